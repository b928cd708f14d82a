"""The shape of a prop: pose, distance, bounds, surface, and its table in a file.

A new shape is a class in a module of its own and an entry of `generator.contact.scene.SHAPES`.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from generator.rotations import Array
from generator.toml_file.reader import TableReader
from generator.toml_file.rows import Row, Vector3
from generator.units import INPUT_BOUNDS, Dimension
from springs.backends import NUMPY, Operations, Real

if TYPE_CHECKING:
    from generator.geometry.surface import Surface

Vector = tuple[float, float, float]
Components = tuple[Real, Real, Real]

MAX_LENGTH = 1e3
"""Largest coordinate and length in a scene [m]."""

LENGTH_BOUND = f"at most {MAX_LENGTH:g} m"

CENTRE = Vector3("centre_m", MAX_LENGTH, LENGTH_BOUND, "coordinate", example="[0, 0.2, -0.3]")
_ANGLE_BOUND = INPUT_BOUNDS[Dimension.ANGLE]
ANGLES = Vector3("angles_deg", _ANGLE_BOUND.max_abs, str(_ANGLE_BOUND), "angle")


@dataclass(frozen=True)
class Shape(ABC):
    """Form and place of a prop; one that is built without arguments is an example of its class.

    Attributes:
        name: Name of its table in a scene file.
        rows: Rows of this table, by attribute.
        seldom_written: Attributes that are written where they differ from their defaults.
    """

    name: ClassVar[str]
    rows: ClassVar[Mapping[str, Row[Any]]]
    seldom_written: ClassVar[tuple[str, ...]] = ()

    @cached_property
    @abstractmethod
    def pose(self) -> Array:
        """Axes of the shape in the world, shape (4, 4)."""

    @property
    @abstractmethod
    def lengths(self) -> tuple[float, ...]:
        """Numbers that its distance depends on [m]: as many for each of its class, at most five."""

    @property
    @abstractmethod
    def bounds(self) -> Array:
        """Least and largest coordinates in its axes, infinite without an end, shape (2, 3) [m]."""

    @abstractmethod
    def distance(
        self,
        point: Components,
        ops: Operations = NUMPY,
        lengths: Sequence[Real] | None = None,
    ) -> tuple[Real, Components]:
        """Return the signed distance of a point [m] and its gradient, the outward normal.

        Args:
            point: Coordinates in the axes of the shape [m].
            ops: Kind of the numbers.
            lengths: Numbers in place of `lengths`, which may be arrays or symbols [m].
        """

    @abstractmethod
    def surface(self) -> "Surface | None":
        """Return its surface in its axes; None without an end."""

    @abstractmethod
    def describe(self) -> str:
        """Return a phrase with its numbers."""

    @cached_property
    def is_endless(self) -> bool:
        """Tell whether it has no end in some direction, as a plane; pictures do not frame it."""
        return not bool(np.all(np.isfinite(self.bounds)))

    @classmethod
    def read(cls, table: TableReader) -> "Shape | None":
        """Return the shape of a table; None, with errors noted, if it is wrong."""
        rows = {name: row for name, row in cls.rows.items() if row.key in table.content}
        values = {name: row.read(table) for name, row in rows.items()}
        return None if None in values.values() else cls(**values)

    def write(self) -> Iterator[str]:
        """Yield the lines of its table."""
        default = type(self)()
        for name, row in self.rows.items():
            value = getattr(self, name)
            if name not in self.seldom_written or value != getattr(default, name):
                yield row.write(value)


def join_numbers(numbers: Sequence[float], separator: str = ", ") -> str:
    """Return numbers as text."""
    return separator.join(f"{number:g}" for number in numbers)
