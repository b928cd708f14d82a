"""Contact spheres of segments, by which a figure touches props.

A plane touches a segment at its support function s(u) = max over its vertices v of u . v, the
extent of the segment in the direction u. That of spheres with centres c_i and radii r_i is
max over i of (u . c_i + r_i); so spheres whose support function is close to that of a segment
touch a plane in any orientation at nearly the same height. The largest difference of both is the
error in height. Hollows of the segment do not enter: a plane does not reach them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache
from math import pi

import numpy as np
from numpy.typing import NDArray

from generator.contact.record import Overlap
from generator.contact.self_contact import unjoined_pairs
from generator.diagnostics import Diagnostic, InputError
from generator.figure import ContactSphere, Figure, Segment
from generator.geometry.appearance import mass_capsule
from generator.geometry.read import read_segment_surface
from generator.geometry.surface import Array, Surface

LARGEST_ERROR = 0.012
"""Error in height at which a fit needs no further sphere [m]."""

MAX_SPHERES = 8
"""Most spheres that are fitted to a segment: as many as a box has corners."""

MIN_RADIUS = 0.005
"""Smallest radius of a fitted sphere [m]."""

FIRST_RADIUS = 0.015
"""Radius with which a further sphere enters the fit [m]."""

NORMS = (2, 4, 8, 16)
"""Exponents of the norms of the differences that a fit minimises one after the other.

The first is least squares; the last is nearly the largest difference. Powers of two.
"""

FITTED_DIRECTIONS, MEASURED_DIRECTIONS = 2400, 9600
"""Number of directions in which a fit compares extents, and of those that its error is from."""

PRODUCTS_AT_ONCE = 2**16
"""Products of a vertex and a direction in one step: few enough for one thread and fast memory."""

MAX_STEPS = 60
"""Most Newton steps with one number of spheres and one norm."""

CONVERGED_GAIN, MAX_DAMPING = 1e-3, 1e4
"""Relative decrease of the sum of powers below which a fit ends, and damping at which it does."""

MIN_WEIGHT, MIN_DIAGONAL = 1e-6, 1e-9
"""Added to the weights, the largest of which is 1, and to the diagonal of the normal equations."""


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
        spheres: spheres in the segment frame.
        largest_error: largest difference of the extent in any direction from that of the
            psurf [m]; None without a psurf.
        source: own in the figure, fitted to the psurf, or a capsule in place of a missing psurf;
            none where the mass is missing too.
    """

    spheres: tuple[ContactSphere, ...]
    largest_error: float | None
    source: SphereSource


def contact_spheres(figure: Figure) -> dict[str, tuple[ContactSphere, ...]]:
    """Return the contact spheres of each moving segment that has some; see `fit_contact_spheres`.

    Surfaces beside own spheres, of which only errors depend, are not read.
    """
    bare = [replace(one, psurf=None) for one in figure.bodies.values() if one.contact_spheres]
    fits = fit_contact_spheres(figure.with_parts(*bare) if bare else figure)
    return {name: fit.spheres for name, fit in fits.items() if fit.spheres}


def fit_contact_spheres(figure: Figure) -> dict[str, SegmentSpheres]:
    """Return the contact spheres of each moving segment.

    Raises InputError with the psurfs that cannot be read, of segments without own spheres.
    """
    spheres: dict[str, SegmentSpheres] = {}
    vertices: dict[str, Array] = {}
    problems: list[Diagnostic] = []
    for name, segment in figure.bodies.items():
        try:
            if segment.psurf is not None and segment.psurf not in vertices:
                surface = read_segment_surface(figure, segment)
                vertices[segment.psurf] = surface.vertices[np.unique(surface.corners)]
        except InputError as failure:
            if not segment.contact_spheres:
                problems += failure.diagnostics
                continue
        spheres[name] = _segment_spheres(figure, segment, vertices.get(segment.psurf or ""))
    if problems:
        raise InputError(problems)
    return spheres


def fit_spheres(surface: Surface) -> tuple[ContactSphere, ...]:
    """Return the contact spheres of a surface."""
    vertices = surface.vertices[np.unique(surface.corners)]
    return _fit(np.ascontiguousarray(vertices).tobytes()).spheres


def _segment_spheres(figure: Figure, segment: Segment, vertices: Array | None) -> SegmentSpheres:
    """Return the contact spheres of a segment with `vertices` in its frame, shape (n, 3) [m]."""
    if vertices is not None and not len(vertices):
        vertices = None
    if segment.contact_spheres:
        table = np.array([(*each.centre, each.radius) for each in segment.contact_spheres])
        error = None if vertices is None else _largest_error(vertices.tobytes(), table.tobytes())
        return SegmentSpheres(segment.contact_spheres, error, SphereSource.OWN)
    if vertices is not None:
        return _fit(np.ascontiguousarray(vertices).tobytes())
    return _capsule(figure, segment)


@lru_cache(maxsize=256)
def _largest_error(vertices: bytes, spheres: bytes) -> float:
    """Return the error of spheres beside vertices; see `SegmentSpheres`."""
    ruler = _Ruler(np.frombuffer(vertices).reshape(-1, 3))
    return ruler.largest_error(np.frombuffer(spheres).reshape(-1, 4))


@lru_cache(maxsize=4)
def directions(count: int) -> Array:
    """Return unit vectors, shape (count, 3), that are symmetric about the three coordinate planes.

    A spiral with equal areas over one octant, and its mirror images: so the fit of a mirrored
    segment is the mirror image of the fit. `count` is a multiple of eight.
    """
    golden_ratio = (1.0 + 5.0**0.5) / 2.0
    steps = np.arange(count // 8) + 0.5
    height = steps / len(steps)
    azimuth = 0.5 * pi * ((steps / golden_ratio) % 1.0)
    across = np.sqrt(1.0 - height**2)
    octant = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height], axis=1)
    signs = np.stack(np.meshgrid(*[[1.0, -1.0]] * 3, indexing="ij"), axis=-1).reshape(8, 1, 3)
    return (octant * signs).reshape(-1, 3)


def _extents(vertices: Array, along: Array) -> Array:
    """Return the largest extent of vertices in each direction, shape (n,) [m]."""
    size = max(1, PRODUCTS_AT_ONCE // len(vertices))
    parts = [along[at : at + size] for at in range(0, len(along), size)]
    return np.concatenate([(vertices @ part.T).max(axis=0) for part in parts])


class _Ruler:
    """Measure of the largest difference of the extents of spheres and of vertices [m]."""

    def __init__(self, vertices: Array) -> None:
        self._directions = directions(MEASURED_DIRECTIONS)
        self._extents = _extents(vertices, self._directions)

    def largest_error(self, table: Array) -> float:
        """Largest error in height of spheres, given as a table of `_SupportFit` [m]."""
        reach = (self._directions @ table[:, :3].T + table[:, 3]).max(axis=1)
        return float(np.abs(reach - self._extents).max())


@lru_cache(maxsize=256)
def _fit(content: bytes) -> SegmentSpheres:
    """Fit spheres to vertices, given as the bytes of their array.

    The fit begins with one sphere in the middle, and adds one at a time where the segment
    protrudes farthest, until no extent is in error by more than `LARGEST_ERROR`.
    """
    vertices = np.frombuffer(content, dtype=np.float64).reshape(-1, 3)
    fit, ruler = _SupportFit(vertices), _Ruler(vertices)
    best = table = fit.improve(fit.single_sphere())
    error = ruler.largest_error(best)
    while len(table) < MAX_SPHERES and error > LARGEST_ERROR:
        table = fit.improve(fit.with_sphere_at_largest_gap(table))
        if (smaller := ruler.largest_error(table)) < error:
            best, error = table, smaller
    rows: list[list[float]] = best.tolist()
    spheres = tuple(ContactSphere((x, y, z), radius) for x, y, z, radius in rows)
    return SegmentSpheres(spheres, error, SphereSource.FITTED)


class _SupportFit:
    """Fit of spheres to the support function of points.

    Spheres are a table with a row of centre and radius for each, shape (k, 4) [m].
    """

    def __init__(self, vertices: Array) -> None:
        self._vertices = vertices
        self._directions = directions(FITTED_DIRECTIONS)
        self._extents = _extents(vertices, self._directions)
        self._slopes = np.column_stack([self._directions, np.ones(len(self._directions))])
        self._products = np.einsum("ni,nj->nij", self._slopes, self._slopes).reshape(-1, 16)

    def single_sphere(self) -> Array:
        """Return one sphere in the middle of the points, shape (1, 4)."""
        middle = 0.5 * (self._vertices.min(axis=0) + self._vertices.max(axis=0))
        radius = np.maximum((self._extents - self._directions @ middle).mean(), MIN_RADIUS)
        return np.append(middle, radius)[None]

    def with_sphere_at_largest_gap(self, table: Array) -> Array:
        """Add a small sphere inside the vertex that protrudes farthest from those of `table`."""
        direction = self._directions[self._differences(table)[0].argmin()]
        vertex = self._vertices[(self._vertices @ direction).argmax()]
        return np.vstack([table, np.append(vertex - FIRST_RADIUS * direction, FIRST_RADIUS)])

    def improve(self, table: Array) -> Array:
        """Return spheres near those of `table` with small differences in each norm of `NORMS`."""
        for exponent in NORMS:
            table = self._minimise(table, exponent)
        return table

    def _differences(self, table: Array) -> tuple[Array, NDArray[np.int64]]:
        """Extents of spheres less those of the points [m], and the sphere that reaches each."""
        reach = self._directions @ table[:, :3].T + table[:, 3]
        farthest = reach.argmax(axis=1)
        return reach[np.arange(len(reach)), farthest] - self._extents, farthest

    def _minimise(self, table: Array, exponent: int) -> Array:
        """Return spheres with the least sum of powers of the differences.

        Newton steps, damped as by Levenberg and Marquardt. A difference is linear in centre and
        radius of the one sphere that reaches farthest in its direction: so each sphere has four
        equations of its own.
        """
        difference, farthest = self._differences(table)
        scale = float(np.abs(difference).max()) or 1.0
        cost, damping = float(_power(difference / scale, exponent).sum()), 1e-3
        for _ in range(MAX_STEPS):
            weight = _power(difference / scale, exponent - 2)
            weight = weight / weight.max() + MIN_WEIGHT
            weights = (farthest[:, None] == np.arange(len(table))) * weight[:, None]
            normal = (weights.T @ self._products).reshape(-1, 4, 4)
            diagonal = np.einsum("kii->ki", normal)
            diagonal *= 1.0 + damping
            diagonal += MIN_DIAGONAL
            gradient = (weights * difference[:, None]).T @ self._slopes
            step = np.asarray(np.linalg.solve(normal, gradient[..., None]), float)[..., 0]
            moved = table - step / (exponent - 1)
            moved[:, 3] = np.maximum(moved[:, 3], MIN_RADIUS)
            trial, trial_farthest = self._differences(moved)
            trial_cost = float(_power(trial / scale, exponent).sum())
            if trial_cost < cost:
                has_converged = cost - trial_cost < CONVERGED_GAIN * cost
                table, difference, farthest, cost = moved, trial, trial_farthest, trial_cost
                damping = max(0.1 * damping, MIN_DIAGONAL)
            else:
                damping *= 10.0
                has_converged = damping > MAX_DAMPING
            if has_converged:
                break
        return table


def _power(values: Array, exponent: int) -> Array:
    """Even power of values, by products: the general power takes ten times as long."""
    square = values * values
    result = np.ones_like(values)
    for digit in reversed(f"{exponent // 2:b}"):
        if digit == "1":
            result = result * square
        square = square * square
    return result


def _capsule(figure: Figure, segment: Segment) -> SegmentSpheres:
    """Return spheres of one radius at the joints of a segment and at its centre of mass."""
    capsule = mass_capsule(figure, segment)
    if capsule is None:
        return SegmentSpheres((), None, SphereSource.NONE)
    points = dict.fromkeys(
        (x, y, z) for x, y, z in [capsule.centre.tolist(), *capsule.ends.tolist()]
    )
    spheres = tuple(ContactSphere(point, capsule.radius) for point in points)
    return SegmentSpheres(spheres, None, SphereSource.CAPSULE)


def deepest_overlap(
    spheres: Mapping[str, Sequence[ContactSphere]],
    poses: Mapping[str, Array],
    figure: Figure,
    times: Array,
) -> Overlap | None:
    """Return the deepest overlap of two segments that share no joint; None without any.

    The depth of two segments is the largest overlap of a sphere of one and a sphere of the other.
    The overlap at the first frame is subtracted, because limbs may overlap as drawn. Gaps between
    the spheres of a segment count as empty, so that the depth is a lower bound.

    Args:
        spheres: spheres by segment.
        poses: poses by segment, in the world, shape (n, 4, 4).
        figure: figure with these segments.
        times: times of the poses, shape (n,) [s].
    """
    names = [name for name, own in spheres.items() if own and name in poses]
    radii = {name: np.array([each.radius for each in spheres[name]]) for name in names}
    centres: dict[str, Array] = {}
    for name in names:
        local = np.array([each.centre for each in spheres[name]])
        pose = np.asarray(poses[name])
        centres[name] = local @ pose[:, :3, :3].transpose(0, 2, 1) + pose[:, None, :3, 3]
    deepest: Overlap | None = None
    for first, second in unjoined_pairs(figure):
        if not centres.keys() >= {first, second}:
            continue
        between = centres[first][:, :, None] - centres[second][:, None]
        distance = np.sqrt(np.einsum("nijk,nijk->nij", between, between))
        overlap = radii[first][:, None] + radii[second] - distance
        depth = np.maximum(overlap.max(axis=(1, 2)), 0.0)
        depth -= depth[0]
        frame = int(depth.argmax())
        if depth[frame] > (deepest.depth if deepest else 0.0):
            deepest = Overlap(float(depth[frame]), first, second, float(times[frame]))
    return deepest
