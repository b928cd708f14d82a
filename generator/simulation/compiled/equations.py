"""Pointers to the functions that an integration calls, which depend on the mechanism."""

from typing import Annotated, Any, NamedTuple

from numba import types

from generator.rotations import Array
from generator.simulation.compiled.compiler import (
    COUNT,
    FLAG,
    NOTHING,
    REAL,
    VECTOR,
    FunctionPointer,
    compiled,
    compiled_type,
)
from generator.simulation.compiled.layout import (
    LAWS,
    MECHANISM,
    SCRATCH,
    Laws,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.recursion import compute_rates, evaluate_laws

_STATE_ARGUMENTS = (LAWS, MECHANISM, SCRATCH, COUNT, REAL, VECTOR)


class Equations(NamedTuple):
    """Pointers to the functions that an integration calls.

    Attributes:
        laws: laws of the joints and of contact.
        evaluate_laws: computes the motion of a state and the laws.
        compute_rates: computes the rates of a state.
        project: projects a state onto the constraints beyond the tree; returns whether it can.
    """

    laws: Annotated[Laws, LAWS]
    evaluate_laws: Annotated[Any, types.FunctionType(NOTHING(*_STATE_ARGUMENTS))]
    compute_rates: Annotated[Any, types.FunctionType(NOTHING(*_STATE_ARGUMENTS, VECTOR))]
    project: Annotated[Any, types.FunctionType(FLAG(*_STATE_ARGUMENTS, VECTOR))]


EQUATIONS = compiled_type(Equations)


@compiled(FLAG, *_STATE_ARGUMENTS, VECTOR, pointer=True)
def _keep_state(
    laws: Laws,
    mechanism: Mechanism,
    scratch: Scratch,
    interval: int,
    time: float,
    state: Array,
    rates: Array,
) -> bool:
    """Leave the state of a tree without constraints beyond it, where any state is valid."""
    return True


@compiled(NOTHING, MECHANISM, SCRATCH, pointer=True)
def _touch_nothing(mechanism: Mechanism, scratch: Scratch) -> None:
    """Leave the forces of a figure without props."""


@compiled(NOTHING, MECHANISM, SCRATCH, VECTOR, pointer=True)
def _record_nothing(mechanism: Mechanism, scratch: Scratch, row: Array) -> None:
    """Leave the record of a figure without props empty."""


EVALUATE_LAWS = FunctionPointer(evaluate_laws)
TREE_RATES, KEEP_STATE = FunctionPointer(compute_rates), FunctionPointer(_keep_state)
TOUCH_NOTHING = FunctionPointer(_touch_nothing)
RECORD_NOTHING = FunctionPointer(_record_nothing)
