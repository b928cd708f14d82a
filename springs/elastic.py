"""Elastic laws of one angle: torque, energy, breakpoints and the range in which they are valid."""

from collections.abc import Iterable
from functools import reduce
from math import degrees
from operator import add
from typing import Protocol, TypeAlias, TypeGuard, runtime_checkable

from springs.backends import NUMPY, Operations, Real


class Elastic(Protocol):
    """A law of one angle (or one translation)."""

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] (force [N] along it) at `angle` [rad or m]."""
        ...

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J]; the torque is minus its slope."""
        ...

    @property
    def breakpoints(self) -> tuple[float, ...]:
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


def _is_frictional(law: Elastic) -> TypeGuard[Frictional]:
    """Return whether a law has a friction; `isinstance` takes longer than the law's torque."""
    return hasattr(law, "friction")


def total_friction(
    laws: Iterable[Elastic], angle: Real, rate: Real, ops: Operations = NUMPY
) -> Real | None:
    """Sum of the laws' own frictions at one angle and rate [N m]; None where none has any."""
    frictions = [law.friction(angle, rate, ops) for law in laws if _is_frictional(law)]
    return reduce(add, frictions) if frictions else None


def total_energy(laws: Iterable[Elastic], angle: Real, ops: Operations = NUMPY) -> Real:
    """Sum of the laws' energies at one angle [J]; zero without laws."""
    energies = [law.energy(angle, ops) for law in laws]
    return reduce(add, energies) if energies else angle * 0.0


Range: TypeAlias = tuple[float, float]
"""Lower and upper end [rad]; an end may be infinite."""

_ANGLE_ROUNDING = 1e-9
"""Rounding of a range converted from degrees [rad]."""


@runtime_checkable
class HasValidRange(Protocol):
    """A law with the range in which it was measured."""

    @property
    def valid_range(self) -> Range | None:
        """Range in which the law is valid [rad], or None if unknown."""
        ...


def valid_range(law: object) -> Range | None:
    """The range in which a law is known to hold [rad], or None where that is not known."""
    return law.valid_range if isinstance(law, HasValidRange) else None


def common_valid_range(laws: Iterable[Elastic]) -> Range | None:
    """The range in which all laws that know theirs are known to hold [rad]; None without one."""
    ranges = [known for law in laws if (known := valid_range(law)) is not None]
    return (max(low for low, _ in ranges), min(high for _, high in ranges)) if ranges else None


def mirror_range(limits: Range | None) -> Range | None:
    """The range of the same joint when its angle is counted the other way [rad]."""
    return None if limits is None else (-limits[1], -limits[0])


def describe_extrapolation(limits: Range | None, low: float, high: float) -> str:
    """Describe the extrapolation of a curve from `low` to `high` [rad]; "" within its range."""
    if limits is None:
        return "the range in which this curve was measured is not known"
    first, last = limits
    if low >= first - _ANGLE_ROUNDING and high <= last + _ANGLE_ROUNDING:
        return ""
    known = f"{degrees(first) + 0.0:.4g} .. {degrees(last) + 0.0:.4g} deg"
    parts = [
        f"{degrees(start) + 0.0:.4g} .. {degrees(end) + 0.0:.4g} deg"
        for start, end in ((low, min(high, first)), (max(low, last), high))
        if end - start > _ANGLE_ROUNDING
    ]
    return f"extrapolated at {' and '.join(parts)}: the curve is known for {known} only"
