"""Live simulations: a figure that moves frame by frame, is changed in between, and is recorded.

The log of a simulation holds its start and all changes with the numbers of their frames, so that
`replay` computes the same motion again, bit by bit.

A recording has the joints of one figure in all of its frames. If the root was free at any time, it
is the figure with a free root, also for the frames before: their free coordinates follow from the
poses, and the reactions at the free joints are what held the root.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from generator.contact.scene import Scene, floor_height, with_floor
from generator.diagnostics import ModelError, Source, format_count
from generator.figure import Figure, Location, Site, SiteRef
from generator.input_files.live import (
    MAX_FRAMES,
    MAX_LOG_LENGTH,
    LiveChange,
    LiveLog,
    LiveStart,
    LoggedChange,
    SetFloor,
    SetForce,
    SetGravity,
    SetRoot,
    SetScales,
    SetSprings,
    StopMotion,
    format_change,
)
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import SCENE_FILE
from generator.kinematics.free_root import free_joints
from generator.kinematics.tree import Tree, build_tree
from generator.loads import LoadKind, constant_load
from generator.model import Model
from generator.recording import Accuracy, Ending, Outcome, Recording
from generator.rotations import Array
from generator.simulation.compiled.runge_kutta import STEPS, TIME
from generator.simulation.compiled_run import build_trace
from generator.simulation.falls import fall_plan
from generator.simulation.joint_motion import (
    JointMotion,
    SegmentMotion,
    contact_of_trace,
    newton_euler_reactions,
)
from generator.simulation.live.stepper import Stepper
from generator.simulation.live.stepper_state import Setting, StepperState, evaluate
from generator.simulation.plan import Plan
from generator.simulation.run_model import RunModel, prepare_run
from generator.simulation.trace import mean_position
from generator.springs_file.edit import springs_from_text
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.read import read_springs
from springs import SpringSet


def plan_of_start(figure: Figure, start: LiveStart) -> Plan:
    """Return the start of a live simulation as a plan.

    Raises:
        InputError: the springs, the pose or the scene are wrong.
        MoverError: the figure cannot fall so, or the root is held in a fall.
    """
    props = Scene()
    if start.scene:
        props = SCENE_FILE.parse(Source("scene", start.scene)).require_value()
    springs = read_springs(start.springs, figure, start.law)
    if start.fall:
        if start.pose or not start.free_root:
            raise ModelError("a fall has its own pose, and a free root")
        fall = fall_plan(figure, start.fall, start.seed)
        height = fall.height if start.height is None else start.height
        own = {prop.name for prop in props.props}
        others = (prop for prop in fall.scene.props if prop.name not in own)
        scene = replace(props, props=(*others, *props.props))
        scene = scene if start.floor is None else with_floor(scene, start.floor)
        return replace(
            fall, springs=springs, gravity=start.gravity, scene=scene, height=height, tone=None
        )
    pose: Mapping[str, Array] = {}
    if start.pose:
        pose = POSE_FILE.parse(Source("pose", start.pose), figure).require_value()
    return Plan(
        springs=springs,
        gravity=start.gravity,
        free_root=start.free_root,
        height=start.height,
        scene=props if start.floor is None else with_floor(props, start.floor),
        displacements={name: tuple(map(float, row)) for name, row in pose.items()},
    )


@dataclass(frozen=True, eq=False)
class _Frame:
    """A recorded frame.

    Attributes:
        time: [s].
        values: values of the state, shape (n,).
        first: the first recorded state with the same setting.
    """

    time: float
    values: Array
    first: StepperState


class LiveRun:
    """A simulation that advances by frames and is changed between them.

    Attributes:
        figure: figure as its file describes it.
        start: start before the first frame.
        last_outcome: last outcome of the last call of `advance`.
    """

    def __init__(self, figure: Figure, start: LiveStart, folder: Path | None = None) -> None:
        """Compile the equations at the start.

        Args:
            figure: figure with its file.
            start: start before the first frame.
            folder: folder of springs files that changed springs extend; None for the present one.

        Raises:
            MoverError: the figure or the start cannot be simulated step by step.
        """
        self.figure, self.start = figure, start
        self._springs_file = (folder or Path()) / f"changed{SPRINGS_FILE.suffix}"
        self._plan = plan_of_start(figure, start)
        self._stepper = Stepper(figure, self._plan, start.tolerance)
        self._log: list[LoggedChange] = []
        self._log_length = 0
        self._frames: list[_Frame] = []
        self._displacements: dict[str, Array] = {}
        self._steps = 0
        self.last_outcome = Outcome(Ending.DONE, "", 0.0)
        self._record()

    @property
    def frame(self) -> int:
        """Number of the last frame; 0 is the start."""
        return len(self._frames) - 1

    @property
    def time(self) -> float:
        """Time of the last frame [s]."""
        return self._frames[-1].time

    @property
    def poses(self) -> dict[str, Array]:
        """Pose of each segment in the world, shape (4, 4)."""
        return self._stepper.poses

    @property
    def displacements(self) -> Mapping[str, Array]:
        """Displacements of each joint; with a free root, of the detached figure [rad or m]."""
        return self._displacements

    @property
    def energy(self) -> dict[str, float]:
        """Energy by kind [J]."""
        return self._stepper.energy

    @property
    def scene(self) -> Scene:
        """Props that the figure may touch."""
        return self._stepper.scene

    @property
    def floor(self) -> float | None:
        """Height of the floor [m]; None without a floor."""
        return floor_height(self.scene)

    @property
    def contact_forces(self) -> tuple[Array, Array]:
        """Forces on parts that are touched [N] and their points [m], both of shape (k, 3)."""
        return self._stepper.part_forces

    @property
    def springs(self) -> SpringSet:
        """Springs of the joints, before their scales."""
        return self._stepper.springs

    @property
    def has_free_root(self) -> bool:
        """Return whether the root moves freely."""
        free = free_joints(self._stepper.figure)
        return bool(free) and not free.keys() & set(self._stepper.locked)

    def apply(self, change: LiveChange) -> None:
        """Make a change and log it.

        Raises:
            MoverError: it cannot be made, or the log is full; everything stays as it is.
        """
        logged = LoggedChange(self.frame, change)
        length = self._log_length + len(format_change(logged))
        if length > MAX_LOG_LENGTH:
            changes = format_count(len(self._log), "change")
            raise ModelError(f"the log is full after {changes}: save it, and reset the simulation")
        self._make(change)
        self._log.append(logged)
        self._log_length = length

    def _make(self, change: LiveChange) -> None:
        stepper = self._stepper
        match change:
            case SetGravity():
                stepper.set_gravity(change.gravity)
            case SetScales():
                stepper.set_scales(change.stiffness, change.damping)
            case SetFloor():
                stepper.set_scene(with_floor(stepper.scene, change.height))
            case SetRoot():
                if change.is_free and not self.has_free_root:
                    stepper.free_root()
                elif self.has_free_root and not change.is_free:
                    stepper.hold_root()
            case SetForce():
                stepper.set_force(change.segment, change.force, change.point)
            case SetSprings():
                springs = self._plan.springs
                if change.text:
                    springs = springs_from_text(change.text, self.figure, self._springs_file)
                assert springs is not None
                stepper.set_springs(springs)
            case StopMotion():
                stepper.stop()

    def advance(self) -> Outcome:
        """Compute the next frame; return `Ending.DONE`, or why there is none.

        In the second case the state is that of the last frame, which may be changed and continued.
        """
        if self.frame >= MAX_FRAMES:
            message = f"stopped at {self.time:.6g} s: a live simulation has {MAX_FRAMES:,} frames"
            self.last_outcome = Outcome(Ending.TOO_LONG, message, self.time)
            return self.last_outcome
        before = self._stepper.snapshot()
        self.last_outcome = self._stepper.advance(
            (self.frame + 1) * self.start.frame - self._stepper.time
        )
        if self.last_outcome.succeeded:
            old, new = before.progress.counts, self._stepper.snapshot().progress.counts
            self._steps += int(new[STEPS] - old[STEPS])
            self._record()
        else:
            self._stepper.rewind(before)
        return self.last_outcome

    def _record(self) -> None:
        """Record the present state. It reads the displacements, which later ones are nearest to."""
        self._displacements = self._stepper.displacements
        state = self._stepper.snapshot()
        first = self._frames[-1].first if self._frames else state
        if first.setting is not state.setting:
            first = state
        self._frames.append(_Frame(state.time, state.progress.state, first))

    def log(self, figure_name: str, sha256: str | None) -> LiveLog:
        """Return the log up to the last frame.

        Args:
            figure_name: name of the figure's file.
            sha256: sha256 of its bytes, in hexadecimal, or None.
        """
        return LiveLog(figure_name, sha256, self.start, tuple(self._log), self.frame)

    def recording(self) -> Recording:
        """Return the motion so far. It has neither an estimate of its error nor a contact record.

        The numbers of a frame are those before the changes that were made at it.
        """
        recording = _build_recording(
            self._plan, self._frames, len(self._log), self._steps, self._stepper
        )
        model = Model(self.figure, self.springs, self._stepper.contact)
        return replace(recording, model=model, scene=self._stepper.scene)


def replay(
    figure: Figure,
    log: LiveLog,
    watch: Callable[[float], None] | None = None,
    folder: Path | None = None,
) -> LiveRun:
    """Compute a live simulation again.

    Args:
        figure: that the log is of.
        log: its start and changes.
        watch: called with the time after each frame.
        folder: folder as for a `LiveRun`.

    Raises:
        MoverError: the figure is another one, or a change cannot be made, or the motion stops.
    """
    run, changes = LiveRun(figure, log.start, folder), list(log.changes)
    while True:
        while changes and changes[0].frame == run.frame:
            run.apply(changes.pop(0).change)
        if run.frame == log.end_frame:
            return run
        outcome = run.advance()
        if not outcome.succeeded:
            end = log.end_frame * log.start.frame
            raise ModelError(f"{outcome.message}; the live simulation reached {end:.6g} s")
        if watch is not None:
            watch(run.time)


@dataclass(frozen=True, eq=False)
class _Span:
    """Frames of one setting.

    Attributes:
        times: shape (n,) [s].
        joints: motion of each joint.
        columns: columns by name of the field of a recording, its values by name.
        centre: centre of mass, shape (n, 3) [m].
    """

    times: Array
    joints: Mapping[str, JointMotion]
    columns: Mapping[str, Mapping[str, Array]]
    centre: Array


def _build_recording(
    plan: Plan, frames: Sequence[_Frame], changes: int, steps: int, stepper: Stepper
) -> Recording:
    """Return the motion of frames; see `LiveRun.recording`.

    Args:
        plan: plan of the start.
        frames: frames in order.
        changes: number of changes.
        steps: number of steps of the integrator.
        stepper: stepper in the state of the last frame.
    """
    groups: list[list[_Frame]] = []
    for frame in frames:
        if not groups or groups[-1][0].first is not frame.first:
            groups.append([])
        groups[-1].append(frame)
    trees = {id(tree): tree for tree in (group[0].first.setting.tree for group in groups)}
    free = [tree for tree in trees.values() if free_joints(tree.figure)]
    builder = _SpanBuilder(plan, (free or list(trees.values()))[0], groups)
    spans: list[_Span] = []
    for group in groups:
        before = spans[-1].joints.items() if spans else ()
        spans.append(builder.build(group, {name: one.displacements[-1] for name, one in before}))
    last, springs = frames[-1].time, frames[-1].first.setting.springs
    message = f"Live simulation of {last:.4g} s with {format_count(changes, 'change')}."
    step = (last - frames[0].time) / max(steps, 1)
    accuracy = Accuracy(None, None, last, step, steps, np.full(len(frames), np.nan))

    def joined(field: str) -> dict[str, Array]:
        names = dict.fromkeys(name for span in spans for name in span.columns[field])
        return {
            name: np.concatenate(
                [span.columns[field].get(name, np.zeros(len(span.times))) for span in spans]
            )
            for name in names
        }

    return Recording(
        times=np.concatenate([span.times for span in spans]),
        poses=joined("poses"),
        chains={name: joint.chain for name, joint in builder.tree.figure.joints.items()},
        displacements=joined("displacements"),
        velocities=joined("velocities"),
        rotation_vectors=joined("rotation_vectors"),
        reactions=joined("reactions"),
        passive_torques=joined("passive_torques"),
        centre_of_mass=np.concatenate([span.centre for span in spans]),
        energy=joined("energy"),
        outcome=Outcome(Ending.DONE, message, last),
        accuracy=accuracy,
        springs=springs.origin,
        law=springs.law.value,
        agreement_with_exudyn=stepper.agreement_with_exudyn(),
    )


class _SpanBuilder:
    """Builds spans of a recording, all of one figure.

    The Exudyn models give springs, loads and contact; their constraints are not used.
    """

    def __init__(self, plan: Plan, tree: Tree, groups: Sequence[Sequence[_Frame]]) -> None:
        """Add sites at the points of all forces to the figure."""
        self._plan = replace(
            plan,
            stop=groups[-1][-1].time + 1.0,
            scene=Scene(),
            free_root=False,
            height=None,
            velocities={},
        )
        points = {point for group in groups for point in group[0].first.setting.forces}
        self._sites = {point: f"force {k}" for k, point in enumerate(sorted(points))}
        segments = dict(tree.figure.segments)
        for (name, point), site in self._sites.items():
            sites = {**segments[name].sites, site: Site(site, Location.at(*point))}
            segments[name] = replace(segments[name], sites=sites)
        self.tree = build_tree(replace(tree.figure, segments=segments))
        self._models: dict[tuple[int, tuple[float, float]], RunModel] = {}

    def build(self, frames: Sequence[_Frame], near: Mapping[str, Array]) -> _Span:
        """Return the span of frames.

        Args:
            frames: frames of one setting.
            near: displacements of the frame before; empty at the start.
        """
        first = frames[0].first
        model = self._model(first.setting)
        times = np.array([frame.time for frame in frames])
        states = np.array([frame.values for frame in frames])
        links, _ = evaluate(first.model, first.mechanism, float(times[0]), states)
        trace = build_trace(model, first.model, times, states, links)
        motion, figure = SegmentMotion(model, trace), model.figure
        starts = near or model.placement.displacements
        joints = {name: motion.joint(each, starts[name]) for name, each in figure.joints.items()}
        passive, contact = motion.passive_torques(joints), contact_of_trace(model, trace)
        reactions = newton_euler_reactions(model, trace, joints, motion, passive, contact)
        return _Span(
            times,
            joints,
            {
                "poses": motion.poses,
                "displacements": {name: each.displacements for name, each in joints.items()},
                "velocities": {name: each.rates for name, each in joints.items()},
                "rotation_vectors": {name: each.rotation_vectors for name, each in joints.items()},
                "reactions": reactions,
                "passive_torques": passive,
                "energy": _energies(frames),
            },
            mean_position(figure, trace.positions),
        )

    def _model(self, setting: Setting) -> RunModel:
        """Return the model of a setting, built once for all with the same springs."""
        key = id(setting.springs), setting.scales
        figure = self.tree.figure
        if key not in self._models:
            springs = setting.springs.of_joints(figure.joints).scaled(*setting.scales)
            start = self._plan.displacements.items()
            displacements = {name: row for name, row in start if name in figure.joints}
            plan = replace(self._plan, springs=springs, displacements=displacements)
            self._models[key] = prepare_run(figure, plan)
        model, plan = self._models[key], self._plan
        loads = [
            constant_load(
                SiteRef(point[0], self._sites[point]),
                LoadKind.GLOBAL_FORCE,
                force,
                plan.start - 1.0,
                plan.stop + 1.0,
            )
            for point, force in setting.forces.items()
        ]
        return replace(
            model,
            plan=replace(model.plan, gravity=setting.gravity),
            loads=(*model.loads, *loads),
            contacts=setting.contacts,
        )


def _energies(frames: Sequence[_Frame]) -> dict[str, Array]:
    """Energy by kind in frames of one setting, shape (n,) each [J]."""
    state = frames[0].first.copy()
    rows: list[dict[str, float]] = []
    for frame in frames:
        state.progress.state[:] = frame.values
        state.progress.clock[TIME] = frame.time
        state.forget_motion()
        rows.append(state.energy)
    kinds = dict.fromkeys(kind for row in rows for kind in row)
    return {kind: np.array([row.get(kind, 0.0) for row in rows]) for kind in kinds}
