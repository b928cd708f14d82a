"""The form of a published table, `published/data/*.toml`: one publication, numbers as printed.

`[[curve]]`, `[[coupled]]`, `[[rhythm]]` and `[[range]]` are its rows; `[defaults]` stands in for
keys that a row leaves out. Units, senses and ranges are named beside the numbers and turned here
into radians, N m, and torques on the child in the sense of our angles.
"""

import tomllib
from collections.abc import Iterable, Mapping
from math import inf, radians
from typing import Any, cast

from springs.coupled import CoupledExponential, CoupledTerm
from springs.elastic import Range
from springs.published.formulas import ANGLE_UNITS, FORMULAS, MOMENT_UNITS, Printed
from springs.published.reference import Reference, Sureness
from springs.published.rows import Coupled, Curve, MotionRange, Publication, Rhythm
from springs.published.shoulder_rhythm import BoneAngle, Lines, Readings, Regression

_SAID = ("reference", "doi", "sureness", "place", "note", "formula", "convention")
_KEYS = {
    "curve": (
        *("name", "motion", "coefficients", "points", "dead_zone", "angle_unit", "moment_unit"),
        *("angle_sign", "moment_sign", "measured_deg", "usable_deg", "held_deg"),
        "damping_Nms_rad",
    ),
    "coupled": (
        *("name", "coordinates", "turned", "term", "constants", "angle_unit"),
        *("measured_deg", "usable_deg"),
    ),
    "rhythm": ("name", "bone", "plane", "coefficients", "points_deg", "lines_deg", "minus_deg"),
    "range": ("motion", "deg", "at_least", "deviation_deg", "moment_Nm", "age"),
}
_MUSCLES = "M = -gradient of sum of exp(rates . angles - |first rate| slack)/|first rate|"
_SUM = "M = constant + sum of sign exp(c + hip h + knee k + ankle a)"
_REGRESSION = ("c", "y", "z", "r", "rest")


class PublishedError(ValueError):
    """A published table that does not exist, or that cannot be read."""


def parse_publication(text: str, name: str = "<text>") -> Publication:
    """The publication that `text` describes; `name` is what errors call it.

    Raises:
        PublishedError: for a text that is no TOML, and for a row that cannot be read.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as failure:
        raise PublishedError(f"{name}: this is no TOML: {failure}") from failure
    file = _Row(name, document)
    defaults = file.table("defaults")
    head = {key: document[key] for key in _SAID if key in document}
    whole = _Row(name, head)
    whole.refuse_unknown({*document} - {"defaults", *_KEYS}, _SAID)

    def rows(kind: str) -> Iterable[_Row]:
        for content in file.tables(kind):
            label = content.get("name", content.get("motion", ""))
            row = _Row(
                f"{name}, {kind} {label}".strip(), {**head, "note": "", **defaults, **content}
            )
            row.refuse_unknown(content, (*_KEYS[kind], *_SAID))
            yield row

    return Publication(
        name,
        whole.reference(),
        whole.text("note", ""),
        {row.text("name"): _curve(row) for row in rows("curve")},
        {row.text("name"): _coupled(row) for row in rows("coupled")},
        {row.text("name"): _rhythm(row) for row in rows("rhythm")},
        tuple(_motion_range(row) for row in rows("range")),
    )


class _Row:
    """The keys of one row, each asked for by the kind of its value."""

    def __init__(self, label: str, content: Mapping[str, Any]) -> None:
        self.label = label
        self.content = content

    def fault(self, message: str) -> PublishedError:
        return PublishedError(f"{self.label}: {message}")

    def refuse_unknown(self, keys: Iterable[str], known: Iterable[str]) -> None:
        unknown = sorted(set(keys) - set(known))
        if unknown:
            raise self.fault(f"unknown key `{unknown[0]}`; known are {', '.join(known)}")

    def text(self, key: str, otherwise: str | None = None) -> str:
        value = self.content.get(key, otherwise)
        if not isinstance(value, str):
            raise self.fault(f"`{key}` is a text")
        return value

    def number(self, key: str, otherwise: float | None = None) -> float:
        return self._number(key, self.content.get(key, otherwise))

    def optional(self, key: str) -> float | None:
        return self.number(key) if key in self.content else None

    def numbers(self, key: str) -> dict[str, float]:
        """A table of numbers by name; empty where it is left out."""
        table = self.table(key)
        return {name: self._number(f"{key}.{name}", one) for name, one in table.items()}

    def table(self, key: str) -> dict[str, Any]:
        value = self.content.get(key, {})
        if not isinstance(value, dict):
            raise self.fault(f"`{key}` is a table")
        return cast("dict[str, Any]", value)

    def tables(self, key: str) -> list[dict[str, Any]]:
        values = self.items(key)
        if not all(isinstance(value, dict) for value in values):
            raise self.fault(f"`{key}` is a list of tables")
        return cast("list[dict[str, Any]]", values)

    def pairs(self, key: str) -> tuple[tuple[float, float], ...]:
        return tuple(self._pair(key, one) for one in self.items(key))

    def items(self, key: str) -> list[Any]:
        value = self.content.get(key, [])
        if not isinstance(value, list):
            raise self.fault(f"`{key}` is a list")
        return cast("list[Any]", value)

    def pair(self, key: str) -> Range | None:
        return self._pair(key, self.content[key]) if key in self.content else None

    def one_of(self, key: str, known: Mapping[str, Any], otherwise: str | None = None) -> str:
        value = self.text(key, otherwise)
        if value not in known:
            raise self.fault(f"unknown {key} `{value}`; known are {', '.join(known)}")
        return value

    def exactly(self, key: str, names: Iterable[str]) -> dict[str, float]:
        """A table of numbers with just these names."""
        found = self.numbers(key)
        if set(found) != set(names):
            raise self.fault(f"`{key}` has the names {', '.join(names) or 'none'}")
        return found

    def sign(self, key: str) -> int:
        value = self.number(key, 1.0)
        if value not in (-1.0, 1.0):
            raise self.fault(f"`{key}` is +1 or -1")
        return int(value)

    def reference(self) -> Reference:
        sureness = self.one_of("sureness", {kind.value: kind for kind in Sureness})
        return Reference(
            self.text("reference"), Sureness(sureness), self.text("doi", ""), self.text("place", "")
        )

    def range_key(self) -> str:
        """Which of the two keys says in which range the row holds."""
        if "measured_deg" in self.content and "usable_deg" in self.content:
            raise self.fault("a range is measured or usable, not both")
        return "measured_deg" if "measured_deg" in self.content else "usable_deg"

    def _number(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.fault(f"`{key}` is a number")
        return float(value)

    def _pair(self, key: str, value: Any) -> tuple[float, float]:
        if not isinstance(value, list) or len(cast("list[Any]", value)) != 2:
            raise self.fault(f"`{key}` holds pairs of numbers")
        first, second = cast("list[Any]", value)
        return self._number(key, first), self._number(key, second)


def _radians(pair: Range | None) -> Range | None:
    return pair and (radians(pair[0]), radians(pair[1]))


def _curve(row: _Row) -> Curve:
    formula = row.one_of("formula", FORMULAS)
    angle = ANGLE_UNITS[row.one_of("angle_unit", ANGLE_UNITS)]
    moment = MOMENT_UNITS[row.one_of("moment_unit", MOMENT_UNITS)]
    points = row.pairs("points")
    known = _radians(row.pair(row.range_key()))
    if points:
        known = (points[0][0] * angle, points[-1][0] * angle)
    printed = Printed(
        row.exactly("coefficients", FORMULAS[formula].names),
        points,
        row.pair("dead_zone"),
        angle,
        moment,
        known,
    )
    made = Curve(
        name=row.text("name"),
        motion=row.text("motion"),
        formula=formula,
        printed=printed,
        reference=row.reference(),
        convention=row.text("convention", ""),
        angle_sign=row.sign("angle_sign"),
        moment_sign=row.sign("moment_sign"),
        range_is_measured=bool(points) or "measured_deg" in row.content,
        held={name: radians(angle) for name, angle in row.numbers("held_deg").items()},
        damping=row.optional("damping_Nms_rad"),
        note=row.text("note"),
    )
    try:
        _ = made.law
    except ValueError as failure:
        raise row.fault(str(failure)) from failure
    return made


def _coupled(row: _Row) -> Coupled:
    coordinates = tuple(map(str, row.items("coordinates")))
    joints = [coordinate.partition(" ")[0] for coordinate in coordinates]
    formula = row.one_of("formula", {_SUM: _sum_term, _MUSCLES: _muscle_term})
    unit = ANGLE_UNITS[row.one_of("angle_unit", ANGLE_UNITS)]
    term = _sum_term if formula == _SUM else _muscle_term
    terms = [
        term(_Row(f"{row.label}, term {number}", content), joints, unit)
        for number, content in enumerate(row.tables("term"), start=1)
    ]
    constants = row.numbers("constants")
    key = row.range_key()
    ranges = _Row(f"{row.label}, {key}", row.table(key))
    against = row.items("turned")
    turned = tuple(c for c, joint in zip(coordinates, joints, strict=True) if joint in against)
    law = CoupledExponential(
        coordinates,
        tuple(terms),
        tuple(constants.get(joint, 0.0) for joint in joints),
        tuple(_radians(ranges.pair(joint)) for joint in joints),
    ).mirrored(*turned)
    return Coupled(
        name=row.text("name"),
        law=law,
        formula=formula,
        reference=row.reference(),
        convention=row.text("convention", ""),
        turned=turned,
        range_is_measured=key == "measured_deg",
        note=row.text("note"),
    )


def _sum_term(row: _Row, joints: list[str], unit: float) -> CoupledTerm:
    """One exponential of one moment (Riener & Edrich)."""
    row.refuse_unknown(row.content, ("moment", "sign", "c", *joints))
    moment, sign = row.one_of("moment", dict.fromkeys(joints)), row.sign("sign")
    return CoupledTerm(
        tuple(float(sign) if joint == moment else 0.0 for joint in joints),
        tuple(row.number(joint, 0.0) / unit for joint in joints),
        row.number("c"),
    )


def _muscle_term(row: _Row, joints: list[str], unit: float) -> CoupledTerm:
    """One muscle, with its moments about all joints that it spans (Silder et al.)."""
    row.refuse_unknown(row.content, ("muscle", "first", "rates", "slack_deg"))
    printed = row.numbers("rates")
    rates = tuple(printed.get(joint, 0.0) / unit for joint in joints)
    first = rates[joints.index(row.one_of("first", dict.fromkeys(joints)))]
    slack = radians(row.number("slack_deg"))
    return CoupledTerm(tuple(-rate / abs(first) for rate in rates), rates, -first * slack)


def _rhythm(row: _Row) -> Rhythm:
    return Rhythm(
        name=row.text("name"),
        bone=row.text("bone"),
        plane=row.text("plane", ""),
        law=_bone_angle(row),
        reference=row.reference(),
        note=row.text("note"),
    )


def _bone_angle(row: _Row) -> BoneAngle:
    """A regression, straight pieces, or points: what the row has."""
    if "coefficients" in row.content:
        n = row.exactly("coefficients", _REGRESSION)
        return Regression(radians(n["c"]), n["y"], n["z"], n["r"], radians(n["rest"]))
    if "lines_deg" in row.content:
        minus = row.number("minus_deg", 0.0)
        pieces: list[tuple[float, float, float]] = []
        for content in row.tables("lines_deg"):
            line = _Row(f"{row.label}, lines_deg", content)
            line.refuse_unknown(content, ("to", "slope", "at_zero"))
            zero = radians(line.number("at_zero") - minus)
            pieces.append((radians(line.number("to", inf)), line.number("slope"), zero))
        return Lines(tuple(pieces))
    if "points_deg" in row.content:
        return Readings(tuple((radians(x), radians(y)) for x, y in row.pairs("points_deg")))
    raise row.fault("a rhythm has `coefficients`, `lines_deg` or `points_deg`")


def _motion_range(row: _Row) -> MotionRange:
    deviation = row.optional("deviation_deg")
    return MotionRange(
        motion=row.text("motion"),
        limit=radians(row.number("deg")),
        reference=row.reference(),
        at_least=bool(row.content.get("at_least", False)),
        deviation=None if deviation is None else radians(deviation),
        moment=row.optional("moment_Nm"),
        age=row.optional("age"),
    )
