"""Elastic laws as piecewise cubics, the form of springs in other programs.

A law is sampled between its breakpoints. If the cubic through four samples gives all others, the
law is that cubic there; otherwise the law has no such form.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import pi

import numpy as np
from numpy.polynomial import Polynomial

from springs import Elastic, total_torque
from springs.backends import Array

_END_MARGIN = pi
"""Sampled range beyond the first and last breakpoint [rad or m]."""

_MAX_FIT_ERROR = 1e-9
"""Largest difference of a law and its cubic, relative to the largest torque of the piece."""

_NEGLIGIBLE_TERM = 1e-12
"""Rounding errors: terms below this share of the largest torque of their piece."""

_SAMPLES_PER_PIECE = 9

_DIGITS = 15

_MIN_BREAKPOINT_DISTANCE = 1e-9
"""Closer breakpoints coincide [rad or m]."""


@dataclass(frozen=True)
class BreakpointTerm:
    """A term beyond a breakpoint.

    Attributes:
        start: the breakpoint [rad or m].
        above: it applies above the breakpoint, otherwise below.
        coefficients: a1, a2, a3 of a1 y + a2 y^2 + a3 y^3, where y = value - start [N m].
    """

    start: float
    above: bool
    coefficients: tuple[float, float, float]


@dataclass(frozen=True)
class PiecewiseCubic:
    """A continuous torque as a cubic that applies everywhere, and terms beyond breakpoints.

    Attributes:
        root: zero of the cubic [rad or m].
        coefficients: a1, a2, a3 of a1 x + a2 x^2 + a3 x^3, where x = value - root [N m].
        breakpoint_terms: terms beyond breakpoints.
    """

    root: float
    coefficients: tuple[float, float, float]
    breakpoint_terms: tuple[BreakpointTerm, ...] = ()


def piecewise_cubic(laws: Sequence[Elastic]) -> PiecewiseCubic | None:
    """Return the sum of laws as a piecewise cubic; None if it has no such form.

    It has none if a piece is not a cubic, if the sum jumps, or if no piece has a zero, as with a
    constant torque.
    """
    corners = _distinct_breakpoints(sorted({corner for law in laws for corner in law.breakpoints}))
    edges = [(corners or [0.0])[0] - _END_MARGIN, *corners, (corners or [0.0])[-1] + _END_MARGIN]
    pieces = [_Piece(tuple(laws), low, high) for low, high in pairwise(edges)]
    if not all(piece.is_cubic for piece in pieces):
        return None
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
    kept = breakpoints[:1]
    kept += [
        later for one, later in pairwise(breakpoints) if later - one > _MIN_BREAKPOINT_DISTANCE
    ]
    return kept


@dataclass(frozen=True)
class _Piece:
    """The sum of the laws from `low` to `high`."""

    laws: tuple[Elastic, ...]
    low: float
    high: float

    @property
    def base_rank(self) -> tuple[bool, float, float]:
        """Sort key of the piece that becomes the base, the lowest first.

        A piece without torque needs no spring; a zero within the piece loses no digits; then a zero
        near zero is preferred.
        """
        root = self.root or 0.0
        return self.max_torque > 0.0, max(self.low - root, root - self.high, 0.0), abs(root)

    @cached_property
    def _samples(self) -> tuple[Array, Array]:
        """Values from -1 to 1 inside the piece, and the torques there."""
        nodes = np.cos(pi * (np.arange(_SAMPLES_PER_PIECE) + 0.5) / _SAMPLES_PER_PIECE)
        torques = total_torque(self.laws, self._middle + self._half_width * nodes)
        return nodes, np.asarray(torques) + np.zeros_like(nodes)

    @property
    def _middle(self) -> float:
        return 0.5 * (self.low + self.high)

    @property
    def _half_width(self) -> float:
        return 0.5 * (self.high - self.low)

    @property
    def max_torque(self) -> float:
        """Largest torque [N m]."""
        return float(np.abs(self._samples[1]).max())

    @cached_property
    def _cubic(self) -> Polynomial:
        """The cubic through four of the samples, of values from -1 to 1."""
        nodes, torques = self._samples
        chosen = [0, 2, 5, 8]
        terms = np.linalg.solve(np.vander(nodes[chosen], 4, increasing=True), torques[chosen])
        return Polynomial(np.where(np.abs(terms) < _NEGLIGIBLE_TERM * self.max_torque, 0.0, terms))

    @property
    def is_cubic(self) -> bool:
        """True if the cubic through four samples gives the others."""
        nodes, torques = self._samples
        difference = np.abs(self._cubic(nodes) - torques)
        return bool(
            np.isfinite(difference).all() and difference.max() <= _MAX_FIT_ERROR * self.max_torque
        )

    @cached_property
    def root(self) -> float | None:
        """The zero of the cubic that is nearest to the piece; 0 if it is zero everywhere."""
        if self.max_torque == 0.0:
            return 0.0
        found = self._cubic.trim().roots()
        real = [float(r.real) for r in found if abs(r.imag) <= _NEGLIGIBLE_TERM * max(1.0, abs(r))]
        if not real:
            return None
        return self._middle + self._half_width * min(real, key=abs)

    def coefficients_about(self, point: float) -> Array:
        """Return the coefficients of the powers 0 to 3 of value - point [N m], shape (4,)."""
        line = Polynomial([(point - self._middle) / self._half_width, 1.0 / self._half_width])
        terms = np.zeros(4)
        moved = np.asarray(self._cubic(line).coef)
        terms[: len(moved)] = moved
        reach = max(abs(self.low - point), abs(self.high - point))
        small = np.abs(terms) * reach ** np.arange(4) < _NEGLIGIBLE_TERM * self.max_torque
        return np.array(
            [0.0 if none else _round_digits(a) for a, none in zip(terms, small, strict=True)]
        )


def _round_digits(number: float) -> float:
    """Return the number without its last digits, which are rounding errors."""
    return float(f"{number:.{_DIGITS}g}")
