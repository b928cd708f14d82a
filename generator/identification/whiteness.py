"""Tests of the residuals of a fit: autocorrelation, and their size against a stated noise."""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from generator.rotations import Array

SIGNIFICANCE = 1e-3
"""Probability below which a test counts: fits of correct models are rarely called wrong."""

_MAX_LAGS = 20
"""Largest number of lags of a test."""

_SAMPLES_PER_LAG = 5
"""Smallest number of samples for each lag of a test."""


@dataclass(frozen=True)
class Whiteness:
    """Tests of residuals.

    Attributes:
        samples: number of residuals.
        rms: root mean square [rad].
        lag_one: autocorrelation of successive residuals.
        lags: number of lags of the Ljung-Box test.
        ljung_box: its statistic.
        whiteness: probability of a larger one for independent residuals; None for few samples.
        effective_samples: number of independent samples with the same information on a mean, for
            residuals that decay geometrically (Bartlett, J. R. Stat. Soc. 1935).
        chi_square: sum of squares over the stated variance; None without one.
        misfit: probability of a larger chi-square; None without one.
        degrees_of_freedom: samples less unknowns.
    """

    samples: int
    rms: float
    lag_one: float
    lags: int
    ljung_box: float
    whiteness: float | None
    effective_samples: float
    chi_square: float | None
    misfit: float | None
    degrees_of_freedom: int

    @property
    def are_autocorrelated(self) -> bool:
        """Return whether the residuals depend on each other, so that the model misses something."""
        return self.whiteness is not None and self.whiteness < SIGNIFICANCE

    @property
    def widening(self) -> float:
        """Factor by which intervals that assume independent residuals are too narrow, about."""
        return sqrt(self.samples / self.effective_samples)


def check_residuals(residuals: Array, unknowns: int, sd: float | None) -> Whiteness:
    """Test residuals, shape (n, k) [rad].

    Each column is a series in time; the statistics of the columns add (Ljung and Box,
    Biometrika 1978).

    Args:
        residuals: simulated less measured angles.
        unknowns: number of fitted quantities.
        sd: stated standard deviation of the noise [rad], or None.
    """
    from scipy.stats import chi2

    samples, columns = residuals.shape
    freedom = samples * columns - unknowns
    lags = min(_MAX_LAGS, samples // _SAMPLES_PER_LAG)
    total, rho_one, whiteness = 0.0, 0.0, None
    if lags >= 1 and np.all(np.sum(residuals**2, axis=0) > 0.0):
        for column in residuals.T:
            rho = autocorrelations(column, lags)
            total += (
                samples
                * (samples + 2.0)
                * float(np.sum(rho**2 / (samples - np.arange(1, lags + 1))))
            )
            rho_one += float(rho[0]) / columns
        whiteness = float(chi2.sf(total, lags * columns))
    squares = float(np.sum(residuals**2))
    chi_square = None if sd is None else squares / sd**2
    kept = min(max(rho_one, 0.0), 0.999)
    return Whiteness(
        samples=residuals.size,
        rms=sqrt(squares / residuals.size),
        lag_one=rho_one,
        lags=lags,
        ljung_box=total,
        whiteness=whiteness,
        effective_samples=residuals.size * (1.0 - kept) / (1.0 + kept),
        chi_square=chi_square,
        misfit=None if chi_square is None else float(chi2.sf(chi_square, freedom)),
        degrees_of_freedom=freedom,
    )


def autocorrelations(series: Array, lags: int) -> Array:
    """Autocorrelations of a series (n,) about its mean at the lags 1 to `lags`, shape (lags,)."""
    centred = series - series.mean()
    power = float(np.sum(centred**2))
    if power == 0.0:
        return np.zeros(lags)
    return np.array([float(centred[k:] @ centred[:-k]) / power for k in range(1, lags + 1)])
