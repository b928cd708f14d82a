"""The linear spring of a figure file: `stiff` and `rest`."""

from dataclasses import dataclass

from springs.backends import NUMPY, Operations, Real


@dataclass(frozen=True)
class Linear:
    """Torque on the child = -stiffness * (angle - rest).

    stiffness [N m/rad], or [N/m] along a translation; rest [rad or m].
    """

    stiffness: float
    rest: float = 0.0

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] (force [N]) at `angle` [rad or m]."""
        del ops
        return (self.rest - angle) * self.stiffness

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J], zero at rest."""
        del ops
        a = angle - self.rest
        return 0.5 * self.stiffness * a * a

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """None: the torque is smooth."""
        return ()

    def mirrored(self) -> "Linear":
        """The law of the same joint when its angle is counted the other way."""
        return Linear(self.stiffness, -self.rest)
