"""Contact spheres along limbs, between which no edge of a prop enters deeply.

An edge is a line, such as the rim of a bath. It is inside a segment by the smallest distance that
moves it out of the convex hull of the segment. Seen along the edge, the hull is a polygon, the edge
a point, and each sphere a disc: an edge is stopped at the depth d if the discs cover the curve
within the polygon that is everywhere d below its sides.

The spheres of the fit hold a limb by its ends. Further ones, as large as its hull, stop the edges
between them.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.contact.spheres import LARGEST_ERROR, directions
from generator.figure import ContactSphere, Figure
from generator.geometry.surface import Array, Surface

MIN_ELONGATION = 1.5
"""Length over width from which a segment between joints is a limb."""

PROTRUSION = 8e-3
"""Height of an added sphere above the hull of its segment [m], less than the error of a fit."""

_DEPTH_STEP = 2.5e-4
"""Difference of the depths at which edges are stopped one after the other [m], until those between
them are stopped before the largest error too."""

_EDGES, _MEASURED_EDGES = 256, 320
"""Number of directions on a sphere, half of which are those of edges: of a fit, and of a measure.

Multiples of eight.
"""

_RAYS = 384
"""Number of directions in a full turn in which the curve of edges is computed."""

_SPACING, _MEASURED_SPACING = 6e-3, 3e-3
"""Distance of neighbouring edges [m]."""

_MIRROR_ROUNDING = 1e-6
"""Difference of the extents of a hull and of its mirror image that is rounding [m]."""

_GRID = 8e-3
"""Distance of neighbouring centres of candidates [m]."""

_MIN_RADIUS = 0.01
"""Smallest radius of a candidate [m]."""

_DOMINANCE = 0.7
"""Growth of the radius over the distance of two centres from which the larger sphere replaces the
other."""


def is_limb(figure: Figure, name: str, surface: Surface) -> bool:
    """Tell whether a segment is elongated and connects two joints, as a thigh and a forearm do."""
    ends = [end for joint in figure.joints.values() for end in (joint.parent, joint.child)]
    if sum(end.segment == name for end in ends) < 2:
        return False
    points = _points(surface)
    axes = np.linalg.eigh(np.cov(points.T))[1]
    _, width, length = np.sort(np.ptp(points @ axes, axis=0))
    return bool(length >= MIN_ELONGATION * width)


def largest_edge_depth(surface: Surface, spheres: Sequence[ContactSphere]) -> float:
    """Return how deep an edge enters a segment before it touches a sphere [m].

    The largest depth of edges in all directions at any place, to 0.1 mm; the extent of the segment
    if the spheres do not stop them at any depth.

    Args:
        surface: Surface of the segment.
        spheres: Its contact spheres.
    """
    hull, table = _Hull(_points(surface), _MEASURED_EDGES), _table(spheres)
    step = 1e-3
    high = float(np.ptp(hull.points, axis=0).max())
    depth = next((depth for depth in np.arange(step, high, step) if hull.stops(table, depth)), high)
    low, high = depth - step, float(depth)
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if hull.stops(table, middle) else (middle, high)
    return high


def add_limb_spheres(
    surface: Surface, spheres: Sequence[ContactSphere]
) -> tuple[ContactSphere, ...]:
    """Return spheres that stop all edges before `LARGEST_ERROR`: those given, and further ones.

    Each further sphere reaches up to `PROTRUSION` above the convex hull, and is the one of a grid
    that stops most of the edges that no other stops. A segment that is its own mirror image across
    y gets spheres that are.

    Args:
        surface: Surface of the segment.
        spheres: Contact spheres fitted to it.
    """
    return _with_limb_spheres(_points(surface).tobytes(), tuple(spheres))


@lru_cache(maxsize=16)
def _with_limb_spheres(
    points: bytes, spheres: tuple[ContactSphere, ...]
) -> tuple[ContactSphere, ...]:
    hull = _Hull(np.frombuffer(points).reshape(-1, 3), _EDGES)
    measure, choices, made = _Hull(hull.points, _MEASURED_EDGES), hull.choices(), spheres
    for depth in np.arange(LARGEST_ERROR - 2.0 * _DEPTH_STEP, 0.5 * LARGEST_ERROR, -_DEPTH_STEP):
        made = (*spheres, *_further_spheres(hull, choices, spheres, float(depth)))
        if measure.stops(_table(made), LARGEST_ERROR):
            break
    return made


def _further_spheres(
    hull: "_Hull", choices: Array, spheres: Sequence[ContactSphere], depth: float
) -> Iterator[ContactSphere]:
    """Yield few spheres that stop at a depth the edges that the given ones do not stop there."""
    table, count = _table(spheres), len(choices)
    stopped: list[Any] = []
    for axes, points in hull.edges_at(depth, table[:, :3], _SPACING):
        missed = points[~_covers(table, axes, points).any(axis=1)]
        each = _covers(choices.reshape(-1, 4), axes, missed)
        stopped.append(each.reshape(-1, count, choices.shape[1]).any(axis=2))
    stops = np.concatenate([np.zeros((0, count), dtype=bool), *stopped])
    costs = np.array([len(np.unique(choice, axis=0)) for choice in choices])
    for number in _cover(stops[stops.any(axis=1)], costs):
        for x, y, z, radius in np.unique(choices[number].round(6), axis=0).tolist():
            yield ContactSphere((x, y, z), radius)


def _cover(stops: NDArray[np.bool_], costs: NDArray[np.intp]) -> list[int]:
    """Return columns of which at least one is true in each row, few in relation to their costs."""
    counts = stops.astype(np.float32)
    left, chosen = np.ones(len(stops), dtype=np.float32), list[int]()
    while left.any():
        best = int(np.argmax(left @ counts / costs))
        chosen.append(best)
        left *= 1.0 - counts[:, best]
    while True:
        pairs = (_merged(stops, costs, chosen, *two) for two in combinations(chosen, 2))
        fewer = next(filter(None, pairs), None)
        if fewer is None:
            return sorted(chosen)
        chosen = fewer


def _merged(
    stops: NDArray[np.bool_], costs: NDArray[np.intp], chosen: list[int], one: int, other: int
) -> list[int] | None:
    """Return the columns with a cheaper one in place of two; None if there is none."""
    rest = [column for column in chosen if column not in (one, other)]
    missed = ~stops[:, rest].any(axis=1)
    does = stops[missed].all(axis=0) & (costs < costs[one] + costs[other])
    return [*rest, int(np.flatnonzero(does)[0])] if does.any() else None


class _Hull:
    """Convex hull of points, by its extents."""

    def __init__(self, points: Array, edges: int) -> None:
        self.points = points
        every = directions(edges)
        # One of each direction and its opposite: none is orthogonal to this vector.
        self._edges = every[every @ (1.0, 2.0**-0.5, 3.0**-0.5) > 0.0]
        angles = np.linspace(0.0, 2.0 * np.pi, _RAYS, endpoint=False)
        self._rays = np.column_stack([np.cos(angles), np.sin(angles)])

    def edges_at(
        self, depth: float, centres: Array, spacing: float
    ) -> Iterator[tuple[Array, Array]]:
        """Yield two axes across edges, shape (3, 2), and the places of edges there, shape (n, 2).

        The edges of each direction are at a depth in the hull, along a closed curve.

        Args:
            depth: Depth [m].
            centres: Points in the hull, shape (k, 3) [m].
            spacing: Largest distance of neighbouring edges [m].
        """
        from scipy.spatial import ConvexHull  # slow import

        inside = np.vstack([centres, self.points.mean(axis=0)])
        for edge in self._edges:
            axes = np.linalg.svd(edge[None])[2][1:].T
            sides = np.asarray(ConvexHull(self.points @ axes).equations)
            normals, heights = sides[:, :2], -sides[:, 2]
            places = inside @ axes
            gaps = (heights - places @ normals.T).min(axis=1)
            if gaps.max() <= depth:
                continue  # so thin is the hull there that no edge is so deep in it
            middle = places[gaps.argmax()]
            gap = heights - depth - middle @ normals.T
            slopes = self._rays @ normals.T
            distances = np.where(slopes > 1e-9, gap / np.maximum(slopes, 1e-9), np.inf).min(axis=1)
            curve = middle + distances[:, None] * self._rays
            yield axes, _resampled(curve, spacing)

    def stops(self, table: Array, depth: float) -> bool:
        """Tell whether spheres stop all edges at a depth [m]."""
        return all(
            bool(_covers(table, axes, points).any(axis=1).all())
            for axes, points in self.edges_at(depth, table[:, :3], _MEASURED_SPACING)
        )

    def choices(self) -> Array:
        """Return large spheres that protrude by `PROTRUSION`, shape (n, 2, 4): centre and radius.

        Each with its mirror image across y if the hull has one; otherwise twice the same.
        """
        from scipy.spatial import ConvexHull  # slow import

        faces = np.unique(np.asarray(ConvexHull(self.points).equations).round(9), axis=0)
        normals, heights = faces[:, :3], -faces[:, 3]
        low, high = self.points.min(axis=0) / _GRID, self.points.max(axis=0) / _GRID
        shape = np.floor(high).astype(int) - np.ceil(low).astype(int) + 1
        centres = _GRID * (np.ceil(low) + np.indices(tuple(shape)).reshape(3, -1).T)
        parts = np.array_split(np.arange(len(faces)), 1 + len(faces) // 100)
        gaps = [(heights[part] - centres @ normals[part].T).min(axis=1) for part in parts]
        radii = np.min(gaps, axis=0) + PROTRUSION
        kept = (radii > _MIN_RADIUS) & ~_is_dominated(radii.reshape(shape)).ravel()
        found = np.column_stack([centres[kept], radii[kept]])
        mirror = np.array([1.0, -1.0, 1.0, 1.0])
        reaches = self.points @ normals.T, (self.points * mirror[:3]) @ normals.T
        if np.abs(reaches[0].max(axis=0) - reaches[1].max(axis=0)).max() > _MIRROR_ROUNDING:
            return np.stack([found, found], axis=1)
        found = found[found[:, 1] >= 0.0]
        return np.stack([found, found * mirror], axis=1)


def _is_dominated(radii: Array) -> NDArray[np.bool_]:
    """Tell in which places of a grid a neighbouring sphere is so large that it replaces the one."""
    around = np.pad(radii, 1, constant_values=-np.inf)
    found = np.zeros(radii.shape, dtype=bool)
    for shift in product((-1, 0, 1), repeat=3):
        if any(shift):
            window = tuple(slice(1 + k, 1 + k + n) for k, n in zip(shift, radii.shape, strict=True))
            found |= around[window] >= radii + _DOMINANCE * _GRID * float(np.linalg.norm(shift))
    return found


def _resampled(curve: Array, spacing: float) -> Array:
    """Return points of a closed curve, shape (n, 2), at most `spacing` apart [m]."""
    closed = np.vstack([curve, curve[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    count = int(np.ceil(along[-1] / spacing)) + 1
    places = np.linspace(0.0, float(along[-1]), count, endpoint=False, dtype=float)
    return np.column_stack([np.interp(places, along, closed[:, k]) for k in range(2)])


def _points(surface: Surface) -> Array:
    return surface.vertices[np.unique(surface.corners)]


def _table(spheres: Sequence[ContactSphere]) -> Array:
    return np.array([(*one.centre, one.radius) for one in spheres]).reshape(-1, 4)


def _covers(table: Array, axes: Array, points: Array) -> NDArray[np.bool_]:
    """Tell which of k spheres, seen along an edge, cover n points, shape (n, k)."""
    centres = table[:, :3] @ axes
    beyond = np.sum(centres**2, axis=1) - table[:, 3] ** 2 - 2.0 * points @ centres.T
    return beyond < -np.sum(points**2, axis=1)[:, None]
