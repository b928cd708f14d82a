"""Viscous and Coulomb damping (b_v and b_coul of eq. 4.1-4.5; friction opposes velocity)."""

from dataclasses import dataclass

from springs.backends import NUMPY, Operations, Real

DEFAULT_SLIP_RATE = 0.01
"""Rate at which the regularised Coulomb friction has 76 % of its full value [rad/s or m/s]."""


@dataclass(frozen=True)
class Damping:
    """Torque on the child = -viscous * rate - coulomb * tanh(rate / slip).

    The hyperbolic tangent stands for the sign of eq. 4.1-4.3, whose jump at rest no integrator can
    take; below `slip` a joint creeps instead of sticking.

    Attributes:
        viscous: b_v [N m s/rad or N s/m].
        coulomb: b_coul [N m or N].
        slip: [rad/s or m/s].
    """

    viscous: float = 0.0
    coulomb: float = 0.0
    slip: float = DEFAULT_SLIP_RATE

    def __post_init__(self) -> None:
        """Refuse damping that would feed energy."""
        if self.viscous < 0.0 or self.coulomb < 0.0 or self.slip <= 0.0:
            raise ValueError("damping and friction are not negative, and the slip rate is positive")

    def torque(self, rate: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] (force [N]) at `rate` [rad/s or m/s]."""
        torque = -self.viscous * rate
        if self.coulomb:
            torque = torque - self.coulomb * ops.tanh(rate * (1.0 / self.slip))
        return torque
