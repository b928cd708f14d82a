"""Numbers of a free swing about a joint: turning points, period, relaxation index, peak rates."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from springs.backends import Array

_FEWEST_TURNS = 3
"""Number of turning points from which the angle of rest follows."""


@dataclass(frozen=True, eq=False)
class Swing:
    """Swing of a joint that is released at rest.

    Attributes:
        times: shape (n,) [s].
        angles: shape (n,) [rad]; the first is that of the release.
        rates: shape (n,) [rad/s].
    """

    times: Array
    angles: Array
    rates: Array

    def __post_init__(self) -> None:
        """Raise ValueError for a motion that is not a swing from rest."""
        if not np.abs(self.rates[0]) <= 1e-9:
            raise ValueError("a swing begins at rest")
        if len(self._turns) < _FEWEST_TURNS:
            raise ValueError(f"fewer than {_FEWEST_TURNS} turning points: record it for longer")

    @property
    def start(self) -> float:
        """Angle at the release [rad]."""
        return float(self.angles[0])

    @cached_property
    def rest(self) -> float:
        """Angle at which the swing comes to rest [rad].

        It is the limit of the last three turning points, whose distances from it decay
        geometrically (Aitken's extrapolation).
        """
        before, here, after = self.turning_angles[-3:].tolist()
        bend = (here - before) - (after - here)
        return after + (after - here) ** 2 / bend if bend else after

    @property
    def _turns(self) -> NDArray[np.int64]:
        """Frames before which the rate changes its sign."""
        signs = np.sign(self.rates[1:])
        return np.flatnonzero(signs[1:] * signs[:-1] < 0.0) + 2

    @property
    def turning_times(self) -> Array:
        """Times at which the motion reverses, shape (k,) [s]."""
        turns = self._turns
        before, after = self.rates[turns - 1], self.rates[turns]
        share = before / (before - after)
        return self.times[turns - 1] + share * (self.times[turns] - self.times[turns - 1])

    @property
    def turning_angles(self) -> Array:
        """Angles at which the motion reverses, shape (k,) [rad].

        The first one is across from the release. Between frames the rate is linear in time.
        """
        turns = self._turns
        step = self.turning_times - self.times[turns - 1]
        return self.angles[turns - 1] + 0.5 * self.rates[turns - 1] * step

    @property
    def relaxation_index(self) -> float:
        """First swing over the drop from start to rest: 2 without damping, 1 without overshoot."""
        return float((self.turning_angles[0] - self.start) / (self.rest - self.start))

    def period(self, count: int = 3) -> float:
        """Mean of the first periods between turning points across from the release [s].

        nan if the motion reverses too few times.
        """
        across = self.turning_times[::2]
        return float((across[count] - across[0]) / count) if len(across) > count else float("nan")

    def swings(self, amplitude: float) -> int:
        """Number of turning points across from the release that lie further than this from rest.

        Raises ValueError if the last turning points do.
        """
        distances = np.abs(self.turning_angles - self.rest)
        if distances[-2:].max() > amplitude:
            raise ValueError("the swing goes on: record it for longer")
        return int(np.sum(distances[::2] > amplitude))

    @property
    def peak_rates(self) -> Array:
        """Largest magnitude of the rate in each half swing, shape (k,) [rad/s]."""
        parts = np.split(np.abs(self.rates), self._turns)
        return np.array([part.max() for part in parts[:-1]])
