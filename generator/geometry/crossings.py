"""Whether the edges of one set of triangles pass through another's."""

import numpy as np

from generator.geometry.surface import Array, Indices, Mask

AT_ONCE = 200_000
"""Pairs of an edge and a triangle that are compared together."""

DEEPEST = 40
"""Halvings of space after which pairs are compared however many they are."""

TOUCHING = 1e-9
"""Volumes below this, relative to the cube of an edge and a triangle's extent, mean a touch."""


def crosses(one: Array, two: Array) -> bool:
    """Whether two sets of triangles, shapes (n, 3, 3) and (m, 3, 3), cut through each other.

    They do when an edge of one passes through the inner part of a triangle of the other.
    """
    return _edges_cross(one, two) or _edges_cross(two, one)


def _edges_cross(one: Array, two: Array) -> bool:
    edges = np.concatenate([one[:, [0, 1]], one[:, [1, 2]], one[:, [2, 0]]])
    # Each inner edge belongs to two triangles that run it in opposite directions.
    edges = edges[_first_of_two(edges)]
    low = np.maximum(one.min(axis=(0, 1)), two.min(axis=(0, 1)))
    high = np.minimum(one.max(axis=(0, 1)), two.max(axis=(0, 1)))
    edges, triangles = edges[_overlap(edges, low, high)], two[_overlap(two, low, high)]
    return _any_hit(edges, triangles, 0)


def _first_of_two(edges: Array) -> Mask:
    """One half-edge of each edge: the one whose end comes after its start in some fixed order."""
    difference = edges[:, 1] - edges[:, 0]
    leading = (difference != 0.0).argmax(axis=1)
    return difference[np.arange(len(edges)), leading] > 0.0


def _overlap(shapes: Array, low: Array, high: Array) -> Mask:
    """Which shapes, (n, corners, 3), have an extent that meets a box."""
    return ((shapes.min(axis=1) <= high) & (shapes.max(axis=1) >= low)).all(axis=1)


def _any_hit(edges: Array, triangles: Array, depth: int) -> bool:
    """Whether any edge passes through any triangle: space is halved until they are few."""
    if not len(edges) or not len(triangles):
        return False
    if len(edges) * len(triangles) <= AT_ONCE:
        return _hits(edges, triangles)
    if depth == DEEPEST:
        step = max(1, AT_ONCE // len(triangles))
        return any(_hits(edges[k : k + step], triangles) for k in range(0, len(edges), step))
    middles = edges.mean(axis=1)
    axis = int(np.ptp(middles, axis=0).argmax())
    cut = float(np.median(middles[:, axis]))
    for sign in (1.0, -1.0):
        near = _reaches(edges, axis, cut, sign), _reaches(triangles, axis, cut, sign)
        if near[0].all() and near[1].all():
            depth = DEEPEST - 1
        if _any_hit(edges[near[0]], triangles[near[1]], depth + 1):
            return True
    return False


def _reaches(shapes: Array, axis: int, cut: float, sign: float) -> Mask:
    """Which shapes reach the side of a plane that `sign` tells."""
    return (sign * (shapes[..., axis] - cut)).max(axis=1) >= 0.0


def _hits(edges: Array, triangles: Array) -> bool:
    """Whether any edge passes through the inner part of any triangle."""
    e, t = _pairs_of_extents(edges, triangles)
    p, q = edges[e, 0], edges[e, 1]
    a, b, c = (triangles[t, k] for k in range(3))
    all_five = np.stack([p, q, a, b, c])
    slack = TOUCHING * np.linalg.norm(np.ptp(all_five, axis=0), axis=1) ** 3
    ends = _volumes(a, b, c, p), _volumes(a, b, c, q)
    sides = np.stack([_volumes(p, q, a, b), _volumes(p, q, b, c), _volumes(p, q, c, a)])
    apart = np.minimum(*map(np.abs, ends)) > slack
    through = (sides > slack).all(axis=0) | (sides < -slack).all(axis=0)
    return bool((apart & (ends[0] * ends[1] < 0.0) & through).any())


def _pairs_of_extents(edges: Array, triangles: Array) -> tuple[Indices, Indices]:
    """The edges and triangles whose extents meet."""
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    meets = (edges.min(axis=1)[:, None] <= high) & (edges.max(axis=1)[:, None] >= low)
    e, t = np.nonzero(meets.all(axis=-1))
    return e, t


def _volumes(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Six times the signed volumes of tetrahedra, shape (n,)."""
    return ((b - a) * np.cross(c - a, d - a)).sum(axis=-1)
