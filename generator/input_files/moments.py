"""Measured moments of a joint at its angles, from a file of comma-separated values.

The first line that is not a comment names the columns with their units, in any order:
`angle [deg]` or another unit of angle, `moment [N m]` or another unit of moment (`docs/fits.md`).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from math import degrees, radians

from generator.diagnostics import (
    Diagnostics,
    Source,
    Span,
    shorten,
)
from generator.file_kind import FileKind
from generator.input_files.csv_columns import (
    Column,
    data_lines,
    parse_columns,
    parse_number_cell,
    split_row,
    split_title,
)
from generator.units import DIMENSION_POWERS, UNIT_EXAMPLES, Dimension, UnitError, parse_unit

COLUMN_DIMENSIONS: Mapping[str, Dimension] = {"angle": Dimension.ANGLE, "moment": Dimension.MOMENT}
COLUMN_SYNONYMS: Mapping[str, str] = {
    **dict.fromkeys(("angle", "angles", "joint angle", "theta", "\u03b8", "position"), "angle"),
    **dict.fromkeys(
        ("moment", "moments", "joint moment", "passive moment", "torque", "torques"), "moment"
    ),
    **dict.fromkeys(("joint torque", "passive torque", "tau", "\u03c4"), "moment"),
}
"""Column of a title, in lower case and with blanks for underscores."""

MOMENTS_EXAMPLE = "angle [deg],moment [N m]"

MIN_ANGLES = 4
"""Different angles that a cubic needs."""

SAME_ANGLE_FRACTION = 1e-4
"""Part of the range of the angles below which two count as one: rounding would tell them apart."""

MAX_ANGLE = radians(720.0)
"""Largest angle of a joint [rad]; a larger one is a slip."""

MIN_ANGLE_RANGE = radians(0.01)
"""Range of the angles that a cubic needs [rad]; a smaller one is a slip."""


@dataclass(frozen=True)
class MeasuredMoments:
    """Moments of one joint at angles that do not fall.

    Attributes:
        angles: [rad], at least four different ones.
        moments: [N m], one an angle.
        name: name of the file.
        titles: titles of the columns of angles and moments, as in the file.
    """

    angles: tuple[float, ...]
    moments: tuple[float, ...]
    name: str
    titles: tuple[str, str] = field(default=("angle", "moment"), compare=False)


@dataclass(frozen=True)
class _Row:
    """An angle [rad] as written at `angle_span`, and a moment [N m]."""

    angle: float
    moment: float
    angle_span: Span


def _parse_table(source: Source, diagnostics: Diagnostics) -> MeasuredMoments | None:
    lines = data_lines(source)
    if not lines:
        diagnostics.error("there are no moments in this file", Span(source, 0, 1), MOMENTS_EXAMPLE)
        return None
    columns = parse_columns(lines[0], COLUMN_DIMENSIONS, MOMENTS_EXAMPLE, diagnostics, _read_title)
    factors = {name: _unit_factor(name, one, diagnostics) for name, one in columns.items()}
    if diagnostics.has_errors:
        return None
    parsed = [_parse_row(line, columns, factors, diagnostics) for line in lines[1:]]
    rows = [row for row in parsed if row is not None]
    _check_order(rows, diagnostics)
    _check_count(rows, lines, diagnostics)
    angles, moments = tuple(row.angle for row in rows), tuple(row.moment for row in rows)
    titles = columns["angle"].title_span.text, columns["moment"].title_span.text
    return MeasuredMoments(angles, moments, source.name, titles)


MOMENTS_FILE = FileKind("moments", ".csv", _parse_table)


def _read_title(cell: Span) -> tuple[str, str]:
    """Column and unit of a title: `Joint_Torque (N m)` is the moment, `[N m]` its unit."""
    match = re.fullmatch(r"([^\[(]*?)\s*(?:[\[(]([^\])]*)[\])])?", cell.text)
    words = "" if match is None else " ".join(match[1].replace("_", " ").lower().split())
    if match is None or words not in COLUMN_SYNONYMS:
        return split_title(cell)
    return COLUMN_SYNONYMS[words], "" if match[2] is None else f"[{match[2]}]"


def _unit_factor(name: str, column: Column, diagnostics: Diagnostics) -> Fraction:
    """The SI value of a column's unit; 1, with an error reported, if none fits."""
    dimension, unit, cell = COLUMN_DIMENSIONS[name], column.unit, column.title_span
    hint = f"in brackets, one of: {UNIT_EXAMPLES[dimension]}; as in `{MOMENTS_EXAMPLE}`"
    if not (unit.startswith("[") and unit.endswith("]")):
        diagnostics.error(f"column `{name}` has no unit", cell, hint)
        return Fraction(1)
    try:
        known = parse_unit(unit[1:-1].strip())
    except UnitError as failure:
        diagnostics.error(str(failure), cell, failure.hint)
        return Fraction(1)
    if known.powers != DIMENSION_POWERS[dimension]:
        diagnostics.error(f"`{shorten(unit)}` is not the unit of {dimension.value}", cell, hint)
    return known.factor


def _parse_row(
    line: Span,
    columns: Mapping[str, Column],
    factors: Mapping[str, Fraction],
    diagnostics: Diagnostics,
) -> _Row | None:
    """Parse a line; None, with the errors reported, if it says nothing."""
    by_name = split_row(line, columns, diagnostics)
    if by_name is None:
        return None
    numbers = {name: parse_number_cell(cell, name, diagnostics) for name, cell in by_name.items()}
    angle, moment = numbers["angle"], numbers["moment"]
    if angle is None or moment is None:
        return None
    turned = angle * float(factors["angle"])
    if abs(turned) > MAX_ANGLE:
        hint = f"a joint's angle is at most {degrees(MAX_ANGLE):g} deg"
        diagnostics.error(f"the angle {shorten(by_name['angle'].text)} is too large", line, hint)
        return None
    return _Row(turned, moment * float(factors["moment"]), by_name["angle"])


def _check_order(rows: list[_Row], diagnostics: Diagnostics) -> None:
    """Angles that go up and down again are two curves: one a direction of the motion."""
    for before, row in pairwise(rows):
        if row.angle < before.angle:
            diagnostics.error(
                f"the angle {row.angle_span.text} is below the previous {before.angle_span.text}",
                row.angle_span,
                "sort the rows by angle; split a loop into two files, one for each direction",
            )


def _check_count(rows: list[_Row], lines: list[Span], diagnostics: Diagnostics) -> None:
    if diagnostics.has_errors:
        return
    different = _count_distinct_angles([row.angle for row in rows])
    if different < MIN_ANGLES:
        diagnostics.error(
            f"a cubic needs {MIN_ANGLES} different angles; this file has {different or 'none'}",
            lines[-1],
            f"angles less than {SAME_ANGLE_FRACTION:g} of their range apart count as one"
            if different > 1
            else "",
        )
    elif rows[-1].angle - rows[0].angle < MIN_ANGLE_RANGE:
        diagnostics.error(
            "the angles are too close together for a cubic",
            lines[-1],
            f"from the first to the last are at least {degrees(MIN_ANGLE_RANGE):g} deg",
        )


def _count_distinct_angles(angles: Sequence[float]) -> int:
    """Number of the increasing angles that differ from the last one counted."""
    counted: list[float] = []
    for angle in angles:
        if not counted or angle - counted[-1] > SAME_ANGLE_FRACTION * (angles[-1] - angles[0]):
            counted.append(angle)
    return len(counted)
