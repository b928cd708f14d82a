"""Law of a limb's reach: the directions that it takes, and its turn about itself in each.

d is the limb's direction and c the centre of its reach, both in the parent. theta is the angle
from c to d, phi the azimuth of d about c, t the turn about the limb that is left when the shortest
rotation from c to d is taken off. The boundary of the directions is an angle r(phi), the range of
the turn from lower(p) to upper(p) with p = theta (cos phi, sin phi). The energy is

    U = W(theta - r(phi)) + V(t - upper(p)) + V(lower(p) - t),

W and V being laws of an angle beyond an end. It is smooth but for d = -c, which the boundary must
keep out of reach: a joint with such a law may pass half a turn and any pole of its chain.

With the quaternion (w, u c + x) of the rotation from the limb at the centre, x normal to c:
tan(theta/2) = |x| / sqrt(w^2 + u^2) and t = atan2(2 u w, w^2 - u^2).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import atan2, cos, pi, sin
from typing import NamedTuple

import numpy as np

from springs.axis import UNKNOWN_AXIS, AxisSpring, Direction
from springs.backends import FLOATS, NUMPY, Array, Operations, Real, Vector
from springs.elastic import total_energy, total_torque
from springs.parts import Parts, combined, cross, dot, half_quaternion
from springs.short_repr import short_repr

Quadratic = tuple[float, float, float, float, float, float]
"""Coefficients of 1, p1, p2, p1^2, p1 p2 and p2^2."""

_FLAT: Quadratic = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

NO_LAW = AxisSpring(UNKNOWN_AXIS)
"""Stands for a law of a reach that there is not."""

MAX_BOUNDARY = 165.0 * pi / 180.0
"""Largest angle of the boundary from the centre [rad]."""

_SMALL_ANGLE = 1e-3
"""Angle from the centre below which its functions are taken from their series [rad]."""

_LEAST_ELEVATION = 1e-6
"""Least angle of the centre from the limb's direction at zero displacements [rad]."""

_HARMONIC_RIDGE = 1e-3
"""Weight of the square of a harmonic's coefficients, times the square of its number."""

_QUADRATIC_WEIGHTS = np.array([0.0, 0.0, 0.0, 0.05, 0.05, 0.05])
"""Weights of the squares of a quadratic's coefficients."""


@dataclass(frozen=True)
class ReachPoint:
    """A direction of a limb.

    Attributes:
        plane: plane of elevation [rad]: 0 is a turn about the first of two axes, 90 deg about the
            second.
        elevation: angle from the limb's direction at zero displacements [rad].
    """

    plane: float
    elevation: float


@dataclass(frozen=True)
class TurnRange:
    """Range of a limb's turn about itself, before it is raised in a plane to a direction.

    Attributes:
        at: the direction.
        lower: lower end, in the sense of the joint's own axis along the limb [rad].
        upper: upper end [rad].
    """

    at: ReachPoint
    lower: float
    upper: float


@dataclass(frozen=True)
class ReachFit:
    """Functions through the points of a reach.

    Attributes:
        centre: unit vector in the parent.
        zero: unit vector normal to the centre; the azimuth of directions on its side is 0.
        second: unit vector normal to both.
        start: quaternion of the inverse of the shortest rotation from the limb to the centre.
        boundary: cosine and sine terms of the boundary by multiples of the azimuth, the constant
            first [rad].
        lower: lower end of the turn, right-handed about the limb [rad].
        upper: upper end [rad].
        residuals: largest distances of the points from the boundary, and from the ends [rad].
    """

    centre: Direction
    zero: Direction
    second: Direction
    start: tuple[float, Parts]
    boundary: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    lower: Quadratic = _FLAT
    upper: Quadratic = _FLAT
    residuals: tuple[float, float] = (0.0, 0.0)


@short_repr
@dataclass(frozen=True)
class Reach:
    """Directions that a limb reaches, and the range of its turn about itself in each.

    The boundary is a sum of harmonics of the azimuth, each end of the turn a quadratic of p; both
    meet the points that are given in the least squares.

    Attributes:
        long_axis: unit axis of the limb in the child's frame, from this joint on.
        planes: unit axes in the parent's frame, turns about which raise the limb in the planes 0
            and 90 deg.
        centre: direction from which the boundary is seen.
        boundary: directions on the boundary, twice as many as harmonics and one more at least.
        turns: ranges of the turn; without any the limb turns freely.
        harmonics: number of multiples of the azimuth.
        sense: 1 where a positive turn is right-handed about the long axis, else -1.
        beyond: law of the angle beyond the boundary, negative inside; its direction has no meaning.
        turn: law of the angle beyond either end of the turn, negative inside.
        reference: where the points are from.
        why: why they are read as they are.

    Raises:
        ValueError: There are too few points, the centre is the limb's own direction, or the
            boundary is not between 0 and `MAX_BOUNDARY` from the centre.
    """

    long_axis: Direction
    planes: tuple[Direction, Direction]
    centre: ReachPoint
    boundary: tuple[ReachPoint, ...]
    turns: tuple[TurnRange, ...] = ()
    harmonics: int = 4
    sense: float = 1.0
    beyond: AxisSpring = NO_LAW
    turn: AxisSpring = NO_LAW
    reference: str = ""
    why: str = ""

    def __post_init__(self) -> None:
        """Fit the functions."""
        _ = self.fit

    @cached_property
    def fit(self) -> ReachFit:
        """Functions through the points."""
        return _fit(
            _Points(
                self.long_axis,
                self.planes,
                self.centre,
                self.boundary,
                self.turns,
                self.harmonics,
                self.sense,
            )
        )

    @property
    def parts(self) -> tuple[tuple[str, "Reach | AxisSpring"], ...]:
        """Points and laws by the name of their angle; each has a reference."""
        return ("reach", self), ("reach", self.beyond), ("turn", self.turn)

    @property
    def residuals(self) -> tuple[float, float]:
        """Largest distances of the points from the boundary and the ends of the turn [rad]."""
        return self.fit.residuals

    def boundary_at(self, azimuths: Array) -> Array:
        """Return the angles of the boundary from the centre at azimuths [rad]."""
        return _sum_of_harmonics(self.fit.boundary, azimuths)

    @property
    def torque_at_centre(self) -> float:
        """Torque beyond the boundary at the centre [N m]; there its direction is not defined."""
        return float(total_torque(self.beyond.elastic, -self.fit.boundary[0][0], FLOATS))

    def with_laws(self, change: Callable[[AxisSpring], AxisSpring]) -> "Reach":
        """Return the reach with a change of both laws."""
        return replace(self, beyond=change(self.beyond), turn=change(self.turn))

    def depth(self, r: Vector, ops: Operations = NUMPY) -> Real:
        """Return the angle beyond the boundary, negative inside [rad]."""
        at = self.at(r, ops)
        return at.theta - at.boundary(ops)[0]

    def at(self, r: Vector, ops: Operations = NUMPY) -> "ReachAt":
        """Return the place in the reach of a rotation vector [rad], shape (..., 3)."""
        return _at(self.fit, r, ops)

    def torque(self, r: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the torque on the child in the half-way frame [N m], shape (..., 3)."""
        return self.at(r, ops).torque(self, ops)

    def energy(self, r: Vector, ops: Operations = NUMPY) -> Real:
        """Return the stored energy [J]."""
        return self.at(r, ops).energy(self, ops)


@dataclass(frozen=True)
class ReachAt:
    """Place of a limb in its reach.

    Attributes:
        fit: functions of the reach.
        rotation: quaternion of the rotation of the child.
        theta: angle from the centre [rad].
        turn: turn about the limb, within half of one from the middle of its range here [rad].
        swing: theta times the axis of the shortest rotation from the centre, in the parent.
        half_tangent: tangent of half of theta.
        place: p, theta times the cosine and the sine of the azimuth [rad].
        lower: lower end of the turn here [rad], and its slopes along p.
        upper: upper end, likewise.
    """

    fit: ReachFit
    rotation: tuple[Real, Parts]
    theta: Real
    turn: Real
    swing: Parts
    half_tangent: Real
    place: tuple[Real, Real]
    lower: tuple[Real, Real, Real]
    upper: tuple[Real, Real, Real]

    def boundary(self, ops: Operations) -> tuple[Real, Real, Real]:
        """Return the boundary at the azimuth, its slope, and theta kept from zero [rad]."""
        safe = ops.smooth_where(self.theta < _SMALL_ANGLE, 1.0, self.theta)
        p1, p2 = self.place
        c1, s1 = p1 / safe, p2 / safe
        value, slope = self.fit.boundary[0][0], 0.0
        multiples = _cosines_and_sines(c1, s1, len(self.fit.boundary) - 1)
        for k, ((a, b), (c, s)) in enumerate(zip(self.fit.boundary[1:], multiples, strict=True), 1):
            value = value + (a * c + b * s)
            slope = slope + k * (b * c - a * s)
        return value, slope, safe

    def energy(self, reach: Reach, ops: Operations) -> Real:
        """Return the stored energy [J]."""
        energy = total_energy(reach.beyond.elastic, self.theta - self.boundary(ops)[0], ops)
        if not reach.turns:
            return energy
        above = total_energy(reach.turn.elastic, self.turn - self.upper[0], ops)
        return energy + above + total_energy(reach.turn.elastic, self.lower[0] - self.turn, ops)

    def torque(self, reach: Reach, ops: Operations) -> Vector:
        """Return the torque on the child in the half-way frame [N m], shape (..., 3)."""
        fit, centre, theta = self.fit, self.fit.centre, self.theta
        across = cross(centre, self.swing)
        boundary, slope, safe = self.boundary(ops)
        push = total_torque(reach.beyond.elastic, theta - boundary, ops)
        tangent = ops.smooth_where(theta < _SMALL_ANGLE, 1.0, self.half_tangent)
        cotangent = 0.5 * (1.0 / tangent - tangent)
        # At the centre the azimuth has no gradient, and the law beyond the boundary no torque.
        push = ops.smooth_where(theta < _SMALL_ANGLE, 0.0, push)
        around = -push * slope
        total = combined(
            (push / safe, self.swing), (around, centre), (around * cotangent / safe, across)
        )
        if reach.turns and reach.turn.elastic:
            (upper, *by_upper), (lower, *by_lower) = self.upper, self.lower
            above = total_torque(reach.turn.elastic, self.turn - upper, ops)
            below = total_torque(reach.turn.elastic, lower - self.turn, ops)
            # The gradient of p is a constant vector and a part that vanishes at the centre.
            g1, g2 = (below * b - above * a for a, b in zip(by_upper, by_lower, strict=True))
            p1, p2 = self.place
            about = g2 * p1 - g1 * p2
            square = theta * theta
            small = theta < 10.0 * _SMALL_ANGLE
            bent = ops.smooth_where(
                small,
                -1.0 / 3.0 - square / 45.0,
                (theta * cotangent - 1.0) / ops.smooth_where(small, 1.0, square),
            )
            half = ops.smooth_where(
                small, 0.5 + square / 24.0, self.half_tangent / ops.smooth_where(small, 1.0, theta)
            )
            twist = above - below
            total = combined(
                (1.0, total),
                (g1, fit.second),
                (-g2, fit.zero),
                (about + twist, centre),
                (about * bent - twist * half, across),
            )
        w, v = self.rotation
        once = cross(v, total)
        return ops.vector(combined((1.0, total), (-1.0, once), (1.0 / (1.0 + w), cross(v, once))))


def _at(fit: ReachFit, r: Vector, ops: Operations) -> "ReachAt":
    w, v = half_quaternion(r, ops)
    w0, v0 = fit.start
    whole = w * w0 - dot(v, v0)
    p = combined((w, v0), (w0, v), (1.0, cross(v, v0)))
    u = dot(p, fit.centre)
    x = combined((1.0, p), (-u, fit.centre))
    s, h = ops.sqrt(dot(x, x)), ops.sqrt(whole * whole + u * u)
    theta = 2.0 * ops.atan2(s, h)
    small = theta < _SMALL_ANGLE
    product = ops.smooth_where(small, 1.0, h * s)
    rate = ops.smooth_where(small, 2.0 + theta * theta / 3.0, theta / product)
    swing = combined((rate * whole, x), (rate * u, cross(fit.centre, x)))
    place = dot(swing, fit.second), -dot(swing, fit.zero)
    lower, upper = _end(fit.lower, place), _end(fit.upper, place)
    sine, cosine, middle = 2.0 * u * whole, whole * whole - u * u, 0.5 * (lower[0] + upper[0])
    if isinstance(middle, float):
        b, c = sin(middle), cos(middle)
    else:
        b, c = ops.sin(middle), ops.cos(middle)
    turn = middle + ops.atan2(sine * c - cosine * b, cosine * c + sine * b)
    return ReachAt(fit, (w, v), theta, turn, swing, s / h, place, lower, upper)


def _end(quadratic: Quadratic, place: tuple[Real, Real]) -> tuple[Real, Real, Real]:
    """Return an end of the turn [rad] at p, and its slopes along p."""
    if quadratic == _FLAT:
        return 0.0, 0.0, 0.0
    k0, k1, k2, k11, k12, k22 = quadratic
    p1, p2 = place
    value = k0 + p1 * (k1 + k11 * p1 + k12 * p2) + p2 * (k2 + k22 * p2)
    return value, k1 + 2.0 * k11 * p1 + k12 * p2, k2 + k12 * p1 + 2.0 * k22 * p2


class _Points(NamedTuple):
    """The attributes of a reach on which its functions depend."""

    long_axis: Direction
    planes: tuple[Direction, Direction]
    centre: ReachPoint
    boundary: tuple[ReachPoint, ...]
    turns: tuple[TurnRange, ...]
    harmonics: int
    sense: float


@lru_cache(maxsize=64)
def _fit(points: _Points) -> ReachFit:
    """Functions through the points; a study scales the laws of one reach many times."""
    axis = np.array(points.long_axis)
    centre = _matrix(_raising(points, points.centre)) @ axis
    zero = axis - (axis @ centre) * centre
    if np.linalg.norm(zero) < _LEAST_ELEVATION:
        raise ValueError("the centre of a reach is not the limb's direction at zero")
    zero /= np.linalg.norm(zero)
    vector = np.cross(centre, axis)
    start = np.array([1.0 + axis @ centre, *vector])
    w, x, y, z = map(float, start / np.linalg.norm(start))
    second = np.cross(centre, zero)
    fit = ReachFit(_direction(centre), _direction(zero), _direction(second), (w, (x, y, z)))
    fit, off_boundary = _with_boundary(points, fit)
    fit, off_turn = _with_turns(points, fit)
    return replace(fit, residuals=(off_boundary, off_turn))


def _with_boundary(points: _Points, fit: ReachFit) -> tuple[ReachFit, float]:
    """Return a fit with its boundary, and the largest residual [rad]."""
    needed = 2 * points.harmonics + 1
    if len(points.boundary) < needed:
        raise ValueError(
            f"a boundary of {points.harmonics} harmonics needs {needed} points, not "
            f"{len(points.boundary)}"
        )
    places = np.array(
        [_at(fit, _raising(points, point), FLOATS).place for point in points.boundary]
    )
    sizes = np.hypot(places[:, 0], places[:, 1])
    multiples = np.arange(1, points.harmonics + 1)
    c, s = (places / np.maximum(sizes, _LEAST_ELEVATION)[:, None]).T
    columns: list[Array] = [np.ones_like(sizes)]
    for pair in _cosines_and_sines(c, s, points.harmonics):
        columns += pair
    weights = np.concatenate([[0.0], np.repeat(_HARMONIC_RIDGE * multiples**2, 2)])
    found, residual = _least_squares(np.column_stack(columns), sizes, weights)
    terms = ((found[0], 0.0), *zip(found[1::2], found[2::2], strict=True))
    angles = _sum_of_harmonics(terms, np.radians(np.arange(360.0)))
    if angles.min() <= 0.0 or angles.max() >= MAX_BOUNDARY:
        low, high = np.degrees([angles.min(), angles.max()])
        raise ValueError(
            f"the boundary of a reach is {low:.0f} to {high:.0f} deg from its centre, not between "
            f"0 and {np.degrees(MAX_BOUNDARY):.0f}"
        )
    return replace(fit, boundary=terms), residual


def _with_turns(points: _Points, fit: ReachFit) -> tuple[ReachFit, float]:
    """Return a fit with the ends of the turn, and the largest residual [rad]."""
    if not points.turns:
        return fit, 0.0
    axis = points.sense * np.array(points.long_axis)
    raisings = [_raising(points, each.at) for each in points.turns]
    rows = np.array([_powers(*_at(fit, raising, FLOATS).place) for raising in raisings])
    ends = [(each.lower, each.upper)[:: int(points.sense)] for each in points.turns]
    middle = _turn(fit, _raising(points, points.centre), axis * float(np.mean(ends)))
    quadratics: list[Quadratic] = []
    residuals: list[float] = []
    for angles in zip(*ends, strict=True):
        turns = [_turn(fit, r, axis * each) for r, each in zip(raisings, angles, strict=True)]
        # Rounding to a whole number of turns is odd, as a remainder is not.
        near = turns - 2.0 * pi * np.round((np.array(turns) - middle) / (2.0 * pi))
        (k0, k1, k2, k11, k12, k22), residual = _least_squares(rows, near, _QUADRATIC_WEIGHTS)
        quadratics.append((k0, k1, k2, k11, k12, k22))
        residuals.append(residual)
    lower, upper = quadratics
    return replace(fit, lower=lower, upper=upper), max(residuals)


def _cosines_and_sines(c1: Real, s1: Real, count: int) -> Iterator[tuple[Real, Real]]:
    """Yield cosine and sine of the first multiples of an angle, given those of the angle itself.

    The opposite angle has exactly the same cosines and the opposite sines, so that a reach and its
    mirror image have exactly opposite torques.
    """
    before, c, s = (1.0, 0.0), c1, s1
    for _ in range(count):
        yield c, s
        before, c, s = (c, s), 2.0 * c1 * c - before[0], 2.0 * c1 * s - before[1]


def _sum_of_harmonics(terms: Sequence[tuple[float, float]], azimuths: Array) -> Array:
    sizes = [a * np.cos(k * azimuths) + b * np.sin(k * azimuths) for k, (a, b) in enumerate(terms)]
    return np.sum(sizes, axis=0)


def _raising(points: _Points, point: ReachPoint) -> Array:
    """Rotation vector that raises the limb to a direction."""
    first, second = map(np.array, points.planes)
    turned = cos(point.plane) * first + sin(point.plane) * second
    return np.asarray(point.elevation * turned)


def _matrix(r: Array) -> Array:
    """Matrix of a rotation vector."""
    w, v = half_quaternion(r, FLOATS)
    x, y, z = map(float, v)
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + 2.0 * (w * across + across @ across))


def _turn(fit: ReachFit, raising: Array, turn: Array) -> float:
    """Turn of a limb that is turned about itself, then raised."""
    (w, v), (w1, v1) = (half_quaternion(each, FLOATS) for each in (raising, turn))
    x = np.array(combined((w, v1), (w1, v), (1.0, cross(v, v1))), dtype=np.float64)
    size = float(np.linalg.norm(x))
    angle = 2.0 * atan2(size, float(w * w1 - dot(v, v1)))
    return float(_at(fit, x * (angle / size if size else 2.0), FLOATS).turn)


def _powers(p1: Real, p2: Real) -> tuple[Real, ...]:
    return 1.0, p1, p2, p1 * p1, p1 * p2, p2 * p2


def _least_squares(rows: Array, values: Array, weights: Array) -> tuple[list[float], float]:
    """Coefficients with weights of their squares, and the largest residual.

    Raises ValueError for rows that do not determine them.
    """
    try:
        found = np.linalg.solve(rows.T @ rows + np.diag(weights), rows.T @ values)
    except np.linalg.LinAlgError:
        message = "the ends of a turn need three directions at least that are not in a line"
        raise ValueError(message) from None
    return found.tolist(), float(np.max(np.abs(rows @ found - values)))


def _direction(vector: Array) -> Direction:
    x, y, z = map(float, vector)
    return x, y, z
