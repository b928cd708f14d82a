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
    matrix_less_outer,
    minus,
    plus,
    quaternion,
    quaternion_rate,
    store,
    store_in,
    sum_of,
    symmetric,
    symmetric_less_outer,
    symmetric_less_product,
    symmetric_times,
    times,
    twice_symmetric_part,
    upper_half,
    vector,
    vector_in,
)
from generator.simulation.compiled.compiler import (
    COUNT,
    NOTHING,
    REAL,
    VECTOR,
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
    COORDINATE,
    COUPLING_INERTIA,
    DRIVE,
    EFFORT,
    EXTERNAL,
    FIXED,
    FORCE,
    HINGE,
    INVERSE_INERTIA,
    JOINT_RATE,
    KIND,
    LAWS,
    LINEAR_INERTIA,
    MEASURED_ANGLE,
    MECHANISM,
    MOMENT,
    NET_EFFORT,
    ORIENTATION,
    PARENT,
    PARENT_GAIN,
    POINT_ACCELERATION,
    POINT_BIAS,
    POWERS,
    RATE,
    SCRATCH,
    SPIN,
    SPIN_BIAS,
    SPIN_RATE,
    Laws,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.link_forces import compute_inertia_and_loads
from generator.simulation.compiled.link_motion import compute_kinematics, measure_joints


@compiled(NOTHING, MECHANISM, SCRATCH, merged=True)
def eliminate_constraints(mechanism: Mechanism, scratch: Scratch) -> None:
    """Pass from the tips inwards: add what each joint transmits to the inboard link."""
    links, work = mechanism.links, scratch.work
    is_implicit = len(scratch.added_inertia) > 0
    for i in range(len(links) - 1, -1, -1):
        parent, kind = links[i, PARENT], links[i, KIND]
        j, h = symmetric(work, i, ANGULAR_INERTIA), matrix(work, i, COUPLING_INERTIA)
        m = symmetric(work, i, LINEAR_INERTIA)
        n, f = vector(work, i, MOMENT), vector(work, i, FORCE)
        arm, point_bias = vector(work, i, ARM), vector(work, i, POINT_BIAS)
        if kind == BALL:
            # The joint exerts no moment, so alpha = -J^-1 (n + H a), and only a force is left.
            b = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            if is_implicit:
                b = symmetric(scratch.added_inertia, i, 0)
            inverse = inverse_symmetric(sum_of(j, b))
            gain = symmetric_times(inverse, h)
            spin_rate = times(-1.0, apply_symmetric(inverse, n))
            store(work, i, BALL_GAIN, gain)
            store(work, i, BALL_SPIN_RATE, spin_rate)
            if parent < 0:
                continue
            m = symmetric_less_product(m, h, gain)
            f = plus(plus(f, apply_transposed(h, spin_rate)), apply_symmetric(m, point_bias))
            shifted = cross_symmetric(arm, m)
            if is_implicit:
                # With B between both links alpha = (J + B)^-1 (B alpha0 - n - H a), and the moment
                # on the inboard link is B (alpha0 - alpha).
                full = (b[0], b[1], b[2], b[1], b[3], b[4], b[2], b[4], b[5])
                parent_gain = symmetric_times(inverse, full)
                store(work, i, PARENT_GAIN, parent_gain)
                coupling = symmetric_times(b, gain)
                moment = minus(apply(coupling, point_bias), apply_symmetric(b, spin_rate))
                across = twice_symmetric_part(cross_rows(arm, coupling))
                accumulate(
                    work, parent, ANGULAR_INERTIA, symmetric_less_product(b, full, parent_gain)
                )
                accumulate(work, parent, ANGULAR_INERTIA, across)
                accumulate(work, parent, COUPLING_INERTIA, coupling)
                accumulate(work, parent, MOMENT, moment)
            accumulate(work, parent, ANGULAR_INERTIA, upper_half(cross_rows(arm, shifted)))
            accumulate(work, parent, COUPLING_INERTIA, shifted)
            accumulate(work, parent, LINEAR_INERTIA, m)
            accumulate(work, parent, MOMENT, cross(arm, f))
            accumulate(work, parent, FORCE, f)
            continue
        if links[i, DRIVE] < 0 and kind != FIXED:
            axis = vector(work, i, AXIS)
            if kind == HINGE:
                u, v = apply_symmetric(j, axis), apply_transposed(h, axis)
                inertia, effort = dot(axis, u), work[i, EFFORT] - dot(axis, n)
            else:
                u, v = apply(h, axis), apply_symmetric(m, axis)
                inertia, effort = dot(axis, v), work[i, EFFORT] - dot(axis, f)
            if is_implicit:
                inertia += scratch.added_inertia[i, 0]
            store(work, i, AXIS_INERTIA, u)
            store(work, i, AXIS_INERTIA + 3, v)
            work[i, INVERSE_INERTIA], work[i, NET_EFFORT] = 1.0 / inertia, effort
            x, y = times(1.0 / inertia, u), times(1.0 / inertia, v)
            j, h = symmetric_less_outer(j, x, u), matrix_less_outer(h, x, v)
            m = symmetric_less_outer(m, y, v)
            n, f = plus(n, times(effort, x)), plus(f, times(effort, y))
        if parent < 0:
            continue
        spin_bias = vector(work, i, SPIN_BIAS)
        n = plus(n, plus(apply_symmetric(j, spin_bias), apply(h, point_bias)))
        f = plus(f, plus(apply_transposed(h, spin_bias), apply_symmetric(m, point_bias)))
        # About the inboard link's point: H + [s]x M, and J + H [s]x^T + [s]x H^T + [s]x M [s]x^T.
        shifted = cross_symmetric(arm, m)
        accumulate(work, parent, ANGULAR_INERTIA, j)
        accumulate(work, parent, ANGULAR_INERTIA, twice_symmetric_part(cross_rows(arm, h)))
        accumulate(work, parent, ANGULAR_INERTIA, upper_half(cross_rows(arm, shifted)))
        accumulate(work, parent, COUPLING_INERTIA, h)
        accumulate(work, parent, COUPLING_INERTIA, shifted)
        accumulate(work, parent, LINEAR_INERTIA, m)
        accumulate(work, parent, MOMENT, plus(n, cross(arm, f)))
        accumulate(work, parent, FORCE, f)


@compiled(NOTHING, MECHANISM, SCRATCH, VECTOR, VECTOR, merged=True)
def compute_accelerations(
    mechanism: Mechanism, scratch: Scratch, state: Array, rates: Array
) -> None:
    """Pass from the ground outwards: accelerations of all links, and the rates of the state."""
    links, work = mechanism.links, scratch.work
    is_implicit = len(scratch.added_inertia) > 0
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
            outer = alpha
            alpha = minus(vector(work, i, BALL_SPIN_RATE), apply(matrix(work, i, BALL_GAIN), a))
            if is_implicit and parent >= 0:
                alpha = plus(alpha, apply(matrix(work, i, PARENT_GAIN), outer))
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
            h, axis = matrix(work, i, COUPLING_INERTIA), vector(work, i, AXIS)
            if kind == HINGE:
                inertial = plus(
                    apply_symmetric(symmetric(work, i, ANGULAR_INERTIA), alpha), apply(h, a)
                )
                effort = dot(axis, plus(inertial, vector(work, i, MOMENT)))
            else:
                inertial = plus(
                    apply_transposed(h, alpha),
                    apply_symmetric(symmetric(work, i, LINEAR_INERTIA), a),
                )
                effort = dot(axis, plus(inertial, vector(work, i, FORCE)))
            scratch.powers[EXTERNAL] += (effort - work[i, EFFORT]) * work[i, JOINT_RATE]


@compiled(NOTHING, LAWS, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, pointer=True, merged=True)
def evaluate_laws(
    laws: Laws,
    mechanism: Mechanism,
    scratch: Scratch,
    interval: int,
    time: float,
    state: Array,
) -> None:
    """Compute the motion of a state, and the forces and switching functions of all laws."""
    compute_kinematics(mechanism, scratch, interval, time, state)
    measure_joints(mechanism, scratch, interval, time, state)
    for k in range(POWERS):
        scratch.powers[k] = 0.0
    laws.joints(
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
    if len(mechanism.sphere_groups) > 0:  # a call that does nothing takes as long as two links
        laws.contacts(mechanism, scratch)
    if len(mechanism.pairs) > 0:
        laws.pairs(mechanism, scratch)


@compiled(NOTHING, LAWS, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, VECTOR, pointer=True)
def compute_rates(
    laws: Laws,
    mechanism: Mechanism,
    scratch: Scratch,
    interval: int,
    time: float,
    state: Array,
    rates: Array,
) -> None:
    """Compute the rates of a state of a tree at a time, in an interval of `Mechanism.knots`."""
    evaluate_laws(laws, mechanism, scratch, interval, time, state)
    compute_inertia_and_loads(mechanism, scratch, interval, time)
    eliminate_constraints(mechanism, scratch)
    compute_accelerations(mechanism, scratch, state, rates)
    for j in range(len(mechanism.measured)):
        if mechanism.measured[j, MEASURED_ANGLE] >= 0:
            rates[mechanism.measured[j, MEASURED_ANGLE]] = scratch.rates[j, 0]
    impulses = len(rates) - POWERS - 3 * len(scratch.contact_forces)
    for k in range(len(scratch.contact_forces)):
        store_in(rates, impulses + 3 * k, vector(scratch.contact_forces, k, 0))
    for k in range(POWERS):
        rates[len(rates) - POWERS + k] = scratch.powers[k]
