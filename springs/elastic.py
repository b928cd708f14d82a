"""What every elastic law of one angle offers: a torque and the energy whose slope it is."""

from collections.abc import Iterable
from functools import reduce
from operator import add
from typing import Protocol, runtime_checkable

from springs.operations import NUMPY, Operations, Real


class Elastic(Protocol):
    """A law of one angle (or one translation)."""

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] (force [N] along it) at `angle` [rad or m]."""
        ...

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J]; the torque is minus its slope."""
        ...

    @property
    def corners(self) -> tuple[float, ...]:
        """Angles at which the slope or the curvature of the torque jumps [rad or m]."""
        ...

    def mirrored(self) -> "Elastic":
        """The law of the same joint when its angle is counted the other way."""
        ...


@runtime_checkable
class Frictional(Protocol):
    """An elastic law with a friction of its own, whose size depends on the angle."""

    def friction(self, angle: Real, rate: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child [N m] beside the elastic one, against `rate` [rad/s]."""
        ...


def total_torque(laws: Iterable[Elastic], angle: Real, ops: Operations = NUMPY) -> Real:
    """Sum of the laws' torques at one angle [N m]; zero without laws."""
    torques = [law.torque(angle, ops) for law in laws]
    return reduce(add, torques) if torques else angle * 0.0


def total_friction(
    laws: Iterable[Elastic], angle: Real, rate: Real, ops: Operations = NUMPY
) -> Real | None:
    """Sum of the laws' own frictions at one angle and rate [N m]; None where none has any."""
    frictions = [law.friction(angle, rate, ops) for law in laws if isinstance(law, Frictional)]
    return reduce(add, frictions) if frictions else None


def total_energy(laws: Iterable[Elastic], angle: Real, ops: Operations = NUMPY) -> Real:
    """Sum of the laws' energies at one angle [J]; zero without laws."""
    energies = [law.energy(angle, ops) for law in laws]
    return reduce(add, energies) if energies else angle * 0.0
