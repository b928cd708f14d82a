"""The thesis's moment-displacement cubic with its dead zone (eq. 4.1-4.3 as corrected, 4.5-4.7).

The thesis's tables mix two senses (torque on the child = +M or -M), and several cubics drive away
in the middle of the range. The rule that makes all of them passive: take the sense in which the
curve restores at both ends, and where it has three real roots read the interval between the outer
two as a dead zone, as eq. 4.5 has it for elbow and knee.
"""

from dataclasses import dataclass

import numpy as np

from springs.backends import NUMPY, Operations, Real

Coefficients = tuple[float, float, float, float]


def polynomial(coefficients: Coefficients, a: Real) -> Real:
    """M(a) = c0 + c1 a + c2 a^2 + c3 a^3 [N m], a in rad."""
    c0, c1, c2, c3 = coefficients
    return c0 + a * (c1 + a * (c2 + a * c3))


def antiderivative(coefficients: Coefficients, a: Real) -> Real:
    """The integral of `polynomial` from 0 to a [J]."""
    c0, c1, c2, c3 = coefficients
    return a * (c0 + a * (c1 / 2.0 + a * (c2 / 3.0 + a * (c3 / 4.0))))


@dataclass(frozen=True)
class Cubic:
    """Torque on the child = sense * (M(a) - M(edge)) beyond the dead zone's edges, zero inside.

    a = angle - rest. Without a dead zone the torque is sense * M(a) everywhere, and the energy is
    counted from a = 0; with one it is counted from the dead zone.

    Attributes:
        coefficients: c0..c3 [N m, N m/rad, N m/rad^2, N m/rad^3].
        sense: -1 when M is the resisting moment (eq. 4.5), +1 when M acts on the child.
        dead_zone: lower and upper edge of a [rad], or None.
        rest: the displacement at which a is zero (alpha_0 of eq. 4.5) [rad].
    """

    coefficients: Coefficients
    sense: int = -1
    dead_zone: tuple[float, float] | None = None
    rest: float = 0.0

    def __post_init__(self) -> None:
        """Reject a sense other than +1 or -1 and a dead zone that ends before it begins."""
        if self.sense not in (-1, 1):
            raise ValueError(f"the sense of a cubic is +1 or -1, not {self.sense}")
        if self.dead_zone is not None and self.dead_zone[0] > self.dead_zone[1]:
            raise ValueError(
                f"the dead zone {self.dead_zone[0]:g} .. {self.dead_zone[1]:g} rad "
                "ends before it begins"
            )

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] at `angle` [rad]."""
        a = self._angle_from_rest(angle)
        if self.dead_zone is None:
            return polynomial(self._torque_coefficients(None), a)
        low, high = self.dead_zone
        below = polynomial(self._torque_coefficients(low), a - low)
        above = polynomial(self._torque_coefficients(high), a - high)
        return ops.where(a < low, below, ops.where(a > high, above, 0.0))

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J] at `angle` [rad]; the torque is minus its slope."""
        a = self._angle_from_rest(angle)
        if self.dead_zone is None:
            return -antiderivative(self._torque_coefficients(None), a)
        low, high = self.dead_zone
        below = antiderivative(self._torque_coefficients(low), a - low)
        above = antiderivative(self._torque_coefficients(high), a - high)
        return -ops.where(a < low, below, ops.where(a > high, above, 0.0))

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Angles of the dead zone's edges [rad], where the slope of the torque jumps."""
        return tuple(edge + self.rest for edge in self.dead_zone or ())

    def mirrored(self) -> "Cubic":
        """The law of the same joint when its angle is counted the other way."""
        c0, c1, c2, c3 = self.coefficients
        zone = self.dead_zone
        return Cubic((-c0, c1, -c2, c3), self.sense, zone and (-zone[1], -zone[0]), -self.rest)

    def _angle_from_rest(self, angle: Real) -> Real:
        return angle - self.rest if self.rest else angle

    def _torque_coefficients(self, edge: float | None) -> Coefficients:
        """Coefficients of the torque on the child, of powers of a, or of a - edge beyond an edge.

        sense * (M(a) - M(edge)) is expanded about the edge, so that rounding changes no sign there.
        """
        c0, c1, c2, c3 = self.coefficients
        if edge is not None:
            c0, c1, c2 = 0.0, c1 + edge * (2.0 * c2 + edge * 3.0 * c3), c2 + 3.0 * edge * c3
        s = self.sense
        return s * c0, s * c1, s * c2, s * c3


class NotRestoringError(ValueError):
    """No sense makes the cubic restoring at both ends."""


def restoring_sense(coefficients: Coefficients) -> int:
    """The sense in which a cubic restores at both ends, +1 or -1.

    -sign(c3), and -sign(c1) where c3 is zero. Raises NotRestoringError when c3 is zero and c2 is
    not (a parabola pushes the same way at both ends), or when only a constant is left.
    """
    c0, c1, c2, c3 = coefficients
    if c3 != 0.0:
        return -1 if c3 > 0.0 else 1
    if c2 != 0.0:
        raise NotRestoringError("c3 is zero and c2 is not: it pushes the same way at both ends")
    if c1 == 0.0 and c0 != 0.0:
        raise NotRestoringError("only c0 is not zero: a constant moment restores nowhere")
    return 1 if c1 < 0.0 else -1


def outer_roots(coefficients: Coefficients) -> tuple[float, float] | None:
    """The smallest and the largest of three real roots [rad], or None where there is only one."""
    c0, c1, c2, c3 = coefficients
    if c3 == 0.0:
        return None
    # In units of `scale` no coefficient of x^3 + b x^2 + c x + d exceeds one, so nothing overflows.
    b, c, d = c2 / c3, c1 / c3, c0 / c3
    scale = max(abs(b), abs(c) ** 0.5, abs(d) ** (1.0 / 3.0))
    if scale == 0.0 or not np.isfinite(scale):
        return None
    b, c, d = b / scale, c / scale / scale, d / scale / scale / scale
    # Depressed cubic t^3 + p t + q, x = t - shift: three real roots where 4p^3 + 27q^2 <= 0.
    shift = b / 3.0
    p = c - 3.0 * shift**2
    q = 2.0 * shift**3 - shift * c + d
    if p >= 0.0 or 4.0 * p**3 + 27.0 * q**2 > 0.0:
        return None
    radius = 2.0 * np.sqrt(-p / 3.0)
    angle = np.arccos(np.clip(3.0 * q / (p * radius), -1.0, 1.0)) / 3.0
    roots = [radius * np.cos(angle - 2.0 * np.pi * k / 3.0) - shift for k in range(3)]
    return float(scale * min(roots)), float(scale * max(roots))


def passive_cubic(
    coefficients: Coefficients,
    dead_zone: tuple[float, float] | None = None,
    rest: float = 0.0,
    *,
    bounded: bool = False,
) -> Cubic:
    """A printed cubic read by the rule.

    Args:
        coefficients: c0..c3 as printed [N m, rad].
        dead_zone: edges of a [rad] when the table gives them; they win over the roots.
        rest: alpha_0 [rad].
        bounded: whether stops bound the range, so that a cubic that restores at one end only may
            pass; it is then read as a resisting moment (sense -1).

    Raises:
        NotRestoringError: see `restoring_sense`.
    """
    try:
        sense = restoring_sense(coefficients)
    except NotRestoringError:
        if not bounded:
            raise
        sense = -1
    return Cubic(coefficients, sense, dead_zone or outer_roots(coefficients), rest)
