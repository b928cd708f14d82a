"""Functions that a law needs beyond arithmetic, for arrays, single floats and symbols.

A law is written once, with `+ - * / <` and the functions of an `Operations`: `NUMPY` serves arrays,
`FLOATS` single numbers; an engine that builds expression trees brings its own. Expression trees are
evaluated without sharing, so laws name vectors as wholes where a component would be read often.
"""

import math
import sys
from bisect import bisect_right
from collections.abc import Sequence
from typing import Any, Protocol, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

Real: TypeAlias = Any
"""A float, a numpy array, or a symbol of an engine."""

Vector: TypeAlias = Any
"""Three Reals: a numpy array of shape (..., 3) or a symbolic vector; has `+`, `-` and `[]`."""


CubicPieces: TypeAlias = Sequence[tuple[float, tuple[float, float, float, float]]]
"""Origins in increasing order, and coefficients of the powers of the distance from them.

A piece holds from its origin to that of the next one; the first also below its origin.
"""

_LARGEST_EXPONENT = math.log(sys.float_info.max)


class Operations(Protocol):
    """Functions that every kind of number must offer."""

    def where(self, condition: Real, yes: Real, no: Real) -> Real:
        """`yes` where the condition holds, else `no`: pieces whose values or slopes differ.

        Where the condition changes is a breakpoint, at which an integration ends a step.
        """
        ...

    def smooth_where(self, condition: Real, yes: Real, no: Real) -> Real:
        """`yes` where the condition holds, else `no`: pieces that join with the same slope.

        Such as the pieces of a curve, or (1 - cos x)/x^2 and its series near zero. An integration
        ends no step where the condition changes: its error control suffices. Also for kinks of
        contact that are left to it; `tests/properties/test_smooth_where.py` lists all uses.
        """
        ...

    def piecewise_cubic(self, value: Real, pieces: CubicPieces) -> Real:
        """The cubic of the piece in which `value` is; pieces join with the same slope.

        Their curvature jumps, so that methods of high order end a step there.
        """
        ...

    def sin(self, value: Real) -> Real:
        """Sine of an angle [rad]."""
        ...

    def cos(self, value: Real) -> Real:
        """Cosine of an angle [rad]."""
        ...

    def atan2(self, y: Real, x: Real) -> Real:
        """Angle of the point (x, y) [rad]."""
        ...

    def sqrt(self, value: Real) -> Real:
        """Square root."""
        ...

    def tanh(self, value: Real) -> Real:
        """Hyperbolic tangent."""
        ...

    def exp(self, value: Real) -> Real:
        """Exponential function; infinite where it is too large for a number."""
        ...

    def vector(self, parts: Sequence[Real]) -> Vector:
        """A vector of three components."""
        ...

    def part(self, vector: Vector, index: int) -> Real:
        """Component 0, 1 or 2."""
        ...

    def dot(self, one: Vector, other: Vector) -> Real:
        """Scalar product."""
        ...

    def norm(self, vector: Vector) -> Real:
        """Length of a vector."""
        ...

    def scaled(self, factor: Real, vector: Vector) -> Vector:
        """A vector times a scalar."""
        ...


def select_cubic(ops: Operations, value: Real, pieces: CubicPieces) -> Real:
    """Evaluate `Operations.piecewise_cubic` by conditions, halving the pieces.

    So an expression tree is as shallow as it can be.
    """
    if len(pieces) == 1:
        origin, (c0, c1, c2, c3) = pieces[0]
        x = value - origin
        return c0 + x * (c1 + x * (c2 + x * c3))
    middle = len(pieces) // 2
    below = select_cubic(ops, value, pieces[:middle])
    above = select_cubic(ops, value, pieces[middle:])
    return ops.smooth_where(value < pieces[middle][0], below, above)


class _Numpy:
    """Arrays; a vector holds its components along the last axis."""

    def where(self, condition: Real, yes: Real, no: Real) -> Real:
        return np.where(cast("Array", condition), cast("Array", yes), cast("Array", no))

    smooth_where = where

    def piecewise_cubic(self, value: Real, pieces: CubicPieces) -> Real:
        origins = np.array([origin for origin, _ in pieces])
        angles = np.asarray(value, dtype=np.float64)
        index = np.asarray(np.searchsorted(origins[1:], angles, side="right"))
        rows = np.array([row for _, row in pieces])[index]
        x = angles - origins[index]
        c0, c1, c2, c3 = (rows[..., k] for k in range(4))
        return c0 + x * (c1 + x * (c2 + x * c3))

    def sin(self, value: Real) -> Real:
        return np.sin(value)

    def cos(self, value: Real) -> Real:
        return np.cos(value)

    def atan2(self, y: Real, x: Real) -> Real:
        return np.arctan2(y, x)

    def sqrt(self, value: Real) -> Real:
        return np.sqrt(value)

    def tanh(self, value: Real) -> Real:
        return np.tanh(value)

    def exp(self, value: Real) -> Real:
        with np.errstate(over="ignore"):
            return np.exp(value)

    def vector(self, parts: Sequence[Real]) -> Vector:
        return np.stack(np.broadcast_arrays(*parts), axis=-1)

    def part(self, vector: Vector, index: int) -> Real:
        return vector[..., index]

    def dot(self, one: Vector, other: Vector) -> Real:
        return np.sum(cast("Array", one * other), axis=-1)

    def norm(self, vector: Vector) -> Real:
        return np.sqrt(self.dot(vector, vector))

    def scaled(self, factor: Real, vector: Vector) -> Vector:
        return np.asarray(factor)[..., None] * vector


class _Floats:
    """Single floats, several times faster than arrays of one; a vector is an array (3,)."""

    def where(self, condition: Real, yes: Real, no: Real) -> Real:
        return yes if condition else no

    smooth_where = where

    def piecewise_cubic(self, value: Real, pieces: CubicPieces) -> Real:
        index = bisect_right(pieces, value, lo=1, key=lambda piece: piece[0]) - 1
        return select_cubic(self, value, pieces[index : index + 1])

    def sin(self, value: Real) -> Real:
        return math.sin(value)

    def cos(self, value: Real) -> Real:
        return math.cos(value)

    def atan2(self, y: Real, x: Real) -> Real:
        return math.atan2(y, x)

    def sqrt(self, value: Real) -> Real:
        return math.sqrt(value)

    def tanh(self, value: Real) -> Real:
        return math.tanh(value)

    def exp(self, value: Real) -> Real:
        return math.exp(value) if value < _LARGEST_EXPONENT else math.inf

    def vector(self, parts: Sequence[Real]) -> Vector:
        return np.array(parts)

    def part(self, vector: Vector, index: int) -> Real:
        return float(vector[index])

    def dot(self, one: Vector, other: Vector) -> Real:
        return float(one @ other)

    def norm(self, vector: Vector) -> Real:
        return math.sqrt(self.dot(vector, vector))

    def scaled(self, factor: Real, vector: Vector) -> Vector:
        return factor * vector


NUMPY: Operations = _Numpy()
FLOATS: Operations = _Floats()
