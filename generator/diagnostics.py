"""What can go wrong, said in sentences with a place.

Where something was written: a text and a stretch of it.

The faults found so far in one input, and when it is enough.
"""

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

_NEWLINE = ord("\n")


@dataclass(frozen=True)
class Source:
    """A text and the name a user knows it by (a path, or `prototype` for a shipped figure)."""

    name: str
    text: str = field(repr=False)

    @cached_property
    def _line_starts(self) -> NDArray[np.int64]:
        """Offset of the first character of each line; an array, since texts may be large."""
        codes = np.frombuffer(self.text.encode("utf-32-le", "surrogatepass"), dtype="<u4")
        return np.concatenate([np.zeros(1, np.int64), np.flatnonzero(codes == _NEWLINE) + 1])

    def line_and_column(self, offset: int) -> tuple[int, int]:
        """Line and column, both counted from 1, of the character at `offset`."""
        index = int(np.searchsorted(self._line_starts, offset, side="right")) - 1
        return index + 1, offset - int(self._line_starts[index]) + 1

    def line(self, number: int) -> str:
        """The text of line `number` (counted from 1), without its end."""
        start = int(self._line_starts[number - 1])
        end = self.text.find("\n", start)
        return self.text[start : None if end == -1 else end].rstrip("\r")


@dataclass(frozen=True)
class Span:
    """The stretch `start <= offset < end` of a source."""

    source: Source
    start: int
    end: int

    @property
    def text(self) -> str:
        """The characters that the span covers."""
        return self.source.text[self.start : self.end]

    @property
    def line(self) -> int:
        """Number of the line in which the span starts, from 1."""
        return self.source.line_and_column(self.start)[0]

    @property
    def column(self) -> int:
        """Column in which the span starts, from 1."""
        return self.source.line_and_column(self.start)[1]

    def to(self, other: "Span") -> "Span":
        """The span from the start of this one to the end of `other`."""
        return Span(self.source, self.start, max(self.end, other.end))


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


ENOUGH = 100
"""No reader wants more errors, or more warnings, than this at once."""


class EnoughFaults(Exception):  # noqa: N818 - it ends the reading, it is not an error of its own
    """So many errors were found that reading on tells nothing new."""


@dataclass
class Findings:
    """Collects the faults of one input.

    `malformed` says that the grammar was broken somewhere, `partial` that a part of the input is
    unknown: what seems to be absent may then be there, so absences are not reported.
    """

    faults: list[Fault] = field(default_factory=list[Fault])
    malformed: bool = False
    partial: bool = False
    _errors: int = 0

    def error(self, message: str, span: Span | None, hint: str = "") -> None:
        """Note an error. Raises EnoughFaults when there are too many to go on."""
        self._errors += 1
        if self._errors < ENOUGH:
            self.faults.append(error(message, span, hint))
            return
        stopped = f"reading stopped here, after {ENOUGH} errors"
        self.faults.append(error(message, span, _joined(hint, stopped)))
        raise EnoughFaults

    def warning(self, message: str, span: Span | None, hint: str = "") -> None:
        """Note a warning."""
        self.faults.append(warning(message, span, hint))

    def malformation(self, message: str, span: Span, hint: str = "") -> None:
        """Note an error of grammar, unless it echoes the one before at the same place."""
        if self.faults and self.faults[-1].span == span:
            return
        self.malformed = self.partial = True
        self.error(message, span, hint)

    @property
    def has_errors(self) -> bool:
        """Whether anything stops the command."""
        return self._errors > 0

    def in_order(self) -> tuple[Fault, ...]:
        """The faults in the order of the text.

        Of the warnings only the first 100; the last of them says how many more there were.
        """
        warnings = [f for f in sorted(self.faults, key=_start) if f.severity is Severity.WARNING]
        more = len(warnings) - ENOUGH
        if more > 0:
            last, told = warnings[ENOUGH - 1], f"and {more} more warning{'s' if more > 1 else ''}"
            warnings[ENOUGH - 1 :] = [replace(last, hint=_joined(last.hint, told))]
        return tuple(sorted([*errors_among(self.faults), *warnings], key=_start))


def _start(fault: Fault) -> int:
    return fault.span.start if fault.span else -1


def _joined(first: str, second: str) -> str:
    return f"{first}; {second}" if first else second


def shorten(word: str) -> str:
    """`word` as a sentence quotes it: cut when it is long."""
    return word if len(word) <= 40 else word[:37] + "..."
