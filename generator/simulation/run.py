"""Simulation of a figure under a plan, and the recording of its motion."""

import time
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from math import inf
from typing import cast

import numpy as np

from generator.contact.record import ContactRecord
from generator.contact.states import ContactStates
from generator.contact.summary import build_contact_record
from generator.contact_file.parts import BodyContact
from generator.figure import Figure
from generator.kinematics.free_root import attaching_joints
from generator.model import Model
from generator.recording import (
    EARLY_STOP_ENDINGS,
    STEP_PARTS,
    WHOLE_RECORDING,
    Ending,
    Outcome,
    Recording,
    RecordingPart,
    energy_kinds,
)
from generator.rotations import Array
from generator.run_options import Integrator
from generator.simulation.compiled.code_cache import require_numba
from generator.simulation.exudyn_model.model import ExudynModel, build_exudyn
from generator.simulation.exudyn_run import run_exudyn
from generator.simulation.joint_motion import (
    JointMotion,
    SegmentMotion,
    constraint_wrenches,
    contact_of_trace,
    drive_torques,
    energy_by_kind,
    losses_by_kind,
    newton_euler_reactions,
)
from generator.simulation.plan import NO_LIMIT, Plan, WallLimit, resolve_model
from generator.simulation.projection import (
    constraint_drift,
    explain_dead_point,
    explain_singularity,
    project_to_constraints,
)
from generator.simulation.run_model import RunModel, prepare_run
from generator.simulation.trace import RefinedRun, Trace, frame_times, mean_position
from springs.coordinates import CoordinateLaw

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
    model: Model | Figure,
    plan: Plan | None = None,
    watch: Callable[[Progress], None] | None = None,
    *,
    record: Collection[RecordingPart] = WHOLE_RECORDING,
    threads: int = 2,
) -> Recording:
    """Simulate a model under gravity, loads and the springs of its joints.

    Args:
        model: Figure with springs; a figure alone gets the springs of the plan, or its own.
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
        MoverError: the model or the plan cannot be built; the message states the reason.
        TypeError: the model is a name, or the plan a number.
    """
    plan = Plan() if plan is None else plan
    if not isinstance(cast("object", model), Model | Figure):
        raise TypeError(
            "simulate needs a Model or a Figure, such as person.model or read_figure(...), "
            f"not {model!r}"
        )
    if isinstance(plan, int | float):
        raise TypeError(f"the second argument is a Plan, such as Plan(stop=2.0), not {plan!r}")
    limit = WallLimit.begin(plan.wall_limit)
    model, plan = resolve_model(model, plan)
    if plan.scene.props and not plan.free_root:
        holders = [name for name in attaching_joints(model.figure) if name not in plan.drives]
        names = " and ".join(f"`{name}`" for name in holders)
        if holders:
            warnings.warn(
                f"The figure stays attached to the ground by {names} and does not fall: "
                "Plan(free_root=True) removes the attachment.",
                stacklevel=2,
            )
    times = frame_times(plan.start, plan.stop, plan.frame)
    runner = _Runner(model, plan, times, limit, watch, frozenset(record), threads)
    obstacle = _compiled_obstacle(plan)
    was_compiled = obstacle is None
    runner.prepare(needs_exudyn=not was_compiled)
    if obstacle is None:
        recording = _try_compiled(runner)
        if isinstance(recording, Recording):
            return recording
        obstacle = recording
    refined = run_exudyn(runner.exudyn, runner.rebuild, times, limit.deadline, runner.report)
    recording = _build_recording(runner, refined)
    if was_compiled and recording.outcome.ending is Ending.SOLVER_FAILED:
        # Exudyn's method was expected to be cheaper, but it fails: take all the steps.
        compiled = _try_compiled(runner, max_steps_per_second=inf)
        if isinstance(compiled, Recording) and compiled.times[-1] > recording.times[-1]:
            return compiled
    return replace(recording, integrator=Integrator.EXUDYN, integrator_reason=obstacle)


def _compiled_obstacle(plan: Plan) -> str | None:
    """Return why Exudyn's integrator is used; None for the compiled one."""
    if plan.integrator is Integrator.EXUDYN:
        return "it was asked for"
    if plan.step is not None:
        return "a fixed step was asked for"
    if plan.python_torques:
        return "the torques are Python functions"
    try:
        require_numba()
        import_module("generator.simulation.compiled_run")
    except ImportError as failure:
        return f"numba cannot be loaded ({failure})"
    return None


def _try_compiled(runner: "_Runner", max_steps_per_second: float | None = None) -> Recording | str:
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
            runner.model,
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
    integrator = runner.model.plan.integrator
    if RecordingPart.AGREEMENT not in runner.record:
        return replace(recording, integrator=integrator)
    trace = refined.trace.first_frames(len(recording.times))  # a recording may be cut
    agreement = agreement_with_exudyn(runner.exudyn, trace, recording.displacements)
    if not agreement <= MAX_DISAGREEMENT:
        return f"the compiled accelerations differ from Exudyn's by {agreement:.1e}"
    return replace(recording, agreement_with_exudyn=agreement, integrator=integrator)


class _Runner:
    """Common data of the passes of a simulation, each of which needs a new model."""

    def __init__(
        self,
        model: Model,
        plan: Plan,
        times: Array,
        limit: WallLimit,
        watch: Callable[[Progress], None] | None,
        record: frozenset[RecordingPart],
        threads: int,
    ) -> None:
        self.record, self.threads = record, threads
        self.subject = model
        self.times, self.limit, self._watch = times, limit, watch
        start = time.monotonic()
        self.model = self._run = prepare_run(model, plan)
        self.build_time = time.monotonic() - start

    def prepare(self, *, needs_exudyn: bool) -> None:
        """Build what a run needs within its wall-time limit: Exudyn's model only for some.

        That is for Exudyn's integrator and the comparison with it, and to explain the failures of
        links and drives.
        """
        if needs_exudyn or RecordingPart.AGREEMENT in self.record or self.model.prescribed:
            self.model = self.rebuild(self.limit)

    @property
    def exudyn(self) -> ExudynModel:
        """The model in Exudyn, built if it is not yet."""
        if not isinstance(self.model, ExudynModel):
            self.model = self.rebuild()
        return self.model

    def rebuild(self, limit: WallLimit = NO_LIMIT) -> ExudynModel:
        """Return a new model in Exudyn; a limit applies to the time of building."""
        start = time.monotonic()
        model = build_exudyn(self._run, limit=limit)
        self.build_time += time.monotonic() - start
        return model

    def report(self, number: int, step: float, now: float) -> None:
        """Report the progress of a pass."""
        if self._watch is not None:
            self._watch(Progress(number, step, now))


def _build_recording(runner: _Runner, refined: RefinedRun) -> Recording:
    """Convert a run to the figure's joints and segments."""
    model, trace = runner.model, refined.trace
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
    if truncated is None and refined.outcome.succeeded:
        truncated = _truncate_at_half_turn(refined, model, joints)
    if truncated is not None:
        return _build_recording(runner, truncated)
    if model.prescribed:
        trace = project_to_constraints(model, trace, joints)
        motion = SegmentMotion(model, trace)
        joints = {name: motion.joint(joint, starts[name]) for name, joint in figure.joints.items()}
    outcome = refined.outcome
    if model.prescribed and outcome.ending is Ending.SOLVER_FAILED:
        outcome = explain_dead_point(model, outcome, joints)
        outcome = explain_singularity(runner.exudyn, outcome, joints)
    record, contact = runner.record, None
    if {RecordingPart.ENERGY, RecordingPart.REACTIONS, RecordingPart.CONTACT} & record:
        contact = contact_of_trace(model, trace)
    energy: dict[str, Array] = {}
    if {RecordingPart.ENERGY, RecordingPart.LOSSES} & record:
        energy = losses_by_kind(trace)
    if RecordingPart.ENERGY in record:
        energy |= energy_by_kind(model, trace, joints, contact)
    passive_torques: dict[str, Array] = {}
    if {RecordingPart.PASSIVE_TORQUES, RecordingPart.REACTIONS} & record:
        passive_torques = motion.passive_torques(joints)
    reactions: dict[str, Array] = {}
    constraint_moments: dict[str, Array] = {}
    if RecordingPart.REACTIONS not in record:
        pass
    elif trace.accelerations is None:
        wrenches = constraint_wrenches(runner.exudyn, trace, joints)
        constraint_moments = {name: wrench[:, 3:] for name, wrench in wrenches.items()}
        reactions = {name: motion.reaction(j, joints[name]) for name, j in figure.joints.items()}
        for name, wrench in wrenches.items():
            reactions[name] += wrench
    else:
        reactions = newton_euler_reactions(model, trace, joints, motion, passive_torques, contact)
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
        energy={kind: energy[kind] for kind in energy_kinds(energy)},
        outcome=outcome,
        accuracy=refined.accuracy,
        constraint_drift=_max_over_joints(gaps),
        prescribed_motion_drift=_max_over_joints(constraint_drifts),
        drive_torques=drive_torques(model, constraint_moments, joints) if reactions else {},
        wall_time=refined.wall_time,
        build_time=runner.build_time,
        springs=model.spring_set.origin,
        law=model.spring_set.law.value,
        contact=_contact_record(
            model,
            trace,
            contact if RecordingPart.CONTACT in record else None,
            motion.poses,
            runner.subject.contact,
            with_injury=bool({RecordingPart.CONTACT, RecordingPart.HEAD_INJURY} & record),
        )
        if STEP_PARTS & record
        else None,
        recorded=record,
        model=runner.subject,
        scene=model.plan.scene,
    )


def _contact_record(
    model: RunModel,
    trace: Trace,
    frames: ContactStates | None,
    poses: Mapping[str, Array],
    body: BodyContact | None,
    *,
    with_injury: bool,
) -> ContactRecord | None:
    """Return the contact of a run; None without props."""
    if model.contacts is None or trace.contact is None:
        return None
    return build_contact_record(
        model.contacts,
        trace.contact,
        frames,
        model.figure,
        poses,
        trace.times,
        model.plan.gravity,
        model.plan.up,
        body,
        with_injury=with_injury,
    )


def _joint_gaps(model: RunModel, joints: Mapping[str, JointMotion]) -> dict[str, Array]:
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


def _truncate_at_half_turn(
    refined: RefinedRun, model: RunModel, joints: Mapping[str, JointMotion]
) -> RefinedRun | None:
    """Truncate a run where a law of coordinates passes half a turn from the middle of its range.

    There its angle jumps by a turn, and its torque with it. None if none does.
    """
    first: tuple[int, str] | None = None
    for name, connectors in model.springs.items():
        chain = model.placement.tree.chains[name]
        for connector in connectors:
            law = connector.law
            if not isinstance(law, CoordinateLaw):
                continue
            moved = joints[name].displacements[:, list(chain.rotations)].T
            if law.coordinates.reads(moved):
                continue
            read = law.angles(chain.rotation_axes, joints[name].rotation_vectors)
            matters = [spring is not None and bool(spring.elastic) for spring in law.springs]
            beyond = np.abs(np.array(read) - moved)[matters].max(axis=0, initial=0.0) > 1.0
            if np.any(beyond):
                found = int(np.argmax(beyond)), name
                first = found if first is None else min(first, found)
    if first is None:
        return None
    count = max(1, first[0])
    last = float(refined.trace.times[count - 1])
    message = (
        f"joint {first[1]} turned by more than half a turn from the middle of its range after "
        f"{last:.4g} s, where the torque of its springs is not defined"
    )
    return replace(
        refined,
        trace=refined.trace.first_frames(count),
        outcome=Outcome(Ending.TURNED_OVER, message, last, first[1]),
        accuracy=replace(
            refined.accuracy,
            by_frame=refined.accuracy.by_frame[:count],
            tolerance_met_until=min(last, refined.accuracy.tolerance_met_until),
        ),
    )


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
        tolerance_met_until=min(last, refined.accuracy.tolerance_met_until),
    )
    return replace(
        refined,
        trace=refined.trace.first_frames(count),
        outcome=outcome,
        accuracy=accuracy,
    )
