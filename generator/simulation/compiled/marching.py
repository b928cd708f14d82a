"""Adaptive integration whose steps end at the breakpoints of laws and loads.

During a step every law keeps to one branch, so that the step is smooth. The stages of each step
show whether a breakpoint has been passed. It is then located on the continuous solution, the step
ends there, and the sign of its switching function is reversed.
"""

from math import inf

from generator.rotations import Array
from generator.simulation.compiled.breakpoints import (
    NO_BREAKPOINT,
    SLACK,
    locate_breakpoint,
    locate_graze,
    possible_crossings,
    store_margins,
)
from generator.simulation.compiled.compiler import COUNT, MATRIX, REAL, VECTOR, compiled
from generator.simulation.compiled.equations import EQUATIONS, Equations
from generator.simulation.compiled.flight import longest_flight
from generator.simulation.compiled.frames import settle_branches
from generator.simulation.compiled.layout import (
    MEASURED_ENDS_RUN,
    MECHANISM,
    SCRATCH,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.runge_kutta import (
    EVENTS,
    FRAME,
    INTERVAL,
    NEEDS_FIRST_STAGE,
    PROGRESS,
    REJECTED,
    STEP,
    STEPS,
    SWITCH,
    TIME,
    Progress,
    build_continuous,
    combine_stages,
    interpolate,
    keep_step,
    normalize_quaternions,
    step_error,
)
from generator.simulation.compiled.tableau import METHOD, Method

SHORTEST_STEP = 1e-12
"""Step below which an integration has failed [s]."""

SHARE_AFTER_BREAKPOINT = 0.7
"""Largest step after a breakpoint over the one before. What suits the motion before, such as that
in a dead zone, may be so long for the motion after it that the error estimates cancel."""

LONGEST_CONTACT_STEP = 5e-3
"""Longest step of a figure that may touch props [s]. In a longer one, as in free flight, a segment
could pass through a prop between two stages. It is that of the first pass of Exudyn as well."""

FINISHED, PAUSED, COLLAPSED, TURNED_OVER = range(4)
"""Ends of `march`: the stop time, the number of steps allowed, a step that became too short, a
joint at 180 deg whose law is not defined there."""

SAFETY = 0.8
"""Share of the step that the error estimate permits; 0.9 rejects twice as many steps."""

LARGEST_GROWTH, LARGEST_SHRINKAGE = 10.0, 0.2
"""Bounds of the ratio of two steps."""


@compiled(
    COUNT,
    METHOD,
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
    method: Method,
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
        method: Runge-Kutta method.
        equations: equations of motion.
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
    end, knots, last_stage = progress.end, mechanism.knots, method.end_stage
    first_joint = len(mechanism.branches) - len(mechanism.measured)
    has_rows = len(mechanism.rows) > 0
    longest = LONGEST_CONTACT_STEP if mechanism.contact_offsets.size > 0 else inf
    taken = 0
    while True:
        interval, time = counts[INTERVAL], float(clock[TIME])
        if time >= stop:
            return FINISHED
        if counts[NEEDS_FIRST_STAGE]:
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
            counts[NEEDS_FIRST_STAGE] = 0
            store_margins(mechanism, scratch, progress, 0)
            if counts[STEPS] == 0:
                keep_step(equations, mechanism, scratch, progress)
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
        earliest = NO_BREAKPOINT
        for s in range(1, last_stage + 1):
            stage = end if s == last_stage else progress.trial
            combine_stages(state, step, method.weights[s], slopes, s, stage)
            at = time + method.nodes[s] * step
            equations.compute_rates(
                equations.laws, mechanism, scratch, interval, at, stage, slopes[s]
            )
            if store_margins(mechanism, scratch, progress, s):
                earliest = min(earliest, method.nodes[s])
        error = step_error(method, progress, step, tolerance)
        if not error <= 1.0:
            shrinkage = LARGEST_SHRINKAGE
            if error == error:
                shrinkage = max(shrinkage, SAFETY * error ** (-1.0 / method.error_order))
            clock[STEP] = step * shrinkage
            counts[REJECTED] += 1
            continue
        if has_rows:
            # The continuous solution needs the end as it is; the next step starts on the
            # constraints.
            for k in range(len(state)):
                progress.projected[k] = end[k]
            normalize_quaternions(balls, progress.projected)
            if not equations.project(
                equations.laws,
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
            growth = min(growth, SAFETY * error ** (-1.0 / method.error_order))
        grown = step * growth
        clock[STEP] = max(grown, clock[STEP]) if reaches_limit else grown
        share, has_continuous = NO_BREAKPOINT, False
        if earliest <= 1.0:
            build_continuous(method, equations, mechanism, scratch, progress, step)
            has_continuous = True
            share = locate_breakpoint(
                method, equations, mechanism, scratch, progress, balls, step, earliest
            )
        for n in range(possible_crossings(method, progress)):
            if not has_continuous:
                build_continuous(method, equations, mechanism, scratch, progress, step)
                has_continuous = True
            switch, suspected = progress.passed[n], float(progress.shares[n])
            graze = locate_graze(
                equations, mechanism, scratch, progress, balls, step, switch, suspected
            )
            if graze < share:
                share, counts[SWITCH] = graze, switch
        reached = limit if reaches_limit else time + step
        if share <= 1.0:
            reached = time + share * step
        while counts[FRAME] < len(frames) and frames[counts[FRAME]] <= reached:
            if not has_continuous:
                build_continuous(method, equations, mechanism, scratch, progress, step)
                has_continuous = True
            at = float(frames[counts[FRAME]] - time) / step
            interpolate(
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
            interpolate(equations, mechanism, scratch, progress, balls, step, share, progress.trial)
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
                and mechanism.measured[switch - first_joint, MEASURED_ENDS_RUN]
            ):
                return TURNED_OVER
            settle_branches(
                equations, mechanism, scratch, interval, reached, state, slopes[0], switch, SLACK
            )
            store_margins(mechanism, scratch, progress, 0)
            keep_step(equations, mechanism, scratch, progress)
            continue
        for k in range(len(state)):
            state[k] = progress.projected[k] if has_rows else end[k]
            slopes[0, k] = slopes[last_stage, k]
        for k in range(len(mechanism.branches)):
            progress.margins[0, k] = progress.margins[last_stage, k]
        normalize_quaternions(balls, state)
        clock[TIME] = reached
        if has_rows:
            equations.compute_rates(
                equations.laws, mechanism, scratch, interval, reached, state, slopes[0]
            )
        elif has_continuous and len(mechanism.sphere_groups) > 0:
            # For the record; neither frames nor a record change a bit of the motion.
            equations.compute_rates(
                equations.laws, mechanism, scratch, interval, reached, state, progress.spare
            )
        keep_step(equations, mechanism, scratch, progress)
        if reaches_limit and reached < stop:
            counts[INTERVAL] += 1
            counts[NEEDS_FIRST_STAGE] = 1
