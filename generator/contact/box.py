"""A box, at any angles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import degrees
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from generator.contact.shape import (
    ANGLES,
    CENTRE,
    LENGTH_BOUND,
    MAX_LENGTH,
    Components,
    Shape,
    Vector,
    join_numbers,
)
from generator.diagnostics import ModelError
from generator.rotations import Array, matrix_from_xyz, pose_matrix
from generator.toml_file.rows import Row, Vector3
from springs.backends import NUMPY, Operations, Real

if TYPE_CHECKING:
    from generator.geometry.surface import Surface

_SIZE = Vector3(
    "size_m",
    MAX_LENGTH,
    LENGTH_BOUND,
    "length",
    ("a length of a box must be above zero", "in m, along its x, y, z"),
    example="[0.5, 0.4, 0.4]",
)


@dataclass(frozen=True)
class Box(Shape):
    """A box.

    Attributes:
        centre: Centre [m].
        size: Lengths of its edges along its own axes [m].
        angles: Intrinsic x-y-z angles of these axes [rad].
    """

    name: ClassVar[str] = "box"
    rows: ClassVar[Mapping[str, Row[Any]]] = {"centre": CENTRE, "size": _SIZE, "angles": ANGLES}
    seldom_written: ClassVar[tuple[str, ...]] = ("angles",)

    centre: Vector = (0.0, 0.0, 0.0)
    size: Vector = (1.0, 1.0, 1.0)
    angles: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Raise ModelError for a box without a volume."""
        if not all(0.0 < length < np.inf for length in self.size):
            raise ModelError("the lengths of a box must be positive")

    @cached_property
    def pose(self) -> Array:
        """Axes of the box at its centre, shape (4, 4)."""
        return pose_matrix(matrix_from_xyz(*self.angles), self.centre)

    @property
    def lengths(self) -> Vector:
        """Lengths of its edges [m]."""
        return self.size

    @property
    def bounds(self) -> Array:
        """Its corners with the least and the largest coordinates, shape (2, 3) [m]."""
        return np.multiply([[-0.5], [0.5]], self.size)

    def surface(self) -> "Surface":
        """Return its six faces."""
        from generator.geometry.primitives import box  # slow

        return box(*self.bounds[1].tolist())

    def describe(self) -> str:
        """Return a phrase with size, centre, and angles other than zero."""
        text = f"box {join_numbers(self.size, ' x ')} m at ({join_numbers(self.centre)}) m"
        if any(self.angles):
            text += f", turned by xyz({join_numbers([*map(degrees, self.angles)])}) deg"
        return text

    def distance(
        self, point: Components, ops: Operations = NUMPY, lengths: Sequence[Real] | None = None
    ) -> tuple[Real, Components]:
        """Return the signed distance and the normal.

        Outside, the normal points away from the nearest point of the box; inside, from the
        nearest face.
        """
        size = lengths or self.size
        signs = [ops.smooth_where(p < 0.0, -1.0, 1.0) for p in point]
        beyond = [s * p - 0.5 * length for s, p, length in zip(signs, point, size, strict=True)]
        qx, qy, qz = beyond
        ox, oy, oz = (ops.smooth_where(q > 0.0, q, 0.0) for q in beyond)
        outside = ops.sqrt(ox * ox + oy * oy + oz * oz)
        largest = ops.smooth_where(qx > qy, qx, qy)
        largest = ops.smooth_where(qz > largest, qz, largest)
        is_outside = largest > 0.0
        inverse = 1.0 / ops.smooth_where(is_outside, outside, 1.0)
        x_face = ops.smooth_where(qx > qy, ops.smooth_where(qx > qz, 1.0, 0.0), 0.0)
        z_face = ops.smooth_where(qz > qy, ops.smooth_where(qz > qx, 1.0, 0.0), 0.0)
        faces = (x_face, 1.0 - x_face - z_face, z_face)
        nx, ny, nz = (
            sign * ops.smooth_where(is_outside, o * inverse, face)
            for sign, o, face in zip(signs, (ox, oy, oz), faces, strict=True)
        )
        return ops.smooth_where(is_outside, outside, largest), (nx, ny, nz)
