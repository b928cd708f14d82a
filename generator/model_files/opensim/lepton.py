"""Laws as the text of an expression, for programs that calculate from one.

The functions are those of Lepton, which OpenSim reads: `step(x)` is 0 below zero and 1 from there
on, `^` is not used. There are no blanks. Both sides of a condition are calculated and one of them
is multiplied by zero, so both have to be finite.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from springs.backends import Operations, Real, Vector


@dataclass(frozen=True)
class Expression:
    """A number that is not known yet: `text` says how to calculate it."""

    text: str

    def __add__(self, other: "Expression | float") -> "Expression":
        """The sum."""
        return _joined(self, "+", other)

    def __radd__(self, other: float) -> "Expression":
        """The sum."""
        return _joined(other, "+", self)

    def __sub__(self, other: "Expression | float") -> "Expression":
        """The difference."""
        return _joined(self, "-", other)

    def __rsub__(self, other: float) -> "Expression":
        """The difference."""
        return _joined(other, "-", self)

    def __mul__(self, other: "Expression | float") -> "Expression":
        """The product."""
        return _joined(self, "*", other)

    def __rmul__(self, other: float) -> "Expression":
        """The product."""
        return _joined(other, "*", self)

    def __truediv__(self, other: "Expression | float") -> "Expression":
        """The quotient."""
        return _joined(self, "/", other)

    def __neg__(self) -> "Expression":
        """The number with the other sign."""
        return _joined(-1.0, "*", self)

    def __lt__(self, other: "Expression | float") -> "Condition":
        """Whether it is below `other`."""
        return Condition(self - other)

    def __gt__(self, other: "Expression | float") -> "Condition":
        """Whether it is above `other`."""
        return Condition(other - self)


@dataclass(frozen=True)
class Condition:
    """Whether a number is below zero."""

    number: Expression

    @property
    def fails(self) -> Expression:
        """0 where the condition holds, else 1."""
        return Expression(f"step({self.number.text})")

    @property
    def holds(self) -> Expression:
        """1 where the condition holds, else 0."""
        return 1.0 - self.fails


ZERO = Expression("0")


def _joined(one: Expression | float, sign: str, other: Expression | float) -> Expression:
    """Two numbers with a sign between them, without what changes nothing."""
    neutral = 0.0 if sign in "+-" else 1.0
    if isinstance(one, Expression) and other == neutral:
        return one
    if isinstance(other, Expression) and one == neutral and sign in "+*":
        return other
    if isinstance(one, Expression) and sign in "+-" and other == ZERO:
        return one
    if isinstance(other, Expression) and sign == "+" and one == ZERO:
        return other
    if sign == "*" and {0.0, ZERO} & {one, other}:
        return ZERO
    return Expression(f"({_text(one)}{sign}{_text(other)})")


def _text(value: Expression | float) -> str:
    if isinstance(value, Expression):
        return value.text
    number = repr(float(value))
    return f"({number})" if number.startswith("-") else number


class _Written:
    """Expressions of one number; there are no vectors."""

    def where(self, condition: Real, yes: Real, no: Real) -> Real:
        assert isinstance(condition, Condition)
        return condition.holds * yes + condition.fails * no

    def sin(self, value: Real) -> Real:
        return Expression(f"sin({_text(value)})")

    def tanh(self, value: Real) -> Real:
        return Expression(f"tanh({_text(value)})")

    def exp(self, value: Real) -> Real:
        return Expression(f"exp({_text(value)})")

    def vector(self, parts: Sequence[Real]) -> Vector:
        raise TypeError(_NO_VECTORS)

    def part(self, vector: Vector, index: int) -> Real:
        raise TypeError(_NO_VECTORS)

    def dot(self, one: Vector, other: Vector) -> Real:
        raise TypeError(_NO_VECTORS)

    def norm(self, vector: Vector) -> Real:
        raise TypeError(_NO_VECTORS)

    def scaled(self, factor: Real, vector: Vector) -> Vector:
        raise TypeError(_NO_VECTORS)


_NO_VECTORS = "an expression is a number: laws of several turns cannot be written as one"

WRITTEN: Operations = _Written()
