"""Simulation step by step, of a figure that may be changed between two steps.

The motion is integrated by the compiled method in one run, without the second one that estimates
the error of `simulate`. Gravity, forces and scales are numbers in its tables. Other springs, locks
and a free or held root need other tables, which are computed from the present poses and velocities.

A change keeps all poses. The velocities become those that the joints permit and that are nearest to
the present ones in the metric of the masses. A joint that is locked thus stops as by an inelastic
impact, and velocities that are still possible stay. The kinetic energy that is lost counts as
dissipated; the potential energy that a change adds counts as work.

With props in the plan the figure touches them by its contact spheres, also where a change has
freed its root. No change moves a segment, so the energy of contact stays as it is where the props
stay.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf, isfinite
from typing import cast

import numpy as np

from generator.contact.scene import Scene
from generator.contact.states import ContactModel
from generator.diagnostics import ModelError, NamedMapping
from generator.figure import Figure, Location, Site, SiteRef, Vector
from generator.kinematics.free_root import detach_root, free_joints
from generator.kinematics.links import Links
from generator.kinematics.loops import consistent_rates
from generator.kinematics.placement import Placement
from generator.kinematics.prescribed import PrescribedMotion
from generator.kinematics.tree import build_valid_tree
from generator.loads import LoadKind, constant_load
from generator.model import Model
from generator.recording import Ending, Outcome
from generator.rotations import Array
from generator.run_options import Integrator
from generator.simulation.compiled.layout import (
    DISSIPATION,
    EXTERNAL,
    MEASURED_FORM,
    POWERS,
    SPIN,
    THREE_ANGLES,
)
from generator.simulation.compiled.marching import COLLAPSED, FINISHED, PAUSED, TURNED_OVER, march
from generator.simulation.compiled.mechanism import CompiledModel, MechanismBuilder
from generator.simulation.compiled.recorder import BranchingLawError
from generator.simulation.compiled.refinement import MAX_STEPS_PER_SECOND
from generator.simulation.compiled.runge_kutta import (
    NEEDS_FIRST_STAGE,
    REJECTED,
    STEP,
    STEPS,
    SWITCH,
)
from generator.simulation.compiled.tableau import BS23, DOP853
from generator.simulation.compiled_run import build_trace, frame_disagreement
from generator.simulation.exudyn_model.agreement import ExudynEquations
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.live.stepper_state import (
    FIRST_STEP,
    Point,
    Setting,
    StepperState,
    build_tables,
    project_velocities,
    weighted_velocities,
)
from generator.simulation.plan import Plan, resolve_model
from generator.simulation.run_model import (
    InitialState,
    constant_site_loads,
    contact_geometry,
    deepest_sphere,
    initial_state,
    require_defined_torques,
    require_valid_model,
)
from generator.simulation.trace import half_turn_outcome, pole_outcome, solver_failure_outcome
from springs import SpringSet

DEFAULT_STEP_TOLERANCE = 1e-4
"""Error of a step of the integrator, relative to 1 + the size of each number of the state."""

MAX_CHANGED_DEPTH = 0.01
"""Depth of a contact sphere in a prop up to which the prop may be put there [m]."""

_STEPS_PER_CALL = 500
"""Steps between two checks for Ctrl-C."""

_MIN_COUNTED_TIME = 1e-2
"""Shortest duration by which `MAX_STEPS_PER_SECOND` limits the steps of an advance [s]."""

_HALF_TURN_MARGIN = 1e-6
"""Time before a half turn at which the motion stops [s]."""

_LOAD_HORIZON = 1e9
"""Duration that the tables of loads cover [s]."""

_MIN_LOAD_DURATION = 1.0
"""Duration that they cover after the last drive has ended [s]."""

_TIME_TOLERANCE = 1e-9
"""Time by which an advance may continue beyond the end of a drive [s]."""


class Stepper:
    """A figure in motion, which may be changed between two steps.

    `advance` continues the motion. The same calls give the same numbers, bit by bit.
    A call that raises an error leaves the stepper unchanged.
    """

    def __init__(
        self,
        model: Model | Figure,
        plan: Plan | None = None,
        tolerance: float = DEFAULT_STEP_TOLERANCE,
    ) -> None:
        """Start at the initial pose and velocities of a plan.

        Args:
            model: Figure without closed loops, with springs, as for `simulate`.
            plan: its start, springs, gravity, root, pose, velocities, scene, loads, locks and
                drives are used, but not its stop time, interval of frames and tolerance; None for
                the pose of the file at rest.
            tolerance: error of a step of the integrator, relative to 1 + the size of each number of
                the state. The error of the motion is not estimated.

        Raises:
            MoverError: the figure or the plan cannot be simulated by the compiled method; the
                message states the reason.
        """
        if not isinstance(cast("object", model), Model | Figure):
            message = (
                f"a Stepper needs a Model or a Figure, such as read_figure(...), not {model!r}"
            )
            raise TypeError(message)
        if not (isfinite(tolerance) and tolerance > 0.0):
            raise ValueError(f"the tolerance must be positive, not {tolerance:g}")
        plan = Plan() if plan is None else plan
        whole, _ = resolve_model(model, plan)
        require_valid_model(whole)
        figure, springs = whole.figure, whole.springs
        start = initial_state(figure, plan, whole.contact)
        placement, prescribed = start.placement, start.prescribed
        obstacle = _obstacle(plan, start)
        if obstacle is not None:
            raise ModelError(f"the figure cannot be simulated step by step: {obstacle}")
        require_defined_torques(placement, springs)
        self._figure, self._plan, self._tolerance = figure, plan, tolerance
        self.contact = whole.contact
        """Parts of the body that touch props as wholes; None without any."""
        self._last_time = min((drive.stop for drive in plan.drives.values()), default=inf)
        rates = consistent_rates(
            placement, start.rates, fixed=set(plan.velocities) | prescribed.fixed_joints
        )
        setting = Setting(
            placement.tree,
            springs,
            prescribed.locked,
            _finite_vector(plan.gravity, "gravity"),
            (1.0, 1.0),
            {},
            ContactModel(plan.scene, start.spheres, start.pairs, start.part_laws)
            if start.spheres
            else None,
        )
        compiled = self._compile(setting, placement, rates, prescribed, plan.start)
        self._state = StepperState.start(
            setting, compiled, compiled.initial_state, plan.start, placement
        )

    def __repr__(self) -> str:
        """Figure and time, in a line."""
        return f"<Stepper of {self.figure!r} at {self.time:.6g} s>"

    def copy(self) -> "Stepper":
        """Return an independent stepper in the same state."""
        other = object.__new__(Stepper)
        other.__dict__.update(self.__dict__)
        other._state = self._state.copy()
        return other

    def snapshot(self) -> StepperState:
        """Return the present state with everything that may be changed."""
        return self._state.copy()

    def rewind(self, state: StepperState) -> None:
        """Return to a snapshot of this stepper or of a copy.

        Raises:
            ModelError: the snapshot is of a figure with other segments.
        """
        if not isinstance(cast("object", state), StepperState):
            raise TypeError(f"a stepper is rewound to a snapshot, not to {state!r}")
        if set(state.setting.tree.figure.segments) != set(self._figure.segments):
            raise ModelError("the snapshot is of another figure")
        self._state = state.copy()

    def advance(self, duration: float) -> Outcome:
        """Continue the motion.

        Args:
            duration: [s].

        Returns:
            `Ending.DONE`, or the reason why the motion stopped before: its steps became too short
            or too many, or a joint with springs reached 180 deg. The state then is the last valid
            one, which may be changed and continued.

        Raises:
            ModelError: a drive ends before.
        """
        if not (isfinite(duration) and duration > 0.0):
            raise ValueError(f"the duration must be positive, not {duration:g} s")
        stop = self.time + duration
        if stop > self._last_time + _TIME_TOLERANCE:
            raise ModelError(f"a drive ends at {self._last_time:g} s, before {stop:.6g} s")
        before = self._state.copy()
        limit = int(MAX_STEPS_PER_SECOND * max(duration, _MIN_COUNTED_TIME))
        ending = self._march(stop, limit)
        if ending == FINISHED:
            return Outcome(Ending.DONE, f"reached {stop:.6g} s", stop)
        if ending == TURNED_OVER:
            return self._stop_before_half_turn(before, limit)
        if ending == COLLAPSED:
            self._state.progress.clock[STEP] = FIRST_STEP
            spins = self._state.links[self._state.bodies, SPIN : SPIN + 3]
            return solver_failure_outcome(self.figure, spins, self.time)
        message = (
            f"stopped at {self.time:.6g} s: the motion needs more than "
            f"{MAX_STEPS_PER_SECOND:,} steps a second"
        )
        return Outcome(Ending.TOO_LONG, message, self.time)

    def _march(self, stop: float, limit: int) -> int:
        """Integrate until a time or for a number of steps, and return the ending of `march`."""
        state, model = self._state, self._state.model
        state.forget_motion()
        counts = state.progress.counts
        taken = int(counts[STEPS] + counts[REJECTED])
        frames, frame_states = np.empty(0), np.empty((0, len(state.progress.state)))
        method = BS23 if model.has_contact else DOP853
        arguments = (
            method,
            model.equations,
            state.mechanism,
            model.scratch,
            state.progress,
            model.balls,
        )
        while True:
            ending = march(*arguments, frames, frame_states, stop, self._tolerance, _STEPS_PER_CALL)
            if ending != PAUSED or counts[STEPS] + counts[REJECTED] - taken >= limit:
                return ending

    def _stop_before_half_turn(self, before: StepperState, limit: int) -> Outcome:
        """Return to the time just before a joint reached 180 deg; return the outcome."""
        state, model = self._state, self._state.model
        first = len(state.mechanism.branches) - len(state.mechanism.measured)
        switch = state.progress.counts[SWITCH]
        joint = model.measured_joints[int(switch) - first]
        reached = state.time
        self._state = before.copy()
        just_before = reached - _HALF_TURN_MARGIN
        if just_before > before.time and self._march(just_before, limit) != FINISHED:
            self._state = before
        row = int(switch) - first
        is_pole = self._state.mechanism.measured[row, MEASURED_FORM] == THREE_ANGLES
        found = pole_outcome if is_pole else half_turn_outcome
        return replace(found(joint, reached), last_time=self.time)

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._state.time

    @property
    def figure(self) -> Figure:
        """The figure; with a free root, the detached one."""
        return self._state.setting.tree.figure

    @property
    def springs(self) -> SpringSet:
        """Springs of the joints, before their scales."""
        return self._state.setting.springs

    @property
    def gravity(self) -> Vector:
        """Acceleration in world axes [m/s2]."""
        return self._state.setting.gravity

    @property
    def scales(self) -> tuple[float, float]:
        """Factors of the springs' torques, and of damping and friction."""
        return self._state.setting.scales

    @property
    def locked(self) -> tuple[str, ...]:
        """Names of the locked joints."""
        return tuple(self._state.setting.locked)

    @property
    def forces(self) -> dict[Point, Vector]:
        """External forces in world axes [N], by segment and point in its frame [m]."""
        return dict(self._state.setting.forces)

    @property
    def poses(self) -> dict[str, Array]:
        """Pose of each segment in the world, shape (4, 4)."""
        return self._state.poses

    @property
    def displacements(self) -> dict[str, Array]:
        """Displacements of each joint, shape (n,) [rad or m].

        The angles of a spherical joint are those nearest to the ones read before.
        """
        return self._state.displacements

    @property
    def rates(self) -> dict[str, Array]:
        """Rates of the displacements of each joint, shape (n,) [rad/s or m/s].

        At a pole of the angles of a spherical joint, the smallest ones.
        """
        return self._state.rates

    @property
    def centre_of_mass(self) -> Array:
        """Centre of mass of all moving segments, shape (3,) [m]."""
        return self._state.centre_of_mass

    @property
    def energy(self) -> dict[str, float]:
        """Energy by kind as in a `Recording` [J].

        `dissipated` contains the kinetic energy lost by changes, `work` the potential energy that
        changes have added; kinetic + gravity + spring + dissipated - work, with props also +
        contact + contact damping + friction, is constant.
        """
        return self._state.energy

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy [J]."""
        return self._state.kinetic_energy

    @property
    def scene(self) -> Scene:
        """Props that the figure touches."""
        contacts = self._state.setting.contacts
        return Scene() if contacts is None else contacts.scene

    @property
    def contact_forces(self) -> dict[str, Array]:
        """Force of all props on each segment that has contact spheres, world axes, (3,) [N]."""
        contact, contacts = self._state.contact, self._state.setting.contacts
        if contact is None or contacts is None:
            return {}
        return dict(zip(contacts.spheres, contact.forces[0], strict=True))

    @property
    def part_forces(self) -> tuple[Array, Array]:
        """Forces of props on touched parts of the body [N] and their points [m], both (k, 3)."""
        contact = self._state.contact
        if contact is None:
            return np.zeros((0, 3)), np.zeros((0, 3))
        is_touched = np.any(contact.group_forces[0], axis=1)
        return contact.group_forces[0, is_touched], contact.group_points[0, is_touched]

    def set_gravity(self, gravity: Sequence[float]) -> None:
        """Replace gravity by an acceleration in world axes, shape (3,) [m/s2]."""
        gravity = _finite_vector(gravity, "gravity")
        state, before = self._state, self._state.gravity_energy
        setting = replace(state.setting, gravity=gravity)
        after = replace(state, setting=setting).gravity_energy
        self._change_numbers(setting, after - before)

    def set_scales(self, springs: float = 1.0, damping: float = 1.0) -> None:
        """Multiply the torques of all springs, and of damping and friction, by factors."""
        if not (isfinite(springs) and isfinite(damping) and min(springs, damping) >= 0.0):
            raise ModelError(f"scales must be finite and not negative: {springs:g}, {damping:g}")
        scales = float(springs), float(damping)
        setting = self._state.setting
        work = (scales[0] - setting.scales[0]) * self._state.unscaled_spring_energy()
        self._change_numbers(replace(setting, scales=scales), work)

    def set_force(
        self, segment: str, force: Sequence[float], point: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> None:
        """Apply a force to a point of a segment until it is replaced; a zero force removes it.

        Args:
            segment: a moving one.
            force: force in world axes, shape (3,) [N].
            point: point in the segment's frame, shape (3,) [m]. Forces at different points add.
        """
        _ = self.figure.segments[segment]  # an unknown name raises
        if segment not in self._state.model.segment_links:
            raise ModelError(f"segment {segment} does not move, so a force cannot act on it")
        place = segment, _finite_vector(point, "the point of a force")
        forces = {**self.forces, place: _finite_vector(force, "a force")}
        acting = {at: value for at, value in forces.items() if any(value)}
        self._change_numbers(replace(self._state.setting, forces=acting))

    def set_springs(self, springs: SpringSet) -> None:
        """Replace the springs of all joints.

        Coefficients of laws of the same form replace numbers in a table; new forms are compiled.

        Raises:
            ModelError: the springs do not fit the figure, or a law cannot be compiled.
        """
        model, _ = resolve_model(self._figure, replace(self._plan, springs=springs))
        require_valid_model(model)
        self._rebuild(replace(self._state.setting, springs=model.springs))

    def set_scene(self, scene: Scene) -> None:
        """Replace the props: others, other places, shapes or surfaces; or remove them.

        Removing all props ends the contact between segments too, also after props are added again.

        Raises:
            ModelError: a contact sphere would be deeper in a prop than it is now, and than
                `MAX_CHANGED_DEPTH`; or the figure has no contact sphere.
            InputError: a psurf cannot be read.
        """
        setting = self._state.setting
        if not scene.props:
            self._rebuild(replace(setting, contacts=None))
            return
        contacts = setting.contacts
        if contacts is None:
            plan = replace(self._plan, scene=scene, self_contact=False)
            spheres, laws = contact_geometry(self._figure, plan)[0], {}
            if self.contact is not None:
                spheres, laws = self.contact.assign(spheres), self.contact.laws
            contacts = ContactModel(Scene(), spheres, laws=laws)
        laws, regions = {}, {}
        if self.contact is not None:
            laws, regions = self.contact.laws, self.contact.regions
        laws = scene.cover(laws, regions)
        deepest = deepest_sphere(self.poses, scene, contacts.spheres)
        present = deepest_sphere(self.poses, contacts.scene, contacts.spheres)
        allowed = max(MAX_CHANGED_DEPTH, 0.0 if present is None else present.depth)
        if deepest is not None and deepest.depth > allowed:
            raise ModelError(
                f"segment {deepest.segment} is {100.0 * deepest.depth:.3g} cm inside "
                f"{deepest.prop}: raise the figure, or move the prop"
            )
        self._rebuild(replace(setting, contacts=replace(contacts, scene=scene, laws=laws)))

    def lock(self, *joints: str) -> None:
        """Lock joints at their present displacements, as by an inelastic impact."""
        displacements, setting = self.displacements, self._state.setting
        locked = {name: displacements[name] for name in map(self._joint, joints)}
        self._rebuild(replace(setting, locked={**locked, **setting.locked}))

    def unlock(self, *joints: str) -> None:
        """Unlock joints, which start at rest."""
        names, setting = set(map(self._joint, joints)), self._state.setting
        locked = {name: value for name, value in setting.locked.items() if name not in names}
        self._rebuild(replace(setting, locked=locked))

    def _joint(self, name: str) -> str:
        """Return the name of a joint. Raises UnknownNameError for an unknown one."""
        return self.figure.joints[name].name

    def hold_root(self) -> None:
        """Lock the joints to the ground: the segments next to it stay at their present poses."""
        self.lock(
            *(
                name
                for name, joint in self.figure.joints.items()
                if joint.chain
                and len({ref.segment for ref in joint.ends} & self.figure.ground) == 1
            )
        )

    def free_root(self) -> None:
        """Remove the joints to the ground, with their springs and locks.

        The joints of a detached figure to the world, which `hold_root` has locked, are unlocked.
        """
        figure, setting = self.figure, self._state.setting
        free = free_joints(figure)
        if free:
            self.unlock(*free)
            return
        freed, displacements = detach_root(figure, self.displacements)
        tree = build_valid_tree(freed)
        drives = PrescribedMotion(setting.tree, Links(), {}, self._plan.drives)
        drives.check_free_root(freed.joints)
        locked = {name: value for name, value in setting.locked.items() if name in freed.joints}
        self._rebuild(replace(setting, tree=tree, locked=locked), displacements)

    def stop(self) -> None:
        """Stop all segments where they are; driven joints continue."""
        self._state = self._state.copy()
        state, before = self._state, self._state.kinetic_energy
        progress = state.progress
        progress.state[state.model.rate_places] = 0.0
        progress.counts[NEEDS_FIRST_STAGE] = 1
        progress.clock[STEP] = FIRST_STEP
        state.forget_motion()
        progress.state[DISSIPATION - POWERS] += before - state.kinetic_energy

    def _change_numbers(self, setting: Setting, work: float = 0.0) -> None:
        """Change numbers in the tables, with the potential energy [J] that this adds."""
        state = self._state
        tables = build_tables(setting, state.model)._replace(branches=state.mechanism.branches)
        self._state = replace(state, setting=setting, mechanism=tables)
        progress = self._state.progress
        progress.counts[NEEDS_FIRST_STAGE] = 1
        progress.state[EXTERNAL - POWERS] += work

    def _rebuild(self, setting: Setting, displacements: Mapping[str, Array] | None = None) -> None:
        """Compute other tables for the present poses and velocities.

        Args:
            setting: setting with another tree, other springs or other locks.
            displacements: displacements of another tree; None for the present ones [rad or m].
        """
        old, before, time = self._state, self._state.energy, self.time
        placement = Placement(
            setting.tree,
            old.displacements if displacements is None else displacements,
            NamedMapping(old.poses, "the figure has no segment"),
        )
        prescribed = PrescribedMotion(setting.tree, Links(), setting.locked, self._plan.drives)
        require_defined_torques(placement, setting.springs)
        rates = np.zeros(setting.tree.kinematics.size)
        model = self._compile(setting, placement, rates, prescribed, time)
        if np.array_equal(model.mechanism.links, old.model.mechanism.links):
            values = np.concatenate(
                [old.progress.state[: -old.model.integrals], old.integrals_for(model)]
            )
        else:
            values = model.initial_state.copy()
            speeds = weighted_velocities(old.model, old.bodies, old.links)
            state = StepperState.start(setting, model, values, time, placement)
            project_velocities(model, state.bodies, time, values, speeds)
            values[-model.integrals :] = old.integrals_for(model)
        self._state = StepperState.start(setting, model, values, time, placement)
        after, powers = self._state.energy, self._state.progress.state[-POWERS:]
        powers[DISSIPATION] += before["kinetic"] - after["kinetic"]
        stored = ("gravity", "spring", "contact")
        powers[EXTERNAL] += sum(after.get(kind, 0.0) - before.get(kind, 0.0) for kind in stored)

    def _compile(
        self,
        setting: Setting,
        placement: Placement,
        rates: Array,
        prescribed: PrescribedMotion,
        start: float,
    ) -> CompiledModel:
        """Compile the equations of a setting, with the loads of the file and of the plan."""
        figure = setting.tree.figure
        stop = min(self._last_time, start + _LOAD_HORIZON)
        stop = stop if stop > start else start + _MIN_LOAD_DURATION
        loads = [*constant_site_loads(figure, start, stop), *self._plan.loads]
        try:
            return MechanismBuilder(
                placement,
                rates,
                setting.springs,
                prescribed,
                [load for load in loads if load.site.segment not in figure.ground],
                setting.gravity,
                (start, stop),
                setting.contacts,
            ).build()
        except BranchingLawError as failure:
            raise ModelError(str(failure)) from None

    def agreement_with_exudyn(self) -> float:
        """Largest difference of the accelerations from Exudyn's, relative to the largest one.

        An Exudyn model is built for the present figure, springs, locks and forces. Where a load
        jumps at the present time, the two may differ.
        """
        state, figure, setting = self._state, self.figure, self._state.setting
        stop = min(self._last_time, max(self.time, self._plan.start) + 1.0)
        loads, segments = list(self._plan.loads), dict(figure.segments)
        for number, ((name, point), force) in enumerate(setting.forces.items()):
            site = Site(f"force {number}", Location.at(*point))
            sites = {**segments[name].sites, site.name: site}
            segments[name] = replace(segments[name], sites=sites)
            where, times = SiteRef(name, site.name), (self._plan.start - 1.0, stop + 1.0)
            loads.append(constant_load(where, LoadKind.GLOBAL_FORCE, force, *times))
        plan = Plan(
            start=self._plan.start,
            stop=stop,
            gravity=setting.gravity,
            displacements={name: tuple(row) for name, row in self.displacements.items()},
            loads=loads,
            locked=self.locked,
            drives=self._plan.drives,
            scene=self.scene,
        )
        springs = setting.springs.of_joints(figure.joints).scaled(*setting.scales)
        figure = replace(figure, segments=segments)
        model = build_model(Model(figure, springs), plan, contacts=setting.contacts)
        times, values = np.array([self.time]), state.progress.state[None]
        trace = build_trace(model, state.model, times, values, state.links[None])
        displacements = {name: row[None] for name, row in self.displacements.items()}
        return frame_disagreement(model, ExudynEquations(model), trace, displacements, 0)


def _obstacle(plan: Plan, start: InitialState) -> str | None:
    """Return why a figure cannot be simulated step by step; None if it can."""
    if plan.integrator is Integrator.EXUDYN:
        return "the plan asks for Exudyn's integrator"
    if plan.step is not None:
        return "the plan asks for a fixed step"
    if plan.python_torques:
        return "the torques are Python functions"
    if start.placement.tree.closures:
        return "the figure has closed loops"
    if start.prescribed.links.links:
        return "rotations are linked"
    if plan.tone:
        return "the plan has tone of muscles"
    return None


def _finite_vector(values: Sequence[float], quantity: str) -> Vector:
    """Return three numbers. Raises ModelError."""
    numbers = tuple(float(value) for value in values)
    if len(numbers) != 3 or not all(map(isfinite, numbers)):
        raise ModelError(f"{quantity} needs three finite components, not {numbers}")
    return numbers
