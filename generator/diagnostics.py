"""Diagnostics of inputs, with their places in the text, and the errors of the project."""

from bisect import bisect_left
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from springs.short_repr import represent_mapping

_NEWLINE = ord("\n")


@dataclass(frozen=True)
class Source:
    """A text, its name for the user (a path, or `prototype` for a shipped figure), and its file."""

    name: str
    text: str = field(repr=False)
    path: Path | None = field(default=None, compare=False, repr=False)

    @cached_property
    def _line_starts(self) -> NDArray[np.int64]:
        """Offset of the first character of each line; an array, since texts may be large."""
        codes = np.frombuffer(self.text.encode("utf-32-le", "surrogatepass"), dtype="<u4")
        return np.concatenate([np.zeros(1, np.int64), np.flatnonzero(codes == _NEWLINE) + 1])

    def line_and_column(self, offset: int) -> tuple[int, int]:
        """Line and column, both counted from 1, of the character at `offset`."""
        index = int(np.searchsorted(self._line_starts, offset, side="right")) - 1
        return index + 1, offset - int(self._line_starts[index]) + 1

    def line_text(self, number: int) -> str:
        """The text of line `number` (counted from 1), without its end."""
        start = int(self._line_starts[number - 1])
        end = self.text.find("\n", start)
        return self.text[start : None if end == -1 else end].rstrip("\r")


@dataclass(frozen=True)
class Span:
    """The characters `start <= offset < end` of a source."""

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

    def extend_to(self, other: "Span") -> "Span":
        """The span from the start of this one to the end of `other`."""
        return Span(self.source, self.start, max(self.end, other.end))


_MAX_LINE_WIDTH = 100

_NEIGHBOURS_PER_SIDE = 50

_MAX_WORDS_LISTED = 20


class Severity(Enum):
    """Severity of a diagnostic: an error stops the command, a warning does not.

    A note is for the reader of a whole report, `mover check`; other commands leave it out.
    """

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True)
class Diagnostic:
    """An error or a warning about an input, with its place.

    `message` is what is wrong, `hint` what to do about it. `span` is None only for a file without a
    text (it is missing, or is a directory).
    """

    severity: Severity
    message: str
    span: Span | None = None
    hint: str = ""

    def __str__(self) -> str:
        """Format as compilers do: place, sentence, line, mark, hint."""
        hint = [f"  hint: {self.hint}"] if self.hint else []
        head = self.first_line
        if self.span is None:
            return "\n".join([head, *hint])
        number, column = self.span.source.line_and_column(self.span.start)
        line, first, width = _excerpt(self.span, number, column)
        gutter = f"{number:>5} | "
        mark = " " * (len(gutter) - 2) + "| " + " " * first + "^" * width
        return "\n".join([head, gutter + line, mark, *hint])

    @property
    def first_line(self) -> str:
        """Place, severity and message."""
        message = f"{self.severity.value}: {self.message}"
        if self.span is None:
            return message
        number, column = self.span.source.line_and_column(self.span.start)
        return f"{self.span.source.name}:{number}:{column}: {message}"

    def to_json(self) -> dict[str, object]:
        """Data for `--json`: severity, message, hint, file, line, column."""
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
    """The line, cut to a readable width, and the column and width of the mark in it."""
    line = span.source.line_text(number)
    first = column - 1
    cut = max(0, first - _MAX_LINE_WIDTH // 2) if len(line) > _MAX_LINE_WIDTH else 0
    shown = line[cut : cut + _MAX_LINE_WIDTH]
    printable = "".join(char if char.isprintable() else " " for char in shown)
    width = max(1, min(span.end - span.start, len(line) - first, _MAX_LINE_WIDTH // 2))
    return printable, first - cut, width


def error(message: str, span: Span | None = None, hint: str = "") -> Diagnostic:
    """Make a diagnostic that stops the command."""
    return Diagnostic(Severity.ERROR, message, span, hint)


def warning(message: str, span: Span | None = None, hint: str = "") -> Diagnostic:
    """Make a diagnostic that is shown and does not stop the command."""
    return Diagnostic(Severity.WARNING, message, span, hint)


def select_errors(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The diagnostics that stop the command."""
    return tuple(one for one in diagnostics if one.severity is Severity.ERROR)


def closest_match(word: str, known: Iterable[str]) -> str | None:
    """The known word that `word` is probably a slip of, if there is one.

    Of very many known words only the alphabetical neighbours are compared.
    """
    words = sorted(set(known))
    if len(words) > 2 * _NEIGHBOURS_PER_SIDE:
        place = bisect_left(words, word)
        words = words[max(0, place - _NEIGHBOURS_PER_SIDE) : place + _NEIGHBOURS_PER_SIDE]
    from difflib import get_close_matches

    close = get_close_matches(word, words, n=1, cutoff=0.6)
    return close[0] if close else None


def spelling_hint(word: str, known: Iterable[str]) -> str:
    """A hint naming the known word nearest to `word`, or all of them when none is near."""
    words = sorted(set(known))
    near = closest_match(word, words)
    if near is not None:
        return f"did you mean `{near}`?"
    if len(words) > _MAX_WORDS_LISTED:
        listed, more = ", ".join(words[:_MAX_WORDS_LISTED]), len(words) - _MAX_WORDS_LISTED
        return f"known here: {listed} and {more} more"
    return f"known here: {', '.join(words)}" if words else ""


class MoverError(Exception):
    """Base of every error that this project raises on purpose."""


class InputError(MoverError):
    """The input is wrong. `diagnostics` holds all errors and warnings."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        """Join all diagnostics to one message."""
        self.diagnostics = tuple(diagnostics)
        super().__init__("\n".join(str(diagnostic) for diagnostic in self.diagnostics))

    def __reduce__(self) -> tuple[type["InputError"], tuple[tuple[Diagnostic, ...]]]:
        """Pickle the diagnostics, from which the message follows."""
        return type(self), (self.diagnostics,)


class UsageError(MoverError):
    """An option, a name or a path is unknown or does not fit the others."""


class ModelError(MoverError, ValueError):
    """A figure, its joints or its springs cannot be modelled as asked; the message says why."""


class WallLimitError(MoverError):
    """The wall-time limit of a run was reached before the run had a motion."""


class NotInstalledError(MoverError):
    """A program or library that is needed is not installed."""


T = TypeVar("T")


@dataclass(frozen=True)
class Parsed(Generic[T]):
    """The value read from an input, and the diagnostics of that input.

    `value` is None if and only if `diagnostics` holds an error.
    """

    value: T | None
    diagnostics: tuple[Diagnostic, ...]

    def require_value(self) -> T:
        """Return the value. Raises InputError with all diagnostics if there is none."""
        if self.value is None:
            raise InputError(self.diagnostics)
        return self.value


MAX_DIAGNOSTICS = 100
"""Largest number of errors, and of warnings, that are shown at once."""


class TooManyErrors(Exception):  # noqa: N818 - it ends the reading, it is not an error of its own
    """Reading stops, because more errors would tell nothing new."""


@dataclass
class Diagnostics:
    """Collector of the diagnostics of one input.

    `has_syntax_errors`: the text does not follow the grammar. `is_incomplete`: a part of the input
    could not be read, so what seems to be absent is not reported.
    """

    entries: list[Diagnostic] = field(default_factory=list[Diagnostic])
    has_syntax_errors: bool = False
    is_incomplete: bool = False
    _error_count: int = 0
    _reported: set[tuple[str, Span | None]] = field(default_factory=set[tuple[str, Span | None]])

    def error(self, message: str, span: Span | None, hint: str = "") -> None:
        """Add an error, once. Raises TooManyErrors at the last one that is shown."""
        if (message, span) in self._reported:
            return
        self._reported.add((message, span))
        self._error_count += 1
        if self._error_count < MAX_DIAGNOSTICS:
            self.entries.append(error(message, span, hint))
            return
        stopped = f"reading stopped here, after {MAX_DIAGNOSTICS} errors"
        hint = hint if hint.endswith(stopped) else _append_hint(hint, stopped)
        self.entries.append(error(message, span, hint))
        raise TooManyErrors

    def warning(self, message: str, span: Span | None, hint: str = "") -> None:
        """Add a warning."""
        self.entries.append(warning(message, span, hint))

    def note(self, message: str, span: Span | None, hint: str = "") -> None:
        """Add a note."""
        self.entries.append(Diagnostic(Severity.NOTE, message, span, hint))

    def syntax_error(self, message: str, span: Span, hint: str = "") -> None:
        """Add an error of grammar, unless the last diagnostic is at the same place."""
        if self.entries and self.entries[-1].span == span:
            return
        self.has_syntax_errors = self.is_incomplete = True
        self.error(message, span, hint)

    @contextmanager
    def muted(self) -> Generator[None, None, None]:
        """Leave out what is reported in a block, as if it were the first; too much ends it."""
        state = self.entries, self._error_count, self._reported
        self.entries, self._error_count, self._reported = [], 0, set()
        with suppress(TooManyErrors):
            yield
        self.entries, self._error_count, self._reported = state

    def extend(self, other: "Diagnostics") -> None:
        """Add the diagnostics of a part of the input. Raises TooManyErrors as `error` does."""
        for one in other.entries:
            if one.severity is Severity.ERROR:
                self.error(one.message, one.span, one.hint)
            else:
                self.entries.append(one)

    @property
    def has_errors(self) -> bool:
        """Return whether there is an error."""
        return self._error_count > 0

    def sorted_by_position(self) -> tuple[Diagnostic, ...]:
        """The diagnostics in the order of the text.

        Of the warnings only the first 100; the last of them says how many more there are.
        """
        warnings = [
            f for f in sorted(self.entries, key=_start_offset) if f.severity is Severity.WARNING
        ]
        more = len(warnings) - MAX_DIAGNOSTICS
        if more > 0:
            last = warnings[MAX_DIAGNOSTICS - 1]
            hint = _append_hint(last.hint, f"and {more} more warning{'s' if more > 1 else ''}")
            warnings[MAX_DIAGNOSTICS - 1 :] = [replace(last, hint=hint)]
        notes = [one for one in self.entries if one.severity is Severity.NOTE]
        return tuple(sorted([*select_errors(self.entries), *warnings, *notes], key=_start_offset))


def _start_offset(diagnostic: Diagnostic) -> int:
    return diagnostic.span.start if diagnostic.span else -1


def _append_hint(first: str, second: str) -> str:
    return f"{first}; {second}" if first else second


def format_count(count: int, noun: str) -> str:
    """Return a count with its noun: `1 joint`, `2 joints`, `no joints`."""
    return f"{count or 'no'} {noun}{'' if count == 1 else 's'}"


def shorten(word: str) -> str:
    """`word` as a sentence quotes it: cut when it is long."""
    return word if len(word) <= 40 else word[:37] + "..."


class UnknownNameError(ModelError, KeyError):
    """A mapping has no such name; the message states the nearest one."""

    def __str__(self) -> str:
        """The sentence, without the quotes of a KeyError."""
        return str(self.args[0])


class Named(Protocol):
    """A value with a name."""

    @property
    def name(self) -> str:
        """The name."""
        ...


V = TypeVar("V")
N = TypeVar("N", bound=Named)


class NamedMapping(dict[str, V]):
    """Values by name, in order; `mapping[name]` raises UnknownNameError for an unknown name.

    `subject` opens its sentence: "the figure has no joint".
    """

    def __init__(self, values: Mapping[str, V] | Iterable[tuple[str, V]] = (), subject: str = ""):
        """Copy the values."""
        super().__init__(values)
        self.subject = subject or "there is no name"

    def __repr__(self) -> str:
        """Number of values and the first names, in a line."""
        return represent_mapping(self)

    def __missing__(self, name: str) -> V:
        """Raise UnknownNameError."""
        hint = spelling_hint(str(name), self) or "it has none"
        raise UnknownNameError(f"{self.subject} `{shorten(str(name))}`; {hint}")


def by_name(*values: N) -> dict[str, N]:
    """Return segments, sites, joints or attributes as a mapping from their names.

    Raises ModelError for a name that occurs twice.
    """
    mapping: dict[str, N] = {}
    for value in values:
        if mapping.setdefault(value.name, value) is not value:
            raise ModelError(f"two values are named `{shorten(value.name)}`")
    return mapping
