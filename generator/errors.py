"""What can go wrong, said in sentences with a place."""

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from enum import Enum

from generator.source import Span

_WIDEST_LINE = 100

_NEIGHBOURS = 50

_LONGEST_LIST = 20


class Severity(Enum):
    """How bad a fault is: an error stops the command, a warning does not."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong or odd, with its place in the input.

    `message` is what is wrong, `hint` what to do about it. `span` is None only for faults of a
    whole file that has no text (it is missing, it is a directory).
    """

    severity: Severity
    message: str
    span: Span | None = None
    hint: str = ""

    def __str__(self) -> str:
        """The fault as a compiler prints it: place, sentence, the line, a mark, the hint."""
        hint = [f"  hint: {self.hint}"] if self.hint else []
        if self.span is None:
            return "\n".join([f"{self.severity.value}: {self.message}", *hint])
        number, column = self.span.source.line_and_column(self.span.start)
        head = f"{self.span.source.name}:{number}:{column}: {self.severity.value}: {self.message}"
        line, first, width = _excerpt(self.span, number, column)
        gutter = f"{number:>5} | "
        mark = " " * (len(gutter) - 2) + "| " + " " * first + "^" * width
        return "\n".join([head, gutter + line, mark, *hint])

    def as_dict(self) -> dict[str, object]:
        """The fault for `--json`: severity, message, hint, file, line, column."""
        place: dict[str, object] = {}
        if self.span is not None:
            line, column = self.span.source.line_and_column(self.span.start)
            place = {"file": self.span.source.name, "line": line, "column": column}
        return {
            "severity": self.severity.value,
            "message": self.message,
            "hint": self.hint,
            **place,
        }


def _excerpt(span: Span, number: int, column: int) -> tuple[str, int, int]:
    """The line to show, cut to a readable width, and where in it the mark goes."""
    line = span.source.line(number)
    first = column - 1
    cut = max(0, first - _WIDEST_LINE // 2) if len(line) > _WIDEST_LINE else 0
    shown = line[cut : cut + _WIDEST_LINE]
    printable = "".join(char if char.isprintable() else " " for char in shown)
    width = max(1, min(span.end - span.start, len(line) - first, _WIDEST_LINE // 2))
    return printable, first - cut, width


def error(message: str, span: Span | None = None, hint: str = "") -> Fault:
    """A fault that stops the command."""
    return Fault(Severity.ERROR, message, span, hint)


def warning(message: str, span: Span | None = None, hint: str = "") -> Fault:
    """A fault that is told and then passed over."""
    return Fault(Severity.WARNING, message, span, hint)


def errors_among(faults: Iterable[Fault]) -> tuple[Fault, ...]:
    """The faults that stop the command."""
    return tuple(fault for fault in faults if fault.severity is Severity.ERROR)


def closest(word: str, known: Iterable[str]) -> str | None:
    """The known word that `word` is probably a slip of, if there is one.

    Of very many known words only the alphabetical neighbours are looked at.
    """
    words = sorted(set(known))
    if len(words) > 2 * _NEIGHBOURS:
        place = bisect_left(words, word)
        words = words[max(0, place - _NEIGHBOURS) : place + _NEIGHBOURS]
    close = get_close_matches(word, words, n=1, cutoff=0.6)
    return close[0] if close else None


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint naming the known word nearest to `word`, or all of them when none is near."""
    words = sorted(set(known))
    near = closest(word, words)
    if near is not None:
        return f"did you mean `{near}`?"
    if len(words) > _LONGEST_LIST:
        return (
            f"known here: {', '.join(words[:_LONGEST_LIST])} and {len(words) - _LONGEST_LIST} more"
        )
    return f"known here: {', '.join(words)}" if words else ""


class MoverError(Exception):
    """Base of every error that this project raises on purpose."""


class InputError(MoverError):
    """The input is wrong. `faults` holds everything that was found, warnings included."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        """Collect the faults; the message is all of them, one after the other."""
        self.faults = tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))
