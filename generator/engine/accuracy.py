"""A run that knows its error: passes with smaller and smaller steps, extrapolated.

The trapezoidal rule's error falls with the square of the step, so two passes give a limit that is
better than both (Richardson). Three passes give two such limits; how far these are apart tells the
error of the last. Each pass ends steps at the corners of spring laws where the passes before met
them, without which the limits would not converge so fast.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from generator.engine.march import Pass
from generator.engine.passages import Guide
from generator.engine.trace import Trace, extrapolated
from generator.figure import Figure
from generator.frames import Array, homogeneous, inverse_pose, rotation_vector_from_matrix
from generator.recording import Accuracy, Ending, Outcome

LONGEST_STEP = 2e-3
"""Step of the first pass [s], where frames are not nearer to each other."""

PARTS = (1, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233)
"""Into how many parts the passes cut it: whole ones give passes whose steps have one ratio
everywhere, also where frames are cut at corners."""

CAUTION = 0.75
"""The estimate is so much of the distance between the last two limits. Theory has the last one far
nearer, but corners that were found late, and falls that amplify errors a hundred times a second,
let it come as far off as this; the worst case tried was off by 1.7 times the estimate."""

SMALLEST_STEP = 6e-5
"""Smallest step that the default tolerance may ask for [s]; it shrinks with the tolerance."""

_CUT_SHORT = (Ending.INTERRUPTED, Ending.TOO_LONG)
"""Endings of a pass that say nothing against the passes before it."""


@dataclass(frozen=True)
class Refined:
    """The best motion that the passes give, with what is known of its error."""

    trace: Trace
    outcome: Outcome
    accuracy: Accuracy
    wall_time: float


def refine(
    figure: Figure,
    tolerance: float,
    run: Callable[[int, Guide | None], Pass],
    longest_step: float,
    deadline: float,
) -> Refined:
    """Repeat a run with smaller steps until its estimated error is below the tolerance.

    Args:
        figure: whose joint angles the error is measured in.
        tolerance: largest joint-angle error [rad].
        run: makes one pass whose steps are the longest one cut into so many parts, guided by an
            earlier pass.
        longest_step: step of the first pass [s].
        deadline: `time.monotonic()` after which no pass is begun.

    Returns:
        The extrapolation of the two finest passes. A pass that fails is followed by a finer one;
        the run fails when the finest passes fail.
    """
    floor = SMALLEST_STEP * min(1.0, (tolerance / 1e-3) ** 0.25)
    done: list[Pass] = []
    for parts in PARTS:
        step = longest_step / parts
        if len(done) >= 3 and step < floor:
            break
        if len(done) >= 2 and time.monotonic() + _next_cost(done, step) > deadline:
            break
        latest = run(parts, done[-1].guide if done else None)
        if latest.outcome.ending is Ending.INTERRUPTED and len(done) >= 2:
            return _result(figure, tolerance, done, latest.outcome)
        done.append(latest)
        if latest.outcome.ending in _CUT_SHORT or _hopeless(done):
            break
        errors = estimated_errors(figure, _furthest(done))
        if latest.outcome.succeeded and errors.size and errors[-1] <= tolerance:
            break
    return _result(figure, tolerance, done, done[-1].outcome)


def estimated_errors(figure: Figure, passes: list[Pass]) -> Array:
    """Estimated largest joint-angle error up to each frame [rad] of the limit of the last two.

    Empty with fewer than three passes.
    """
    if len(passes) < 3:
        return np.zeros(0)
    first, second, third = passes[-3:]
    one = extrapolated(first.trace, second.trace, first.step / second.step)
    two = extrapolated(second.trace, third.trace, second.step / third.step)
    return np.maximum.accumulate(CAUTION * joint_differences(figure, one, two))


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
            parent, child = (_poses(trace, places.get(ref.segment), count) for ref in joint.ends)
            between.append(inverse_pose(parent) @ child)
        apart = inverse_pose(between[0]) @ between[1]
        turn = np.linalg.norm(rotation_vector_from_matrix(apart[:, :3, :3]), axis=-1)
        worst = np.maximum(worst, turn)
        if any(factor.kind == "T" for factor in joint.chain):
            worst = np.maximum(worst, np.linalg.norm(apart[:, :3, 3], axis=-1))
    return worst


def _poses(trace: Trace, place: int | None, count: int) -> Array:
    """Poses of a body's axes at its centre of mass; of the ground, the identity; (count, 4, 4)."""
    if place is None:
        return np.broadcast_to(np.eye(4), (count, 4, 4))
    return homogeneous(trace.rotations[:count, place], trace.positions[:count, place])


def _furthest(done: list[Pass]) -> list[Pass]:
    """The passes that got as far as any: a pass that fell behind has nothing to say of the rest."""
    longest = max(len(one.trace) for one in done)
    return [one for one in done if len(one.trace) == longest]


def _up_to_the_last(done: list[Pass]) -> list[Pass]:
    """The passes that got as far as the last one, up to there: coarse steps may miss a failure."""
    reached = len(done[-1].trace)
    return [replace(p, trace=p.trace.first(reached)) for p in done if len(p.trace) >= reached]


def _next_cost(done: list[Pass], step: float) -> float:
    """Wall time that a pass with a step will take [s], judged by the last one."""
    return done[-1].wall_time * done[-1].step / step


def _hopeless(done: list[Pass]) -> bool:
    """Whether the last two passes failed alike: the fault is the model's, not the step's."""
    if len(done) < 3 or done[-1].outcome.succeeded or done[-2].outcome.succeeded:
        return False
    last, before = done[-1].outcome, done[-2].outcome
    near = abs(last.last_time - before.last_time) <= 0.02 * (1e-9 + last.last_time) + 0.02
    return last.ending is before.ending and last.joint == before.joint and near


def _result(figure: Figure, tolerance: float, done: list[Pass], outcome: Outcome) -> Refined:
    """What the passes amount to."""
    steps = sum(one.steps for one in done)
    wall_time = sum(one.wall_time for one in done)
    used = _furthest(done) if outcome.ending in _CUT_SHORT else _up_to_the_last(done)
    trace = used[-1].trace
    if len(used) > 1:
        trace = extrapolated(used[-2].trace, trace, used[-2].step / used[-1].step)
    errors = estimated_errors(figure, used)
    if not errors.size:
        errors = np.full(len(trace), np.inf)
    held = trace.times[errors <= tolerance]
    held_until = float(held[-1]) if held.size else float(trace.times[0])
    accuracy = Accuracy(float(errors[-1]), tolerance, held_until, done[-1].step, steps, errors)
    last = float(trace.times[-1])
    message = outcome.message or _sentence(accuracy, last)
    if outcome.last_time < last:
        message += " of a finer pass"
    return Refined(trace, replace(outcome, message=message, last_time=last), accuracy, wall_time)


def _sentence(accuracy: Accuracy, last: float) -> str:
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
