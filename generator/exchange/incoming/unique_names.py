"""Names that the figure language has, each given once."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import count, takewhile

from generator.reader.tokens import LONGEST_WORD
from generator.reader.vocabulary import WORDS

_ODD = re.compile(r"[^A-Za-z0-9_]")
_ROOM = 12
"""Characters that are left for a number at the end."""


@dataclass
class Names:
    """Names of one kind.

    Attributes:
        changed: by the name that was asked for, the one that was given instead.
    """

    changed: dict[str, str] = field(default_factory=dict[str, str])
    _given: set[str] = field(default_factory=set[str])
    _kept: set[str] = field(default_factory=set[str])

    def keep(self, names: Iterable[str]) -> None:
        """Put names of the model that need no change aside: none is made of another one."""
        self._kept |= {name for name in names if _valid(name) == name}

    def taken(self, asked: str) -> str:
        """The name that is given for one that is asked for: itself where it can be."""
        word = _valid(asked)
        if word in self._given or (word in self._kept and word != asked):
            gone = self._given | self._kept
            word = next(new for k in count(2) if (new := f"{word}_{k}") not in gone)
        self._given.add(word)
        if word != asked:
            self.changed[asked] = word
        return word

    def made(self, stem: str) -> str:
        """The name that is given for one that the model does not have."""
        free = next(new for k in count(1) if (new := _numbered(stem, k)) not in self._kept)
        return self.taken(free)


def _numbered(stem: str, k: int) -> str:
    return stem if k == 1 else f"{stem}_{k}"


def _valid(asked: str) -> str:
    """The name, or what the figure language has nearest to it."""
    word = _ODD.sub("_", asked)[: LONGEST_WORD - _ROOM]
    if not word or word[0].isdigit():
        word = f"_{word}"
    return f"{word}_" if word in WORDS else word


def common_stem(names: tuple[str, ...]) -> str:
    """What several names share at their beginning and their end: `hip_right` of `hip_x_right` ...

    Empty where they share nothing.
    """
    front = _same_beginning(names)
    back = _same_beginning([name[len(front) :][::-1] for name in names])[::-1]
    stem = f"{front.rstrip('_')}{back}" if front else back.lstrip("_")
    return stem if any(letter.isalpha() for letter in stem) else ""


def _same_beginning(names: Sequence[str]) -> str:
    letters = takewhile(lambda column: len(set(column)) == 1, zip(*names, strict=False))
    return "".join(column[0] for column in letters)
