"""Elastic laws as piecewise cubics, the form of springs in other programs.

A law is sampled between its breakpoints. If the cubic through four samples gives all others, the
law is that cubic there; otherwise the law has no such form, and the pieces are divided until the
cubics are near it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import pi, radians

import numpy as np
from numpy.polynomial import Polynomial

from springs import Elastic, total_torque
from springs.backends import Array
from springs.elastic import Range

_END_MARGIN = pi
"""Sampled range beyond the first and last breakpoint [rad or m]."""

_MAX_FIT_ERROR = 1e-9
"""Largest difference of a law and its cubic, relative to the largest torque of the piece."""

_NEGLIGIBLE_TERM = 1e-12
"""Rounding errors: terms below this share of the largest torque of their piece."""

_SAMPLES_PER_PIECE = 9

ROTATION_MARGIN, TRANSLATION_MARGIN = radians(30.0), 0.02
"""Distances beyond the range of a joint up to which its laws are followed [rad] and [m]."""

FITTED_SHARE, FITTED_TORQUE = 1e-3, 1e-2
"""Difference of a law and its fit, as a share of the largest torque of the piece, and in N m, or N
along a translation; the larger holds."""

_SHORTEST_FITTED_SHARE = 1.0 / 512.0
"""Pieces of a fit of less than this share of the range are not divided further."""

_DIGITS = 15

_MIN_BREAKPOINT_DISTANCE = 1e-9
"""Closer breakpoints coincide [rad or m]."""

_REACH = 1e6
"""Largest displacement at which laws are followed [rad or m]. Some models write 1e16 for a joint
without limits, where two numbers that differ by a turn are the same."""


@dataclass(frozen=True)
class BreakpointTerm:
    """A term beyond a breakpoint.

    Attributes:
        start: the breakpoint [rad or m].
        above: it applies above the breakpoint, otherwise below.
        coefficients: a1, a2, a3 of a1 y + a2 y^2 + a3 y^3, where y = value - start [N m or N].
    """

    start: float
    above: bool
    coefficients: tuple[float, float, float]


@dataclass(frozen=True)
class PiecewiseCubic:
    """A continuous torque as a cubic that applies everywhere, and terms beyond breakpoints.

    Attributes:
        root: zero of the cubic [rad or m].
        coefficients: a1, a2, a3 of a1 x + a2 x^2 + a3 x^3, where x = value - root [N m or N].
        breakpoint_terms: terms beyond breakpoints.
        constant: torque that applies everywhere, if no piece has a zero [N m or N].
    """

    root: float
    coefficients: tuple[float, float, float]
    breakpoint_terms: tuple[BreakpointTerm, ...] = ()
    constant: float = 0.0

    def torque(self, value: Array) -> Array:
        """Torque [N m] at displacements [rad or m]."""
        total = self.constant + _cubic_torque(self.coefficients, value - self.root)
        for term in self.breakpoint_terms:
            beyond = value > term.start if term.above else value < term.start
            total = total + beyond * _cubic_torque(term.coefficients, value - term.start)
        return total


def _cubic_torque(coefficients: tuple[float, float, float], x: Array) -> Array:
    a1, a2, a3 = coefficients
    return x * (a1 + x * (a2 + x * a3))


def piecewise_cubic(laws: Sequence[Elastic]) -> PiecewiseCubic | None:
    """Return the sum of laws as a piecewise cubic; None if it has no such form.

    It has none if a piece is not a cubic, if the sum jumps, or if no piece has a zero, as with a
    constant torque.
    """
    corners = _distinct_breakpoints(
        sorted({x for law in laws for x in law.breakpoints if abs(x) <= _REACH})
    )
    edges = [(corners or [0.0])[0] - _END_MARGIN, *corners, (corners or [0.0])[-1] + _END_MARGIN]
    pieces: list[_Piece] = []
    for low, high in pairwise(edges):
        piece = _interpolate(laws, low, high, _CHEBYSHEV_NODES, _CHEBYSHEV_CHOICE)
        if not piece.error <= _MAX_FIT_ERROR * piece.max_torque < np.inf:
            return None
        pieces.append(piece)
    return _join_pieces(pieces, corners)


def fit_piecewise_cubic(laws: Sequence[Elastic], ends: Range) -> PiecewiseCubic | None:
    """Return a continuous piecewise cubic near the sum of laws; None for infinite torques.

    It is exact where `piecewise_cubic` is. Beyond the range the torque continues with its slope.

    Args:
        laws: laws of one displacement.
        ends: range in which the laws are followed [rad or m].
    """
    exact = piecewise_cubic(laws)
    if exact is not None:
        return exact
    low, high = max(ends[0], -_REACH), min(ends[1], _REACH)
    inner = [x for law in laws for x in law.breakpoints if low < x < high]
    edges = _distinct_breakpoints(sorted({low, *inner, high}))
    pieces: list[_Piece] = []
    pending = list(pairwise(edges))[::-1]
    while pending:
        start, end = pending.pop()
        piece = _interpolate(laws, start, end, _LOBATTO_NODES, _LOBATTO_CHOICE)
        if not np.isfinite(piece.max_torque):
            return None
        allowed = max(FITTED_SHARE * piece.max_torque, FITTED_TORQUE)
        if piece.error > allowed and end - start > _SHORTEST_FITTED_SHARE * (high - low):
            middle = 0.5 * (start + end)
            pending += [(middle, end), (start, middle)]
        else:
            pieces.append(piece)
    corners = [pieces[0].low, *(piece.high for piece in pieces)]
    pieces = [pieces[0].tangent(low, low - 1.0), *pieces, pieces[-1].tangent(high, high + 1.0)]
    joined = _join_pieces(pieces, corners)
    if joined is None:
        constant = float(np.asarray(total_torque(laws, pieces[len(pieces) // 2].low)))
        moved = [replace(piece, cubic=piece.cubic - constant) for piece in pieces]
        joined = _join_pieces(moved, corners)
        joined = joined and replace(joined, constant=constant)
    return joined


def _join_pieces(pieces: Sequence["_Piece"], corners: Sequence[float]) -> PiecewiseCubic | None:
    """Return the curve of successive pieces; None if it jumps or no piece has a zero."""
    rooted = [(piece.base_rank, k) for k, piece in enumerate(pieces) if piece.root is not None]
    if not rooted:
        return None
    base = min(rooted)[1]
    root = pieces[base].root or 0.0
    steps: list[BreakpointTerm] = []
    for k, corner in enumerate(corners):
        above = k >= base
        inner, outer = (pieces[k], pieces[k + 1]) if above else (pieces[k + 1], pieces[k])
        start, *terms = (
            outer.coefficients_about(corner) - inner.coefficients_about(corner)
        ).tolist()
        if abs(start) > _MAX_FIT_ERROR * max(inner.max_torque, outer.max_torque):
            return None
        if any(terms):
            steps.append(BreakpointTerm(corner, above, (terms[0], terms[1], terms[2])))
    _, a1, a2, a3 = pieces[base].coefficients_about(root).tolist()
    return PiecewiseCubic(root, (a1, a2, a3), tuple(steps))


def _distinct_breakpoints(breakpoints: list[float]) -> list[float]:
    """Return the breakpoints in order, without those that coincide except for rounding."""
    steps = pairwise([-np.inf, *breakpoints])
    return [later for one, later in steps if later - one > _MIN_BREAKPOINT_DISTANCE]


_CHEBYSHEV_NODES: Array = np.cos(pi * (np.arange(_SAMPLES_PER_PIECE) + 0.5) / _SAMPLES_PER_PIECE)
_CHEBYSHEV_CHOICE = [0, 2, 5, 8]
"""Samples from -1 to 1 inside a piece, and those through which the cubic goes."""

_LOBATTO_NODES: Array = np.cos(pi * np.arange(_SAMPLES_PER_PIECE + 4) / (_SAMPLES_PER_PIECE + 3))
_LOBATTO_CHOICE = [0, 4, 8, 12]
"""The same with both ends, so that cubics of successive pieces are equal there."""


def _interpolate(
    laws: Sequence[Elastic], low: float, high: float, nodes: Array, chosen: list[int]
) -> "_Piece":
    """Return the cubic through some samples of the sum of laws from `low` to `high`."""
    middle, half_width = 0.5 * (low + high), 0.5 * (high - low)
    torques = np.asarray(total_torque(laws, middle + half_width * nodes)) + np.zeros_like(nodes)
    max_torque = float(np.abs(torques).max())
    if not np.isfinite(torques).all():
        return _Piece(low, high, Polynomial([0.0]), np.inf, np.inf)
    terms = np.linalg.solve(np.vander(nodes[chosen], 4, increasing=True), torques[chosen])
    cubic = Polynomial(np.where(np.abs(terms) < _NEGLIGIBLE_TERM * max_torque, 0.0, terms))
    return _Piece(low, high, cubic, max_torque, float(np.abs(cubic(nodes) - torques).max()))


@dataclass(frozen=True)
class _Piece:
    """A cubic from `low` to `high`.

    Attributes:
        low: lower end [rad or m].
        high: upper end.
        cubic: torque as a function of values from -1 to 1 between the ends [N m].
        max_torque: largest torque [N m].
        error: largest difference from the samples [N m].
    """

    low: float
    high: float
    cubic: Polynomial
    max_torque: float
    error: float

    def tangent(self, start: float, end: float) -> "_Piece":
        """Return the line that continues the piece from its end `start` to `end`."""
        at = (start - self._middle) / self._half_width
        torque, slope = float(self.cubic(at)), float(self.cubic.deriv()(at)) / self._half_width
        low, high = min(start, end), max(start, end)
        half = 0.5 * (high - low)
        line = Polynomial([torque + slope * (0.5 * (low + high) - start), slope * half])
        return _Piece(low, high, line, max(abs(torque), abs(torque + slope * (end - start))), 0.0)

    @property
    def base_rank(self) -> tuple[bool, float, float]:
        """Sort key of the piece that becomes the base, the lowest first.

        A piece without torque needs no spring; a zero within the piece loses no digits; then a zero
        near zero is preferred.
        """
        root = self.root or 0.0
        return bool(np.any(self.cubic.coef)), max(self.low - root, root - self.high, 0.0), abs(root)

    @property
    def _middle(self) -> float:
        return 0.5 * (self.low + self.high)

    @property
    def _half_width(self) -> float:
        return 0.5 * (self.high - self.low)

    @cached_property
    def root(self) -> float | None:
        """The zero of the cubic that is nearest to the piece; 0 if it is zero everywhere."""
        if not np.any(self.cubic.coef):
            return 0.0
        found = self.cubic.trim().roots()
        real = [float(r.real) for r in found if abs(r.imag) <= _NEGLIGIBLE_TERM * max(1.0, abs(r))]
        if not real:
            return None
        return self._middle + self._half_width * min(real, key=abs)

    def coefficients_about(self, point: float) -> Array:
        """Return the coefficients of the powers 0 to 3 of value - point [N m], shape (4,)."""
        line = Polynomial([(point - self._middle) / self._half_width, 1.0 / self._half_width])
        terms = np.zeros(4)
        moved = np.asarray(self.cubic(line).coef)
        terms[: len(moved)] = moved
        reach = max(abs(self.low - point), abs(self.high - point))
        small = np.abs(terms) * reach ** np.arange(4) < _NEGLIGIBLE_TERM * self.max_torque
        # The last digits are rounding errors.
        return np.where(small, 0.0, [float(f"{term:.{_DIGITS}g}") for term in terms.tolist()])
