"""Constraints beyond the tree: joints that close loops, and linked displacements.

Each scalar constraint is a row of `Mechanism.rows`: a displacement g of two links that stays zero.
Its second derivative is linear in the accelerations, g'' = G a + b. The row acts on the links by
its transpose, with a multiplier as the force or torque; it does no work. With the accelerations a0
of the tree alone and those of the tree for a unit of each multiplier, M^-1 G^T, the multipliers
solve

    (G M^-1 G^T) multipliers = -(G a0 + b).

M^-1 G^T comes from the elimination that has given a0, whose factors are stored with the links: only
the biases pass inwards and outwards anew (Featherstone, *Rigid Body Dynamics Algorithms*, 2008,
chapter 8).
"""

from math import sqrt

from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    accumulate,
    apply,
    apply_symmetric,
    apply_transposed,
    cross,
    dot,
    inverse_symmetric,
    matrix,
    minus,
    plus,
    store,
    store_in,
    symmetric,
    times,
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
    ALONG,
    ANGULAR_INERTIA,
    ARM,
    AXIS,
    AXIS_INERTIA,
    BALL,
    BALL_GAIN,
    COORDINATE,
    COUPLING_INERTIA,
    DIRECTION,
    DRIVE,
    EXTERNAL,
    FIRST_ARM,
    FIXED,
    HINGE,
    INVERSE_INERTIA,
    JOINT_RATE,
    KIND,
    LINEAR_INERTIA,
    LINKED,
    MECHANISM,
    MULTIPLIER,
    PARENT,
    POINT_ACCELERATION,
    RATE,
    RESPONSE_ACCELERATION,
    RESPONSE_EFFORT,
    RESPONSE_FORCE,
    RESPONSE_JOINT,
    RESPONSE_MOMENT,
    RESPONSE_SPIN_RATE,
    ROW_BIAS,
    ROW_FIRST,
    ROW_KIND,
    ROW_SECOND,
    SCRATCH,
    SECOND_ARM,
    SLOPE,
    SPIN_RATE,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.row_motion import relative_motion

_SOLUTION_SWEEPS = 2
"""Number of solutions for the multipliers, each for what those before it have left."""


@compiled(REAL, MECHANISM, SCRATCH, COUNT, COUNT)
def _row_response(mechanism: Mechanism, scratch: Scratch, r: int, unit_row: int) -> float:
    """Acceleration of row r by the unit multiplier of another one."""
    responses, control = scratch.responses[unit_row], mechanism.rows[r, ROW_FIRST]
    if mechanism.rows[r, ROW_KIND] != LINKED:
        return relative_motion(
            mechanism, scratch, r, responses, RESPONSE_SPIN_RATE, RESPONSE_ACCELERATION
        )
    total = responses[mechanism.rows[r, ROW_SECOND], RESPONSE_JOINT]
    if control >= 0 and mechanism.links[control, DRIVE] < 0:
        total -= scratch.row_work[r, SLOPE] * responses[control, RESPONSE_JOINT]
    return total


@compiled(REAL, MECHANISM, SCRATCH, COUNT, VECTOR)
def _row_acceleration(mechanism: Mechanism, scratch: Scratch, r: int, rates: Array) -> float:
    """Second derivative of a row's displacement at the present accelerations."""
    links, control = mechanism.links, mechanism.rows[r, ROW_FIRST]
    total = scratch.row_work[r, ROW_BIAS]
    if mechanism.rows[r, ROW_KIND] != LINKED:
        return total + relative_motion(
            mechanism, scratch, r, scratch.work, SPIN_RATE, POINT_ACCELERATION
        )
    total += rates[links[mechanism.rows[r, ROW_SECOND], RATE]]
    if control >= 0 and links[control, DRIVE] < 0:
        total -= scratch.row_work[r, SLOPE] * rates[links[control, RATE]]
    return total


@compiled(NOTHING, MECHANISM, SCRATCH, COUNT)
def _apply_unit(mechanism: Mechanism, scratch: Scratch, r: int) -> None:
    """Set the biases of all links to the wrenches or efforts of a row's unit multiplier."""
    rows, found, own = mechanism.rows, scratch.row_work, scratch.responses[r]
    kind, first, second = rows[r, ROW_KIND], rows[r, ROW_FIRST], rows[r, ROW_SECOND]
    own[:, RESPONSE_MOMENT:] = 0.0
    if kind == LINKED:
        own[second, RESPONSE_EFFORT] = 1.0
        if first >= 0:
            own[first, RESPONSE_EFFORT] = -found[r, SLOPE]
        return
    moment = other_moment = vector(found, r, DIRECTION)
    if kind == ALONG:
        force = moment
        moment = cross(vector(found, r, FIRST_ARM), force)
        other_moment = cross(vector(found, r, SECOND_ARM), force)
        if first >= 0:
            store(own, first, RESPONSE_FORCE, force)
        if second >= 0:
            store(own, second, RESPONSE_FORCE, times(-1.0, force))
    if first >= 0:
        store(own, first, RESPONSE_MOMENT, moment)
    if second >= 0:
        store(own, second, RESPONSE_MOMENT, times(-1.0, other_moment))


@compiled(NOTHING, MECHANISM, SCRATCH, COUNT)
def _respond(mechanism: Mechanism, scratch: Scratch, r: int) -> None:
    """Compute the accelerations of all links by the unit multiplier of a row."""
    links, work, own = mechanism.links, scratch.work, scratch.responses[r]
    _apply_unit(mechanism, scratch, r)
    for i in range(len(links) - 1, -1, -1):
        parent, kind = links[i, PARENT], links[i, KIND]
        if parent < 0:
            continue
        n, f = vector(own, i, RESPONSE_MOMENT), vector(own, i, RESPONSE_FORCE)
        if kind == BALL:
            # f + H^T g with g = -J^-1 n, as the gain is J^-1 H.
            f = minus(f, apply_transposed(matrix(work, i, BALL_GAIN), n))
            n = (0.0, 0.0, 0.0)
        elif links[i, COORDINATE] >= 0:
            along = n if kind == HINGE else f
            net = own[i, RESPONSE_EFFORT] - dot(vector(work, i, AXIS), along)
            net *= work[i, INVERSE_INERTIA]
            n = plus(n, times(net, vector(work, i, AXIS_INERTIA)))
            f = plus(f, times(net, vector(work, i, AXIS_INERTIA + 3)))
        accumulate(own, parent, RESPONSE_MOMENT, plus(n, cross(vector(work, i, ARM), f)))
        accumulate(own, parent, RESPONSE_FORCE, f)
    for i in range(len(links)):
        parent, kind = links[i, PARENT], links[i, KIND]
        alpha, a = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if parent >= 0:
            alpha = vector(own, parent, RESPONSE_SPIN_RATE)
            a = plus(vector(own, parent, RESPONSE_ACCELERATION), cross(alpha, vector(work, i, ARM)))
        n, f = vector(own, i, RESPONSE_MOMENT), vector(own, i, RESPONSE_FORCE)
        axis, along = vector(work, i, AXIS), n if kind == HINGE else f
        if kind == BALL:
            inverse = inverse_symmetric(symmetric(work, i, ANGULAR_INERTIA))
            gain = matrix(work, i, BALL_GAIN)
            alpha = times(-1.0, plus(apply_symmetric(inverse, n), apply(gain, a)))
        elif links[i, COORDINATE] >= 0:
            net = own[i, RESPONSE_EFFORT] - dot(axis, along)
            net -= dot(vector(work, i, AXIS_INERTIA), alpha)
            net -= dot(vector(work, i, AXIS_INERTIA + 3), a)
            acceleration = net * work[i, INVERSE_INERTIA]
            own[i, RESPONSE_JOINT] = acceleration
            if kind == HINGE:
                alpha = plus(alpha, times(acceleration, axis))
            else:
                a = plus(a, times(acceleration, axis))
        elif links[i, DRIVE] >= 0:
            H = matrix(work, i, COUPLING_INERTIA)
            if kind == HINGE:
                J = symmetric(work, i, ANGULAR_INERTIA)
                inertial = plus(apply_symmetric(J, alpha), apply(H, a))
            else:
                M = symmetric(work, i, LINEAR_INERTIA)
                inertial = plus(apply_transposed(H, alpha), apply_symmetric(M, a))
            own[i, RESPONSE_JOINT] = dot(axis, plus(inertial, along)) - own[i, RESPONSE_EFFORT]
        store(own, i, RESPONSE_SPIN_RATE, alpha)
        store(own, i, RESPONSE_ACCELERATION, a)


@compiled(NOTHING, MECHANISM, SCRATCH)
def _factorize(mechanism: Mechanism, scratch: Scratch) -> None:
    """Factorize G M^-1 G^T by Cholesky; not finite where rows depend on each other."""
    L = scratch.factor
    for r in range(len(mechanism.rows)):
        for s in range(r + 1):
            total = _row_response(mechanism, scratch, r, s)
            for k in range(s):
                total -= L[r, k] * L[s, k]
            L[r, s] = sqrt(total) if r == s else total / L[s, s]


@compiled(NOTHING, SCRATCH)
def solve_rows(scratch: Scratch) -> None:
    """Replace the residual by the multipliers whose accelerations it is."""
    L, x = scratch.factor, scratch.residual
    for r in range(len(x)):
        for k in range(r):
            x[r] -= L[r, k] * x[k]
        x[r] /= L[r, r]
    for r in range(len(x) - 1, -1, -1):
        for k in range(r + 1, len(x)):
            x[r] -= L[k, r] * x[k]
        x[r] /= L[r, r]


@compiled(NOTHING, MECHANISM, SCRATCH, VECTOR)
def impose_rows(mechanism: Mechanism, scratch: Scratch, rates: Array) -> None:
    """Add to the accelerations, and to the rates of the state, those by the rows' multipliers."""
    links, work, found = mechanism.links, scratch.work, scratch.row_work
    for r in range(len(found)):
        _respond(mechanism, scratch, r)
        found[r, MULTIPLIER] = 0.0
    _factorize(mechanism, scratch)
    for _ in range(_SOLUTION_SWEEPS):
        for r in range(len(found)):
            scratch.residual[r] = -_row_acceleration(mechanism, scratch, r, rates)
        solve_rows(scratch)
        for r in range(len(found)):
            size, own = scratch.residual[r], scratch.responses[r]
            found[r, MULTIPLIER] += size
            for i in range(len(links)):
                turn = times(size, vector(own, i, RESPONSE_SPIN_RATE))
                accumulate(work, i, SPIN_RATE, turn)
                moved = times(size, vector(own, i, RESPONSE_ACCELERATION))
                accumulate(work, i, POINT_ACCELERATION, moved)
                if links[i, DRIVE] >= 0:
                    power = size * own[i, RESPONSE_JOINT] * work[i, JOINT_RATE]
                    scratch.powers[EXTERNAL] += power
                elif links[i, KIND] == BALL:
                    rate = links[i, RATE]
                    store_in(rates, rate, plus(vector_in(rates, rate), turn))
                elif links[i, KIND] != FIXED:
                    rates[links[i, RATE]] += size * own[i, RESPONSE_JOINT]
