"""A joint that resists differently as its angle grows and as it falls (the thesis's figure 4.7).

Yoon & Mansour measured two curves of the hip, 5 to 10 N m apart: one as flexion grew, one as
extension did. Between the two the rate decides, smoothly, since no integrator can take a jump. Half
the sum of the curves is an elastic law, half their difference a friction that depends on the angle.
"""

from dataclasses import dataclass

from springs.backends import NUMPY, Operations, Real
from springs.damping import DEFAULT_SLIP_RATE
from springs.elastic import Elastic, Range, valid_range
from springs.transformed import Transformed


@dataclass(frozen=True)
class Hysteresis:
    """Torque on the child = mean of the two curves + tanh(rate / slip) * half their difference.

    The mean is the elastic law, the rest friction.

    Attributes:
        increasing: the curve while the angle grows (increasing flexion).
        decreasing: the curve while the angle falls (increasing extension).
        slip: rate at which 76 % of the way between the curves' mean and one of them is reached
            [rad/s].
    """

    increasing: Elastic
    decreasing: Elastic
    slip: float = DEFAULT_SLIP_RATE

    def __post_init__(self) -> None:
        """Reject a slip rate that is not positive."""
        if self.slip <= 0.0:
            raise ValueError("the slip rate of a directional law is positive")

    @classmethod
    def from_mean_and_width(
        cls, mean: Elastic, width: float, slip: float = DEFAULT_SLIP_RATE
    ) -> "Hysteresis":
        """Two curves `width` [N m] apart, half above and half below `mean`.

        Raises:
            ValueError: for a negative width, with which the joint would feed energy.
        """
        if width < 0.0:
            raise ValueError("the width of a hysteresis is not negative: it would feed energy")
        half = 0.5 * width
        return cls(Transformed(mean, constant=-half), Transformed(mean, constant=half), slip)

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Mean of the two curves [N m] at `angle` [rad]; minus the slope of the energy."""
        return 0.5 * (self.increasing.torque(angle, ops) + self.decreasing.torque(angle, ops))

    def friction(self, angle: Real, rate: Real, ops: Operations = NUMPY) -> Real:
        """Difference of the torque from the mean [N m] at `angle` [rad] and `rate` [rad/s]."""
        up, down = self.increasing.torque(angle, ops), self.decreasing.torque(angle, ops)
        return 0.5 * (up - down) * ops.tanh(rate * (1.0 / self.slip))

    def total_torque(self, angle: Real, rate: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] at `angle` [rad] and `rate` [rad/s]."""
        return self.torque(angle, ops) + self.friction(angle, rate, ops)

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Energy stored by the mean of the two curves [J]; the torque is minus its slope."""
        return 0.5 * (self.increasing.energy(angle, ops) + self.decreasing.energy(angle, ops))

    def cycle_loss(self, low: float, high: float) -> float:
        """Energy lost in a slow cycle from `low` to `high` [rad] and back [J].

        Negative where the curves are in the wrong order, so that a cycle would feed energy.
        """
        up, down = self.increasing, self.decreasing
        going = up.energy(high) - up.energy(low)
        coming = down.energy(high) - down.energy(low)
        return float(going - coming)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of both curves [rad]."""
        return tuple(sorted({*self.increasing.breakpoints, *self.decreasing.breakpoints}))

    @property
    def valid_range(self) -> Range | None:
        """Range in which both curves are known to hold [rad], or None."""
        up, down = valid_range(self.increasing), valid_range(self.decreasing)
        return up and down and (max(up[0], down[0]), min(up[1], down[1]))

    def mirrored(self) -> "Hysteresis":
        """The law of the same joint when its angle is counted the other way."""
        return Hysteresis(self.decreasing.mirrored(), self.increasing.mirrored(), self.slip)
