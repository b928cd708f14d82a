"""Activation of muscles in time: from 0 to 1 after a delay, and back to 0 at a release."""

from dataclasses import dataclass
from math import inf, isfinite

from springs.backends import NUMPY, Operations, Real

Cubic = tuple[float, float, float, float]
"""Coefficients of the powers of the time since an instant."""


@dataclass(frozen=True)
class Activation:
    """Activation in the time of a run: cubics that join with equal slopes.

    Attributes:
        begin: Time at which it starts to rise [s]; -inf where it is 1 from the start.
        release: Time at which it starts to fall [s], not before it has risen; inf for never.
        rise: Duration of the rise and of the fall [s], positive.
    """

    begin: float = -inf
    release: float = inf
    rise: float = 0.05

    @property
    def knots(self) -> tuple[float, ...]:
        """Times at which its second derivative jumps [s]."""
        ends = [time for time in (self.begin, self.release) if isfinite(time)]
        return tuple(knot for time in ends for knot in (time, time + self.rise))

    def at(self, time: Real, ops: Operations = NUMPY) -> Real:
        """Return the activation at times [s]."""
        value = 1.0 if self.begin == -inf else self._step(time - self.begin, ops)
        return value if self.release == inf else value - self._step(time - self.release, ops)

    def _step(self, since: Real, ops: Operations) -> Real:
        """Return the rise from 0 to 1."""
        share = (1.0 / self.rise) * since
        share = ops.smooth_where(share < 0.0, 0.0, share)
        share = ops.smooth_where(share < 1.0, share, 1.0)
        return share * share * (3.0 - 2.0 * share)

    def cubic(self, start: float, stop: float) -> Cubic:
        """Return coefficients in an interval without a knot inside, by the time since its start.

        Args:
            start: Start of the interval [s].
            stop: End of the interval [s].
        """
        total = [float(self.begin == -inf), 0.0, 0.0, 0.0]
        middle = 0.5 * (start + stop)
        for time, sign in ((self.begin, 1.0), (self.release, -1.0)):
            if not isfinite(time) or middle < time:
                continue
            if middle > time + self.rise:
                total[0] += sign
                continue
            x, k = (start - time) / self.rise, 1.0 / self.rise
            parts = x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) * k
            parts += (3.0 - 6.0 * x) * k * k, -2.0 * k * k * k
            total = [t + sign * part for t, part in zip(total, parts, strict=True)]
        a, b, c, d = total
        return a, b, c, d
