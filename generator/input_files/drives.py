"""Joints driven by a table of comma-separated values (`docs/driving.md`).

The first line that is no comment names the columns: `time [s]`, and `JOINT [deg]` for a joint of
one displacement or `JOINT.k [deg]` for the k-th of a joint of several, counted from 1.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from generator.diagnostics import EnoughFaults, Fault, Findings, Source, Span, nearest, shorten
from generator.drive import FARTHEST, SHORTEST, Drive, Overshoot
from generator.figure import Figure, Joint
from generator.input_files.csv_columns import cells_of, lines_of, number_in, title_of
from generator.text_io import read_text, unified

EXAMPLE = "time [s],left_knee [deg],left_shoulder.1 [deg]"

_TIME, _TIME_UNIT = "time", "[s]"
_UNITS: Mapping[str, float] = {"[deg]": np.pi / 180.0, "[rad]": 1.0}
OVERSHOOT_HINT = "more rows where it bends hold it back"

_ENERGY = "[J]"
"""Unit of the energies that a motion's table has beside its displacements."""


@dataclass(frozen=True)
class DrivesReading:
    """What came of reading a table; `drives` is empty when `faults` holds an error."""

    drives: Mapping[str, Drive]
    faults: tuple[Fault, ...]


@dataclass(frozen=True)
class _Column:
    """One displacement: `factor` times the cell at `place` in the line is in rad."""

    place: int
    joint: str
    index: int
    factor: float


@dataclass(frozen=True)
class _Header:
    count: int
    time: int
    columns: list[_Column] = field(default_factory=list[_Column])


def examine_drives(path: str | Path, figure: Figure, only: Sequence[str] = ()) -> DrivesReading:
    """The drives in a table for a figure, with all faults; bad input raises nothing.

    Args:
        path: of the table.
        figure: whose joints are driven.
        only: names of the joints to drive; all of the table when there are none.
    """
    source, fault = read_text(Path(path), str(path))
    if fault is not None:
        return DrivesReading({}, (fault,))
    return parse_drives(source.text, figure, only, source.name)


def parse_drives(
    text: str, figure: Figure, only: Sequence[str] = (), name: str = "<text>"
) -> DrivesReading:
    """The drives that `text` describes, with all faults; `name` is what they call the text."""
    source, findings = Source(name, unified(text)), Findings()
    drives: dict[str, Drive] = {}
    with suppress(EnoughFaults):
        lines = lines_of(source)
        if not lines:
            findings.error("there is no table in this file", Span(source, 0, 1), EXAMPLE)
        else:
            header = _header(lines[0], figure, only, findings)
            if header is not None and header.columns and not findings.has_errors:
                drives = _drives(lines, header, findings)
    return DrivesReading({} if findings.has_errors else drives, findings.in_order())


def _header(line: Span, figure: Figure, only: Sequence[str], findings: Findings) -> _Header | None:
    """Which columns there are; None, with the faults noted, when that cannot be told."""
    cells = cells_of(line)
    if len(cells) == 1 and ";" in line.text:
        findings.error("columns are separated by commas", line, EXAMPLE)
        return None
    time: int | None = None
    columns: dict[tuple[str, int], _Column] = {}
    for place, cell in enumerate(cells):
        title, unit = title_of(cell)
        if title == _TIME and (_TIME not in figure.joints or unit in (_TIME_UNIT, "")):
            if unit != _TIME_UNIT:
                what = f"has the unknown unit `{shorten(unit)}`" if unit else "has no unit"
                findings.error(f"column `time` {what}", cell, f"write `{_TIME} {_TIME_UNIT}`")
            elif time is not None:
                findings.error("a second column `time`", cell)
            time = place
        elif unit != _ENERGY:
            column = _column(place, cell, figure, only, findings)
            if column is None:
                continue
            if (column.joint, column.index) in columns:
                findings.error(f"a second column `{shorten(title)}`", cell)
            columns[column.joint, column.index] = column
    if time is None:
        findings.error("there is no column `time [s]`", line, EXAMPLE)
    elif not columns and not only and not findings.has_errors:
        findings.error("no column drives a joint", line, EXAMPLE)
    ordered = sorted(columns.values(), key=lambda one: (one.joint, one.index))
    return None if time is None else _Header(len(cells), time, ordered)


def _column(
    place: int, cell: Span, figure: Figure, only: Sequence[str], findings: Findings
) -> _Column | None:
    """What a column drives; None when it is not asked for, or wrong and a fault is noted."""
    title, unit = title_of(cell)
    name, number = (title, "") if title in figure.joints else _split(title)
    joint = figure.joints.get(name)
    if only and name not in only:
        return None
    if joint is None:
        hint = nearest(name, figure.joints)
        findings.error(f"the figure has no joint `{shorten(name)}`", cell, hint)
        return None
    index = _index(joint, number, cell, findings)
    if index is None:
        return None
    if joint.chain[index].kind != "R":
        findings.error(f"`{shorten(title)}` slides: only turns can be driven in a simulation", cell)
        return None
    if unit not in _UNITS:
        what = f"has the unknown unit `{shorten(unit)}`" if unit else "has no unit"
        findings.error(
            f"column `{shorten(title)}` {what}", cell, f"write `{shorten(title)} [deg]` or `[rad]`"
        )
        return None
    return _Column(place, name, index, _UNITS[unit])


def _split(title: str) -> tuple[str, str]:
    """The joint and the number in `JOINT.k`."""
    name, dot, number = title.rpartition(".")
    return (name, number) if dot else (title, "")


def _index(joint: Joint, number: str, cell: Span, findings: Findings) -> int | None:
    """The place in the joint's chain that a number from 1 means; the only one needs none."""
    count, name = len(joint.chain), shorten(joint.name)
    if not count:
        findings.error(f"joint `{name}` does not move", cell)
        return None
    if not number and count > 1:
        findings.error(
            f"`{name}` has {count} degrees of freedom",
            cell,
            f"a column for each that is driven: `{name}.1 [deg]`",
        )
        return None
    if number and (not number.isascii() or not number.isdigit() or not 1 <= int(number) <= count):
        findings.error(
            f"`{name}` has no degree of freedom `{shorten(number)}`", cell, f"from 1 to {count}"
        )
        return None
    return int(number or 1) - 1


def _drives(lines: list[Span], header: _Header, findings: Findings) -> dict[str, Drive]:
    """The drives that the rows make; none, with the faults noted, when any is wrong."""
    if len(lines) < 3:
        findings.error("a drive needs two rows or more", lines[-1])
        return {}
    times: list[float] = []
    rows: list[list[float]] = []
    read: list[list[Span]] = []
    for line in lines[1:]:
        cells = cells_of(line)
        if len(cells) != header.count:
            findings.error(f"this row has {len(cells)} cells, not {header.count}", line)
            continue
        time = number_in(cells[header.time], _TIME, findings)
        values = [_turn_in(cells[column.place], column, findings) for column in header.columns]
        told = [value for value in values if value is not None]
        if time is None or len(told) != len(values):
            continue
        if times and time <= times[-1]:
            findings.error("the time does not increase", cells[header.time])
        elif times and time - times[-1] < SHORTEST:
            said = f"this row is nearer than {SHORTEST:.0e} s to the one before"
            findings.error(said, cells[header.time])
        times.append(time)
        rows.append(told)
        read.append(cells)
    if findings.has_errors:
        return {}
    table, found = np.array(rows), dict[str, Drive]()
    for name in dict.fromkeys(column.joint for column in header.columns):
        mine = [k for k, column in enumerate(header.columns) if column.joint == name]
        freedoms = tuple(header.columns[k].index for k in mine)
        drive = found[name] = Drive(tuple(times), table[:, mine], freedoms)
        for one in drive.overshoots():
            column = header.columns[mine[one.column]]
            said = f"between this row and the next {overshoot_said(name, column.index, one)}"
            findings.warning(said, read[one.row][column.place], OVERSHOOT_HINT)
    return found


def overshoot_said(joint: str, index: int, one: Overshoot) -> str:
    """The sentence that tells how far a turn leaves the range of its rows."""
    value, low, high = np.degrees([one.value, one.low, one.high])
    return (
        f"the spline takes {joint} {index + 1} to {value:.4g} deg at {one.time:.4g} s, "
        f"though the rows are from {low:.4g} to {high:.4g} deg"
    )


def _turn_in(cell: Span, column: _Column, findings: Findings) -> float | None:
    """The turn in a cell [rad]; None, with the fault noted, when there is none."""
    value = number_in(cell, column.joint, findings)
    if value is None:
        return None
    if abs(turn := column.factor * value) > FARTHEST:
        findings.error(f"`{shorten(cell.text)}` is beyond {FARTHEST:.0e} rad", cell)
        return None
    return turn
