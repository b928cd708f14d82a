"""A run of an Exudyn model by Exudyn's integrator: a pass of fixed steps, and one of half of them.

Exudyn's trapezoidal rule with constraints on velocity level (index 2) has an error of second order
in the step, so the Richardson extrapolation of the two passes is more accurate than both. Their
difference is the estimate of its error. That holds also where the order is less: steps do not end
at breakpoints of spring laws, but a method of first order still has an error below the difference.
Steps end at frames and at discontinuities of loads.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, sqrt
from typing import Any

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
from generator.run_options import Integrator
from generator.simulation.exudyn_model.bodies import Constraint
from generator.simulation.exudyn_model.exudyn_api import SolverError, exu, set_times
from generator.simulation.exudyn_model.model import ExudynModel
from generator.simulation.exudyn_model.sensors import SensorLog
from generator.simulation.trace import (
    RefinedRun,
    Trace,
    estimated_accuracy,
    finished_outcome,
    half_turn_outcome,
    map_arrays,
    pole_outcome,
    solver_failure_outcome,
)

STEP = 5e-4
"""Step of the first pass at the default tolerance [s]; it changes with the root of that."""

LONGEST_STEP = 5e-3
"""Longest step of the first pass [s]."""

LONGEST_STEP_WITH_CONTACT = 2e-4
"""The same with props: the friction of a light forearm that hits the floor needs it."""

_MAX_PASS_DIVERGENCE = 0.1
"""Distance of passes above which they have no common limit [rad]."""

_NEWTON_TOLERANCE = 1e-9
"""Relative tolerance of Newton's method."""

_NEGLIGIBLE_STEP = 1e-8
"""Step during which the motion is negligible [s]."""

_DISCONTINUITY_HALF_WIDTH = 1e-9
"""Half the length of the step across a load discontinuity [s]."""

_MAX_STEPS_PER_CALL = 500
"""Largest number of steps between checks of the clock and of Ctrl-C."""

_MIN_SUSPECT_SINE = 0.98
"""Sine of the middle one of three angles from which a failed solver is put down to the pole."""

_MIN_SUSPECT_ANGLE = 2.8
"""Angle of a joint with springs beyond which a solver failure is attributed to it [rad]."""


@dataclass(frozen=True)
class IntegrationPass:
    """Result of one pass.

    Attributes:
        trace: Frames up to the end.
        outcome: Ending of the pass; without a message at the stop time.
        step: Step in the first frame interval [s].
        steps: Number of steps taken.
        wall_time: Wall time of the integration [s].
    """

    trace: Trace
    outcome: Outcome
    step: float
    steps: int
    wall_time: float


FrameCallback = Callable[[float], None]
"""Called with the simulated time [s] after every frame."""


def run_exudyn(
    model: ExudynModel,
    rebuild: Callable[[], ExudynModel],
    times: Array,
    deadline: float,
    report: Callable[[int, float, float], None],
) -> RefinedRun:
    """Run a model with the fixed step of its plan; without one, with a default step and its half.

    Args:
        model: Model before its first step.
        rebuild: Function that builds it again, for the second pass.
        times: Times of the frames [s], shape (n,).
        deadline: `time.monotonic()` after which the run stops.
        report: Function of the number of the pass, its step [s] and its time [s].
    """
    plan = model.plan
    step = plan.step or first_step(
        float(times[1] - times[0]), plan.tolerance, with_contact=model.contacts is not None
    )

    def run_pass(number: int, model: ExudynModel) -> IntegrationPass:
        def on_frame(now: float) -> None:
            report(number, step / number, now)

        return integrate(model, times, step, deadline, on_frame, subdivision=number)

    coarse = run_pass(1, model)
    if plan.step is not None:
        return _fixed_step_run(coarse)
    if coarse.outcome.ending in EARLY_STOP_ENDINGS:
        return _combined_run(model, [coarse], coarse)
    fine = run_pass(2, rebuild())
    if fine.outcome.ending in EARLY_STOP_ENDINGS and len(fine.trace) <= len(coarse.trace):
        return _combined_run(model, [coarse, fine], coarse)
    return _combined_run(model, [coarse, fine], fine)


def first_step(frame: float, tolerance: float, *, with_contact: bool = False) -> float:
    """Step of the first pass [s], for a frame interval [s] and a tolerance [rad].

    A subdivided frame has an even number of steps, because the error of the multipliers alternates
    in sign from step to step.
    """
    longest = LONGEST_STEP_WITH_CONTACT if with_contact else LONGEST_STEP
    step = min(STEP * sqrt(tolerance / 1e-3), longest)
    return frame if frame <= step else frame / (2 * ceil(frame / (2.0 * step) - 1e-9))


def _fixed_step_run(only: IntegrationPass) -> RefinedRun:
    """Return the result of a pass without an estimate of its error."""
    last = float(only.trace.times[-1])
    outcome = only.outcome
    if outcome.succeeded:
        message = f"Finished {last:.4g} s with a fixed step of {only.step:.3g} s."
        outcome = replace(outcome, message=message)
    unknown = np.full(len(only.trace), np.nan)
    accuracy = Accuracy(None, None, last, only.step, only.steps, unknown)
    return RefinedRun(only.trace, outcome, accuracy, only.wall_time)


def _combined_run(
    model: ExudynModel, passes: list[IntegrationPass], best: IntegrationPass
) -> RefinedRun:
    """Combine the passes of a run, whose last one tells how it ended.

    Args:
        model: Model of the run.
        passes: One or two passes.
        best: Pass whose frames are those of the run.
    """
    trace, outcome = best.trace, passes[-1].outcome
    errors = np.full(len(trace), np.inf)
    if best is not passes[0]:
        trace, errors = extrapolate(model.figure, passes[0].trace, trace)
    last = float(trace.times[-1])
    accuracy = estimated_accuracy(
        trace.times, errors, model.plan.tolerance, best.step, sum(each.steps for each in passes)
    )
    if outcome.succeeded:
        remedy = "choose a smaller step"
        if model.plan.integrator is Integrator.EXUDYN:
            remedy += " or the compiled integrator"
        outcome = finished_outcome(accuracy, last, remedy)
    elif outcome.last_time < last:
        message = f"{outcome.message} of a finer pass"
        outcome = replace(outcome, message=message, last_time=last)
    return RefinedRun(trace, outcome, accuracy, sum(each.wall_time for each in passes))


def extrapolate(figure: Figure, coarse: Trace, fine: Trace) -> tuple[Trace, Array]:
    """Extrapolate two passes until they diverge, and continue with the finer one.

    Returns:
        The trace with the n frames of the finer pass, and the largest difference of the joints of
        the two up to each frame, shape (n,) [rad]; infinite beyond the coarser one.
    """
    differences = joint_differences(figure, coarse, fine)
    unknown = np.full(len(fine) - len(differences), np.inf)
    errors = np.maximum.accumulate(np.append(differences, unknown))
    alike = int(np.count_nonzero(errors <= _MAX_PASS_DIVERGENCE))
    limit = richardson_extrapolation(coarse.first_frames(alike), fine.first_frames(alike))

    def extend(one: Array, other: Array) -> Array:
        return np.concatenate([one, other[alike:]])

    trace = map_arrays(extend, limit, fine)
    contact = fine.contact
    if contact is not None and limit.contact is not None:
        contact = replace(
            contact,
            losses=extend(limit.contact.losses, contact.losses),
            impulses=extend(limit.contact.impulses, contact.impulses),
        )
    return replace(trace, contact=contact), errors


def richardson_extrapolation(coarse: Trace, fine: Trace) -> Trace:
    """Extrapolate two traces of a method of second order, the second with half the step.

    Rotations are extrapolated along the geodesic from the coarse to the fine one. Steps of contact
    are those of the finer pass.
    """

    def limit(one: Array, other: Array) -> Array:
        return other + (other - one) / 3.0

    step = rotation_vector_from_matrix(np.swapaxes(coarse.rotations, -1, -2) @ fine.rotations)
    trace = replace(
        map_arrays(limit, coarse, fine),
        times=fine.times,
        rotations=fine.rotations @ matrix_from_rotation_vector(step / 3.0),
    )
    if coarse.contact is None or fine.contact is None:
        return trace
    losses = limit(coarse.contact.losses, fine.contact.losses)
    impulses = limit(coarse.contact.impulses, fine.contact.impulses)
    return replace(trace, contact=replace(fine.contact, losses=losses, impulses=impulses))


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


def integrate(
    model: ExudynModel,
    times: Array,
    step: float,
    deadline: float,
    on_frame: FrameCallback,
    *,
    subdivision: int = 1,
) -> IntegrationPass:
    """Integrate a model over the frames.

    The integrator is restarted at frames and at discontinuities of loads, which loses no accuracy.

    Args:
        model: New model, which cannot be used again.
        times: Times of the frames [s], shape (n,).
        step: Largest step [s]; each interval is divided into equal steps not longer than it.
        deadline: `time.monotonic()` after which the pass stops.
        on_frame: Function called with the time after each frame.
        subdivision: Factor by which the number of steps in each interval is multiplied.

    Returns:
        The pass; a failure is its outcome, never an exception.
    """
    wall_start = time.monotonic()
    settings = _settings()
    multipliers = _initial_multipliers(model, settings, float(times[0]))
    sensors = SensorLog(model)
    log = _StateLog(model, sensors, float(times[0]), multipliers)
    steps = 0
    outcome = Outcome(Ending.DONE, "", float(times[-1]))
    try:
        for start, stop, count, is_frame in _calls(model, times, step, subdivision):
            _advance(model, settings, start, stop, count)
            steps += count
            crossing = sensors.read()
            if crossing is not None:
                ends_at_pole = sensors.is_at_pole(crossing[0])
                outcome = (pole_outcome if ends_at_pole else half_turn_outcome)(*crossing)
                break
            if is_frame:
                log.record(stop)
                on_frame(stop)
            if time.monotonic() > deadline and stop < times[-1]:
                message = f"the wall-time limit was reached at {stop:.4g} s"
                outcome = Outcome(Ending.TOO_LONG, message, stop)
                break
    except SolverError:
        outcome = _solver_failure_outcome(model, log, sensors)
    except KeyboardInterrupt:
        message = f"interrupted at {log.last_time:.4g} s"
        outcome = Outcome(Ending.INTERRUPTED, message, log.last_time)
    wall_time = time.monotonic() - wall_start
    frame = float(times[1] - times[0])
    used_step = frame / (subdivision * _count_steps(frame, step))
    outcome = replace(outcome, last_time=log.last_time)
    return IntegrationPass(log.build_trace(), outcome, used_step, steps, wall_time)


def _count_steps(length: float, step: float) -> int:
    """Return the number of equal steps, not longer than `step`, in an interval [s]."""
    return max(1, ceil(length / step - 1e-9))


def _calls(
    model: ExudynModel, times: Array, step: float, subdivision: int
) -> Iterator[tuple[float, float, int, bool]]:
    """Yield each call of the integrator: start, stop, steps, and whether it ends at a frame.

    A step with a discontinuity of a load inside it or at its end would be of first order.
    """
    jumps = {time for load in model.loads for time in load.discontinuities}
    sides = (-_DISCONTINUITY_HALF_WIDTH, _DISCONTINUITY_HALF_WIDTH)
    cuts = sorted(time + side for time in jumps for side in sides)
    for before, frame in pairwise(times.tolist()):
        inner = [time for time in cuts if before < time < frame]
        for start, stop in pairwise([before, *inner, frame]):
            count = subdivision * _count_steps(stop - start, step)
            call_start = start
            for first in range(0, count, _MAX_STEPS_PER_CALL):
                last = min(first + _MAX_STEPS_PER_CALL, count)
                call_stop = stop if last == count else start + (stop - start) * last / count
                yield call_start, call_stop, last - first, call_stop == frame
                call_start = call_stop


def _settings() -> Any:
    """Return the simulation settings of a pass."""
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.adaptiveStep = False
    integration.newton.useModifiedNewton = True
    # A Jacobian costs as much as a dozen iterations: update it when they converge more slowly.
    integration.newton.modifiedNewtonContractivity = 0.2
    integration.newton.relativeTolerance = _NEWTON_TOLERANCE
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.solution.file.write = False
    return settings


def _advance(
    model: ExudynModel, settings: Any, start: float, stop: float, count: int, keep: bool = True
) -> None:
    """Take `count` equal steps; with `keep` the next call starts from the final state.

    Raises SolverError.
    """
    integration = settings.timeIntegration
    set_times(integration, start, stop)
    integration.numberOfSteps = count
    settings.solution.sensors.writePeriod = (stop - start) / count / 2.0
    settings.solution.file.writeInitialValues = start == model.plan.start
    try:
        model.mbs.SolveDynamic(
            settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2, updateInitialValues=keep
        )
    except Exception as failure:
        # Ctrl-C arrives wrapped: in a SystemError from compiled code, in an error of Exudyn from a
        # user function.
        if isinstance(failure.__cause__, KeyboardInterrupt):
            raise failure.__cause__ from None
        raise


class _StateLog:
    """States at the frames of a pass."""

    def __init__(
        self, model: ExudynModel, sensors: SensorLog, start: float, multipliers: "Multipliers"
    ) -> None:
        """Record the initial state with its multipliers."""
        self._model, self._sensors = model, sensors
        # The bodies' coordinates come first; that of a clock may follow.
        self._count = 7 * len(model.figure.bodies)
        self._reference = np.asarray(
            model.mbs.systemData.GetODE2Coordinates(configuration=exu.ConfigurationType.Reference)
        )[: self._count]
        self._frames: list[tuple[float, Array, Array, Array, Multipliers]] = []
        self.record(start, multipliers)

    @property
    def last_time(self) -> float:
        """Time of the last state [s]."""
        return self._frames[-1][0]

    def record(self, now: float, multipliers: "Multipliers | None" = None) -> None:
        """Record the current state, with the current multipliers by default."""
        data = self._model.mbs.systemData
        coordinates = np.array(data.GetODE2Coordinates())[: self._count]
        rates = np.array(data.GetODE2Coordinates_t())[: self._count]
        multipliers = multipliers or current_multipliers(self._model)
        self._frames.append((now, coordinates, rates, self._sensors.work, multipliers))

    def build_trace(self) -> Trace:
        """Return the recorded states."""
        times, coordinates, rates, work, multipliers = zip(*self._frames, strict=True)
        shape = len(times), len(self._model.figure.bodies), 7
        q = np.array(coordinates).reshape(shape) + self._reference.reshape(shape[1:])
        q_rates, works = np.array(rates).reshape(shape), np.array(work)
        return Trace(
            np.array(times),
            q[..., :3],
            rotations_from_parameters(q[..., 3:]),
            q_rates[..., :3],
            angular_velocities_from_parameters(q[..., 3:], q_rates[..., 3:]),
            {name: np.array([m.joints[name] for m in multipliers]) for name in self._model.joints},
            *works[:, :3].T,
            coordinate_multipliers=np.array([m.coordinates for m in multipliers]),
            contact=self._sensors.contact_trace(works),
            tone_work=None if self._model.tone is None else works[:, 3],
        )


def rotations_from_parameters(parameters: Array) -> Array:
    """Rotation matrices of Euler parameters (scalar first), shape (..., 4) to (..., 3, 3)."""
    e = parameters / np.linalg.norm(parameters, axis=-1, keepdims=True)
    w, x, y, z = (e[..., k] for k in range(4))
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def angular_velocities_from_parameters(parameters: Array, rates: Array) -> Array:
    """Angular velocities in world axes [rad/s] of Euler parameters and rates: (..., 4) each."""
    scalar, vector = parameters[..., :1], parameters[..., 1:]
    scalar_rate, vector_rate = rates[..., :1], rates[..., 1:]
    return 2.0 * (scalar * vector_rate - scalar_rate * vector + np.cross(vector, vector_rate))


@dataclass(frozen=True)
class Multipliers:
    """Multipliers of joints, shape (items, 6) each, and of links and drives, shape (rows,)."""

    joints: dict[str, Array]
    coordinates: Array


def _initial_multipliers(model: ExudynModel, settings: Any, start: float) -> Multipliers:
    """Multipliers at the start, which Exudyn leaves zero: those after a negligible step.

    Assembling again resets the model to its start. A solver failure is ignored here, because it
    occurs again in the first step of the pass.
    """
    with suppress(SolverError):
        _advance(model, settings, start, start + _NEGLIGIBLE_STEP, 1, keep=False)
    return current_multipliers(model)


def current_multipliers(model: ExudynModel) -> Multipliers:
    """Return the current multipliers of all constraints."""
    joints = {
        name: np.array([_joint_multipliers(model.mbs, c) for c in constraints])
        for name, constraints in model.joints.items()
    }
    kind = exu.OutputVariableType.Force
    coordinates = [
        np.atleast_1d(np.asarray(model.mbs.GetObjectOutput(constraint.item, kind), dtype=float))
        for constraint in model.coordinate_constraints
    ]
    return Multipliers(joints, np.concatenate([np.zeros(0), *coordinates]))


def _joint_multipliers(mbs: Any, constraint: Constraint) -> Array:
    """Force (of a spherical joint in world axes) and rotation multipliers, shape (6,)."""
    kinds = exu.OutputVariableType
    if constraint.is_spherical:
        return np.append(np.asarray(mbs.GetObjectOutput(constraint.item, kinds.Force)), np.zeros(3))
    force = mbs.GetObjectOutput(constraint.item, kinds.ForceLocal)
    about = mbs.GetObjectOutput(constraint.item, kinds.TorqueLocal)
    return np.concatenate([np.asarray(force), np.asarray(about)])


def _solver_failure_outcome(model: ExudynModel, log: _StateLog, sensors: SensorLog) -> Outcome:
    """Return the outcome of a solver failure, with the joint that probably caused it."""
    near = sensors.nearest_half_turn()
    if near is not None and near[1] > _MIN_SUSPECT_ANGLE:
        return half_turn_outcome(near[0], log.last_time)
    pole = sensors.nearest_pole()
    if pole is not None and pole[1] > _MIN_SUSPECT_SINE:
        return pole_outcome(pole[0], log.last_time)
    spins = log.build_trace().angular_velocities[-1]
    return solver_failure_outcome(model.figure, spins, log.last_time)
