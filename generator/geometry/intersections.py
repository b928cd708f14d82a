"""Intersection of two sets of triangles, by edges that pass through triangles.

Triangles that lie within the faces of a surface.

For sums `Surface.fans` will do, whose triangles may stick out of a concave face. Where it matters
where a triangle lies, concave faces are cut by clipping ears: a corner that bulges out and whose
triangle holds no other corner is cut off, until a triangle is left.
"""

from itertools import pairwise

import numpy as np

from generator.geometry.surface import Array, Indices, Mask, Surface

MAX_PAIRS_PER_BATCH = 200_000
"""Pairs of an edge and a triangle that are compared together."""

MAX_SUBDIVISION_DEPTH = 40
"""Halvings of space after which pairs are compared however many they are."""

TOUCH_TOLERANCE = 1e-9
"""Volumes below this, relative to the cube of an edge and a triangle's extent, mean a touch."""


def triangles_intersect(one: Array, two: Array) -> bool:
    """Return whether two sets of triangles, (n, 3, 3) and (m, 3, 3), intersect each other.

    They do when an edge of one passes through the inner part of a triangle of the other.
    """
    return _edges_intersect(one, two) or _edges_intersect(two, one)


def _edges_intersect(one: Array, two: Array) -> bool:
    edges = np.concatenate([one[:, [0, 1]], one[:, [1, 2]], one[:, [2, 0]]])
    # Each inner edge belongs to two triangles that run it in opposite directions: keep the one
    # whose end comes after its start in some fixed order.
    difference = edges[:, 1] - edges[:, 0]
    leading = (difference != 0.0).argmax(axis=1)
    edges = edges[difference[np.arange(len(edges)), leading] > 0.0]
    low = np.maximum(one.min(axis=(0, 1)), two.min(axis=(0, 1)))
    high = np.minimum(one.max(axis=(0, 1)), two.max(axis=(0, 1)))
    edges, triangles = edges[_overlaps_box(edges, low, high)], two[_overlaps_box(two, low, high)]
    return _any_intersection(edges, triangles, 0)


def _overlaps_box(shapes: Array, low: Array, high: Array) -> Mask:
    """Return a mask of shapes, (n, corners, 3), whose bounding box meets a box."""
    return ((shapes.min(axis=1) <= high) & (shapes.max(axis=1) >= low)).all(axis=1)


def _any_intersection(edges: Array, triangles: Array, depth: int) -> bool:
    """Return whether any edge passes through any triangle, by recursive bisection of space."""
    if not len(edges) or not len(triangles):
        return False
    if len(edges) * len(triangles) <= MAX_PAIRS_PER_BATCH:
        return _any_pair_intersects(edges, triangles)
    if depth == MAX_SUBDIVISION_DEPTH:
        step = max(1, MAX_PAIRS_PER_BATCH // len(triangles))
        return any(
            _any_pair_intersects(edges[k : k + step], triangles) for k in range(0, len(edges), step)
        )
    middles = edges.mean(axis=1)
    axis = int(np.ptp(middles, axis=0).argmax())
    cut = float(np.median(middles[:, axis]))
    for sign in (1.0, -1.0):
        near = _reaches_side(edges, axis, cut, sign), _reaches_side(triangles, axis, cut, sign)
        if near[0].all() and near[1].all():
            depth = MAX_SUBDIVISION_DEPTH - 1
        if _any_intersection(edges[near[0]], triangles[near[1]], depth + 1):
            return True
    return False


def _reaches_side(shapes: Array, axis: int, cut: float, sign: float) -> Mask:
    """Return a mask of shapes that reach the side of a plane given by `sign`."""
    return (sign * (shapes[..., axis] - cut)).max(axis=1) >= 0.0


def _any_pair_intersects(edges: Array, triangles: Array) -> bool:
    """Return whether any edge passes through the interior of any triangle."""
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    meets = (edges.min(axis=1)[:, None] <= high) & (edges.max(axis=1)[:, None] >= low)
    e, t = np.nonzero(meets.all(axis=-1))  # pairs whose extents meet
    p, q = edges[e, 0], edges[e, 1]
    a, b, c = (triangles[t, k] for k in range(3))
    all_five = np.stack([p, q, a, b, c])
    slack = TOUCH_TOLERANCE * np.linalg.norm(np.ptp(all_five, axis=0), axis=1) ** 3
    ends = _sixfold_volumes(a, b, c, p), _sixfold_volumes(a, b, c, q)
    sides = np.stack(
        [_sixfold_volumes(p, q, a, b), _sixfold_volumes(p, q, b, c), _sixfold_volumes(p, q, c, a)]
    )
    separated = np.minimum(*map(np.abs, ends)) > slack
    through = (sides > slack).all(axis=0) | (sides < -slack).all(axis=0)
    return bool((separated & (ends[0] * ends[1] < 0.0) & through).any())


def _sixfold_volumes(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Six times the signed volumes of tetrahedra, shape (n,)."""
    return ((b - a) * np.cross(c - a, d - a)).sum(axis=-1)


COLLINEARITY_TOLERANCE = 1e-12
"""A corner whose triangle is below this, relative to the square of the face's size, is none."""


def triangulate(surface: Surface) -> tuple[Array, Indices]:
    """Corners of triangles within the faces [m], shape (t, 3, 3), and the face of each, (t,)."""
    fans, owner = surface.fan_triangles
    points = surface.vertices[fans.T]
    # In a concave face the fan has a triangle that looks against the face.
    crosses = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    sums = [np.bincount(owner, crosses[:, axis], surface.face_count) for axis in range(3)]
    against = (crosses * np.stack(sums, axis=1)[owner]).sum(axis=1) < 0.0
    concave = np.unique(owner[against])
    if not len(concave):
        return points, owner
    kept = ~np.isin(owner, concave)
    cut = [_clip_ears(surface, face) for face in concave.tolist()]
    owners = [np.full(len(part), face) for part, face in zip(cut, concave, strict=True)]
    return np.concatenate([points[kept], *cut]), np.concatenate([owner[kept], *owners])


def _clip_ears(surface: Surface, face: int) -> Array:
    """The triangles of one concave face, shape (n - 2, 3, 3)."""
    ring = surface.vertices[surface.corners[surface.starts[face] : surface.starts[face + 1]]]
    flat = _project_to_plane(ring)
    left = list(range(len(ring)))
    triangles: list[tuple[int, int, int]] = []
    while len(left) > 3:
        place = _find_ear(flat, left)
        triangles.append((left[place - 1], left[place], left[(place + 1) % len(left)]))
        del left[place]
    triangles.append((left[0], left[1], left[2]))
    return ring[np.array(triangles)]


def _project_to_plane(ring: Array) -> Array:
    """The corners in two coordinates in which the face runs counter-clockwise, of size one."""
    arms = ring - ring[0]
    normal = sum((np.cross(a, b) for a, b in pairwise(arms)), np.zeros(3))
    axis = int(np.abs(normal).argmax())
    flat = arms[:, [(axis + 1) % 3, (axis + 2) % 3]] / float(np.abs(arms).max())
    return flat if normal[axis] > 0.0 else flat * [-1.0, 1.0]


def _find_ear(flat: Array, left: list[int]) -> int:
    """The place in `left` of a corner that can be cut off: a straight one, else an ear."""
    here = flat[left]
    before, after = np.roll(here, 1, axis=0), np.roll(here, -1, axis=0)
    bulges = _twice_signed_area(before, here, after)
    straight = np.abs(bulges) <= COLLINEARITY_TOLERANCE
    if straight.any():
        return int(straight.argmax())
    for place in np.flatnonzero(bulges > 0.0).tolist():
        a, b, c = before[place], here[place], after[place]
        sides = np.stack(
            [
                _twice_signed_area(a, b, here),
                _twice_signed_area(b, c, here),
                _twice_signed_area(c, a, here),
            ]
        )
        within = (sides >= -COLLINEARITY_TOLERANCE).all(axis=0)
        corner = (here == a).all(axis=1) | (here == b).all(axis=1) | (here == c).all(axis=1)
        if not (within & ~corner).any():
            return int(place)
    return int(bulges.argmax())  # a face whose sides cross has no ear


def _twice_signed_area(a: Array, b: Array, c: Array) -> Array:
    """Twice the signed area of triangles in the plane."""
    one, two = b - a, c - a
    return one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
