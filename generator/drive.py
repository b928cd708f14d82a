"""Drive of a joint in a simulation: a table of displacements, smooth between the rows."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from generator.rotations import Array

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

MIN_ROW_INTERVAL = 1e-6
"""Smallest interval between rows from which rates can be computed [s]."""

MAX_DISPLACEMENT = 1e6
"""Largest displacement [rad or m]."""

RELATIVE_OVERSHOOT_TOLERANCE = 0.05
"""Overshoot of a spline, relative to the range of its rows, below which there is no warning."""

ABSOLUTE_OVERSHOOT_TOLERANCE = 1e-3
"""Overshoot below which there is no warning [rad or m]."""


@dataclass(frozen=True)
class Overshoot:
    """Largest excursion of the spline of a drive beyond the range of its rows.

    Attributes:
        column: column of the drive's values, from 0.
        row: the place is between this row and the next, from 0.
        time: time of it [s].
        value: there [rad or m].
        low: smallest displacement in the rows [rad or m].
        high: largest one.
    """

    column: int
    row: int
    time: float
    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Drive:
    """The motion of one joint, through n rows.

    Between the rows it is the cubic spline whose second derivative is continuous, and whose third
    is so at the second row and the last but one ("not a knot"): the slopes at the ends are free,
    so that rows taken from a motion reproduce it. Two rows make a straight line,
    three a parabola.

    Attributes:
        times: shape (n,), increasing [s]; at least two.
        values: displacements, shape (n, k) [rad or m].
        coordinates: degrees of freedom of the joint that the k columns are, from 0; None for all.

    Raises:
        ValueError: the rows make no motion; the message says why.
    """

    times: Sequence[float] | Array
    values: Sequence[Sequence[float]] | Array
    coordinates: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        """Refuse rows that are too few, out of order or not finite."""
        times, values = np.asarray(self.times, float), np.asarray(self.values, float)
        if times.ndim != 1 or times.size < 2:
            raise ValueError("a drive needs two rows or more")
        if values.ndim != 2 or len(values) != times.size or values.shape[1] == 0:
            raise ValueError(
                f"a drive of {times.size} rows needs as many rows of displacements, "
                f"not the shape {values.shape}"
            )
        if not (np.all(np.isfinite(times)) and np.all(np.isfinite(values))):
            raise ValueError("times and displacements of a drive must be finite")
        if np.any(np.diff(times) <= 0.0):
            raise ValueError("the times of a drive must increase")
        if np.any(np.diff(times) < MIN_ROW_INTERVAL):
            raise ValueError(f"rows of a drive must be {MIN_ROW_INTERVAL:.0e} s apart or more")
        if np.any(np.abs(values) > MAX_DISPLACEMENT):
            raise ValueError(
                f"displacements of a drive must be at most {MAX_DISPLACEMENT:.0e} rad or m"
            )
        if self.coordinates is not None and (
            len(set(self.coordinates)) != len(self.coordinates)
            or len(self.coordinates) != values.shape[1]
            or min(self.coordinates) < 0
        ):
            raise ValueError("each column of a drive is one degree of freedom, counted from 0")

    @property
    def start(self) -> float:
        """Time of the first row [s]."""
        return float(self.times[0])

    @property
    def stop(self) -> float:
        """Time of the last row [s]."""
        return float(self.times[-1])

    @cached_property
    def _splines(self) -> "tuple[CubicSpline, CubicSpline]":
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(np.asarray(self.times, float), np.asarray(self.values, float))
        return spline, spline.derivative()

    def displacements(self, times: float | Array) -> Array:
        """Displacements, shape (..., k) [rad or m], at times of shape (...)."""
        return np.asarray(self._splines[0](times))

    def overshoots(self) -> tuple[Overshoot, ...]:
        """The largest overshoot of each column, if above both tolerances."""
        knots, rows = np.asarray(self.times, float), np.asarray(self.values, float)
        lengths = np.diff(knots)[:, None]
        a, b, c = (factor * self._splines[0].c[k] for k, factor in enumerate((3.0, 2.0, 1.0)))
        with np.errstate(divide="ignore", invalid="ignore"):
            # Where 3 c0 x^2 + 2 c1 x + c2 is zero, in the form that loses no digits.
            q = -0.5 * (b + np.copysign(np.sqrt(b**2 - 4.0 * a * c), b))
            turning = np.stack([q / a, c / q])
        inside = (turning > 0.0) & (turning < lengths)
        times = knots[:-1, None] + np.where(inside, turning, 0.0)
        found: list[Overshoot] = []
        for column, (low, high) in enumerate(zip(rows.min(axis=0), rows.max(axis=0), strict=True)):
            values = self.displacements(times[:, :, column])[..., column]
            beyond = np.maximum(values - high, low - values)
            which, row = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
            if beyond[which, row] > max(
                RELATIVE_OVERSHOOT_TOLERANCE * (high - low), ABSOLUTE_OVERSHOOT_TOLERANCE
            ):
                time, value = float(times[which, row, column]), float(values[which, row])
                found.append(Overshoot(column, int(row), time, value, float(low), float(high)))
        return tuple(found)

    def derivatives(self, times: float | Array, order: int) -> Array:
        """Derivative of an order in time, shape (..., k) [rad/s^order], at times (...)."""
        return np.asarray(self._splines[0](times, order))

    def rates(self, times: float | Array) -> Array:
        """Rates of the displacements, shape (..., k) [rad/s or m/s], at times of shape (...)."""
        return np.asarray(self._splines[1](times))

    def accelerations(self, times: float | Array) -> Array:
        """Second derivatives of the displacements, shape (..., k) [rad/s^2 or m/s^2]."""
        return np.asarray(self._splines[0](times, 2))
