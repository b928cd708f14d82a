"""Joints driven by a table of comma-separated values (`docs/driving.md`).

The first line that is not a comment names the columns: `time [s]`, and `JOINT [deg]` for a joint of
one displacement or `JOINT.k [deg]` for the k-th of a joint of several, counted from 1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import assert_never

import numpy as np

from generator.diagnostics import Diagnostics, Source, Span, shorten, spelling_hint
from generator.drive import MAX_DISPLACEMENT, MIN_ROW_INTERVAL, Drive, Overshoot
from generator.figure import AxisKind, Figure, Joint
from generator.file_kind import FileKind
from generator.input_files.csv_columns import (
    data_lines,
    parse_number_cell,
    split_cells,
    split_title,
)

DRIVES_EXAMPLE = "time [s],left_knee [deg],left_shoulder.1 [deg]"

_TIME_COLUMN, _TIME_UNIT = "time", "[s]"
_ANGLE_UNITS: Mapping[str, float] = {"[deg]": np.pi / 180.0, "[rad]": 1.0}
OVERSHOOT_HINT = "add rows where the curve bends"

_OTHER_UNITS = ("[J]", "[1]")
"""Units of the energies and quaternions that a motion's table has beside its displacements."""


@dataclass(frozen=True)
class _Column:
    """One displacement: `factor` times the cell at `cell_index` in the line is in rad."""

    cell_index: int
    joint: str
    coordinate: int
    factor: float


def _parse_drives(
    source: Source, diagnostics: Diagnostics, figure: Figure, joint_names: Sequence[str] = ()
) -> Mapping[str, Drive]:
    """Parse a table for a figure; of the joints with these names, or of all in the table."""
    lines = data_lines(source)
    if not lines:
        diagnostics.error("there is no table in this file", Span(source, 0, 1), DRIVES_EXAMPLE)
        return {}
    header = _parse_header(lines[0], figure, joint_names, diagnostics)
    if header is None or not header[1] or diagnostics.has_errors:
        return {}
    return _build_drives(lines, *header, diagnostics)


DRIVES_FILE = FileKind("drives", ".csv", _parse_drives)


def _parse_header(
    line: Span, figure: Figure, joint_names: Sequence[str], diagnostics: Diagnostics
) -> tuple[int, list[_Column]] | None:
    """Return the place of the time and the other columns; None, with errors, if they are wrong."""
    cells = split_cells(line)
    if len(cells) == 1 and ";" in line.text:
        diagnostics.error("columns are separated by commas", line, DRIVES_EXAMPLE)
        return None
    time: int | None = None
    columns: dict[tuple[str, int], _Column] = {}
    for place, cell in enumerate(cells):
        title, unit = split_title(cell)
        if title == _TIME_COLUMN and (
            _TIME_COLUMN not in figure.joints or unit in (_TIME_UNIT, "")
        ):
            if unit != _TIME_UNIT:
                what = f"has the unknown unit `{shorten(unit)}`" if unit else "has no unit"
                diagnostics.error(
                    f"column `time` {what}", cell, f"write `{_TIME_COLUMN} {_TIME_UNIT}`"
                )
            elif time is not None:
                diagnostics.error("a second column `time`", cell)
            time = place
        elif unit not in _OTHER_UNITS:
            column = _parse_column(place, cell, figure, joint_names, diagnostics)
            if column is None:
                continue
            if (column.joint, column.coordinate) in columns:
                diagnostics.error(f"a second column `{shorten(title)}`", cell)
            columns[column.joint, column.coordinate] = column
    if time is None:
        diagnostics.error("there is no column `time [s]`", line, DRIVES_EXAMPLE)
    elif not columns and not joint_names and not diagnostics.has_errors:
        diagnostics.error("no column is the angle of a joint", line, DRIVES_EXAMPLE)
    ordered = sorted(columns.values(), key=lambda one: (one.joint, one.coordinate))
    return None if time is None else (time, ordered)


def _parse_column(
    cell_index: int,
    cell: Span,
    figure: Figure,
    joint_names: Sequence[str],
    diagnostics: Diagnostics,
) -> _Column | None:
    """Parse a title; None if the joint is not asked for, or with an error reported."""
    title, unit = split_title(cell)
    name, number = (title, "") if title in figure.joints else _split_title(title)
    joint = figure.joints.get(name)
    if joint_names and name not in joint_names:
        return None
    if joint is None:
        hint = spelling_hint(name, figure.joints)
        diagnostics.error(f"the figure has no joint `{shorten(name)}`", cell, hint)
        return None
    index = _parse_coordinate_index(joint, number, cell, diagnostics)
    if index is None:
        return None
    kind = joint.chain[index].kind
    match kind:
        case AxisKind.ROTATION:
            pass
        case AxisKind.TRANSLATION:
            diagnostics.error(
                f"`{shorten(title)}` is a translation: only rotations can be driven "
                "in a simulation or fitted",
                cell,
            )
            return None
        case _:
            assert_never(kind)
    if unit not in _ANGLE_UNITS:
        what = f"has the unknown unit `{shorten(unit)}`" if unit else "has no unit"
        diagnostics.error(
            f"column `{shorten(title)}` {what}", cell, f"write `{shorten(title)} [deg]` or `[rad]`"
        )
        return None
    return _Column(cell_index, name, index, _ANGLE_UNITS[unit])


def _split_title(title: str) -> tuple[str, str]:
    """The joint and the number in `JOINT.k`."""
    name, dot, number = title.rpartition(".")
    return (name, number) if dot else (title, "")


def _parse_coordinate_index(
    joint: Joint, number: str, cell: Span, diagnostics: Diagnostics
) -> int | None:
    """Index in the joint's chain of a number from 1, which may be left out of a chain of one."""
    count, name = len(joint.chain), shorten(joint.name)
    if not count:
        diagnostics.error(f"joint `{name}` does not move", cell)
        return None
    if not number and count > 1:
        diagnostics.error(
            f"`{name}` has {count} degrees of freedom",
            cell,
            f"a column for each that is driven: `{name}.1 [deg]`",
        )
        return None
    if number and (not number.isascii() or not number.isdigit() or not 1 <= int(number) <= count):
        diagnostics.error(
            f"`{name}` has no degree of freedom `{shorten(number)}`", cell, f"from 1 to {count}"
        )
        return None
    return int(number or 1) - 1


def _build_drives(
    lines: list[Span], time_index: int, columns: list[_Column], diagnostics: Diagnostics
) -> dict[str, Drive]:
    """Build the drives from the rows; none, with the errors reported, if any is wrong."""
    if len(lines) < 3:
        diagnostics.error("a table of angles needs two rows or more", lines[-1])
        return {}
    count = len(split_cells(lines[0]))
    times: list[float] = []
    rows: list[list[float]] = []
    read: list[list[Span]] = []
    for line in lines[1:]:
        cells = split_cells(line)
        if len(cells) != count:
            diagnostics.error(f"this row has {len(cells)} cells, not {count}", line)
            continue
        time = parse_number_cell(cells[time_index], _TIME_COLUMN, diagnostics)
        values = [_parse_angle(cells[column.cell_index], column, diagnostics) for column in columns]
        row = [value for value in values if value is not None]
        if time is None or len(row) != len(values):
            continue
        if times and time <= times[-1]:
            diagnostics.error("the time does not increase", cells[time_index])
        elif times and time - times[-1] < MIN_ROW_INTERVAL:
            message = f"this row is less than {MIN_ROW_INTERVAL:.0e} s after the one before"
            diagnostics.error(message, cells[time_index])
        times.append(time)
        rows.append(row)
        read.append(cells)
    if diagnostics.has_errors:
        return {}
    table, found = np.array(rows), dict[str, Drive]()
    for name in dict.fromkeys(column.joint for column in columns):
        mine = [k for k, column in enumerate(columns) if column.joint == name]
        freedoms = tuple(columns[k].coordinate for k in mine)
        drive = found[name] = Drive(tuple(times), table[:, mine], freedoms)
        for one in drive.overshoots():
            column = columns[mine[one.column]]
            message = (
                f"between this row and the next {describe_overshoot(name, column.coordinate, one)}"
            )
            diagnostics.warning(message, read[one.row][column.cell_index], OVERSHOOT_HINT)
    return found


def describe_overshoot(joint: str, index: int, overshoot: Overshoot) -> str:
    """Sentence about an angle that leaves the range of its rows."""
    value, low, high = np.degrees([overshoot.value, overshoot.low, overshoot.high])
    return (
        f"the spline takes {joint} {index + 1} to {value:.4g} deg at {overshoot.time:.4g} s, "
        f"though the rows are from {low:.4g} to {high:.4g} deg"
    )


def _parse_angle(cell: Span, column: _Column, diagnostics: Diagnostics) -> float | None:
    """The turn in a cell [rad]; None, with the error reported, if there is none."""
    value = parse_number_cell(cell, column.joint, diagnostics)
    if value is None:
        return None
    if abs(turn := column.factor * value) > MAX_DISPLACEMENT:
        diagnostics.error(f"`{shorten(cell.text)}` is beyond {MAX_DISPLACEMENT:.0e} rad", cell)
        return None
    return turn
