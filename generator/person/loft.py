"""Closed surfaces lofted through cross sections along an axis, with round ends.

A section is half a superellipse in front of its widest line and half of another one behind it:

    x = centre + front c,   x = centre - back c,   y = breadth / 2 s

where (c, s) is the point of |c|^n + |s|^n = 1 in a direction. Its sizes are interpolated along the
axis by monotone cubics (Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980), which do not
overshoot: between two sections a limb is nowhere thicker than the thicker one. As each triangle
stays between two neighbouring planes, and each section is convex, the surface does not meet itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise

import numpy as np

from generator.geometry.surface import Array, Indices, Mask, Surface

DECIMALS = 5
"""Decimals of the coordinates of vertices in metres, which keeps the files short."""

MAX_RING_HEIGHT = 0.95
"""Highest ring of a cap, relative to its height."""

SEAM = 0.006
"""Distance of the rings on both sides of a joint [m], by which its shade is that of the limb."""


def ring_places(ends: Sequence[tuple[float, float]], joints: Sequence[float]) -> Array:
    """Return the positions of rings along an axis [m].

    Args:
        ends: positions [m] at which a new spacing begins, with the spacing up to the next one [m];
            the last spacing is unused.
        joints: positions with rings at them and closely beside them [m].
    """
    spread: list[float] = []
    for (low, spacing), (high, _) in pairwise(ends):
        spread += np.linspace(low, high, max(2, round((high - low) / spacing) + 1)).tolist()
    seams = [joint + side for joint in joints for side in (-SEAM, 0.0, SEAM)]
    kept = [at for at in spread if all(abs(at - seam) > SEAM for seam in seams)]
    return np.array(sorted({*kept, *seams}))


@dataclass(frozen=True)
class Section:
    """Cross section of a loft.

    Attributes:
        at: position along the axis [m].
        breadth: full size across the plane of symmetry [m].
        front: front from the widest line forward [m].
        back: back from the widest line backward [m].
        centre: position of the widest line, forward [m].
        front_exponent: front exponent of the superellipse in front: 2 is an ellipse, larger ones
            are squarer.
        back_exponent: back exponent of the superellipse behind.
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


def section_outline(section: Section, sides: int, focus: float = 0.0) -> Array:
    """Points forward and across [m], shape (sides, 2), counter-clockwise from the front.

    They are closer in front by a factor of 1 - `focus`.
    """
    half = np.linspace(0.0, np.pi, sides // 2 + 1)
    half -= focus * np.sin(half)
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


@dataclass(frozen=True)
class Cap:
    """Round end of a part of a loft.

    Attributes:
        height: height from the last section to the pole [m].
        exponent: exponent of the superellipse of its outline: 2 is a half ellipsoid.
        rings: rings of vertices between the last section and the pole, at an end of the loft.
            Within the loft they are at its places.
        pole: position forward of the pole [m]; None for the middle of the last section.
    """

    height: float
    exponent: float = 2.0
    rings: int = 4
    pole: float | None = None

    def ring_sizes(self, end: float, sign: float, places: Array) -> list[tuple[float, float]]:
        """Positions [m] and relative sizes of the rings from the section at `end` on.

        Args:
            end: end of the part [m].
            sign: 1 for the upper end, -1 for the lower.
            places: places of all rings of the loft [m].
        """
        heights = np.sort(sign * (places - end)) / self.height
        heights = heights[(heights > 1e-9) & (heights < MAX_RING_HEIGHT)]
        if len(heights):
            sizes = (1.0 - heights**self.exponent) ** (1.0 / self.exponent)
        else:
            turns = 0.5 * np.pi * (np.arange(1, self.rings + 1) / (self.rings + 1)) ** 1.5
            c, s = np.cos(turns), np.sin(turns)
            reach = (c**self.exponent + s**self.exponent) ** (-1.0 / self.exponent)
            heights, sizes = reach * s, reach * c
        return list(zip((end + sign * self.height * heights).tolist(), sizes.tolist(), strict=True))


@dataclass(frozen=True)
class Relief:
    """Smooth rise or hollow in the front or the back of a loft, the same on both sides.

    Attributes:
        at: position of its middle along the axis [m].
        across: distance of its middle from the plane of symmetry [m].
        height: outward [m]; negative for a hollow.
        above: its extent towards higher positions, as a standard deviation [m].
        below: its extent towards lower positions [m].
        breadth: its extent across [m].
        is_behind: whether it is in the back.
    """

    at: float
    across: float
    height: float
    above: float
    below: float
    breadth: float
    is_behind: bool = False

    def rise(self, ring: Array, section: Section) -> Array:
        """Displacement forward of the points of a section's ring [m], shape (n,)."""
        along = section.at - self.at
        along /= self.above if along > 0.0 else self.below
        sign = -1.0 if self.is_behind else 1.0
        depth = section.back if self.is_behind else section.front
        # Zero at the widest line, where front and back meet.
        facing = np.clip(sign * (ring[:, 0] - section.centre) / depth, 0.0, 1.0)
        away = (np.abs(ring[:, 1]) - self.across) / self.breadth
        return sign * self.height * facing * np.exp(-0.5 * (along**2 + away**2))


@dataclass(frozen=True, eq=False)
class Loft:
    """Sections along an axis, with reliefs on them.

    Attributes:
        sections: sections in ascending order along the axis.
        sides: corners of each ring of vertices, an even number.
        places: places of the rings along the axis, ascending [m].
        reliefs: reliefs on the sections.
        focus: 1 less the spacing of the corners in front, relative to an even one.
    """

    sections: Sequence[Section]
    sides: int
    places: Array
    reliefs: Sequence[Relief] = ()
    focus: float = 0.0

    @cached_property
    def _numbers(self) -> Callable[[float | Array], Array]:
        """Numbers of the sections at positions within the sections [m]."""
        from scipy.interpolate import PchipInterpolator

        table = np.stack([section.numbers for section in self.sections])
        return PchipInterpolator(table[:, 0], table)

    def breadths(self, at: Array) -> Array:
        """Full sizes across the plane of symmetry at positions, shape (n,) [m].

        Beyond the first and the last section they are theirs.
        """
        inside = np.clip(at, self.sections[0].at, self.sections[-1].at)
        return self._numbers(inside)[:, 1]

    def ring(self, at: float) -> Array:
        """Points forward, across, along at a position [m], shape (sides, 3).

        Beyond the first and the last section the outlines are theirs.
        """
        inside = min(max(at, self.sections[0].at), self.sections[-1].at)
        section = Section(at, *map(float, self._numbers(inside)[1:]))
        ring = np.column_stack(
            [section_outline(section, self.sides, self.focus), np.full(self.sides, at)]
        )
        ring[:, 0] += sum(relief.rise(ring, section) for relief in self.reliefs)
        return ring

    def part(self, low: float, high: float, low_cap: Cap, high_cap: Cap) -> tuple[Array, Array]:
        """Rings of points forward, across, along, and the two poles [m].

        Args:
            low: first position, one of `places` [m].
            high: last position, one of `places` [m].
            low_cap: round end before the first position.
            high_cap: round end behind the last position.

        Returns:
            Arrays of shapes (rings, sides, 3) and (2, 3).
        """
        before, low_pole = self._cap_rings(low, low_cap, -1.0)
        behind, high_pole = self._cap_rings(high, high_cap, 1.0)
        inner = self.places[(self.places >= low) & (self.places <= high)]
        middle = [self.ring(at) for at in inner.tolist()]
        return np.array([*before[::-1], *middle, *behind]), np.array([low_pole, high_pole])

    def _cap_rings(self, end: float, cap: Cap, sign: float) -> tuple[list[Array], Array]:
        """Return the rings of a cap from its section on, and its pole.

        They are the sections beyond the end, the smaller the nearer to the pole, at the places of
        the next part: so the cap lies within that part.
        """
        last = self.ring(end)
        forward = 0.5 * (last[:, 0].min() + last[:, 0].max()) if cap.pole is None else cap.pole
        rings: list[Array] = []
        for at, size in cap.ring_sizes(end, sign, self.places):
            ring = self.ring(at)
            ring[:, 0] = forward + size * (ring[:, 0] - forward)
            ring[:, 1] *= size
            rings.append(ring)
        return rings, np.array([forward, 0.0, end + sign * cap.height])


def loft_surface(rings: Array, poles: Array, axes: Array, name: str) -> Surface:
    """Return the triangles of rings and poles, symmetric about the plane across = 0.

    Args:
        rings: (forward, across, along), shape (r, n, 3) [m].
        poles: poles below the first and above the last ring, shape (2, 3) [m].
        axes: directions forward, across, along in the segment's frame, in columns; right-handed.
        name: name of the surface.
    """
    count, sides = rings.shape[:2]
    points = np.concatenate([poles[:1], rings.reshape(-1, 3), poles[1:]])
    k: Indices = np.arange(sides, dtype=np.int64)
    after: Indices = (k + 1) % sides
    top = 1 + count * sides
    faces: list[Indices] = [np.stack([np.zeros_like(k), 1 + after, 1 + k], axis=1)]
    # The diagonals of one half are the mirror images of those of the other.
    first: Mask = (k < sides // 2)[:, None]
    for ring in range(count - 1):
        low, high = 1 + ring * sides, 1 + (ring + 1) * sides
        a, b, c, d = low + k, low + after, high + after, high + k
        one = np.where(first, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
        two = np.where(first, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
        faces += [one, two]
    last = top - sides
    faces.append(np.stack([np.full_like(k, top), last + k, last + after], axis=1))
    vertices = np.round(points @ axes.T, DECIMALS)
    return Surface.from_faces(vertices, np.concatenate(faces), name)
