"""Forces of props on the contact spheres of the links.

This code is compiled when a figure first has props. The law of contact is recorded from its
definition; here it gets its arguments in the axes of a prop, and its results act on the links.
"""

from math import inf
from typing import Any

from numba import types

from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    Matrix,
    Vector,
    accumulate,
    apply,
    apply_transposed,
    cross,
    matrix,
    minus,
    plus,
    store,
    store_in,
    times,
    vector,
    vector_in,
)
from generator.simulation.compiled.compiler import (
    COUNT,
    NOTHING,
    VECTOR,
    FunctionPointer,
    compile_source,
    compiled,
    inlined,
)
from generator.simulation.compiled.contact_tables import contact_source
from generator.simulation.compiled.flight import distance_below
from generator.simulation.compiled.layout import (
    CENTRE,
    CONTACT_DEPTH,
    CONTACT_INPUTS,
    CONTACT_RATE,
    FORCE,
    FRICTION,
    GROUP_END,
    GROUP_FIRST,
    GROUP_LINK,
    IMPACT,
    MASS,
    MECHANISM,
    MOMENT,
    POINT,
    POINT_ACCELERATION,
    PROP_AXES,
    PROP_ORIGIN,
    ROTATION,
    SCRATCH,
    SPHERE_CENTRE,
    SPHERE_RADIUS,
    SPIN,
    SPIN_RATE,
    STEP_ACCELERATIONS,
    STEP_CENTRE,
    VELOCITY,
    Mechanism,
    Scratch,
)

_contact: Any = compile_source(
    contact_source(), "contact", types.void(COUNT, COUNT, VECTOR, VECTOR)
).function


@inlined
def touch(
    mechanism: Mechanism,
    scratch: Scratch,
    s: int,
    d: int,
    place: Vector,
    axes: Matrix,
    velocity: Vector,
    spin: Vector,
) -> None:
    """Evaluate the law of contact of a sphere and a prop; see `Scratch.contact_work`."""
    arguments = scratch.contact_work
    store_in(arguments, 0, place)
    store_in(arguments, 3, apply_transposed(axes, velocity))
    store_in(arguments, 6, apply_transposed(axes, spin))
    _contact(
        mechanism.props[d, 0],
        mechanism.contact_offsets[s, d],
        arguments,
        mechanism.contact_parameters,
    )


@compiled(NOTHING, MECHANISM, SCRATCH, pointer=True)
def apply_contacts(mechanism: Mechanism, scratch: Scratch) -> None:
    """Add the forces of all props on all spheres to the bias forces of the links."""
    groups, places, props = (
        mechanism.sphere_groups,
        mechanism.sphere_constants,
        mechanism.prop_constants,
    )
    work, arguments, forces = scratch.work, scratch.contact_work, scratch.contact_forces
    powers = scratch.powers
    for g in range(len(groups)):
        i, reach = groups[g, GROUP_LINK], mechanism.sphere_reaches[g]
        total, moments = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        turn, point = matrix(work, i, ROTATION), vector(work, i, POINT)
        for d in range(len(props)):
            axes = matrix(props, d, PROP_AXES)
            origin = apply_transposed(axes, minus(point, vector(props, d, PROP_ORIGIN)))
            if distance_below(props, d, origin) > reach:
                continue
            for s in range(groups[g, GROUP_FIRST], groups[g, GROUP_END]):
                arm = apply(turn, vector(places, s, SPHERE_CENTRE))
                place = plus(origin, apply_transposed(axes, arm))
                if distance_below(props, d, place) >= places[s, SPHERE_RADIUS]:
                    continue
                spin = vector(work, i, SPIN)
                velocity = plus(vector(work, i, VELOCITY), cross(spin, arm))
                touch(mechanism, scratch, s, d, place, axes, velocity, spin)
                force = apply(axes, vector_in(arguments, CONTACT_INPUTS))
                moment = apply(axes, vector_in(arguments, CONTACT_INPUTS + 3))
                total = plus(total, force)
                moments = plus(moments, plus(cross(arm, force), moment))
                powers[IMPACT] += arguments[CONTACT_INPUTS + 6]
                powers[FRICTION] += arguments[CONTACT_INPUTS + 7]
        accumulate(work, i, FORCE, times(-1.0, total))
        accumulate(work, i, MOMENT, times(-1.0, moments))
        store(forces, g, 0, total)


_NEAR = 0.1
"""Distance from a prop within which the depth of a sphere is recorded exactly [m]: no sphere passes
it in a step, of 5 ms at most, at less than 20 m/s."""


@compiled(NOTHING, MECHANISM, SCRATCH, VECTOR, pointer=True)
def _record_step(mechanism: Mechanism, scratch: Scratch, row: Array) -> None:
    """Write the record of a step, of the state that was evaluated last; see `STEP_CENTRE`."""
    links, constants, work = mechanism.links, mechanism.constants, scratch.work
    gravity, centre, total = vector_in(mechanism.gravity, 0), (0.0, 0.0, 0.0), 0.0
    for i in range(len(links)):
        arm = apply(matrix(work, i, ROTATION), vector(constants, i, CENTRE))
        spin, spin_rate = vector(work, i, SPIN), vector(work, i, SPIN_RATE)
        around = plus(cross(spin_rate, arm), cross(spin, cross(spin, arm)))
        acceleration = plus(plus(vector(work, i, POINT_ACCELERATION), gravity), around)
        store_in(row, STEP_ACCELERATIONS + 3 * i, acceleration)
        mass = constants[i, MASS]
        centre = plus(centre, times(mass, plus(vector(work, i, POINT), arm)))
        total += mass
    store_in(row, STEP_CENTRE, times(1.0 / total, centre))
    groups, places, props = (
        mechanism.sphere_groups,
        mechanism.sphere_constants,
        mechanism.prop_constants,
    )
    arguments, at = scratch.contact_work, STEP_ACCELERATIONS + 3 * len(links)
    for g in range(len(groups)):
        store_in(row, at + 3 * g, vector(scratch.contact_forces, g, 0))
    at += 3 * len(groups)
    for g in range(len(groups)):
        i = groups[g, GROUP_LINK]
        turn, point = matrix(work, i, ROTATION), vector(work, i, POINT)
        spin = vector(work, i, SPIN)
        for s in range(groups[g, GROUP_FIRST], groups[g, GROUP_END]):
            row[at + 2 * s], row[at + 2 * s + 1] = -inf, 0.0
        for d in range(len(props)):
            axes = matrix(props, d, PROP_AXES)
            origin = apply_transposed(axes, minus(point, vector(props, d, PROP_ORIGIN)))
            is_far = distance_below(props, d, origin) > mechanism.sphere_reaches[g] + _NEAR
            for s in range(groups[g, GROUP_FIRST], groups[g, GROUP_END]):
                if is_far:
                    row[at + 2 * s] = max(row[at + 2 * s], -_NEAR)
                    continue
                arm = apply(turn, vector(places, s, SPHERE_CENTRE))
                velocity = plus(vector(work, i, VELOCITY), cross(spin, arm))
                place = plus(origin, apply_transposed(axes, arm))
                touch(mechanism, scratch, s, d, place, axes, velocity, spin)
                depth, rate = arguments[CONTACT_DEPTH], arguments[CONTACT_RATE]
                if depth > row[at + 2 * s]:
                    row[at + 2 * s], row[at + 2 * s + 1] = depth, rate


RECORD_STEP = FunctionPointer(_record_step)
"""Pointer to the function that writes the record of a step."""

APPLY_CONTACTS = FunctionPointer(apply_contacts)
"""Pointer to the function that adds the forces of contact."""
