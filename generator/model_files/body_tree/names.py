"""Names that the figure language has, each given once.

Turning a model's world so that y is up and the figure faces z.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count, takewhile

import numpy as np

from generator.figure_file.lexer import KEYWORDS, MAX_WORD_LENGTH
from generator.model_files.body_tree.tree import Y_UP_FROM_Z_UP
from generator.model_files.mjcf.joints import rotation_from_z_to
from generator.rotations import Array

_INVALID_CHARACTER = re.compile(r"[^A-Za-z0-9_]")
_SUFFIX_LENGTH = 12
"""Characters that are left for a number at the end."""


@dataclass
class Names:
    """Names of one kind.

    Attributes:
        renamed: by the name that was asked for, the one that was given instead.
    """

    renamed: dict[str, str] = field(default_factory=dict[str, str])
    _assigned: set[str] = field(default_factory=set[str])
    _protected: set[str] = field(default_factory=set[str])

    def protect(self, names: Iterable[str]) -> None:
        """Put names of the model that need no change aside: none is made of another one."""
        self._protected |= {name for name in names if _sanitise(name) == name}

    def assign(self, name: str) -> str:
        """The name that is given for one that is asked for: itself where it can be."""
        word = _sanitise(name)
        if word in self._assigned or (word in self._protected and word != name):
            gone = self._assigned | self._protected
            word = next(new for k in count(2) if (new := f"{word}_{k}") not in gone)
        self._assigned.add(word)
        if word != name:
            self.renamed[name] = word
        return word

    def assign_new(self, stem: str) -> str:
        """The name that is given for one that the model does not have."""
        free = next(new for k in count(1) if (new := _numbered(stem, k)) not in self._protected)
        return self.assign(free)


def _numbered(stem: str, k: int) -> str:
    return stem if k == 1 else f"{stem}_{k}"


def _sanitise(name: str) -> str:
    """The name, or what the figure language has nearest to it."""
    word = _INVALID_CHARACTER.sub("_", name)[: MAX_WORD_LENGTH - _SUFFIX_LENGTH]
    if not word or word[0].isdigit():
        word = f"_{word}"
    return f"{word}_" if word in KEYWORDS else word


def common_stem(names: tuple[str, ...]) -> str:
    """What several names share at their beginning and their end: `hip_right` of `hip_x_right` ...

    Empty where they share nothing.
    """
    front = _common_prefix(names)
    back = _common_prefix([name[len(front) :][::-1] for name in names])[::-1]
    stem = f"{front.rstrip('_')}{back}" if front else back.lstrip("_")
    return stem if any(letter.isalpha() for letter in stem) else ""


def _common_prefix(names: Sequence[str]) -> str:
    letters = takewhile(lambda column: len(set(column)) == 1, zip(*names, strict=False))
    return "".join(column[0] for column in letters)


STANDARD_GRAVITY = 9.81
_ALIGNMENT_TOLERANCE = 1e-9


def rotation_to_y_up(gravity: Array) -> Array:
    """The rotation from the model's world to a figure's, shape (3, 3), by its gravity [m/s^2].

    Where y is up nothing turns. Without gravity z counts as up. A direction between the axes is
    brought up by the shortest turn from z.
    """
    size = float(np.linalg.norm(gravity))
    if size == 0.0:
        return Y_UP_FROM_Z_UP
    up = -gravity / size
    if np.abs(up - [0.0, 1.0, 0.0]).max() < _ALIGNMENT_TOLERANCE:
        return np.eye(3)
    if np.abs(up - [0.0, 0.0, 1.0]).max() < _ALIGNMENT_TOLERANCE:
        return Y_UP_FROM_Z_UP
    x, y, z = up.tolist()
    return Y_UP_FROM_Z_UP @ rotation_from_z_to((x, y, z)).T


def gravity_losses(gravity: Array, up: Array) -> Iterator[str]:
    """What to say of the turn, and of a gravity that is not the standard one."""
    columns = [_axis_name(axis) for axis in up.T]
    if columns == ["x", "y", "z"]:
        pass
    elif all(columns):
        yield f"the world is turned: the model's x, y, z are {', '.join(columns)} of the figure's"
    else:
        yield "the world is turned so that gravity points against y"
    size = float(np.linalg.norm(gravity))
    if abs(size - STANDARD_GRAVITY) > 1e-12:
        yield f"gravity of {size:.8g} m/s^2: simulate with `--gravity 0,{-size:.8g},0`"


def _axis_name(axis: Array) -> str:
    """`x`, `-z` ... of a unit vector along a coordinate axis; empty for another."""
    place = int(np.argmax(np.abs(axis)))
    if abs(axis[place]) < 1.0 - _ALIGNMENT_TOLERANCE:
        return ""
    return f"{'-' if axis[place] < 0.0 else ''}{'xyz'[place]}"
