"""Forces of the capsules of two links on each other.

This code is compiled when segments first touch each other. The law is recorded from its definition;
here it gets its arguments in world axes, and its results act on the links.
"""

from typing import Any

from generator.simulation.compiled.algebra import (
    accumulate,
    apply,
    cross,
    dot,
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
    FLAG,
    NOTHING,
    VECTOR,
    FunctionPointer,
    compile_source,
    compiled,
)
from generator.simulation.compiled.contact_tables import pair_source
from generator.simulation.compiled.layout import (
    FIRST_HALF,
    FIRST_MIDDLE,
    FORCE,
    FRICTION,
    IMPACT,
    MECHANISM,
    MOMENT,
    PAIR_FIRST,
    PAIR_INPUTS,
    PAIR_RANGE,
    PAIR_REACH,
    PAIR_SECOND,
    POINT,
    RADIUS_DIFFERENCE,
    ROTATION,
    SCRATCH,
    SECOND_HALF,
    SECOND_MIDDLE,
    SPIN,
    VELOCITY,
    Mechanism,
    Scratch,
)

_pair: Any = compile_source(pair_source(), "pair", FLAG(COUNT, VECTOR, VECTOR)).function


@compiled(NOTHING, MECHANISM, SCRATCH, pointer=True)
def _apply_pairs(mechanism: Mechanism, scratch: Scratch) -> None:
    """Add the forces of all pairs of capsules to the bias forces of the links."""
    pairs, places, arguments = mechanism.pairs, mechanism.pair_constants, scratch.contact_work
    work, powers = scratch.work, scratch.powers
    for p in range(len(pairs)):
        i, j = pairs[p, PAIR_FIRST], pairs[p, PAIR_SECOND]
        turn, other_turn = matrix(work, i, ROTATION), matrix(work, j, ROTATION)
        arm = apply(turn, vector(places, p, FIRST_MIDDLE))
        other_arm = apply(other_turn, vector(places, p, SECOND_MIDDLE))
        between = minus(plus(vector(work, j, POINT), other_arm), plus(vector(work, i, POINT), arm))
        if dot(between, between) > places[p, PAIR_RANGE] ** 2:
            continue
        spin, other_spin = vector(work, i, SPIN), vector(work, j, SPIN)
        velocity = plus(vector(work, i, VELOCITY), cross(spin, arm))
        other_velocity = plus(vector(work, j, VELOCITY), cross(other_spin, other_arm))
        store_in(arguments, 0, between)
        store_in(arguments, 3, apply(turn, vector(places, p, FIRST_HALF)))
        store_in(arguments, 6, apply(other_turn, vector(places, p, SECOND_HALF)))
        store_in(arguments, 9, minus(other_velocity, velocity))
        store_in(arguments, 12, spin)
        store_in(arguments, 15, other_spin)
        arguments[18], arguments[19] = places[p, PAIR_REACH], places[p, RADIUS_DIFFERENCE]
        if not _pair(0, arguments, mechanism.pair_parameters):
            continue
        force = vector_in(arguments, PAIR_INPUTS)
        moment = minus(vector_in(arguments, PAIR_INPUTS + 3), cross(arm, force))
        other_moment = plus(vector_in(arguments, PAIR_INPUTS + 6), cross(other_arm, force))
        accumulate(work, i, FORCE, force)
        accumulate(work, i, MOMENT, times(-1.0, moment))
        accumulate(work, j, FORCE, times(-1.0, force))
        accumulate(work, j, MOMENT, times(-1.0, other_moment))
        powers[IMPACT] += arguments[PAIR_INPUTS + 9]
        powers[FRICTION] += arguments[PAIR_INPUTS + 10]


APPLY_PAIRS = FunctionPointer(_apply_pairs)
"""Pointer to the function that adds the forces of contact between links."""
