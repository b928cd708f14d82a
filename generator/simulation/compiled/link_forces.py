"""Inertia of each single link, and the torques and forces of laws and loads on it."""

from generator.simulation.compiled.algebra import (
    accumulate,
    apply,
    apply_symmetric,
    cross,
    dot,
    matrix,
    plus,
    rotated_diagonal,
    store,
    times,
    vector,
)
from generator.simulation.compiled.compiler import (
    COUNT,
    NOTHING,
    REAL,
    compiled,
)
from generator.simulation.compiled.layout import (
    ACTIVATION,
    ANGULAR_INERTIA,
    CENTRE,
    COUPLING_INERTIA,
    EFFORT,
    EXTERNAL,
    FORCE,
    INERTIA,
    LINEAR_INERTIA,
    LOAD_IS_FORCE,
    LOAD_IS_LOCAL,
    LOAD_LINK,
    MASS,
    MEASURED_CHILD,
    MEASURED_FORM,
    MEASURED_LINK,
    MEASURED_PARENT,
    MECHANISM,
    MOMENT,
    RIGHTING,
    ROTATION,
    SCRATCH,
    SHIFT,
    SPIN,
    TONE,
    VELOCITY,
    Mechanism,
    Scratch,
)


@compiled(NOTHING, MECHANISM, SCRATCH, COUNT, REAL, merged=True)
def compute_inertia_and_loads(
    mechanism: Mechanism, scratch: Scratch, interval: int, time: float
) -> None:
    """Start each link's articulated inertia with its own, and add all but contacts to its bias."""
    constants, measured, work = mechanism.constants, mechanism.measured, scratch.work
    for i in range(len(mechanism.links)):
        mass, turn, spin = constants[i, MASS], matrix(work, i, ROTATION), vector(work, i, SPIN)
        x, y, z = apply(turn, vector(constants, i, CENTRE))
        own = rotated_diagonal(turn, vector(constants, i, INERTIA))
        inertia = (
            own[0] + mass * (y * y + z * z),
            own[1] - mass * x * y,
            own[2] - mass * x * z,
            own[3] + mass * (x * x + z * z),
            own[4] - mass * y * z,
            own[5] + mass * (x * x + y * y),
        )
        store(work, i, ANGULAR_INERTIA, inertia)
        mx, my, mz = mass * x, mass * y, mass * z
        store(work, i, COUPLING_INERTIA, (0.0, -mz, my, mz, 0.0, -mx, -my, mx, 0.0))
        store(work, i, LINEAR_INERTIA, (mass, 0.0, 0.0, mass, 0.0, mass))
        accumulate(work, i, MOMENT, cross(spin, apply_symmetric(inertia, spin)))
        accumulate(work, i, FORCE, cross(spin, cross(spin, (mx, my, mz))))
    for j in range(len(measured)):
        parent, child = measured[j, MEASURED_PARENT], measured[j, MEASURED_CHILD]
        if measured[j, MEASURED_LINK] >= 0:
            work[measured[j, MEASURED_LINK], EFFORT] += scratch.torques[j, 0]
            continue
        if measured[j, MEASURED_FORM] == ACTIVATION:
            continue
        if measured[j, MEASURED_FORM] == SHIFT:
            force = times(scratch.torques[j, 0], vector(scratch.torque_axes, j, 0))
            if parent >= 0:
                accumulate(work, parent, FORCE, force)
                moment = cross(vector(scratch.torque_axes, j, 3), force)
                accumulate(work, parent, MOMENT, moment)
            if child >= 0:
                accumulate(work, child, FORCE, times(-1.0, force))
                moment = cross(vector(scratch.torque_axes, j, 6), force)
                accumulate(work, child, MOMENT, times(-1.0, moment))
            continue
        torque = apply(matrix(scratch.torque_axes, j, 0), vector(scratch.torques, j, 0))
        if measured[j, MEASURED_FORM] == RIGHTING:  # of which the law does not know the rate
            power = dot(torque, vector(work, child, SPIN))
            if parent >= 0:
                power -= dot(torque, vector(work, parent, SPIN))
            scratch.powers[TONE] += power
        if parent >= 0:
            accumulate(work, parent, MOMENT, torque)
        if child >= 0:
            accumulate(work, child, MOMENT, times(-1.0, torque))
    loads, pieces = mechanism.loads, mechanism.load_pieces
    since = time - mechanism.knots[interval]
    for k in range(len(loads)):
        i = loads[k, LOAD_LINK]
        turn = matrix(work, i, ROTATION)
        acting = (
            pieces[interval, k, 0] + since * pieces[interval, k, 3],
            pieces[interval, k, 1] + since * pieces[interval, k, 4],
            pieces[interval, k, 2] + since * pieces[interval, k, 5],
        )
        if loads[k, LOAD_IS_LOCAL]:
            acting = apply(turn, acting)
        if loads[k, LOAD_IS_FORCE]:
            arm = apply(turn, vector(mechanism.load_points, k, 0))
            accumulate(work, i, FORCE, times(-1.0, acting))
            accumulate(work, i, MOMENT, times(-1.0, cross(arm, acting)))
            speed = plus(vector(work, i, VELOCITY), cross(vector(work, i, SPIN), arm))
            scratch.powers[EXTERNAL] += dot(acting, speed)
        else:
            accumulate(work, i, MOMENT, times(-1.0, acting))
            scratch.powers[EXTERNAL] += dot(acting, vector(work, i, SPIN))
