"""A law scaled, shifted along its angle, or raised by a constant torque."""

from dataclasses import dataclass

from springs.backends import NUMPY, Operations, Real
from springs.elastic import Elastic, Frictional, Range, valid_range


@dataclass(frozen=True)
class Transformed:
    """Torque on the child = scale * law(angle - offset) + constant.

    Attributes:
        law: law to be transformed.
        scale: factor of its torque; -1 reverses it.
        offset: shift of the curve towards larger angles [rad].
        constant: torque added at every angle [N m].
    """

    law: Elastic
    scale: float = 1.0
    offset: float = 0.0
    constant: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a law whose friction would be lost: its curves are scaled one by one."""
        if isinstance(self.law, Frictional):
            raise ValueError("scale the two curves of a directional law, not the law")

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] at `angle` [rad]."""
        return self.scale * self.law.torque(angle - self.offset, ops) + self.constant

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J]; the torque is minus its slope."""
        return self.scale * self.law.energy(angle - self.offset, ops) - self.constant * angle

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of the law, shifted [rad]."""
        return tuple(corner + self.offset for corner in self.law.breakpoints)

    @property
    def valid_range(self) -> Range | None:
        """Range in which the law is known to hold, moved [rad]; None where that is not known."""
        known = valid_range(self.law)
        return known and (known[0] + self.offset, known[1] + self.offset)

    def mirrored(self) -> "Transformed":
        """The law of the same joint when its angle is counted the other way."""
        return Transformed(self.law.mirrored(), self.scale, -self.offset, -self.constant)
