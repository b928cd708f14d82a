"""The rule for sense and dead zone: the one reading of the printed cubics that makes all passive.

The thesis's tables mix two senses (torque on the child = +M or -M), and several cubics push the
wrong way in the middle of the range. A cubic that crosses zero at both ends of a range must do so.
The rule: take the sense in which the curve restores at both ends, and where it has three real roots
read the stretch between the outer two as a dead zone, as eq. 4.5 has it for elbow and knee.
"""

import numpy as np

from springs.cubic import Coefficients, Cubic


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
