"""Tables of comma-separated values with units in their titles, each cell with its place."""

import re
from math import isfinite

from generator.reader.findings import Findings
from generator.reader.vocabulary import shown
from generator.source import Source, Span

_TITLE = re.compile(r"(\S*)\s*(.*)", re.DOTALL)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)


def lines_of(source: Source) -> list[Span]:
    """The lines that say something: not blank, no comment."""
    spans: list[Span] = []
    start = 0
    for line in source.text.split("\n"):
        if line.strip() and not line.lstrip().startswith("#"):
            spans.append(Span(source, start, start + len(line)))
        start += len(line) + 1
    return spans


def cells_of(line: Span) -> list[Span]:
    """What stands between the commas of a line, without the blanks around it."""
    cells: list[Span] = []
    start = line.start
    for text in line.text.split(","):
        lead = len(text) - len(text.lstrip())
        stripped = text.strip()
        begin = start + (lead if stripped else 0)
        cells.append(Span(line.source, begin, begin + len(stripped)))
        start += len(text) + 1
    return cells


def title_of(cell: Span) -> tuple[str, str]:
    """Name and unit, with its brackets, of a column's title."""
    match = _TITLE.fullmatch(cell.text)
    return (match[1], " ".join(match[2].split())) if match else ("", "")


def number_in(cell: Span, column: str, findings: Findings) -> float | None:
    """The number in a cell of `column`; None, with the fault noted, when there is none."""
    if _NOT_FINITE.fullmatch(cell.text):
        findings.error(f"`{shown(cell.text)}` is not finite", cell)
        return None
    if not _NUMBER.fullmatch(cell.text):
        said = f"`{shown(cell.text)}` is not a number" if cell.text else "a number is missing"
        findings.error(f"{said} (column `{column}`)", cell)
        return None
    number = float(cell.text)
    if not isfinite(number):
        findings.error(f"`{shown(cell.text)}` is beyond the largest number", cell)
        return None
    return number
