"""Accelerations of a tree of links, by eliminating its joint constraints from the tips inwards.

The redundant equations of motion are those of Exudyn's model: Newton's and Euler's for each body,
with the constraint forces of the joints. The velocity transformation expresses the bodies'
velocities by those of the joints (Jerkovsky 1978; Kim & Vanderploeg 1986). Along a tree it
eliminates the constraint forces joint by joint: the articulated-body recursion of Featherstone
(*The calculation of robot dynamics using articulated-body inertias*, 1983), with n links in a time
proportional to n. All quantities are in world axes. Each link is referred to the point of its own
joint: about the centre of mass the recursion would lose a digit every few links.

With angular acceleration `alpha` and acceleration `a` of the link's point, the joint must exert

    moment = J alpha + H a + n,    force = H^T alpha + M a + f

on everything outboard of it, where J, H, M is the articulated inertia and n, f its bias.
`docs/compiled-integration.md` derives the equations.
"""

from typing import Any, NamedTuple

from numba import types

from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    accumulate,
    apply,
    apply_symmetric,
    apply_transposed,
    cross,
    cross_rows,
    cross_symmetric,
    dot,
    inverse_symmetric,
    matrix,
    minus,
    plus,
    quaternion,
    quaternion_rate,
    rotated_diagonal,
    store,
    store_in,
    symmetric,
    symmetric_times,
    times,
    vector,
    vector_in,
)
from generator.simulation.compiled.closure import impose_rows
from generator.simulation.compiled.compiler import (
    COUNT,
    NOTHING,
    REAL,
    VECTOR,
    FunctionPointer,
    compiled,
)
from generator.simulation.compiled.layout import (
    ANGULAR_INERTIA,
    ARM,
    AXIS,
    AXIS_INERTIA,
    BALL,
    BALL_GAIN,
    BALL_SPIN_RATE,
    CENTRE,
    COORDINATE,
    COUPLING_INERTIA,
    DRIVE,
    EFFORT,
    EXTERNAL,
    FIXED,
    FORCE,
    HINGE,
    INERTIA,
    INVERSE_INERTIA,
    JOINT_RATE,
    KIND,
    LAW,
    LINEAR_INERTIA,
    LOAD_IS_FORCE,
    LOAD_IS_LOCAL,
    LOAD_LINK,
    MASS,
    MECHANISM,
    MOMENT,
    NET_EFFORT,
    ORIENTATION,
    PARENT,
    POINT_ACCELERATION,
    POINT_BIAS,
    POWERS,
    RATE,
    ROTATION,
    ROW_ANGLE,
    ROW_CHILD,
    ROW_FORM,
    ROW_LINK,
    ROW_PARENT,
    SCRATCH,
    SHIFT,
    SPIN,
    SPIN_BIAS,
    SPIN_RATE,
    VELOCITY,
    CompiledLaw,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.link_motion import compute_kinematics, measure_joints
from generator.simulation.compiled.row_motion import measure_rows


@compiled(NOTHING, MECHANISM, SCRATCH, COUNT, REAL, merged=True)
def compute_inertia_and_loads(
    mechanism: Mechanism, scratch: Scratch, interval: int, time: float
) -> None:
    """Start each link's articulated inertia and bias with its own, the laws' torques and loads."""
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
        store(work, i, MOMENT, cross(spin, apply_symmetric(inertia, spin)))
        store(work, i, FORCE, cross(spin, cross(spin, (mx, my, mz))))
    for j in range(len(measured)):
        parent, child = measured[j, ROW_PARENT], measured[j, ROW_CHILD]
        if measured[j, ROW_LINK] >= 0:
            work[measured[j, ROW_LINK], EFFORT] += scratch.torques[j, 0]
            continue
        if measured[j, ROW_FORM] == SHIFT:
            force = times(scratch.torques[j, 0], vector(scratch.half_way, j, 0))
            if parent >= 0:
                accumulate(work, parent, FORCE, force)
                moment = cross(vector(scratch.half_way, j, 3), force)
                accumulate(work, parent, MOMENT, moment)
            if child >= 0:
                accumulate(work, child, FORCE, times(-1.0, force))
                moment = cross(vector(scratch.half_way, j, 6), force)
                accumulate(work, child, MOMENT, times(-1.0, moment))
            continue
        torque = apply(matrix(scratch.half_way, j, 0), vector(scratch.torques, j, 0))
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


@compiled(NOTHING, MECHANISM, SCRATCH, merged=True)
def eliminate_constraints(mechanism: Mechanism, scratch: Scratch) -> None:
    """Pass from the tips inwards: add what each joint transmits to the inboard link."""
    links, work = mechanism.links, scratch.work
    for i in range(len(links) - 1, -1, -1):
        parent, kind = links[i, PARENT], links[i, KIND]
        J, H = symmetric(work, i, ANGULAR_INERTIA), matrix(work, i, COUPLING_INERTIA)
        M, n, f = (
            symmetric(work, i, LINEAR_INERTIA),
            vector(work, i, MOMENT),
            vector(work, i, FORCE),
        )
        spin_bias, point_bias = vector(work, i, SPIN_BIAS), vector(work, i, POINT_BIAS)
        if kind == BALL:
            # The joint exerts no moment: alpha = g - G a, and only a force is left.
            inverse = inverse_symmetric(J)
            G = symmetric_times(inverse, H)
            g = times(-1.0, apply_symmetric(inverse, n))
            store(work, i, BALL_GAIN, G)
            store(work, i, BALL_SPIN_RATE, g)
            if parent < 0:
                continue
            M = (
                M[0] - H[0] * G[0] - H[3] * G[3] - H[6] * G[6],
                M[1] - H[0] * G[1] - H[3] * G[4] - H[6] * G[7],
                M[2] - H[0] * G[2] - H[3] * G[5] - H[6] * G[8],
                M[3] - H[1] * G[1] - H[4] * G[4] - H[7] * G[7],
                M[4] - H[1] * G[2] - H[4] * G[5] - H[7] * G[8],
                M[5] - H[2] * G[2] - H[5] * G[5] - H[8] * G[8],
            )
            f = plus(plus(f, apply_transposed(H, g)), apply_symmetric(M, point_bias))
            arm = vector(work, i, ARM)
            H = cross_symmetric(arm, M)
            J_rows = cross_rows(arm, H)
            accumulate(
                work,
                parent,
                ANGULAR_INERTIA,
                (J_rows[0], J_rows[1], J_rows[2], J_rows[4], J_rows[5], J_rows[8]),
            )
            accumulate(work, parent, COUPLING_INERTIA, H)
            accumulate(work, parent, LINEAR_INERTIA, M)
            accumulate(work, parent, MOMENT, cross(arm, f))
            accumulate(work, parent, FORCE, f)
            continue
        if links[i, DRIVE] < 0 and kind != FIXED:
            axis = vector(work, i, AXIS)
            if kind == HINGE:
                u, v = apply_symmetric(J, axis), apply_transposed(H, axis)
                inverse, net = 1.0 / dot(axis, u), work[i, EFFORT] - dot(axis, n)
            else:
                u, v = apply(H, axis), apply_symmetric(M, axis)
                inverse, net = 1.0 / dot(axis, v), work[i, EFFORT] - dot(axis, f)
            store(work, i, AXIS_INERTIA, u)
            store(work, i, AXIS_INERTIA + 3, v)
            work[i, INVERSE_INERTIA], work[i, NET_EFFORT] = inverse, net
            x, y = times(inverse, u), times(inverse, v)
            J = (
                J[0] - x[0] * u[0],
                J[1] - x[0] * u[1],
                J[2] - x[0] * u[2],
                J[3] - x[1] * u[1],
                J[4] - x[1] * u[2],
                J[5] - x[2] * u[2],
            )
            H = (
                H[0] - x[0] * v[0],
                H[1] - x[0] * v[1],
                H[2] - x[0] * v[2],
                H[3] - x[1] * v[0],
                H[4] - x[1] * v[1],
                H[5] - x[1] * v[2],
                H[6] - x[2] * v[0],
                H[7] - x[2] * v[1],
                H[8] - x[2] * v[2],
            )
            M = (
                M[0] - y[0] * v[0],
                M[1] - y[0] * v[1],
                M[2] - y[0] * v[2],
                M[3] - y[1] * v[1],
                M[4] - y[1] * v[2],
                M[5] - y[2] * v[2],
            )
            n, f = plus(n, times(net, x)), plus(f, times(net, y))
        if parent < 0:
            continue
        n = plus(n, plus(apply_symmetric(J, spin_bias), apply(H, point_bias)))
        f = plus(f, plus(apply_transposed(H, spin_bias), apply_symmetric(M, point_bias)))
        arm = vector(work, i, ARM)
        # About the inboard link's point: J + L + L^T + K [s]x^T and H + K.
        K, L = cross_symmetric(arm, M), cross_rows(arm, H)
        k = cross_rows(arm, K)
        accumulate(
            work,
            parent,
            ANGULAR_INERTIA,
            (
                J[0] + 2.0 * L[0] + k[0],
                J[1] + L[1] + L[3] + k[1],
                J[2] + L[2] + L[6] + k[2],
                J[3] + 2.0 * L[4] + k[4],
                J[4] + L[5] + L[7] + k[5],
                J[5] + 2.0 * L[8] + k[8],
            ),
        )
        accumulate(work, parent, COUPLING_INERTIA, H)
        accumulate(work, parent, COUPLING_INERTIA, K)
        accumulate(work, parent, LINEAR_INERTIA, M)
        accumulate(work, parent, MOMENT, plus(n, cross(arm, f)))
        accumulate(work, parent, FORCE, f)


@compiled(NOTHING, MECHANISM, SCRATCH, VECTOR, VECTOR, merged=True)
def compute_accelerations(
    mechanism: Mechanism, scratch: Scratch, state: Array, rates: Array
) -> None:
    """Pass from the ground outwards: accelerations of all links, and the rates of the state."""
    links, work = mechanism.links, scratch.work
    for i in range(len(links)):
        parent = links[i, PARENT]
        kind, coordinate, rate = links[i, KIND], links[i, COORDINATE], links[i, RATE]
        if parent >= 0:
            alpha = vector(work, parent, SPIN_RATE)
            a = plus(vector(work, parent, POINT_ACCELERATION), cross(alpha, vector(work, i, ARM)))
        else:
            alpha, a = (0.0, 0.0, 0.0), times(-1.0, vector_in(mechanism.gravity, 0))
        a = plus(a, vector(work, i, POINT_BIAS))
        if kind == BALL:
            alpha = minus(vector(work, i, BALL_SPIN_RATE), apply(matrix(work, i, BALL_GAIN), a))
            store_in(rates, rate, alpha)
            store_in(
                rates,
                coordinate,
                quaternion_rate(quaternion(work, i, ORIENTATION), vector(work, i, SPIN)),
            )
        else:
            alpha = plus(alpha, vector(work, i, SPIN_BIAS))
            if coordinate >= 0:
                required = dot(vector(work, i, AXIS_INERTIA), alpha) + dot(
                    vector(work, i, AXIS_INERTIA + 3), a
                )
                acceleration = (work[i, NET_EFFORT] - required) * work[i, INVERSE_INERTIA]
                rates[rate], rates[coordinate] = acceleration, state[rate]
                along = times(acceleration, vector(work, i, AXIS))
                if kind == HINGE:
                    alpha = plus(alpha, along)
                else:
                    a = plus(a, along)
        store(work, i, SPIN_RATE, alpha)
        store(work, i, POINT_ACCELERATION, a)
        if links[i, DRIVE] >= 0:
            H, axis = matrix(work, i, COUPLING_INERTIA), vector(work, i, AXIS)
            if kind == HINGE:
                inertial = plus(
                    apply_symmetric(symmetric(work, i, ANGULAR_INERTIA), alpha), apply(H, a)
                )
                effort = dot(axis, plus(inertial, vector(work, i, MOMENT)))
            else:
                inertial = plus(
                    apply_transposed(H, alpha),
                    apply_symmetric(symmetric(work, i, LINEAR_INERTIA), a),
                )
                effort = dot(axis, plus(inertial, vector(work, i, FORCE)))
            scratch.powers[EXTERNAL] += (effort - work[i, EFFORT]) * work[i, JOINT_RATE]


@compiled(NOTHING, LAW, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, pointer=True)
def evaluate_laws(
    law: CompiledLaw,
    mechanism: Mechanism,
    scratch: Scratch,
    interval: int,
    time: float,
    state: Array,
) -> None:
    """Compute the motion of a state, and the torques and switching functions of the laws."""
    compute_kinematics(mechanism, scratch, interval, time, state)
    measure_joints(mechanism, scratch, state)
    for k in range(POWERS):
        scratch.powers[k] = 0.0
    law(
        scratch.displacements,
        scratch.rates,
        mechanism.parameters,
        mechanism.branches,
        mechanism.law_rows,
        mechanism.law_bounds,
        scratch.torques,
        scratch.switching,
        scratch.powers,
    )


@compiled(NOTHING, LAW, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, VECTOR, pointer=True)
def compute_rates(
    law: CompiledLaw,
    mechanism: Mechanism,
    scratch: Scratch,
    interval: int,
    time: float,
    state: Array,
    rates: Array,
) -> None:
    """Compute the rates of a state at a time, in an interval of `Mechanism.knots`."""
    evaluate_laws(law, mechanism, scratch, interval, time, state)
    compute_inertia_and_loads(mechanism, scratch, interval, time)
    eliminate_constraints(mechanism, scratch)
    compute_accelerations(mechanism, scratch, state, rates)
    if len(mechanism.rows) > 0:
        measure_rows(mechanism, scratch)
        impose_rows(mechanism, scratch, rates)
    for j in range(len(mechanism.measured)):
        if mechanism.measured[j, ROW_ANGLE] >= 0:
            rates[mechanism.measured[j, ROW_ANGLE]] = scratch.rates[j, 0]
    for k in range(POWERS):
        rates[len(rates) - POWERS + k] = scratch.powers[k]


class Equations(NamedTuple):
    """Pointers to the functions that an integration calls.

    Attributes:
        law: the laws of the joints.
        evaluate_laws: computes the motion of a state and the laws.
        compute_rates: computes the rates of a state.
    """

    law: CompiledLaw
    evaluate_laws: Any
    compute_rates: Any


EQUATIONS = types.NamedTuple(
    (
        LAW,
        types.FunctionType(NOTHING(LAW, MECHANISM, SCRATCH, COUNT, REAL, VECTOR)),
        types.FunctionType(NOTHING(LAW, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, VECTOR)),
    ),
    Equations,
)

_EVALUATE_LAWS, _COMPUTE_RATES = FunctionPointer(evaluate_laws), FunctionPointer(compute_rates)


def equations_with(law: CompiledLaw) -> Equations:
    """Return the equations of motion with the laws of a mechanism's joints."""
    return Equations(law, _EVALUATE_LAWS, _COMPUTE_RATES)
