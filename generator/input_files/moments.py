"""Measured moments of a joint at its angles, from a file of comma-separated values.

The first line that is no comment names the columns with their units, in any order: `angle [deg]` or
another unit of angle, `moment [N m]` or another unit of moment (`docs/fits.md`).
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import degrees, radians
from pathlib import Path

from generator.diagnostics import EnoughFaults, Fault, Findings, InputError, Source, Span, shorten
from generator.input_files.csv_columns import cells_of, columns_in, lines_of, number_in
from generator.text_io import read_text, unified
from generator.units import EXAMPLES, POWERS, Dimension, UnitError, unit_named

COLUMNS: Mapping[str, Dimension] = {"angle": Dimension.ANGLE, "moment": Dimension.MOMENT}
EXAMPLE = "angle [deg],moment [N m]"

LEAST = 4
"""Different angles that a cubic needs."""

SAME = 1e-4
"""Part of the range of the angles below which two count as one: rounding would tell them apart."""

FARTHEST = radians(720.0)
"""Largest angle of a joint [rad]; a larger one is a slip."""

LEAST_RANGE = radians(0.01)
"""Range of the angles that a cubic needs [rad]; a smaller one is a slip."""


@dataclass(frozen=True)
class MeasuredMoments:
    """Moments of one joint at angles that do not fall.

    Attributes:
        angles: [rad], at least four different ones.
        moments: [N m], one an angle.
        name: of the file.
    """

    angles: tuple[float, ...]
    moments: tuple[float, ...]
    name: str


@dataclass(frozen=True)
class MomentsReading:
    """What came of reading moments; `moments` is None when `faults` holds an error."""

    moments: MeasuredMoments | None
    faults: tuple[Fault, ...]


@dataclass(frozen=True)
class _Column:
    place: int
    factor: Fraction


@dataclass(frozen=True)
class _Row:
    """An angle [rad] as written at `place`, and a moment [N m]."""

    angle: float
    moment: float
    place: Span


def read_moments(path: str | Path) -> MeasuredMoments:
    """The moments in a file. Raises InputError, with all faults, when any is wrong."""
    reading = examine_moments(path)
    if reading.moments is None:
        raise InputError(reading.faults)
    return reading.moments


def examine_moments(path: str | Path) -> MomentsReading:
    """The moments in a file, with all faults; bad input raises nothing."""
    source, fault = read_text(Path(path), str(path))
    if fault is not None:
        return MomentsReading(None, (fault,))
    return parse_moments(source.text, source.name)


def parse_moments(text: str, name: str = "<text>") -> MomentsReading:
    """The moments that `text` lists, with all faults; `name` is what they call the text."""
    source, findings, rows = Source(name, unified(text)), Findings(), list[_Row]()
    with suppress(EnoughFaults):
        lines = lines_of(source)
        if not lines:
            findings.error("there are no moments in this file", Span(source, 0, 1), EXAMPLE)
        else:
            columns = _columns(lines[0], findings)
            if not findings.has_errors:
                read = [_row(line, columns, findings) for line in lines[1:]]
                rows = [row for row in read if row is not None]
                _check_order(rows, findings)
                _check_count(rows, lines, findings)
    if findings.has_errors:
        return MomentsReading(None, findings.in_order())
    angles, moments = tuple(row.angle for row in rows), tuple(row.moment for row in rows)
    return MomentsReading(MeasuredMoments(angles, moments, name), findings.in_order())


def _columns(line: Span, findings: Findings) -> dict[str, _Column]:
    """Where each column is, by name, and the SI value of its unit."""
    return {
        name: _Column(column.place, _factor(name, column.unit, column.title, findings))
        for name, column in columns_in(line, COLUMNS, EXAMPLE, findings).items()
    }


def _factor(name: str, unit: str, cell: Span, findings: Findings) -> Fraction:
    """The SI value of a column's unit; 1, with a fault noted, where it has none that fits."""
    dimension = COLUMNS[name]
    hint = f"in brackets, one of: {EXAMPLES[dimension]}; as in `{EXAMPLE}`"
    if not (unit.startswith("[") and unit.endswith("]")):
        findings.error(f"column `{name}` has no unit", cell, hint)
        return Fraction(1)
    try:
        known = unit_named(unit[1:-1].strip())
    except UnitError as failure:
        findings.error(str(failure), cell, failure.hint)
        return Fraction(1)
    if known.powers != POWERS[dimension]:
        findings.error(f"`{shorten(unit)}` is not the unit of {dimension.value}", cell, hint)
    return known.factor


def _row(line: Span, columns: Mapping[str, _Column], findings: Findings) -> _Row | None:
    """What a line says; None, with the faults noted, when it says nothing."""
    cells = cells_of(line)
    if len(cells) != len(columns):
        findings.error(f"this row has {len(cells)} cells, not {len(columns)}", line)
        return None
    by_name = {name: cells[column.place] for name, column in columns.items()}
    numbers = {name: number_in(cell, name, findings) for name, cell in by_name.items()}
    angle, moment = numbers["angle"], numbers["moment"]
    if angle is None or moment is None:
        return None
    turned = angle * float(columns["angle"].factor)
    if abs(turned) > FARTHEST:
        hint = f"a joint's angle is at most {degrees(FARTHEST):g} deg"
        findings.error(f"the angle {shorten(by_name['angle'].text)} is too large", line, hint)
        return None
    return _Row(turned, moment * float(columns["moment"].factor), by_name["angle"])


def _check_order(rows: list[_Row], findings: Findings) -> None:
    """Angles that go up and down again are two curves: one a direction of the motion."""
    for before, row in pairwise(rows):
        if row.angle < before.angle:
            findings.error(
                f"the angle {row.place.text} is below {before.place.text}, the one before",
                row.place,
                "sort the rows by angle; of a loop make two files, one for each direction",
            )


def _check_count(rows: list[_Row], lines: list[Span], findings: Findings) -> None:
    if findings.has_errors:
        return
    different = _count_different([row.angle for row in rows])
    if different < LEAST:
        findings.error(
            f"a cubic needs {LEAST} different angles; this file has {different or 'none'}",
            lines[-1],
            f"angles less than {SAME:g} of their range apart count as one" if different > 1 else "",
        )
    elif rows[-1].angle - rows[0].angle < LEAST_RANGE:
        findings.error(
            "the angles are too close together for a cubic",
            lines[-1],
            f"from the first to the last are at least {degrees(LEAST_RANGE):g} deg",
        )


def _count_different(angles: Sequence[float]) -> int:
    """How many of the angles, which do not fall, are apart from the last that was counted."""
    counted: list[float] = []
    for angle in angles:
        if not counted or angle - counted[-1] > SAME * (angles[-1] - angles[0]):
            counted.append(angle)
    return len(counted)
