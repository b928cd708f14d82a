"""Uncertainty of fitted values: covariance, directions that the data do not determine, profiles."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from generator.rotations import Array

MAX_CONDITION = 1e4
"""Condition of the scaled Jacobian above which a fit is refused."""

PROFILE_DISTANCES = (1.0, 2.0, 3.0)
"""Distances from the estimate at which a profile is computed [sd]."""

MAX_PROFILE_DISTANCE = 12.0
"""Distance from which a profile that has not risen is open [sd], or twice the quantile if larger:
with few samples the quantile itself is large."""

_MAX_CORRECTIONS = 6
"""Number of corrections of the other unknowns at a point of a profile."""


@dataclass(frozen=True)
class LinearUncertainty:
    """Uncertainty of a fit whose residuals are linear in the unknowns.

    Attributes:
        condition: condition of the Jacobian with columns of length 1, which does not depend on
            units (Belsley, Kuh and Welsch, Regression Diagnostics, 1980).
        null_direction: change of the unknowns that changes the angles least, shape (p,), relative
            to the length of the columns of the Jacobian.
        covariance: covariance of the estimates, shape (p, p), for noise of variance 1.
    """

    condition: float
    null_direction: Array
    covariance: Array

    @property
    def sd(self) -> Array:
        """Standard deviations for noise of variance 1, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlations(self) -> Array:
        """Correlations of the estimates, shape (p, p)."""
        return self.covariance / np.outer(self.sd, self.sd)


def linear_uncertainty(jacobian: Array) -> LinearUncertainty:
    """Return the uncertainty of the unknowns from a Jacobian (n, p) without columns of zeros."""
    lengths = np.linalg.norm(jacobian, axis=0)
    _, values, directions = np.linalg.svd(jacobian / lengths, full_matrices=False)
    smallest = max(float(values[-1]), float(values[0]) * np.finfo(float).eps)
    scaled = directions.T / np.maximum(values, smallest)
    covariance = (scaled @ scaled.T) / np.outer(lengths, lengths)
    return LinearUncertainty(float(values[0]) / smallest, directions[-1] / lengths, covariance)


def gauss_newton_move(jacobian: Array, residuals: Array) -> Array:
    """Change of the unknowns, shape (p,), at which linear residuals are least."""
    lengths = np.linalg.norm(jacobian, axis=0)
    moves = cast("Array", np.linalg.lstsq(jacobian / lengths, residuals, rcond=None)[0])
    return -moves / lengths


@dataclass(frozen=True, eq=False)
class Profile:
    """Profile of the sum of squares along one unknown, the others fitted at each of its values.

    Attributes:
        values: values of the unknown, shape (m,), increasing.
        distances: signed root of the increase of the sum of squares over the variance of the
            noise, shape (m,); for a linear model the distance from the estimate in standard
            deviations (Bates and Watts, Nonlinear Regression Analysis, 1988).
    """

    values: Array
    distances: Array

    def interval(self, quantile: float) -> tuple[float | None, float | None]:
        """Ends of the values whose distance is at most `quantile`; None for an open end."""
        fine = np.linspace(float(self.values[0]), float(self.values[-1]), _FINE_POINTS)
        inside = fine[self.increase(fine) <= quantile**2]
        low = float(inside[0]) if inside[0] > fine[0] else None
        high = float(inside[-1]) if inside[-1] < fine[-1] else None
        return low, high

    def increase(self, values: Array) -> Array:
        """Increase of the sum of squares over the variance at other values, shape of `values`.

        Between the points of the profile the signed root is interpolated, which is a line for a
        linear model; beside an estimate at the end of its range, the increase itself.
        """
        from scipy.interpolate import PchipInterpolator

        if 0.0 in self.distances[[0, -1]]:
            return np.asarray(PchipInterpolator(self.values, self.distances**2)(values))
        return np.asarray(PchipInterpolator(self.values, self.distances)(values)) ** 2


_FINE_POINTS = 20_001
"""Number of values among which the ends of an interval are found."""


def compute_profile(
    index: int,
    estimate: Array,
    sd: Array,
    variance: float,
    quantile: float,
    lower: Array,
    jacobian: Array,
    residuals: Callable[[Array], Array],
) -> Profile:
    """Compute the profile of one unknown.

    Args:
        index: index of the unknown.
        estimate: estimate of all unknowns, shape (p,).
        sd: of the estimates, shape (p,).
        variance: variance of the noise [rad^2].
        quantile: distance that the profile should reach.
        lower: smallest values of the unknowns, shape (p,).
        jacobian: jacobian at the estimate.
        residuals: residuals as a function of the unknowns.
    """
    others = [k for k in range(len(estimate)) if k != index]
    least = float(np.sum(residuals(estimate) ** 2))
    points = [(float(estimate[index]), 0.0)]
    slope = _slope_of_others(jacobian, index, others)
    farthest = max(MAX_PROFILE_DISTANCE, 2.0 * quantile)
    for sign in (-1.0, 1.0):
        distances = list(PROFILE_DISTANCES)
        reached, moved = 0.0, estimate.copy()
        for distance in distances:
            value = max(float(estimate[index] + sign * distance * sd[index]), float(lower[index]))
            moved[others] += slope * (value - moved[index])
            moved = np.maximum(moved, lower)
            moved[index] = value
            squares = _fit_others(moved, others, sd, lower, jacobian, residuals)
            reached = np.sqrt(max(squares - least, 0.0) / variance)
            points.append((value, sign * float(reached)))
            is_last = distance == distances[-1]
            if value == lower[index] or (is_last and distance >= farthest):
                break
            if is_last and reached < quantile:
                distances.append(2.0 * distance)
    points.sort()
    values, heights = np.array(list(dict(points).items())).T
    return Profile(values, heights)


def _slope_of_others(jacobian: Array, index: int, others: Sequence[int]) -> Array:
    """Change of the other unknowns per change of one, along which linear residuals are least."""
    if not others:
        return np.zeros(0)
    return gauss_newton_move(jacobian[:, list(others)], jacobian[:, index])


def _fit_others(
    values: Array,
    others: Sequence[int],
    sd: Array,
    lower: Array,
    jacobian: Array,
    residuals: Callable[[Array], Array],
) -> float:
    """Fit all unknowns but one, in place, with a constant Jacobian; return the sum of squares."""
    found = residuals(values)
    least = float(np.sum(found**2))
    for _ in range(_MAX_CORRECTIONS if others else 0):
        trial = move_within_bounds(values, others, lower, jacobian, found)
        found = residuals(trial)
        squares = float(np.sum(found**2))
        if not squares < least:
            break
        is_small = bool(np.all(np.abs(trial - values) < 0.02 * sd))
        least, gain = squares, least - squares
        values[:] = trial
        if is_small or gain < 1e-6 * least:
            break
    return least


def move_within_bounds(
    values: Array, others: Sequence[int], lower: Array, jacobian: Array, residuals: Array
) -> Array:
    """Move unknowns to where linear residuals are least; a bound that is passed stops them."""
    free, moved = list(others), values.copy()
    while free:
        trial = moved.copy()
        trial[free] += gauss_newton_move(jacobian[:, free], residuals)
        outside = [k for k in free if trial[k] < lower[k]]
        if not outside:
            return trial
        residuals = residuals + jacobian[:, outside] @ (lower[outside] - moved[outside])
        moved[outside] = lower[outside]
        free = [k for k in free if k not in outside]
    return moved
