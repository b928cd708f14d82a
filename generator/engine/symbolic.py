"""Exudyn's symbols as a kind of number for the laws of `springs`."""

from collections.abc import Sequence

from generator.engine.exudyn_api import symbols
from springs.operations import Operations, Real, Vector


def _symbol(value: Real) -> Real:
    """A constant as a symbol; symbols pass."""
    return symbols.Real(float(value)) if isinstance(value, float | int) else value


class _Symbolic:
    """Expression trees; conditions become `IfThenElse`, both branches are recorded."""

    def where(self, condition: Real, yes: Real, no: Real) -> Real:
        return symbols.IfThenElse(condition, _symbol(yes), _symbol(no))

    def sin(self, value: Real) -> Real:
        return symbols.sin(value)

    def tanh(self, value: Real) -> Real:
        return symbols.tanh(value)

    def exp(self, value: Real) -> Real:
        return symbols.exp(value)

    def vector(self, parts: Sequence[Real]) -> Vector:
        if all(isinstance(part, float | int) for part in parts):
            return symbols.Vector([float(part) for part in parts])
        return symbols.Vector([_symbol(part) for part in parts])

    def part(self, vector: Vector, index: int) -> Real:
        return vector[index]

    def dot(self, one: Vector, other: Vector) -> Real:
        return one * other

    def norm(self, vector: Vector) -> Real:
        return vector.NormL2()

    def scaled(self, factor: Real, vector: Vector) -> Vector:
        return factor * vector


SYMBOLIC: Operations = _Symbolic()
