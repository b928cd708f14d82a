"""Closed surfaces lofted through cross sections along an axis, with round ends.

A section is half a superellipse in front of its widest line and half of another one behind it:

    x = centre + front c,   x = centre - back c,   y = breadth / 2 s

where (c, s) is the point of |c|^n + |s|^n = 1 in a direction. Its sizes are interpolated along the
axis by monotone cubics (Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980), which do not
overshoot: between two sections a limb is nowhere thicker than the thicker one. As each triangle
stays between two neighbouring planes, and each section is convex, the surface does not meet itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from generator.geometry.surface import Array, Surface

GRID = 1e-5
"""Spacing of the grid to which vertices are rounded, which keeps the files short [m]."""


@dataclass(frozen=True)
class Section:
    """Cross section of a loft.

    Attributes:
        at: position along the axis [m].
        breadth: full size across the plane of symmetry [m].
        front: from the widest line forward [m].
        back: from the widest line backward [m].
        centre: position of the widest line, forward [m].
        front_exponent: of the superellipse in front: 2 is an ellipse, larger ones are squarer.
        back_exponent: of the superellipse behind.
    """

    at: float
    breadth: float
    front: float
    back: float
    centre: float = 0.0
    front_exponent: float = 2.0
    back_exponent: float = 2.0

    @property
    def numbers(self) -> Array:
        """Its attributes in order, shape (7,)."""
        return np.array([getattr(self, field.name) for field in fields(self)], dtype=float)


def section_outline(section: Section, sides: int) -> Array:
    """Points forward and across [m], shape (sides, 2), counter-clockwise from the front."""
    half = np.linspace(0.0, np.pi, sides // 2 + 1)
    c, s = np.cos(half), np.sin(half)
    c[abs(c) < 1e-12], s[-1] = 0.0, 0.0
    exponent = np.where(c >= 0.0, section.front_exponent, section.back_exponent)
    reach = (np.abs(c) ** exponent + np.abs(s) ** exponent) ** (-1.0 / exponent)
    forward = section.centre + np.where(c >= 0.0, section.front, section.back) * reach * c
    across = 0.5 * section.breadth * reach * s
    return np.concatenate(
        [
            np.stack([forward, across], axis=1),
            np.stack([forward, -across], axis=1)[-2:0:-1],
        ]
    )


def section_girth(section: Section) -> float:
    """Perimeter [m]."""
    outline = section_outline(section, 360)
    return float(np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1).sum())


def sections_between(sections: Sequence[Section], places: Array) -> list[Section]:
    """Return the sections at positions along the axis, by monotone cubics."""
    from scipy.interpolate import PchipInterpolator

    table = np.stack([section.numbers for section in sections])
    return [Section(*map(float, row)) for row in PchipInterpolator(table[:, 0], table)(places)]


@dataclass(frozen=True)
class Cap:
    """Round end of a loft.

    Attributes:
        height: from the last section to the pole [m].
        exponent: of the superellipse of its outline: 2 is a half ellipsoid.
        rings: of vertices between the last section and the pole.
        centre: of the pole, forward [m]; None for that of the section's outline.
    """

    height: float
    exponent: float = 2.0
    rings: int = 4
    centre: float | None = None


@dataclass(frozen=True)
class Loft:
    """Surface through sections along an axis.

    Attributes:
        sections: in ascending order along the axis.
        places: of the rings of vertices, the first and the last those of the end sections [m].
        sides: corners of each ring, an even number.
        low_cap: round end at the first section.
        high_cap: round end at the last section.
    """

    sections: Sequence[Section]
    places: Array
    sides: int
    low_cap: Cap
    high_cap: Cap

    def outlines(self) -> tuple[Array, Array]:
        """Rings of points (forward, across, along), and the two poles [m].

        Shapes (rings, sides, 3) and (2, 3).
        """
        middle = [
            np.column_stack([section_outline(section, self.sides), np.full(self.sides, section.at)])
            for section in sections_between(self.sections, self.places)
        ]
        low, low_pole = _cap_rings(middle[0], self.low_cap, -1.0)
        high, high_pole = _cap_rings(middle[-1], self.high_cap, 1.0)
        return np.array([*low[::-1], *middle, *high]), np.array([low_pole, high_pole])


def _cap_rings(last: Array, cap: Cap, sign: float) -> tuple[list[Array], Array]:
    """Return the rings of a cap from the last section on, and its pole."""
    forward = 0.5 * (last[:, 0].min() + last[:, 0].max()) if cap.centre is None else cap.centre
    middle = np.array([forward, 0.0, last[0, 2]])
    axis = np.array([0.0, 0.0, sign * cap.height])
    rings: list[Array] = []
    for turn in 0.5 * np.pi * np.arange(1, cap.rings + 1) / (cap.rings + 1):
        c, s = np.cos(turn), np.sin(turn)
        reach = (c**cap.exponent + s**cap.exponent) ** (-1.0 / cap.exponent)
        rings.append(middle + reach * c * (last - middle) + reach * s * axis)
    return rings, middle + axis


def loft_surface(rings: Array, poles: Array, axes: Array, name: str) -> Surface:
    """Return the triangles of rings and poles, symmetric about the plane across = 0.

    Args:
        rings: (forward, across, along), shape (r, n, 3) [m].
        poles: below the first and above the last ring, shape (2, 3) [m].
        axes: directions forward, across, along in the segment's frame, in columns; right-handed.
        name: of the surface.
    """
    count, sides = rings.shape[:2]
    points = np.concatenate([poles[:1], rings.reshape(-1, 3), poles[1:]])
    k = np.arange(sides)
    after = (k + 1) % sides
    top = 1 + count * sides
    faces = [np.stack([np.zeros(sides, dtype=int), 1 + after, 1 + k], axis=1)]
    # The diagonals of one half are the mirror images of those of the other.
    first = k < sides // 2
    for ring in range(count - 1):
        low, high = 1 + ring * sides, 1 + (ring + 1) * sides
        a, b, c, d = low + k, low + after, high + after, high + k
        one = np.where(first[:, None], np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
        two = np.where(first[:, None], np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
        faces += [one, two]
    last = top - sides
    faces.append(np.stack([np.full(sides, top), last + k, last + after], axis=1))
    vertices = np.round(points @ axes.T / GRID) * GRID
    return Surface.from_faces(vertices, np.concatenate(faces), name)
