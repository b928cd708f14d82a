"""Interface to Exudyn: the only module that casts its untyped objects.

Importing it takes a tenth of a second. Exudyn's console output has global switches only; they are
set here. `SYMBOLIC` makes Exudyn's symbols a kind of number for the laws of `springs`.
"""

from collections.abc import Sequence
from typing import Any, cast

import exudyn
from exudyn import advancedUtilities, itemInterface, rigidBodyUtilities

from springs.backends import CubicPieces, Operations, Real, Vector, select_cubic

exu: Any = exudyn
items: Any = itemInterface
symbols: Any = exu.symbolic
rigid: Any = rigidBodyUtilities

MainSystem = Any
"""An Exudyn `mbs`."""

Index = Any
"""An Exudyn item index (ObjectIndex, MarkerIndex, SensorIndex, ...)."""

SolverError: type[Exception] = cast("type[Exception]", exu.SolverError)

exu.config.printToConsole = False
exu.config.suppressWarnings = True


def symbolic_user_function(mbs: MainSystem, function: Any, field: str, item: str) -> Any:
    """Record a Python user function as an expression tree that C++ evaluates.

    Args:
        mbs: the system in which it will be used.
        function: a function with exactly the documented arguments, in symbolic operations.
        field: the item's parameter that takes it (`springTorqueUserFunction`, ...).
        item: the item type's name (`ObjectConnectorTorsionalSpringDamper`, ...).

    Returns:
        The symbolic function; it must be kept alive as long as the system.
    """
    create = cast("Any", advancedUtilities).CreateSymbolicUserFunction
    try:
        return create(mbs, function, field, itemTypeName=item)
    finally:
        symbols.SetRecording(False)


def set_times(integration: Any, start: float, stop: float) -> None:
    """Set the interval of integration [s], which may be negative.

    Exudyn rejects negative times although nothing depends on it, so its check is disabled.
    """
    checks = exu.special.exceptions
    before, checks.parameterRangeChecks = checks.parameterRangeChecks, False
    integration.startTime, integration.endTime = start, stop
    checks.parameterRangeChecks = before


def unused_name(mbs: MainSystem, name: str) -> str:
    """Return the name, numbered if the system has an object or a node of that name.

    Exudyn requires unique names, but a joint may share the name of a segment, and a system may
    contain a figure twice.
    """
    number, tried = 1, name
    while max(int(mbs.GetObjectNumber(tried)), int(mbs.GetNodeNumber(tried))) >= 0:
        number += 1
        tried = f"{name} {number}"
    return tried


def _as_symbol(value: Real) -> Real:
    """Convert a constant to a symbol; return symbols unchanged."""
    return symbols.Real(float(value)) if isinstance(value, float | int) else value


class _Symbolic:
    """Expression trees; conditions become `IfThenElse`, with both branches recorded."""

    def where(self, condition: Real, yes: Real, no: Real) -> Real:
        return symbols.IfThenElse(condition, _as_symbol(yes), _as_symbol(no))

    smooth_where = where

    def piecewise_cubic(self, value: Real, pieces: CubicPieces) -> Real:
        return select_cubic(self, value, pieces)

    def sin(self, value: Real) -> Real:
        return symbols.sin(value)

    def cos(self, value: Real) -> Real:
        return symbols.cos(value)

    def atan2(self, y: Real, x: Real) -> Real:
        return symbols.atan2(y, x)

    def sqrt(self, value: Real) -> Real:
        return symbols.sqrt(value)

    def tanh(self, value: Real) -> Real:
        return symbols.tanh(value)

    def exp(self, value: Real) -> Real:
        return symbols.exp(value)

    def vector(self, parts: Sequence[Real]) -> Vector:
        if all(isinstance(part, float | int) for part in parts):
            return symbols.Vector([float(part) for part in parts])
        return symbols.Vector([_as_symbol(part) for part in parts])

    def part(self, vector: Vector, index: int) -> Real:
        return vector[index]

    def dot(self, one: Vector, other: Vector) -> Real:
        return one * other

    def norm(self, vector: Vector) -> Real:
        return vector.NormL2()

    def scaled(self, factor: Real, vector: Vector) -> Vector:
        return factor * vector


SYMBOLIC: Operations = _Symbolic()
