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
    CompiledLaw,
    Laws,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.recursion import compute_rates, evaluate_laws

_STATE_ARGUMENTS = (LAWS, MECHANISM, SCRATCH, COUNT, REAL, VECTOR)


class Equations(NamedTuple):
    """Pointers to the functions that an integration calls.

    Attributes:
        laws: of the joints and of contact.
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


_EVALUATE_LAWS = FunctionPointer(evaluate_laws)
_TREE_RATES, _KEEP_STATE = FunctionPointer(compute_rates), FunctionPointer(_keep_state)
_TOUCH_NOTHING = FunctionPointer(_touch_nothing)


def equations_with(law: CompiledLaw, mechanism: Mechanism) -> Equations:
    """Return the equations of motion of a mechanism with the laws of its joints.

    With rows of constraints beyond the tree, with contacts, or with contacts between links, the
    functions for these are compiled as well.
    """
    contacts = _TOUCH_NOTHING
    if len(mechanism.spheres) > 0:
        from generator.simulation.compiled.contact_forces import APPLY_CONTACTS

        contacts = APPLY_CONTACTS
    if len(mechanism.pairs) > 0:
        from generator.simulation.compiled.self_contact_forces import APPLY_ALL_CONTACTS

        contacts = APPLY_ALL_CONTACTS
    laws = Laws(law, contacts)
    if len(mechanism.rows) == 0:
        return Equations(laws, _EVALUATE_LAWS, _TREE_RATES, _KEEP_STATE)
    from generator.simulation.compiled.projection import (
        compute_constrained_rates,
        project_state,
    )

    constrained = FunctionPointer(compute_constrained_rates), FunctionPointer(project_state)
    return Equations(laws, _EVALUATE_LAWS, *constrained)
