"""Triangles that lie within the faces of a surface.

For sums `Surface.fans` will do, whose triangles may stick out of a concave face. Where it matters
where a triangle lies, concave faces are cut by clipping ears: a corner that bulges out and whose
triangle holds no other corner is cut off, until a triangle is left.
"""

from itertools import pairwise

import numpy as np

from generator.geometry.surface import Array, Indices, Surface

STRAIGHT = 1e-12
"""A corner whose triangle is below this, relative to the square of the face's size, is none."""


def triangles_of(surface: Surface) -> tuple[Array, Indices]:
    """Corners of triangles within the faces [m], shape (t, 3, 3), and the face of each, (t,)."""
    fans, owner = surface.fans
    points = surface.vertices[fans.T]
    concave = _concave_faces(points, owner, surface.face_count)
    if not len(concave):
        return points, owner
    kept = ~np.isin(owner, concave)
    cut = [_clipped(surface, face) for face in concave.tolist()]
    owners = [np.full(len(part), face) for part, face in zip(cut, concave, strict=True)]
    return np.concatenate([points[kept], *cut]), np.concatenate([owner[kept], *owners])


def _concave_faces(points: Array, owner: Indices, count: int) -> Indices:
    """Faces whose fan has a triangle that looks against the face."""
    crosses = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    sums = [np.bincount(owner, crosses[:, axis], count) for axis in range(3)]
    against = (crosses * np.stack(sums, axis=1)[owner]).sum(axis=1) < 0.0
    return np.unique(owner[against])


def _clipped(surface: Surface, face: int) -> Array:
    """The triangles of one concave face, shape (n - 2, 3, 3)."""
    ring = surface.vertices[surface.corners[surface.starts[face] : surface.starts[face + 1]]]
    flat = _in_plane(ring)
    left = list(range(len(ring)))
    triangles: list[tuple[int, int, int]] = []
    while len(left) > 3:
        place = _ear(flat, left)
        triangles.append((left[place - 1], left[place], left[(place + 1) % len(left)]))
        del left[place]
    triangles.append((left[0], left[1], left[2]))
    return ring[np.array(triangles)]


def _in_plane(ring: Array) -> Array:
    """The corners in two coordinates in which the face runs counter-clockwise, of size one."""
    arms = ring - ring[0]
    normal = sum((np.cross(a, b) for a, b in pairwise(arms)), np.zeros(3))
    axis = int(np.abs(normal).argmax())
    flat = arms[:, [(axis + 1) % 3, (axis + 2) % 3]] / float(np.abs(arms).max())
    return flat if normal[axis] > 0.0 else flat * [-1.0, 1.0]


def _ear(flat: Array, left: list[int]) -> int:
    """The place in `left` of a corner that can be cut off: a straight one, else an ear."""
    here = flat[left]
    before, after = np.roll(here, 1, axis=0), np.roll(here, -1, axis=0)
    bulges = _area(before, here, after)
    straight = np.abs(bulges) <= STRAIGHT
    if straight.any():
        return int(straight.argmax())
    for place in np.flatnonzero(bulges > 0.0).tolist():
        a, b, c = before[place], here[place], after[place]
        sides = np.stack([_area(a, b, here), _area(b, c, here), _area(c, a, here)])
        within = (sides >= -STRAIGHT).all(axis=0)
        corner = (here == a).all(axis=1) | (here == b).all(axis=1) | (here == c).all(axis=1)
        if not (within & ~corner).any():
            return int(place)
    return int(bulges.argmax())  # a face whose sides cross has no ear


def _area(a: Array, b: Array, c: Array) -> Array:
    """Twice the signed area of triangles in the plane."""
    one, two = b - a, c - a
    return one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
