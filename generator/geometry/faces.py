"""Whether the faces of a surface are polygons: each vertex once, in a plane, with an area."""

from dataclasses import dataclass

import numpy as np

from generator.geometry.surface import LEAST, Array, Indices, Surface

FLAT = 1e-6
"""A face counts as planar up to this deviation, relative to its size."""

WARPED = 0.01
"""Up to this deviation a face is used with a warning, above it the surface is refused."""

NO_AREA = 1e-12
"""A face whose area is below this, relative to the square of its size, has none."""


@dataclass(frozen=True, eq=False)
class FaceFlaws:
    """What is odd about single faces.

    Attributes:
        repeating: faces that pass a vertex twice.
        slivers: triangles without area; they enclose nothing, and do no harm.
        crossed: larger faces without area: their sides cross, or they lie on a line.
        warps: distance of the farthest corner from a face's plane, relative to its size, for those
            that are not planar, by face.
    """

    repeating: Indices
    slivers: Indices
    crossed: Indices
    warps: dict[int, float]


def flaws_of(surface: Surface) -> FaceFlaws:
    """What is odd about single faces of a surface."""
    repeating = _repeating(surface)
    areas = _area_vectors(surface)
    lengths, sizes = np.sqrt((areas**2).sum(axis=0)), _sizes(surface)
    flat = lengths <= NO_AREA * sizes**2
    polygons = surface.sizes > LEAST
    return FaceFlaws(
        repeating,
        slivers=np.flatnonzero(flat & ~polygons),
        crossed=np.flatnonzero(flat & polygons),
        warps=_warps(surface, areas, sizes, np.flatnonzero(polygons & ~flat)),
    )


def _repeating(surface: Surface) -> Indices:
    if (surface.sizes == LEAST).all():
        a, b, c = surface.corners.reshape(-1, 3).T
        return np.flatnonzero((a == b) | (b == c) | (c == a))
    keys = np.sort(surface.face_of_corner * len(surface.vertices) + surface.corners)
    twice = keys[1:][keys[1:] == keys[:-1]]
    return np.unique(twice // len(surface.vertices))


def _area_vectors(surface: Surface) -> Array:
    """Area of each face along its normal [m2], shape (3, m): the sum over its triangles."""
    triangles, owner = surface.fans
    points = np.ascontiguousarray(surface.vertices.T)
    hub = np.take(points, triangles[0], axis=1)
    one, two = (np.take(points, triangles[k], axis=1) - hub for k in (1, 2))
    crosses = np.empty_like(one)
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        crosses[x] = (one[y] * two[z] - one[z] * two[y]) / 2.0
    if len(owner) == surface.face_count:
        return crosses
    sums = [np.bincount(owner, cross, surface.face_count) for cross in crosses]
    return np.stack(sums, dtype=np.float64)


def _sizes(surface: Surface) -> Array:
    """Diagonal of the box about each face [m], shape (m,)."""
    points = np.ascontiguousarray(surface.vertices.T)
    if (surface.sizes == LEAST).all():
        one, two, three = (np.take(points, surface.corners[k::3], axis=1) for k in range(3))
        low = np.minimum(np.minimum(one, two), three)
        high = np.maximum(np.maximum(one, two), three)
    else:
        corners = np.take(points, surface.corners, axis=1)
        low = np.minimum.reduceat(corners, surface.starts[:-1], axis=1)
        high = np.maximum.reduceat(corners, surface.starts[:-1], axis=1)
    return np.sqrt(((high - low) ** 2).sum(axis=0))


def _warps(surface: Surface, areas: Array, sizes: Array, faces: Indices) -> dict[int, float]:
    """How far each of `faces` is from planar, where it is more than rounding."""
    if not len(faces):
        return {}
    firsts = surface.starts[:-1]
    hubs = surface.vertices[surface.corners[firsts]]
    arms = surface.vertices[surface.corners] - hubs[surface.face_of_corner]
    with np.errstate(divide="ignore", invalid="ignore"):  # for faces that are not asked about
        normals = (areas / np.sqrt((areas**2).sum(axis=0))).T
    heights = (arms * normals[surface.face_of_corner]).sum(axis=1)
    middles = np.add.reduceat(heights, firsts) / surface.sizes
    away = np.maximum.reduceat(np.abs(heights - middles[surface.face_of_corner]), firsts)
    warps = away[faces] / sizes[faces]
    return {int(f): float(w) for f, w in zip(faces, warps, strict=True) if w > FLAT}
