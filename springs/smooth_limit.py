"""The limit torque of Saul et al. 2015: a spring beyond each limit that a quintic step turns on."""

from collections.abc import Callable
from dataclasses import dataclass

from springs.backends import NUMPY, Operations, Real
from springs.elastic import Range, mirror_range


@dataclass(frozen=True)
class SmoothLimit:
    """No torque between the limits; beyond one by x, the torque -k x S(x / transition).

    S(u) = 10 u^3 - 15 u^4 + 6 u^5 rises from 0 to 1 with two continuous derivatives and stays 1
    beyond, so that the spring has its full stiffness k only at the end of the transition.

    Attributes:
        lower: lower limit [rad].
        upper: upper limit [rad].
        lower_stiffness: k beyond the lower limit [N m/rad].
        upper_stiffness: k beyond the upper limit [N m/rad].
        transition: [rad].
        valid_range: range in which the curve is known to hold [rad], or None.
    """

    lower: float
    upper: float
    lower_stiffness: float
    upper_stiffness: float
    transition: float
    valid_range: Range | None = None

    def __post_init__(self) -> None:
        """Reject limits that leave no range, and a limit that does not resist."""
        if self.lower_stiffness < 0.0 or self.upper_stiffness < 0.0 or self.transition <= 0.0:
            raise ValueError("a limit's stiffness is not negative, and its transition is positive")
        if self.lower > self.upper:
            raise ValueError(f"the lower limit {self.lower:g} is above the upper {self.upper:g}")

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] at `angle` [rad]."""
        below, above = self._sides(self._smoothed_excess, angle, ops)
        return below - above

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J], zero between the limits."""
        below, above = self._sides(self._smoothed_excess_integral, angle, ops)
        return below + above

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Both ends of each transition [rad], where a higher derivative jumps."""
        width = self.transition
        below = (self.lower - width, self.lower) if self.lower_stiffness else ()
        above = (self.upper, self.upper + width) if self.upper_stiffness else ()
        return below + above

    def mirrored(self) -> "SmoothLimit":
        """The law of the same joint when its angle is counted the other way."""
        return SmoothLimit(
            -self.upper,
            -self.lower,
            self.upper_stiffness,
            self.lower_stiffness,
            self.transition,
            mirror_range(self.valid_range),
        )

    def _sides(
        self, function: Callable[[Real, Operations], Real], angle: Real, ops: Operations
    ) -> tuple[Real, Real]:
        """Return both stiffnesses times a function of the excess; a side without one is 0."""
        if not self.lower_stiffness and not self.upper_stiffness:
            return 0.0 * angle, 0.0 * angle
        below = self.lower_stiffness and function(self.lower - angle, ops) * self.lower_stiffness
        above = self.upper_stiffness and function(angle - self.upper, ops) * self.upper_stiffness
        return below, above

    def _smoothed_excess(self, x: Real, ops: Operations) -> Real:
        """Angle x S(x / transition) [rad], zero where x is not positive."""
        u = x / self.transition
        step = u * u * u * (10.0 + u * (6.0 * u - 15.0))
        return ops.smooth_where(u > 1.0, x, ops.smooth_where(u > 0.0, x * step, 0.0))

    def _smoothed_excess_integral(self, x: Real, ops: Operations) -> Real:
        """Integral of `_smoothed_excess` from 0 to x [rad^2]."""
        width = self.transition
        u = x / width
        inside = width * width * u * u * u * u * u * (2.0 + u * (6.0 / 7.0 * u - 2.5))
        # The whole transition takes 2 - 5/2 + 6/7 = 5/14 of its width squared.
        beyond = 0.5 * x * x - width * width / 7.0
        return ops.smooth_where(u > 1.0, beyond, ops.smooth_where(u > 0.0, inside, 0.0))
