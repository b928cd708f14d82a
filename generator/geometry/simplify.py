"""Simplification of surfaces with more faces than a drawing or a contact needs."""

import numpy as np

from generator.geometry.surface import Surface

_GROWTH = 1.15
"""Factor of the cells' size from one attempt to the next."""


def simplify(surface: Surface, max_faces: int) -> tuple[Surface, float]:
    """Return a surface of at most `max_faces` triangles, and how far vertices moved at most [m].

    The vertices in each cell of a cubic lattice become one of them, that which is farthest from
    the middle of the surface, so that it keeps its extent (Rossignac & Borrel 1993). Faces without
    three different corners go, and of several with the same corners all but one.
    """
    surface = surface.without_unused_vertices
    triangles = surface.fan_triangles[0].T
    if len(triangles) <= max_faces:
        return Surface.from_faces(surface.vertices, triangles, surface.name), 0.0
    points = surface.vertices
    low, high = points.min(axis=0), points.max(axis=0)
    outermost = np.argsort(-np.linalg.norm(points - (low + high) / 2.0, axis=1), kind="stable")
    corners = points[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = float(np.linalg.norm(across, axis=1).sum()) / 2.0
    # A lattice of this size cuts a plane of this area into so many triangles.
    size = max((2.0 * area / max_faces) ** 0.5, float((high - low).max()) * 1e-6, 1e-12)
    while True:
        cells = np.floor((points - low) / size).astype(np.int64)
        _, first, place = np.unique(
            cells[outermost], axis=0, return_index=True, return_inverse=True
        )
        chosen = np.empty(len(points), dtype=np.int64)
        chosen[outermost] = outermost[first][place.reshape(-1)]
        faces = chosen[triangles]
        one, two, three = faces.T
        faces = faces[(one != two) & (two != three) & (three != one)]
        _, kept = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        faces = faces[np.sort(kept)]
        if len(faces) <= max_faces:
            moved = float(np.linalg.norm(points - points[chosen], axis=1).max())
            return Surface.from_faces(points, faces, surface.name).without_unused_vertices, moved
        size *= _GROWTH
