"""A step of a Runge-Kutta method: its error, and its continuous solution."""

from math import sqrt
from typing import NamedTuple

from generator.rotations import Array
from generator.simulation.compiled.algebra import quaternion_in, store_in, unit
from generator.simulation.compiled.compiler import (
    COUNT,
    MATRIX,
    NOTHING,
    REAL,
    VECTOR,
    Indices,
    Matrix,
    Vector,
    compiled,
    compiled_type,
)
from generator.simulation.compiled.equations import EQUATIONS, Equations
from generator.simulation.compiled.layout import (
    MECHANISM,
    SCRATCH,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.tableau import (
    METHOD,
    Method,
)

TIME, STEP, UNCORRECTED = range(3)
"""Places in `Progress.clock` [s]."""

STEPS, REJECTED, FRAME, INTERVAL, EVENTS, NEEDS_FIRST_STAGE, SWITCH, PATH = range(8)
"""Places in `Progress.counts`: accepted and rejected steps, the next frame, the interval of time,
breakpoints passed, 1 where the rates at the start of the step are to be computed, the switching
function of the last breakpoint, and the number of steps whose ends are kept."""

COUNTS = 8

MAX_EVENTS = 100_000
"""Number of breakpoints of a run whose times are kept."""


class Progress(NamedTuple):
    """An integration in progress: its state, and the working memory of a step; n numbers a state.

    Attributes:
        state: shape (n,).
        clock: time, next step, and the last step while its integrals hold a predicted power, else
            0, shape (3,) [s].
        counts: shape (8,).
        event_times: times of the first e breakpoints passed [s], shape (e,).
        event_switches: their switching functions, shape (e,).
        slopes: rates at the stages, shape (16, n).
        end: state at the end of the step, shape (n,).
        trial: another state, shape (n,).
        projected: state at the end of the step on the constraints beyond the tree, shape (n,).
        spare: rates that are not kept, shape (n,).
        continuous: coefficients of the continuous solution, shape (7, n).
        sums: sums of the error estimates, shape (2, m): of the first m numbers of a state, which
            are not integrals of powers and forces.
        passed: switching functions that have passed zero, shape (s,).
        shares: shares of the step at which suspected ones may have passed it, shape (s,).
        margins: distances of the switching functions from being passed, at the start and at the
            stages, shape (13, s).
        path_times: start, and ends of the last accepted steps, as many as there is room for, shape
            (p,) [s].
        path_rows: their records of contact, shape (p, r); see `STEP_CENTRE`.
    """

    state: Vector
    clock: Vector
    counts: Indices
    event_times: Vector
    event_switches: Indices
    slopes: Matrix
    end: Vector
    trial: Vector
    projected: Vector
    spare: Vector
    continuous: Matrix
    sums: Matrix
    passed: Indices
    shares: Vector
    margins: Matrix
    path_times: Vector
    path_rows: Matrix


PROGRESS = compiled_type(Progress)


@compiled(NOTHING, VECTOR, REAL, VECTOR, MATRIX, COUNT, VECTOR, vectorised=True)
def combine_stages(
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


@compiled(REAL, METHOD, PROGRESS, REAL, REAL, vectorised=True)
def step_error(method: Method, progress: Progress, step: float, tolerance: float) -> float:
    """Return the error of a step over the tolerance; the integrals do not count."""
    state, end, fifth, third = progress.state, progress.end, progress.sums[0], progress.sums[1]
    size = len(fifth)
    for k in range(size):
        fifth[k] = 0.0
        third[k] = 0.0
    for s in range(method.end_stage + 1):
        a, b = method.errors[0, s], method.errors[1, s]
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


@compiled(NOTHING, METHOD, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, REAL)
def build_continuous(
    method: Method,
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    step: float,
) -> None:
    """Compute the continuous solution of the step, by the stages beyond its end."""
    state, end, slopes = progress.state, progress.end, progress.slopes
    F, interval, time = progress.continuous, progress.counts[INTERVAL], progress.clock[TIME]
    for s in range(method.end_stage + 1, len(method.nodes)):
        combine_stages(state, step, method.weights[s], slopes, s, progress.trial)
        at = time + method.nodes[s] * step
        equations.compute_rates(
            equations.laws, mechanism, scratch, interval, at, progress.trial, slopes[s]
        )
    for k in range(len(state)):
        change = end[k] - state[k]
        F[0, k] = change
        F[1, k] = step * slopes[0, k] - change
        F[2, k] = 2.0 * change - step * (slopes[method.end_stage, k] + slopes[0, k])
        for m in range(3, 7):
            F[m, k] = 0.0
    for m in range(4):
        for s in range(len(method.nodes)):
            weight = step * method.continuous[m, s]
            if weight != 0.0:
                for k in range(len(state)):
                    F[3 + m, k] += weight * slopes[s, k]


@compiled(NOTHING, EQUATIONS, MECHANISM, SCRATCH, PROGRESS)
def keep_step(
    equations: Equations, mechanism: Mechanism, scratch: Scratch, progress: Progress
) -> None:
    """Append the record of the state that was evaluated last to the path, if there is room."""
    count = progress.counts[PATH]
    if count < len(progress.path_times):
        progress.path_times[count] = progress.clock[TIME]
        equations.laws.record_step(mechanism, scratch, progress.path_rows[count])
        progress.counts[PATH] = count + 1


@compiled(NOTHING, COUNT, VECTOR)
def normalize_quaternions(balls: int, state: Array) -> None:
    """Give the quaternions of the balls, which come first in a state, the length one."""
    for ball in range(balls):
        store_in(state, 4 * ball, unit(quaternion_in(state, 4 * ball)))


@compiled(NOTHING, PROGRESS, COUNT, REAL, VECTOR, vectorised=True)
def interpolate_freely(progress: Progress, balls: int, share: float, result: Array) -> None:
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
    normalize_quaternions(balls, result)


@compiled(NOTHING, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, COUNT, REAL, REAL, VECTOR)
def interpolate(
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
    interpolate_freely(progress, balls, share, result)
    if len(mechanism.rows) > 0:
        at = progress.clock[TIME] + share * step
        interval = progress.counts[INTERVAL]
        equations.project(equations.laws, mechanism, scratch, interval, at, result, progress.spare)
