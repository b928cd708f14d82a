"""Where something was written: a text and a stretch of it."""

from dataclasses import dataclass, field
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
