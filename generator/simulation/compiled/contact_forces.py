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
    dot,
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
    REAL,
    VECTOR,
    FunctionPointer,
    compile_source,
    compiled,
    inlined,
)
from generator.simulation.compiled.contact_tables import contact_source, stage_source
from generator.simulation.compiled.flight import distance_below
from generator.simulation.compiled.layout import (
    CENTRE,
    CONTACT_BEND,
    CONTACT_DAMPING,
    CONTACT_DEPTH,
    CONTACT_FRICTION,
    CONTACT_INPUTS,
    CONTACT_NORMAL,
    CONTACT_RATE,
    CONTACT_STIFFNESS,
    FORCE,
    FRICTION,
    GROUP_END,
    GROUP_FIRST,
    GROUP_LINK,
    IMPACT,
    MASS,
    MECHANISM,
    MOMENT,
    PART_DAMPING,
    PART_FIRST_STAGE,
    PART_FORCE,
    PART_LARGEST,
    PART_NORM_SCALE,
    PART_RATES,
    PART_SCALE,
    PART_SLOPE,
    PART_STAGES,
    PART_SUM,
    PART_SUM_COLUMNS,
    PART_WEIGHTS,
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
    TOUCH_BEND,
    TOUCH_DAMPING,
    TOUCH_DEEPEST,
    TOUCH_DEPTH,
    TOUCH_FORCE,
    TOUCH_FRICTION,
    TOUCH_FRICTION_POWER,
    TOUCH_GROUP,
    TOUCH_IMPACT,
    TOUCH_MOMENT,
    TOUCH_NORMAL,
    TOUCH_PROP,
    TOUCH_RATE,
    TOUCH_SPHERE,
    TOUCH_STIFFNESS,
    VELOCITY,
    Mechanism,
    Scratch,
)
from springs.contact_part import NORM

_CONTACT = types.void(COUNT, COUNT, VECTOR, VECTOR)
_contact: Any = compile_source(contact_source(), "contact", _CONTACT).function
_depth: Any = compile_source(
    contact_source([CONTACT_DEPTH, CONTACT_RATE]), "contact", _CONTACT
).function

_stage: Any = compile_source(stage_source(), "stage", types.void(REAL, REAL, REAL, VECTOR)).function


@inlined
def _one_power_less(share: float) -> float:
    """Return the power p - 1 of a share of a depth; p is `NORM`."""
    square = share * share
    fourth = square * square
    return fourth * fourth * square * share


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


@inlined
def _evaluate_part(mechanism: Mechanism, scratch: Scratch, part: int, d: int) -> None:
    """Evaluate the elastic force of a part of the body in a prop; see `PART_SCALE`."""
    sums, table, at = scratch.part_sums, mechanism.part_parameters, mechanism.part_offsets[part, d]
    root = float(sums[part, d, PART_SUM]) ** (1.0 / NORM)
    sums[part, d, PART_SCALE] = table[at + PART_NORM_SCALE] / _one_power_less(root)
    root *= table[at + PART_NORM_SCALE]
    force, slope = 0.0, 0.0
    for stage in range(int(table[at + PART_STAGES])):
        place = at + PART_FIRST_STAGE + 3 * stage
        depth = sums[part, d, PART_LARGEST] * root - table[place]
        _stage(depth, table[place + 1], table[place + 2], scratch.contact_work)
        force += scratch.contact_work[0]
        slope += scratch.contact_work[1]
    sums[part, d, PART_FORCE], sums[part, d, PART_SLOPE] = force, slope


@compiled(NOTHING, MECHANISM, SCRATCH, COUNT)
def _share_forces(mechanism: Mechanism, scratch: Scratch, count: int) -> None:
    """Give the spheres of a part their shares of its force; see `springs.contact_part`.

    Until then a sphere has a force that is proportional to its own, without impact damping.
    """
    touches, where, sums = scratch.touches, scratch.touch_places, scratch.part_sums
    table, parts = mechanism.part_parameters, mechanism.sphere_parts
    for t in range(count):
        for layer in range(2):
            part, d = parts[where[t, TOUCH_SPHERE], layer], where[t, TOUCH_PROP]
            for k in range(PART_SUM_COLUMNS if part >= 0 else 0):
                sums[part, d, k] = 0.0
    for t in range(count):
        for layer in range(2):
            part, d = parts[where[t, TOUCH_SPHERE], layer], where[t, TOUCH_PROP]
            if part >= 0:
                deepest = max(sums[part, d, PART_LARGEST], touches[t, TOUCH_DEPTH])
                sums[part, d, PART_LARGEST] = deepest
    for t in range(count):
        for layer in range(2):
            part, d = parts[where[t, TOUCH_SPHERE], layer], where[t, TOUCH_PROP]
            if part >= 0 and sums[part, d, PART_LARGEST] > 0.0:
                share = max(touches[t, TOUCH_DEPTH], 0.0) / sums[part, d, PART_LARGEST]
                weight = _one_power_less(share)
                sums[part, d, PART_SUM] += weight * share
                sums[part, d, PART_RATES] += weight * touches[t, TOUCH_RATE]
                sums[part, d, PART_WEIGHTS] += weight
    for t in range(count):
        normal, elastic, stiffness, damping = 0.0, 0.0, 0.0, 0.0
        for layer in range(2):
            part, d = parts[where[t, TOUCH_SPHERE], layer], where[t, TOUCH_PROP]
            if part < 0 or sums[part, d, PART_LARGEST] <= 0.0:
                continue
            if sums[part, d, PART_SCALE] == 0.0:
                _evaluate_part(mechanism, scratch, part, d)
            scale, largest = sums[part, d, PART_SCALE], sums[part, d, PART_LARGEST]
            weight = scale * _one_power_less(max(touches[t, TOUCH_DEPTH], 0.0) / largest)
            force = weight * sums[part, d, PART_FORCE]
            lost = table[mechanism.part_offsets[part, d] + PART_DAMPING]
            impact = 1.0 + lost * scale * sums[part, d, PART_RATES]
            elastic += force
            others = scale * sums[part, d, PART_WEIGHTS]
            if impact > 0.0:
                normal += force * impact
                stiffness += sums[part, d, PART_SLOPE] * impact * weight * others
                damping += force * lost * others
        own = dot(vector(touches, t, TOUCH_FORCE), vector(touches, t, TOUCH_NORMAL))
        factor = normal / own if own > 0.0 else 0.0
        touches[t, TOUCH_IMPACT] = (normal - elastic) * touches[t, TOUCH_RATE]
        touches[t, TOUCH_FRICTION_POWER] *= factor
        touches[t, TOUCH_STIFFNESS], touches[t, TOUCH_DAMPING] = stiffness, damping
        touches[t, TOUCH_FRICTION] *= factor
        touches[t, TOUCH_BEND] *= factor
        for k in range(3):
            touches[t, TOUCH_FORCE + k] *= factor
            touches[t, TOUCH_MOMENT + k] *= factor


@compiled(COUNT, MECHANISM, SCRATCH)
def find_touches(mechanism: Mechanism, scratch: Scratch) -> int:
    """Evaluate the forces of all props on all spheres that touch them; return their number.

    They are left in `Scratch.touches`, in the order of groups; the place after them has no group.
    """
    groups, places, props = (
        mechanism.sphere_groups,
        mechanism.sphere_constants,
        mechanism.prop_constants,
    )
    work, arguments, touches = scratch.work, scratch.contact_work, scratch.touches
    count = 0
    for g in range(len(groups)):
        i, reach = groups[g, GROUP_LINK], mechanism.sphere_reaches[g]
        turn, point = matrix(work, i, ROTATION), vector(work, i, POINT)
        for d in range(len(props)):
            axes = matrix(props, d, PROP_AXES)
            origin = apply_transposed(axes, minus(point, vector(props, d, PROP_ORIGIN)))
            if distance_below(props, d, origin) > reach:
                continue
            for s in range(groups[g, GROUP_FIRST], groups[g, GROUP_END]):
                radius = float(places[s, SPHERE_RADIUS])
                arm = apply(turn, vector(places, s, SPHERE_CENTRE))
                place = plus(origin, apply_transposed(axes, arm))
                if distance_below(props, d, place) >= radius:
                    continue
                spin = vector(work, i, SPIN)
                velocity = plus(vector(work, i, VELOCITY), cross(spin, arm))
                touch(mechanism, scratch, s, d, place, axes, velocity, spin)
                force = apply(axes, vector_in(arguments, CONTACT_INPUTS))
                moment = apply(axes, vector_in(arguments, CONTACT_INPUTS + 3))
                normal = apply(axes, vector_in(arguments, CONTACT_NORMAL))
                store(touches, count, TOUCH_FORCE, force)
                store(touches, count, TOUCH_MOMENT, plus(cross(arm, force), moment))
                store(touches, count, TOUCH_NORMAL, normal)
                store(touches, count, TOUCH_DEEPEST, minus(arm, times(radius, normal)))
                touches[count, TOUCH_IMPACT] = arguments[CONTACT_INPUTS + 6]
                touches[count, TOUCH_FRICTION_POWER] = arguments[CONTACT_INPUTS + 7]
                touches[count, TOUCH_DEPTH] = arguments[CONTACT_DEPTH]
                touches[count, TOUCH_RATE] = arguments[CONTACT_RATE]
                touches[count, TOUCH_STIFFNESS] = arguments[CONTACT_STIFFNESS]
                touches[count, TOUCH_DAMPING] = arguments[CONTACT_DAMPING]
                touches[count, TOUCH_FRICTION] = arguments[CONTACT_FRICTION]
                touches[count, TOUCH_BEND] = arguments[CONTACT_BEND]
                scratch.touch_places[count, TOUCH_GROUP] = g
                scratch.touch_places[count, TOUCH_SPHERE] = s
                scratch.touch_places[count, TOUCH_PROP] = d
                count += 1
    scratch.touch_places[count, TOUCH_GROUP] = -1
    if len(mechanism.sphere_parts) > 0:
        _share_forces(mechanism, scratch, count)
    return count


@compiled(NOTHING, MECHANISM, SCRATCH, pointer=True)
def apply_contacts(mechanism: Mechanism, scratch: Scratch) -> None:
    """Add the forces of all props on all spheres to the bias forces of the links."""
    groups, touches, work = mechanism.sphere_groups, scratch.touches, scratch.work
    count, t = find_touches(mechanism, scratch), 0
    for g in range(len(groups)):
        total, moments = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        while t < count and scratch.touch_places[t, TOUCH_GROUP] == g:
            total = plus(total, vector(touches, t, TOUCH_FORCE))
            moments = plus(moments, vector(touches, t, TOUCH_MOMENT))
            scratch.powers[IMPACT] += touches[t, TOUCH_IMPACT]
            scratch.powers[FRICTION] += touches[t, TOUCH_FRICTION_POWER]
            t += 1
        i = groups[g, GROUP_LINK]
        accumulate(work, i, FORCE, times(-1.0, total))
        accumulate(work, i, MOMENT, times(-1.0, moments))
        store(scratch.contact_forces, g, 0, total)


_NEAR = 0.1
"""Distance from a prop within which the depth of a sphere is recorded exactly [m]: no sphere passes
it in a step, of 5 ms at most, at less than 20 m/s."""


@compiled(NOTHING, MECHANISM, SCRATCH, VECTOR, COUNT)
def _record_parts(mechanism: Mechanism, scratch: Scratch, row: Array, at: int) -> None:
    """Write the forces on parts and their regions, of the touches that were found last."""
    parts, where = mechanism.sphere_parts, scratch.touch_places
    for k in range(at, len(row)):
        row[k] = 0.0
    t = 0
    while len(parts) > 0 and where[t, TOUCH_GROUP] >= 0:
        for layer in range(2):
            part = parts[where[t, TOUCH_SPHERE], layer]
            for k in range(3 if part >= 0 else 0):
                row[at + 3 * part + k] += scratch.touches[t, TOUCH_FORCE + k]
        t += 1


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
                store_in(arguments, 0, plus(origin, apply_transposed(axes, arm)))
                store_in(arguments, 3, apply_transposed(axes, velocity))
                offset = mechanism.contact_offsets[s, d]
                _depth(mechanism.props[d, 0], offset, arguments, mechanism.contact_parameters)
                depth, rate = arguments[CONTACT_DEPTH], arguments[CONTACT_RATE]
                if depth > row[at + 2 * s]:
                    row[at + 2 * s], row[at + 2 * s + 1] = depth, rate
    _record_parts(mechanism, scratch, row, at + 2 * len(places))


RECORD_STEP = FunctionPointer(_record_step)
"""Pointer to the function that writes the record of a step."""

APPLY_CONTACTS = FunctionPointer(apply_contacts)
"""Pointer to the function that adds the forces of contact."""
