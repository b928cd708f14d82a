"""Simulation of a figure under a plan, and the recording of its motion."""

import time
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from math import inf
from typing import cast

import numpy as np

from generator.figure import Figure
from generator.kinematics.free_root import attaching_joints
from generator.recording import (
    EARLY_STOP_ENDINGS,
    WHOLE_RECORDING,
    Accuracy,
    Ending,
    Integrator,
    Outcome,
    Recording,
    RecordingPart,
)
from generator.rotations import Array
from generator.simulation.compiled.code_cache import require_numba
from generator.simulation.contact_summary import build_contact_record
from generator.simulation.contacts import mean_position
from generator.simulation.error_control import (
    RELIABLE_STEP,
    RELIABLE_STEP_WITH_CONTACT,
    RefinedRun,
    first_step,
    refine_until_converged,
)
from generator.simulation.integrate import IntegrationPass, frame_times, integrate
from generator.simulation.joint_motion import (
    JointMotion,
    SegmentMotion,
    constraint_torques,
    drive_torques,
    energy_by_kind,
    newton_euler_reactions,
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
from generator.simulation.wall_limit import WallLimit
from springs import SpringSet

MAX_JOINT_GAP = 0.01
"""Largest gap between a joint's sites; a larger one is a failure of the run [m]."""

MAX_CONSTRAINT_DRIFT = 0.01
"""Largest drift of a locked, linked or driven joint [rad or m]; a larger one is a failure of the
run, for example at a pose where the rates of its displacements are undefined."""


@dataclass(frozen=True)
class Progress:
    """Progress of a run.

    Attributes:
        pass_number: number of the pass or compiled run; later ones have smaller steps. The first
            compiled run, beside the second one, is not reported.
        step: step of the pass [s]; for compiled integration, the mean step so far.
        time: simulated time reached by the pass [s].
    """

    pass_number: int
    step: float
    time: float


def simulate(
    figure: Figure,
    plan: Plan | None = None,
    watch: Callable[[Progress], None] | None = None,
    *,
    record: Collection[RecordingPart] = WHOLE_RECORDING,
    threads: int = 2,
) -> Recording:
    """Simulate a figure under gravity, loads and the springs of its joints.

    Args:
        figure: the figure, with the springs of the plan, or with its own.
        plan: parameters of the run; None for one second at the default tolerance.
        watch: called with the progress: after every frame by Exudyn's integrator, several times a
            second by the compiled one.
        record: parts of the recording that are computed beside the motion. Without the others a run
            takes less time; what is recorded is the same bit for bit.
        threads: 2 for a second thread, in which the coarser of the compared runs proceed, or 1. The
            result is the same bit for bit.

    Returns:
        The motion. A failed run is an outcome of it, with the frames up to the last valid time.

    Warns:
        UserWarning: there is a scene, and the figure stays attached to the ground.

    Raises:
        WallLimitError: the wall-time limit was reached while the model was built.
        MoverError: the figure or the plan cannot be built; the message states the reason.
        TypeError: the figure is a name, or the plan a number.
    """
    plan = Plan() if plan is None else plan
    if not isinstance(cast("object", figure), Figure):
        raise TypeError(
            f"simulate needs a Figure, such as person.figure or read_figure(...), not {figure!r}"
        )
    if isinstance(plan, int | float):
        raise TypeError(f"the second argument is a Plan, such as Plan(stop=2.0), not {plan!r}")
    limit = WallLimit.begin(plan.wall_limit)
    springs = resolve_springs(figure, plan)
    holders = [name for name in attaching_joints(figure) if name not in plan.drives]
    if plan.scene.props and not plan.free_root and holders:
        names = " and ".join(f"`{name}`" for name in holders)
        warnings.warn(
            f"The figure stays attached to the ground by {names} and does not fall: "
            "Plan(free_root=True) removes the attachment.",
            stacklevel=2,
        )
    times = frame_times(plan.start, plan.stop, plan.frame)
    runner = _PassRunner(figure, plan, springs, times, limit, watch, frozenset(record), threads)
    obstacle = _compiled_obstacle(runner.first_model)
    was_compiled = obstacle is None
    if obstacle is None:
        recording = _try_compiled(runner)
        if isinstance(recording, Recording):
            return recording
        obstacle = recording
    if plan.step is None:
        refined = refine_until_converged(
            runner.first_model.figure,
            plan.tolerance,
            runner.run_pass,
            runner.longest_step,
            limit.deadline,
            RELIABLE_STEP if runner.first_model.contacts is None else RELIABLE_STEP_WITH_CONTACT,
        )
    else:
        refined = _fixed_step_run(runner.run_pass())
    recording = _build_recording(runner, refined)
    if was_compiled and recording.outcome.ending is Ending.SOLVER_FAILED:
        # Exudyn's method was expected to be cheaper, but it fails: take all the steps.
        compiled = _try_compiled(runner, max_steps_per_second=inf)
        if isinstance(compiled, Recording) and compiled.times[-1] > recording.times[-1]:
            return compiled
    return replace(recording, integrator=Integrator.EXUDYN, integrator_reason=obstacle)


def _compiled_obstacle(model: ExudynModel) -> str | None:
    """Return why Exudyn's integrator is used; None for the compiled one."""
    if model.plan.integrator is Integrator.EXUDYN:
        return "it was asked for"
    if model.plan.step is not None:
        return "a fixed step was asked for"
    if model.plan.python_torques:
        return "the torques are Python functions"
    try:
        require_numba()
        import_module("generator.simulation.compiled_run")
    except ImportError as failure:
        return f"numba cannot be loaded ({failure})"
    return None


def _try_compiled(
    runner: "_PassRunner", max_steps_per_second: float | None = None
) -> Recording | str:
    """Run the model by the compiled method, or return why its result does not count.

    By default a motion that needs too many steps per simulated second does not count.
    """
    from generator.simulation.compiled.recorder import BranchingLawError
    from generator.simulation.compiled.refinement import StiffMotionError
    from generator.simulation.compiled_run import (
        MAX_DISAGREEMENT,
        MAX_STEPS_PER_SECOND,
        agreement_with_exudyn,
        run_compiled,
    )

    try:
        refined = run_compiled(
            runner.first_model,
            runner.times,
            runner.limit,
            runner.report,
            max_steps_per_second or MAX_STEPS_PER_SECOND,
            runner.record,
            runner.threads,
        )
    except (BranchingLawError, StiffMotionError) as failure:
        return str(failure)
    recording = _build_recording(runner, refined)
    agreement = agreement_with_exudyn(runner.first_model, refined.trace, recording.displacements)
    if not agreement <= MAX_DISAGREEMENT:
        return f"the compiled accelerations differ from Exudyn's by {agreement:.1e}"
    return replace(recording, agreement_with_exudyn=agreement)


class _PassRunner:
    """Runs the passes of a simulation, each on a new model."""

    def __init__(
        self,
        figure: Figure,
        plan: Plan,
        springs: SpringSet,
        times: Array,
        limit: WallLimit,
        watch: Callable[[Progress], None] | None,
        record: frozenset[RecordingPart],
        threads: int,
    ) -> None:
        self.record, self.threads = record, threads
        self._figure, self._plan, self._springs = figure, plan, springs
        self.times, self.limit, self._watch = times, limit, watch
        self._passes = 0
        start = time.monotonic()
        self.first_model: ExudynModel = build_model(figure, plan, springs, limit=limit)
        self.build_time = time.monotonic() - start

    @property
    def _newton_tolerance(self) -> float:
        """Relative tolerance of Newton's method in the next pass.

        It decreases with each pass, so that the residual of Newton's method contributes to the
        difference of passes like any other error.
        """
        if self._plan.step is not None:
            return 1e-9
        first = min(1e-2 * self._plan.tolerance, 1e-5)
        return max(first * max(0.1**self._passes, 1e-3), 1e-11)

    @property
    def longest_step(self) -> float:
        """Fixed step of the plan, or the step of the first pass [s]."""
        frame = float(self.times[1] - self.times[0])
        return self._plan.step or first_step(frame, self._plan.tolerance)

    def report(self, number: int, step: float, now: float) -> None:
        """Report the progress of a compiled run."""
        if self._watch is not None:
            self._watch(Progress(number, step, now))

    def run_pass(self, subdivision: int = 1, hints: StepHints | None = None) -> IntegrationPass:
        """Run a pass with the longest step subdivided, using the hints of an earlier one."""
        model, newton = self.first_model, self._newton_tolerance
        if self._passes:
            start = time.monotonic()
            model = build_model(self._figure, self._plan, self._springs)
            self.build_time += time.monotonic() - start
        self._passes += 1
        number, watch = self._passes, self._watch

        def on_frame(now: float) -> None:
            if watch is not None:
                watch(Progress(number, self.longest_step / subdivision, now))

        return integrate(
            model,
            self.times,
            self.longest_step,
            newton,
            self.limit.deadline,
            on_frame,
            hints,
            subdivision,
        )


def _fixed_step_run(only_pass: IntegrationPass) -> RefinedRun:
    """Return the result of a run with a fixed step."""
    last = float(only_pass.trace.times[-1])
    message = (
        only_pass.outcome.message
        or f"Finished {last:.4g} s with a fixed step of {only_pass.step:.3g} s."
    )
    accuracy = Accuracy(
        None, None, last, only_pass.step, only_pass.steps, np.full(len(only_pass.trace), np.nan)
    )
    return RefinedRun(
        only_pass.trace, replace(only_pass.outcome, message=message), accuracy, only_pass.wall_time
    )


def _build_recording(runner: _PassRunner, refined: RefinedRun) -> Recording:
    """Convert a run to the figure's joints and segments."""
    model, trace = runner.first_model, refined.trace
    figure = model.figure
    motion = SegmentMotion(model, trace)
    starts = model.placement.displacements
    joints = {name: motion.joint(joint, starts[name]) for name, joint in figure.joints.items()}
    gaps, constraint_drifts = _joint_gaps(model, joints), {}
    if model.prescribed:
        constraint_drifts = constraint_drift(model, trace, joints)
    truncated = (
        _truncate_at_separation(refined, gaps, constraint_drifts) if len(trace) > 1 else None
    )
    if truncated is not None:
        return _build_recording(runner, truncated)
    if model.prescribed:
        trace = project_to_constraints(model, trace, joints)
        motion = SegmentMotion(model, trace)
        joints = {name: motion.joint(joint, starts[name]) for name, joint in figure.joints.items()}
    record = runner.record
    passive_torques: dict[str, Array] = {}
    if {RecordingPart.PASSIVE_TORQUES, RecordingPart.REACTIONS} & record:
        passive_torques = motion.passive_torques(joints)
    reactions: dict[str, Array] = {}
    constraint_moments: dict[str, Array] = {}
    if RecordingPart.REACTIONS not in record:
        pass
    elif trace.accelerations is None:
        constraint_moments = constraint_torques(model, trace, joints)
        reactions = {name: motion.reaction(j, joints[name]) for name, j in figure.joints.items()}
        for name, torque in constraint_moments.items():
            reactions[name][:, 3:] += torque
    else:
        reactions = newton_euler_reactions(model, trace, joints, motion, passive_torques)
        constraint_moments = {name: wrench[:, 3:] for name, wrench in reactions.items()}
    return Recording(
        times=trace.times,
        poses=motion.poses,
        chains={name: joint.chain for name, joint in figure.joints.items()},
        displacements={name: moved.displacements for name, moved in joints.items()},
        velocities={name: moved.rates for name, moved in joints.items()}
        if RecordingPart.VELOCITIES in record
        else {},
        rotation_vectors={name: moved.rotation_vectors for name, moved in joints.items()}
        if RecordingPart.ROTATION_VECTORS in record
        else {},
        reactions=reactions,
        passive_torques=passive_torques if RecordingPart.PASSIVE_TORQUES in record else {},
        centre_of_mass=mean_position(figure, trace.positions),
        energy=energy_by_kind(model, trace, joints) if RecordingPart.ENERGY in record else {},
        outcome=explain_singularity(
            model, explain_dead_point(model, refined.outcome, joints), joints
        ),
        accuracy=refined.accuracy,
        constraint_drift=_max_over_joints(gaps),
        strayed=_max_over_joints(constraint_drifts),
        drive_torques=drive_torques(model, constraint_moments, joints) if reactions else {},
        wall_time=refined.wall_time,
        build_time=runner.build_time,
        springs=model.spring_set.origin,
        law=model.spring_set.joining.value,
        contact=build_contact_record(model, trace, motion.poses)
        if RecordingPart.CONTACT in record
        else None,
        recorded=record,
    )


def _joint_gaps(model: ExudynModel, joints: Mapping[str, JointMotion]) -> dict[str, Array]:
    """Gap of each joint along its locked translations, shape (n,) [m]."""
    gaps: dict[str, Array] = {}
    for name, motion in joints.items():
        chain = model.placement.tree.chains[name]
        if not chain.translations:
            gaps[name] = np.linalg.norm(motion.pose_in_parent[:, :3, 3], axis=1)
        elif len(chain.translations) < 3:
            residuals = chain.pose_residual(motion.pose_in_parent)
            gaps[name] = np.linalg.norm(residuals[:, 3:], axis=1)
    return gaps


def _max_over_joints(by_joint: Mapping[str, Array]) -> float:
    return max((float(np.max(drift)) for drift in by_joint.values()), default=0.0)


def _truncate_at_separation(
    refined: RefinedRun, gaps: Mapping[str, Array], constraint_drifts: Mapping[str, Array]
) -> RefinedRun | None:
    """Truncate a run before a joint exceeds its gap or drift, as a failure; None if none does."""
    first = {
        (joint, event): int(np.argmax(~(drift <= bound)))
        for event, bound, by_joint in (
            ("came apart", MAX_JOINT_GAP, gaps),
            ("drifted from its constraint", MAX_CONSTRAINT_DRIFT, constraint_drifts),
        )
        for joint, drift in by_joint.items()
        if not np.all(drift <= bound)
    }
    if not first:
        return None
    joint, event = min(first, key=lambda key: first[key])
    count = max(1, first[joint, event])
    last = float(refined.trace.times[count - 1])
    message = (
        f"joint {joint} {event} after {last:.4g} s: the step is too long, choose a smaller one"
    )
    outcome = Outcome(Ending.SOLVER_FAILED, message, last, joint)
    by_frame, estimate = refined.accuracy.by_frame[:count], refined.accuracy.estimate
    if count == 1 and estimate is not None:
        by_frame = np.full(1, np.inf)
    if refined.outcome.ending in EARLY_STOP_ENDINGS and estimate == np.inf:
        # The passes before the early stop were coarse, and finer ones may succeed.
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
