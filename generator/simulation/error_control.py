"""Error control: passes with decreasing steps, and their Richardson extrapolation.

The error of the trapezoidal rule is of second order in the step, so the extrapolation of two passes
is more accurate than both. Three passes give two extrapolations, whose distance estimates the error
of the last. Each pass ends steps at the breakpoints of spring laws that earlier passes crossed;
otherwise a step across a breakpoint would reduce the order.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, inf, isfinite, sqrt

import numpy as np

from generator.figure import Figure
from generator.recording import EARLY_STOP_ENDINGS, Accuracy, Ending, Outcome
from generator.rotations import (
    Array,
    inverse_pose,
    matrix_from_rotation_vector,
    pose_matrix,
    rotation_vector_from_matrix,
)
from generator.simulation.contacts import ContactTrace
from generator.simulation.integrate import IntegrationPass, Trace
from generator.simulation.step_schedule import StepHints

LONGEST_STEP = 5e-3
"""Longest step of the first pass at the default tolerance [s]."""

SHORTEST_FIRST_STEP = 2.5e-3
"""Shortest step of the first pass at smaller tolerances [s]."""

MIN_SUBDIVISION_RATIO, MAX_SUBDIVISION_RATIO = 1.5, 2.0
"""Smallest and largest ratio of the subdivisions of the first step in consecutive passes. A smaller
ratio would amplify errors that are not smooth, and hide them from the estimate. Subdivisions are
integers, so that the ratio is the same in all subintervals."""

ERROR_SAFETY_FACTOR = 0.75
"""Error estimate as a share of the distance between the last two extrapolations. The last one is
usually much closer, but breakpoints that are detected late and falls that amplify errors a hundred
times per second bring it to this; the worst case tried was off by 1.7 times the estimate."""

SMALLEST_STEP = 6e-5
"""Smallest step at the default tolerance [s]; it decreases with the tolerance."""

RELIABLE_STEP = 4e-4
"""Longest step at which two failures alike are attributed to the model [s]."""

RELIABLE_STEP_WITH_CONTACT = 1e-4
"""The same with props: the friction of a light forearm that hits the floor needs 2e-4 s."""

MAX_PASS_DIVERGENCE = 0.1
"""Distance of passes above which they follow different motions [rad]."""


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
    reliable_step: float = RELIABLE_STEP,
) -> RefinedRun:
    """Repeat a run with smaller steps until its estimated error is below the tolerance.

    Args:
        figure: the figure in whose joint angles the error is measured.
        tolerance: largest joint-angle error [rad].
        run_pass: function that makes a pass with the longest step subdivided, using the hints of an
            earlier pass.
        longest_step: step of the first pass [s].
        deadline: `time.monotonic()` after which no pass starts.
        reliable_step: longest step at which two failures alike end the run [s].

    Returns:
        The extrapolation of the two finest passes. A failed pass is followed by a finer one; the
        run fails if the finest passes fail.
    """
    floor = SMALLEST_STEP * min(1.0, (tolerance / 1e-3) ** 0.25)
    passes: list[IntegrationPass] = []
    subdivisions: list[int] = []
    errors = np.zeros(0)
    while True:
        subdivision = _next_subdivision(
            subdivisions, float(errors[-1]) / tolerance if errors.size else None
        )
        subdivisions.append(subdivision)
        step = longest_step / subdivision
        if len(passes) >= 3 and step < floor:
            break
        if len(passes) >= 2 and time.monotonic() + _estimated_wall_time(passes, step) > deadline:
            break
        latest = run_pass(subdivision, passes[-1].step_hints if passes else None)
        if latest.outcome.ending is Ending.INTERRUPTED and len(passes) >= 2:
            return _build_refined_run(figure, tolerance, passes, latest.outcome)
        passes.append(latest)
        if latest.outcome.ending in EARLY_STOP_ENDINGS:
            break
        errors = estimated_errors(figure, _longest_passes(passes))
        if latest.outcome.succeeded and errors.size and errors[-1] <= tolerance:
            break
        if latest.step <= reliable_step and _is_failure_reproducible(passes):
            break
    return _build_refined_run(figure, tolerance, passes, passes[-1].outcome)


def _next_subdivision(previous: list[int], error_ratio: float | None) -> int:
    """Subdivision of the first step in the next pass.

    The extrapolation of passes with subdivisions a and b has an error of fourth order,
    proportional to 1/(a b)^2. The estimate after passes a, b and c is effectively that of the
    extrapolation of a and b. The next subdivision n is chosen so that the error of c and n is half
    the tolerance.

    Args:
        previous: subdivisions of the passes so far.
        error_ratio: the last estimate over the tolerance; None without an estimate.
    """
    if len(previous) < 3:
        return len(previous) + 1
    a, b, c = previous[-3:]
    known = error_ratio is not None and isfinite(error_ratio)
    subdivision = a * b / c * sqrt(2.0 * (error_ratio or 0.0)) if known else inf
    return ceil(c * float(np.clip(subdivision / c, MIN_SUBDIVISION_RATIO, MAX_SUBDIVISION_RATIO)))


def first_step(frame: float, tolerance: float) -> float:
    """Step of the first pass [s], for a frame interval [s] and a tolerance [rad].

    The extrapolation of two passes is of fourth order. A subdivided frame has an even number of
    steps, because the error of the multipliers alternates in sign from step to step.
    """
    step = LONGEST_STEP * min(1.0, (tolerance / 1e-3) ** 0.25)
    step = max(step, SHORTEST_FIRST_STEP)
    return frame if frame <= step else frame / (2 * ceil(frame / (2.0 * step) - 1e-9))


def estimated_errors(figure: Figure, passes: list[IntegrationPass]) -> Array:
    """Estimated largest joint-angle error of the last extrapolation up to each frame [rad].

    Empty with fewer than three passes.
    """
    if len(passes) < 3:
        return np.zeros(0)
    first, second, third = passes[-3:]
    previous = richardson_extrapolation(first.trace, second.trace, first.step / second.step)
    latest = richardson_extrapolation(second.trace, third.trace, second.step / third.step)
    return np.maximum.accumulate(ERROR_SAFETY_FACTOR * joint_differences(figure, previous, latest))


def richardson_extrapolation(coarse: Trace, fine: Trace, ratio: float) -> Trace:
    """Richardson extrapolation of two passes of a second-order method with steps `ratio` to 1.

    Rotations are extrapolated along the geodesic from the coarse to the fine one. Frames that only
    one pass has are omitted.
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
        contact=_extrapolated_contact(coarse.contact, fine.contact, limit),
    )


def _extrapolated_contact(
    coarse: ContactTrace | None,
    fine: ContactTrace | None,
    limit: Callable[[Array, Array], Array],
) -> ContactTrace | None:
    """Extrapolate the integrals of contact; the steps are those of the finer pass."""
    if coarse is None or fine is None:
        return None
    return replace(
        fine,
        losses=limit(coarse.losses, fine.losses),
        impulses=limit(coarse.impulses, fine.impulses),
    )


def joint_differences(figure: Figure, one: Trace, other: Trace) -> Array:
    """Largest angle between the joints' rotations in two traces, at each common frame [rad].

    For joints with translations, the distance of the child's positions [m] counts as well.
    """
    count = min(len(one), len(other))
    body_indices = {name: k for k, name in enumerate(figure.bodies)}
    largest = np.zeros(count)
    for joint in figure.joints.values():
        relative_poses: list[Array] = []
        for trace in (one, other):
            parent, child = (
                _body_poses(trace, body_indices.get(ref.segment), count) for ref in joint.ends
            )
            relative_poses.append(inverse_pose(parent) @ child)
        differences = inverse_pose(relative_poses[0]) @ relative_poses[1]
        angles = np.linalg.norm(rotation_vector_from_matrix(differences[:, :3, :3]), axis=-1)
        largest = np.maximum(largest, angles)
        if any(any(factor.twist.linear) for factor in joint.chain):
            largest = np.maximum(largest, np.linalg.norm(differences[:, :3, 3], axis=-1))
    return largest


def _body_poses(trace: Trace, index: int | None, count: int) -> Array:
    """Poses of a body's axes at its centre of mass, the identity for the ground, (count, 4, 4)."""
    if index is None:
        return np.broadcast_to(np.eye(4), (count, 4, 4))
    return pose_matrix(trace.rotations[:count, index], trace.positions[:count, index])


def _longest_passes(passes: list[IntegrationPass]) -> list[IntegrationPass]:
    """Return the passes with the most frames."""
    longest = max(len(each.trace) for each in passes)
    return [each for each in passes if len(each.trace) == longest]


def _truncate_to_last_pass(passes: list[IntegrationPass]) -> list[IntegrationPass]:
    """Truncate passes to the frames of the last; coarser steps may miss a failure."""
    reached = len(passes[-1].trace)
    return [
        replace(p, trace=p.trace.first_frames(reached)) for p in passes if len(p.trace) >= reached
    ]


def _estimated_wall_time(passes: list[IntegrationPass], step: float) -> float:
    """Wall time of a pass with a step [s], extrapolated from the last one."""
    return passes[-1].wall_time * passes[-1].step / step


def _is_failure_reproducible(passes: list[IntegrationPass]) -> bool:
    """Return whether the last two passes failed alike, so that the model is the cause."""
    if len(passes) < 3 or passes[-1].outcome.succeeded or passes[-2].outcome.succeeded:
        return False
    last, before = passes[-1].outcome, passes[-2].outcome
    near = abs(last.last_time - before.last_time) <= 0.02 * (1e-9 + last.last_time) + 0.02
    return last.ending is before.ending and last.joint == before.joint and near


def _build_refined_run(
    figure: Figure, tolerance: float, passes: list[IntegrationPass], outcome: Outcome
) -> RefinedRun:
    """Combine the passes into one run."""
    steps = sum(each.steps for each in passes)
    wall_time = sum(each.wall_time for each in passes)
    used = (
        _longest_passes(passes)
        if outcome.ending in EARLY_STOP_ENDINGS
        else _truncate_to_last_pass(passes)
    )
    trace = used[-1].trace if len(used) == 1 else _extrapolate_until_divergence(figure, *used[-2:])
    errors = estimated_errors(figure, used)
    if not errors.size or len(trace) == 1:  # the first frame is that of the start in all passes
        errors = np.full(len(trace), np.inf)
    accurate_times = trace.times[errors <= tolerance]
    accurate_until = float(accurate_times[-1]) if accurate_times.size else float(trace.times[0])
    accuracy = Accuracy(
        float(errors[-1]), tolerance, accurate_until, passes[-1].step, steps, errors
    )
    last = float(trace.times[-1])
    if outcome.succeeded:
        return RefinedRun(trace, finished_outcome(accuracy, last), accuracy, wall_time)
    message = outcome.message
    if outcome.last_time < last:
        message += " of a finer pass"
    return RefinedRun(trace, replace(outcome, message=message, last_time=last), accuracy, wall_time)


def _extrapolate_until_divergence(
    figure: Figure, coarse: IntegrationPass, fine: IntegrationPass
) -> Trace:
    """Extrapolate two passes up to where they diverge, and continue with the finer one.

    Passes that have diverged have no common limit.
    """
    limit = richardson_extrapolation(coarse.trace, fine.trace, coarse.step / fine.step)
    parted = joint_differences(figure, coarse.trace, fine.trace) > MAX_PASS_DIVERGENCE
    if not np.any(parted):
        return limit
    return limit.first_frames(int(np.argmax(parted))).extend_from(
        fine.trace.first_frames(len(limit))
    )


def finished_outcome(accuracy: Accuracy, last: float) -> Outcome:
    """Return the outcome of a run that reached its stop time, by the estimate of its error.

    Args:
        accuracy: Accuracy with a tolerance and an estimate, infinite if it is unknown.
        last: the stop time [s].
    """
    asked, estimate = accuracy.asked, accuracy.estimate
    assert asked is not None
    assert estimate is not None
    if estimate <= asked:
        message = (
            f"Finished {last:.4g} s. Estimated joint-angle error {estimate:.1e} rad "
            f"(tolerance {asked:.1e})."
        )
        return Outcome(Ending.DONE, message, last)
    if np.isfinite(estimate):
        message = (
            f"the tolerance {asked:.1e} rad is met only until {accuracy.held_until:.4g} s of "
            f"{last:.4g} s, where the joint-angle error is about {estimate:.1e} rad"
        )
    else:
        message = f"too few passes of {last:.4g} s ended to estimate the joint-angle error"
    return Outcome(Ending.INACCURATE, message, last)
