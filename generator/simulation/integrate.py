"""One integration pass with a fixed number of steps per frame, and the trace of its states.

Exudyn's trapezoidal rule with constraints on velocity level (index 2) is restarted at frames, which
loses no accuracy, and at the breakpoints of spring laws that an earlier pass crossed: a step across
a breakpoint would reduce the order on which the extrapolation relies. Between frames the pass stops
for Ctrl-C, for the wall-time limit and for a joint that passes 180 deg. Steps are never halved, so
a pass always ends.
"""

import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from math import ceil
from typing import Any

import numpy as np

from generator.figure import Figure
from generator.recording import Ending, Outcome
from generator.rotations import Array
from generator.simulation.contacts import ContactTrace
from generator.simulation.exudyn_api import SolverError, exu, set_times
from generator.simulation.joints import Constraint
from generator.simulation.model import ExudynModel
from generator.simulation.sensors import HalfTurnCrossing, SensorLog
from generator.simulation.step_schedule import (
    MAX_STEPS_PER_CHUNK,
    StepHints,
    count_steps,
    last_frame_of_batch,
    load_discontinuities,
    step_chunks,
    subintervals,
)

_NEGLIGIBLE_STEP = 1e-8
"""Step during which the motion is negligible [s]."""

FRAMES_PER_SENSOR_READ = 20
"""Frames between two readings of the sensors; a reading costs as much as many steps."""

_MIN_SUSPECT_ANGLE = 2.8
"""Angle of a joint with springs beyond which a solver failure is attributed to it [rad]."""


@dataclass(frozen=True)
class Trace:
    """States at n frames of B bodies, in world axes.

    Attributes:
        times: shape (n,) [s].
        positions: of the centres of mass, shape (n, B, 3) [m].
        rotations: of the segment axes, shape (n, B, 3, 3).
        velocities: of the centres of mass, shape (n, B, 3) [m/s].
        angular_velocities: angular velocities, shape (n, B, 3) [rad/s].
        multipliers: Exudyn's multipliers of each joint's constraint items, shape (n, items, 6).
        dissipated: energy dissipated since the start, shape (n,) [J].
        spring_work: work against springs without an energy since the start, shape (n,) [J].
        load_work: work done by loads and drives since the start, shape (n,) [J].
        coordinate_multipliers: multipliers of links and drives, which are minus their torques,
            shape (n, rows) [N m].
        accelerations: angular, and of the centres of mass, shape (n, B, 6) [rad/s2, m/s2]; known
            after compiled integration, in place of the multipliers.
        displacements: of the joints that are known without their poses, shape (n, dof) each.
        closing_wrenches: force of the constraints of each joint that closes a loop on its child and
            moment about the world's origin, shape (n, 6) [N, N m]; after compiled integration.
        contact: integrals of contact, and its forces after every step; None without props.
    """

    times: Array
    positions: Array
    rotations: Array
    velocities: Array
    angular_velocities: Array
    multipliers: Mapping[str, Array]
    dissipated: Array
    spring_work: Array
    load_work: Array
    coordinate_multipliers: Array = field(default_factory=lambda: np.zeros((0, 0)))
    accelerations: Array | None = None
    displacements: Mapping[str, Array] = field(default_factory=dict[str, Array])
    closing_wrenches: Mapping[str, Array] = field(default_factory=dict[str, Array])
    contact: ContactTrace | None = None

    def __len__(self) -> int:
        """Number of frames."""
        return self.times.size

    def first_frames(self, count: int) -> "Trace":
        """Return the first `count` frames."""
        contact = self.contact
        if contact is not None:
            contact = contact.first_frames(count, float(self.times[:count][-1]))
        return replace(self._map_arrays(lambda values: values[:count]), contact=contact)

    def with_motion(
        self, positions: Array, rotations: Array, velocities: Array, angular_velocities: Array
    ) -> "Trace":
        """Return a copy with another motion; shapes and axes as those of the attributes."""
        return replace(
            self,
            positions=positions,
            rotations=rotations,
            velocities=velocities,
            angular_velocities=angular_velocities,
        )

    def extend_from(self, longer: "Trace") -> "Trace":
        """Append the frames by which another trace is longer."""
        count = len(self)

        def extend(first: Array, second: Array) -> Array:
            return np.concatenate([first, second[count:]])

        return Trace(
            extend(self.times, longer.times),
            extend(self.positions, longer.positions),
            extend(self.rotations, longer.rotations),
            extend(self.velocities, longer.velocities),
            extend(self.angular_velocities, longer.angular_velocities),
            {name: extend(m, longer.multipliers[name]) for name, m in self.multipliers.items()},
            extend(self.dissipated, longer.dissipated),
            extend(self.spring_work, longer.spring_work),
            extend(self.load_work, longer.load_work),
            extend(self.coordinate_multipliers, longer.coordinate_multipliers),
            contact=None
            if self.contact is None or longer.contact is None
            else self.contact.extend_from(longer.contact),
        )

    def _map_arrays(self, change: Callable[[Array], Array]) -> "Trace":
        multipliers = {name: change(values) for name, values in self.multipliers.items()}
        return Trace(
            change(self.times),
            change(self.positions),
            change(self.rotations),
            change(self.velocities),
            change(self.angular_velocities),
            multipliers,
            change(self.dissipated),
            change(self.spring_work),
            change(self.load_work),
            change(self.coordinate_multipliers),
            None if self.accelerations is None else change(self.accelerations),
            {name: change(values) for name, values in self.displacements.items()},
            {name: change(values) for name, values in self.closing_wrenches.items()},
        )


@dataclass(frozen=True)
class IntegrationPass:
    """Result of one pass.

    Attributes:
        trace: the frames up to the end.
        outcome: how the pass ended.
        step: step in a frame without subintervals [s].
        steps: number of steps taken.
        wall_time: wall time of the integration [s].
        step_hints: breakpoint crossings of spring laws, for the next pass.
    """

    trace: Trace
    outcome: Outcome
    step: float
    steps: int
    wall_time: float
    step_hints: StepHints


FrameCallback = Callable[[float], None]
"""Called with the simulated time [s] after every frame."""


def frame_times(start: float, stop: float, frame: float) -> Array:
    """Times of the frames [s]: every `frame` from `start`, and `stop` itself."""
    count = max(1, ceil((stop - start) / frame - 1e-9))
    return np.append(start + frame * np.arange(count), stop)


def integrate(
    model: ExudynModel,
    times: Array,
    step: float,
    newton_tolerance: float,
    deadline: float,
    on_frame: FrameCallback,
    hints: StepHints | None = None,
    subdivision: int = 1,
) -> IntegrationPass:
    """Integrate a model over the frames.

    Args:
        model: a new model, which cannot be used again.
        times: times of the frames [s], shape (n,).
        step: largest step [s]; each frame interval is divided into equal steps not longer than it.
        newton_tolerance: relative tolerance of Newton's method.
        deadline: `time.monotonic()` after which the pass stops.
        on_frame: called with the time after each frame.
        hints: breakpoint crossings of an earlier pass over the same frames, where steps should end.
        subdivision: factor by which steps are divided further; the steps of two passes that differ
            only in it have this ratio everywhere, including subintervals.

    Returns:
        The pass; a failure is its outcome, never an exception.
    """
    wall_start = time.monotonic()
    settings = _settings(newton_tolerance)
    multipliers = _initial_multipliers(model, settings, float(times[0]))
    sensors = SensorLog(model)
    log = _StateLog(model, float(times[0]), multipliers)
    steps, last_read, k = 0, 0, 0
    hints, discontinuities = hints or StepHints(), load_discontinuities(model)
    outcome = Outcome(Ending.DONE, "", float(times[-1]))
    callback = _StepCallback(log, on_frame, deadline)
    steps_per_frame = subdivision * count_steps(float(times[1] - times[0]), step)
    try:
        while k + 1 < times.size:
            max_frames = min(
                last_read + FRAMES_PER_SENSOR_READ - k, MAX_STEPS_PER_CHUNK // steps_per_frame
            )
            last = last_frame_of_batch(times, k, max_frames, discontinuities, hints)
            start, stop = float(times[k]), float(times[last])
            try:
                if last > k + 1:
                    count = (last - k) * steps_per_frame
                    with callback.track_frames(model.mbs, times[k + 1 : last], steps_per_frame):
                        _advance(model, settings, (start, stop), count, last_read < k)
                    steps += count
                    if callback.stopped:
                        raise TimeoutError
                else:
                    crossings = hints.crossing_times(k, start, stop, sensors.current_displacement)
                    for interval in subintervals(
                        start, stop, discontinuities, crossings, step / subdivision
                    ):
                        count = subdivision * count_steps(interval[1] - interval[0], step)
                        for chunk, chunk_steps in step_chunks(interval, count):
                            if time.monotonic() > deadline and chunk[0] > start:
                                raise TimeoutError
                            _advance(
                                model,
                                settings,
                                chunk,
                                chunk_steps,
                                last_read < k or chunk[0] > start,
                            )
                            steps += chunk_steps
            except SolverError:
                outcome = _solver_failure_outcome(model, log, sensors)
                break
            except TimeoutError:
                outcome = _timeout_outcome(log.last_time)
                break
            log.record(stop)
            k = last
            if k - last_read == FRAMES_PER_SENSOR_READ or stop == times[-1]:
                crossing = sensors.read(times[last_read + 1 : k + 1])
                last_read = k
                if crossing is not None:
                    outcome = half_turn_outcome(crossing)
                    break
            on_frame(stop)
            if time.monotonic() > deadline and stop < times[-1]:
                outcome = _timeout_outcome(stop)
                break
    except KeyboardInterrupt:
        outcome = _interruption_outcome(log.last_time)
    reached = len(log)
    if last_read + 1 < reached:
        crossing = sensors.read(times[last_read + 1 : reached])
        outcome = outcome if crossing is None else half_turn_outcome(crossing)
    wall_time = time.monotonic() - wall_start
    trace = log.build_trace(sensors)
    if outcome.ending is Ending.TURNED_OVER:
        # The first frame stays, also where a fast joint turns over before the second.
        trace = trace.first_frames(max(1, int(np.searchsorted(times, outcome.last_time))))
    last = float(trace.times[-1])
    outcome = replace(outcome, last_time=last)
    frame = float(times[1] - times[0])
    used_step = frame / steps_per_frame
    return IntegrationPass(trace, outcome, used_step, steps, wall_time, sensors.step_hints)


class _StepCallback:
    """Records the frames within a batch; Exudyn calls it after every step."""

    def __init__(self, log: "_StateLog", on_frame: FrameCallback, deadline: float) -> None:
        self._log, self._on_frame, self._deadline = log, on_frame, deadline
        self._frame_times: list[float] = []
        self.stopped = False
        self._steps_per_frame, self._steps, self._recorded, self._reported = 1, 0, 0, 0

    @contextmanager
    def track_frames(self, mbs: Any, times: Array, every: int) -> Generator[None]:
        """Record frames at times [s], one after each `every` steps, during a batch."""
        self._frame_times, self._steps_per_frame = times.tolist(), every
        self._steps, self._recorded, self._reported = -1, 0, 0
        mbs.SetPostStepUserFunction(self)
        try:
            yield
        finally:
            # Exudyn would keep this object, and through it the system itself.
            mbs.SetPostStepUserFunction(0)

    def __call__(self, mbs: Any, now: float) -> bool:
        """Handle the start or a step; return whether to continue."""
        self._steps += 1
        if self._reported < self._recorded:
            # Exudyn stores the sensors of a frame only after this call.
            self._reported += 1
            self._on_frame(self._frame_times[self._reported - 1])
        is_frame = self._steps > 0 and self._steps % self._steps_per_frame == 0
        if is_frame and self._recorded < len(self._frame_times):
            self._log.record(self._frame_times[self._recorded])
            self._recorded += 1
            self.stopped = time.monotonic() > self._deadline
        return not self.stopped


def _settings(newton: float) -> Any:
    """Return the simulation settings of a pass."""
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.adaptiveStep = False
    integration.newton.useModifiedNewton = True
    # A Jacobian costs as much as a dozen iterations: update it when they converge more slowly.
    integration.newton.modifiedNewtonContractivity = 0.2
    integration.newton.relativeTolerance = newton
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.solution.file.write = False
    return settings


def _advance(
    model: ExudynModel,
    settings: Any,
    interval: tuple[float, float],
    count: int,
    is_continuation: bool,
    keep: bool = True,
) -> None:
    """Take `count` equal steps; with `keep` the next call starts from the final state.

    Raises SolverError.
    """
    integration = settings.timeIntegration
    set_times(integration, *interval)
    integration.numberOfSteps = count
    settings.solution.sensors.writePeriod = (interval[1] - interval[0]) / count / 2.0
    settings.solution.sensors.append = is_continuation
    settings.solution.file.writeInitialValues = (
        not is_continuation and interval[0] == model.plan.start
    )
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

    def __init__(self, model: ExudynModel, start: float, multipliers: "Multipliers") -> None:
        """Record the initial state with its multipliers."""
        self._model = model
        # The bodies' coordinates come first; that of a clock may follow.
        self._count = 7 * len(model.figure.bodies)
        self._reference = np.asarray(
            model.mbs.systemData.GetODE2Coordinates(configuration=exu.ConfigurationType.Reference)
        )[: self._count]
        self._times: list[float] = []
        self._states: list[tuple[Array, Array]] = []
        self._multipliers: list[Multipliers] = []
        self.record(start, multipliers)

    def __len__(self) -> int:
        return len(self._multipliers)

    @property
    def last_time(self) -> float:
        """Time of the last state [s]."""
        return self._times[len(self) - 1]

    def record(self, now: float, multipliers: "Multipliers | None" = None) -> None:
        """Record the current state, with the current multipliers by default."""
        data = self._model.mbs.systemData
        coordinates = np.array(data.GetODE2Coordinates())[: self._count]
        rates = np.array(data.GetODE2Coordinates_t())[: self._count]
        self._times.append(now)
        self._states.append((coordinates, rates))
        self._multipliers.append(multipliers or current_multipliers(self._model))

    def fastest_joint(self) -> str:
        """Return the joint with the largest relative angular velocity at the last state."""
        coordinates, rates = (part.reshape(-1, 7) for part in self._states[len(self) - 1])
        parameters = (coordinates + self._reference.reshape(-1, 7))[:, 3:]
        return fastest_joint(
            self._model.figure, angular_velocities_from_parameters(parameters, rates[:, 3:])
        )

    def build_trace(self, sensors: SensorLog) -> Trace:
        """Return the states whose sensors have been read."""
        count = min(len(self), len(sensors.work))
        bodies = len(self._model.figure.bodies)
        q, rates = (
            np.array([state[k] for state in self._states[:count]]).reshape(count, bodies, 7)
            for k in range(2)
        )
        q = q + self._reference.reshape(bodies, 7)
        work = np.array(sensors.work[:count])
        return Trace(
            np.array(self._times[:count]),
            q[..., :3],
            rotations_from_parameters(q[..., 3:]),
            rates[..., :3],
            angular_velocities_from_parameters(q[..., 3:], rates[..., 3:]),
            {
                name: np.array([row.joints[name] for row in self._multipliers[:count]])
                for name in self._model.joints
            },
            work[:, 0],
            work[:, 1],
            work[:, 2],
            np.array([row.coordinates for row in self._multipliers[:count]]),
            contact=sensors.contact_trace(count),
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
        _advance(model, settings, (start, start + _NEGLIGIBLE_STEP), 1, False, keep=False)
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
        return half_turn_outcome(HalfTurnCrossing(near[0], log.last_time))
    return solver_failure_outcome(log.fastest_joint(), log.last_time)


def solver_failure_outcome(fastest: str, last_time: float) -> Outcome:
    """Return the outcome of a run whose step became too short, or whose iterations diverged."""
    message = f"the solver failed after {last_time:.4g} s; the fastest joint was {fastest}"
    return Outcome(Ending.SOLVER_FAILED, message, last_time, fastest)


def fastest_joint(figure: Figure, spins: Array) -> str:
    """Return the joint with the largest relative angular velocity.

    Args:
        figure: with B moving segments.
        spins: their angular velocities, shape (B, 3) [rad/s].
    """
    by_segment = dict.fromkeys(figure.ground, np.zeros(3))
    by_segment.update(zip(figure.bodies, spins, strict=True))
    speeds = {
        name: float(np.linalg.norm(np.subtract(*(by_segment[ref.segment] for ref in joint.ends))))
        for name, joint in figure.joints.items()
    }
    return max(speeds, key=lambda name: speeds[name])


def half_turn_outcome(crossing: HalfTurnCrossing) -> Outcome:
    """Return the outcome of a run that ends at 180 deg of a joint."""
    return Outcome(
        Ending.TURNED_OVER,
        f"joint {crossing.joint} rotated through 180 deg at {crossing.time:.4g} s, where "
        "the torque of its springs is not defined",
        crossing.time,
        crossing.joint,
    )


def _timeout_outcome(now: float) -> Outcome:
    return Outcome(Ending.TOO_LONG, f"the wall-time limit was reached at {now:.4g} s", now)


def _interruption_outcome(now: float) -> Outcome:
    return Outcome(Ending.INTERRUPTED, f"interrupted at {now:.4g} s", now)
