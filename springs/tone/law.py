"""Torque of muscles about an axis: towards an angle, within a share of their strength.

    tau = A (m h + d h^2),    h = tanh((q0 - q - td q') / th)

m is half the sum and d half the difference of the largest torques in the two directions, so that
they are reached at h = 1 and h = -1. A is the activation at a time. The law has all derivatives.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

from springs.axis import Direction
from springs.backends import NUMPY, Operations, Real, Vector
from springs.coordinates import CoordinateLaw
from springs.spherical import RotationLaw

WIDTH = 0.2
"""Error at which the torque is 0.76 of the largest one [rad]; an estimate."""

LEAD = 0.1
"""Time by which the error is anticipated, which damps [s]; an estimate."""


@dataclass(frozen=True)
class AxisTone:
    """Tone about one axis.

    Attributes:
        direction: Unit axis, about which the angle grows.
        largest: Largest torques about the axis and against it, not negative [N m].
        rest: Angle that it holds [rad].
        width: Error at which the torque is 0.76 of the largest one [rad].
        lead: Time by which the error is anticipated [s].

    Raises:
        ValueError: A torque is negative, or the width is not positive.
    """

    direction: Direction
    largest: tuple[float, float]
    rest: float = 0.0
    width: float = WIDTH
    lead: float = LEAD

    def __post_init__(self) -> None:
        """Check the numbers."""
        if min(self.largest) < 0.0:
            raise ValueError(f"the largest torques of muscles are not negative: {self.largest}")
        if not self.width > 0.0:
            raise ValueError(f"the width of a tone is positive, not {self.width:g} rad")

    def torque(self, angle: Real, rate: Real, activation: Real, ops: Operations = NUMPY) -> Real:
        """Return the torque on the child [N m].

        Its size is at most the larger of both largest torques; in each direction it is at most its
        own, where neither is more than three times the other.

        Args:
            angle: Angle [rad].
            rate: Its rate [rad/s].
            activation: Activation, from 0 to 1.
            ops: Functions of the kind of number in these.
        """
        plus, minus = self.largest
        share = ops.tanh((1.0 / self.width) * (self.rest - angle - self.lead * rate))
        return activation * (share * (0.5 * (plus + minus) + 0.5 * (plus - minus) * share))

    def oriented_along(self, axis: Direction) -> "AxisTone":
        """Return the same tone about `axis`, which is its direction or the opposite."""
        if sum(a * b for a, b in zip(self.direction, axis, strict=True)) > 0.0:
            return self
        x, y, z = self.direction
        plus, minus = self.largest
        return replace(self, direction=(-x, -y, -z), largest=(minus, plus), rest=-self.rest)


def vector_tone(
    axes: Sequence[AxisTone], r: Vector, rate: Vector, activation: Real, ops: Operations = NUMPY
) -> Vector:
    """Return the sum of the torques about axes, of the components of a rotation vector [N m].

    Args:
        axes: Tones about one axis or more.
        r: Rotation vector [rad], shape (..., 3).
        rate: Angular velocity in the axes of the torque [rad/s], shape (..., 3).
        activation: Activation, from 0 to 1.
        ops: Functions of the kind of number in these.
    """

    def along(axis: AxisTone) -> Vector:
        direction = ops.vector(axis.direction)
        torque = axis.torque(ops.dot(direction, r), ops.dot(direction, rate), activation, ops)
        return ops.scaled(torque, direction)

    return reduce(add, map(along, axes))


def rotation_tone(
    law: RotationLaw,
    axes: Sequence[AxisTone],
    r: Vector,
    rate: Vector,
    activation: Real,
    ops: Operations = NUMPY,
) -> Vector:
    """Return the torque of tones of several rotations in the half-way frame [N m], shape (..., 3).

    Where the law of the joint is one of the displacements of its chain, tones are generalized
    forces along these; else they are of the components of the rotation vector and of the angular
    velocity, about the axes of the half-way frame.

    Args:
        law: Law of the joint's springs.
        axes: Tones about axes of the joint, one or more.
        r: Rotation vector of the child in the parent [rad], shape (..., 3).
        rate: Angular velocity of the child relative to the parent in the half-way frame [rad/s],
            shape (..., 3).
        activation: Activation, from 0 to 1.
        ops: Functions of the kind of number in these.
    """
    if not isinstance(law, CoordinateLaw):
        return vector_tone(axes, r, rate, activation, ops)
    at = law.coordinates.at(r, ops)
    rates = at.rates(rate, ops)
    torques: list[Real | None] = [None] * len(rates)
    for axis in axes:
        index, _ = law.coordinates.place(axis.direction)
        own = axis.oriented_along(law.coordinates.axes[index])
        torques[index] = own.torque(at.angles[index], rates[index], activation, ops)
    return at.torque(torques, ops)


def rest_angle(law: RotationLaw, direction: Direction, r: Vector) -> float:
    """Return the angle about an axis, as `rotation_tone` measures it [rad].

    Args:
        law: Law of the joint's springs.
        direction: Unit axis of the joint.
        r: Rotation vector of the child in the parent [rad], shape (3,).
    """
    if isinstance(law, CoordinateLaw):
        (angle,) = law.angles([direction], r)
        return float(angle)
    return float(NUMPY.dot(NUMPY.vector(direction), r))
