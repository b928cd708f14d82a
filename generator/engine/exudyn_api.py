"""Exudyn as this project sees it: the one file where its untyped surface is cast.

Importing it takes about a second. Exudyn talks to the console and knows only global switches for
that; they are set here, once.
"""

from typing import Any, cast

import exudyn
from exudyn import advancedUtilities, itemInterface, rigidBodyUtilities

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
    """Set the times between which a system is integrated [s]; they may be negative.

    Exudyn refuses negative ones, though nothing in it depends on that: its check is held back.
    """
    checks = exu.special.exceptions
    before, checks.parameterRangeChecks = checks.parameterRangeChecks, False
    integration.startTime, integration.endTime = start, stop
    checks.parameterRangeChecks = before


def unused_name(mbs: MainSystem, name: str) -> str:
    """The name, numbered where the system has an object or a node of that name already.

    Exudyn refuses a second one, but a joint may be called like a segment, and a system may hold
    one figure twice.
    """
    number, tried = 1, name
    while max(int(mbs.GetObjectNumber(tried)), int(mbs.GetNodeNumber(tried))) >= 0:
        number += 1
        tried = f"{name} {number}"
    return tried
