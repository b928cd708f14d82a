"""Laws of three axes combined into the law of a spherical joint (eq. 4.4, corrected in two ways).

Eq. 4.4 as printed is not a function of the orientation: (A, alpha) and (-A, -alpha) are one
rotation with two moments. Both laws here are functions of the rotation vector r = alpha A and
reduce to the axis's own law for a turn about an axis. Torques act on the child and are components
in the half-way frame, the parent's frame turned by r/2.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Protocol

from springs.axis import AxisSpring, Direction
from springs.backends import NUMPY, Operations, Real, Vector
from springs.coordinates import ChainCoordinates, CoordinateLaw
from springs.elastic import total_energy, total_torque
from springs.joint import JointSprings, Singularity, SphericalLaw
from springs.reach import Reach

_SMALL_ANGLE = 1e-2
"""Angle below which (a/2)/sin(a/2) is taken from its series [rad]."""

_SMALLEST_ANGLE = 1e-150
"""Angle below which its square is lost to underflow [rad]."""


class RotationLaw(Protocol):
    """Torque and energy of a joint's springs as functions of its rotation vector."""

    @property
    def axes(self) -> Sequence[AxisSpring]:
        """Springs of the axes."""
        ...

    @property
    def is_conservative(self) -> bool:
        """True where the elastic torque has an energy."""
        ...

    @property
    def singularity(self) -> Singularity:
        """Orientations at which the elastic torque is not defined."""
        ...

    def torque(self, r: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the elastic torque [N m], shape (..., 3), at a rotation vector [rad]."""
        ...

    def energy(self, r: Vector, ops: Operations = NUMPY) -> Real:
        """Return the stored energy [J] of a conservative law."""
        ...

    def damping(self, r: Vector, rate: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the torque of damping and friction [N m], shape (..., 3).

        Args:
            r: Rotation vector [rad], shape (..., 3).
            rate: Angular velocity of the child relative to the parent in the half-way frame
                [rad/s], shape (..., 3).
            ops: Functions of the kind of number in both.
        """
        ...

    def angles(
        self, directions: Sequence[Direction], r: Vector, ops: Operations = NUMPY
    ) -> Sequence[Real]:
        """Return the coordinates about axes [rad], which laws over several joints read."""
        ...

    def torque_about(
        self,
        directions: Sequence[Direction],
        torques: Sequence[Real],
        r: Vector,
        ops: Operations = NUMPY,
    ) -> Vector:
        """Return the torque [N m] whose power is the sum of torques times rates of `angles`."""
        ...


@dataclass(frozen=True)
class VectorLaw:
    """Laws of the components of the rotation vector (eq. 4.4, corrected).

    Attributes:
        axes: Springs of the axes.
        is_weighted: True for the thesis's directional weighting, which has no energy.
    """

    axes: tuple[AxisSpring, ...]
    is_weighted: bool = False

    @property
    def is_conservative(self) -> bool:
        """True where the elastic torque has an energy."""
        return not self.is_weighted

    @property
    def singularity(self) -> Singularity:
        """A half turn."""
        return Singularity.HALF_TURN

    def torque(self, r: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the elastic torque."""
        law = weighted_torque if self.is_weighted else conservative_torque
        return law(self.axes, r, ops)

    def energy(self, r: Vector, ops: Operations = NUMPY) -> Real:
        """Return the energy of the conservative law."""
        return conservative_energy(self.axes, r, ops)

    def damping(self, r: Vector, rate: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the torque of damping about the axes of the half-way frame."""
        return damping_torque(self.axes, r, rate, ops)

    def angles(
        self, directions: Sequence[Direction], r: Vector, ops: Operations = NUMPY
    ) -> Sequence[Real]:
        """Return the components of the rotation vector along the axes."""
        return [ops.dot(ops.vector(direction), r) for direction in directions]

    def torque_about(
        self,
        directions: Sequence[Direction],
        torques: Sequence[Real],
        r: Vector,
        ops: Operations = NUMPY,
    ) -> Vector:
        """Return the `group_torque` of the torques along their axes."""
        parts = [ops.scaled(t, ops.vector(d)) for d, t in zip(directions, torques, strict=True)]
        return group_torque(reduce(add, parts), r, ops)


@dataclass(frozen=True)
class ReachLaw:
    """A limb's reach, and damping about the axes of the half-way frame.

    Attributes:
        axes: Damping of the axes.
        reach: Directions and turns of the limb.
    """

    axes: tuple[AxisSpring, ...]
    reach: Reach

    @property
    def is_conservative(self) -> bool:
        """True."""
        return True

    @property
    def singularity(self) -> Singularity:
        """None: the direction opposite to the centre is out of reach."""
        return Singularity.NONE

    def torque(self, r: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the elastic torque."""
        return self.reach.torque(r, ops)

    def energy(self, r: Vector, ops: Operations = NUMPY) -> Real:
        """Return the stored energy."""
        return self.reach.energy(r, ops)

    def damping(self, r: Vector, rate: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the torque of damping about the axes of the half-way frame."""
        return damping_torque(self.axes, r, rate, ops)

    def angles(
        self, directions: Sequence[Direction], r: Vector, ops: Operations = NUMPY
    ) -> Sequence[Real]:
        """Raise ValueError: a reach has no coordinates."""
        if directions:
            raise ValueError("a law over several joints cannot read a joint with a reach")
        return []

    def torque_about(
        self,
        directions: Sequence[Direction],
        torques: Sequence[Real],
        r: Vector,
        ops: Operations = NUMPY,
    ) -> Vector:
        """Raise ValueError, as `angles`."""
        raise ValueError("a law over several joints cannot read a joint with a reach")


def rotation_law(
    springs: JointSprings, law: SphericalLaw, chain: Sequence[Direction]
) -> RotationLaw:
    """Return the law of a joint of several rotations.

    Args:
        springs: Springs of its axes, or its reach.
        law: Rule that joins them.
        chain: Axes of its rotations, innermost first.

    Raises:
        ValueError: A spring is about no axis of a chain whose coordinates the law needs, or the
            chain's outer axes are not perpendicular.
    """
    if springs.reach is not None:
        return ReachLaw(springs.axes, springs.reach)
    if law is not SphericalLaw.COORDINATES:
        return VectorLaw(springs.axes, law is SphericalLaw.WEIGHTED)
    coordinates = ChainCoordinates(
        tuple(chain), tuple(_middle(springs.axes, axis) for axis in chain)
    )
    own: list[AxisSpring | None] = [None] * len(chain)
    for spring in springs.axes:
        index, _ = coordinates.place(spring.direction)
        if own[index] is not None:
            raise ValueError("a law of coordinates needs one spring at most about an axis")
        own[index] = spring.oriented_along(chain[index])
    return CoordinateLaw(tuple(own), coordinates)


def _middle(springs: Sequence[AxisSpring], axis: Direction) -> float:
    """Middle of the range of the spring about an axis [rad], 0 where there is none."""
    for spring in springs:
        along = sum(a * b for a, b in zip(spring.direction, axis, strict=True))
        if abs(along) > 0.5:
            return spring.middle if along > 0.0 else -spring.middle
    return 0.0


def conservative_torque(axes: Sequence[AxisSpring], r: Vector, ops: Operations = NUMPY) -> Vector:
    """Minus the gradient, on the rotation group, of the sum of the axes' energies U_i(a_i . r).

    It is the `group_torque` of f = -dU/dr.

    Args:
        axes: the joint's axis springs.
        r: rotation vector of the child in the parent [rad], shape (..., 3).
        ops: functions of the kind of number in `r`.

    Returns:
        Torque on the child in the half-way frame [N m], shape (..., 3).
    """

    def size(axis: AxisSpring) -> Real:
        return total_torque(axis.elastic, _component(axis, r, ops), ops)

    return group_torque(_sum_along_axes(axes, size, ops), r, ops)


def group_torque(f: Vector, r: Vector, ops: Operations = NUMPY) -> Vector:
    """The torque whose power is f . dr/dt: f per radian of the rotation vector, on the group.

    Args:
        f: what each component of the rotation vector is driven by [N m], shape (..., 3).
        r: rotation vector of the child in the parent [rad], shape (..., 3).
        ops: functions of the kind of number in both.

    Returns:
        Torque on the child in the half-way frame [N m], shape (..., 3). It is f with its part
        across r scaled by (a/2)/sin(a/2), where `a = |r|`. There the rate of r and the relative
        angular velocity differ by just that factor across r, and not at all along it. With
        e = ((a/2)/sin(a/2) - 1)/a^2 it reads f + e (a^2 f - (r.f) r).
    """
    a = ops.norm(r)
    small = a < _SMALL_ANGLE
    safe = ops.smooth_where(small, 1.0, a)
    series = 1.0 / 24.0 + (7.0 / 5760.0) * a * a
    excess = ops.smooth_where(small, series, (0.5 / ops.sin(0.5 * safe) - 1.0 / safe) / safe)
    # f stands in it twice only: expression trees are evaluated without sharing.
    return ops.scaled(1.0 + excess * a * a, f) - ops.scaled(excess * ops.dot(r, f), r)


def conservative_energy(axes: Sequence[AxisSpring], r: Vector, ops: Operations = NUMPY) -> Real:
    """Stored energy U(r) = sum of U_i(a_i . r) [J]; zero without axes."""
    terms = [total_energy(axis.elastic, _component(axis, r, ops), ops) for axis in axes]
    return reduce(add, terms, ops.part(r, 0) * 0.0)


def weighted_torque(axes: Sequence[AxisSpring], r: Vector, ops: Operations = NUMPY) -> Vector:
    """The thesis's directional weighting (eq. 4.4), corrected to a function of the orientation.

    Each axis takes `t_i(0) + |A_i| (t_i(sgn(A_i) a) - t_i(0))`, t_i being its own torque law and
    A = r/a: the law at the full angle, weighted by how far the turn is about that axis. It is
    not a gradient: round a closed loop of orientations it does work.

    Arguments and result as `conservative_torque`.
    """
    a = ops.norm(r)
    safe = ops.smooth_where(a < _SMALLEST_ANGLE, 1.0, a)

    def size(axis: AxisSpring) -> Real:
        x = _component(axis, r, ops)
        at_rest = float(total_torque(axis.elastic, 0.0))
        backward = x < 0.0
        at_angle = total_torque(axis.elastic, ops.where(backward, -a, a), ops)
        return at_rest + ops.where(backward, -x, x) / safe * (at_angle - at_rest)

    return _sum_along_axes(axes, size, ops)


def elastic_torque(
    law: SphericalLaw, axes: Sequence[AxisSpring], r: Vector, ops: Operations = NUMPY
) -> Vector:
    """Torque of a law of the rotation vector on the child in the half-way frame [N m].

    Its shape is (..., 3). Raises ValueError for laws of coordinates, which need the joint's chain.
    """
    if law is SphericalLaw.COORDINATES:
        raise ValueError("a law of coordinates needs the joint's chain: call `rotation_law`")
    torque = conservative_torque if law is SphericalLaw.CONSERVATIVE else weighted_torque
    return torque(axes, r, ops)


def damping_torque(
    axes: Sequence[AxisSpring], r: Vector, rate: Vector, ops: Operations = NUMPY
) -> Vector:
    """Torque of damping and of the friction of directional laws, against the rate.

    Args:
        axes: the joint's axis springs.
        r: rotation vector of the child in the parent [rad], shape (..., 3).
        rate: angular velocity of the child relative to the parent in the half-way frame [rad/s],
            shape (..., 3).
        ops: functions of the kind of number in both.

    Returns:
        Torque on the child in the half-way frame [N m], shape (..., 3).
    """

    def size(axis: AxisSpring) -> Real:
        return axis.resistance(_component(axis, r, ops), _component(axis, rate, ops), ops)

    return _sum_along_axes(axes, size, ops)


def _coordinate_axis(axis: AxisSpring) -> int | None:
    """Index of x, y or z along the axis, or None for any other axis."""
    place = [k for k in range(3) if axis.direction[k] == 1.0]
    return place[0] if place and sum(map(abs, axis.direction)) == 1.0 else None


def _with_positive_axis(axis: AxisSpring) -> AxisSpring:
    """Return the axis about the positive coordinate axis where it is along a negative one."""
    is_negative = -1.0 in axis.direction and sum(map(abs, axis.direction)) == 1.0
    return axis.with_opposite_axis() if is_negative else axis


def _component(axis: AxisSpring, vector: Vector, ops: Operations) -> Real:
    """Component of a vector along an axis."""
    place = _coordinate_axis(axis)
    if place is not None:
        return ops.part(vector, place)
    return ops.dot(ops.vector(axis.direction), vector)


def _sum_along_axes(
    axes: Sequence[AxisSpring], size: Callable[[AxisSpring], Real], ops: Operations
) -> Vector:
    """The sum of the axes' directions, each times its size; each size stands in it once."""
    sums: list[Real] = [None, None, None]
    skew: list[Vector] = []
    for axis in map(_with_positive_axis, axes):
        value, place = size(axis), _coordinate_axis(axis)
        if place is None:
            skew.append(ops.scaled(value, ops.vector(axis.direction)))
        else:
            sums[place] = value if sums[place] is None else sums[place] + value
    if any(part is not None for part in sums) or not skew:
        skew.append(ops.vector([0.0 if part is None else part for part in sums]))
    return reduce(add, skew)
