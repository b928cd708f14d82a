"""Positions and velocities of the links, and displacements of the joints with laws."""

from math import atan2, cos, sin, sqrt

from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    apply,
    apply_transposed,
    conjugate,
    cross,
    matrix,
    minus,
    plus,
    product,
    quaternion,
    rotation,
    store,
    times,
    unit,
    vector,
)
from generator.simulation.compiled.compiler import COUNT, NOTHING, REAL, VECTOR, compiled
from generator.simulation.compiled.layout import (
    ARM,
    ARM_IN_PARENT,
    AXIS,
    AXIS_IN_PARENT,
    BALL,
    COORDINATE,
    COSINE_TURN,
    DRIVE,
    EFFORT,
    HINGE,
    JOINT_RATE,
    JOINT_VALUE,
    KIND,
    LOCKED_VALUE,
    MECHANISM,
    ORIENTATION,
    PARENT,
    POINT,
    POINT_BIAS,
    RATE,
    ROTATION,
    ROW_CHILD,
    ROW_LINK,
    ROW_PARENT,
    SCRATCH,
    SINE_TURN,
    SITE_IN_CHILD,
    SITE_IN_PARENT,
    SLIDE,
    SPIN,
    SPIN_BIAS,
    VELOCITY,
    Mechanism,
    Scratch,
)


@compiled(NOTHING, MECHANISM, SCRATCH, COUNT, REAL, VECTOR)
def compute_kinematics(
    mechanism: Mechanism, scratch: Scratch, interval: int, time: float, state: Array
) -> None:
    """Compute orientations, points, velocities and acceleration biases of all links."""
    links, constants = mechanism.links, mechanism.constants
    for i in range(len(links)):
        link, c, w = links[i], constants[i], scratch.work[i]
        parent, kind = link[PARENT], link[KIND]
        if parent >= 0:
            p = scratch.work[parent]
            outer, spin, velocity = quaternion(p, ORIENTATION), vector(p, SPIN), vector(p, VELOCITY)
            arm = apply(matrix(p, ROTATION), vector(c, ARM_IN_PARENT))
            axis = apply(matrix(p, ROTATION), vector(c, AXIS_IN_PARENT))
            point = vector(p, POINT)
        else:
            outer, spin, velocity = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            arm, axis = vector(c, ARM_IN_PARENT), vector(c, AXIS_IN_PARENT)
            point = (0.0, 0.0, 0.0)
        spin_bias, point_bias = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        joint_value, joint_rate = 0.0, 0.0
        if kind == BALL:
            own = unit(quaternion(state, link[COORDINATE]))
            own_spin = vector(state, link[RATE])
        else:
            value, rate, acceleration = float(c[LOCKED_VALUE]), 0.0, 0.0
            if link[DRIVE] >= 0:
                since = time - mechanism.knots[interval]
                cubic: Array = mechanism.drive_pieces[interval, link[DRIVE]]
                value = cubic[0] + since * (cubic[1] + since * (cubic[2] + since * cubic[3]))
                rate = cubic[1] + since * (2.0 * cubic[2] + 3.0 * since * cubic[3])
                acceleration = 2.0 * cubic[2] + 6.0 * since * cubic[3]
            elif link[COORDINATE] >= 0:
                value, rate = float(state[link[COORDINATE]]), float(state[link[RATE]])
            own_spin, joint_value, joint_rate = spin, value, rate
            along = times(rate, axis)
            turn = quaternion(c, COSINE_TURN)
            if kind == HINGE:
                own_spin = plus(spin, along)
                spin_bias = plus(cross(spin, along), times(acceleration, axis))
                h, s = cos(0.5 * value), sin(0.5 * value)
                turn = (
                    h * turn[0] + s * c[SINE_TURN],
                    h * turn[1] + s * c[SINE_TURN + 1],
                    h * turn[2] + s * c[SINE_TURN + 2],
                    h * turn[3] + s * c[SINE_TURN + 3],
                )
            elif kind == SLIDE:
                arm = plus(arm, times(value, axis))
                velocity = plus(velocity, along)
                point_bias = plus(times(2.0, cross(spin, along)), times(acceleration, axis))
            own = product(outer, turn)
        carried = cross(spin, arm)
        store(w, ROTATION, rotation(own))
        store(w, ORIENTATION, own)
        store(w, SPIN, own_spin)
        store(w, ARM, arm)
        store(w, POINT, plus(point, arm))
        store(w, VELOCITY, plus(velocity, carried))
        store(w, AXIS, axis)
        store(w, SPIN_BIAS, spin_bias)
        store(w, POINT_BIAS, plus(point_bias, cross(spin, carried)))
        w[EFFORT] = 0.0
        w[JOINT_VALUE], w[JOINT_RATE] = joint_value, joint_rate


@compiled(NOTHING, MECHANISM, SCRATCH)
def measure_joints(mechanism: Mechanism, scratch: Scratch) -> None:
    """Compute the displacements and rates of the joints with laws.

    For several rotations: the rotation vector, and the angular velocity in the half-way frame. Up
    to 180 deg, half the angle has a positive cosine; beyond, the sign of the quaternion is held.
    """
    branches, switching = mechanism.branches, scratch.switching
    first = len(branches) - len(mechanism.measured)
    for j in range(len(mechanism.measured)):
        row, sites = mechanism.measured[j], mechanism.sites[j]
        if row[ROW_LINK] >= 0:
            w = scratch.work[row[ROW_LINK]]
            scratch.displacements[j, 0] = w[JOINT_VALUE]
            scratch.rates[j, 0] = w[JOINT_RATE]
            switching[first + j] = branches[first + j]
            continue
        outer, spin = quaternion(sites, SITE_IN_PARENT), (0.0, 0.0, 0.0)
        inner, own_spin = quaternion(sites, SITE_IN_CHILD), (0.0, 0.0, 0.0)
        if row[ROW_PARENT] >= 0:
            w = scratch.work[row[ROW_PARENT]]
            outer, spin = product(quaternion(w, ORIENTATION), outer), vector(w, SPIN)
        if row[ROW_CHILD] >= 0:
            w = scratch.work[row[ROW_CHILD]]
            inner, own_spin = product(quaternion(w, ORIENTATION), inner), vector(w, SPIN)
        cosine, x, y, z = product(conjugate(outer), inner)
        switching[first + j] = cosine
        sign = branches[first + j]
        cosine, x, y, z = sign * cosine, sign * x, sign * y, sign * z
        square = x * x + y * y + z * z
        if square > 1e-8:
            sine = sqrt(square)
            ratio = 2.0 * atan2(sine, cosine) / sine
        else:
            ratio = 2.0 + square / 3.0
        store(scratch.displacements[j], 0, (ratio * x, ratio * y, ratio * z))
        # Half of the turn by (cosine, sine) is that by (1 + cosine, sine), scaled.
        half_way = rotation(product(outer, unit((1.0 + cosine, x, y, z))))
        store(scratch.half_way[j], 0, half_way)
        store(scratch.rates[j], 0, apply_transposed(half_way, minus(own_spin, spin)))
