"""Contact spheres of segments, by which a figure touches props.

A plane touches a segment at its support function s(u) = max over its vertices v of u . v, the
extent of the segment in the direction u. That of spheres with centres c_i and radii r_i is
max over i of (u . c_i + r_i); so spheres whose support function is close to that of a segment
touch a plane in any orientation at nearly the same height. The largest difference of both is the
error in height. Hollows of the segment do not enter: a plane does not reach them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from math import pi

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import Diagnostic, InputError
from generator.figure import ContactSphere, Figure, Segment
from generator.geometry.read import read_segment_surface
from generator.geometry.surface import Array

MAX_SPHERES = 6
"""Most spheres that are fitted to a segment."""

LARGEST_ERROR = 0.012
"""Error in height below which a fit needs no further sphere [m]."""

MIN_RADIUS, MAX_RADIUS = 0.008, 0.3
"""Bounds of the radius of a fitted sphere [m]."""

FIRST_RADIUS = 0.03
"""Radius with which a further sphere enters the fit [m]."""

DENSITY = 1000.0
"""Density of a capsule, that of water [kg/m^3]."""

DIRECTIONS_PER_OCTANT = 75
"""One eighth of the directions in which extents are compared."""

MAX_ITERATIONS = 60
"""Most iterations of a fit with one number of spheres."""


class SphereSource(StrEnum):
    """Origin of a segment's contact spheres."""

    OWN = "own"
    FITTED = "fitted"
    CAPSULE = "capsule"
    NONE = "none"


@dataclass(frozen=True)
class SegmentSpheres:
    """Contact spheres of a segment.

    Attributes:
        spheres: in the segment frame.
        largest_error: largest difference of the extent in any direction from that of the
            psurf [m]; None without a psurf.
        source: own in the figure, fitted to the psurf, or a capsule in place of a missing psurf;
            none where the mass is missing too.
    """

    spheres: tuple[ContactSphere, ...]
    largest_error: float | None
    source: SphereSource


def fit_contact_spheres(figure: Figure) -> dict[str, SegmentSpheres]:
    """Return the contact spheres of each moving segment.

    Raises InputError with the psurfs that cannot be read.
    """
    spheres: dict[str, SegmentSpheres] = {}
    vertices: dict[str, Array] = {}
    problems: list[Diagnostic] = []
    for name, segment in figure.bodies.items():
        try:
            if segment.psurf is not None and segment.psurf not in vertices:
                vertices[segment.psurf] = read_segment_surface(figure, segment).vertices
        except InputError as failure:
            problems += failure.diagnostics
            continue
        shape = None if segment.psurf is None else vertices[segment.psurf]
        spheres[name] = segment_spheres(figure, segment, shape)
    if problems:
        raise InputError(problems)
    return spheres


def segment_spheres(figure: Figure, segment: Segment, vertices: Array | None) -> SegmentSpheres:
    """Return the contact spheres of a segment with `vertices` in its frame, shape (n, 3) [m]."""
    if segment.contact_spheres:
        error = None
        if vertices is not None:
            table = np.array([(*each.centre, each.radius) for each in segment.contact_spheres])
            error = float(np.abs(_differences(table, _extents(vertices))[0]).max())
        return SegmentSpheres(segment.contact_spheres, error, SphereSource.OWN)
    if vertices is not None:
        return _fit(np.ascontiguousarray(vertices).tobytes())
    return _capsule(figure, segment)


@lru_cache(maxsize=1)
def _directions() -> Array:
    """Unit vectors, shape (n, 3), that are symmetric about the three coordinate planes.

    A spiral with equal areas over one octant and its mirror images: so the fit of a mirrored
    segment is the mirror image of the fit.
    """
    count = DIRECTIONS_PER_OCTANT
    golden_ratio = (1.0 + 5.0**0.5) / 2.0
    steps = np.arange(count) + 0.5
    height = steps / count
    azimuth = 0.5 * pi * ((steps / golden_ratio) % 1.0)
    across = np.sqrt(1.0 - height**2)
    octant = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height], axis=1)
    signs = np.stack(np.meshgrid(*[[1.0, -1.0]] * 3, indexing="ij"), axis=-1).reshape(8, 1, 3)
    return (octant * signs).reshape(-1, 3)


def _extents(vertices: Array) -> Array:
    """Largest extent of points in each direction [m], shape (n,)."""
    return (vertices @ _directions().T).max(axis=0)


def _differences(table: Array, extents: Array) -> tuple[Array, NDArray[np.int64]]:
    """Extents of spheres less `extents` [m], and the sphere that reaches each, shape (n,) both.

    `table` has a row of centre and radius for each sphere, shape (k, 4) [m].
    """
    reach = _directions() @ table[:, :3].T + table[:, 3]
    farthest = reach.argmax(axis=1)
    return reach[np.arange(len(reach)), farthest] - extents, farthest


@lru_cache(maxsize=256)
def _fit(content: bytes) -> SegmentSpheres:
    """Fit spheres to vertices, given as the bytes of their array.

    From one sphere in the middle, one is added at a time in the direction where the segment
    protrudes farthest, until no extent is in error by more than `LARGEST_ERROR`.
    """
    vertices = np.frombuffer(content, dtype=np.float64).reshape(-1, 3)
    extents, directions = _extents(vertices), _directions()
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    radius = np.mean(extents - directions @ middle)
    table = _improve(np.append(middle, radius)[None], extents)
    best = table
    for _ in range(MAX_SPHERES - 1):
        difference, _ = _differences(table, extents)
        if _largest(best, extents) < LARGEST_ERROR:
            break
        direction = directions[difference.argmin()]
        vertex = vertices[(vertices @ direction).argmax()]
        added = np.append(vertex - FIRST_RADIUS * direction, FIRST_RADIUS)
        table = _improve(np.vstack([table, added]), extents)
        if _largest(table, extents) < _largest(best, extents):
            best = table
    rows: list[list[float]] = best.tolist()
    spheres = tuple(ContactSphere((x, y, z), radius) for x, y, z, radius in rows)
    return SegmentSpheres(spheres, _largest(best, extents), SphereSource.FITTED)


def _largest(table: Array, extents: Array) -> float:
    return float(np.abs(_differences(table, extents)[0]).max())


def _improve(table: Array, extents: Array) -> Array:
    """Return spheres with the least sum of squared differences near `table`, shape (k, 4).

    Levenberg-Marquardt. A difference depends on the one sphere that reaches farthest in its
    direction, so that the normal equations fall apart into four for each sphere.
    """
    slopes = np.column_stack([_directions(), np.ones(len(extents))])
    difference, farthest = _differences(table, extents)
    cost, damping = difference @ difference, 1e-3
    for _ in range(MAX_ITERATIONS):
        moved = table.copy()
        for index in range(len(table)):
            own = farthest == index
            rows = slopes[own]
            normal = rows.T @ rows
            normal += np.diag(damping * np.diag(normal) + 1e-9)
            moved[index] -= np.linalg.solve(normal, rows.T @ difference[own])
        moved[:, 3] = np.clip(moved[:, 3], MIN_RADIUS, MAX_RADIUS)
        trial, trial_farthest = _differences(moved, extents)
        trial_cost = trial @ trial
        if trial_cost < cost:
            has_converged = cost - trial_cost < 1e-6 * cost
            table, difference, farthest, cost = moved, trial, trial_farthest, trial_cost
            damping = max(0.1 * damping, 1e-9)
            if has_converged:
                break
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    return table


def _capsule(figure: Figure, segment: Segment) -> SegmentSpheres:
    """Return spheres of one radius at the joints of a segment and at its centre of mass.

    A segment with one joint extends as far beyond its centre of mass as the joint is before it.
    The radius r is that of a capsule of the segment's mass m with the density of water around a
    line of the total length l from the centre of mass to all others: m / density =
    pi r^2 l + 4/3 pi r^3.
    """
    centre = segment.centre_of_mass
    if not segment.mass or segment.mass <= 0.0 or centre is None:
        return SegmentSpheres((), None, SphereSource.NONE)
    sites = dict.fromkeys(
        end.site
        for joint in figure.joints.values()
        for end in joint.ends
        if end.segment == segment.name
    )
    ends = [segment.sites[site].pose_in_segment[:3, 3] for site in sites]
    if len(ends) == 1:
        ends.append(2.0 * centre - ends[0])
    length = sum(float(np.linalg.norm(end - centre)) for end in ends)
    roots = np.roots([4.0 / 3.0 * pi, pi * length, 0.0, -segment.mass / DENSITY])
    radius = float(roots.real.max())
    points = dict.fromkeys(tuple(map(float, end)) for end in (centre, *ends))
    spheres = tuple(ContactSphere((x, y, z), radius) for x, y, z in points)
    return SegmentSpheres(spheres, None, SphereSource.CAPSULE)


def deepest_overlap(
    spheres: Mapping[str, SegmentSpheres], poses: Mapping[str, Array], figure: Figure
) -> tuple[float, str, str, int]:
    """Return the depth [m] to which two segments interpenetrate, both names, and the frame.

    The depth of two segments is the largest overlap of a sphere of one and a sphere of the other;
    what they overlap by at the first frame is subtracted, because limbs may overlap as drawn.
    Segments that share a joint are left out. Hollows between the spheres of a segment are not
    seen. Without two such segments the depth is 0 and the names are empty.

    Args:
        spheres: by segment.
        poses: by segment, in the world, shape (n, 4, 4).
        figure: whose joints say which segments are joined.
    """
    joined = {
        frozenset((joint.parent.segment, joint.child.segment)) for joint in figure.joints.values()
    }
    names = [name for name, own in spheres.items() if own.spheres and name in poses]
    radii = {name: np.array([each.radius for each in spheres[name].spheres]) for name in names}
    centres: dict[str, Array] = {}
    for name in names:
        local = np.array([each.centre for each in spheres[name].spheres])
        pose = np.asarray(poses[name])
        centres[name] = local @ pose[:, :3, :3].transpose(0, 2, 1) + pose[:, None, :3, 3]
    deepest = (0.0, "", "", 0)
    for index, first in enumerate(names):
        for second in names[:index]:
            if frozenset((first, second)) in joined:
                continue
            apart = centres[first][:, :, None] - centres[second][:, None]
            distance = np.sqrt(np.einsum("nijk,nijk->nij", apart, apart))
            overlap = radii[first][:, None] + radii[second] - distance
            depth = np.maximum(overlap.max(axis=(1, 2)), 0.0)
            depth -= depth[0]
            frame = int(depth.argmax())
            if depth[frame] > deepest[0]:
                deepest = (float(depth[frame]), second, first, frame)
    return deepest
