"""A displacement as a function of another one: a polynomial or a cubic spline through points.

The spline is that of SIMM and of OpenSim's models. Its second derivative is continuous between its
ends, and beyond these it goes straight on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from math import isfinite, perm
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import ModelError
from generator.rotations import Array

MAX_COEFFICIENTS = 20
"""Largest number of coefficients of a polynomial."""

MAX_POINTS = 1000
"""Largest number of points of a spline."""

_FITTED_POINTS = 400
"""Number of points of a curve that a fit considers."""

START, ORIGIN, POWERS_FROM = 0, 1, 2
"""Columns of pieces: first argument of the piece, argument from which powers are, coefficients."""


class CurveKind(StrEnum):
    """Kind of a curve; the value is the word of figure files."""

    POLYNOMIAL = "polynomial"
    SIMM_SPLINE = "simm_spline"


@dataclass(frozen=True)
class FollowerCurve:
    """A displacement as a function of another.

    Attributes:
        kind: Polynomial, or cubic spline whose third derivatives at the ends are those of the
            cubics through the first and the last four points (Forsythe, Malcolm & Moler 1977).
        numbers: Coefficients of a polynomial from the constant on, or points x, y, x, y ... of a
            spline [rad or m].

    Raises:
        ModelError: The numbers make no curve.
    """

    kind: CurveKind
    numbers: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the numbers."""
        numbers = tuple(float(number) for number in self.numbers)
        object.__setattr__(self, "numbers", numbers)
        if not all(map(isfinite, numbers)):
            raise ModelError("a curve has a number that is not finite")
        count = len(numbers)
        if self.kind is CurveKind.POLYNOMIAL:
            if not 1 <= count <= MAX_COEFFICIENTS:
                raise ModelError(
                    f"a polynomial has 1 to {MAX_COEFFICIENTS} coefficients, not {count}"
                )
        elif count % 2 or not 4 <= count <= 2 * MAX_POINTS:
            raise ModelError(
                f"a spline has the numbers x, y of 2 to {MAX_POINTS} points, not {count} numbers"
            )
        elif not np.all(np.diff(numbers[::2]) > 0.0):
            raise ModelError("the points of a spline are in the order of increasing x")
        if not np.all(np.isfinite(self.pieces[:, ORIGIN:])):
            raise ModelError("a curve is too steep: its coefficients are not finite")

    @classmethod
    def line(cls, slope: float, constant: float) -> "FollowerCurve":
        """Return a straight line."""
        return cls(CurveKind.POLYNOMIAL, (constant, slope))

    @cached_property
    def pieces(self) -> Array:
        """Polynomials by intervals of the argument, in the columns `START` and what follows."""
        if self.kind is CurveKind.POLYNOMIAL:
            return np.array([[-np.inf, 0.0, *self.numbers]])
        x, y = np.array(self.numbers[::2]), np.array(self.numbers[1::2])
        with np.errstate(all="ignore"):
            bends, steps = _bends(x, y), np.diff(x)
            slopes = np.diff(y) / steps - steps * (2.0 * bends[:-1] + bends[1:]) / 6.0
            thirds = np.diff(bends) / steps
            last = slopes[-1] + steps[-1] * (bends[-2] + bends[-1]) / 2.0
        inner = np.stack([x[:-1], x[:-1], y[:-1], slopes, bends[:-1] / 2.0, thirds / 6.0], axis=1)
        before = [-np.inf, x[0], y[0], slopes[0], 0.0, 0.0]
        return np.vstack([before, inner, [x[-1], x[-1], y[-1], last, 0.0, 0.0]])

    def places(self, values: ArrayLike) -> Any:
        """Return the piece of each argument."""
        return np.searchsorted(self.pieces[:, START], values, side="right") - 1

    def at(self, values: ArrayLike, derivative: int = 0, places: Any = None) -> Array:
        """Return the displacement, or a derivative of it, at arguments of any shape.

        Args:
            values: Arguments [rad or m].
            derivative: Order of the derivative.
            places: Pieces to use, in place of those in which the arguments are.
        """
        rows = self.pieces[self.places(values) if places is None else places]
        beyond, total = np.asarray(values, dtype=float) - rows[..., ORIGIN], np.zeros(())
        powers = rows[..., POWERS_FROM:]
        for k in reversed(range(derivative, powers.shape[-1])):
            total = total * beyond + perm(k, derivative) * powers[..., k]
        return np.asarray(total + 0.0 * beyond)

    def of_line(self, slope: float, constant: float) -> "FollowerCurve":
        """Return the curve of an argument that is slope * x + constant."""
        if self.kind is CurveKind.POLYNOMIAL:
            powers = np.zeros(1)
            for number in reversed(self.numbers):
                powers = np.convolve(powers, (constant, slope))
                powers[0] += number
            return FollowerCurve(self.kind, tuple(powers[: len(self.numbers)]))
        points = (np.reshape(self.numbers, (-1, 2)) - (constant, 0.0)) / (slope, 1.0)
        return FollowerCurve(self.kind, tuple(points[:: 1 if slope > 0.0 else -1].ravel()))

    def fitted_by_polynomial(
        self, degree: int, ends: tuple[float, float], through: float
    ) -> "FollowerCurve":
        """Return the polynomial that is nearest at the Chebyshev points of a range.

        Args:
            degree: Degree of the polynomial, at least 1.
            ends: Range of the argument [rad or m].
            through: Argument at which it has the value of the curve [rad or m].
        """
        angles = np.pi * (np.arange(_FITTED_POINTS) + 0.5) / _FITTED_POINTS
        low, high = ends
        x = (high + low) / 2.0 + (high - low) / 2.0 * np.cos(angles) - through
        here = self.at(through)
        size, exponents = max(float(np.abs(x).max()), 1e-9), np.arange(1, degree + 1)
        columns = (x[:, None] / size) ** exponents
        powers = np.linalg.lstsq(columns, self.at(x + through) - here)[0] / size**exponents
        fitted = FollowerCurve(CurveKind.POLYNOMIAL, (float(here), *map(float, powers)))
        return fitted.of_line(1.0, -through)

    def scaled(self, factor: float, added: float = 0.0) -> "FollowerCurve":
        """Return factor * curve + added."""
        numbers = list(self.numbers)
        if self.kind is CurveKind.POLYNOMIAL:
            numbers = [factor * number for number in numbers]
            numbers[0] += added
        else:
            numbers[1::2] = [factor * number + added for number in numbers[1::2]]
        return FollowerCurve(self.kind, tuple(numbers))


def _bends(x: Array, y: Array) -> Array:
    """Return the second derivatives of the spline at its points."""
    count, steps = len(x), np.diff(x)
    slopes = np.diff(y) / steps
    if count == 2:
        return np.zeros(2)
    matrix, right = np.zeros((count, count)), np.zeros(count)
    for k in range(1, count - 1):
        matrix[k, k - 1 : k + 2] = steps[k - 1], 2.0 * (steps[k - 1] + steps[k]), steps[k]
        right[k] = 6.0 * (slopes[k] - slopes[k - 1])
    matrix[0, :2] = matrix[-1, :-3:-1] = -1.0, 1.0
    if count > 3:
        right[0] = 6.0 * steps[0] * _divided_difference(x[:4], y[:4])
        right[-1] = -6.0 * steps[-1] * _divided_difference(x[-4:], y[-4:])
    return np.asarray(np.linalg.solve(matrix, right), dtype=float)


def _divided_difference(x: Array, y: Array) -> float:
    """Return the divided difference of all points."""
    values: Sequence[float] | Array = y
    for width in range(1, len(x)):
        values = np.diff(values) / (x[width:] - x[:-width])
    return float(values[0])
