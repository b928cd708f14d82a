"""The faces of a surface as triangles, for programs that draw nothing else."""

import numpy as np

from generator.frames import Array
from generator.geometry.surface import Indices, Surface

_AREA = 1e-12
"""A corner with less area than this, relative to its face's, lies on a line."""


def triangles_of(surface: Surface) -> tuple[Array, Array]:
    """Corners of triangles that cover the faces, and their normals: shapes (3 t, 3) each [m, 1].

    Three rows are a triangle, counter-clockwise from outside. Faces may be concave.
    """
    fans, owners = surface.fans
    points = surface.vertices[fans]
    areas = np.cross(points[1] - points[0], points[2] - points[0])
    whole = np.zeros((surface.face_count, 3))
    np.add.at(whole, owners, areas)
    lengths = np.linalg.norm(whole, axis=1)
    normals = np.divide(
        whole, lengths[:, None], where=lengths[:, None] > 0.0, out=np.zeros_like(whole)
    )
    normals[lengths == 0.0] = [0.0, 1.0, 0.0]
    against = np.sum(areas * normals[owners], axis=1) < -_AREA * lengths[owners]
    concave = np.unique(owners[against])
    kept = ~np.isin(owners, concave)
    corners, faces = fans.T[kept], owners[kept]
    if concave.size:
        clipped = [_clipped(surface, int(face), normals[face]) for face in concave]
        corners = np.concatenate([corners, *clipped])
        faces = np.concatenate([faces, np.repeat(concave, [len(part) for part in clipped])])
    return surface.vertices[corners].reshape(-1, 3), np.repeat(normals[faces], 3, axis=0)


def _clipped(surface: Surface, face: int, normal: Array) -> Indices:
    """Triangles of a concave face, shape (t, 3): one ear after the other is cut off."""
    left = surface.corners[surface.starts[face] : surface.starts[face + 1]].tolist()
    ears: list[tuple[int, int, int]] = []
    while len(left) > 3:
        place = next((k for k in range(len(left)) if _is_ear(surface, left, k, normal)), 0)
        ears.append((left[place - 1], left[place], left[(place + 1) % len(left)]))
        del left[place]
    ears.append((left[0], left[1], left[2]))
    return np.array(ears, dtype=np.int64)


def _is_ear(surface: Surface, left: list[int], place: int, normal: Array) -> bool:
    """Whether the corner at `place` sticks out and no other corner lies within its triangle."""
    names = (left[place - 1], left[place], left[(place + 1) % len(left)])
    a, b, c = surface.vertices[list(names)]
    if np.cross(b - a, c - b) @ normal <= 0.0:
        return False
    others = surface.vertices[[corner for corner in left if corner not in names]]
    sides = [
        np.cross(head - tail, others - tail) @ normal for tail, head in ((a, b), (b, c), (c, a))
    ]
    return not bool(np.any(np.all(np.array(sides) >= 0.0, axis=0)))
