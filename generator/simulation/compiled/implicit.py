"""Linearly implicit integration of falls: ROS2, whose stages the articulated-body recursion solves.

With the stiffness K and the damping D of joints and contacts, a stage of step h needs the solution
of (M - g D - g^2 K) a = r with g = gamma h. K and D act between a link and its inboard link, or on
a link that touches a prop, so they add to the inertia of links in the recursion, and a stage costs
as much as an evaluation, whatever the stiffness. ROS2 (Verwer, Spee, Blom & Hundsdorfer, *A
second-order Rosenbrock method applied to photochemical dispersion problems*, SIAM J. Sci. Comput.
20:1456, 1999) is of order 2 for any K and D, so that these need not be exact: those of joints are
differences of the laws, without what one joint has on another, and are kept for some steps.

Breakpoints of laws are not located. The error of the motion is not estimated, because the
difference of two runs of this method is smaller than their errors.
"""

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    accumulate,
    apply_symmetric,
    apply_transposed,
    cross,
    cross_rows,
    cross_symmetric,
    dot,
    matrix,
    minus,
    plus,
    quaternion,
    quaternion_rate,
    store,
    store_in,
    symmetric,
    times,
    upper_half,
    vector,
    vector_in,
)
from generator.simulation.compiled.compiler import (
    COUNT,
    FLAG,
    MATRIX,
    NOTHING,
    REAL,
    VECTOR,
    IndexTable,
    Matrix,
    Vector,
    compiled,
    compiled_type,
)
from generator.simulation.compiled.contact_forces import find_touches
from generator.simulation.compiled.equations import EQUATIONS, Equations
from generator.simulation.compiled.flight import longest_flight
from generator.simulation.compiled.frames import settle_branches
from generator.simulation.compiled.layout import (
    ACTIVATION,
    ANGULAR_INERTIA,
    AXIS,
    BALL,
    COORDINATE,
    COUPLING_INERTIA,
    EFFORT,
    FORCE,
    FRICTION,
    GROUP_LINK,
    IMPACT,
    JOINT_RATE,
    KIND,
    LAWS,
    LINEAR_INERTIA,
    MEASURED_CHILD,
    MEASURED_ENDS_RUN,
    MEASURED_FORM,
    MEASURED_LINK,
    MEASURED_PARENT,
    MECHANISM,
    MOMENT,
    ORIENTATION,
    PARENT,
    POINT_ACCELERATION,
    POWERS,
    RATE,
    ROTATION_VECTOR,
    SCRATCH,
    SPIN,
    SPIN_RATE,
    TOUCH_BEND,
    TOUCH_DAMPING,
    TOUCH_DEEPEST,
    TOUCH_FORCE,
    TOUCH_FRICTION,
    TOUCH_FRICTION_POWER,
    TOUCH_GROUP,
    TOUCH_IMPACT,
    TOUCH_MOMENT,
    TOUCH_NORMAL,
    TOUCH_STIFFNESS,
    VELOCITY,
    Laws,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.link_forces import compute_inertia_and_loads
from generator.simulation.compiled.link_motion import compute_kinematics, measure_joints
from generator.simulation.compiled.marching import (
    COLLAPSED,
    FINISHED,
    LONGEST_CONTACT_STEP,
    PAUSED,
    SHORTEST_STEP,
    TURNED_OVER,
)
from generator.simulation.compiled.recursion import compute_accelerations, eliminate_constraints
from generator.simulation.compiled.runge_kutta import (
    FRAME,
    INTERVAL,
    NEEDS_FIRST_STAGE,
    PROGRESS,
    REJECTED,
    STEP,
    STEPS,
    SWITCH,
    TIME,
    UNCORRECTED,
    Progress,
    keep_step,
    normalize_quaternions,
)

GAMMA = 1.0 - sqrt(0.5)
"""Of ROS2: both stages are damped for stiff forces."""

RATE_WEIGHT = 0.1
"""Weight of an error of a rate over that of a coordinate [s]."""

STEPS_PER_TANGENT = 8
"""Steps for which stiffness and damping of the joints are kept."""

SAFETY, LARGEST_GROWTH, LARGEST_SHRINKAGE = 0.85, 3.0, 0.2
"""Share of the step that the error permits, and bounds of the ratio of two steps."""

_ANGLE, _RATE = 1e-5, 1e-2
"""Differences of a displacement [rad or m] and a rate [rad/s or m/s] for tangents of laws."""

_LARGEST_COUPLING = 0.5
"""Bound of an element beside the diagonal over the root of both on it."""

OLD_SPIN, OLD_VELOCITY, OLD_SPIN_RATE, OLD_ACCELERATION, OLD_JOINT = 0, 3, 6, 9, 12
"""Columns of `Tangents.first`: of the first stage, spin, velocity of the link's point,
accelerations of both (3 each), and rate and acceleration of a hinge or slide."""


class Tangents(NamedTuple):
    """Stiffness and damping of the joints, and memory of a step; n links, m measured joints.

    Attributes:
        rows: measured joint whose law acts at each link, -1 without one, shape (n, 1).
        stiffness: stiffness of the measured joints in their half-way frames, symmetric, shape (m,
            6) [N m/rad]; of a single displacement in the first column.
        damping: likewise [N m s/rad].
        first: what the second stage needs of the first, shape (n, 14).
        displacements: displaced joints, shape (m, 3).
        rates: rates of these, shape (m, 3).
        torques: torques of the laws then, shape (m, 3).
        base: torques without displacements, shape (m, 3).
        raw: differences, shape (m, 9).
        switching: switching functions that are not read.
        powers: powers that are not read.
    """

    rows: IndexTable
    stiffness: Matrix
    damping: Matrix
    first: Matrix
    displacements: Matrix
    rates: Matrix
    torques: Matrix
    base: Matrix
    raw: Matrix
    switching: Vector
    powers: Vector


TANGENTS = compiled_type(Tangents)


def make_tangents(mechanism: Mechanism) -> Tangents:
    """Return the memory of a linearly implicit integration of a mechanism."""
    links, measured = mechanism.links, mechanism.measured
    n, m = len(links), len(measured)
    rows = np.full((n, 1), -1, dtype=np.int64)
    for j, row in enumerate(measured.tolist()):
        if row[MEASURED_LINK] >= 0:
            rows[row[MEASURED_LINK]] = j
        elif row[MEASURED_FORM] == ROTATION_VECTOR:
            link = row[MEASURED_CHILD]
            while link >= 0 and link != row[MEASURED_PARENT]:
                rows[link] = j
                link = int(links[link, PARENT])
    return Tangents(
        rows,
        np.zeros((m, 6)),
        np.zeros((m, 6)),
        np.zeros((n, 14)),
        np.zeros((m, 3)),
        np.zeros((m, 3)),
        np.zeros((m, 3)),
        np.zeros((m, 3)),
        np.zeros((m, 9)),
        np.zeros(len(mechanism.branches)),
        np.zeros(POWERS),
    )


@compiled(NOTHING, LAWS, MECHANISM, TANGENTS, MATRIX)
def _evaluate(laws: Laws, mechanism: Mechanism, tangents: Tangents, torques: Array) -> None:
    """Evaluate the laws of the displaced joints."""
    laws.joints(
        tangents.displacements,
        tangents.rates,
        mechanism.parameters,
        mechanism.branches,
        mechanism.law_rows,
        mechanism.law_bounds,
        torques,
        tangents.switching,
        tangents.powers,
    )


@compiled(NOTHING, MATRIX, MATRIX)
def _store_positive(raw: Array, result: Array) -> None:
    """Store the symmetric parts of matrices, changed so that they are not negative."""
    for j in range(len(raw)):
        xx, yy, zz = max(raw[j, 0], 0.0), max(raw[j, 4], 0.0), max(raw[j, 8], 0.0)
        xy, xz = 0.5 * (raw[j, 1] + raw[j, 3]), 0.5 * (raw[j, 2] + raw[j, 6])
        yz = 0.5 * (raw[j, 5] + raw[j, 7])
        a, b, c = sqrt(xx * yy), sqrt(xx * zz), sqrt(yy * zz)
        xy = min(max(xy, -_LARGEST_COUPLING * a), _LARGEST_COUPLING * a)
        xz = min(max(xz, -_LARGEST_COUPLING * b), _LARGEST_COUPLING * b)
        yz = min(max(yz, -_LARGEST_COUPLING * c), _LARGEST_COUPLING * c)
        store(result, j, 0, (xx, xy, xz, yy, yz, zz))


@compiled(NOTHING, LAWS, MECHANISM, SCRATCH, TANGENTS)
def _compute_tangents(
    laws: Laws, mechanism: Mechanism, scratch: Scratch, tangents: Tangents
) -> None:
    """Compute stiffness and damping of the joints in the state that was evaluated last."""
    x, v, base, torques = (
        tangents.displacements,
        tangents.rates,
        tangents.base,
        tangents.torques,
    )
    for j in range(len(x)):
        for k in range(3):
            x[j, k], v[j, k] = scratch.displacements[j, k], scratch.rates[j, k]
    _evaluate(laws, mechanism, tangents, base)
    measured = mechanism.measured
    for k in range(3):
        for j in range(len(x)):
            if measured[j, MEASURED_FORM] != ACTIVATION:
                x[j, k] += _ANGLE
        _evaluate(laws, mechanism, tangents, torques)
        for j in range(len(x)):
            if measured[j, MEASURED_FORM] != ACTIVATION:
                x[j, k] -= _ANGLE
            for n in range(3):
                tangents.raw[j, 3 * n + k] = (base[j, n] - torques[j, n]) / _ANGLE
    _store_positive(tangents.raw, tangents.stiffness)
    for k in range(3):
        for j in range(len(x)):
            v[j, k] += _RATE
        _evaluate(laws, mechanism, tangents, torques)
        for j in range(len(x)):
            v[j, k] -= _RATE
            for n in range(3):
                tangents.raw[j, 3 * n + k] = (base[j, n] - torques[j, n]) / _RATE
    _store_positive(tangents.raw, tangents.damping)


@compiled(NOTHING, MECHANISM, SCRATCH, TANGENTS, REAL, FLAG)
def _add_joints(
    mechanism: Mechanism, scratch: Scratch, tangents: Tangents, g: float, is_second: bool
) -> None:
    """Add the implicit part of the joints to their torques, and to `Scratch.added_inertia`."""
    links, measured, work, first = mechanism.links, mechanism.measured, scratch.work, tangents.first
    added = scratch.added_inertia
    for i in range(len(links)):
        j = tangents.rows[i, 0]
        if j < 0:
            continue
        turn = matrix(scratch.torque_axes, j, 0)
        stiffness, damping = symmetric(tangents.stiffness, j, 0), symmetric(tangents.damping, j, 0)
        if links[i, KIND] == BALL:
            parent = links[i, PARENT]
            spin, old, rate = vector(work, i, SPIN), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            if parent >= 0:
                spin = minus(spin, vector(work, parent, SPIN))
            if is_second:
                old, rate = vector(first, i, OLD_SPIN), vector(first, i, OLD_SPIN_RATE)
                if parent >= 0:
                    old = minus(old, vector(first, parent, OLD_SPIN))
                    rate = minus(rate, vector(first, parent, OLD_SPIN_RATE))
            moved = minus(spin, plus(times(2.0, old), times(4.0 * g, rate)))
            moved = apply_transposed(turn, moved)
            driven = apply_transposed(turn, times(-2.0, rate))
            torque = plus(apply_symmetric(stiffness, moved), apply_symmetric(damping, driven))
            for k in range(3):
                scratch.torques[j, k] -= g * torque[k]
            b = (
                g * damping[0] + g * g * stiffness[0],
                g * damping[1] + g * g * stiffness[1],
                g * damping[2] + g * g * stiffness[2],
                g * damping[3] + g * g * stiffness[3],
                g * damping[4] + g * g * stiffness[4],
                g * damping[5] + g * g * stiffness[5],
            )
            x = apply_symmetric(b, (turn[0], turn[1], turn[2]))
            y = apply_symmetric(b, (turn[3], turn[4], turn[5]))
            z = apply_symmetric(b, (turn[6], turn[7], turn[8]))
            store(
                added,
                i,
                0,
                (
                    turn[0] * x[0] + turn[1] * x[1] + turn[2] * x[2],
                    turn[0] * y[0] + turn[1] * y[1] + turn[2] * y[2],
                    turn[0] * z[0] + turn[1] * z[1] + turn[2] * z[2],
                    turn[3] * y[0] + turn[4] * y[1] + turn[5] * y[2],
                    turn[3] * z[0] + turn[4] * z[1] + turn[5] * z[2],
                    turn[6] * z[0] + turn[7] * z[1] + turn[8] * z[2],
                ),
            )
        elif links[i, COORDINATE] >= 0:
            along, resisted = stiffness[0], damping[0]
            if measured[j, MEASURED_LINK] < 0:
                axis = apply_transposed(turn, vector(work, i, AXIS))
                along = dot(axis, apply_symmetric(stiffness, axis))
                resisted = dot(axis, apply_symmetric(damping, axis))
            moved, driven = work[i, JOINT_RATE], 0.0
            if is_second:
                rate = first[i, OLD_JOINT + 1]
                moved -= 2.0 * first[i, OLD_JOINT] + 4.0 * g * rate
                driven = -2.0 * rate
            work[i, EFFORT] -= g * (along * moved + resisted * driven)
            added[i, 0] = g * resisted + g * g * along


@compiled(NOTHING, MECHANISM, SCRATCH, TANGENTS, REAL, FLAG)
def _add_contacts(
    mechanism: Mechanism, scratch: Scratch, tangents: Tangents, g: float, is_second: bool
) -> None:
    """Add the forces of props with their implicit part, and this to the inertia of the links."""
    groups, work, powers = mechanism.sphere_groups, scratch.work, scratch.powers
    first, gravity, touches = tangents.first, vector_in(mechanism.gravity, 0), scratch.touches
    count = find_touches(mechanism, scratch)
    for c in range(len(groups)):
        store(scratch.contact_forces, c, 0, (0.0, 0.0, 0.0))
    for t in range(count):
        c = scratch.touch_places[t, TOUCH_GROUP]
        i = groups[c, GROUP_LINK]
        force = vector(touches, t, TOUCH_FORCE)
        accumulate(scratch.contact_forces, c, 0, force)
        powers[IMPACT] += touches[t, TOUCH_IMPACT]
        powers[FRICTION] += touches[t, TOUCH_FRICTION_POWER]
        accumulate(work, i, FORCE, times(-1.0, force))
        accumulate(work, i, MOMENT, times(-1.0, vector(touches, t, TOUCH_MOMENT)))
        # At the deepest point the force loses C times its velocity, k n n times its displacement.
        normal, deepest = vector(touches, t, TOUCH_NORMAL), vector(touches, t, TOUCH_DEEPEST)
        speed = plus(vector(work, i, VELOCITY), cross(vector(work, i, SPIN), deepest))
        slip = minus(speed, times(dot(speed, normal), normal))
        k, friction = touches[t, TOUCH_STIFFNESS], touches[t, TOUCH_FRICTION]
        along, bend = touches[t, TOUCH_DAMPING] - friction, -touches[t, TOUCH_BEND]
        moved, driven = speed, (0.0, 0.0, 0.0)
        if is_second:
            old = cross(vector(first, i, OLD_SPIN), deepest)
            old = plus(vector(first, i, OLD_VELOCITY), old)
            rate = cross(vector(first, i, OLD_SPIN_RATE), deepest)
            rate = plus(vector(first, i, OLD_ACCELERATION), rate)
            moved = minus(speed, plus(times(2.0, old), times(4.0 * g, rate)))
            driven = times(-2.0, rate)
        driven = plus(driven, gravity)  # accelerations in the recursion are without gravity
        moved = plus(moved, times(g, gravity))
        lost = times(along * dot(normal, driven) + k * dot(normal, moved), normal)
        lost = plus(lost, plus(times(friction, driven), times(bend * dot(slip, driven), slip)))
        more = times(g, lost)
        accumulate(work, i, FORCE, more)
        accumulate(work, i, MOMENT, cross(deepest, more))
        nn, tt, ss = g * along + g * g * k, g * friction, g * bend
        m = (
            tt + nn * normal[0] * normal[0] + ss * slip[0] * slip[0],
            nn * normal[0] * normal[1] + ss * slip[0] * slip[1],
            nn * normal[0] * normal[2] + ss * slip[0] * slip[2],
            tt + nn * normal[1] * normal[1] + ss * slip[1] * slip[1],
            nn * normal[1] * normal[2] + ss * slip[1] * slip[2],
            tt + nn * normal[2] * normal[2] + ss * slip[2] * slip[2],
        )
        shifted = cross_symmetric(deepest, m)
        accumulate(work, i, LINEAR_INERTIA, m)
        accumulate(work, i, COUPLING_INERTIA, shifted)
        accumulate(work, i, ANGULAR_INERTIA, upper_half(cross_rows(deepest, shifted)))


@compiled(
    NOTHING, LAWS, MECHANISM, SCRATCH, TANGENTS, COUNT, REAL, VECTOR, REAL, FLAG, VECTOR, entry=True
)
def solve_stage(
    laws: Laws,
    mechanism: Mechanism,
    scratch: Scratch,
    tangents: Tangents,
    interval: int,
    time: float,
    state: Array,
    g: float,
    is_second: bool,
    rates: Array,
) -> None:
    """Compute k of the first stage, or k2 + 2 k1 of the second one, as rates of a state."""
    links, work, first = mechanism.links, scratch.work, tangents.first
    compute_kinematics(mechanism, scratch, interval, time, state)
    measure_joints(mechanism, scratch, interval, time, state)
    for p in range(POWERS):
        scratch.powers[p] = 0.0
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
    _add_joints(mechanism, scratch, tangents, g, is_second)
    compute_inertia_and_loads(mechanism, scratch, interval, time)
    _add_contacts(mechanism, scratch, tangents, g, is_second)
    if len(mechanism.pairs) > 0:
        laws.pairs(mechanism, scratch)
    eliminate_constraints(mechanism, scratch)
    compute_accelerations(mechanism, scratch, state, rates)
    gravity = vector_in(mechanism.gravity, 0)
    for i in range(len(links)):
        kind, coordinate, rate = links[i, KIND], links[i, COORDINATE], links[i, RATE]
        if kind == BALL:
            spin_rate, spin = vector(work, i, SPIN_RATE), vector(work, i, SPIN)
            if is_second:
                spin = minus(spin, times(2.0 * g, vector(first, i, OLD_SPIN_RATE)))
            spin = plus(spin, times(g, spin_rate))
            orientation = quaternion(work, i, ORIENTATION)
            store_in(rates, coordinate, quaternion_rate(orientation, spin))
        elif coordinate >= 0:
            rates[coordinate] += g * rates[rate]
            if is_second:
                rates[coordinate] -= 2.0 * g * first[i, OLD_JOINT + 1]
        if not is_second:
            acceleration = plus(vector(work, i, POINT_ACCELERATION), gravity)
            store(first, i, OLD_SPIN, vector(work, i, SPIN))
            store(first, i, OLD_VELOCITY, vector(work, i, VELOCITY))
            store(first, i, OLD_SPIN_RATE, vector(work, i, SPIN_RATE))
            store(first, i, OLD_ACCELERATION, acceleration)
            if kind != BALL and coordinate >= 0:
                first[i, OLD_JOINT], first[i, OLD_JOINT + 1] = work[i, JOINT_RATE], rates[rate]
    impulses = len(rates) - POWERS - 3 * len(scratch.contact_forces)
    for c in range(len(scratch.contact_forces)):
        store_in(rates, impulses + 3 * c, vector(scratch.contact_forces, c, 0))
    for p in range(POWERS):
        rates[len(rates) - POWERS + p] = scratch.powers[p]


@compiled(REAL, PROGRESS, COUNT, REAL, REAL)
def _step_error(progress: Progress, coordinates: int, step: float, tolerance: float) -> float:
    """Return the difference from the linearly implicit Euler method, over the tolerance."""
    first, second, size = progress.slopes[0], progress.slopes[1], progress.sums.shape[1]
    total = 0.0
    for k in range(size):
        weight = 1.0 if k < coordinates else RATE_WEIGHT
        error = weight * 0.5 * step * (second[k] - first[k])
        scale = tolerance * (1.0 + weight * max(abs(progress.state[k]), abs(progress.end[k])))
        total += (error / scale) ** 2
    return sqrt(total / size)


@compiled(COUNT, MECHANISM, SCRATCH)
def _turn_branches(mechanism: Mechanism, scratch: Scratch) -> int:
    """Set the signs of the branches; return the first one whose joint ends the run, or -1."""
    ended, first_joint = -1, len(mechanism.branches) - len(mechanism.measured)
    for k in range(len(mechanism.branches)):
        if mechanism.branches[k] * scratch.switching[k] < 0.0:
            mechanism.branches[k] = -mechanism.branches[k]
            is_joint = k >= first_joint
            if ended < 0 and is_joint and mechanism.measured[k - first_joint, MEASURED_ENDS_RUN]:
                ended = k
    return ended


@compiled(
    COUNT,
    EQUATIONS,
    MECHANISM,
    SCRATCH,
    TANGENTS,
    PROGRESS,
    COUNT,
    COUNT,
    VECTOR,
    MATRIX,
    REAL,
    REAL,
    COUNT,
    entry=True,
)
def march_implicitly(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    tangents: Tangents,
    progress: Progress,
    balls: int,
    coordinates: int,
    frames: Array,
    frame_states: Array,
    stop: float,
    tolerance: float,
    max_steps: int,
) -> int:
    """Integrate until the stop time, and write the states of the frames.

    Args:
        equations: equations of motion, without constraints beyond the tree.
        mechanism: tables.
        scratch: working memory of evaluations, with `added_inertia` of all links.
        tangents: memory of the implicit method.
        progress: the integration so far, which is continued.
        balls: number of balls, whose quaternions come first in a state.
        coordinates: number of coordinates, which come before rates.
        frames: times of the frames, shape (f,) [s].
        frame_states: result, shape (f, n); rows from `progress.counts[FRAME]` are written.
        stop: time of the end [s].
        tolerance: error of a step, relative to 1 + the size of each number of the state.
        max_steps: number of accepted and rejected steps after which to pause.

    Returns:
        `FINISHED`, `PAUSED`, `COLLAPSED` or `TURNED_OVER`.
    """
    state, clock, counts = progress.state, progress.clock, progress.counts
    end, trial, knots = progress.end, progress.trial, mechanism.knots
    first, second, added = progress.slopes[0], progress.slopes[1], scratch.added_inertia
    longest = LONGEST_CONTACT_STEP if mechanism.contact_offsets.size > 0 else inf
    taken, age = 0, STEPS_PER_TANGENT
    while True:
        interval, time = counts[INTERVAL], float(clock[TIME])
        if counts[NEEDS_FIRST_STAGE] or time >= stop:
            for i in range(len(added)):
                for k in range(6):
                    added[i, k] = 0.0
            settle_branches(equations, mechanism, scratch, interval, time, state, second, -1, 0.0)
            if counts[NEEDS_FIRST_STAGE]:
                age = STEPS_PER_TANGENT
                counts[NEEDS_FIRST_STAGE] = 0
                clock[UNCORRECTED] = 0.0
            if time >= stop:
                keep_step(equations, mechanism, scratch, progress)
                return FINISHED
        if taken >= max_steps:
            return PAUSED
        taken += 1
        limit = stop
        if interval + 1 < len(knots) and knots[interval + 1] < stop:
            limit = float(knots[interval + 1])
        step, reaches_limit = min(float(clock[STEP]), longest), False
        if len(mechanism.props) > 0:
            step = max(longest_flight(mechanism, scratch, step), 2.0 * SHORTEST_STEP)
        if time + step >= limit - SHORTEST_STEP:
            step, reaches_limit = limit - time, True
        elif step < SHORTEST_STEP:
            return COLLAPSED
        if age >= STEPS_PER_TANGENT:
            _compute_tangents(equations.laws, mechanism, scratch, tangents)
            age = 0
        g = GAMMA * step
        solve_stage(
            equations.laws, mechanism, scratch, tangents, interval, time, state, g, False, first
        )
        # Powers and forces of the last step were taken where the second stage was predicted to end.
        last = float(clock[UNCORRECTED])
        if last > 0.0:
            for k in range(progress.sums.shape[1], len(state)):
                state[k] += 0.5 * last * (first[k] - second[k])
            clock[UNCORRECTED] = 0.0
        if progress.path_times.size > 0 and not counts[SWITCH]:
            keep_step(equations, mechanism, scratch, progress)
        for k in range(len(state)):
            trial[k] = state[k] + step * first[k]
        normalize_quaternions(balls, trial)
        solve_stage(
            equations.laws,
            mechanism,
            scratch,
            tangents,
            interval,
            time + step,
            trial,
            g,
            True,
            second,
        )
        for k in range(len(state)):
            end[k] = state[k] + 0.5 * step * (first[k] + second[k])
        error = _step_error(progress, coordinates, step, tolerance)
        if not error <= 1.0:
            shrinkage = LARGEST_SHRINKAGE
            if error == error:
                shrinkage = max(shrinkage, SAFETY / sqrt(error))
            clock[STEP] = step * shrinkage
            counts[REJECTED] += 1
            counts[SWITCH] = 1  # the start of the step is recorded
            continue
        counts[STEPS] += 1
        counts[SWITCH] = 0
        age += 1
        grown = step * min(LARGEST_GROWTH, SAFETY / sqrt(max(error, 1e-12)))
        clock[STEP] = max(grown, clock[STEP]) if reaches_limit else grown
        normalize_quaternions(balls, end)
        reached = limit if reaches_limit else time + step
        while counts[FRAME] < len(frames) and frames[counts[FRAME]] <= reached:
            share = float(frames[counts[FRAME]] - time) / step
            row = frame_states[counts[FRAME]]
            for k in range(len(state)):
                begun = step * first[k]
                row[k] = state[k] + share * (begun + share * (end[k] - state[k] - begun))
            normalize_quaternions(balls, row)
            counts[FRAME] += 1
        for k in range(len(state)):
            state[k] = end[k]
        clock[TIME], clock[UNCORRECTED] = reached, step
        ended = _turn_branches(mechanism, scratch)
        if ended >= 0:
            counts[SWITCH] = ended
            return TURNED_OVER
        if reaches_limit and reached < stop:
            counts[INTERVAL] += 1
            counts[NEEDS_FIRST_STAGE] = 1
