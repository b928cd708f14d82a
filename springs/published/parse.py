"""The form of a published table, `published/data/*.toml`: one publication, numbers as printed.

`[[curve]]`, `[[coupled]]`, `[[rhythm]]` and `[[range]]` are its rows; `[defaults]` stands in for
keys that a row leaves out. Units, senses and ranges are named beside the numbers and turned here
into radians, N m, and torques on the child in the sense of our angles.

The tables are our own: misspelt and missing keys are reported, types of values are not checked.
"""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from math import inf, radians
from typing import Any, TypeVar

from springs.coupled import CoupledExponential, CoupledTerm
from springs.elastic import Range
from springs.published.formulas import ANGLE_UNITS, FORMULAS, MOMENT_UNITS, PrintedCurve
from springs.published.reference import Reference, Sample, SampleKind, Sureness
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

_Row = Mapping[str, Any]
_Parsed = TypeVar("_Parsed")

_SHARED_KEYS = (
    *("reference", "doi", "sureness", "place", "note", "formula", "convention"),
    *("sample", "subjects"),
)
_ROW_KEYS = {
    "curve": (
        *("name", "motion", "coefficients", "points", "dead_zone", "angle_unit", "moment_unit"),
        *("angle_sign", "moment_sign", "measured_deg", "usable_deg", "held_deg"),
        *("damping_Nms_rad", "deviation", "rms_error_Nm"),
    ),
    "coupled": (
        *("name", "coordinates", "turned", "term", "constants", "angle_unit"),
        *("measured_deg", "usable_deg", "tangents"),
    ),
    "rhythm": ("name", "bone", "plane", "coefficients", "points_deg", "lines_deg", "minus_deg"),
    "range": ("motion", "deg", "at_least", "deviation_deg", "moment_Nm", "age"),
}
_REGRESSION_NAMES = ("c", "y", "z", "r", "rest")
_SIGNS = {+1: +1, -1: -1}


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
    head = {key: value for key, value in document.items() if key not in ("defaults", *_ROW_KEYS)}
    all_keys = chain(_SHARED_KEYS, *_ROW_KEYS.values())
    defaults = _parse_row(f"{name}, defaults", document.get("defaults", {}), all_keys, dict)

    def parse_rows(kind: str, parse: Callable[[_Row], _Parsed]) -> list[_Parsed]:
        known, parsed = (*_ROW_KEYS[kind], *_SHARED_KEYS), list[_Parsed]()
        for row in document.get(kind, []):
            label = f"{name}, {kind} {row.get('name', row.get('motion', ''))}".rstrip()
            shared = {key: value for key, value in defaults.items() if key in known}
            parsed.append(_parse_row(label, {**head, "note": "", **shared, **row}, known, parse))
        return parsed

    return Publication(
        name,
        _parse_row(name, head, _SHARED_KEYS, parse_reference),
        head.get("note", ""),
        {row.name: row for row in parse_rows("curve", _parse_curve)},
        {row.name: row for row in parse_rows("coupled", _parse_coupled_law)},
        {row.name: row for row in parse_rows("rhythm", _parse_rhythm)},
        tuple(parse_rows("range", _parse_motion_range)),
    )


def _parse_row(
    label: str, row: _Row, known: Iterable[str], parse: Callable[[_Row], _Parsed]
) -> _Parsed:
    """Parse a row of which the keys are known; errors begin with its label."""
    try:
        _refuse_unknown(row, known)
        return parse(row)
    except KeyError as failure:
        raise PublishedError(f"{label}: there is no `{failure.args[0]}`") from failure
    except ValueError as failure:
        raise PublishedError(f"{label}: {failure}") from failure


def _refuse_unknown(names: Iterable[str], known: Iterable[str]) -> None:
    words = list(known)
    unknown = [name for name in names if name not in words]
    if unknown:
        raise ValueError(f"unknown `{unknown[0]}`; known are {', '.join(words)}")


def parse_reference(row: _Row) -> Reference:
    """Reference of a table with the keys `reference`, `sureness`, `doi` and `place`.

    Raises KeyError for a missing key, ValueError for an unknown sureness.
    """
    return Reference(
        row["reference"], Sureness(row["sureness"]), row.get("doi", ""), row.get("place", "")
    )


def _parse_sample(row: _Row) -> Sample:
    return Sample(SampleKind(row.get("sample", "unknown")), row.get("subjects"))


def _range_key(row: _Row) -> str:
    """Key of the range in which the row is valid."""
    if "measured_deg" in row and "usable_deg" in row:
        raise ValueError("a range is measured or usable, not both")
    return "measured_deg" if "measured_deg" in row else "usable_deg"


def _range_in_radians(pair: Range | None) -> Range | None:
    if pair is None:
        return None
    lower, upper = pair
    return radians(lower), radians(upper)


def _parse_curve(row: _Row) -> PublishedCurve:
    formula, coefficients = row["formula"], row.get("coefficients", {})
    deviation = row.get("deviation", {})
    _refuse_unknown([*coefficients, *deviation], FORMULAS[formula].coefficient_names)
    angle = ANGLE_UNITS[row["angle_unit"]]
    points = tuple((float(x), float(y)) for x, y in row.get("points", ()))
    known = _range_in_radians(row.get(_range_key(row)))
    if points:
        known = (points[0][0] * angle, points[-1][0] * angle)
    moment = MOMENT_UNITS[row["moment_unit"]]
    printed = PrintedCurve(coefficients, points, row.get("dead_zone"), angle, moment, known)
    curve = PublishedCurve(
        name=row["name"],
        motion=row["motion"],
        formula=formula,
        printed=printed,
        reference=parse_reference(row),
        convention=row.get("convention", ""),
        angle_sign=_SIGNS[row.get("angle_sign", 1)],
        moment_sign=_SIGNS[row.get("moment_sign", 1)],
        range_is_measured=bool(points) or "measured_deg" in row,
        held_angles={name: radians(angle) for name, angle in row.get("held_deg", {}).items()},
        damping=row.get("damping_Nms_rad"),
        sample=_parse_sample(row),
        deviation=deviation,
        rms_error=row.get("rms_error_Nm"),
        note=row["note"],
    )
    _ = curve.law  # checks itself when made
    return curve


def _parse_coupled_law(row: _Row) -> PublishedCoupledLaw:
    coordinates = tuple(row["coordinates"])
    joints = [coordinate.partition(" ")[0] for coordinate in coordinates]
    parse_term = _TERM_PARSERS[row["formula"]]
    unit = ANGLE_UNITS[row["angle_unit"]]
    constants, ranges = row.get("constants", {}), row.get(_range_key(row), {})
    against = row.get("turned", [])
    _refuse_unknown([*constants, *ranges, *against], joints)
    turned = tuple(c for c, joint in zip(coordinates, joints, strict=True) if joint in against)
    box = tuple(_range_in_radians(ranges.get(joint)) for joint in joints)
    terms = tuple(parse_term(term, joints, unit) for term in row["term"])
    law = CoupledExponential(
        coordinates,
        tuple(_end_in_box(term, box) for term in terms) if row.get("tangents") else terms,
        tuple(constants.get(joint, 0.0) for joint in joints),
        box,
    ).mirrored(*turned)
    return PublishedCoupledLaw(
        name=row["name"],
        law=law,
        formula=row["formula"],
        reference=parse_reference(row),
        convention=row.get("convention", ""),
        reversed_coordinates=turned,
        range_is_measured="measured_deg" in row,
        sample=_parse_sample(row),
        note=row["note"],
    )


def _parse_sum_term(term: _Row, joints: list[str], unit: float) -> CoupledTerm:
    """One exponential of one moment (Riener & Edrich)."""
    _refuse_unknown(term, ("moment", "sign", "c", *joints))
    moment, sign = term["moment"], float(_SIGNS[term["sign"]])
    _refuse_unknown([moment], joints)
    return CoupledTerm(
        tuple(sign if joint == moment else 0.0 for joint in joints),
        tuple(term.get(joint, 0.0) / unit for joint in joints),
        term["c"],
    )


def _parse_muscle_term(term: _Row, joints: list[str], unit: float) -> CoupledTerm:
    """One muscle, with its moments about all joints that it spans (Silder et al.)."""
    _refuse_unknown(term, ("muscle", "first", "rates", "slack_deg"))
    _refuse_unknown(term["rates"], joints)
    rates = tuple(term["rates"].get(joint, 0.0) / unit for joint in joints)
    first = term["rates"][term["first"]] / unit
    amplitudes = tuple(-rate / abs(first) for rate in rates)
    return CoupledTerm(amplitudes, rates, -first * radians(term["slack_deg"]))


def _parse_energy_term(term: _Row, joints: list[str], unit: float) -> CoupledTerm:
    """One exponential of an energy, with its moments about all joints."""
    _refuse_unknown(term, ("muscle", "ln_V0", "rates"))
    _refuse_unknown(term["rates"], joints)
    rates = tuple(term["rates"].get(joint, 0.0) / unit for joint in joints)
    return CoupledTerm(tuple(-rate + 0.0 for rate in rates), rates, term["ln_V0"])


def _end_in_box(term: CoupledTerm, box: Sequence[Range | None]) -> CoupledTerm:
    """Return a term that continues along its tangent beyond its greatest exponent in a box."""
    parts = [
        max(r * end for end in side or (inf,))
        for r, side in zip(term.rates, box, strict=True)
        if r != 0.0
    ]
    return replace(term, end=term.exponent + sum(parts))


_TERM_PARSERS: Mapping[str, Callable[[_Row, list[str], float], CoupledTerm]] = {
    "M = constant + sum of sign exp(c + hip h + knee k + ankle a)": _parse_sum_term,
    "M = -gradient of sum of exp(rates . angles - |first rate| slack)/|first rate|": (
        _parse_muscle_term
    ),
    "M = -gradient of sum of exp(ln_V0 + rates . angles)": _parse_energy_term,
}


def _parse_rhythm(row: _Row) -> PublishedRhythm:
    law, reference = _parse_bone_angle(row), parse_reference(row)
    plane = row.get("plane", "")
    sample = _parse_sample(row)
    return PublishedRhythm(row["name"], row["bone"], plane, law, reference, sample, row["note"])


def _parse_bone_angle(row: _Row) -> BoneAngle:
    """A regression, straight pieces, or points: what the row has."""
    if "coefficients" in row:
        n = row["coefficients"]
        _refuse_unknown(n, _REGRESSION_NAMES)
        return Regression(radians(n["c"]), n["y"], n["z"], n["r"], radians(n["rest"]))
    if "lines_deg" in row:
        minus = row.get("minus_deg", 0.0)
        pieces: list[tuple[float, float, float]] = []
        for line in row["lines_deg"]:
            _refuse_unknown(line, ("to", "slope", "at_zero"))
            end, zero = radians(line.get("to", inf)), radians(line["at_zero"] - minus)
            pieces.append((end, line["slope"], zero))
        return PiecewiseLinear(tuple(pieces))
    if "points_deg" in row:
        return DigitisedPoints(tuple((radians(x), radians(y)) for x, y in row["points_deg"]))
    raise ValueError("a rhythm has `coefficients`, `lines_deg` or `points_deg`")


def _parse_motion_range(row: _Row) -> MotionRange:
    deviation = row.get("deviation_deg")
    return MotionRange(
        motion=row["motion"],
        limit=radians(row["deg"]),
        reference=parse_reference(row),
        sample=_parse_sample(row),
        at_least=row.get("at_least", False),
        deviation=None if deviation is None else radians(deviation),
        moment=row.get("moment_Nm"),
        age=row.get("age"),
    )
