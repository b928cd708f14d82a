"""The answer of a command, and how columns of text are set."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import isfinite

from generator.errors import Fault, MoverError


class ExitCode(IntEnum):
    """What a command returns to the shell."""

    GOOD = 0
    WRONG_INPUT = 1
    USAGE = 2
    RUN_FAILED = 3


class UsageError(MoverError):
    """The command line asks for what there is not."""


@dataclass(frozen=True)
class Answer:
    """What a command has to say.

    Attributes:
        text: for people.
        data: for `--json`.
        faults: warnings found on the way, to be told beside the answer.
        code: exit code.
        failure: the sentence that says why a run failed.
    """

    text: str
    data: object
    faults: tuple[Fault, ...] = ()
    code: ExitCode = ExitCode.GOOD
    failure: str | None = None


def aligned(rows: Sequence[Sequence[str]], left: int = 1) -> str:
    """Rows of cells set in columns, the first `left` of them to the left, the others to the right.

    Rows may have different lengths; the last cell of a left-set row is not filled up.
    """
    widths: dict[int, int] = {}
    for row in rows:
        for k, cell in enumerate(row):
            widths[k] = max(widths.get(k, 0), len(cell))
    lines = (
        "  ".join(
            cell.ljust(widths[k]) if k < left else cell.rjust(widths[k])
            for k, cell in enumerate(row)
        ).rstrip()
        for row in rows
    )
    return "\n".join(lines)


def counted(count: int, noun: str) -> str:
    """`1 joint`, `2 joints`, `no joints`."""
    return f"{count or 'no'} {noun}{'' if count == 1 else 's'}"


def finite(number: float | None) -> float | None:
    """The number, or None for one that JSON does not have."""
    return number if number is not None and isfinite(number) else None
