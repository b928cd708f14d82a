"""Vectors as three components, and the turn by half of a rotation vector.

A number that is exactly 0 or 1 makes a product vanish or disappear, so that recorded code and
expression trees have no such terms.
"""

from typing import TypeAlias

from springs.backends import Operations, Real, Vector

Parts: TypeAlias = tuple[Real, Real, Real]
"""Components of a vector."""

_SMALL_ANGLE = 1e-4
"""Angle below which sin(a/2)/a is taken from its series [rad]."""


def half_quaternion(r: Vector, ops: Operations) -> tuple[Real, Parts]:
    """Return cos(a/2), and sin(a/2) times the axis, of a rotation vector of the size a [rad]."""
    a = ops.norm(r)
    small = a < _SMALL_ANGLE
    safe = ops.smooth_where(small, 1.0, a)
    share = ops.smooth_where(small, 0.5 - a * a / 48.0, ops.sin(0.5 * safe) / safe)
    x, y, z = (share * ops.part(r, k) for k in range(3))
    return ops.cos(0.5 * a), (x, y, z)


def _is_number(value: Real, number: float) -> bool:
    return isinstance(value, int | float) and value == number


def times(x: Real, y: Real) -> Real:
    """Return a product."""
    if _is_number(x, 0.0) or _is_number(y, 0.0):
        return 0.0
    if _is_number(x, 1.0):
        return y
    if _is_number(y, 1.0):
        return x
    if _is_number(x, -1.0):
        return -y
    if _is_number(y, -1.0):
        return -x
    return x * y


def plus(x: Real, y: Real) -> Real:
    """Return a sum."""
    return y if _is_number(x, 0.0) else x if _is_number(y, 0.0) else x + y


def minus(x: Real, y: Real) -> Real:
    """Return a difference."""
    return x if _is_number(y, 0.0) else -y if _is_number(x, 0.0) else x - y


def cross(x: Parts, y: Parts) -> Parts:
    """Return a vector product."""
    a, b, c = (minus(times(x[i], y[j]), times(x[j], y[i])) for i, j in ((1, 2), (2, 0), (0, 1)))
    return a, b, c


def dot(x: Parts, y: Parts) -> Real:
    """Return a scalar product."""
    terms = [times(a, b) for a, b in zip(x, y, strict=True)]
    return plus(plus(terms[0], terms[1]), terms[2])


def combined(*terms: tuple[Real, Parts]) -> Parts:
    """Return the sum of vectors, each times a number."""
    total: Parts = (0.0, 0.0, 0.0)
    for size, axis in terms:
        x, y, z = (plus(part, times(size, e)) for part, e in zip(total, axis, strict=True))
        total = (x, y, z)
    return total
