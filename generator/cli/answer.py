"""The answer of a command, and how columns of text are set."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import isfinite
from typing import Any, cast

from generator.diagnostics import Diagnostic


class ExitCode(IntEnum):
    """What a command returns to the shell."""

    SUCCESS = 0
    WRONG_INPUT = 1
    USAGE = 2
    RUN_FAILED = 3


@dataclass(frozen=True)
class CommandResult:
    """What a command has to say.

    Attributes:
        text: for people.
        data: for `--json`; numbers that are not finite become null.
        diagnostics: warnings found on the way, to be told beside the answer.
        code: exit code.
        failure: the sentence that says why a run failed.
    """

    text: str
    data: object
    diagnostics: tuple[Diagnostic, ...] = ()
    code: ExitCode = ExitCode.SUCCESS
    failure: str | None = None


def format_table(rows: Sequence[Sequence[str]], left_columns: int = 1) -> str:
    """Align rows of cells in columns, the first `left_columns` to the left, others to the right.

    Rows may have different lengths; the last cell of a left-set row is not filled up.
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


def format_count(count: int, noun: str) -> str:
    """`1 joint`, `2 joints`, `no joints`."""
    return f"{count or 'no'} {noun}{'' if count == 1 else 's'}"


def finite_or_none(number: float | None) -> float | None:
    """The number, or None for one that JSON does not have."""
    return number if number is not None and isfinite(number) else None


def json_text(data: object) -> str:
    """The text of a value in JSON, with null for numbers that it does not have."""
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
