"""A plane, below which everything is solid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Any, ClassVar

import numpy as np

from generator.contact.shape import (
    LENGTH_BOUND,
    MAX_LENGTH,
    Components,
    Shape,
    Vector,
    join_numbers,
)
from generator.diagnostics import ModelError
from generator.rotations import Array, pose_matrix, rotation_with_z_axis
from generator.toml_file.reader import TableReader
from generator.toml_file.rows import Row, Vector3
from springs.backends import NUMPY, Operations, Real


class _Direction(Vector3):
    """Three numbers that are not all zero."""

    def read(self, table: TableReader) -> Vector | None:
        """Return the numbers."""
        value = super().read(table)
        if value is None or any(value):
            return value
        table.error(self.key, "the normal of a plane must not be zero", "up is [0, 1, 0]")
        return None


@dataclass(frozen=True)
class Plane(Shape):
    """The half-space below a plane.

    Attributes:
        point: Point on the plane [m].
        normal: Vector that points outwards, of any length.
    """

    name: ClassVar[str] = "plane"
    rows: ClassVar[Mapping[str, Row[Any]]] = {
        "point": Vector3("point_m", MAX_LENGTH, LENGTH_BOUND, "coordinate"),
        "normal": _Direction("normal", example="[0, 1, 0]"),
    }

    point: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        """Raise ModelError without a direction."""
        if not (all(map(isfinite, self.normal)) and any(self.normal)):
            raise ModelError("a plane needs a normal that is not zero")

    @cached_property
    def pose(self) -> Array:
        """Axes of the plane, y along the normal, at its point, shape (4, 4)."""
        x, y, z = rotation_with_z_axis(np.divide(self.normal, max(map(abs, self.normal)))).T
        turn = np.eye(3) if np.array_equal(z, (0.0, 1.0, 0.0)) else np.array([x, z, -y]).T
        return pose_matrix(turn, self.point)

    @property
    def lengths(self) -> tuple[()]:
        """None: all planes are alike in their axes."""
        return ()

    @property
    def bounds(self) -> Array:
        """Bounds of the half-space, shape (2, 3) [m]."""
        return np.array([[-np.inf, -np.inf, -np.inf], [np.inf, 0.0, np.inf]])

    def distance(
        self, point: Components, ops: Operations = NUMPY, lengths: Sequence[Real] | None = None
    ) -> tuple[Real, Components]:
        """Return the signed distance and the normal."""
        return point[1], (0.0, 1.0, 0.0)

    def surface(self) -> None:
        """Return None: it has no end."""

    def describe(self) -> str:
        """Return a phrase with point and normal."""
        point, normal = join_numbers(self.point), join_numbers(self.normal)
        return f"plane through ({point}) m, normal ({normal})"
