"""Adaptive integration by DOP853 whose steps end at the breakpoints of laws and loads.

During a step every law keeps to one branch, so that the step is smooth. The stages of each step
show whether a breakpoint has been passed. It is then located on the continuous solution, the step
ends there, and the sign of its switching function is reversed.
"""

from math import inf, sqrt

from generator.rotations import Array
from generator.simulation.compiled.algebra import apply, cross, dot, matrix, plus, vector
from generator.simulation.compiled.breakpoints import (
    NO_BREAKPOINT,
    SLACK,
    locate_breakpoint,
    locate_graze,
    possible_crossings,
    store_margins,
)
from generator.simulation.compiled.compiler import COUNT, FLAG, MATRIX, REAL, VECTOR, compiled
from generator.simulation.compiled.equations import EQUATIONS, Equations
from generator.simulation.compiled.frames import settle_branches
from generator.simulation.compiled.layout import (
    CONTACT_SWITCHES,
    MEASURED_ENDS_RUN,
    MECHANISM,
    PROP_LARGEST,
    PROP_LEAST,
    ROTATION,
    SCRATCH,
    SPHERE_CENTRE,
    SPHERE_LINK,
    SPHERE_RADIUS,
    SPIN,
    STIFF,
    TOUCH,
    VELOCITY,
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
from generator.simulation.compiled.tableau import END_STAGE, NODES, STAGES

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

_ORDER = 8.0
"""Order of the method, and so of its error estimate in the step."""

SAFETY = 0.8
"""Share of the step that the error estimate permits; 0.9 rejects twice as many steps."""

LARGEST_GROWTH, LARGEST_SHRINKAGE = 10.0, 0.2
"""Bounds of the ratio of two steps."""

EARLIEST_SHARE = 0.3
"""Share of a step before which a contact may not leave the transition of a surface. Far beyond it
the branch of the step has forces so large that the next stages are thrown off the prop, and those
that the error estimate consists of have none."""


SHORTEST_TRANSITION = 1e-9
"""Step up to which this is not required [s]."""


@compiled(COUNT, MECHANISM)
def _first_contact(mechanism: Mechanism) -> int:
    """Return the first switching function of contact."""
    contacts = len(mechanism.spheres) * len(mechanism.props) + len(mechanism.pairs)
    return len(mechanism.branches) - len(mechanism.measured) - CONTACT_SWITCHES * contacts


@compiled(FLAG, MECHANISM, PROGRESS, COUNT)
def _leaves_transition(mechanism: Mechanism, progress: Progress, stage: int) -> bool:
    """Return whether a contact leaves the transition of its surface before a stage."""
    branches, margins = mechanism.branches, progress.margins
    first, last = _first_contact(mechanism), len(branches) - len(mechanism.measured)
    for at in range(first, last, CONTACT_SWITCHES):
        touch, stiff = at + TOUCH, at + STIFF
        is_left = margins[stage, touch] < 0.0 or margins[stage, stiff] < 0.0
        if is_left and branches[touch] > 0.0 and branches[stiff] < 0.0:
            return True
    return False


@compiled(REAL, MECHANISM, SCRATCH, PROGRESS, REAL)
def _longest_flight(
    mechanism: Mechanism, scratch: Scratch, progress: Progress, step: float
) -> float:
    """Return the longest step in which no sphere passes through a prop near it, between stages.

    Args:
        mechanism: tables.
        scratch: evaluation at the start of the step, or near it.
        progress: progress with the margins at the start.
        step: intended step [s].
    """
    spheres, places, props = mechanism.spheres, mechanism.sphere_constants, mechanism.prop_constants
    longest = step
    x, y, z = mechanism.gravity
    gravity = sqrt(x * x + y * y + z * z)
    for s in range(len(spheres)):
        i = spheres[s, SPHERE_LINK]
        arm = apply(matrix(scratch.work, i, ROTATION), vector(places, s, SPHERE_CENTRE))
        turning = cross(vector(scratch.work, i, SPIN), arm)
        velocity = plus(vector(scratch.work, i, VELOCITY), turning)
        speed = sqrt(dot(velocity, velocity))
        reach = step * (speed + 0.5 * gravity * step)
        for d in range(len(props)):
            touch = _first_contact(mechanism) + CONTACT_SWITCHES * (s * len(props) + d) + TOUCH
            is_near = mechanism.branches[touch] < 0.0 and progress.margins[0, touch] < reach
            if not is_near:
                continue
            width = inf
            for k in range(3):
                width = min(width, float(props[d, PROP_LARGEST + k] - props[d, PROP_LEAST + k]))
            width += 2.0 * places[s, SPHERE_RADIUS]
            if reach > width:
                # The positive root of width = speed t + gravity t^2 / 2.
                root = sqrt(speed * speed + 2.0 * gravity * width)
                longest = min(longest, 2.0 * width / (speed + root))
    return longest


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
    end, knots = progress.end, mechanism.knots
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
        if taken >= max_steps:
            return PAUSED
        taken += 1
        limit = stop
        if interval + 1 < len(knots) and knots[interval + 1] < stop:
            limit = float(knots[interval + 1])
        step, reaches_limit = min(float(clock[STEP]), longest), False
        if len(mechanism.props) > 0:
            step = max(_longest_flight(mechanism, scratch, progress, step), 2.0 * SHORTEST_STEP)
        if time + step >= limit - SHORTEST_STEP:
            step, reaches_limit = limit - time, True
        elif step < SHORTEST_STEP:
            return COLLAPSED
        earliest, is_too_long = NO_BREAKPOINT, False
        for s in range(1, END_STAGE + 1):
            stage = end if s == END_STAGE else progress.trial
            combine_stages(state, step, STAGES[s], slopes, s, stage)
            at = time + NODES[s] * step
            equations.compute_rates(
                equations.laws, mechanism, scratch, interval, at, stage, slopes[s]
            )
            if store_margins(mechanism, scratch, progress, s) and NODES[s] < earliest:
                earliest = NODES[s]
                if NODES[s] < EARLIEST_SHARE and step > SHORTEST_TRANSITION:
                    is_too_long = _leaves_transition(mechanism, progress, s)
                    if is_too_long:
                        break
        if is_too_long:
            clock[STEP] = step * max(earliest, LARGEST_SHRINKAGE)
            counts[REJECTED] += 1
            continue
        error = step_error(progress, step, tolerance)
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
            growth = min(growth, SAFETY * error ** (-1.0 / _ORDER))
        grown = step * growth
        clock[STEP] = max(grown, clock[STEP]) if reaches_limit else grown
        share, has_continuous = NO_BREAKPOINT, False
        if earliest <= 1.0:
            build_continuous(equations, mechanism, scratch, progress, step)
            has_continuous = True
            share = locate_breakpoint(
                equations, mechanism, scratch, progress, balls, step, earliest
            )
        for n in range(possible_crossings(progress)):
            if not has_continuous:
                build_continuous(equations, mechanism, scratch, progress, step)
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
                build_continuous(equations, mechanism, scratch, progress, step)
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
            keep_step(progress)
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
            continue
        for k in range(len(state)):
            state[k] = progress.projected[k] if has_rows else end[k]
            slopes[0, k] = slopes[END_STAGE, k]
        for k in range(len(mechanism.branches)):
            progress.margins[0, k] = progress.margins[END_STAGE, k]
        normalize_quaternions(balls, state)
        clock[TIME] = reached
        keep_step(progress)
        if has_rows:
            equations.compute_rates(
                equations.laws, mechanism, scratch, interval, reached, state, slopes[0]
            )
        if reaches_limit and reached < stop:
            counts[INTERVAL] += 1
            counts[NEEDS_FIRST_STAGE] = 1
