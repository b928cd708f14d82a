"""Facts of falls by people and dummies (`plots/data/fall_facts.toml`), a row each."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files
from typing import Any

from springs.published.reference import Sureness


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


_PARTS = ("pelvis", "head", "hand")
_ACCELERATIONS = ["head_acceleration_g", "single_head_acceleration_g"]
QUANTITIES: Mapping[str, Quantity] = {
    name: Quantity(unit, factor, group)
    for unit, factor, group, names in (
        ("m/s", 1.0, Group.SPEEDS, [f"{part}_speed_m_per_s" for part in _PARTS]),
        ("ms", 1.0, Group.TIMES, ["descent_ms", "hand_lead_ms"]),
        ("%", 100.0, Group.SHARES, [f"{part}_hit_share" for part in _PARTS]),
        ("kN", 1e-3, Group.HIPS, ["hip_force_N", "floor_force_N"]),
        ("kN", 1e-3, Group.HEAD_FORCES, ["head_force_N", "single_head_force_N"]),
        ("g", 1.0, Group.HEAD_ACCELERATIONS, _ACCELERATIONS),
    )
    for name in names
}
"""Quantities by name: keys of `falls` in the JSON of many falls, and three of other runs."""

RATIO_UNIT = "1"

_OF_DIRECTIONS = (Rule.ODDS, Rule.RATIO)


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

    def __post_init__(self) -> None:
        """Raise ValueError for a fact whose parts contradict each other."""
        unit = RATIO_UNIT if self.rule in _OF_DIRECTIONS else QUANTITIES[self.quantity].unit
        if self.unit != unit:
            raise ValueError(f"{self.key}: its numbers are in `{unit}`, not in `{self.unit}`")
        low, high = self.span
        if not low <= (low if self.mean is None else self.mean) <= high:
            raise ValueError(f"{self.key}: its mean is not within {low:g} to {high:g}")
        if (self.use is Use.SETS) != bool(self.parameter):
            raise ValueError(f"{self.key}: what sets a parameter names it, and a test has none")

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
    """Read the facts of a parsed file. Raises KeyError, TypeError and ValueError."""
    sources = {key: FallSource(key, row["reference"]) for key, row in data["source"].items()}
    facts = tuple(_fact(row, sources) for row in data["fact"])
    if len({fact.key for fact in facts}) != len(facts):
        raise ValueError("two facts have the same key")
    return FallFacts(facts)


_CHOICES: Mapping[str, type[StrEnum]] = {
    "falls": Falls,
    "rule": Rule,
    "sureness": Sureness,
    "use": Use,
    "direction": Direction,
}


def _fact(row: Mapping[str, Any], sources: Mapping[str, FallSource]) -> FallFact:
    values: dict[str, Any] = {
        key: _CHOICES[key](cell) if key in _CHOICES else cell for key, cell in row.items()
    }
    values["source"] = sources[row["source"]]
    if "directions" in row:
        values["directions"] = tuple(map(Direction, row["directions"]))
    floor = values.pop("floor_kN_m", None)
    return FallFact(**values, floor=floor)
