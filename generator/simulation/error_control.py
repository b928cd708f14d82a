"""A run that knows its error: passes with smaller and smaller steps, extrapolated.

The trapezoidal rule's error falls with the square of the step, so two passes give a limit that is
better than both (Richardson). Three passes give two such limits; how far these are apart tells the
error of the last. Each pass ends steps at the corners of spring laws where the passes before met
them, without which the limits would not converge so fast.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, inf, isfinite, sqrt

import numpy as np

from generator.figure import AxisKind, Figure
from generator.recording import Accuracy, Ending, Outcome
from generator.rotations import (
    Array,
    inverse_pose,
    matrix_from_rotation_vector,
    pose_matrix,
    rotation_vector_from_matrix,
)
from generator.simulation.integrate import IntegrationPass, Trace
from generator.simulation.step_schedule import StepHints

LONGEST_STEP = 5e-3
"""Longest step of the first pass at the default tolerance [s]."""

SHORTEST_FIRST_STEP = 2.5e-3
"""So short may a smaller tolerance make it [s]."""

MIN_SUBDIVISION_RATIO, MAX_SUBDIVISION_RATIO = 1.5, 2.0
"""A pass cuts the first step into so many times the parts of the pass before: at least, at most.
Nearer passes make a limit that magnifies what is not smooth in their errors, and an estimate that
does not see it. Whole parts give steps of one ratio everywhere, also where frames are cut."""

ERROR_SAFETY_FACTOR = 0.75
"""The estimate is so much of the distance between the last two limits. Theory has the last one far
nearer, but corners that were found late, and falls that amplify errors a hundred times a second,
let it come as far off as this; the worst case tried was off by 1.7 times the estimate."""

SMALLEST_STEP = 6e-5
"""Smallest step that the default tolerance may ask for [s]; it shrinks with the tolerance."""

RELIABLE_STEP = 4e-4
"""Passes that fail alike with a longer step than this may have failed for the step [s]."""

MAX_PASS_DIVERGENCE = 0.1
"""Passes farther apart than this go different ways [rad]."""

EARLY_STOP_ENDINGS = (Ending.INTERRUPTED, Ending.TOO_LONG)
"""Endings of a pass that say nothing against the passes before it."""


@dataclass(frozen=True)
class RefinedRun:
    """The best motion that the passes give, with what is known of its error."""

    trace: Trace
    outcome: Outcome
    accuracy: Accuracy
    wall_time: float


def refine_until_converged(
    figure: Figure,
    tolerance: float,
    run_pass: Callable[[int, StepHints | None], IntegrationPass],
    longest_step: float,
    deadline: float,
) -> RefinedRun:
    """Repeat a run with smaller steps until its estimated error is below the tolerance.

    Args:
        figure: whose joint angles the error is measured in.
        tolerance: largest joint-angle error [rad].
        run_pass: makes one pass whose steps are the longest one cut into so many parts, guided by an
            earlier pass.
        longest_step: step of the first pass [s].
        deadline: `time.monotonic()` after which no pass is begun.

    Returns:
        The extrapolation of the two finest passes. A pass that fails is followed by a finer one;
        the run fails when the finest passes fail.
    """
    floor = SMALLEST_STEP * min(1.0, (tolerance / 1e-3) ** 0.25)
    done: list[IntegrationPass] = []
    tried: list[int] = []
    errors = np.zeros(0)
    while True:
        parts = _next_subdivision(tried, float(errors[-1]) / tolerance if errors.size else None)
        tried.append(parts)
        step = longest_step / parts
        if len(done) >= 3 and step < floor:
            break
        if len(done) >= 2 and time.monotonic() + _estimated_wall_time(done, step) > deadline:
            break
        latest = run_pass(parts, done[-1].step_hints if done else None)
        if latest.outcome.ending is Ending.INTERRUPTED and len(done) >= 2:
            return _build_refined_run(figure, tolerance, done, latest.outcome)
        done.append(latest)
        if latest.outcome.ending in EARLY_STOP_ENDINGS:
            break
        errors = estimated_errors(figure, _longest_passes(done))
        if latest.outcome.succeeded and errors.size and errors[-1] <= tolerance:
            break
        if latest.step <= RELIABLE_STEP and _is_failure_reproducible(done):
            break
    return _build_refined_run(figure, tolerance, done, done[-1].outcome)


def _next_subdivision(previous: list[int], error_ratio: float | None) -> int:
    """Into how many parts the next pass cuts the first step.

    The limit of passes of a and b parts has an error of fourth order, in proportion to 1/(a b)^2.
    The estimate after passes of a, b and c parts is in truth that of the limit of a and b; so that
    the one after next, that of the limit of c and n, comes out at half the tolerance, n is chosen.

    Args:
        previous: parts of the passes so far.
        error_ratio: the last estimate over the tolerance, or None where there is no estimate.
    """
    if len(previous) < 3:
        return len(previous) + 1
    a, b, c = previous[-3:]
    known = error_ratio is not None and isfinite(error_ratio)
    wanted = a * b / c * sqrt(2.0 * (error_ratio or 0.0)) if known else inf
    return ceil(c * float(np.clip(wanted / c, MIN_SUBDIVISION_RATIO, MAX_SUBDIVISION_RATIO)))


def first_step(frame: float, tolerance: float) -> float:
    """Step of the first pass [s], for frames so far apart [s] and a tolerance [rad].

    A limit of two passes is of fourth order. Frames that are cut at all are cut into an even number
    of steps: multipliers have an error that changes sign from step to step, and a pass of odd parts
    would not be extrapolated with one of even parts.
    """
    wanted = LONGEST_STEP * min(1.0, (tolerance / 1e-3) ** 0.25)
    wanted = max(wanted, SHORTEST_FIRST_STEP)
    return frame if frame <= wanted else frame / (2 * ceil(frame / (2.0 * wanted) - 1e-9))


def estimated_errors(figure: Figure, passes: list[IntegrationPass]) -> Array:
    """Estimated largest joint-angle error up to each frame [rad] of the limit of the last two.

    Empty with fewer than three passes.
    """
    if len(passes) < 3:
        return np.zeros(0)
    first, second, third = passes[-3:]
    one = richardson_extrapolation(first.trace, second.trace, first.step / second.step)
    two = richardson_extrapolation(second.trace, third.trace, second.step / third.step)
    return np.maximum.accumulate(ERROR_SAFETY_FACTOR * joint_differences(figure, one, two))


def richardson_extrapolation(coarse: Trace, fine: Trace, ratio: float) -> Trace:
    """Richardson's limit of two passes of a second-order method with steps `ratio` to 1.

    Vectors are extrapolated as they are, rotations along the shortest way from the coarse to the
    fine one. Frames that only one pass has are left out.
    """
    count = min(len(coarse), len(fine))
    coarse, fine = coarse.first_frames(count), fine.first_frames(count)
    gain = 1.0 / (ratio**2 - 1.0)

    def limit(one: Array, other: Array) -> Array:
        return other + gain * (other - one)

    step = rotation_vector_from_matrix(np.swapaxes(coarse.rotations, -1, -2) @ fine.rotations)
    return Trace(
        fine.times,
        limit(coarse.positions, fine.positions),
        fine.rotations @ matrix_from_rotation_vector(gain * step),
        limit(coarse.velocities, fine.velocities),
        limit(coarse.angular_velocities, fine.angular_velocities),
        {name: limit(coarse.multipliers[name], m) for name, m in fine.multipliers.items()},
        limit(coarse.dissipated, fine.dissipated),
        limit(coarse.spring_work, fine.spring_work),
        limit(coarse.load_work, fine.load_work),
        limit(coarse.coordinate_multipliers, fine.coordinate_multipliers),
    )


def joint_differences(figure: Figure, one: Trace, other: Trace) -> Array:
    """Largest angle between the joints' rotations in two traces, at each common frame [rad].

    For joints that slide, the distance between the child's positions [m] counts as well.
    """
    count = min(len(one), len(other))
    places = {name: k for k, name in enumerate(figure.bodies)}
    worst = np.zeros(count)
    for joint in figure.joints.values():
        between: list[Array] = []
        for trace in (one, other):
            parent, child = (
                _body_poses(trace, places.get(ref.segment), count) for ref in joint.ends
            )
            between.append(inverse_pose(parent) @ child)
        apart = inverse_pose(between[0]) @ between[1]
        turn = np.linalg.norm(rotation_vector_from_matrix(apart[:, :3, :3]), axis=-1)
        worst = np.maximum(worst, turn)
        if any(factor.kind is AxisKind.TRANSLATION for factor in joint.chain):
            worst = np.maximum(worst, np.linalg.norm(apart[:, :3, 3], axis=-1))
    return worst


def _body_poses(trace: Trace, index: int | None, count: int) -> Array:
    """Poses of a body's axes at its centre of mass; of the ground, the identity; (count, 4, 4)."""
    if index is None:
        return np.broadcast_to(np.eye(4), (count, 4, 4))
    return pose_matrix(trace.rotations[:count, index], trace.positions[:count, index])


def _longest_passes(done: list[IntegrationPass]) -> list[IntegrationPass]:
    """The passes that got as far as any: a pass that fell behind has nothing to say of the rest."""
    longest = max(len(one.trace) for one in done)
    return [one for one in done if len(one.trace) == longest]


def _truncate_to_last_pass(done: list[IntegrationPass]) -> list[IntegrationPass]:
    """The passes that got as far as the last one, up to there: coarse steps may miss a failure."""
    reached = len(done[-1].trace)
    return [
        replace(p, trace=p.trace.first_frames(reached)) for p in done if len(p.trace) >= reached
    ]


def _estimated_wall_time(done: list[IntegrationPass], step: float) -> float:
    """Wall time that a pass with a step will take [s], judged by the last one."""
    return done[-1].wall_time * done[-1].step / step


def _is_failure_reproducible(done: list[IntegrationPass]) -> bool:
    """Whether the last two passes failed alike: the fault is the model's, not the step's."""
    if len(done) < 3 or done[-1].outcome.succeeded or done[-2].outcome.succeeded:
        return False
    last, before = done[-1].outcome, done[-2].outcome
    near = abs(last.last_time - before.last_time) <= 0.02 * (1e-9 + last.last_time) + 0.02
    return last.ending is before.ending and last.joint == before.joint and near


def _build_refined_run(
    figure: Figure, tolerance: float, done: list[IntegrationPass], outcome: Outcome
) -> RefinedRun:
    """What the passes amount to."""
    steps = sum(one.steps for one in done)
    wall_time = sum(one.wall_time for one in done)
    used = (
        _longest_passes(done)
        if outcome.ending in EARLY_STOP_ENDINGS
        else _truncate_to_last_pass(done)
    )
    trace = used[-1].trace if len(used) == 1 else _extrapolate_until_divergence(figure, *used[-2:])
    errors = estimated_errors(figure, used)
    if not errors.size:
        errors = np.full(len(trace), np.inf)
    held = trace.times[errors <= tolerance]
    held_until = float(held[-1]) if held.size else float(trace.times[0])
    accuracy = Accuracy(float(errors[-1]), tolerance, held_until, done[-1].step, steps, errors)
    last = float(trace.times[-1])
    message = outcome.message or _accuracy_message(accuracy, last)
    if outcome.last_time < last:
        message += " of a finer pass"
    return RefinedRun(trace, replace(outcome, message=message, last_time=last), accuracy, wall_time)


def _extrapolate_until_divergence(
    figure: Figure, coarse: IntegrationPass, fine: IntegrationPass
) -> Trace:
    """The limit of two passes as long as they go together, and from there on the finer one.

    Passes that have parted have no limit: what would be extrapolated is no motion of the figure.
    """
    limit = richardson_extrapolation(coarse.trace, fine.trace, coarse.step / fine.step)
    parted = joint_differences(figure, coarse.trace, fine.trace) > MAX_PASS_DIVERGENCE
    if not np.any(parted):
        return limit
    return limit.first_frames(int(np.argmax(parted))).extend_from(
        fine.trace.first_frames(len(limit))
    )


def _accuracy_message(accuracy: Accuracy, last: float) -> str:
    """What a run that is done says of its error."""
    asked, estimate = accuracy.asked, accuracy.estimate
    if asked is None or estimate is None:
        return f"done at {last:.4g} s"
    if not np.isfinite(estimate):
        return f"done at {last:.4g} s, but too few passes ended to estimate the error"
    if estimate <= asked:
        return f"done at {last:.4g} s with joint angles within {estimate:.1e} rad"
    return (
        f"done at {last:.4g} s, but the tolerance of {asked:.1e} rad held only until "
        f"{accuracy.held_until:.4g} s; at the end the estimated error is {estimate:.1e} rad"
    )
