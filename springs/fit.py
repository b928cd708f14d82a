"""A least-squares cubic through measured moments, as the thesis fits its curves (section 4.2).

The polynomial is fitted in x = (angle - middle) / half, which runs from -1 to 1 over the data:
there the problem is well conditioned wherever the data lie, and "negligible" has a meaning.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
from numpy.polynomial import Polynomial

from springs.backends import Array
from springs.cubic import Coefficients, Cubic, NotRestoringError, passive_cubic, polynomial

_NEGLIGIBLE_SHARE = 1e-12
"""Part of the largest moment below which a term of the cubic is rounding."""

_ROOT_TOLERANCE = 1e-4
"""Part of the range of the data by which rounding may move a root that is threefold."""

_RESTORING_CONSTRAINTS = np.array(
    [
        [1.0, -1.0, 1.0, -1.0],  # T(-1) >= 0
        [-1.0, -1.0, -1.0, -1.0],  # T(1) <= 0
        [0.0, -1.0, 2.0, -3.0],  # T'(-1) <= 0
        [0.0, -1.0, -2.0, -3.0],  # T'(1) <= 0
        [0.0, 0.0, 2.0, -6.0],  # T''(-1) >= 0
        [0.0, 0.0, -2.0, -6.0],  # T''(1) <= 0
    ]
)
"""Rows that are not negative for the coefficients, lowest power first, of a T that restores."""


@dataclass(frozen=True)
class CubicFit:
    """A cubic fitted to measured moments.

    Attributes:
        angles: angles of the data [rad].
        moments: moments of the data [N m].
        coefficients: c0..c3 [N m, N m/rad, N m/rad^2, N m/rad^3].
        covariance: covariance of the coefficients, shape (4, 4), estimated from the residuals; None
            where there are no more points than coefficients or a bound holds the cubic.
        bounds_active: whether the cubic was bound to restore at both ends, and a bound holds it.
    """

    angles: Array
    moments: Array
    coefficients: Coefficients
    covariance: Array | None
    bounds_active: bool = False

    @property
    def fitted_moments(self) -> Array:
        """The cubic at the angles of the data [N m]."""
        return polynomial(self.coefficients, self.angles)

    @property
    def residuals(self) -> Array:
        """Measured moment less the cubic [N m]."""
        return self.moments - self.fitted_moments

    @property
    def rms(self) -> float:
        """Root mean square of the residuals [N m]."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def r_squared(self) -> float | None:
        """Part of the moments' variance that the cubic explains; None for equal moments."""
        spread = float(np.sum((self.moments - self.moments.mean()) ** 2))
        return 1.0 - float(np.sum(self.residuals**2)) / spread if spread > 0.0 else None

    @property
    def standard_errors(self) -> Coefficients | None:
        """Standard errors of c0..c3, in their units; None without a covariance."""
        if self.covariance is None:
            return None
        c0, c1, c2, c3 = np.sqrt(np.diag(self.covariance)).tolist()
        return c0, c1, c2, c3

    @cached_property
    def law(self) -> Cubic:
        """The law that the cubic is by the rule of `springs.cubic`.

        Raises:
            NotRestoringError: no sense makes the cubic restoring at both ends.
        """
        return passive_cubic(self.coefficients)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Doubts about the law, one sentence each."""
        try:
            law = self.law
        except NotRestoringError as failure:
            return (f"no sense makes this cubic restoring, so it is not a law: {failure}",)
        return tuple(_find_doubts(self, law))


def fit_cubic(
    angles: Sequence[float] | Array, moments: Sequence[float] | Array, *, passive: bool = False
) -> CubicFit:
    """The cubic nearest to measured moments in least squares.

    Args:
        angles: [rad], at least four different ones.
        moments: [N m], one an angle.
        passive: bind the torque T = sense M to restore at the first and the last angle and beyond:
            T >= 0, T' <= 0 and T'' >= 0 at the first; T <= 0, T' <= 0 and T'' <= 0 at the last.
            From there on the torque then only grows, and any dead zone lies between the two. Of the
            two senses that one is taken in which the cubic comes nearer to the data.

    Raises:
        ValueError: fewer than four different angles, or numbers that are not finite.
    """
    a, m = np.asarray(angles, dtype=float), np.asarray(moments, dtype=float)
    if a.shape != m.shape or not (np.isfinite(a).all() and np.isfinite(m).all()):
        raise ValueError("a fit needs finite numbers, and a moment for each angle")
    if len(np.unique(a)) < 4:
        raise ValueError("a cubic needs four different angles")
    middle, half = 0.5 * (a.max() + a.min()), 0.5 * (a.max() - a.min())
    x = (a - middle) / half
    largest = float(np.abs(m).max())
    design = np.vander(x, 4, increasing=True)
    solved = cast("tuple[Array, Array]", np.polyfit(x, m, 3, cov="unscaled"))
    nearest, unscaled = (np.flip(part) for part in solved)
    free = chosen = _clear_negligible_powers(nearest, largest)
    if passive:
        bound = [_clear_negligible_powers(s * _fit_restoring(x, s * m), largest) for s in (-1, 1)]
        chosen = min(bound, key=lambda one: float(np.sum((m - design @ one) ** 2)))
    slack = 1e-9 * max(largest, np.finfo(float).tiny)
    is_bound_active = passive and not np.allclose(chosen, free, rtol=0.0, atol=slack)
    covariance = None
    if len(a) > 4 and not is_bound_active:
        variance = float(np.sum((m - design @ nearest) ** 2)) / (len(a) - 4)
        turn = np.array([_angle_coefficients(unit, middle, half) for unit in np.eye(4)]).T
        covariance = variance * turn @ unscaled @ turn.T
    c0, c1, c2, c3 = _angle_coefficients(chosen, middle, half)
    return CubicFit(a, m, (c0, c1, c2, c3), covariance, is_bound_active)


def _fit_restoring(x: Array, torques: Array) -> Array:
    """The coefficients of least squares of a torque that restores at -1 and 1.

    With the design matrix A = QR and z = R k - Q^T T this is a least-distance problem, |z| least
    where G R^-1 z >= -G R^-1 Q^T T, and its dual is one of non-negative least squares (Lawson &
    Hanson 1974, chapter 23).
    """
    from scipy.optimize import nnls

    q, r = np.linalg.qr(np.vander(x, 4, increasing=True))
    target = q.T @ torques
    constraints = np.linalg.solve(r.T, _RESTORING_CONSTRAINTS.T)
    levels = -(constraints.T @ target)
    scale = max(float(np.abs(levels).max()), np.finfo(float).tiny)
    system = np.vstack([constraints, levels / scale])
    wanted = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
    rest: Array = system @ nnls(system, wanted)[0] - wanted
    return cast("Array", np.linalg.solve(r, target - scale * rest[:4] / rest[4]))


def _clear_negligible_powers(coefficients: Array, largest: float) -> Array:
    """The highest powers set to zero where they are rounding, so that no sense hangs on them."""
    cleared = coefficients.copy()
    for power in (3, 2, 1):
        if abs(cleared[power]) > _NEGLIGIBLE_SHARE * largest:
            break
        cleared[power] = 0.0
    return cleared


def _angle_coefficients(coefficients: Array, middle: float, half: float) -> list[float]:
    """c0..c3 of the angle, from the coefficients of x; powers that are zero stay so."""
    line = Polynomial([-middle / half, 1.0 / half])
    powers = np.asarray(Polynomial(coefficients)(line).coef)
    return [float(c) for c in np.pad(powers, (0, 4 - len(powers)))]


def _find_doubts(fit: CubicFit, law: Cubic) -> Iterator[str]:
    first, last = float(fit.angles.min()), float(fit.angles.max())
    slack = _ROOT_TOLERANCE * (last - first)
    c3, errors = fit.coefficients[3], fit.standard_errors
    if errors is not None and c3 != 0.0 and abs(c3) < 2.0 * errors[3]:
        yield (
            "the cubic term is not twice its standard error, so the sense of the curve, which "
            "is its sign, hangs on noise; --passive asks for one that restores within the data"
        )
    if fit.bounds_active:
        yield "the bounds hold this cubic, so it has no standard errors and is not the nearest one"
    zone = law.dead_zone
    if zone is None:
        return
    if zone[0] <= first + slack and zone[1] >= last - slack:
        yield "the dead zone covers all the data: where it was measured this law has no torque"
    elif zone[0] < first - slack or zone[1] > last + slack:
        yield "an edge of the dead zone lies beyond the data"
    inside = (fit.angles > zone[0]) & (fit.angles < zone[1])
    left_out = float(np.abs(fit.fitted_moments[inside]).max(initial=0.0))
    if left_out > 2.0 * fit.rms:
        yield f"within the dead zone the law leaves out a fitted moment of {left_out:.3g} N m"
