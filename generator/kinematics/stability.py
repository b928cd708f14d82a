"""Static stability of a figure on its support (thesis, section 5.2).

The figure is balanced when its centre of mass, projected on the ground plane, lies in the convex
hull of the projected support points. Joints count as rigid, and gravity as the only load. The
support is faces of psurfs, sites, or all faces below a height.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.diagnostics import InputError, UsageError, error, spelling_hint
from generator.figure import Figure, Segment, SiteRef
from generator.geometry.read import read_segment_surface
from generator.kinematics.centre_of_mass import own_segments
from generator.rotations import Array, rotation_with_z_axis, unit_vector
from springs.short_repr import short_repr

Y_UP = (0.0, 1.0, 0.0)
"""The normal of the ground in the world of the thesis."""

EDGE_TOLERANCE = 1e-6
"""Distance to the edge of the support within which a point counts as on it [m]."""

MIN_SUPPORT_WIDTH = 1e-9
"""Width below which a support is a line, and length below which it is a point [m]."""


class Balance(Enum):
    """Position of the centre of mass relative to the support; the value is its name in text."""

    INSIDE = "inside"
    ON_EDGE = "on the edge"
    OUTSIDE = "outside"
    UNSUPPORTED = "unsupported"


@short_repr
@dataclass(frozen=True)
class Stability:
    """Static stability of a figure in a pose.

    Attributes:
        balance: position of the centre of mass relative to the support.
        margin: distance of the projected centre of mass to the edge of the support [m]; negative
            outside, minus infinity without support.
        centre: the centre of mass, projected on the ground plane through the world's origin, in
            the world, shape (3,) [m].
        corners: corners of the support, projected likewise, anticlockwise seen from above, shape
            (k, 3) [m]. One of them is a point, two are a line.
        sources: indices of the support points that are corners, shape (k,).
        pivot: indices of the corners that the figure would tip over: two for an edge, one for a
            corner.
        direction: direction of tipping, a horizontal unit vector in the world, shape (3,). None
            without support, and where a point or line of support is exactly below the centre of
            mass.
    """

    balance: Balance
    margin: float
    centre: Array
    corners: Array
    sources: NDArray[np.intp]
    pivot: tuple[int, ...]
    direction: Array | None

    @property
    def area(self) -> float:
        """Area of the support [m^2]."""
        if len(self.corners) < 3:
            return 0.0
        arms = self.corners[1:] - self.corners[0]
        return 0.5 * float(np.linalg.norm(np.sum(np.cross(arms[:-1], arms[1:]), axis=0)))


def stability(centre: ArrayLike, points: ArrayLike, up: ArrayLike = Y_UP) -> Stability:
    """Return the static stability of a body with its centre of mass at `centre` on `points`.

    Args:
        centre: centre of mass, shape (3,) [m].
        points: points of support, shape (n, 3) [m]; n may be zero.
        up: normal of the ground plane, of any length but zero.

    Raises:
        ValueError: `up` is zero, or a number is not finite.
    """
    where = np.asarray(centre, dtype=float)
    support_points = np.asarray(points, dtype=float).reshape(-1, 3)
    if not (np.all(np.isfinite(where)) and np.all(np.isfinite(support_points))):
        raise ValueError("positions must be finite")
    plane = rotation_with_z_axis(up)[:, :2]
    c, flat = where @ plane, support_points @ plane
    sources = _hull_indices(flat)
    corners = flat[sources]
    margin, pivot, direction = _nearest_edge(c, corners)
    return Stability(
        balance=_classify_balance(margin),
        margin=margin,
        centre=plane @ c,
        corners=corners @ plane.T,
        sources=sources,
        pivot=pivot,
        direction=None if direction is None else plane @ direction,
    )


def _classify_balance(margin: float) -> Balance:
    if margin == -np.inf:
        return Balance.UNSUPPORTED
    if abs(margin) <= EDGE_TOLERANCE:
        return Balance.ON_EDGE
    return Balance.INSIDE if margin > 0.0 else Balance.OUTSIDE


def _hull_indices(points: Array) -> NDArray[np.intp]:
    """Return indices of the corners of the convex hull of points (n, 2), anticlockwise, (k,).

    Two for collinear points, one for coincident points, none without points.
    """
    from scipy.spatial import ConvexHull

    if not len(points):
        return np.zeros(0, dtype=np.intp)
    near = points - np.mean(points, axis=0)
    first = int(np.argmax(_lengths(near)))
    reach = _lengths(near - near[first])
    last = int(np.argmax(reach))
    thin = max(MIN_SUPPORT_WIDTH, 1e-12 * float(reach[last]))
    if reach[last] <= thin:
        return np.array([first])
    along = (near[last] - near[first]) / reach[last]
    across = _cross(along, near - near[first])
    if np.ptp(across) <= thin:
        return np.array([first, last])
    corners = np.asarray(ConvexHull(near).vertices, dtype=np.intp)
    return corners[_separate_corners(near[corners], thin)]


def _separate_corners(corners: Array, thin: float) -> list[int]:
    """Return indices of corners with neighbours apart: a tiny edge has no definite direction."""
    if np.min(_lengths(np.roll(corners, -1, axis=0) - corners)) > thin:
        return list(range(len(corners)))
    kept = [0]
    for k in range(1, len(corners)):
        if np.hypot(*(corners[k] - corners[kept[-1]])) > thin:
            kept.append(k)
    if np.hypot(*(corners[kept[-1]] - corners[0])) <= thin:
        kept.pop()
    return kept


def _nearest_edge(c: Array, corners: Array) -> tuple[float, tuple[int, ...], Array | None]:
    """Return margin of a point [m], the corners nearest to it, and the outward direction there."""
    if not len(corners):
        return -np.inf, (), None
    following = np.roll(corners, -1, axis=0)
    edges, arms = following - corners, c - corners
    squares = np.sum(edges * edges, axis=1)
    places = np.sum(arms * edges, axis=1) / np.where(squares > 0.0, squares, 1.0)
    away = arms - np.clip(places, 0.0, 1.0)[:, None] * edges
    distances = _lengths(away)
    k = int(np.argmin(distances))
    distance = float(distances[k])
    follower = (k + 1) % len(corners)
    if len(corners) > 2 and np.all(_cross(edges, arms) >= 0.0):
        return distance, (k, follower), _outward_normal(edges[k])
    if len(corners) > 1 and 0.0 < places[k] < 1.0:
        pivot = (k, follower)
    else:
        pivot = (k,) if places[k] <= 0.0 else (follower,)
    if distance > EDGE_TOLERANCE:
        direction = away[k] / distance
    else:
        direction = _outward_normal(edges[k]) if len(corners) > 2 else None
    return 0.0 - distance, pivot, direction


def _outward_normal(edge: Array) -> Array:
    """Return the outward unit normal of an edge (2,) of an anticlockwise polygon."""
    return np.array([edge[1], -edge[0]]) / np.hypot(edge[0], edge[1])


def _lengths(vectors: Array) -> Array:
    return np.hypot(vectors[..., 0], vectors[..., 1])


def _cross(one: Array, other: Array) -> Array:
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]


HEIGHT_TOLERANCE = 1e-9
"""Rounding error of the height of a face in a pose [m]."""

Poses = Mapping[str, Array]
"""Of the segments in the world, shape (4, 4) each."""


@dataclass(frozen=True)
class Points:
    """Support points in one pose.

    Attributes:
        positions: positions in the world, shape (n, 3) [m].
        names: face or site of each, `SEGMENT:FACE` or `SEGMENT.SITE`; the first of the faces that
            meet in a point.
        sources: all faces and sites that support, each once.
    """

    positions: Array
    names: Sequence[str]
    sources: tuple[str, ...]


class Support(Protocol):
    """Support of a figure in any pose."""

    def points_in_pose(self, poses: Poses) -> Points:
        """Return the support points in a pose."""
        ...


@dataclass(frozen=True)
class Patch:
    """Distinct points on one segment.

    Attributes:
        segment: its name.
        points_in_segment: shape (k, 3) [m].
        names: face or site of each point, shape (k,).
        sources: all faces, or the site.
    """

    segment: str
    points_in_segment: Array
    names: tuple[str, ...]
    sources: tuple[str, ...]


def patch_from_site(figure: Figure, ref: SiteRef) -> Patch:
    """Return the point of a site. Raises UsageError when the figure does not have it."""
    segment = _find_segment(figure, ref.segment)
    if ref.site not in segment.sites:
        hint = spelling_hint(ref.site, segment.sites)
        raise UsageError(f"segment `{ref.segment}` has no site `{ref.site}`; {hint}")
    point = figure.site(ref).pose_in_segment[None, :3, 3]
    return Patch(ref.segment, point, (str(ref),), (str(ref),))


def patch_from_faces(figure: Figure, name: str, numbers: Sequence[int] | None = None) -> Patch:
    """Return the corners of faces of a segment, by number from 1 in its psurf [default: all].

    Raises:
        UsageError: the figure has no such segment, or its psurf no such face.
        InputError: the segment has no psurf, or one that cannot be read.
    """
    surface = read_segment_surface(figure, _find_segment(figure, name))
    count = surface.face_count
    for number in numbers or ():
        if not 0 < number <= count:
            raise UsageError(
                f"there is no face {number}: the psurf of `{name}` has {count}, counted from 1"
            )
    chosen = range(1, count + 1) if numbers is None else numbers
    corners = [surface.corners[surface.starts[k - 1] : surface.starts[k]] for k in chosen]
    vertices, first = np.unique(np.concatenate(corners), return_index=True)
    names = [f"{name}:{k}" for k, face in zip(chosen, corners, strict=True) for _ in face]
    return Patch(
        name,
        surface.vertices[vertices],
        tuple(names[int(k)] for k in first.tolist()),
        tuple(dict.fromkeys(names)),
    )


class FixedSupport:
    """Support by the same points in every pose."""

    def __init__(self, patches: Iterable[Patch]) -> None:
        """Collect the points of each segment."""
        by_segment: dict[str, list[Patch]] = {}
        for patch in patches:
            by_segment.setdefault(patch.segment, []).append(patch)
        self._points = {
            name: np.concatenate([patch.points_in_segment for patch in group])
            for name, group in by_segment.items()
        }
        self._names = tuple(
            name for group in by_segment.values() for patch in group for name in patch.names
        )
        self._sources = tuple(
            dict.fromkeys(
                source
                for group in by_segment.values()
                for patch in group
                for source in patch.sources
            )
        )

    def points_in_pose(self, poses: Poses) -> Points:
        """Return the points in a pose."""
        placed = [_transform_points(points, poses[name]) for name, points in self._points.items()]
        positions = np.concatenate([np.zeros((0, 3)), *placed])
        return Points(positions, self._names, self._sources)


class LowFaces:
    """Support by all faces of the figure's own segments at or below a height in the pose."""

    def __init__(self, figure: Figure, height: float, up: ArrayLike = Y_UP) -> None:
        """Read the psurfs of the figure's own segments.

        Args:
            figure: figure whose faces they are.
            height: height over the plane through the world's origin, where the root's site is [m].
            up: normal of that plane, of any length but zero.

        Raises:
            InputError: no segment has a psurf, or one cannot be read.
        """
        self._height = height
        self._up = unit_vector(up)
        own = [figure.segments[name] for name in own_segments(figure)]
        self._surfaces = {
            segment.name: read_segment_surface(figure, segment)
            for segment in own
            if segment.psurf is not None
        }
        if not self._surfaces:
            raise InputError([error("no segment of the figure has a psurf, so there are no faces")])
        self._names = {
            name: np.array([f"{name}:{face + 1}" for face in surface.face_of_corner], dtype=object)
            for name, surface in self._surfaces.items()
        }

    def points_in_pose(self, poses: Poses) -> Points:
        """Return the corners of the faces at or below the height in a pose."""
        positions, names = [np.zeros((0, 3))], list[str]()
        for name, surface in self._surfaces.items():
            pose = poses[name]
            limit = self._height + HEIGHT_TOLERANCE - float(self._up @ pose[:3, 3])
            heights = surface.vertices @ (self._up @ pose[:3, :3])
            if heights.min() > limit:
                continue
            highest = np.maximum.reduceat(heights[surface.corners], surface.starts[:-1])
            low = np.repeat(highest <= limit, surface.corner_counts)
            positions.append(_transform_points(surface.vertices[surface.corners[low]], pose))
            names.extend(self._names[name][low].tolist())
        return Points(np.concatenate(positions), names, tuple(dict.fromkeys(names)))


def _find_segment(figure: Figure, name: str) -> Segment:
    if name not in figure.segments:
        hint = spelling_hint(name, figure.segments)
        raise UsageError(f"the figure has no segment `{name}`; {hint}")
    return figure.segments[name]


def _transform_points(points: Array, pose: Array) -> Array:
    return points @ pose[:3, :3].T + pose[:3, 3]
