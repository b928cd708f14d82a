"""Forces of props on the contact spheres of the links.

This code is compiled when a figure first has props. The law of contact is recorded from its
definition; here it gets its arguments in the axes of a prop, and its results act on the links.
"""

from math import inf
from typing import Any

from numba import types

from generator.simulation.compiled.algebra import (
    accumulate,
    apply,
    apply_transposed,
    cross,
    matrix,
    minus,
    plus,
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
)
from generator.simulation.compiled.contact_tables import contact_source
from generator.simulation.compiled.layout import (
    CONTACT_INPUTS,
    CONTACT_SWITCHES,
    FORCE,
    FRICTION,
    IMPACT,
    MECHANISM,
    MOMENT,
    POINT,
    PROP_AXES,
    PROP_LARGEST,
    PROP_LEAST,
    PROP_ORIGIN,
    ROTATION,
    SCRATCH,
    SPHERE_CENTRE,
    SPHERE_LINK,
    SPHERE_RADIUS,
    SPHERE_SEGMENT,
    SPIN,
    VELOCITY,
    Mechanism,
    Scratch,
)

_contact: Any = compile_source(
    contact_source(), "contact", types.void(COUNT, COUNT, COUNT, VECTOR, VECTOR, VECTOR, VECTOR)
).function


@compiled(NOTHING, MECHANISM, SCRATCH, pointer=True)
def apply_contacts(mechanism: Mechanism, scratch: Scratch) -> None:
    """Add the forces of all props on all spheres to the bias forces of the links."""
    spheres, places = mechanism.spheres, mechanism.sphere_constants
    props, work, arguments = mechanism.prop_constants, scratch.work, scratch.contact_work
    forces, powers, switching = scratch.contact_forces, scratch.powers, scratch.switching
    switch = len(switching) - len(mechanism.measured)
    switch -= CONTACT_SWITCHES * (len(spheres) * len(props) + len(mechanism.pairs))
    for g in range(len(forces)):
        for k in range(3):
            forces[g, k] = 0.0
    for s in range(len(spheres)):
        i, radius = spheres[s, SPHERE_LINK], places[s, SPHERE_RADIUS]
        arm = apply(matrix(work, i, ROTATION), vector(places, s, SPHERE_CENTRE))
        centre = plus(vector(work, i, POINT), arm)
        for d in range(len(props)):
            turn = matrix(props, d, PROP_AXES)
            place = apply_transposed(turn, minus(centre, vector(props, d, PROP_ORIGIN)))
            beyond = -inf
            for k in range(3):
                beyond = max(beyond, place[k] - float(props[d, PROP_LARGEST + k]))
                beyond = max(beyond, float(props[d, PROP_LEAST + k]) - place[k])
            depth = radius - beyond
            if depth < -radius:
                # Far away; the switching functions need no accuracy.
                for k in range(CONTACT_SWITCHES):
                    switching[switch + k] = depth
                switch += CONTACT_SWITCHES
                continue
            spin = vector(work, i, SPIN)
            velocity = plus(vector(work, i, VELOCITY), cross(spin, arm))
            store_in(arguments, 0, place)
            store_in(arguments, 3, apply_transposed(turn, velocity))
            store_in(arguments, 6, apply_transposed(turn, spin))
            _contact(
                mechanism.props[d, 0],
                mechanism.contact_offsets[s, d],
                switch,
                arguments,
                mechanism.contact_parameters,
                mechanism.branches,
                switching,
            )
            switch += CONTACT_SWITCHES
            force = apply(turn, vector_in(arguments, CONTACT_INPUTS))
            moment = plus(cross(arm, force), apply(turn, vector_in(arguments, CONTACT_INPUTS + 3)))
            accumulate(work, i, FORCE, times(-1.0, force))
            accumulate(work, i, MOMENT, times(-1.0, moment))
            accumulate(forces, spheres[s, SPHERE_SEGMENT], 0, force)
            powers[IMPACT] += arguments[CONTACT_INPUTS + 6]
            powers[FRICTION] += arguments[CONTACT_INPUTS + 7]


APPLY_CONTACTS = FunctionPointer(apply_contacts)
"""Pointer to the function that adds the forces of contact."""
