"""Result of a command, and its formatting as text and JSON."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import isfinite
from typing import Any, cast

from generator.diagnostics import Diagnostic
from generator.diagnostics import format_count as format_count


class ExitCode(IntEnum):
    """Exit code of the program."""

    SUCCESS = 0
    WRONG_INPUT = 1
    USAGE = 2
    RUN_FAILED = 3


@dataclass(frozen=True)
class CommandResult:
    """Result of a command.

    Attributes:
        text: for people.
        data: for `--json`; numbers that are not finite become null.
        diagnostics: warnings, printed on the error stream.
        code: exit code.
        failure: why a run failed, as a sentence.
        details: more text, printed with `--verbose`.
    """

    text: str
    data: object
    diagnostics: tuple[Diagnostic, ...] = ()
    code: ExitCode = ExitCode.SUCCESS
    failure: str | None = None
    details: str = ""


def format_table(rows: Sequence[Sequence[str]], left_columns: int = 1) -> str:
    """Align rows of cells in columns, the first `left_columns` to the left, others to the right.

    Rows may have different lengths; lines have no trailing spaces.
    """
    widths: dict[int, int] = {}
    for row in rows:
        for k, cell in enumerate(row):
            widths[k] = max(widths.get(k, 0), len(cell))
    lines = (
        "  ".join(
            cell.ljust(widths[k]) if k < left_columns else cell.rjust(widths[k])
            for k, cell in enumerate(row)
        ).rstrip()
        for row in rows
    )
    return "\n".join(lines)


def finite_or_none(number: float | None) -> float | None:
    """Return the number, or None if it is not finite."""
    return number if number is not None and isfinite(number) else None


def json_text(data: object) -> str:
    """Return a value as JSON, with null for numbers that are not finite."""
    try:
        return json.dumps(data, indent=2, allow_nan=False)
    except ValueError:
        return json.dumps(_replace_nonfinite(data), indent=2, allow_nan=False)


def _replace_nonfinite(data: object) -> object:
    if isinstance(data, float):
        return finite_or_none(data)
    if isinstance(data, Mapping):
        return {
            key: _replace_nonfinite(value) for key, value in cast("Mapping[Any, Any]", data).items()
        }
    if isinstance(data, list | tuple):
        return [_replace_nonfinite(value) for value in cast("Sequence[Any]", data)]
    return data
