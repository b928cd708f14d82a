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
from springs.published.formulas import ANGLE_UNITS, FORMULAS, MOMENT_UNITS, PrintedCurve
from springs.published.reference import Reference, Sureness
from springs.published.rows import (
    MotionRange,
    Publication,
    PublishedCoupledLaw,
    PublishedCurve,
    PublishedRhythm,
)
from springs.published.shoulder_rhythm import (
    BoneAngle,
    DigitisedPoints,
    PiecewiseLinear,
    Regression,
)

_SHARED_KEYS = ("reference", "doi", "sureness", "place", "note", "formula", "convention")
_ROW_KEYS = {
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
_MUSCLE_FORMULA = "M = -gradient of sum of exp(rates . angles - |first rate| slack)/|first rate|"
_SUM_FORMULA = "M = constant + sum of sign exp(c + hip h + knee k + ankle a)"
_REGRESSION_NAMES = ("c", "y", "z", "r", "rest")


class PublishedError(ValueError):
    """A published table that does not exist, or that cannot be read."""


def parse_publication(text: str, name: str = "<text>") -> Publication:
    """Parse a publication; `name` is what errors call it.

    Raises:
        PublishedError: for a text that is not TOML, and for a row that cannot be read.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as failure:
        raise PublishedError(f"{name}: this is not TOML: {failure}") from failure
    file = _TableRow(name, document)
    defaults = file.table("defaults")
    head = {key: document[key] for key in _SHARED_KEYS if key in document}
    whole = _TableRow(name, head)
    whole.check_keys({*document} - {"defaults", *_ROW_KEYS}, _SHARED_KEYS)

    def rows(kind: str) -> Iterable[_TableRow]:
        for content in file.tables(kind):
            label = content.get("name", content.get("motion", ""))
            row = _TableRow(
                f"{name}, {kind} {label}".strip(), {**head, "note": "", **defaults, **content}
            )
            row.check_keys(content, (*_ROW_KEYS[kind], *_SHARED_KEYS))
            yield row

    return Publication(
        name,
        whole.reference(),
        whole.text("note", ""),
        {row.text("name"): _parse_curve(row) for row in rows("curve")},
        {row.text("name"): _parse_coupled_law(row) for row in rows("coupled")},
        {row.text("name"): _parse_rhythm(row) for row in rows("rhythm")},
        tuple(_parse_motion_range(row) for row in rows("range")),
    )


class _TableRow:
    """The keys of one row, each asked for by the kind of its value."""

    def __init__(self, label: str, content: Mapping[str, Any]) -> None:
        self.label = label
        self.content = content

    def error(self, message: str) -> PublishedError:
        return PublishedError(f"{self.label}: {message}")

    def check_keys(self, keys: Iterable[str], known: Iterable[str]) -> None:
        unknown = sorted(set(keys) - set(known))
        if unknown:
            raise self.error(f"unknown key `{unknown[0]}`; known are {', '.join(known)}")

    def text(self, key: str, default: str | None = None) -> str:
        value = self.content.get(key, default)
        if not isinstance(value, str):
            raise self.error(f"`{key}` is a text")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        return self._number(key, self.content.get(key, default))

    def optional_number(self, key: str) -> float | None:
        return self.number(key) if key in self.content else None

    def numbers(self, key: str) -> dict[str, float]:
        """A table of numbers by name; empty where it is left out."""
        table = self.table(key)
        return {name: self._number(f"{key}.{name}", one) for name, one in table.items()}

    def table(self, key: str) -> dict[str, Any]:
        value = self.content.get(key, {})
        if not isinstance(value, dict):
            raise self.error(f"`{key}` is a table")
        return cast("dict[str, Any]", value)

    def tables(self, key: str) -> list[dict[str, Any]]:
        values = self.items(key)
        if not all(isinstance(value, dict) for value in values):
            raise self.error(f"`{key}` is a list of tables")
        return cast("list[dict[str, Any]]", values)

    def pairs(self, key: str) -> tuple[tuple[float, float], ...]:
        return tuple(self._pair(key, one) for one in self.items(key))

    def items(self, key: str) -> list[Any]:
        value = self.content.get(key, [])
        if not isinstance(value, list):
            raise self.error(f"`{key}` is a list")
        return cast("list[Any]", value)

    def optional_pair(self, key: str) -> Range | None:
        return self._pair(key, self.content[key]) if key in self.content else None

    def choice(self, key: str, known: Mapping[str, Any], default: str | None = None) -> str:
        value = self.text(key, default)
        if value not in known:
            raise self.error(f"unknown {key} `{value}`; known are {', '.join(known)}")
        return value

    def numbers_named(self, key: str, names: Iterable[str]) -> dict[str, float]:
        """A table of numbers with just these names."""
        found = self.numbers(key)
        if set(found) != set(names):
            raise self.error(f"`{key}` has the names {', '.join(names) or 'none'}")
        return found

    def sign(self, key: str) -> int:
        value = self.number(key, 1.0)
        if value not in (-1.0, 1.0):
            raise self.error(f"`{key}` is +1 or -1")
        return int(value)

    def reference(self) -> Reference:
        sureness = self.choice("sureness", {kind.value: kind for kind in Sureness})
        return Reference(
            self.text("reference"), Sureness(sureness), self.text("doi", ""), self.text("place", "")
        )

    def range_key(self) -> str:
        """Key of the range in which the row is valid."""
        if "measured_deg" in self.content and "usable_deg" in self.content:
            raise self.error("a range is measured or usable, not both")
        return "measured_deg" if "measured_deg" in self.content else "usable_deg"

    def _number(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(f"`{key}` is a number")
        return float(value)

    def _pair(self, key: str, value: Any) -> tuple[float, float]:
        if not isinstance(value, list) or len(cast("list[Any]", value)) != 2:
            raise self.error(f"`{key}` holds pairs of numbers")
        first, second = cast("list[Any]", value)
        return self._number(key, first), self._number(key, second)


def _range_in_radians(pair: Range | None) -> Range | None:
    return pair and (radians(pair[0]), radians(pair[1]))


def _parse_curve(row: _TableRow) -> PublishedCurve:
    formula = row.choice("formula", FORMULAS)
    angle = ANGLE_UNITS[row.choice("angle_unit", ANGLE_UNITS)]
    moment = MOMENT_UNITS[row.choice("moment_unit", MOMENT_UNITS)]
    points = row.pairs("points")
    known = _range_in_radians(row.optional_pair(row.range_key()))
    if points:
        known = (points[0][0] * angle, points[-1][0] * angle)
    printed = PrintedCurve(
        row.numbers_named("coefficients", FORMULAS[formula].coefficient_names),
        points,
        row.optional_pair("dead_zone"),
        angle,
        moment,
        known,
    )
    made = PublishedCurve(
        name=row.text("name"),
        motion=row.text("motion"),
        formula=formula,
        printed=printed,
        reference=row.reference(),
        convention=row.text("convention", ""),
        angle_sign=row.sign("angle_sign"),
        moment_sign=row.sign("moment_sign"),
        range_is_measured=bool(points) or "measured_deg" in row.content,
        held_angles={name: radians(angle) for name, angle in row.numbers("held_deg").items()},
        damping=row.optional_number("damping_Nms_rad"),
        note=row.text("note"),
    )
    try:
        _ = made.law
    except ValueError as failure:
        raise row.error(str(failure)) from failure
    return made


def _parse_coupled_law(row: _TableRow) -> PublishedCoupledLaw:
    coordinates = tuple(map(str, row.items("coordinates")))
    joints = [coordinate.partition(" ")[0] for coordinate in coordinates]
    formula = row.choice(
        "formula", {_SUM_FORMULA: _parse_sum_term, _MUSCLE_FORMULA: _parse_muscle_term}
    )
    unit = ANGLE_UNITS[row.choice("angle_unit", ANGLE_UNITS)]
    term = _parse_sum_term if formula == _SUM_FORMULA else _parse_muscle_term
    terms = [
        term(_TableRow(f"{row.label}, term {number}", content), joints, unit)
        for number, content in enumerate(row.tables("term"), start=1)
    ]
    constants = row.numbers("constants")
    key = row.range_key()
    ranges = _TableRow(f"{row.label}, {key}", row.table(key))
    against = row.items("turned")
    turned = tuple(c for c, joint in zip(coordinates, joints, strict=True) if joint in against)
    law = CoupledExponential(
        coordinates,
        tuple(terms),
        tuple(constants.get(joint, 0.0) for joint in joints),
        tuple(_range_in_radians(ranges.optional_pair(joint)) for joint in joints),
    ).mirrored(*turned)
    return PublishedCoupledLaw(
        name=row.text("name"),
        law=law,
        formula=formula,
        reference=row.reference(),
        convention=row.text("convention", ""),
        reversed_coordinates=turned,
        range_is_measured=key == "measured_deg",
        note=row.text("note"),
    )


def _parse_sum_term(row: _TableRow, joints: list[str], unit: float) -> CoupledTerm:
    """One exponential of one moment (Riener & Edrich)."""
    row.check_keys(row.content, ("moment", "sign", "c", *joints))
    moment, sign = row.choice("moment", dict.fromkeys(joints)), row.sign("sign")
    return CoupledTerm(
        tuple(float(sign) if joint == moment else 0.0 for joint in joints),
        tuple(row.number(joint, 0.0) / unit for joint in joints),
        row.number("c"),
    )


def _parse_muscle_term(row: _TableRow, joints: list[str], unit: float) -> CoupledTerm:
    """One muscle, with its moments about all joints that it spans (Silder et al.)."""
    row.check_keys(row.content, ("muscle", "first", "rates", "slack_deg"))
    printed = row.numbers("rates")
    rates = tuple(printed.get(joint, 0.0) / unit for joint in joints)
    first = rates[joints.index(row.choice("first", dict.fromkeys(joints)))]
    slack = radians(row.number("slack_deg"))
    return CoupledTerm(tuple(-rate / abs(first) for rate in rates), rates, -first * slack)


def _parse_rhythm(row: _TableRow) -> PublishedRhythm:
    return PublishedRhythm(
        name=row.text("name"),
        bone=row.text("bone"),
        plane=row.text("plane", ""),
        law=_parse_bone_angle(row),
        reference=row.reference(),
        note=row.text("note"),
    )


def _parse_bone_angle(row: _TableRow) -> BoneAngle:
    """A regression, straight pieces, or points: what the row has."""
    if "coefficients" in row.content:
        n = row.numbers_named("coefficients", _REGRESSION_NAMES)
        return Regression(radians(n["c"]), n["y"], n["z"], n["r"], radians(n["rest"]))
    if "lines_deg" in row.content:
        minus = row.number("minus_deg", 0.0)
        pieces: list[tuple[float, float, float]] = []
        for content in row.tables("lines_deg"):
            line = _TableRow(f"{row.label}, lines_deg", content)
            line.check_keys(content, ("to", "slope", "at_zero"))
            zero = radians(line.number("at_zero") - minus)
            pieces.append((radians(line.number("to", inf)), line.number("slope"), zero))
        return PiecewiseLinear(tuple(pieces))
    if "points_deg" in row.content:
        return DigitisedPoints(tuple((radians(x), radians(y)) for x, y in row.pairs("points_deg")))
    raise row.error("a rhythm has `coefficients`, `lines_deg` or `points_deg`")


def _parse_motion_range(row: _TableRow) -> MotionRange:
    deviation = row.optional_number("deviation_deg")
    return MotionRange(
        motion=row.text("motion"),
        limit=radians(row.number("deg")),
        reference=row.reference(),
        at_least=bool(row.content.get("at_least", False)),
        deviation=None if deviation is None else radians(deviation),
        moment=row.optional_number("moment_Nm"),
        age=row.optional_number("age"),
    )
