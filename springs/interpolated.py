"""A curve through measured points, without the overshoot of other splines.

The points are joined by monotone cubic Hermite interpolation (PCHIP; Fritsch & Butland, SIAM J.
Sci. Comput. 5, 1984): between two points the torque never leaves their two values. Beyond the first
and the last point it continues along the tangent: an extrapolation, which begins at the ends of
`valid_range`.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import isfinite
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from springs.backends import NUMPY, CubicPieces, Operations, Real
from springs.cubic import Coefficients, antiderivative
from springs.elastic import Range

Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class _CubicPiece:
    """A cubic from `start` on, with the energy [J] stored where it starts."""

    start: float
    coefficients: Coefficients
    energy: float


@dataclass(frozen=True)
class Interpolated:
    """Torque on the child by monotone interpolation of points.

    Attributes:
        points: pairs of angle [rad] and torque [N m], the angles increasing.
    """

    points: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        """Refuse fewer than two points, numbers that are none, and angles that do not increase."""
        if len(self.points) < 2:
            raise ValueError("a curve needs two points at least")
        if not all(isfinite(value) for point in self.points for value in point):
            raise ValueError("the points of a curve are finite numbers")
        angles = [angle for angle, _ in self.points]
        for before, after in pairwise(angles):
            if after <= before:
                raise ValueError(
                    f"the angles of a curve increase: {after:g} rad comes after {before:g} rad"
                )

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] at `angle` [rad]."""
        return ops.piecewise_cubic(angle, self._cubics)

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J], zero at the first point; the torque is minus its slope."""
        return self._stored_energy(angle, ops, 0, len(self._pieces))

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Angles of the points [rad], where the curvature of the torque jumps."""
        return tuple(angle for angle, _ in self.points)

    @property
    def valid_range(self) -> Range:
        """From the first point to the last [rad]."""
        return self.points[0][0], self.points[-1][0]

    def mirrored(self) -> "Interpolated":
        """The law of the same joint when its angle is counted the other way."""
        return Interpolated(tuple((-angle, -torque) for angle, torque in reversed(self.points)))

    @cached_property
    def _pieces(self) -> tuple[_CubicPiece, ...]:
        """The tangent before the first point, the cubics, the tangent after the last point."""
        angles, torques = np.array(self.points).T
        widths = np.diff(angles)
        chords = np.diff(torques) / widths
        slopes = _monotone_slopes(widths, chords)
        bends = (slopes[:-1] + slopes[1:] - 2.0 * chords) / widths
        columns = [
            torques[:-1],
            slopes[:-1],
            (chords - slopes[:-1]) / widths - bends,
            bends / widths,
        ]
        first, last, energy = self.points[0], self.points[-1], 0.0
        pieces = [_CubicPiece(first[0], (first[1], float(slopes[0]), 0.0, 0.0), energy)]
        for start, width, (c0, c1, c2, c3) in zip(
            angles.tolist(), widths.tolist(), np.transpose(columns).tolist(), strict=False
        ):
            pieces.append(_CubicPiece(start, (c0, c1, c2, c3), energy))
            energy = float(_piece_energy(pieces[-1], width))
        return *pieces, _CubicPiece(last[0], (last[1], float(slopes[-1]), 0.0, 0.0), energy)

    @cached_property
    def _cubics(self) -> CubicPieces:
        """The pieces of the torque."""
        return [(piece.start, piece.coefficients) for piece in self._pieces]

    def _stored_energy(self, angle: Real, ops: Operations, first: int, end: int) -> Real:
        """Energy of the piece in which `angle` is, among those from `first` to before `end`.

        Halving keeps an expression tree as shallow as it can be.
        """
        if end - first == 1:
            piece = self._pieces[first]
            return _piece_energy(piece, angle - piece.start)
        middle = (first + end) // 2
        below = self._stored_energy(angle, ops, first, middle)
        above = self._stored_energy(angle, ops, middle, end)
        return ops.smooth_where(angle < self.points[middle - 1][0], below, above)


def _piece_energy(piece: _CubicPiece, x: Real) -> Real:
    return piece.energy - antiderivative(piece.coefficients, x)


def _monotone_slopes(widths: Array, chords: Array) -> Array:
    """Slopes at n + 1 points for which the cubics between them are monotone [N m/rad].

    Args:
        widths: distances of the points, shape (n,) [rad].
        chords: slopes of the straight lines between the points, shape (n,) [N m/rad].
    """
    if len(chords) == 1:
        return np.repeat(chords, 2)
    slopes = np.zeros(len(chords) + 1)
    before, after = chords[:-1], chords[1:]
    rising = np.flatnonzero(np.sign(before) * np.sign(after) > 0.0)
    first, second = 2.0 * widths[1:] + widths[:-1], widths[1:] + 2.0 * widths[:-1]
    first, second = first[rising], second[rising]
    # The weighted harmonic mean; zero where the torque has an extremum.
    slopes[1 + rising] = 1.0 / (
        (first / before[rising] + second / after[rising]) / (first + second)
    )
    slopes[0] = _end_slope(widths[:2], chords[:2])
    slopes[-1] = _end_slope(widths[:-3:-1], chords[:-3:-1])
    return slopes


def _end_slope(widths: Array, chords: Array) -> float:
    """Slope at an end by the parabola through three points, limited to monotone cubics.

    From C. Moler, Numerical Computing with MATLAB, 2004, section 3.6.
    """
    (h, k), (near, far) = widths.tolist(), chords.tolist()
    slope = ((2.0 * h + k) * near - h * far) / (h + k)
    if np.sign(slope) != np.sign(near):
        return 0.0
    if np.sign(near) != np.sign(far) and abs(slope) > 3.0 * abs(near):
        return 3.0 * near
    return slope
