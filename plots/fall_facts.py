"""Facts of falls by people and dummies (`plots/data/fall_facts.toml`), a row each."""

import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from enum import StrEnum
from functools import cache
from importlib.resources import files
from math import isfinite
from typing import Any, cast

from springs.published.reference import Sureness


class FallFactError(ValueError):
    """A row of the file is wrong; the sentence names the row."""


class Use(StrEnum):
    """Use of a fact: it chose a parameter, or tests what it did not choose."""

    SETS = "sets"
    TESTS = "tests"


class Falls(StrEnum):
    """Falls that are judged: of awake people, or of limp ones and dummies."""

    AWAKE = "awake"
    LIMP = "limp"


class Direction(StrEnum):
    """Sector of the direction of a fall."""

    FORWARD = "forward"
    SIDEWAYS = "sideways"
    BACKWARD = "backward"


class Rule(StrEnum):
    """Rule by which a row is judged; see `plots.fall_verdicts`."""

    MEAN = "mean"
    SHARE = "share"
    ODDS = "odds"
    RATIO = "ratio"
    INTERVAL = "interval"
    VALUE = "value"
    ENDS = "ends"


class Group(StrEnum):
    """Rows that share an axis."""

    SPEEDS = "speed at the first touch"
    TIMES = "time"
    SHARES = "share of falls"
    RATIOS = "ratio of two directions"
    HIPS = "force on pelvis and buttocks"
    HEAD_FORCES = "force on the head"
    HEAD_ACCELERATIONS = "acceleration of the head's centre of mass"


@dataclass(frozen=True)
class Quantity:
    """A number of a fall, or of several.

    Attributes:
        unit: Unit in which it is compared.
        factor: Factor from the number of the program, `mover simulate --fall --starts --json`.
        group: Rows beside which it is drawn.
    """

    unit: str
    factor: float
    group: Group


QUANTITIES: Mapping[str, Quantity] = {
    **{
        f"{part}_speed_m_per_s": Quantity("m/s", 1.0, Group.SPEEDS)
        for part in ("pelvis", "head", "hand")
    },
    **{name: Quantity("ms", 1.0, Group.TIMES) for name in ("descent_ms", "hand_lead_ms")},
    **{
        f"{part}_hit_share": Quantity("%", 100.0, Group.SHARES)
        for part in ("head", "hand", "pelvis")
    },
    **{name: Quantity("kN", 1e-3, Group.HIPS) for name in ("hip_force_N", "floor_force_N")},
    **{
        name: Quantity("kN", 1e-3, Group.HEAD_FORCES)
        for name in ("head_force_N", "single_head_force_N")
    },
    **{
        name: Quantity("g", 1.0, Group.HEAD_ACCELERATIONS)
        for name in ("head_acceleration_g", "single_head_acceleration_g")
    },
}
"""Quantities by name: keys of `falls` in the JSON of many falls, and three of other runs."""

RATIO_UNIT = "1"

_OF_DIRECTIONS = (Rule.ODDS, Rule.RATIO)

_NEEDED: Mapping[Rule, Collection[str]] = {
    Rule.MEAN: ("mean",),
    Rule.SHARE: ("low", "high"),
    Rule.ODDS: ("mean", "low", "high", "directions"),
    Rule.RATIO: ("mean", "directions"),
    Rule.INTERVAL: ("low", "high"),
    Rule.VALUE: ("mean", "floor_kN_m"),
    Rule.ENDS: ("low", "high"),
}
"""Keys that a row with a rule has."""

_ALLOWED: Mapping[Rule, Collection[str]] = {
    Rule.MEAN: ("sd", "n", "direction"),
    Rule.SHARE: ("direction",),
    Rule.INTERVAL: ("direction",),
}
"""Keys that it may have beside."""


@dataclass(frozen=True)
class FallSource:
    """Publication of facts.

    Attributes:
        key: Name in the file.
        reference: Authors, journal, year, and what was measured.
    """

    key: str
    reference: str


@dataclass(frozen=True)
class FallFact:
    """A fact of falls with what it is compared with.

    Attributes:
        key: Name in the file.
        name: Quantity in words.
        quantity: Name of the number that is compared, one of `QUANTITIES`.
        unit: Unit of the numbers.
        falls: Falls that are judged.
        rule: Rule by which they are.
        source: Publication.
        sureness: Verification of the numbers.
        use: Use of the fact.
        parameter: Parameter that it chose; "" for a test.
        mean: Mean, or single value; None without.
        sd: Standard deviation between people; None if unknown.
        n: Number of people or falls of which it is; None if unknown.
        low: Lower end; None without.
        high: Upper end; None without.
        direction: Direction of the falls that are compared; None for all.
        directions: Two directions of a ratio, of the dividend and the divisor.
        floor: Stiffness of the floor; None for a hard one [kN/m].
    """

    key: str
    name: str
    quantity: str
    unit: str
    falls: Falls
    rule: Rule
    source: FallSource
    sureness: Sureness
    use: Use
    parameter: str = ""
    mean: float | None = None
    sd: float | None = None
    n: int | None = None
    low: float | None = None
    high: float | None = None
    direction: Direction | None = None
    directions: tuple[Direction, Direction] | None = None
    floor: float | None = None

    @property
    def group(self) -> Group:
        """Rows beside which it is drawn."""
        if self.rule in _OF_DIRECTIONS:
            return Group.RATIOS
        return QUANTITIES[self.quantity].group

    @property
    def span(self) -> tuple[float, float]:
        """The ends that are drawn: `low` and `high`, or one standard deviation about the mean."""
        if self.low is not None and self.high is not None:
            return self.low, self.high
        assert self.mean is not None
        spread = self.sd or 0.0
        return self.mean - spread, self.mean + spread

    @property
    def value_text(self) -> str:
        """The numbers with their unit: `2.14 (0.63) m/s, n 25`."""
        number = self._span_text if self.mean is None else f"{self.mean:g}"
        if self.sd is not None:
            number += f" ({self.sd:g})"
        if self.mean is not None and self.low is not None:
            number += f" ({self._span_text})"
        unit = "" if self.unit == RATIO_UNIT else f" {self.unit}"
        return f"{number}{unit}" + ("" if self.n is None else f", n {self.n}")

    @property
    def _span_text(self) -> str:
        return f"{self.low:g}" if self.low == self.high else f"{self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class FallFacts:
    """All facts of the file, in its order."""

    facts: Sequence[FallFact]

    def __getitem__(self, key: str) -> FallFact:
        """Return a fact. Raises KeyError."""
        return {fact.key: fact for fact in self.facts}[key]

    @property
    def sources(self) -> list[FallSource]:
        """The sources in the order of the facts."""
        return list(dict.fromkeys(fact.source for fact in self.facts))

    def source_number(self, fact: FallFact) -> int:
        """Number of the source of a fact, from 1 on."""
        return self.sources.index(fact.source) + 1

    def grouped(self) -> dict[Group, list[FallFact]]:
        """The facts of each group."""
        groups: dict[Group, list[FallFact]] = {group: [] for group in Group}
        for fact in self.facts:
            groups[fact.group].append(fact)
        return {group: some for group, some in groups.items() if some}


@cache
def fall_facts() -> FallFacts:
    """Read the shipped facts."""
    text = files("plots").joinpath("data/fall_facts.toml").read_text(encoding="utf-8")
    return parse_fall_facts(tomllib.loads(text))


def parse_fall_facts(data: Mapping[str, Any]) -> FallFacts:
    """Read the facts of a parsed file.

    Raises FallFactError for a row that is wrong.
    """
    _check_keys("the file", data, ("source", "fact"), ())
    sources: dict[str, FallSource] = {}
    for key, row in data["source"].items():
        name = f"source `{key}`"
        _check_keys(name, row, ("reference",), ())
        sources[key] = FallSource(key, _text(name, row, "reference"))
    facts = [_fact(number, row, sources) for number, row in enumerate(data["fact"], start=1)]
    keys = [fact.key for fact in facts]
    for number, key in enumerate(keys, start=1):
        if key in keys[: number - 1]:
            raise FallFactError(f"fact {number}: `{key}` is the key of another fact as well")
    unused = sources.keys() - {fact.source.key for fact in facts}
    if unused:
        raise FallFactError(f"source `{min(unused)}`: no fact has it")
    return FallFacts(tuple(facts))


_TEXTS = ("key", "name", "quantity", "unit", "source", "falls", "rule", "sureness", "use")
_OPTIONAL = tuple(field.name for field in fields(FallFact) if field.default is not MISSING)
_FILE_NAMES = {"floor": "floor_kN_m"}
"""Keys in the file of fields with another name."""

_CHOICES: Mapping[str, type[StrEnum]] = {
    "falls": Falls,
    "rule": Rule,
    "sureness": Sureness,
    "use": Use,
    "direction": Direction,
}


def _fact(number: int, row: Mapping[str, Any], sources: Mapping[str, FallSource]) -> FallFact:
    """Return the fact of a row. Raises FallFactError."""
    key = row.get("key")
    name = f"fact {number} (`{key}`)" if isinstance(key, str) else f"fact {number}"
    optional = [_FILE_NAMES.get(one, one) for one in _OPTIONAL]
    _check_keys(name, row, _TEXTS, optional)
    values: dict[str, Any] = {key: _text(name, row, key) for key in _TEXTS}
    for key in _CHOICES.keys() & row.keys():
        values[key] = _choice(name, key, row[key])
    values["source"] = _known(name, "source", values["source"], sources)
    for field in ("mean", "sd", "low", "high", "floor"):
        if (key := _FILE_NAMES.get(field, field)) in row:
            values[field] = _number(name, key, row[key])
    if "n" in row:
        values["n"] = _count(name, row["n"])
    if "directions" in row:
        values["directions"] = _directions(name, row["directions"])
    if "parameter" in row:
        values["parameter"] = _text(name, row, "parameter")
    made = FallFact(**values)
    _check_fact(name, made, row)
    return made


def _check_fact(name: str, fact: FallFact, row: Mapping[str, Any]) -> None:
    """Check what a row says as a whole. Raises FallFactError."""
    quantity = _known(name, "quantity", fact.quantity, QUANTITIES)
    unit = RATIO_UNIT if fact.rule in _OF_DIRECTIONS else quantity.unit
    if fact.unit != unit:
        raise FallFactError(f"{name}: unit is `{fact.unit}`, but its numbers are in `{unit}`")
    numbers = ("mean", "sd", "n", "low", "high", "direction", "directions", "floor_kN_m")
    needed, allowed = _NEEDED[fact.rule], _ALLOWED.get(fact.rule, ())
    for key in numbers:
        if key in needed and key not in row:
            raise FallFactError(f"{name}: rule `{fact.rule}` needs `{key}`")
        if key in row and key not in (*needed, *allowed):
            raise FallFactError(f"{name}: rule `{fact.rule}` has no use for `{key}`")
    for key, value in (("sd", fact.sd), ("floor_kN_m", fact.floor)):
        if value is not None and not value > 0.0:
            raise FallFactError(f"{name}: {key} must be positive, not {value:g}")
    if fact.n is not None and fact.sd is None:
        raise FallFactError(f"{name}: `n` without `sd`")
    if fact.low is not None and fact.high is not None:
        middle = fact.low if fact.mean is None else fact.mean
        if not fact.low <= middle <= fact.high:
            ends = f"{fact.low:g} to {fact.high:g}"
            raise FallFactError(f"{name}: nothing, or not its mean, is within {ends}")
    if fact.rule in _OF_DIRECTIONS and not (fact.low or fact.mean or 0.0) > 0.0:
        raise FallFactError(f"{name}: a ratio is positive")
    if (fact.use is Use.SETS) != bool(fact.parameter):
        raise FallFactError(f"{name}: what sets a parameter names it, and a test has none")


def _check_keys(name: str, row: Any, needed: Collection[str], optional: Collection[str]) -> None:
    if not isinstance(row, Mapping):
        raise FallFactError(f"{name}: a table is needed, not {row!r}")
    keys = [str(key) for key in cast("Mapping[str, Any]", row)]
    for key in needed:
        if key not in keys:
            raise FallFactError(f"{name}: `{key}` is missing")
    for key in keys:
        if key not in needed and key not in optional:
            raise FallFactError(f"{name}: unknown key `{key}`")


def _text(name: str, row: Mapping[str, Any], key: str) -> str:
    value = row[key]
    if not isinstance(value, str) or not value.strip():
        raise FallFactError(f"{name}: {key} must be a text, not {value!r}")
    return value


def _number(name: str, key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise FallFactError(f"{name}: {key} must be a finite number, not {value!r}")
    return float(value)


def _count(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 2:
        raise FallFactError(f"{name}: n must be an integer from 2 on, not {value!r}")
    return value


def _choice(name: str, key: str, value: Any) -> StrEnum:
    choices = [str(one) for one in _CHOICES[key]]
    if value not in choices:
        raise FallFactError(f"{name}: {key} is one of {', '.join(choices)}, not {value!r}")
    return _CHOICES[key](value)


def _directions(name: str, value: Any) -> tuple[Direction, Direction]:
    if not isinstance(value, list) or len(pair := [*value]) != 2 or pair[0] == pair[1]:  # pyright: ignore
        raise FallFactError(f"{name}: directions are two different ones, not {value!r}")
    first, second = (_choice(name, "direction", one) for one in pair)  # pyright: ignore
    return Direction(first), Direction(second)


def _known(name: str, key: str, value: str, known: Mapping[str, Any]) -> Any:
    if value not in known:
        raise FallFactError(f"{name}: unknown {key} `{value}`")
    return known[value]
