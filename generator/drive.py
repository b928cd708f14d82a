"""What drives a joint in a simulation: a table of its displacements, smooth between the rows."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from generator.frames import Array


@dataclass(frozen=True, eq=False)
class Drive:
    """The motion of one joint, through n rows.

    Between the rows it is the cubic spline whose second derivative is continuous, and whose third
    is so at the second row and the last but one ("not a knot"): nothing is said of the slopes at
    the ends, so that rows taken from a motion give that motion back. Two rows make a straight line,
    three a parabola.

    Attributes:
        times: shape (n,), increasing [s]; at least two.
        values: displacements, shape (n, k) [rad or m].
        freedoms: which of the joint's degrees of freedom the k columns are, from 0; None for all.

    Raises:
        ValueError: the rows make no motion; the message says why.
    """

    times: Sequence[float] | Array
    values: Sequence[Sequence[float]] | Array
    freedoms: tuple[int, ...] | None = None

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
        if self.freedoms is not None and (
            len(set(self.freedoms)) != len(self.freedoms)
            or len(self.freedoms) != values.shape[1]
            or min(self.freedoms) < 0
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
    def _splines(self) -> tuple[CubicSpline, CubicSpline]:
        spline = CubicSpline(np.asarray(self.times, float), np.asarray(self.values, float))
        return spline, spline.derivative()

    def at(self, times: float | Array) -> Array:
        """Displacements, shape (..., k) [rad or m], at times of shape (...)."""
        return np.asarray(self._splines[0](times))

    def rates(self, times: float | Array) -> Array:
        """Rates of the displacements, shape (..., k) [rad/s or m/s], at times of shape (...)."""
        return np.asarray(self._splines[1](times))
