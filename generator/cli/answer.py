"""The result of a command: a dataclass, shown as text and as JSON."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum, IntEnum
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple, cast

from generator.diagnostics import Diagnostic
from generator.diagnostics import format_count as format_count


class ExitCode(IntEnum):
    """Exit code of the program."""

    SUCCESS = 0
    WRONG_INPUT = 1
    USAGE = 2
    RUN_FAILED = 3


class Table(NamedTuple):
    """Rows of cells, which may have different lengths; only the left columns are left-aligned."""

    rows: Sequence[Sequence[str]]
    left_columns: int = 1

    def __str__(self) -> str:
        """Align the columns; lines have no trailing spaces."""
        widths: dict[int, int] = {}
        for row in self.rows:
            for k, cell in enumerate(row):
                widths[k] = max(widths.get(k, 0), len(cell))
        lines = (
            "  ".join(
                cell.ljust(widths[k]) if k < self.left_columns else cell.rjust(widths[k])
                for k, cell in enumerate(row)
            ).rstrip()
            for row in self.rows
        )
        return "\n".join(lines)


Paragraphs = Iterable[str | Table]
"""Parts of a text, with a blank line between them; empty ones are left out."""

HIDDEN = {"rule": "hidden"}
"""Metadata of a field of a result that is for its text only."""

OMITTED_IF_NONE = {"rule": "omitted if None"}
"""Metadata of a field that is a key of the JSON unless it is None."""

MERGED = {"rule": "merged"}
"""Metadata of a field whose keys are keys of the result itself."""


@dataclass(frozen=True, kw_only=True)
class CommandResult:
    """Result of a command: a subclass has the answer in its fields, which are the keys of `--json`.

    Attributes:
        diagnostics: Warnings, printed on the error stream.
        failure: Reason of a failed run, as a sentence.
    """

    diagnostics: tuple[Diagnostic, ...] = field(default=(), metadata=HIDDEN)
    failure: str | None = field(default=None, metadata=HIDDEN)

    @property
    def code(self) -> ExitCode:
        """Exit code."""
        return ExitCode.RUN_FAILED if self.failure else ExitCode.SUCCESS

    def paragraphs(self) -> Paragraphs:
        """Return the paragraphs of the text for people."""
        return ()

    def details(self) -> Paragraphs:
        """Return the paragraphs that `--verbose` adds."""
        return ()


def format_paragraphs(paragraphs: Paragraphs) -> str:
    """Return paragraphs as a text."""
    return "\n\n".join(filter(None, map(str, paragraphs)))


def format_written(files: Iterable[Path]) -> str:
    """Return a line for each file that was written."""
    return "\n".join(f"wrote {path}" for path in files)


def finite_or_none(number: float | None) -> float | None:
    """Return the number, or None if it is not finite."""
    return number if number is not None and isfinite(number) else None


def to_json(value: Any) -> Any:
    """Return a result, or a part of one, as data for JSON.

    Dataclasses and named tuples become objects, arrays lists, enumerations their values and paths
    texts; numbers that are not finite become None. A value with a method `to_json` says it itself.
    """
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, str | int):
        return value
    if isinstance(value, float):
        return finite_or_none(float(value))
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "to_json"):
        return to_json(value.to_json())
    if hasattr(value, "tolist"):  # an array
        return to_json(value.tolist())
    if hasattr(value, "_asdict"):  # a named tuple
        return to_json(value._asdict())
    if is_dataclass(value):
        return dict(_entries(value))
    if isinstance(value, Mapping):
        entries = cast("Mapping[Any, Any]", value).items()
        return {str(key): to_json(each) for key, each in entries}
    return [to_json(each) for each in cast("Iterable[Any]", value)]


def _entries(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the keys of a dataclass and their data."""
    for each in fields(value):
        rule, content = each.metadata.get("rule"), getattr(value, each.name)
        if rule == MERGED["rule"]:
            yield from to_json(content).items()
        elif rule is None or (rule == OMITTED_IF_NONE["rule"] and content is not None):
            yield each.name, to_json(content)


def json_text(value: object) -> str:
    """Return a result, or other data, as JSON."""
    return json.dumps(to_json(value), indent=2, allow_nan=False)
