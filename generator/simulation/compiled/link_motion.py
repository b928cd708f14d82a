"""Positions and velocities of the links, and displacements of the joints with laws."""

from math import atan2, cos, floor, pi, sin, sqrt

from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    Quaternion,
    Vector,
    apply,
    apply_transposed,
    conjugate,
    cross,
    dot,
    matrix,
    minus,
    plus,
    product,
    quaternion,
    quaternion_in,
    rotation,
    store,
    times,
    unit,
    vector,
    vector_in,
)
from generator.simulation.compiled.compiler import (
    COUNT,
    FLAG,
    MATRIX,
    NOTHING,
    QUADRUPLE,
    REAL,
    TRIPLE,
    VECTOR,
    compiled,
)
from generator.simulation.compiled.layout import (
    ACTIVATION,
    ANGLE,
    ARM,
    ARM_IN_PARENT,
    AXIS,
    AXIS_IN_PARENT,
    BALL,
    COORDINATE,
    COSINE_TURN,
    DRIVE,
    EFFORT,
    FORCE,
    HANDEDNESS,
    HINGE,
    JOINT_RATE,
    JOINT_VALUE,
    KIND,
    LOCKED_VALUE,
    MEASURED_ANGLE,
    MEASURED_CHILD,
    MEASURED_FORM,
    MEASURED_LINK,
    MEASURED_PARENT,
    MECHANISM,
    MIDDLES,
    MOMENT,
    ORIENTATION,
    PARENT,
    PLACE_IN_CHILD,
    PLACE_IN_PARENT,
    POINT,
    POINT_BIAS,
    RATE,
    RIGHTING,
    ROTATION,
    SCRATCH,
    SHIFT,
    SINE_TURN,
    SITE_AXIS,
    SITE_IN_CHILD,
    SITE_IN_PARENT,
    SLIDE,
    SPIN,
    SPIN_BIAS,
    THREE_ANGLES,
    TWO_ANGLES,
    VELOCITY,
    Mechanism,
    Scratch,
)
from springs.coordinates import LARGEST_SINE, POLE_COSINE

_SMALL_SQUARE = 1e-8
"""Squared sine of half an angle below which a series replaces the ratio of angle and sine."""


@compiled(NOTHING, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, merged=True)
def compute_kinematics(
    mechanism: Mechanism, scratch: Scratch, interval: int, time: float, state: Array
) -> None:
    """Compute orientations, points, velocities and acceleration biases of all links."""
    links, constants, work = mechanism.links, mechanism.constants, scratch.work
    drives = mechanism.drive_pieces
    for i in range(len(links)):
        parent, kind = links[i, PARENT], links[i, KIND]
        if parent >= 0:
            outer, spin, velocity = (
                quaternion(work, parent, ORIENTATION),
                vector(work, parent, SPIN),
                vector(work, parent, VELOCITY),
            )
            arm = apply(matrix(work, parent, ROTATION), vector(constants, i, ARM_IN_PARENT))
            axis = apply(matrix(work, parent, ROTATION), vector(constants, i, AXIS_IN_PARENT))
            point = vector(work, parent, POINT)
        else:
            outer, spin, velocity = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            arm, axis = vector(constants, i, ARM_IN_PARENT), vector(constants, i, AXIS_IN_PARENT)
            point = (0.0, 0.0, 0.0)
        spin_bias, point_bias = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        joint_value, joint_rate = 0.0, 0.0
        if kind == BALL:
            own = unit(quaternion_in(state, links[i, COORDINATE]))
            own_spin = vector_in(state, links[i, RATE])
        else:
            value, rate, acceleration = float(constants[i, LOCKED_VALUE]), 0.0, 0.0
            if links[i, DRIVE] >= 0:
                since = time - mechanism.knots[interval]
                drive = links[i, DRIVE]
                c0, c1 = drives[interval, drive, 0], drives[interval, drive, 1]
                c2, c3 = drives[interval, drive, 2], drives[interval, drive, 3]
                value = c0 + since * (c1 + since * (c2 + since * c3))
                rate = c1 + since * (2.0 * c2 + 3.0 * since * c3)
                acceleration = 2.0 * c2 + 6.0 * since * c3
            elif links[i, COORDINATE] >= 0:
                value, rate = float(state[links[i, COORDINATE]]), float(state[links[i, RATE]])
            own_spin, joint_value, joint_rate = spin, value, rate
            along = times(rate, axis)
            turn = quaternion(constants, i, COSINE_TURN)
            if kind == HINGE:
                own_spin = plus(spin, along)
                spin_bias = plus(cross(spin, along), times(acceleration, axis))
                h, s = cos(0.5 * value), sin(0.5 * value)
                turn = (
                    h * turn[0] + s * constants[i, SINE_TURN],
                    h * turn[1] + s * constants[i, SINE_TURN + 1],
                    h * turn[2] + s * constants[i, SINE_TURN + 2],
                    h * turn[3] + s * constants[i, SINE_TURN + 3],
                )
            elif kind == SLIDE:
                arm = plus(arm, times(value, axis))
                velocity = plus(velocity, along)
                point_bias = plus(times(2.0, cross(spin, along)), times(acceleration, axis))
            own = product(outer, turn)
        carried = cross(spin, arm)
        store(work, i, ROTATION, rotation(own))
        store(work, i, ORIENTATION, own)
        store(work, i, SPIN, own_spin)
        store(work, i, ARM, arm)
        store(work, i, POINT, plus(point, arm))
        store(work, i, VELOCITY, plus(velocity, carried))
        store(work, i, AXIS, axis)
        store(work, i, SPIN_BIAS, spin_bias)
        store(work, i, POINT_BIAS, plus(point_bias, cross(spin, carried)))
        store(work, i, MOMENT, (0.0, 0.0, 0.0))
        store(work, i, FORCE, (0.0, 0.0, 0.0))
        work[i, EFFORT] = 0.0
        work[i, JOINT_VALUE], work[i, JOINT_RATE] = joint_value, joint_rate


@compiled(NOTHING, MECHANISM, SCRATCH, COUNT, QUADRUPLE)
def _measure_shift(mechanism: Mechanism, scratch: Scratch, j: int, orientation: Quaternion) -> None:
    """Compute a displacement along an axis of the parent's site, and where its force acts."""
    measured, sites, work = mechanism.measured, mechanism.sites, scratch.work
    parent, child = measured[j, MEASURED_PARENT], measured[j, MEASURED_CHILD]
    axis = apply(rotation(orientation), vector(sites, j, SITE_AXIS))
    place, other_arm = vector(sites, j, PLACE_IN_PARENT), vector(sites, j, PLACE_IN_CHILD)
    spin, velocity = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    arm, other_velocity = other_arm, (0.0, 0.0, 0.0)
    if child >= 0:
        other_arm = apply(matrix(work, child, ROTATION), other_arm)
        arm = plus(vector(work, child, POINT), other_arm)
        turning = cross(vector(work, child, SPIN), other_arm)
        other_velocity = plus(vector(work, child, VELOCITY), turning)
    if parent >= 0:
        place = apply(matrix(work, parent, ROTATION), place)
        arm = minus(arm, vector(work, parent, POINT))
        spin = vector(work, parent, SPIN)
        velocity = plus(vector(work, parent, VELOCITY), cross(spin, arm))
    scratch.displacements[j, 0] = dot(axis, minus(arm, place))
    scratch.rates[j, 0] = dot(axis, minus(other_velocity, velocity))
    store(scratch.torque_axes, j, 0, axis)
    store(scratch.torque_axes, j, 3, arm)
    store(scratch.torque_axes, j, 6, other_arm)


@compiled(REAL, SCRATCH, MATRIX, COUNT, FLAG, QUADRUPLE, QUADRUPLE, TRIPLE, merged=True)
def _measure_chain(
    scratch: Scratch,
    sites: Array,
    j: int,
    is_ball: bool,
    outer: Quaternion,
    inner: Quaternion,
    spin: Vector,
) -> float:
    """Compute the angles of a chain of two or three rotations, and the axes of its torques.

    With the turned axes x, y, z of the parent's site and X, Y, Z of the child's, the angular
    velocity is the sum of the rates about X, z x X and z. The rates are its products with the
    vectors that are dual to these axes; see `springs.coordinates`. Returns X . z: the sine of the
    middle angle of three, but for its sign.
    """
    p, q = rotation(outer), rotation(inner)
    innermost, outermost = (q[0], q[3], q[6]), (p[2], p[5], p[8])
    handedness = float(sites[j, HANDEDNESS])
    angles = (
        atan2(dot((q[1], q[4], q[7]), outermost), dot((q[2], q[5], q[8]), outermost)),
        atan2(dot((p[1], p[4], p[7]), innermost), dot((p[0], p[3], p[6]), innermost)),
    )
    for k in range(2):
        middle = float(sites[j, MIDDLES + 2 * k])
        turns = floor((middle - angles[k]) / (2.0 * pi) + 0.5)
        scratch.displacements[j, k * (1 + is_ball)] = angles[k] + 2.0 * pi * turns
    sine, first, second, third = 0.0, innermost, outermost, (0.0, 0.0, 0.0)
    if is_ball:
        sine, across = dot(innermost, outermost), cross(outermost, innermost)
        cosine = max(sqrt(dot(across, across)), POLE_COSINE)
        scratch.displacements[j, 1] = atan2(-handedness * sine, cosine)
        k = 1.0 / (cosine * cosine)
        first = times(k, minus(innermost, times(sine, outermost)))
        second = times(handedness / cosine, across)
        third = times(k, minus(outermost, times(sine, innermost)))
    (a, b, c), (d, e, f), (g, h, i) = first, second, third
    dual = (a, d, g, b, e, h, c, f, i)
    store(scratch.torque_axes, j, 0, dual)
    store(scratch.rates, j, 0, apply_transposed(dual, spin))
    return sine


@compiled(REAL, MECHANISM, COUNT, REAL)
def _activation(mechanism: Mechanism, interval: int, time: float) -> float:
    """Return the activation of muscles, the last cubic of an interval."""
    pieces, since = mechanism.drive_pieces, time - mechanism.knots[interval]
    last = pieces.shape[1] - 1
    c0, c1 = pieces[interval, last, 0], pieces[interval, last, 1]
    c2, c3 = pieces[interval, last, 2], pieces[interval, last, 3]
    return float(c0 + since * (c1 + since * (c2 + since * c3)))


@compiled(NOTHING, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, merged=True)
def measure_joints(
    mechanism: Mechanism, scratch: Scratch, interval: int, time: float, state: Array
) -> None:
    """Compute the displacements and rates of the joints with laws.

    Of a rotation vector, half the angle has a positive cosine up to 180 deg; beyond, the sign of
    the quaternion is held.
    """
    measured, sites, work = mechanism.measured, mechanism.sites, scratch.work
    branches, switching = mechanism.branches, scratch.switching
    first = len(branches) - len(measured)
    for j in range(len(measured)):
        link, parent, child = (
            measured[j, MEASURED_LINK],
            measured[j, MEASURED_PARENT],
            measured[j, MEASURED_CHILD],
        )
        if link >= 0:
            scratch.displacements[j, 0] = work[link, JOINT_VALUE]
            scratch.rates[j, 0] = work[link, JOINT_RATE]
            switching[first + j] = branches[first + j]
            continue
        form = measured[j, MEASURED_FORM]
        if form == ACTIVATION:
            scratch.displacements[j, 0] = _activation(mechanism, interval, time)
            switching[first + j] = branches[first + j]
            continue
        outer, spin = quaternion(sites, j, SITE_IN_PARENT), (0.0, 0.0, 0.0)
        inner, own_spin = quaternion(sites, j, SITE_IN_CHILD), (0.0, 0.0, 0.0)
        if parent >= 0 and form != RIGHTING:
            outer = product(quaternion(work, parent, ORIENTATION), outer)
            spin = vector(work, parent, SPIN)
        if child >= 0:
            inner = product(quaternion(work, child, ORIENTATION), inner)
            own_spin = vector(work, child, SPIN)
        if form == SHIFT:
            _measure_shift(mechanism, scratch, j, outer)
            switching[first + j] = branches[first + j]
            continue
        cosine, x, y, z = product(conjugate(outer), inner)
        if form == ANGLE:
            axis = vector(sites, j, SITE_AXIS)
            angle = 2.0 * atan2(dot(axis, (x, y, z)), cosine)
            turns = (state[measured[j, MEASURED_ANGLE]] - angle) / (2.0 * pi)
            scratch.displacements[j, 0] = angle + 2.0 * pi * floor(turns + 0.5)
            a, b, c = apply(rotation(outer), axis)
            scratch.rates[j, 0] = dot((a, b, c), minus(own_spin, spin))
            store(scratch.torque_axes, j, 0, (a, 0.0, 0.0, b, 0.0, 0.0, c, 0.0, 0.0))
            switching[first + j] = branches[first + j]
            continue
        if TWO_ANGLES <= form <= THREE_ANGLES:
            is_ball = form == THREE_ANGLES
            sine = _measure_chain(scratch, sites, j, is_ball, outer, inner, minus(own_spin, spin))
            switching[first + j] = branches[first + j]
            if is_ball:
                switching[first + j] = LARGEST_SINE * LARGEST_SINE - sine * sine
            continue
        switching[first + j] = cosine
        sign = branches[first + j]
        cosine, x, y, z = sign * cosine, sign * x, sign * y, sign * z
        square = x * x + y * y + z * z
        if square > _SMALL_SQUARE:
            sine = sqrt(square)
            ratio = 2.0 * atan2(sine, cosine) / sine
        else:
            ratio = 2.0 + square / 3.0
        store(scratch.displacements, j, 0, (ratio * x, ratio * y, ratio * z))
        if form == RIGHTING:
            axes = rotation(inner)
            store(scratch.torque_axes, j, 0, axes)
            store(scratch.rates, j, 0, apply_transposed(axes, own_spin))
            continue
        # Half of the turn by (cosine, sine) is that by (1 + cosine, sine), scaled.
        half_way = rotation(product(outer, unit((1.0 + cosine, x, y, z))))
        store(scratch.torque_axes, j, 0, half_way)
        store(scratch.rates, j, 0, apply_transposed(half_way, minus(own_spin, spin)))
