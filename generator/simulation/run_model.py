"""A model with a plan, ready to run: its start, with springs, loads and contacts bound to it.

Exudyn is not needed for it; `generator.simulation.exudyn_model` builds it into Exudyn.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from generator.contact.scene import Penetration, Scene, deepest_start
from generator.contact.self_contact import Capsule, CapsulePair, capsule_pairs
from generator.contact.states import ContactModel
from generator.contact_file.parts import BodyContact
from generator.diagnostics import Diagnostic, ModelError, NamedMapping
from generator.figure import ContactSphere, Figure, Segment, SiteRef, follower_faults
from generator.figure_file.check import require_valid_figure, simulation_diagnostics
from generator.joint_chain import Chain
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
from generator.loads import TimedLoad, constant_load, site_loads
from generator.model import Model
from generator.rotations import Array, pose_matrix
from generator.simulation.muscle_tone import JointTones, bind_tone, upright_orientations
from generator.simulation.plan import Plan, resolve_model
from generator.simulation.preconditions import model_obstacles, place, placement_obstacles
from springs import (
    AxisSpring,
    CoupledSpring,
    JointSprings,
    Operations,
    ReachLaw,
    Real,
    RotationLaw,
    SphericalLaw,
    SpringSet,
    rotation_law,
    total_torque,
)
from springs.contact_part import PartLaw
from springs.tone.law import AxisTone


class JointKind(Enum):
    """The kind of displacement that a spring acts on."""

    REVOLUTE = "revolute"
    """One angle."""
    SPHERICAL = "spherical"
    """A rotation vector."""
    PRISMATIC = "prismatic"
    """One translation."""


@dataclass(frozen=True)
class BoundSpring:
    """Springs of one displacement, or of the rotations of a joint.

    Attributes:
        springs: its springs; empty if it is only measured, for coupled laws and tone.
        kind: kind of the displacement that it acts on.
        axis_index: axis index of a revolute or prismatic, the index of its axis in the joint's
            chain.
        output_weights: output weights of a revolute or prismatic, weights of the offset in the
            displacement.
        law: law of several rotations; None for a single displacement.
        tone: tones about the axes of the rotations.
    """

    springs: tuple[AxisSpring, ...]
    kind: JointKind
    axis_index: int = 0
    output_weights: tuple[float, ...] = (1.0,)
    law: RotationLaw | None = None
    tone: tuple[AxisTone, ...] = ()

    @property
    def acts(self) -> bool:
        """True if it has a torque or force, False if it is only measured."""
        return bool(self.springs or self.tone) or isinstance(self.law, ReachLaw)


def bind_springs(
    tree: Tree, springs: SpringSet, tone: JointTones | None
) -> tuple[dict[str, tuple[BoundSpring, ...]], tuple[CoupledSpring, ...]]:
    """Return the springs of moving joints, bound to their displacements, and the coupled laws.

    Joints of coupled laws and of tone are among them without springs, to be measured.

    Args:
        tree: tree of the figure.
        springs: springs of its joints, without obstacles.
        tone: tone of the joints; None without any.
    """
    moving = tree.figure.moving_joints
    tones: Mapping[str, Sequence[AxisTone]] = {} if tone is None else tone.hold
    coupled = tuple(one for one in springs.coupled if all(a.joint in moving for a in one.axes))
    coupled_joints = dict.fromkeys(axis.joint for spring in coupled for axis in spring.axes)
    bound = {
        name: _bind_joint(
            tree.chains[name],
            springs.joints.get(name, JointSprings(name)),
            springs.law,
            tones.get(name, ()),
            read_rotation=name in coupled_joints or name in tones,
        )
        for name in dict.fromkeys([*springs.joints, *coupled_joints, *tones])
        if name in moving
    }
    return bound, coupled


def _bind_joint(
    chain: Chain,
    springs: JointSprings,
    law: SphericalLaw,
    tones: Sequence[AxisTone],
    *,
    read_rotation: bool,
) -> tuple[BoundSpring, ...]:
    """Return the springs of one joint, bound to its displacements.

    Args:
        chain: displacements of the joint.
        springs: springs about its axes and along its translations.
        law: law of spherical joints.
        tones: tones that hold its angles.
        read_rotation: whether to measure the rotation also without springs, for coupled laws.
    """
    bound: list[BoundSpring] = []
    if springs.axes or springs.reach or read_rotation:
        axes = chain.rotation_axes
        if len(axes) == 1:
            own = tuple(spring.oriented_along(axes[0]) for spring in springs.axes[:1])
            oriented = tuple(tone.oriented_along(axes[0]) for tone in tones)
            bound.append(BoundSpring(own, JointKind.REVOLUTE, chain.rotations[0], tone=oriented))
        else:
            made = rotation_law(springs, law, axes)
            own = tuple(made.axes)
            bound.append(BoundSpring(own, JointKind.SPHERICAL, law=made, tone=tuple(tones)))
    indices = [chain.translation_along(spring.direction) for spring in springs.translations]
    weights: list[tuple[float, ...]] = [(1.0,)] * len(indices)
    if indices and len(chain.translations) > 1:
        # Rows of the pseudo-inverse, because the axes may be oblique.
        inverse = np.linalg.pinv(np.array([chain.joint_axes[k].axis for k in chain.translations]).T)
        weights = [tuple(inverse[chain.translations.index(k)].tolist()) for k in indices]
    for spring, k, row in zip(springs.translations, indices, weights, strict=True):
        along = spring.oriented_along(chain.joint_axes[k].axis)
        bound.append(BoundSpring((along,), JointKind.PRISMATIC, k, row))
    return tuple(bound)


def generalized_force(spring: AxisSpring, value: Real, rate: Real, ops: Operations) -> Real:
    """Torque or force of a spring of one displacement on the child."""
    return total_torque(spring.elastic, value, ops) + spring.resistance(value, rate, ops)


@dataclass(frozen=True)
class RunModel:
    """A model before its first step.

    Attributes:
        placement: initial placement of the figure.
        rates: initial rates of the tree's displacements, shape (m,) [rad/s or m/s].
        springs: springs of each joint with springs, or with an angle of a coupled law or of tone.
        coupled: coupled laws of moving joints.
        prescribed: locks, links and drives.
        loads: loads on moving segments.
        contacts: contact with the props of the plan and of segments; None without props.
        spring_set: the springs that were bound.
        tone: tone of the joints; None without any.
        plan: the plan of the run.
    """

    placement: Placement
    rates: Array
    springs: Mapping[str, Sequence[BoundSpring]]
    coupled: tuple[CoupledSpring, ...]
    prescribed: PrescribedMotion
    loads: tuple[TimedLoad, ...]
    contacts: ContactModel | None
    spring_set: SpringSet
    tone: JointTones | None
    plan: Plan

    def __repr__(self) -> str:
        """The figure, in a line."""
        return f"<{type(self).__name__} of {self.figure!r}>"

    @property
    def figure(self) -> Figure:
        """The figure that moves; with a free root, the detached one."""
        return self.placement.tree.figure


def prepare_run(
    model: Model | Figure, plan: Plan, contacts: ContactModel | None = None
) -> RunModel:
    """Return a model ready to run; the arguments are those of `build_model`.

    Raises:
        InputError: the figure is wrong, or moving segments have no mass; it holds all errors.
        MoverError: the figure or the plan cannot be run; the message says why.
    """
    model, plan = resolve_model(model, plan)
    require_valid_model(model)
    if contacts is None:
        start = initial_state(model.figure, plan, model.contact)
        if start.spheres:
            contacts = ContactModel(plan.scene, start.spheres, start.pairs, start.part_laws)
    else:
        start = initial_state(model.figure, replace(plan, scene=Scene(), self_contact=False))
        contacts = replace(contacts, scene=plan.scene) if contacts.spheres else None
    springs, placement, prescribed = model.springs, start.placement, start.prescribed
    require_defined_torques(placement, springs)
    tree, figure = placement.tree, placement.tree.figure
    if tree.closures:
        fixed = set(plan.velocities) | prescribed.fixed_joints
        rates = consistent_rates(placement, start.rates, fixed=fixed)
    else:
        rates = tree.kinematics.displacement_vector(start.rates)
    tone = None
    if plan.tone:
        tone = bind_tone(plan.tone, start.upright, placement, springs, plan.start)
    bound, coupled = bind_springs(tree, springs, tone)
    loads = [*constant_site_loads(figure, plan.start, plan.stop), *plan.loads]
    return RunModel(
        placement,
        rates,
        NamedMapping(bound, "the model has no springs at joint"),
        coupled,
        prescribed,
        tuple(load for load in loads if load.site.segment not in figure.ground),
        contacts,
        springs,
        tone,
        plan,
    )


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
    stated = checked_joint_values(figure, plan.displacements)
    displacements = {**initial_displacements(tree), **stated}
    prescribed = _build_prescribed_motion(tree, plan, displacements)
    displacements = prescribed.impose_displacements(displacements, plan.start)
    for _, fault in follower_faults(figure.joints, stated, displacements):
        raise ModelError(f"at the start {fault}; leave it out")
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
    imposed = prescribed.impose_rates(rates, plan.start, placement.displacements)
    joints = placement.tree.figure.joints
    for _, fault in follower_faults(joints, rates, placement.displacements, imposed):
        raise ModelError(f"at the start {fault}; leave it out")
    for name in plan.velocities:
        free = list(placement.tree.figure.joints[name].free_places)
        if not np.allclose(rates[name][free], imposed[name][free], rtol=1e-9, atol=1e-9):
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
        np.array([sphere.centre for sphere in some]) @ poses[name][:3, :3].T + poses[name][:3, 3]
        for name, some in spheres.items()
        if some
    ]
    return deepest_start(scene, np.concatenate(centres), radii, names) if names else None


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
        name: np.zeros(len(joint.chain)) for name, joint in figure.joints.items()
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


_LOAD_END_MARGIN = 1.0
"""Time by which constant loads extend beyond the run [s], against early ends by rounding."""


def constant_site_loads(figure: Figure, start: float, stop: float) -> list[TimedLoad]:
    """Return the constant loads at a figure's sites, from `start` to `stop` [s]."""
    loads: list[TimedLoad] = []
    for name in figure.bodies:
        for site in figure.segments[name].sites.values():
            ref = SiteRef(name, site.name)
            loads.extend(
                constant_load(ref, kind, value, start - _LOAD_END_MARGIN, stop + _LOAD_END_MARGIN)
                for kind, value in site_loads(site).items()
                if any(value)
            )
    return loads


def require_centre_of_mass(segment: Segment) -> Array:
    """Position of the centre of mass in the segment frame [m], shape (3,)."""
    centre = segment.centre_of_mass
    if centre is None or segment.mass is None or segment.inertia is None or not segment.mass > 0.0:
        raise ModelError(
            f"segment {segment.name} cannot be simulated: "
            "give it a positive mass, an inertia and a site CM"
        )
    return centre
