"""Adaptive integration by DOP853 whose steps end at the breakpoints of laws and loads.

During a step every law keeps to one branch, so that the step is smooth. A *switching function* is
positive or negative on either side of a breakpoint; its sign, held in `Mechanism.branches`, is
wrong after the breakpoint has been passed. The stages of each step show such a passage. The zero is
then located on the continuous solution, the step ends there, and the sign is reversed.

A zero counts as passed when the function is `SLACK` beyond it. After the reversal it is thus
clearly on its new side: a start on a breakpoint, or a track that grazes one, needs no special
treatment.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numba import types

from generator.rotations import Array
from generator.simulation.compiled.algebra import quaternion_in, store_in, unit
from generator.simulation.compiled.compiler import (
    CONSTANT_VECTOR,
    COUNT,
    FLAG,
    INDICES,
    MATRIX,
    NOTHING,
    REAL,
    VECTOR,
    compiled,
)
from generator.simulation.compiled.layout import (
    MECHANISM,
    POWERS,
    ROW_ENDS_AT_HALF_TURN,
    SCRATCH,
    IndexArray,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.projection import project_state, settle_branches
from generator.simulation.compiled.recursion import EQUATIONS, Equations
from generator.simulation.compiled.tableau import (
    CONTINUOUS,
    ERROR_3,
    ERROR_5,
    NODES,
    STAGES,
)

SLACK = 1e-10
"""Distance beyond a breakpoint at which it counts as passed [rad, m or 1]."""

SHORTEST_STEP = 1e-12
"""Step below which an integration has failed [s]."""

SHARE_AFTER_BREAKPOINT = 0.7
"""Largest step after a breakpoint over the one before. What suits the motion before, such as that
in a dead zone, can be so long after it that the two error estimates of the method cancel."""

FINISHED, PAUSED, COLLAPSED, TURNED_OVER = range(4)
"""Ends of `march`: the stop time, the number of steps allowed, a step that became too short, a
joint at 180 deg whose law is not defined there."""

TIME, STEP = range(2)
"""Columns of `Progress.clock` [s]."""

EVALUATIONS, STEPS, REJECTED, FRAME, INTERVAL, EVENTS, FRESH, SWITCH = range(8)
"""Columns of `Progress.counts`: evaluations, accepted and rejected steps, the next frame, the
interval of time, breakpoints passed, 1 where the rates at the start of the step are to be computed,
and the switching function of the last breakpoint."""

MAX_EVENTS = 100_000
"""Number of breakpoints of a run whose times are kept."""

_ORDER = 8.0

SAFETY = 0.8
"""Share of the step that the error estimate permits; 0.9 rejects twice as many steps."""

LARGEST_GROWTH, LARGEST_SHRINKAGE = 10.0, 0.2
"""Bounds of the ratio of two steps."""


class Progress(NamedTuple):
    """An integration in progress: its state, and the working memory of a step; n numbers a state.

    Attributes:
        state: shape (n,).
        clock: time and next step, shape (2,) [s].
        counts: shape (8,).
        event_times: times of the first e breakpoints passed [s], shape (e,).
        event_switches: their switching functions, shape (e,).
        slopes: rates at the stages, shape (16, n).
        end: state at the end of the step, shape (n,).
        trial: another state, shape (n,).
        projected: state at the end of the step on the constraints beyond the tree, shape (n,).
        spare: rates that are not kept, shape (n,).
        continuous: coefficients of the continuous solution, shape (7, n).
        sums: sums of the error estimates, shape (2, n).
        passed: switching functions that have passed zero, shape (s,).
    """

    state: Array
    clock: Array
    counts: IndexArray
    event_times: Array
    event_switches: IndexArray
    slopes: Array
    end: Array
    trial: Array
    projected: Array
    spare: Array
    continuous: Array
    sums: Array
    passed: IndexArray


PROGRESS = types.NamedTuple(
    (
        VECTOR,
        VECTOR,
        INDICES,
        VECTOR,
        INDICES,
        MATRIX,
        VECTOR,
        VECTOR,
        VECTOR,
        VECTOR,
        MATRIX,
        MATRIX,
        INDICES,
    ),
    Progress,
)

_GRID = np.unique(NODES[:13])[1:]
"""Places within a step at which the continuous solution is searched for breakpoints."""


def start_progress(
    state: Array, time: float, step: float, switches: int, max_events: int = MAX_EVENTS
) -> Progress:
    """Return the integration of a state from a time with a first step [s].

    Args:
        state: shape (n,); copied.
        time: [s].
        step: length of the first step [s].
        switches: number of switching functions.
        max_events: number of breakpoints whose times are kept.
    """
    size = len(state)
    counts = np.zeros(8, dtype=np.int64)
    counts[FRESH] = 1
    return Progress(
        state.copy(),
        np.array([time, step]),
        counts,
        np.zeros(max_events),
        np.zeros(max_events, dtype=np.int64),
        np.zeros((16, size)),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros((7, size)),
        np.zeros((2, size)),
        np.zeros(switches, dtype=np.int64),
    )


@compiled(NOTHING, VECTOR, REAL, CONSTANT_VECTOR, MATRIX, COUNT, VECTOR, vectorised=True)
def _combine(
    state: Array, step: float, weights: Array, slopes: Array, stages: int, result: Array
) -> None:
    """Set the result to state + step * sum of weights times slopes."""
    size = len(state)
    for k in range(size):
        result[k] = 0.0
    for s in range(stages):
        weight = weights[s]
        if weight != 0.0:
            for k in range(size):
                result[k] += weight * slopes[s, k]
    for k in range(size):
        result[k] = state[k] + step * result[k]


@compiled(REAL, PROGRESS, REAL, REAL, vectorised=True)
def _step_error(progress: Progress, step: float, tolerance: float) -> float:
    """Return the error of a step over the tolerance; the integrals of powers do not count."""
    state, end, fifth, third = progress.state, progress.end, progress.sums[0], progress.sums[1]
    size = len(state) - POWERS
    for k in range(size):
        fifth[k] = 0.0
        third[k] = 0.0
    for s in range(13):
        a, b = ERROR_5[s], ERROR_3[s]
        if a != 0.0 or b != 0.0:
            for k in range(size):
                fifth[k] += a * progress.slopes[s, k]
                third[k] += b * progress.slopes[s, k]
    square_5, square_3 = 0.0, 0.0
    for k in range(size):
        scale = 1.0 / (tolerance * (1.0 + max(abs(state[k]), abs(end[k]))))
        square_5 += (fifth[k] * scale) ** 2
        square_3 += (third[k] * scale) ** 2
    if square_5 == 0.0 and square_3 == 0.0:
        return 0.0
    return step * square_5 / sqrt((square_5 + 0.01 * square_3) * size)


@compiled(NOTHING, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, REAL)
def _build_continuous(
    equations: Equations, mechanism: Mechanism, scratch: Scratch, progress: Progress, step: float
) -> None:
    """Compute the continuous solution of the step, by three more stages."""
    state, end, slopes = progress.state, progress.end, progress.slopes
    F, interval, time = progress.continuous, progress.counts[INTERVAL], progress.clock[TIME]
    for s in range(13, 16):
        _combine(state, step, STAGES[s], slopes, s, progress.trial)
        at = time + NODES[s] * step
        equations.compute_rates(
            equations.law, mechanism, scratch, interval, at, progress.trial, slopes[s]
        )
    progress.counts[EVALUATIONS] += 3
    for k in range(len(state)):
        change = end[k] - state[k]
        F[0, k] = change
        F[1, k] = step * slopes[0, k] - change
        F[2, k] = 2.0 * change - step * (slopes[12, k] + slopes[0, k])
        for m in range(3, 7):
            F[m, k] = 0.0
    for m in range(4):
        for s in range(16):
            weight = step * CONTINUOUS[m, s]
            if weight != 0.0:
                for k in range(len(state)):
                    F[3 + m, k] += weight * slopes[s, k]


@compiled(NOTHING, COUNT, VECTOR)
def _normalize(balls: int, state: Array) -> None:
    for ball in range(balls):
        store_in(state, 4 * ball, unit(quaternion_in(state, 4 * ball)))


@compiled(NOTHING, PROGRESS, COUNT, REAL, VECTOR, vectorised=True)
def _interpolate(progress: Progress, balls: int, share: float, result: Array) -> None:
    """Set the result to the continuous solution at a share of the step."""
    F, rest = progress.continuous, 1.0 - share
    for k in range(len(result)):
        value = F[6, k] * share
        value = (value + F[5, k]) * rest
        value = (value + F[4, k]) * share
        value = (value + F[3, k]) * rest
        value = (value + F[2, k]) * share
        value = (value + F[1, k]) * rest
        result[k] = progress.state[k] + (value + F[0, k]) * share
    _normalize(balls, result)


@compiled(NOTHING, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, COUNT, REAL, REAL, VECTOR)
def _interpolate_on_constraints(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    balls: int,
    step: float,
    share: float,
    result: Array,
) -> None:
    """Set the result to the continuous solution, projected onto the constraints."""
    _interpolate(progress, balls, share, result)
    if len(mechanism.rows) > 0:
        at = progress.clock[TIME] + share * step
        interval = progress.counts[INTERVAL]
        project_state(equations, mechanism, scratch, interval, at, result, progress.spare)


@compiled(FLAG, MECHANISM, SCRATCH)
def _has_passed(mechanism: Mechanism, scratch: Scratch) -> bool:
    """Return whether a switching function of the last evaluation is beyond its zero."""
    for k in range(len(mechanism.branches)):
        if mechanism.branches[k] * scratch.switching[k] < -SLACK:
            return True
    return False


@compiled(REAL, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, COUNT, REAL, REAL, COUNT)
def _margin(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    balls: int,
    step: float,
    share: float,
    switch: int,
) -> float:
    """Return the distance of a switching function from being passed, at a share of the step."""
    _interpolate_on_constraints(
        equations, mechanism, scratch, progress, balls, step, share, progress.trial
    )
    at = progress.clock[TIME] + share * step
    equations.evaluate_laws(
        equations.law, mechanism, scratch, progress.counts[INTERVAL], at, progress.trial
    )
    return mechanism.branches[switch] * scratch.switching[switch] + SLACK


@compiled(REAL, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, COUNT, REAL, REAL, REAL, COUNT)
def _locate_zero(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    balls: int,
    step: float,
    before: float,
    after: float,
    switch: int,
) -> float:
    """Return the share of the step at which a margin is zero, by the Illinois method."""
    low = _margin(equations, mechanism, scratch, progress, balls, step, before, switch)
    if low <= 0.0:
        return before
    high = _margin(equations, mechanism, scratch, progress, balls, step, after, switch)
    share, side = after, 0
    for _ in range(60):
        share = after - high * (after - before) / (high - low)
        if not before < share < after:
            share = 0.5 * (before + after)
        middle = _margin(equations, mechanism, scratch, progress, balls, step, share, switch)
        if abs(middle) < 0.25 * SLACK or after - before < 1e-15:
            break
        if middle < 0.0:
            after, high = share, middle
            if side < 0:
                low *= 0.5
            side = -1
        else:
            before, low = share, middle
            if side > 0:
                high *= 0.5
            side = 1
    return share


@compiled(REAL, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, COUNT, REAL, REAL)
def _locate_breakpoint(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    balls: int,
    step: float,
    earliest: float,
) -> float:
    """Return the share of the step at the first breakpoint, 2.0 if none is passed.

    It is searched for from the earliest share at which a stage has passed one. The switching
    function is left in `progress.counts[SWITCH]`.
    """
    before = 0.0
    for m in range(len(_GRID)):
        after = _GRID[m]
        if after < earliest:
            before = after
            continue
        _margin(equations, mechanism, scratch, progress, balls, step, after, 0)
        count = 0
        for k in range(len(mechanism.branches)):
            if mechanism.branches[k] * scratch.switching[k] < -SLACK:
                progress.passed[count] = k
                count += 1
        if count > 0:
            # The zero of one function; then those of the others that it has not excluded.
            first = after
            for n in range(count):
                k = progress.passed[n]
                if (
                    n > 0
                    and _margin(equations, mechanism, scratch, progress, balls, step, first, k)
                    > 0.0
                ):
                    continue
                first = _locate_zero(
                    equations, mechanism, scratch, progress, balls, step, before, first, k
                )
                progress.counts[SWITCH] = k
            return first
        before = after
    return 2.0


@compiled(
    COUNT,
    EQUATIONS,
    MECHANISM,
    SCRATCH,
    PROGRESS,
    COUNT,
    VECTOR,
    MATRIX,
    REAL,
    REAL,
    COUNT,
    entry=True,
)
def march(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    balls: int,
    frames: Array,
    frame_states: Array,
    stop: float,
    tolerance: float,
    max_steps: int,
) -> int:
    """Integrate until the stop time, and write the states of the frames.

    Args:
        equations: of motion.
        mechanism: tables.
        scratch: working memory of evaluations.
        progress: the integration so far, which is continued.
        balls: number of balls, whose quaternions come first in a state.
        frames: times of the frames, shape (f,) [s].
        frame_states: result, shape (f, n); rows from `progress.counts[FRAME]` are written.
        stop: time of the end [s].
        tolerance: error of a step, relative to 1 + the size of each number of the state.
        max_steps: number of accepted and rejected steps after which to pause.

    Returns:
        `FINISHED`, `PAUSED`, `COLLAPSED` or `TURNED_OVER`.
    """
    state, clock, counts, slopes = progress.state, progress.clock, progress.counts, progress.slopes
    end, knots = progress.end, mechanism.knots
    first_joint = len(mechanism.branches) - len(mechanism.measured)
    has_rows = len(mechanism.rows) > 0
    taken = 0
    while True:
        interval, time = counts[INTERVAL], float(clock[TIME])
        if time >= stop:
            return FINISHED
        if counts[FRESH]:
            settle_branches(
                equations,
                mechanism,
                scratch,
                interval,
                time,
                state,
                slopes[0],
                -1,
                SLACK * (counts[STEPS] > 0),
            )
            counts[FRESH] = 0
            counts[EVALUATIONS] += 1
        if taken >= max_steps:
            return PAUSED
        taken += 1
        limit = stop
        if interval + 1 < len(knots) and knots[interval + 1] < stop:
            limit = float(knots[interval + 1])
        step, reaches_limit = float(clock[STEP]), False
        if time + step >= limit - SHORTEST_STEP:
            step, reaches_limit = limit - time, True
        elif step < SHORTEST_STEP:
            return COLLAPSED
        earliest = 2.0
        for s in range(1, 13):
            stage = end if s == 12 else progress.trial
            _combine(state, step, STAGES[s], slopes, s, stage)
            at = time + NODES[s] * step
            equations.compute_rates(
                equations.law, mechanism, scratch, interval, at, stage, slopes[s]
            )
            if NODES[s] < earliest and _has_passed(mechanism, scratch):
                earliest = NODES[s]
        counts[EVALUATIONS] += 12
        error = _step_error(progress, step, tolerance)
        if not error <= 1.0:
            shrinkage = LARGEST_SHRINKAGE
            if error == error:
                shrinkage = max(shrinkage, SAFETY * error ** (-1.0 / _ORDER))
            clock[STEP] = step * shrinkage
            counts[REJECTED] += 1
            continue
        if has_rows:
            # The continuous solution needs the end as it is; the next step starts on the
            # constraints.
            for k in range(len(state)):
                progress.projected[k] = end[k]
            _normalize(balls, progress.projected)
            if not project_state(
                equations,
                mechanism,
                scratch,
                interval,
                time + step,
                progress.projected,
                progress.spare,
            ):
                clock[STEP] = LARGEST_SHRINKAGE * step
                counts[REJECTED] += 1
                continue
        counts[STEPS] += 1
        growth = LARGEST_GROWTH
        if error > 0.0:
            growth = min(growth, SAFETY * error ** (-1.0 / _ORDER))
        grown = step * growth
        clock[STEP] = max(grown, clock[STEP]) if reaches_limit else grown
        share, has_continuous = 2.0, False
        if earliest <= 1.0:
            _build_continuous(equations, mechanism, scratch, progress, step)
            has_continuous = True
            share = _locate_breakpoint(
                equations, mechanism, scratch, progress, balls, step, earliest
            )
        reached = limit if reaches_limit else time + step
        if share <= 1.0:
            reached = time + share * step
        while counts[FRAME] < len(frames) and frames[counts[FRAME]] <= reached:
            if not has_continuous:
                _build_continuous(equations, mechanism, scratch, progress, step)
                has_continuous = True
            at = float(frames[counts[FRAME]] - time) / step
            _interpolate_on_constraints(
                equations,
                mechanism,
                scratch,
                progress,
                balls,
                step,
                at,
                frame_states[counts[FRAME]],
            )
            counts[FRAME] += 1
        if share <= 1.0:
            _interpolate_on_constraints(
                equations, mechanism, scratch, progress, balls, step, share, progress.trial
            )
            for k in range(len(state)):
                state[k] = progress.trial[k]
            clock[TIME] = reached
            clock[STEP] = min(grown, SHARE_AFTER_BREAKPOINT * step)
            switch = counts[SWITCH]
            mechanism.branches[switch] = -mechanism.branches[switch]
            if counts[EVENTS] < len(progress.event_times):
                progress.event_times[counts[EVENTS]] = reached
                progress.event_switches[counts[EVENTS]] = switch
            counts[EVENTS] += 1
            if (
                switch >= first_joint
                and mechanism.measured[switch - first_joint, ROW_ENDS_AT_HALF_TURN]
            ):
                return TURNED_OVER
            settle_branches(
                equations, mechanism, scratch, interval, reached, state, slopes[0], switch, SLACK
            )
            counts[EVALUATIONS] += 1
            continue
        for k in range(len(state)):
            state[k] = progress.projected[k] if has_rows else end[k]
            slopes[0, k] = slopes[12, k]
        _normalize(balls, state)
        clock[TIME] = reached
        if has_rows:
            equations.compute_rates(
                equations.law, mechanism, scratch, interval, reached, state, slopes[0]
            )
            counts[EVALUATIONS] += 3
        if reaches_limit and reached < stop:
            counts[INTERVAL] += 1
            counts[FRESH] = 1
