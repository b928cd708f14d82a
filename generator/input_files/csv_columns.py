"""Tables of comma-separated values with units in their titles, each cell with its place."""

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from math import isfinite

from generator.diagnostics import Diagnostics, Source, Span, shorten, spelling_hint
from generator.text_io import csv_value

_TITLE = re.compile(r"(\S*)\s*(.*)", re.DOTALL)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)

MAX_ABS_VALUE = 1e12
"""Largest number in a table; its square is still a float."""


@dataclass(frozen=True)
class Column:
    """A column: its place in a line, its unit with brackets, and where its title stands."""

    index: int
    unit: str
    title_span: Span


def data_lines(source: Source) -> list[Span]:
    """The lines that are neither blank nor comments."""
    spans: list[Span] = []
    start = 0
    for line in source.text.split("\n"):
        if line.strip() and not line.lstrip().startswith("#"):
            spans.append(Span(source, start, start + len(line)))
        start += len(line) + 1
    return spans


def split_cells(line: Span) -> list[Span]:
    """The cells between the commas of a line, without the blanks around them."""
    cells: list[Span] = []
    start = line.start
    for text in line.text.split(","):
        lead = len(text) - len(text.lstrip())
        stripped = text.strip()
        begin = start + (lead if stripped else 0)
        cells.append(Span(line.source, begin, begin + len(stripped)))
        start += len(text) + 1
    return cells


def split_title(cell: Span) -> tuple[str, str]:
    """Name and unit, with its brackets, of a column's title."""
    match = _TITLE.fullmatch(csv_value(cell.text))
    return (match[1], " ".join(match[2].split())) if match else ("", "")


def parse_columns(
    line: Span,
    known: Collection[str],
    example: str,
    diagnostics: Diagnostics,
    read_title: Callable[[Span], tuple[str, str]] = split_title,
) -> dict[str, Column]:
    """The columns that a line of titles names, by name; errors are reported.

    Args:
        line: line of titles.
        known: the names of the columns, all of which must be there.
        example: a line of titles as it should be, for hints.
        diagnostics: collects the errors.
        read_title: returns the name and the unit, with its brackets, of a title.
    """
    columns: dict[str, Column] = {}
    cells = split_cells(line)
    if len(cells) == 1 and ";" in line.text:
        diagnostics.error("columns are separated by commas", line, example)
        return columns
    for place, cell in enumerate(cells):
        name, unit = read_title(cell)
        if name not in known:
            diagnostics.error(
                f"unknown column `{shorten(cell.text)}`", cell, spelling_hint(name, known)
            )
        elif name in columns:
            diagnostics.error(f"a second column `{name}`", cell)
        else:
            columns[name] = Column(place, unit, cell)
    missing = [f"`{name}`" for name in known if name not in columns]
    if missing and len(columns) == len(cells):  # else what is wrong may be what is missing
        diagnostics.error(f"there is no column {', '.join(missing)}", line, example)
    return columns


def split_row(
    line: Span, columns: Mapping[str, Column], diagnostics: Diagnostics
) -> dict[str, Span] | None:
    """Return the cells of a line by column; None, with the error reported, if some are missing."""
    cells = split_cells(line)
    if len(cells) != len(columns):
        diagnostics.error(f"this row has {len(cells)} cells, not {len(columns)}", line)
        return None
    return {name: cells[column.index] for name, column in columns.items()}


def parse_number_cell(cell: Span, column: str, diagnostics: Diagnostics) -> float | None:
    """The number in a cell of `column`; None, with the error reported, if there is none."""
    if _NOT_FINITE.fullmatch(cell.text):
        diagnostics.error(f"`{shorten(cell.text)}` is not finite", cell)
        return None
    if not _NUMBER.fullmatch(cell.text):
        message = f"`{shorten(cell.text)}` is not a number" if cell.text else "a number is missing"
        diagnostics.error(f"{message} (column `{column}`)", cell)
        return None
    number = float(cell.text)
    if not isfinite(number):
        diagnostics.error(f"`{shorten(cell.text)}` is beyond the largest number", cell)
        return None
    if abs(number) > MAX_ABS_VALUE:
        diagnostics.error(
            f"`{shorten(cell.text)}` is too large", cell, f"at most {MAX_ABS_VALUE:g}"
        )
        return None
    return number
