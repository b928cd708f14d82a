"""Forces and moments that vary in time, from a file of comma-separated values (`docs/loads.md`).

The first line that is not a comment names the columns, in any order: `site`, `kind`, `time [s]`,
and x, y, z with the unit `[N]`, `[N m]`, or `[N or N m]` for a file that holds forces and moments.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from generator.diagnostics import (
    Diagnostics,
    Source,
    Span,
    shorten,
    spelling_hint,
)
from generator.figure import Figure, SiteRef
from generator.file_kind import FileKind
from generator.input_files.csv_columns import (
    Column,
    data_lines,
    parse_columns,
    parse_number_cell,
    split_row,
)
from generator.loads import LoadKind, TimedLoad

TIME_UNIT = "[s]"
FORCE_UNIT = "[N]"
MOMENT_UNIT = "[N m]"
FORCE_OR_MOMENT_UNIT = "[N or N m]"

COLUMN_UNITS: Mapping[str, tuple[str, ...]] = {
    "site": ("",),
    "kind": ("",),
    "time": (TIME_UNIT,),
    "x": (FORCE_UNIT, MOMENT_UNIT, FORCE_OR_MOMENT_UNIT),
    "y": (FORCE_UNIT, MOMENT_UNIT, FORCE_OR_MOMENT_UNIT),
    "z": (FORCE_UNIT, MOMENT_UNIT, FORCE_OR_MOMENT_UNIT),
}
"""The columns, with the units that each may have."""

NUMERIC_COLUMNS = ("time", "x", "y", "z")

LOADS_EXAMPLE = "site,kind,time [s],x [N],y [N],z [N]"


@dataclass(frozen=True)
class _Row:
    """One row that could be read: values [N or N m] at a time [s]."""

    site: SiteRef
    kind: LoadKind
    time: float
    values: tuple[float, float, float]
    time_span: Span


def _parse_table(
    source: Source, diagnostics: Diagnostics, figure: Figure
) -> tuple[TimedLoad, ...] | None:
    lines = data_lines(source)
    if not lines:
        diagnostics.error("there are no loads in this file", Span(source, 0, 1), LOADS_EXAMPLE)
        return None
    columns = _parse_columns(lines[0], diagnostics)
    if diagnostics.has_errors:
        return None
    rows = [_parse_row(line, columns, figure, diagnostics) for line in lines[1:]]
    if not rows:
        diagnostics.error("the table has no rows", lines[0])
    return _group_loads([row for row in rows if row is not None], figure, diagnostics)


LOADS_FILE = FileKind("loads", ".csv", _parse_table)


def _parse_columns(line: Span, diagnostics: Diagnostics) -> dict[str, Column]:
    """Columns by name."""
    columns = parse_columns(line, COLUMN_UNITS, LOADS_EXAMPLE, diagnostics)
    for name, column in columns.items():
        if column.unit not in COLUMN_UNITS[name]:
            expected = " or ".join(
                f"`{name} {known}`".replace(" `", "`") for known in COLUMN_UNITS[name]
            )
            what = "has an unknown unit" if column.unit else "has no unit"
            diagnostics.error(f"column `{name}` {what}", column.title_span, f"write {expected}")
    units = {columns[name].unit for name in ("x", "y", "z") if name in columns}
    if len(units) > 1 and not diagnostics.has_errors:
        diagnostics.error("x, y and z have different units", line, LOADS_EXAMPLE)
    return columns


def _parse_row(
    line: Span, columns: Mapping[str, Column], figure: Figure, diagnostics: Diagnostics
) -> _Row | None:
    """Parse a line; None, with the errors reported, if it says nothing."""
    by_name = split_row(line, columns, diagnostics)
    if by_name is None:
        return None
    site = _find_site(by_name["site"], figure, diagnostics)
    kind = _parse_kind(by_name["kind"], columns["x"].unit, diagnostics)
    numbers = [parse_number_cell(by_name[name], name, diagnostics) for name in NUMERIC_COLUMNS]
    if site is None or kind is None:
        return None
    time, *values = (number for number in numbers if number is not None)
    if len(values) != 3:
        return None
    x, y, z = values
    return _Row(site, kind, time, (x, y, z), by_name["time"])


def _find_site(cell: Span, figure: Figure, diagnostics: Diagnostics) -> SiteRef | None:
    known = {
        f"{segment.name}.{site}": SiteRef(segment.name, site)
        for segment in figure.segments.values()
        for site in segment.sites
    }
    if cell.text in known:
        return known[cell.text]
    diagnostics.error(
        f"the figure has no site `{shorten(cell.text)}`",
        cell,
        spelling_hint(cell.text, known),
    )
    return None


def _parse_kind(cell: Span, unit: str, diagnostics: Diagnostics) -> LoadKind | None:
    kinds = {kind.value: kind for kind in LoadKind}
    kind = kinds.get(cell.text)
    if kind is None:
        diagnostics.error(
            f"unknown kind of load `{shorten(cell.text)}`", cell, spelling_hint(cell.text, kinds)
        )
        return None
    needed = FORCE_UNIT if kind.is_force else MOMENT_UNIT
    if unit not in (needed, FORCE_OR_MOMENT_UNIT):
        diagnostics.error(
            f"`{kind.value}` is in {needed}, but the columns are in {unit}",
            cell,
            f"a file with forces and moments names them `x {FORCE_OR_MOMENT_UNIT}`",
        )
        return None
    return kind


def _group_loads(
    rows: list[_Row], figure: Figure, diagnostics: Diagnostics
) -> tuple[TimedLoad, ...]:
    """One load for each site and kind, in the order in which they first appear."""
    groups: dict[tuple[SiteRef, LoadKind], list[_Row]] = {}
    for row in rows:
        earlier = groups.setdefault((row.site, row.kind), [])
        if earlier and row.time <= earlier[-1].time:
            diagnostics.error(
                f"the time {row.time:g} s is not after {earlier[-1].time:g} s, "
                f"the previous row of `{row.kind.value}` at `{row.site}`",
                row.time_span,
                "for a jump leave a thousandth of a second between two rows",
            )
        earlier.append(row)
    if diagnostics.has_errors:
        return ()
    for (site, kind), group in groups.items():
        if len(group) == 1:
            diagnostics.warning(
                f"`{kind.value}` at `{site}` has one row, so it acts for no time",
                group[0].time_span,
                "a load is linear between its rows and zero outside them",
            )
        if site.segment in figure.ground:
            diagnostics.warning(
                f"`{site}` is on the ground, where a load moves nothing", group[0].time_span
            )
    return tuple(
        TimedLoad(site, kind, tuple(row.time for row in group), tuple(row.values for row in group))
        for (site, kind), group in groups.items()
    )
