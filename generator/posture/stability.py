"""Static stability: does the centre of mass stand over what supports the figure?

The thesis's test (5.2): the figure is balanced when its centre of mass, projected on the ground
plane, lies in the convex hull of the projected points of support. It takes the joints as rigid and
gravity as the only load.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from generator.frames import Array, frame_with_z

Y_UP = (0.0, 1.0, 0.0)
"""The normal of the ground in the world of the thesis."""

ON_EDGE = 1e-6
"""Nearer than this to the edge of the support a point counts as on it [m]."""

THIN = 1e-9
"""A support that is narrower than this is a line, and one that is shorter is a point [m]."""


class Balance(Enum):
    """Where the centre of mass stands; the value is what a sentence calls it."""

    INSIDE = "inside"
    ON_EDGE = "on the edge"
    OUTSIDE = "outside"
    UNSUPPORTED = "unsupported"


@dataclass(frozen=True)
class Stability:
    """How a figure stands.

    Attributes:
        balance: where the centre of mass stands.
        margin: distance of the projected centre of mass to the edge of the support [m]; negative
            outside, minus infinity without support.
        centre: the centre of mass, projected on the ground plane through the world's origin, in
            the world, shape (3,) [m].
        corners: of the support, projected likewise, anticlockwise seen from above, shape (k, 3)
            [m]. One of them is a point, two are a line.
        sources: which points of support the corners are, shape (k,).
        pivot: which of the corners the figure would tip over: two for an edge, one for a corner.
        direction: to which side it would tip, a horizontal unit vector in the world, shape (3,).
            None without support, and where a point or a line of support stands right under the
            centre of mass: it may tip to any side of it.
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
    """How what has its centre of mass at `centre` stands on `points`.

    Args:
        centre: centre of mass, shape (3,) [m].
        points: that support, shape (n, 3) [m]; n may be zero.
        up: normal of the ground plane, of any length but zero.

    Raises:
        ValueError: `up` is zero, or a number is not finite.
    """
    where = np.asarray(centre, dtype=float)
    given = np.asarray(points, dtype=float).reshape(-1, 3)
    if not (np.all(np.isfinite(where)) and np.all(np.isfinite(given))):
        raise ValueError("positions must be finite")
    plane = frame_with_z(up)[:, :2]
    c, flat = where @ plane, given @ plane
    sources = _hull(flat)
    corners = flat[sources]
    margin, pivot, direction = _nearest(c, corners)
    return Stability(
        balance=_balance(margin),
        margin=margin,
        centre=plane @ c,
        corners=corners @ plane.T,
        sources=sources,
        pivot=pivot,
        direction=None if direction is None else plane @ direction,
    )


def _balance(margin: float) -> Balance:
    if margin == -np.inf:
        return Balance.UNSUPPORTED
    if abs(margin) <= ON_EDGE:
        return Balance.ON_EDGE
    return Balance.INSIDE if margin > 0.0 else Balance.OUTSIDE


def _hull(points: Array) -> NDArray[np.intp]:
    """Which of the points (n, 2) are corners of their convex hull, anticlockwise, shape (k,).

    Two for points in a line, one for points in one place, none for no points.
    """
    if not len(points):
        return np.zeros(0, dtype=np.intp)
    near = points - np.mean(points, axis=0)
    first = int(np.argmax(_lengths(near)))
    reach = _lengths(near - near[first])
    last = int(np.argmax(reach))
    thin = max(THIN, 1e-12 * float(reach[last]))
    if reach[last] <= thin:
        return np.array([first])
    along = (near[last] - near[first]) / reach[last]
    across = _cross(along, near - near[first])
    if np.ptp(across) <= thin:
        return np.array([first, last])
    corners = np.asarray(ConvexHull(near).vertices, dtype=np.intp)
    return corners[_apart(near[corners], thin)]


def _apart(corners: Array, thin: float) -> list[int]:
    """Which corners to keep so that neighbours lie apart: a tiny edge has no sure direction."""
    if np.min(_lengths(np.roll(corners, -1, axis=0) - corners)) > thin:
        return list(range(len(corners)))
    kept = [0]
    for k in range(1, len(corners)):
        if np.hypot(*(corners[k] - corners[kept[-1]])) > thin:
            kept.append(k)
    if np.hypot(*(corners[kept[-1]] - corners[0])) <= thin:
        kept.pop()
    return kept


def _nearest(c: Array, corners: Array) -> tuple[float, tuple[int, ...], Array | None]:
    """Margin of a point [m], the corners it is nearest to, and the way out there."""
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
        return distance, (k, follower), _outward(edges[k])
    if len(corners) > 1 and 0.0 < places[k] < 1.0:
        pivot = (k, follower)
    else:
        pivot = (k,) if places[k] <= 0.0 else (follower,)
    if distance > ON_EDGE:
        direction = away[k] / distance
    else:
        direction = _outward(edges[k]) if len(corners) > 2 else None
    return 0.0 - distance, pivot, direction


def _outward(edge: Array) -> Array:
    """The unit normal of an edge (2,) that points out of a polygon with its corners in order."""
    return np.array([edge[1], -edge[0]]) / np.hypot(edge[0], edge[1])


def _lengths(vectors: Array) -> Array:
    return np.hypot(vectors[..., 0], vectors[..., 1])


def _cross(one: Array, other: Array) -> Array:
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]
