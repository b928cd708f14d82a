"""One pass: the integrator goes from frame to frame with a fixed number of steps in each.

Exudyn's trapezoidal rule with constraints on velocity level (index 2) is restarted at each frame,
which it does without loss, and at the corners of spring laws where an earlier pass met them: a step
across a corner would spoil the order that the extrapolation lives on. Between frames the pass can
stop: for Ctrl-C, for the wall clock, for a joint that went through 180 deg. The step is never
halved, so no pass can crawl.
"""

import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from math import ceil
from typing import Any

import numpy as np

from generator.recording import Ending, Outcome
from generator.rotations import Array
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
"""A step so short that nothing moves in it [s]."""

FRAMES_PER_SENSOR_READ = 20
"""Frames between two readings of the meters: reading each costs as much as many steps."""

_MIN_SUSPECT_ANGLE = 2.8
"""A solver that fails with a sprung joint beyond this angle [rad] failed for that joint."""


@dataclass(frozen=True)
class Trace:
    """States at n frames of B bodies, in world axes.

    Attributes:
        times: shape (n,) [s].
        positions: of the centres of mass, shape (n, B, 3) [m].
        rotations: of the segment axes, shape (n, B, 3, 3).
        velocities: of the centres of mass, shape (n, B, 3) [m/s].
        angular_velocities: angular velocities, shape (n, B, 3) [rad/s].
        multipliers: of each constraint item of each joint, shape (n, items, 6), as Exudyn tells
            them.
        dissipated: energy taken by damping since the start, shape (n,) [J].
        spring_work: work done since the start against springs that have no energy, shape (n,) [J].
        load_work: work done by loads and drives since the start, shape (n,) [J].
        coordinate_multipliers: multipliers of the servos' rows, shape (n, rows) [N m]: minus the torques.
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

    def __len__(self) -> int:
        """Number of frames."""
        return self.times.size

    def first_frames(self, count: int) -> "Trace":
        """The first `count` frames."""
        return self._map_arrays(lambda values: values[:count])

    def with_motion(
        self, positions: Array, rotations: Array, velocities: Array, angular_velocities: Array
    ) -> "Trace":
        """The same with the bodies elsewhere; shapes and axes as those of the attributes."""
        return replace(
            self,
            positions=positions,
            rotations=rotations,
            velocities=velocities,
            angular_velocities=angular_velocities,
        )

    def extend_from(self, longer: "Trace") -> "Trace":
        """These frames, and after them those that another trace has more."""
        count = len(self)

        def after(mine: Array, others: Array) -> Array:
            return np.concatenate([mine, others[count:]])

        return Trace(
            after(self.times, longer.times),
            after(self.positions, longer.positions),
            after(self.rotations, longer.rotations),
            after(self.velocities, longer.velocities),
            after(self.angular_velocities, longer.angular_velocities),
            {name: after(m, longer.multipliers[name]) for name, m in self.multipliers.items()},
            after(self.dissipated, longer.dissipated),
            after(self.spring_work, longer.spring_work),
            after(self.load_work, longer.load_work),
            after(self.coordinate_multipliers, longer.coordinate_multipliers),
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
        )


@dataclass(frozen=True)
class IntegrationPass:
    """What one pass left, and how it ended.

    Attributes:
        trace: the frames up to the end.
        outcome: how it ended.
        step: the step of a frame that is not cut [s].
        steps: number of steps taken.
        wall_time: time spent stepping [s].
        step_hints: what it tells the next pass of corners of spring laws.
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
    assembly: ExudynModel,
    times: Array,
    step: float,
    newton_tolerance: float,
    deadline: float,
    on_frame: FrameCallback,
    hints: StepHints | None = None,
    subdivision: int = 1,
) -> IntegrationPass:
    """Integrate an assembly over the frames.

    Args:
        assembly: a fresh one; it is used up.
        times: of the frames [s], shape (n,).
        step: largest step [s]; each frame interval is cut into equal steps not longer than it.
        newton_tolerance: relative tolerance of Newton's method.
        deadline: `time.monotonic()` after which the pass stops.
        on_frame: told the time after each frame.
        hints: an earlier pass over the same frames, which tells where steps shall end.
        subdivision: into how many each step is cut again: two passes that differ in it alone have steps
            in this ratio everywhere, also where a frame is cut at corners.

    Returns:
        The pass; a failure is its outcome, never an exception.
    """
    begun = time.monotonic()
    settings = _settings(newton_tolerance)
    first = _initial_multipliers(assembly, settings, float(times[0]))
    meters = SensorLog(assembly)
    log = _StateLog(assembly, float(times[0]), first)
    steps, read, k = 0, 0, 0
    hints, jumps = hints or StepHints(), load_discontinuities(assembly)
    outcome = Outcome(Ending.DONE, "", float(times[-1]))
    passing = _StepCallback(log, on_frame, deadline)
    a_frame = subdivision * count_steps(float(times[1] - times[0]), step)
    try:
        while k + 1 < times.size:
            most = min(read + FRAMES_PER_SENSOR_READ - k, MAX_STEPS_PER_CHUNK // a_frame)
            last = last_frame_of_batch(times, k, most, jumps, hints)
            here, there = float(times[k]), float(times[last])
            try:
                if last > k + 1:
                    count = (last - k) * a_frame
                    with passing.track_frames(assembly.mbs, times[k + 1 : last], a_frame):
                        _advance(assembly, settings, (here, there), count, read < k)
                    steps += count
                    if passing.stopped:
                        raise TimeoutError
                else:
                    corners = hints.crossing_times(k, here, there, meters.current_displacement)
                    for interval in subintervals(here, there, jumps, corners, step / subdivision):
                        count = subdivision * count_steps(interval[1] - interval[0], step)
                        for bite, some in step_chunks(interval, count):
                            if time.monotonic() > deadline and bite[0] > here:
                                raise TimeoutError
                            _advance(assembly, settings, bite, some, read < k or bite[0] > here)
                            steps += some
            except SolverError:
                outcome = _solver_failure_outcome(assembly, log, meters)
                break
            except TimeoutError:
                outcome = _timeout_outcome(log.last_time)
                break
            log.record(there)
            k = last
            if k - read == FRAMES_PER_SENSOR_READ or there == times[-1]:
                flip = meters.read(times[read + 1 : k + 1])
                read = k
                if flip is not None:
                    outcome = _half_turn_outcome(flip)
                    break
            on_frame(there)
            if time.monotonic() > deadline and there < times[-1]:
                outcome = _timeout_outcome(there)
                break
    except KeyboardInterrupt:
        outcome = _interruption_outcome(log.last_time)
    reached = len(log)
    if read + 1 < reached:
        flip = meters.read(times[read + 1 : reached])
        outcome = outcome if flip is None else _half_turn_outcome(flip)
    spent = time.monotonic() - begun
    trace = log.build_trace(meters)
    if outcome.ending is Ending.TURNED_OVER:
        # The first frame stays, also where a fast joint turns over before the second.
        trace = trace.first_frames(max(1, int(np.searchsorted(times, outcome.last_time))))
    last = float(trace.times[-1])
    outcome = replace(outcome, last_time=last)
    frame = float(times[1] - times[0])
    used = frame / a_frame
    return IntegrationPass(trace, outcome, used, steps, spent, meters.step_hints)


class _StepCallback:
    """Takes the frames that the integrator passes without a stop; Exudyn calls it at every step."""

    def __init__(self, log: "_StateLog", on_frame: FrameCallback, deadline: float) -> None:
        self._log, self._watch, self._deadline = log, on_frame, deadline
        self._waiting: list[float] = []
        self.stopped = False
        self._every, self._steps, self._taken, self._told = 1, 0, 0, 0

    @contextmanager
    def track_frames(self, mbs: Any, times: Array, every: int) -> Generator[None]:
        """While a leg is integrated that passes frames [s], one after each `every` steps."""
        self._waiting, self._every = times.tolist(), every
        self._steps, self._taken, self._told = -1, 0, 0
        mbs.SetPostStepUserFunction(self)
        try:
            yield
        finally:
            # Exudyn would keep this object, and through it the system itself.
            mbs.SetPostStepUserFunction(0)

    def __call__(self, mbs: Any, now: float) -> bool:
        """Told of the start and after every step; whether to go on."""
        self._steps += 1
        if self._told < self._taken:
            # Only now are the sensors of the frame stored.
            self._told += 1
            self._watch(self._waiting[self._told - 1])
        here = self._steps > 0 and self._steps % self._every == 0
        if here and self._taken < len(self._waiting):
            self._log.record(self._waiting[self._taken])
            self._taken += 1
            self.stopped = time.monotonic() > self._deadline
        return not self.stopped


def _settings(newton: float) -> Any:
    """Simulation settings that do not change during a pass."""
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.adaptiveStep = False
    integration.newton.useModifiedNewton = True
    # A Jacobian costs as much as a dozen iterations: renew it once they gain less than this.
    integration.newton.modifiedNewtonContractivity = 0.2
    integration.newton.relativeTolerance = newton
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.solution.file.write = False
    return settings


def _advance(
    assembly: ExudynModel,
    settings: Any,
    interval: tuple[float, float],
    count: int,
    is_continuation: bool,
    keep: bool = True,
) -> None:
    """Take `count` steps from one frame to the next, and start from there next time if `keep`.

    Raises SolverError.
    """
    integration = settings.timeIntegration
    set_times(integration, *interval)
    integration.numberOfSteps = count
    settings.solution.sensors.writePeriod = (interval[1] - interval[0]) / count / 2.0
    settings.solution.sensors.append = is_continuation
    settings.solution.file.writeInitialValues = (
        not is_continuation and interval[0] == assembly.plan.start
    )
    try:
        assembly.mbs.SolveDynamic(
            settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2, updateInitialValues=keep
        )
    except Exception as failure:
        # A Ctrl-C comes back wrapped: while compiled code runs in a SystemError, within a function
        # of ours that Exudyn calls in an error of Exudyn.
        if isinstance(failure.__cause__, KeyboardInterrupt):
            raise failure.__cause__ from None
        raise


class _StateLog:
    """The states at the frames of a pass."""

    def __init__(self, assembly: ExudynModel, start: float, multipliers: "_Multipliers") -> None:
        """Begin with the state at the start, and the multipliers there."""
        self._assembly = assembly
        # The bodies come first; a clock may stand behind them.
        self._count = 7 * len(assembly.figure.bodies)
        self._reference = np.asarray(
            assembly.mbs.systemData.GetODE2Coordinates(
                configuration=exu.ConfigurationType.Reference
            )
        )[: self._count]
        self._times: list[float] = []
        self._states: list[tuple[Array, Array]] = []
        self._multipliers: list[_Multipliers] = []
        self.record(start, multipliers)

    def __len__(self) -> int:
        return len(self._multipliers)

    @property
    def last_time(self) -> float:
        """Time of the last state [s]."""
        return self._times[len(self) - 1]

    def record(self, now: float, multipliers: "_Multipliers | None" = None) -> None:
        """Keep the current state, with its multipliers unless others are given."""
        data = self._assembly.mbs.systemData
        coordinates = np.array(data.GetODE2Coordinates())[: self._count]
        rates = np.array(data.GetODE2Coordinates_t())[: self._count]
        self._times.append(now)
        self._states.append((coordinates, rates))
        self._multipliers.append(multipliers or _current_multipliers(self._assembly))

    def fastest_joint(self) -> str:
        """The joint whose segments turn fastest against each other at the last state."""
        figure = self._assembly.figure
        coordinates, rates = (part.reshape(-1, 7) for part in self._states[len(self) - 1])
        parameters = (coordinates + self._reference.reshape(-1, 7))[:, 3:]
        spins = dict.fromkeys(figure.ground, np.zeros(3))
        spins.update(
            zip(
                figure.bodies,
                angular_velocities_from_parameters(parameters, rates[:, 3:]),
                strict=True,
            )
        )
        speeds = {
            name: float(np.linalg.norm(spins[joint.child.segment] - spins[joint.parent.segment]))
            for name, joint in figure.joints.items()
        }
        return max(speeds, key=lambda name: speeds[name])

    def build_trace(self, sensors: SensorLog) -> Trace:
        """All states that are complete."""
        count = min(len(self), len(sensors.work))
        bodies = len(self._assembly.figure.bodies)
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
                for name in self._assembly.joints
            },
            work[:, 0],
            work[:, 1],
            work[:, 2],
            np.array([row.coordinates for row in self._multipliers[:count]]),
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
class _Multipliers:
    """Those of the joints' constraint items, shape (items, 6), and of all servos' rows, (rows,)."""

    joints: dict[str, Array]
    coordinates: Array


def _initial_multipliers(assembly: ExudynModel, settings: Any, start: float) -> _Multipliers:
    """The multipliers at the start, which Exudyn leaves zero: those after a step of no account.

    The assembly is back at its start when it is assembled anew. A solver that fails here will fail
    in the first step of the pass as well, and be told of there.
    """
    with suppress(SolverError):
        _advance(assembly, settings, (start, start + _NEGLIGIBLE_STEP), 1, False, keep=False)
    return _current_multipliers(assembly)


def _current_multipliers(assembly: ExudynModel) -> _Multipliers:
    """The multipliers of all constraints now."""
    joints = {
        name: np.array([_joint_multipliers(assembly.mbs, c) for c in constraints])
        for name, constraints in assembly.joints.items()
    }
    kind = exu.OutputVariableType.Force
    servos = [
        np.atleast_1d(np.asarray(assembly.mbs.GetObjectOutput(servo.item, kind), dtype=float))
        for servo in assembly.coordinate_constraints
    ]
    return _Multipliers(joints, np.concatenate([np.zeros(0), *servos]))


def _joint_multipliers(mbs: Any, constraint: Constraint) -> Array:
    """Force (of a ball joint in world axes) and rotation multipliers of a joint, shape (6,)."""
    kinds = exu.OutputVariableType
    if constraint.is_spherical:
        return np.append(np.asarray(mbs.GetObjectOutput(constraint.item, kinds.Force)), np.zeros(3))
    force = mbs.GetObjectOutput(constraint.item, kinds.ForceLocal)
    about = mbs.GetObjectOutput(constraint.item, kinds.TorqueLocal)
    return np.concatenate([np.asarray(force), np.asarray(about)])


def _solver_failure_outcome(assembly: ExudynModel, log: _StateLog, sensors: SensorLog) -> Outcome:
    """The solver gave up: which joint was worst."""
    near = sensors.nearest_half_turn()
    if near is not None and near[1] > _MIN_SUSPECT_ANGLE:
        return _half_turn_outcome(HalfTurnCrossing(near[0], log.last_time))
    joint = log.fastest_joint()
    return Outcome(
        Ending.SOLVER_FAILED,
        f"the solver failed after {log.last_time:.4g} s, when joint {joint} moved fastest",
        log.last_time,
        joint,
    )


def _half_turn_outcome(crossing: HalfTurnCrossing) -> Outcome:
    return Outcome(
        Ending.TURNED_OVER,
        f"joint {crossing.joint} turned through 180 deg at {crossing.time:.4g} s, where "
        "the torque of its springs is not defined",
        crossing.time,
        crossing.joint,
    )


def _timeout_outcome(now: float) -> Outcome:
    return Outcome(Ending.TOO_LONG, f"the wall time allowed was used up at {now:.4g} s", now)


def _interruption_outcome(now: float) -> Outcome:
    return Outcome(Ending.INTERRUPTED, f"interrupted at {now:.4g} s", now)
