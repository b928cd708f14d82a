"""The law of a joint of several rotations: from those of its axes, by the rule that joins them.

A law is a function of the rotation vector r of the child in the parent. Torques act on the child
and are components in the half-way frame, the parent's frame turned by r/2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import reduce
from operator import add
from typing import Protocol

from springs.backends import NUMPY, Operations, Real, Vector
from springs.coordinates import ChainCoordinates
from springs.elastic import total_energy, total_torque
from springs.joint import AxisSpring, Direction, Joining, JointSprings
from springs.spherical import (
    conservative_energy,
    conservative_torque,
    damping_torque,
    group_torque,
    weighted_torque,
)


class Singularity(Enum):
    """Orientations at which a law has no torque."""

    HALF_TURN = "half turn"
    """A rotation by 180 deg, where the rotation vector changes its sign."""
    POLE = "pole"
    """The innermost and the outermost of three axes are parallel."""
    NONE = "none"


class RotationLaw(Protocol):
    """Torque and energy of a joint's springs as functions of its rotation vector."""

    @property
    def axes(self) -> Sequence[AxisSpring]:
        """Springs of the axes."""
        ...

    @property
    def is_conservative(self) -> bool:
        """Whether the elastic torque has an energy."""
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
        """Whether the elastic torque has an energy."""
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
class CoordinateLaw:
    """Laws of the displacements of the joint's own chain: each a generalized force along its own.

    Attributes:
        axes: Springs about axes of the chain, in their order; None for an axis without one.
        coordinates: The chain.
    """

    springs: tuple[AxisSpring | None, ...]
    coordinates: ChainCoordinates

    @property
    def axes(self) -> Sequence[AxisSpring]:
        """Springs of the axes."""
        return [spring for spring in self.springs if spring is not None]

    @property
    def is_conservative(self) -> bool:
        """True: the energy is the sum of those of the axes."""
        return True

    @property
    def singularity(self) -> Singularity:
        """The pole of three rotations; two have none."""
        return Singularity.POLE if len(self.springs) == 3 else Singularity.NONE

    def torque(self, r: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the sum of the axes' torques along the dual axes."""
        at = self.coordinates.at(r, ops)
        torques = [
            None if spring is None or not spring.elastic else total_torque(spring.elastic, q, ops)
            for spring, q in zip(self.springs, at.angles, strict=True)
        ]
        return at.torque(torques, ops)

    def energy(self, r: Vector, ops: Operations = NUMPY) -> Real:
        """Return the sum of the axes' energies."""
        at = self.coordinates.at(r, ops)
        terms = [
            total_energy(spring.elastic, q, ops)
            for spring, q in zip(self.springs, at.angles, strict=True)
            if spring is not None and spring.elastic
        ]
        return reduce(add, terms, ops.part(r, 0) * 0.0)

    def damping(self, r: Vector, rate: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the torque of damping of the chain's rates."""
        at = self.coordinates.at(r, ops)
        torques = [
            None if spring is None else spring.resistance(q, v, ops)
            for spring, q, v in zip(self.springs, at.angles, at.rates(rate, ops), strict=True)
        ]
        return at.torque(torques, ops)

    def angles(
        self, directions: Sequence[Direction], r: Vector, ops: Operations = NUMPY
    ) -> Sequence[Real]:
        """Return the displacements about axes of the chain."""
        found = self.coordinates.at(r, ops).angles
        places = map(self.coordinates.place, directions)
        return [sense * found[index] for index, sense in places]

    def torque_about(
        self,
        directions: Sequence[Direction],
        torques: Sequence[Real],
        r: Vector,
        ops: Operations = NUMPY,
    ) -> Vector:
        """Return the torque of generalized forces along the displacements."""
        sums: list[Real | None] = [None] * len(self.springs)
        for direction, torque in zip(directions, torques, strict=True):
            index, sense = self.coordinates.place(direction)
            own = sense * torque
            sums[index] = own if sums[index] is None else sums[index] + own
        return self.coordinates.at(r, ops).torque(sums, ops)


def rotation_law(
    springs: JointSprings, joining: Joining, chain: Sequence[Direction]
) -> RotationLaw:
    """Return the law of a joint of several rotations.

    Args:
        springs: Springs of its axes.
        joining: Rule that joins them.
        chain: Axes of its rotations, innermost first.

    Raises:
        ValueError: A spring is about no axis of a chain whose coordinates the law needs, or the
            chain's outer axes are not perpendicular.
    """
    if joining is not Joining.COORDINATES:
        return VectorLaw(springs.axes, joining is Joining.WEIGHTED)
    coordinates = ChainCoordinates(
        tuple(chain), tuple(_middle(springs.axes, axis) for axis in chain)
    )
    own: list[AxisSpring | None] = [None] * len(chain)
    for spring in springs.axes:
        index, _ = coordinates.place(spring.direction)
        own[index] = spring.oriented_along(chain[index])
    return CoordinateLaw(tuple(own), coordinates)


def _middle(springs: Sequence[AxisSpring], axis: Direction) -> float:
    """Middle of the range of the spring about an axis [rad], 0 where there is none."""
    for spring in springs:
        along = sum(a * b for a, b in zip(spring.direction, axis, strict=True))
        if abs(along) > 0.5:
            return spring.middle if along > 0.0 else -spring.middle
    return 0.0
