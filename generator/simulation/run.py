"""A figure and a plan become a recording."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from generator.figure import Figure
from generator.recording import Accuracy, Ending, Outcome, Recording
from generator.rotations import Array
from generator.simulation.error_control import (
    EARLY_STOP_ENDINGS,
    RefinedRun,
    first_step,
    refine_until_converged,
)
from generator.simulation.integrate import IntegrationPass, Trace, frame_times, integrate
from generator.simulation.joint_motion import (
    JointMotion,
    SegmentMotion,
    constraint_torques,
    drive_torques,
    energy_by_kind,
)
from generator.simulation.model import ExudynModel, build_model
from generator.simulation.plan import Plan, resolve_springs
from generator.simulation.projection import (
    constraint_drift,
    explain_dead_point,
    explain_singularity,
    project_to_constraints,
)
from generator.simulation.step_schedule import StepHints
from springs import SpringSet

MAX_JOINT_GAP = 0.01
"""A run in which a joint's sites part by more than this has blown up [m]."""

MAX_CONSTRAINT_DRIFT = 0.01
"""So has one in which a locked, linked or driven joint is off by more than this [rad or m]; it may
have come to where the rates of its displacements are not defined."""


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    Attributes:
        pass_number: from 1; later passes have smaller steps.
        step: of the pass [s].
        time: simulated time that the pass has reached [s].
    """

    pass_number: int
    step: float
    time: float


def simulate(
    figure: Figure, plan: Plan | None = None, watch: Callable[[Progress], None] | None = None
) -> Recording:
    """Let a figure move under gravity, loads and its passive joints.

    Args:
        figure: what moves; its springs are those of the plan, else those of its file.
        plan: everything else; None for one second at the default tolerance.
        watch: told the progress after every frame.

    Returns:
        The motion. A run that fails is an outcome in it, with the frames up to the last good time.

    Raises:
        MoverError: the figure or the plan cannot be built: the message says why.
    """
    plan = plan or Plan()
    springs = resolve_springs(figure, plan)
    times = frame_times(plan.start, plan.stop, plan.frame)
    deadline = time.monotonic() + plan.wall_limit
    runner = _PassRunner(figure, plan, springs, times, deadline, watch)
    if plan.step is None:
        refined = refine_until_converged(
            runner.first_model.figure,
            plan.tolerance,
            runner.run_pass,
            runner.longest_step,
            deadline,
        )
    else:
        refined = _fixed_step_run(runner.run_pass())
    return _build_recording(runner, refined)


class _PassRunner:
    """Makes passes of one run, each on an assembly of its own."""

    def __init__(
        self,
        figure: Figure,
        plan: Plan,
        springs: SpringSet,
        times: Array,
        deadline: float,
        watch: Callable[[Progress], None] | None,
    ) -> None:
        self._figure, self._plan, self._springs = figure, plan, springs
        self._times, self._deadline, self._watch = times, deadline, watch
        self._passes = 0
        begun = time.monotonic()
        self.first_model: ExudynModel = build_model(figure, plan, springs)
        self.build_time = time.monotonic() - begun

    @property
    def _newton_tolerance(self) -> float:
        """Relative tolerance of Newton's method in the next pass.

        Well below what the extrapolation must see, and smaller with each pass: what Newton's method
        leaves undone then shows in the difference of passes like any other error.
        """
        if self._plan.step is not None:
            return 1e-9
        first = min(1e-2 * self._plan.tolerance, 1e-5)
        return max(first * max(0.1**self._passes, 1e-3), 1e-11)

    @property
    def longest_step(self) -> float:
        """The step that the plan gives, else that of the first pass [s]."""
        frame = float(self._times[1] - self._times[0])
        return self._plan.step or first_step(frame, self._plan.tolerance)

    def run_pass(self, subdivision: int = 1, hints: StepHints | None = None) -> IntegrationPass:
        """One pass with the longest step cut into parts, guided by an earlier one."""
        assembly, newton = self.first_model, self._newton_tolerance
        if self._passes:
            begun = time.monotonic()
            assembly = build_model(self._figure, self._plan, self._springs)
            self.build_time += time.monotonic() - begun
        self._passes += 1
        number, watch = self._passes, self._watch

        def told(now: float) -> None:
            if watch is not None:
                watch(Progress(number, self.longest_step / subdivision, now))

        return integrate(
            assembly,
            self._times,
            self.longest_step,
            newton,
            self._deadline,
            told,
            hints,
            subdivision,
        )


def _fixed_step_run(one: IntegrationPass) -> RefinedRun:
    """The result of a run whose step was given."""
    last = float(one.trace.times[-1])
    message = one.outcome.message or f"done at {last:.4g} s with a fixed step of {one.step:.3g} s"
    accuracy = Accuracy(None, None, last, one.step, one.steps, np.full(len(one.trace), np.nan))
    return RefinedRun(one.trace, replace(one.outcome, message=message), accuracy, one.wall_time)


def _build_recording(runner: _PassRunner, refined: RefinedRun) -> Recording:
    """The motion in the figure's terms."""
    assembly, trace = runner.first_model, refined.trace
    figure = assembly.figure
    motion = SegmentMotion(assembly, trace)
    starts = assembly.placement.displacements
    joints = {name: motion.joint(joint, starts[name]) for name, joint in figure.joints.items()}
    drifts, strayed = _joint_gaps(assembly, joints), {}
    if assembly.prescribed:
        strayed = constraint_drift(assembly, trace, joints)
    torn = _truncate_at_separation(refined, drifts, strayed) if len(trace) > 1 else None
    if torn is not None:
        return _build_recording(runner, torn)
    if assembly.prescribed:
        trace = project_to_constraints(assembly, trace, joints)
        motion = SegmentMotion(assembly, trace)
        joints = {name: motion.joint(joint, starts[name]) for name, joint in figure.joints.items()}
    pulled = constraint_torques(assembly, trace, joints)
    reactions = {name: motion.reaction(one, joints[name]) for name, one in figure.joints.items()}
    for name, torque in pulled.items():
        reactions[name][:, 3:] += torque
    return Recording(
        times=trace.times,
        poses=motion.poses,
        chains={name: joint.chain for name, joint in figure.joints.items()},
        displacements={name: moved.displacements for name, moved in joints.items()},
        velocities={name: moved.rates for name, moved in joints.items()},
        rotation_vectors={name: moved.rotation_vectors for name, moved in joints.items()},
        reactions=reactions,
        passive_torques=motion.passive_torques(joints),
        centre_of_mass=_centre_of_mass_path(figure, trace),
        energy=energy_by_kind(assembly, trace, joints),
        outcome=explain_singularity(
            assembly, explain_dead_point(assembly, refined.outcome, joints), joints
        ),
        accuracy=refined.accuracy,
        constraint_drift=_max_over_joints(drifts),
        strayed=_max_over_joints(strayed),
        drive_torques=drive_torques(assembly, pulled, joints),
        wall_time=refined.wall_time,
        build_time=runner.build_time,
        springs=assembly.spring_set.origin,
        law=assembly.spring_set.joining.value,
    )


def _centre_of_mass_path(figure: Figure, trace: Trace) -> Array:
    """Of all that moves (eq. 5.1), shape (n, 3) [m]."""
    masses = np.array([body.mass for body in figure.bodies.values()], dtype=float)
    return np.asarray(np.einsum("b,nbk->nk", masses, trace.positions) / np.sum(masses))


def _joint_gaps(assembly: ExudynModel, joints: Mapping[str, JointMotion]) -> dict[str, Array]:
    """Distance by which each joint's sites have parted that it should hold, shape (n,) [m]."""
    drifts: dict[str, Array] = {}
    for name, moved in joints.items():
        chain = assembly.placement.tree.chains[name]
        if not chain.translations:
            drifts[name] = np.linalg.norm(moved.pose_in_parent[:, :3, 3], axis=1)
        elif len(chain.translations) < 3:
            gaps = [np.linalg.norm(chain.pose_residual(pose)[3:]) for pose in moved.pose_in_parent]
            drifts[name] = np.array(gaps, dtype=float)
    return drifts


def _max_over_joints(by_joint: Mapping[str, Array]) -> float:
    return max((float(np.max(drift)) for drift in by_joint.values()), default=0.0)


def _truncate_at_separation(
    refined: RefinedRun, gaps: Mapping[str, Array], constraint_drifts: Mapping[str, Array]
) -> RefinedRun | None:
    """The run up to where a joint came apart or strayed, as a failure; None where all held."""
    first = {
        (joint, what): int(np.argmax(~(drift <= bound)))
        for what, bound, by_joint in (
            ("came apart", MAX_JOINT_GAP, gaps),
            ("left where it is held", MAX_CONSTRAINT_DRIFT, constraint_drifts),
        )
        for joint, drift in by_joint.items()
        if not np.all(drift <= bound)
    }
    if not first:
        return None
    joint, what = min(first, key=lambda one: first[one])
    count = max(1, first[joint, what])
    last = float(refined.trace.times[count - 1])
    message = f"joint {joint} {what} after {last:.4g} s: the step is too long for what acts there"
    outcome = Outcome(Ending.SOLVER_FAILED, message, last, joint)
    by_frame, estimate = refined.accuracy.by_frame[:count], refined.accuracy.estimate
    if refined.outcome.ending in EARLY_STOP_ENDINGS and estimate == np.inf:
        # The passes that there was time for were coarse: finer ones would have held.
        outcome = replace(refined.outcome, last_time=last)
    accuracy = replace(
        refined.accuracy,
        estimate=None if estimate is None else float(by_frame[-1]),
        by_frame=by_frame,
        held_until=min(last, refined.accuracy.held_until),
    )
    return replace(
        refined,
        trace=refined.trace.first_frames(count),
        outcome=outcome,
        accuracy=accuracy,
    )
