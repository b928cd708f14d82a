"""Mass properties of meshes by the rules of MuJoCo's compiler.

`legacy` counts the pyramid between each triangle and the centroid of the surface as positive, so
that concave meshes have too much; `exact` has their signed volumes, `convex` those of the hull, and
`shell` the areas (MuJoCo 4.0, XML reference, asset/mesh/inertia, and user_mesh.cc).
"""

from typing import Final

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from generator.geometry.surface import Surface, build_edges, merge_vertices
from generator.inertia import MassProperties
from generator.rotations import Array

RULES: Final = ("convex", "exact", "legacy", "shell")

LEGACY: Final = "legacy"
"""Rule of meshes without any."""

_LEAST_VOLUME = 1e-15
"""Volume [m3] or area [m2] that MuJoCo takes for none."""


def unit_mass_properties(surface: Surface, rule: str) -> MassProperties:
    """Return the mass properties of a mesh at unit density by one of the `RULES`.

    The density is 1 kg/m3, of a shell 1 kg/m2, so that the mass is the volume or the area.

    Raises ValueError, with a sentence, for a mesh that MuJoCo refuses as well.
    """
    if rule == "convex":
        surface = convex_hull(surface.vertices)
    elif rule == "exact" and build_edges(merge_vertices(surface)[0]).same_direction.any():
        raise ValueError("its triangles do not all face outwards")
    corners = surface.vertices[surface.fan_triangles[0]]
    centres = corners.mean(axis=0)
    normals = np.cross(corners[1] - corners[0], corners[2] - corners[0]) / 2.0
    weights = np.linalg.norm(normals, axis=1)
    if weights.sum() < _LEAST_VOLUME:
        raise ValueError("its triangles have no area")
    centre = weights @ centres / weights.sum()
    if rule != "shell":
        weights = _pyramids(centres - centre, normals, rule)
        centre = weights @ (0.75 * centres + 0.25 * centre) / weights.sum()
        weights = _pyramids(centres - centre, normals, rule)
    edges = corners - centre
    total = edges.sum(axis=0)
    second = np.einsum("t,ti,tj->ij", weights, total, total)
    second += np.einsum("t,cti,ctj->ij", weights, edges, edges)
    second /= 12.0 if rule == "shell" else 20.0
    inertia = np.trace(second) * np.eye(3) - second
    return MassProperties(float(weights.sum()), centre, inertia)


def inertia_box(mass: MassProperties) -> tuple[Array, Array]:
    """Return the box that has this mass and inertia, as a mesh's primitive shape is fitted.

    The results are its pose, (4, 4), with the longest side along z, and its half sides [m], (3,).
    """
    principal = mass.principal_inertia
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = principal.axes[:, ::-1] * [1.0, 1.0, -1.0], mass.centre
    moments = principal.moments[::-1]
    squares = np.maximum(moments.sum() - 2.0 * moments, 0.0)
    return pose, np.sqrt(1.5 * squares / mass.mass)


def _pyramids(centres: Array, normals: Array, rule: str) -> Array:
    """Volumes between an apex and triangles with these centres from it, shape (t,) [m3].

    Raises ValueError unless their sum is positive.
    """
    volumes = np.einsum("ti,ti->t", centres, normals) / 3.0
    volumes = np.abs(volumes) if rule == LEGACY else volumes
    if volumes.sum() < 0.0:
        raise ValueError("its volume is negative: its triangles face inwards")
    if volumes.sum() < _LEAST_VOLUME:
        raise ValueError('its volume is zero; `inertia="shell"` takes its area')
    return volumes


def convex_hull(points: Array) -> Surface:
    """Return the convex hull of points, shape (n, 3).

    Raises ValueError for points in a plane.
    """
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):  # fewer than four
        raise ValueError("its points lie in a plane") from None
    faces = hull.simplices.astype(np.int64)
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0.0
    faces[inwards] = faces[inwards][:, ::-1]
    return Surface.from_faces(points, faces).without_unused_vertices
