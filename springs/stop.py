"""A stop: the joint limits `llimit` and `ulimit` of a figure file, as a stiff one-sided spring."""

from dataclasses import dataclass
from functools import cached_property
from math import isinf, radians

from springs.backends import NUMPY, CubicPieces, Operations, Real

DEFAULT_STOP_STIFFNESS = 1000.0
"""Default stiffness of a stop [N m/rad]."""

DEFAULT_STOP_ONSET = radians(1.0)
"""Default angle over which a stop grows to its full stiffness [rad]."""

DEFAULT_TRANSLATION_STOP_STIFFNESS = 1e5
"""Default stiffness of a stop along a translation [N/m]."""

DEFAULT_TRANSLATION_STOP_ONSET = 1e-3
"""Default length over which a stop along a translation grows to its full stiffness [m]."""


@dataclass(frozen=True)
class Stop:
    """No torque between the limits; beyond one, a spring whose stiffness grows from zero.

    With x the angle beyond a limit: k x^2 / (2 onset) up to the onset, k (x - onset/2) after it, so
    that torque and slope are continuous. A limit of None does not stop.

    Attributes:
        lower: smallest free angle [rad or m], or None.
        upper: largest free angle [rad or m], or None.
        stiffness: k [N m/rad or N/m].
        onset: [rad or m].
    """

    lower: float | None
    upper: float | None
    stiffness: float = DEFAULT_STOP_STIFFNESS
    onset: float = DEFAULT_STOP_ONSET

    def __post_init__(self) -> None:
        """Reject limits that leave no range, and a stop that does not resist."""
        if self.stiffness < 0.0 or self.onset <= 0.0:
            raise ValueError("a stop's stiffness is not negative, and its onset is positive")
        if self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise ValueError(f"the lower limit {self.lower:g} is above the upper {self.upper:g}")

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] (force [N]) at `angle` [rad or m]."""
        lower, upper = self._finite_limits
        if lower is None and upper is None:
            return ops.piecewise_cubic(angle, [(0.0, (0.0, 0.0, 0.0, 0.0))])
        # By the angle beyond each limit: rounding then changes no sign next to the limit.
        below = 0.0 if lower is None else ops.piecewise_cubic(lower - angle, self._pieces)
        above = 0.0 if upper is None else ops.piecewise_cubic(angle - upper, self._pieces)
        return below - above

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J], zero between the limits."""
        energy: Real = 0.0
        if self.upper is not None:
            energy = energy + self._stored_energy(angle - self.upper, ops)
        if self.lower is not None:
            energy = energy + self._stored_energy(self.lower - angle, ops)
        return energy

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Both ends of each onset [rad or m], where the curvature jumps."""
        lower = () if self.lower is None else (self.lower - self.onset, self.lower)
        upper = () if self.upper is None else (self.upper, self.upper + self.onset)
        return lower + upper

    def mirrored(self) -> "Stop":
        """The law of the same joint when its angle is counted the other way."""
        lower = None if self.upper is None else -self.upper
        upper = None if self.lower is None else -self.lower
        return Stop(lower, upper, self.stiffness, self.onset)

    @property
    def _finite_limits(self) -> tuple[float | None, float | None]:
        """Both limits [rad or m], None for one that does not stop."""
        lower, upper = (
            None if limit is None or isinf(limit) else limit for limit in (self.lower, self.upper)
        )
        return lower, upper

    @cached_property
    def _pieces(self) -> CubicPieces:
        """Resisting torque by the angle beyond a limit: none, the onset, the full stiffness."""
        k, onset = self.stiffness, self.onset
        return [
            (0.0, (0.0, 0.0, 0.0, 0.0)),
            (0.0, (0.0, 0.0, k / (2.0 * onset), 0.0)),
            (onset, (k * onset / 2.0, k, 0.0, 0.0)),
        ]

    def _stored_energy(self, x: Real, ops: Operations) -> Real:
        k, onset = self.stiffness, self.onset
        full = k * (0.5 * x * (x - onset) + onset * onset / 6.0)
        rising = k / (6.0 * onset) * x * x * x
        return ops.smooth_where(x > onset, full, ops.smooth_where(x > 0.0, rising, 0.0))
