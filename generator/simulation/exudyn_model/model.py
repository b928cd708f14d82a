"""A figure built into an Exudyn system, accessed by the names of the figure."""

import weakref
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from generator.contact.scene import Penetration, Scene, deepest_start
from generator.contact.self_contact import Capsule, CapsulePair, capsule_pairs
from generator.contact.states import ContactModel
from generator.contact_file.parts import BodyContact
from generator.diagnostics import Diagnostic, ModelError, NamedMapping
from generator.figure import ContactSphere, Figure
from generator.figure_file.check import require_valid_figure, simulation_diagnostics
from generator.kinematics.closures import independent_constraints, lock_all_axes
from generator.kinematics.free_root import (
    detach_root,
    free_joint_rates,
    free_joints,
    lift_free_segments,
    lowest_point,
    lowest_sphere_point,
)
from generator.kinematics.loops import consistent_rates
from generator.kinematics.placement import (
    Displacements,
    Placement,
    checked_joint_values,
    forward_kinematics,
    initial_displacements,
)
from generator.kinematics.prescribed import PrescribedMotion
from generator.kinematics.tree import Tree, build_tree, build_valid_tree
from generator.loads import TimedLoad
from generator.model import Model
from generator.rotations import Array, pose_matrix
from generator.simulation.exudyn_model.bodies import (
    Constraint,
    add_bodies,
    add_constraints,
    add_loads,
    add_marker,
    constant_site_loads,
    require_centre_of_mass,
)
from generator.simulation.exudyn_model.constraints import (
    CoordinateConstraint,
    add_coordinate_constraints,
)
from generator.simulation.exudyn_model.contacts import add_contacts
from generator.simulation.exudyn_model.coupled_springs import CoupledObject, add_coupled_spring
from generator.simulation.exudyn_model.exudyn_api import Index, MainSystem, exu
from generator.simulation.exudyn_model.righting import RightingConnector, add_righting
from generator.simulation.exudyn_model.slides import add_slide_springs
from generator.simulation.exudyn_model.springs import (
    Connector,
    SpringBuilder,
    add_joint_springs,
    needs_slide_object,
)
from generator.simulation.muscle_tone import JointTones, bind_tone, upright_orientations
from generator.simulation.plan import NO_LIMIT, Plan, WallLimit, resolve_model
from generator.simulation.preconditions import model_obstacles, place, placement_obstacles
from springs import JointSprings, SpringSet
from springs.contact_part import PartLaw


@dataclass(frozen=True)
class ExudynModel:
    """A figure built into an Exudyn system, before its first step.

    Attributes:
        mbs: the live Exudyn main system.
        container: the Exudyn container that owns the system; None if the caller provided it. It is
            reset when this object is deleted, so keep the model as long as its system.
        placement: initial placement of the figure.
        rates: initial rates of the tree's displacements, shape (m,) [rad/s or m/s].
        bodies: object index of each segment; fixed segments share the ground's.
        sites: marker index of each site, by "segment.site", along the site's axes.
        joints: constraint items of each joint; none for a free joint, or for one whose locks the
            rest of a loop implies.
        springs: connectors of each joint with springs, or with an angle of a coupled law.
        coupled: objects of the coupled laws.
        coordinate_constraints: constraints of links and drives.
        prescribed: locks, links and drives.
        loads: each load with its marker and user function.
        contacts: contact with the props of the plan and of segments; None without props.
        spring_set: the springs that were built.
        tone: tone of the joints; None without any.
        righting: connectors of righting by joint.
        plan: the plan of the run.
    """

    mbs: MainSystem
    container: Any
    placement: Placement
    rates: Array
    bodies: Mapping[str, Index]
    sites: Mapping[str, Index]
    joints: Mapping[str, tuple[Constraint, ...]]
    springs: Mapping[str, tuple[Connector, ...]]
    coupled: tuple[CoupledObject, ...]
    coordinate_constraints: tuple[CoordinateConstraint, ...]
    prescribed: PrescribedMotion
    loads: tuple[tuple[TimedLoad, Index, Any], ...]
    contacts: ContactModel | None
    spring_set: SpringSet
    tone: JointTones | None
    righting: Mapping[str, RightingConnector]
    plan: Plan

    def __repr__(self) -> str:
        """The figure, in a line."""
        return f"<ExudynModel of {self.figure!r}>"

    @property
    def figure(self) -> Figure:
        """The figure that was built; with a free root, the detached one."""
        return self.placement.tree.figure


@dataclass(frozen=True)
class InitialState:
    """Initial state of a run.

    Attributes:
        placement: initial placement, with closed loops and imposed prescriptions.
        rates: initial displacement rates of the plan, with imposed prescriptions [rad/s or m/s].
        prescribed: locks, links and drives.
        spheres: contact spheres of each segment that has some; none without props.
        pairs: capsules of segments that touch each other.
        part_laws: laws of the parts of the body to which the spheres belong, by name.
        upright: orientations to which tone rights segments, by joint.
    """

    placement: Placement
    rates: Displacements
    prescribed: PrescribedMotion
    spheres: Mapping[str, Sequence[ContactSphere]]
    pairs: tuple[CapsulePair, ...]
    part_laws: Mapping[str, PartLaw]
    upright: Mapping[str, Array]


def initial_state(figure: Figure, plan: Plan, contact: BodyContact | None = None) -> InitialState:
    """Compute the initial state of a run, of a body with parts that touch as wholes.

    Raises:
        UnknownNameError: the plan names an unknown joint.
        ModelError: joints cannot be locked, linked or driven as it
            asks, or the chain of a joint is not supported.
        OpenLoopError: the pose opens a loop that cannot be closed.
    """
    tree = build_tree(figure)
    displacements = {
        **initial_displacements(tree),
        **checked_joint_values(figure, plan.displacements),
    }
    prescribed = _build_prescribed_motion(tree, plan, displacements)
    displacements = prescribed.impose_displacements(displacements, plan.start)
    fixed = set(plan.displacements) | prescribed.fixed_joints
    placement = place(tree, displacements, fixed)
    if plan.free_root:
        freed, free_displacements = detach_root(figure, placement.displacements)
        placement = place(build_valid_tree(freed), free_displacements, set(free_displacements))
        prescribed.check_free_root(freed.joints)
        prescribed = _build_prescribed_motion(placement.tree, plan, free_displacements)
    prescribed.check_loops(placement)
    spheres, capsules = contact_geometry(figure, plan)
    laws: Mapping[str, PartLaw] = {}
    if contact is not None and spheres:
        spheres, laws = contact.assign(spheres), contact.laws
    if plan.scene.covers:
        if not plan.scene.props:
            raise ModelError(
                "the scene covers parts of the body, but nothing touches them: add a floor"
            )
        laws = plan.scene.cover(laws, None if contact is None else contact.regions)
    if plan.height is not None:
        up = np.array(plan.up)
        lowest = (
            lowest_sphere_point(placement, spheres, up) if spheres else lowest_point(placement, up)
        )
        lifted = lift_free_segments(placement, (plan.height - lowest) * up)
        placement = forward_kinematics(placement.tree, lifted)
    if spheres:
        _check_start_outside(placement, plan.scene, spheres)
    rates = _initial_rates(placement, plan.velocities)
    imposed = prescribed.impose_rates(rates, plan.start)
    for name in plan.velocities:
        if not np.allclose(rates[name], imposed[name], rtol=1e-9, atol=1e-9):
            raise ModelError(
                f"joint {name} is locked, linked or driven and cannot start with another velocity"
            )
    pairs = capsule_pairs(figure, capsules, placement.poses) if capsules else ()
    upright = upright_orientations(figure, plan.tone) if plan.tone else {}
    return InitialState(placement, imposed, prescribed, spheres, pairs, laws, upright)


def contact_geometry(
    figure: Figure, plan: Plan
) -> tuple[dict[str, tuple[ContactSphere, ...]], dict[str, Capsule]]:
    """Return the contact spheres of the moving segments, and their capsules.

    Spheres need props, and capsules need self-contact as well.

    The figure is that of the file: a capsule depends on its joints, also on those to the ground.

    Raises:
        InputError: a psurf cannot be read.
        ModelError: no segment has a sphere.
    """
    if not plan.scene.props:
        return {}, {}
    from generator.contact.spheres import contact_spheres, fit_contact_spheres  # reads surfaces

    spheres = contact_spheres(figure)
    if not spheres:
        raise ModelError("the figure cannot touch anything: no segment has a contact sphere")
    if not plan.self_contact:
        return spheres, {}
    from generator.contact.capsules import fit_capsules

    return spheres, fit_capsules(figure, fit_contact_spheres(figure))


_MAX_START_DEPTH = 1e-6
"""Depth of a contact sphere in a prop up to which it counts as touching [m]."""


def deepest_sphere(
    poses: Mapping[str, Array], scene: Scene, spheres: Mapping[str, Sequence[ContactSphere]]
) -> Penetration | None:
    """Return the contact sphere that is deepest in a prop; None without spheres or props.

    Args:
        poses: poses of the segments in the world, shape (4, 4).
        scene: scene with the props.
        spheres: spheres of each segment that has some.
    """
    names = [name for name, some in spheres.items() for _ in some]
    radii = np.array([sphere.radius for some in spheres.values() for sphere in some])
    centres = [
        (poses[name] @ np.append(sphere.centre, 1.0))[:3]
        for name, some in spheres.items()
        for sphere in some
    ]
    return deepest_start(scene, np.array(centres), radii, names) if names else None


def _check_start_outside(
    placement: Placement, scene: Scene, spheres: Mapping[str, Sequence[ContactSphere]]
) -> None:
    """Raise ModelError if a contact sphere starts inside a prop."""
    deepest = deepest_sphere(placement.poses, scene, spheres)
    if deepest is not None and deepest.depth > _MAX_START_DEPTH:
        lift = _lift_above(placement.poses, scene, spheres)
        by = "" if lift is None else f" by {100.0 * lift:.3g} cm"
        raise ModelError(
            f"segment {deepest.segment} starts {100.0 * deepest.depth:.3g} cm inside "
            f"{deepest.prop}: raise the figure{by}, or move the prop"
        )


def _lift_above(
    poses: Mapping[str, Array], scene: Scene, spheres: Mapping[str, Sequence[ContactSphere]]
) -> float | None:
    """Return the least multiple of a centimetre that lifts all spheres out of the props [m].

    None where 3 m along the y axis are too little.
    """
    for lift in np.arange(1, 301) / 100.0:
        shift = pose_matrix(np.eye(3), np.array([0.0, lift, 0.0]))
        moved = {name: shift @ pose for name, pose in poses.items()}
        deepest = deepest_sphere(moved, scene, spheres)
        if deepest is None or deepest.depth <= _MAX_START_DEPTH:
            return float(lift)
    return None


def _initial_rates(placement: Placement, velocities: Mapping[str, Any]) -> dict[str, Any]:
    """Return the displacement rates of all joints; free segments have world velocities.

    Raises ModelError for unknown joints, and for rates at a pose where they are undefined.
    """
    figure = placement.tree.figure
    rates: dict[str, Any] = {
        name: np.zeros(joint.degrees_of_freedom) for name, joint in figure.joints.items()
    }
    if not velocities:
        return rates
    free = free_joints(figure)
    for name, values in checked_joint_values(figure, velocities).items():
        joint, displacements = figure.joints[name], placement.displacements[name]
        if name in free:
            segment = figure.segments[joint.child.segment]
            centre = require_centre_of_mass(segment)
            pose = placement.poses[segment.name]
            rates[name] = free_joint_rates(joint, pose, displacements, centre, values)
            continue
        sequence = placement.tree.chains[name].sequence
        if (
            sequence is not None
            and np.any(values)
            and sequence.is_singular(placement.pose_in_parent(joint)[:3, :3])
        ):
            raise ModelError(
                f"joint {name} starts at a pole of its angles, where two of their rates turn it "
                "about the same axis: start it elsewhere, or without a velocity"
            )
        rates[name] = values
    return rates


def _build_prescribed_motion(
    tree: Tree, plan: Plan, displacements: Displacements
) -> PrescribedMotion:
    """Return the prescriptions of the plan; locked joints stay at `displacements`."""
    locked = {name: displacements.get(name, np.zeros(0)) for name in plan.locked}
    return PrescribedMotion(tree, plan.links, locked, plan.drives)


def build_model(
    model: Model | Figure,
    plan: Plan | None = None,
    mbs: MainSystem | None = None,
    contacts: ContactModel | None = None,
    limit: WallLimit = NO_LIMIT,
) -> ExudynModel:
    """Build a model into an Exudyn system: bodies, sites, joints, springs, loads, contacts.

    Args:
        model: Figure with springs, as for `simulate`; springs of a joint that detaching the root
            removes are left out.
        plan: Initial pose, velocities, gravity, loads, kind of torques; None for `Plan()`.
        mbs: a system to build into, which the caller assembles; None creates one and assembles it.
        contacts: spheres of the segments, which may be inside the props of the plan, and capsules;
            None takes those of the figure, whose spheres must start outside.
        limit: wall-time limit of the run.

    Raises:
        WallLimitError: the limit was reached.
        InputError: the figure is wrong, or moving segments have no mass; it holds all errors.
        MoverError: the figure or the plan cannot be built; the message says why.
    """
    model, plan = resolve_model(model, plan or Plan())
    require_valid_model(model)
    if contacts is None:
        start = initial_state(model.figure, plan, model.contact)
    else:
        start = initial_state(model.figure, replace(plan, scene=Scene(), self_contact=False))
        start = replace(
            start, spheres=contacts.spheres, pairs=contacts.pairs, part_laws=contacts.laws
        )
    require_defined_torques(start.placement, model.springs)
    return _build_from_initial_state(start, plan, model.springs, mbs, limit)


def require_valid_model(model: Model) -> None:
    """Raise an error for a model that cannot be simulated in any pose.

    Raises:
        InputError: the figure is wrong, or moving segments have no mass; it holds all errors.
        MoverError: the figure cannot be simulated with the springs; the message says why.
    """
    with suppress(ModelError):  # of chains, which are obstacles
        build_tree(model.figure)  # checks a figure once
    if simulation_diagnostics(model.figure):
        require_valid_figure(model.figure, to_simulate=True)
    _require_none(model_obstacles(model))


def require_defined_torques(placement: Placement, springs: SpringSet) -> None:
    """Raise ModelError where the torques of springs are not defined in a pose."""
    _require_none(placement_obstacles(placement, springs))


def _require_none(obstacles: Iterable[Diagnostic]) -> None:
    """Raise ModelError with the sentences of all obstacles."""
    if sentences := [obstacle.message for obstacle in obstacles]:
        raise ModelError("; ".join(sentences))


def _build_from_initial_state(
    start: InitialState,
    plan: Plan,
    springs: SpringSet,
    mbs: MainSystem | None,
    limit: WallLimit,
) -> ExudynModel:
    placement, prescribed = start.placement, start.prescribed
    figure = placement.tree.figure
    container = None
    if mbs is None:
        container = exu.SystemContainer()
        mbs = container.AddSystem()
    if placement.tree.closures:
        fixed = set(plan.velocities) | prescribed.fixed_joints
        rates = consistent_rates(placement, start.rates, fixed=fixed)
    else:
        rates = placement.tree.kinematics.displacement_vector(start.rates)
    bodies, ground = add_bodies(mbs, placement, rates, plan.gravity)
    sites = {
        f"{segment.name}.{site.name}": add_marker(
            mbs, placement, bodies, segment.name, site.pose_in_segment
        )
        for segment in figure.segments.values()
        for site in segment.sites.values()
    }
    locks = independent_constraints(placement)
    locks.update(
        {
            name: (lock_all_axes(placement.pose_in_parent(figure.joints[name])),)
            for name in prescribed.locked
        }
    )
    moving = {
        name: joint
        for name, joint in figure.joints.items()
        if not {joint.parent.segment, joint.child.segment} <= figure.ground
    }
    joints = {
        name: add_constraints(mbs, placement, bodies, joint, locks[name])
        for name, joint in moving.items()
    }
    tone = None
    if plan.tone:
        tone = bind_tone(plan.tone, start.upright, placement, springs, plan.start)
    builder = SpringBuilder(mbs, placement, bodies, plan.python_torques, tone)
    tones = () if tone is None else tone.hold
    coupled_springs = [
        spring for spring in springs.coupled if all(a.joint in moving for a in spring.axes)
    ]
    coupled_joints = dict.fromkeys(axis.joint for spring in coupled_springs for axis in spring.axes)
    connectors = {
        name: add_joint_springs(
            builder,
            moving[name],
            springs.joints.get(name, JointSprings(name)),
            springs.law,
            read_rotation=name in coupled_joints or name in tones,
        )
        for name in dict.fromkeys([*springs.joints, *coupled_joints, *tones])
        if name in moving
    }
    for name, connected in connectors.items():
        own = springs.joints.get(name, JointSprings(name))
        if needs_slide_object(placement, moving[name], own):
            slides = add_slide_springs(builder, moving[name], own.translations)
            connectors[name] = (*connected, *slides)
    righting = {} if tone is None else add_righting(builder)
    coupled = tuple(add_coupled_spring(builder, spring, connectors) for spring in coupled_springs)
    constraints: tuple[CoordinateConstraint, ...] = ()
    if prescribed:
        constraints = add_coordinate_constraints(builder, prescribed, plan.start)
    loads = [*constant_site_loads(figure, plan.start, plan.stop), *plan.loads]
    moving_loads = [load for load in loads if load.site.segment not in figure.ground]
    added_loads = add_loads(mbs, placement, bodies, moving_loads)
    contacts = None
    if start.spheres:
        contacts = add_contacts(
            mbs,
            placement,
            bodies,
            ground,
            ContactModel(plan.scene, start.spheres, start.pairs, start.part_laws),
            python_torques=plan.python_torques,
            limit=limit,
        )
    if container is not None:
        cast("Any", mbs).Assemble()
    model = ExudynModel(
        mbs,
        container,
        placement,
        rates,
        NamedMapping(bodies, "the model has no segment"),
        NamedMapping(sites, "the model has no site"),
        NamedMapping(joints, "the model has no joint"),
        NamedMapping(connectors, "the model has no springs at joint"),
        coupled,
        constraints,
        prescribed,
        added_loads,
        contacts,
        springs,
        tone,
        righting,
        plan,
    )
    if container is not None:
        # Without a reset Exudyn never frees the symbolic functions of a deleted system.
        weakref.finalize(model, container.Reset)
    return model
