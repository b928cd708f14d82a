"""Numbers of a free swing about a joint: turning points, period, relaxation index, peak rates.

A simulated swing has rates; a measured one has angles with noise, which are smoothed first
(`smooth_swing`): at each sample by the cubic that fits the samples within a tenth of a second best
(Savitzky & Golay, Anal. Chem. 36:1627-1639, 1964). Angle and rate are those of the fit. The angle
of the release is the constant one before the swing begins, at a time that is found between samples.
A reversal counts as a turning point if the smoothed angle moves on both sides of it by more than
noise could.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from generator.identification.release import find_release
from springs.backends import Array

SMOOTHING_TIME = 0.2
"""Interval of the samples to which each cubic is fitted [s]: a fifth of the period of a knee."""

_FEWEST_TURNS = 3
"""Number of turning points from which the angle of rest follows."""

_DEGREE, _FEWEST_SAMPLES = 3, 7
"""Degree of the local fits, and least number of samples of each."""

_NOISE_FACTOR = 6.0
"""Standard deviations of a smoothed angle by which it moves between turning points, at least."""

_RINGING = 0.01
"""Share of the range of the angles by which it moves in addition, more than a fit overshoots."""

_UNEVEN = 0.1
"""Largest deviation of a time from even spacing, as a share of the interval."""

_EARLIEST_RELEASE = 0.3
"""Largest time from the release to the first sample, as a share of the smoothing time."""

_LEAST_RANGE = 1e-6
"""Range of the angles of a joint that moves [rad]."""

_RESAMPLES = 100
"""Number of repetitions with new noise from which uncertainties are estimated."""


@dataclass(frozen=True, eq=False)
class Swing:
    """Swing of a joint that is released at rest.

    Attributes:
        times: shape (n,) [s].
        angles: shape (n,) [rad]; the first is that of the release.
        rates: shape (n,) [rad/s].
        least_move: angle by which the joint moves between turning points, at least [rad].
    """

    times: Array
    angles: Array
    rates: Array
    least_move: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for a motion that is not a swing from rest."""
        if not np.abs(self.rates[0]) <= 1e-9:
            raise ValueError("a swing begins at rest")
        if len(self.turning_angles) < _FEWEST_TURNS:
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

    @cached_property
    def _turns(self) -> NDArray[np.int64]:
        """Frames before which the motion turns."""
        signs = np.sign(self.rates[1:])
        reversals = np.flatnonzero(signs[1:] * signs[:-1] < 0.0) + 2
        ends = [*self._reversal_angles(reversals).tolist(), float(self.angles[-1])]
        turns: list[int] = []
        farthest, direction = -1, 0.0
        for place, angle in enumerate(ends):
            if farthest < 0:
                if abs(angle - self.start) > self.least_move:
                    farthest, direction = place, np.sign(angle - self.start)
            elif direction * (angle - ends[farthest]) > 0.0:
                farthest = place
            elif direction * (ends[farthest] - angle) > self.least_move:
                turns.append(int(reversals[farthest]))
                farthest, direction = place, -direction
        return np.array(turns, dtype=np.int64)

    def _reversal_times(self, frames: NDArray[np.int64]) -> Array:
        """Times before frames at which the rate, linear between frames, changes its sign [s]."""
        before, after = self.rates[frames - 1], self.rates[frames]
        share = before / (before - after)
        return self.times[frames - 1] + share * (self.times[frames] - self.times[frames - 1])

    def _reversal_angles(self, frames: NDArray[np.int64]) -> Array:
        """Angles before frames at which the rate changes its sign [rad]."""
        step = self._reversal_times(frames) - self.times[frames - 1]
        return self.angles[frames - 1] + 0.5 * self.rates[frames - 1] * step

    @cached_property
    def turning_times(self) -> Array:
        """Times at which the motion reverses, shape (k,) [s]."""
        return self._reversal_times(self._turns)

    @cached_property
    def turning_angles(self) -> Array:
        """Angles at which the motion reverses, shape (k,) [rad].

        The first one is across from the release. Between frames the rate is linear in time.
        """
        return self._reversal_angles(self._turns)

    @property
    def first_swing(self) -> float:
        """Angle from the release to the first turning point, with its sign [rad]."""
        return float(self.turning_angles[0]) - self.start

    @property
    def relaxation_index(self) -> float:
        """First swing over the drop from start to rest: 2 without damping, 1 without overshoot."""
        return self.first_swing / (self.rest - self.start)

    def period(self, count: int = 3) -> float:
        """Mean of the first periods between turning points across from the release [s].

        nan if the motion reverses too few times.
        """
        across = self.turning_times[::2]
        return float((across[count] - across[0]) / count) if len(across) > count else float("nan")

    def swings(self, amplitude: float) -> int:
        """Number of turning points across from the release that lie further than this from rest.

        Raises ValueError if the joint is as far from rest within the last period.
        """
        period = 2.0 * float(np.mean(np.diff(self.turning_times)))
        late = self.angles[self.times > self.times[-1] - period]
        if np.abs(late - self.rest).max() > amplitude:
            raise ValueError("the swing goes on: record it for longer")
        return int(np.sum(np.abs(self.turning_angles - self.rest)[::2] > amplitude))

    @property
    def peak_rates(self) -> Array:
        """Largest magnitude of the rate in each half swing, shape (k,) [rad/s]."""
        parts = np.split(np.abs(self.rates), self._turns)
        return np.array([part.max() for part in parts[:-1]])


@dataclass(frozen=True, eq=False)
class MeasuredSwing:
    """Swing from measured angles.

    Attributes:
        swing: smoothed.
        noise: standard deviation of the angles about the smoothed ones [rad], of white noise.
        smoothing_time: interval of the local fits [s].
        smoothed: angles of the local fits, also before the release, shape (n,) [rad].
    """

    swing: Swing
    noise: float
    smoothing_time: float
    smoothed: Array

    def uncertainties(
        self, quantities: Mapping[str, Callable[[Swing], float]], seed: int = 0
    ) -> dict[str, float]:
        """Standard deviations of numbers of the swing, by name, that follow from the noise.

        White noise is added to the smoothed angles and the swing smoothed again, 100 times. A
        number that more than a tenth of these swings lack has the uncertainty nan.
        """
        rng = np.random.default_rng(seed)
        times, angles = self.swing.times, self.smoothed
        drawn: dict[str, list[float]] = {name: [] for name in quantities}
        for _ in range(_RESAMPLES):
            noisy = angles + rng.normal(0.0, self.noise, len(angles))
            try:
                again = smooth_swing(times, noisy, self.smoothing_time).swing
            except ValueError:
                continue
            for name, quantity in quantities.items():
                try:
                    drawn[name].append(quantity(again))
                except ValueError:
                    continue
        return {name: _deviation(np.array(values)) for name, values in drawn.items()}


def _deviation(values: Array) -> float:
    """Standard deviation of the finite ones of resampled numbers; nan for too few."""
    finite = values[np.isfinite(values)]
    return float(np.std(finite, ddof=1)) if len(finite) >= 0.9 * _RESAMPLES else float("nan")


def smooth_swing(
    times: Array, angles: Array, smoothing_time: float = SMOOTHING_TIME
) -> MeasuredSwing:
    """Return the swing in measured angles.

    The record begins while the joint is at rest, or less than 0.06 s after its release. The local
    cubics shorten a swing of the period T by less than 0.1 % where T is five times the smoothing
    time.

    Args:
        times: shape (n,) [s], evenly spaced.
        angles: shape (n,) [rad].
        smoothing_time: interval of the samples of each local fit [s].

    Raises:
        ValueError: the samples are uneven, too few or too sparse, the joint already moves in the
            first one, or it turns fewer than three times.
    """
    from scipy.signal import savgol_coeffs, savgol_filter

    half = _half_window(times, smoothing_time)
    if float(np.ptp(angles)) < _LEAST_RANGE:
        raise ValueError("the joint does not move")
    width = 2 * half + 1
    interval = float(times[-1] - times[0]) / (len(times) - 1)
    smoothed = savgol_filter(angles, width, _DEGREE)
    rates = savgol_filter(angles, width, _DEGREE, deriv=1, delta=interval)
    # A smoothed angle has this share of the variance of an angle, and its residual all the rest.
    share = float(savgol_coeffs(width, _DEGREE)[half])
    residuals = (angles - smoothed)[half:-half]
    noise = sqrt(float(np.mean(residuals**2)) / (1.0 - share))
    release = find_release(times, angles[:, None])
    if release.time < -_EARLIEST_RELEASE * smoothing_time:
        raise ValueError("the joint already moves in the first sample: record from before release")
    resting = max(1, int(np.searchsorted(times - times[0], release.time)))
    released = smoothed.copy()
    released[:resting], rates[:resting] = release.angles[0], 0.0
    least_move = _NOISE_FACTOR * noise * sqrt(share) + _RINGING * float(np.ptp(angles))
    swing = Swing(times, released, rates, least_move)
    return MeasuredSwing(swing, noise, smoothing_time, smoothed)


def _half_window(times: Array, smoothing_time: float) -> int:
    """Number of samples on each side of a local fit.

    Raises ValueError for samples that are uneven, too few or too sparse.
    """
    if len(times) < 2 * _FEWEST_SAMPLES:
        raise ValueError(f"a measured swing needs {2 * _FEWEST_SAMPLES} samples at least")
    interval = float(times[-1] - times[0]) / (len(times) - 1)
    even = times[0] + interval * np.arange(len(times))
    if not interval > 0.0 or np.abs(times - even).max() > _UNEVEN * interval:
        raise ValueError("the samples are not evenly spaced in time: resample them")
    half = round(0.5 * smoothing_time / interval)
    if 2 * half + 1 < _FEWEST_SAMPLES:
        least = (_FEWEST_SAMPLES - 1) / smoothing_time
        raise ValueError(
            f"{1.0 / interval:.3g} samples a second are too few: {least:.0f} are needed at least"
        )
    if 2 * half + 1 > len(times):
        raise ValueError(f"the record is shorter than {smoothing_time:g} s")
    return half
