"""Lines of numbers in DYSPAM's files, as Fortran reads them.

Blanks or commas stand between numbers, and a slash ends a line. Comments from `#` to the end of a
line are an extension, as in `optional`.
"""

import re
from dataclasses import dataclass

from generator.reader.findings import Findings
from generator.reader.tokens import LONGEST_WORD
from generator.reader.units import Dimension, bare_factor, converted, decimal_of
from generator.reader.vocabulary import shown
from generator.source import Source, Span

MOST = 1_000_000
"""No mechanism has so many bodies, joints, points or springs."""

_WORD = re.compile(r"[^\s,]++")
_END = re.compile(r"[#/]")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]{1,6})?")


class BrokenTableError(Exception):
    """A row does not have its form: what follows cannot be told apart. The fault is noted."""


@dataclass(frozen=True)
class Row:
    """The words of a line that has any, and whether commas stand between them."""

    words: tuple[Span, ...]
    has_commas: bool

    @property
    def span(self) -> Span:
        """From the first word to the last."""
        return self.words[0].to(self.words[-1])


class Rows:
    """The rows of a file, taken one after the other; faults go to `findings`."""

    def __init__(self, source: Source, findings: Findings) -> None:
        """Find the rows of a text."""
        self.source = source
        self.findings = findings
        self._rows = _rows(source)
        self._next = 0

    @property
    def ahead(self) -> Row | None:
        """The row that comes next."""
        return self._rows[self._next] if self._next < len(self._rows) else None

    @property
    def left(self) -> int:
        """How many rows there still are."""
        return len(self._rows) - self._next

    @property
    def count(self) -> int:
        """How many faults there are so far."""
        return len(self.findings.faults)

    def take(self, what: str, form: str) -> Row:
        """The next row.

        Args:
            what: what it is, for sentences.
            form: a word for each of its numbers, with blanks between.

        Raises:
            BrokenTableError: the file has ended, or the row has another number of words.
        """
        row, count = self.ahead, len(form.split())
        if row is None:
            self.findings.error(f"the file ends before {what}", self._last(), f"it is `{form}`")
            raise BrokenTableError
        if len(row.words) != count:
            number = len(row.words)
            said = f"{number} value{'s' if number > 1 else ''} instead of {count}"
            self.findings.error(said, row.span, f"here stands {what}, `{form}`")
            raise BrokenTableError
        self._next += 1
        return row

    def finish(self, last: str) -> None:
        """Note a fault when a row is left after what should be the `last`."""
        if self.ahead is not None:
            self.findings.error(f"a line is left over after {last}", self.ahead.span)

    def number(self, word: Span, dimension: Dimension = Dimension.NUMBER) -> float:
        """The number of a word [SI]; zero, with a fault noted, where it is none."""
        if word.end - word.start > LONGEST_WORD or not _NUMBER.fullmatch(word.text):
            hint = "a number looks like `12`, `-0.5` or `2.41e+09`, without a unit"
            self.findings.error(f"`{shown(word.text)}` is not a number", word, hint)
            return 0.0
        try:
            return converted(word.text.lower().replace("d", "e"), bare_factor(dimension))
        except OverflowError:
            said = f"`{shown(word.text)}` is too large"
            self.findings.error(said, word, "a number must be finite")
            return 0.0

    def numbers(
        self, words: tuple[Span, ...], dimension: Dimension = Dimension.NUMBER
    ) -> tuple[float, ...]:
        """The numbers of words of one dimension [SI]."""
        return tuple(self.number(word, dimension) for word in words)

    def whole(self, word: Span, what: str, low: int = 0, high: int = MOST) -> int:
        """The whole number of a word; `low`, with a fault noted, where it is none of the range."""
        before, value = self.count, self.number(word)
        if self.count > before:
            return low
        if not value.is_integer() or not low <= value <= high:
            hint = f"it is {low}" if low == high else f"it is {low} to {high}"
            self.findings.error(f"the {what} is `{shown(word.text)}`", word, hint)
            return low
        return int(value)

    def _last(self) -> Span:
        return self._rows[-1].span if self._rows else Span(self.source, 0, 1)


def number_text(value: float, dimension: Dimension = Dimension.NUMBER, decimals: int = 2) -> str:
    """The shortest cgs number that is read as `value` [SI], with at least `decimals` decimals."""
    text = decimal_of(value, bare_factor(dimension))
    if "e" in text:
        return text
    whole, _, fraction = text.partition(".")
    return f"{whole}.{fraction.ljust(decimals, '0')}"


def _rows(source: Source) -> list[Row]:
    rows: list[Row] = []
    start = 0
    for line in source.text.split("\n"):
        bare = _END.split(line, maxsplit=1)[0]
        words = tuple(
            Span(source, start + match.start(), start + match.end())
            for match in _WORD.finditer(bare)
        )
        if words:
            rows.append(Row(words, "," in bare))
        start += len(line) + 1
    return rows
