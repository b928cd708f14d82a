"""Laws as text that OpenSim evaluates: expressions that are calculated with like numbers.

OpenSim parses them with Lepton, which knows `step` (1 from zero on) and no conditions. Definitions
follow an expression: `a*b;b=2*c`.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from generator.rotations import Array
from springs.backends import CubicPieces, Operations, Real, Vector, select_cubic


@dataclass(frozen=True)
class Expression:
    """A scalar function of variables, as text in Lepton's syntax."""

    text: str

    def __add__(self, other: "Expression | float") -> "Expression":
        """The sum."""
        return _combine(self, "+", other)

    def __radd__(self, other: float) -> "Expression":
        """The sum."""
        return _combine(other, "+", self)

    def __sub__(self, other: "Expression | float") -> "Expression":
        """The difference."""
        return _combine(self, "-", other)

    def __rsub__(self, other: float) -> "Expression":
        """The difference."""
        return _combine(other, "-", self)

    def __mul__(self, other: "Expression | float") -> "Expression":
        """The product."""
        return _combine(self, "*", other)

    def __rmul__(self, other: float) -> "Expression":
        """The product."""
        return _combine(other, "*", self)

    def __truediv__(self, other: "Expression | float") -> "Expression":
        """The quotient."""
        return _combine(self, "/", other)

    def __neg__(self) -> "Expression":
        """The negative."""
        return _combine(-1.0, "*", self)

    def __lt__(self, other: "Expression | float") -> "Condition":
        """Return the condition that it is below `other`."""
        return Condition(self - other)

    def __gt__(self, other: "Expression | float") -> "Condition":
        """Return the condition that it is above `other`."""
        return Condition(other - self)


@dataclass(frozen=True)
class Condition:
    """The condition that a number is below zero."""

    value: Expression

    @property
    def fails(self) -> Expression:
        """0 where the condition holds, else 1."""
        return Expression(f"step({self.value.text})")

    @property
    def holds(self) -> Expression:
        """1 where the condition holds, else 0."""
        return 1.0 - self.fails


ZERO, ONE = Expression("0"), Expression("1")


def _combine(one: Expression | float, operator: str, other: Expression | float) -> Expression:
    """Return two operands with the operator between them; neutral operands are left out."""
    neutral = 0.0 if operator in "+-" else 1.0
    if isinstance(one, Expression) and other == neutral:
        return one
    if isinstance(other, Expression) and one == neutral and operator in "+*":
        return other
    if isinstance(one, Expression) and operator in "+-" and other == ZERO:
        return one
    if isinstance(other, Expression) and operator == "+" and one == ZERO:
        return other
    if operator == "*" and {0.0, ZERO} & {one, other}:
        return ZERO
    return Expression(f"({_operand_text(one)}{operator}{_operand_text(other)})")


def _operand_text(value: Expression | float) -> str:
    if isinstance(value, Expression):
        return value.text
    number = repr(float(value))
    return f"({number})" if number.startswith("-") else number


class _ExpressionOperations:
    """Operations on scalar expressions; those on vectors raise TypeError."""

    def where(self, condition: Real, yes: Real, no: Real) -> Real:
        assert isinstance(condition, Condition)
        return condition.holds * yes + condition.fails * no

    smooth_where = where

    def piecewise_cubic(self, value: Real, pieces: CubicPieces) -> Real:
        return select_cubic(self, value, pieces)

    def sin(self, value: Real) -> Real:
        return Expression(f"sin({_operand_text(value)})")

    def cos(self, value: Real) -> Real:
        return Expression(f"cos({_operand_text(value)})")

    def atan2(self, y: Real, x: Real) -> Real:
        return Expression(f"atan2({_operand_text(y)},{_operand_text(x)})")

    def sqrt(self, value: Real) -> Real:
        return Expression(f"sqrt({_operand_text(value)})")

    def tanh(self, value: Real) -> Real:
        return Expression(f"tanh({_operand_text(value)})")

    def exp(self, value: Real) -> Real:
        return Expression(f"exp({_operand_text(value)})")

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


_NO_VECTORS = "an expression is a number, not a vector"

EXPRESSION_OPERATIONS: Operations = _ExpressionOperations()


_ROUNDING = 1e-15
"""Largest size of coefficients that are rounding errors."""


def sum_of_products(coefficients: Array, factors: Sequence[tuple[str, ...]]) -> Expression:
    """Return the sum of products of one factor of each angle, each with a coefficient.

    Args:
        coefficients: coefficients by the places of the factors, of as many axes as angles.
        factors: texts of the factors of each angle; "" for 1.
    """
    total = ZERO
    for places in product(*map(range, coefficients.shape)):
        coefficient = float(coefficients[places])
        if abs(coefficient) > _ROUNDING:
            texts = [one[place] for one, place in zip(factors, places, strict=True) if one[place]]
            total = total + (coefficient * Expression("*".join(texts)) if texts else coefficient)
    return total


_NAME = re.compile(r"[A-Za-z_]\w*")


def with_definitions(expression: Expression, definitions: Mapping[str, Expression]) -> str:
    """Return the text of an expression, followed by the definitions that it needs.

    Args:
        expression: may contain names that are defined.
        definitions: definitions by name; each may contain names of those after it.
    """
    needed = set(_NAME.findall(expression.text))
    parts = [expression.text]
    for name, definition in definitions.items():
        if name in needed:
            needed.update(_NAME.findall(definition.text))
            parts.append(f"{name}={definition.text}")
    return ";".join(parts)
