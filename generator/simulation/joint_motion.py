"""Motion, reactions, torques and energies of joints from the trace of a run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import assert_never

import numpy as np

from generator.contact.states import ContactStates, evaluate_contacts
from generator.coupled_motion import CoupledMotion
from generator.figure import Joint, SiteRef
from generator.joint_chain import Chain
from generator.kinematics.closures import rotation_equations
from generator.recording import TONE_ENERGY_KIND
from generator.rotations import (
    Array,
    inverse_pose,
    matrix_from_rotation_vector,
    pose_matrix,
    rotation_vector_from_matrix,
    unit_vector,
)
from generator.simulation.exudyn_model.constraints import RateTerm
from generator.simulation.exudyn_model.model import ExudynModel
from generator.simulation.run_model import JointKind, RunModel, generalized_force
from generator.simulation.trace import Trace
from springs import NUMPY, JointSprings, rotation_law, total_energy
from springs.tone.law import AxisTone, rotation_tone, vector_tone


@dataclass(frozen=True)
class JointMotion:
    """Motion of a joint over n frames.

    Attributes:
        chain: displacements of the joint.
        pose_in_parent: pose of the child's site in the parent's, shape (n, 4, 4).
        read_velocity: function that returns `relative_velocity`.
        displacements: shape (n, dof) [rad or m].
    """

    chain: Chain
    pose_in_parent: Array
    read_velocity: Callable[[], Array]
    displacements: Array

    @cached_property
    def relative_velocity(self) -> Array:
        """Velocity of the child's site relative to the parent's, in the parent's site axes.

        Angular, then linear, shape (n, 6).
        """
        return self.read_velocity()

    @cached_property
    def rates(self) -> Array:
        """Rates of the displacements, shape (n, dof)."""
        return _displacement_rates(
            self.chain, self.displacements, self.pose_in_parent, self.relative_velocity
        )

    @cached_property
    def rotation_vectors(self) -> Array:
        """Rotation vectors of the child's site in the parent's, shape (n, 3) [rad]."""
        return rotation_vector_from_matrix(self.pose_in_parent[:, :3, :3])


def coupled_motion(model: RunModel, joints: Mapping[str, JointMotion]) -> CoupledMotion:
    """Return the rotations of the joints of coupled laws."""
    rotations: dict[str, Array] = {}
    for name in {axis.joint for coupled in model.coupled for axis in coupled.axes}:
        rotation_indices = model.placement.tree.chains[name].rotations
        motion = joints[name]
        rotations[name] = (
            motion.displacements[:, rotation_indices[0]]
            if len(rotation_indices) == 1
            else motion.rotation_vectors
        )
    chains = model.placement.tree.chains
    return CoupledMotion(chains, model.spring_set, rotations)


class SegmentMotion:
    """Poses and velocities of segments and joints over a trace."""

    def __init__(self, model: RunModel, trace: Trace) -> None:
        """Compute the poses of the segments at every frame."""
        self._figure = model.figure
        self._trace = trace
        self._model = model
        self._places = {name: k for k, name in enumerate(self._figure.bodies)}
        self.poses: Mapping[str, Array] = {name: self._pose(name) for name in self._figure.segments}

    def _pose(self, segment: str) -> Array:
        count = len(self._trace)
        if segment not in self._places:
            fixed = self._model.placement.poses[segment]
            return np.broadcast_to(fixed, (count, 4, 4)).copy()
        k = self._places[segment]
        centre = self._figure.segments[segment].centre_of_mass
        assert centre is not None
        rotation = self._trace.rotations[:, k]
        return pose_matrix(rotation, self._trace.positions[:, k] - rotation @ centre)

    def _velocity(self, segment: str, point: Array) -> tuple[Array, Array]:
        """Angular velocity, and velocity of the material point at `point` (n, 3), world axes."""
        if segment not in self._places:
            return np.zeros_like(point), np.zeros_like(point)
        k = self._places[segment]
        angular_velocity = self._trace.angular_velocities[:, k]
        arm = point - self._trace.positions[:, k]
        return angular_velocity, self._trace.velocities[:, k] + np.cross(angular_velocity, arm)

    def site(self, ref: SiteRef) -> Array:
        """Pose of a site in the world, shape (n, 4, 4)."""
        return self.poses[ref.segment] @ self._figure.site(ref).pose_in_segment

    def joint(self, joint: Joint, start: Array) -> JointMotion:
        """Return the motion of a joint with the initial displacements `start`, shape (dof,)."""
        parent, child = self.site(joint.parent), self.site(joint.child)
        pose_in_parent = inverse_pose(parent) @ child
        velocity = partial(self._relative_velocity, joint, parent, child)
        chain = self._model.placement.tree.chains[joint.name]
        displacements = self._trace.displacements.get(joint.name)
        if displacements is None:
            displacements = _continuous_displacements(chain, pose_in_parent, start)
        return JointMotion(chain, pose_in_parent, velocity, displacements)

    def _relative_velocity(self, joint: Joint, parent: Array, child: Array) -> Array:
        """Return `JointMotion.relative_velocity` for the poses of both sites, shape (n, 4, 4)."""
        point = child[:, :3, 3]
        angular_velocity, velocity = self._velocity(joint.child.segment, point)
        parent_angular_velocity, parent_velocity = self._velocity(joint.parent.segment, point)
        to_parent = np.swapaxes(parent[:, :3, :3], -1, -2)
        angular = (to_parent @ (angular_velocity - parent_angular_velocity)[..., None])[..., 0]
        linear = (to_parent @ (velocity - parent_velocity)[..., None])[..., 0]
        return np.concatenate([angular, linear], axis=1)

    def passive_torques(self, joints: Mapping[str, JointMotion]) -> dict[str, Array]:
        """Torque of each joint's springs and damping on the child, parent's axes, (n, 3) [N m]."""
        torques = {
            name: self._uncoupled_torque(self._figure.joints[name], motion)
            for name, motion in joints.items()
        }
        chains = self._model.placement.tree.chains
        for coupled in self._model.coupled:
            moved = coupled_motion(self._model, joints)
            for name, torque in moved.torques(coupled).items():
                if torque.ndim == 1:
                    torques[name] += np.outer(torque, unit_vector(chains[name].rotation_axes[0]))
                else:
                    half = matrix_from_rotation_vector(0.5 * moved.rotations[name])
                    torques[name] += (half @ torque[..., None])[..., 0]
        return torques

    def tone_torques(self, joints: Mapping[str, JointMotion]) -> dict[str, Array]:
        """Torque of the tone of each joint on the child, parent's site axes, (n, 3) [N m]."""
        model, trace = self._model, self._trace
        if model.tone is None:
            return {}
        active = np.asarray(model.tone.activation.at(trace.times)) * np.ones(len(trace))
        torques = {
            name: self._held_torque(name, joints[name], axes, active)
            for name, axes in model.tone.hold.items()
        }
        for name, righting in model.tone.righting.items():
            joint = self._figure.joints[name]
            turn = self.site(joint.child)[:, :3, :3]
            spin, _ = self._velocity(joint.child.segment, np.zeros((len(trace), 3)))
            error = rotation_vector_from_matrix(righting.upright.T @ turn)
            spin = (np.swapaxes(turn, -1, -2) @ spin[..., None])[..., 0]
            own = vector_tone(righting.axes, error, spin, active)
            total = (joints[name].pose_in_parent[:, :3, :3] @ own[..., None])[..., 0]
            torques[name] = torques.get(name, 0.0) + total
        return torques

    def _held_torque(
        self, name: str, motion: JointMotion, axes: Sequence[AxisTone], active: Array
    ) -> Array:
        """Torque of the tone that holds a joint, in the axes of `tone_torques`."""
        chain = self._model.placement.tree.chains[name]
        if len(chain.rotations) == 1:
            direction = unit_vector(chain.rotation_axes[0])
            (axis,) = (tone.oriented_along(chain.rotation_axes[0]) for tone in axes)
            angle = motion.displacements[:, chain.rotations[0]]
            size = axis.torque(angle, motion.relative_velocity[:, :3] @ direction, active)
            return np.asarray(size)[:, None] * direction
        springs = self._model.spring_set.joints.get(name, JointSprings(name))
        law = rotation_law(springs, self._model.spring_set.law, chain.rotation_axes)
        r = motion.rotation_vectors
        half = matrix_from_rotation_vector(0.5 * r)
        rate = (np.swapaxes(half, -1, -2) @ motion.relative_velocity[:, :3, None])[..., 0]
        return (half @ rotation_tone(law, axes, r, rate, active)[..., None])[..., 0]

    def _uncoupled_torque(self, joint: Joint, joint_motion: JointMotion) -> Array:
        """Torque of a joint's own springs and damping, in the axes of `passive_torques`."""
        springs = self._model.spring_set.joints.get(joint.name, JointSprings(joint.name))
        chain = self._model.placement.tree.chains[joint.name]
        if not springs.axes or joint.name not in self._model.springs:
            return np.zeros((len(self._trace), 3))
        if len(chain.rotations) == 1:
            spring = springs.axes[0]
            axis = np.asarray(spring.direction)
            sign = float(np.sign(axis @ np.asarray(chain.rotation_axes[0])))
            angle = sign * joint_motion.displacements[:, chain.rotations[0]]
            size = generalized_force(
                spring, angle, joint_motion.relative_velocity[:, :3] @ axis, NUMPY
            )
            return np.asarray(size)[:, None] * axis
        r = joint_motion.rotation_vectors
        half = matrix_from_rotation_vector(0.5 * r)
        rate = (np.swapaxes(half, -1, -2) @ joint_motion.relative_velocity[:, :3, None])[..., 0]
        law = rotation_law(springs, self._model.spring_set.law, chain.rotation_axes)
        torque = law.torque(r) + law.damping(r, rate)
        return (half @ torque[..., None])[..., 0]

    def reaction(self, joint: Joint, joint_motion: JointMotion) -> Array:
        """Force and moment of the constraints on the child at its site, shape (n, 6) [N, N m]."""
        total = np.zeros((len(self._trace), 6))
        assert isinstance(self._model, ExudynModel)
        constraints = self._model.joints.get(joint.name, ())
        for number, constraint in enumerate(constraints):
            multipliers = self._trace.multipliers[joint.name][:, number]
            locked_axes = constraint.locked_axes
            rotation = joint_motion.pose_in_parent[:, :3, :3]
            zero_pose = inverse_pose(locked_axes.zero_pose)
            child = rotation @ zero_pose[:3, :3] @ locked_axes.frame
            parent = np.broadcast_to(locked_axes.frame, child.shape)
            first, second = (child, parent) if locked_axes.from_child else (parent, child)
            if constraint.is_spherical:
                first = np.swapaxes(self.site(joint.parent)[:, :3, :3], -1, -2)
            force = -(first @ multipliers[:, :3, None])[..., 0]
            moment = np.zeros_like(force)
            for u, v, k in rotation_equations(locked_axes.rotations):
                across = np.cross(second[..., v], first[..., u])
                moment -= multipliers[:, 3 + k, None] * across
            if locked_axes.from_child:
                # The second marker is the parent's: reverse the wrench and move its point.
                force, moment = -force, -moment
                moment += np.cross(-joint_motion.pose_in_parent[:, :3, 3], force)
            moment += np.cross(rotation @ zero_pose[:3, 3], force)
            total += np.concatenate([force, moment], axis=1)
        return total


def newton_euler_reactions(
    model: RunModel,
    trace: Trace,
    joints: Mapping[str, JointMotion],
    motion: SegmentMotion,
    passive_torques: Mapping[str, Array],
    contact: ContactStates | None,
) -> dict[str, Array]:
    """Force and moment of each joint on its child by Newton's and Euler's equations.

    What a joint transmits balances the inertial, gravity and load wrenches of all segments outboard
    of it, and those of the joints that close loops; the torques and forces of its springs are
    subtracted.

    Args:
        model: the simulated model.
        trace: n frames with accelerations, and with the wrenches of joints that close loops.
        joints: motion of every joint.
        motion: poses of the segments.
        passive_torques: the result of `SegmentMotion.passive_torques`.
        contact: contact in the frames; None without props.

    Returns:
        By joint, at the child's site and in the parent's site axes, shape (n, 6) [N, N m].
    """
    count, figure = len(trace), model.figure
    assert trace.accelerations is not None
    gravity = np.asarray(model.plan.gravity, dtype=float)
    # Wrenches about the world's origin: force, moment.
    wrenches = {name: np.zeros((count, 6)) for name in figure.segments}
    for k, (name, body) in enumerate(figure.bodies.items()):
        assert body.mass is not None
        force = body.mass * (trace.accelerations[:, k, 3:] - gravity)
        turn, inertia = trace.rotations[:, k], np.asarray(body.inertia)
        to_body = np.swapaxes(turn, -1, -2)
        spin = (to_body @ trace.angular_velocities[:, k, :, None])[..., 0]
        spin_rate = (to_body @ trace.accelerations[:, k, :3, None])[..., 0]
        moment = inertia * spin_rate + np.cross(spin, inertia * spin)
        _add_wrench(wrenches[name], force, trace.positions[:, k])
        wrenches[name][:, 3:] += (turn @ moment[..., None])[..., 0]
    if model.contacts is not None and contact is not None:
        for g, name in enumerate(model.contacts.spheres):
            wrenches[name] -= contact.wrenches[:, g] + contact.self_wrenches[:, g]
    stop = model.plan.stop
    beside = np.where(
        trace.times < stop, np.nextafter(trace.times, np.inf), np.nextafter(trace.times, -np.inf)
    )
    for load in model.loads:
        pose = motion.site(load.site)
        value = load.components(beside)
        if load.kind.is_local:
            turn = motion.poses[load.site.segment][:, :3, :3]
            value = (turn @ value[..., None])[..., 0]
        if load.kind.is_force:
            _add_wrench(wrenches[load.site.segment], -value, pose[:, :3, 3])
        else:
            wrenches[load.site.segment][:, 3:] -= value
    reactions: dict[str, Array] = {}
    tone_torques = motion.tone_torques(joints)
    springs = {
        joint.name: _slide_spring_wrench(model, joint, joints[joint.name])
        + np.concatenate(
            [
                np.zeros((count, 3)),
                passive_torques[joint.name] + tone_torques.get(joint.name, 0.0),
            ],
            axis=1,
        )
        for joint in figure.joints.values()
    }
    for joint in model.placement.tree.closures:
        of_constraints = trace.closing_wrenches.get(joint.name, np.zeros((count, 6)))
        total = of_constraints + _wrench_in_world(motion, joint, springs[joint.name])
        wrenches[joint.child.segment] -= total
        wrenches[joint.parent.segment] += total
        reactions[joint.name] = _wrench_at_joint(motion, joint, of_constraints)
    for branch in reversed(model.placement.tree.joints):
        joint, total = branch.joint, wrenches[branch.outboard]
        wrenches[branch.inboard] += total
        on_child = total if branch.parent_is_inboard else -total
        reactions[joint.name] = _wrench_at_joint(motion, joint, on_child) - springs[joint.name]
    return {name: reactions.get(name, np.zeros((count, 6))) for name in figure.joints}


def _wrench_at_joint(motion: SegmentMotion, joint: Joint, wrench: Array) -> Array:
    """Return wrenches (n, 6) about the world's origin at the child's site, parent's site axes."""
    force, to_parent = wrench[:, :3], np.swapaxes(motion.site(joint.parent)[:, :3, :3], -1, -2)
    moment = wrench[:, 3:] - np.cross(motion.site(joint.child)[:, :3, 3], force)
    parts = [(to_parent @ vectors[..., None])[..., 0] for vectors in (force, moment)]
    return np.concatenate(parts, axis=1)


def _wrench_in_world(motion: SegmentMotion, joint: Joint, wrench: Array) -> Array:
    """Return wrenches (n, 6) at the child's site, in the parent's site axes, about the origin."""
    turn = motion.site(joint.parent)[:, :3, :3]
    force, moment = ((turn @ part[..., None])[..., 0] for part in (wrench[:, :3], wrench[:, 3:]))
    moment = moment + np.cross(motion.site(joint.child)[:, :3, 3], force)
    return np.concatenate([force, moment], axis=1)


def _add_wrench(wrench: Array, force: Array, point: Array) -> None:
    """Add a force at a point to wrenches (n, 6) about the world's origin."""
    wrench[:, :3] += force
    wrench[:, 3:] += np.cross(point, force)


def _slide_spring_wrench(model: RunModel, joint: Joint, motion: JointMotion) -> Array:
    """Force and moment of the springs along a joint's translations on the child, (n, 6) [N, N m].

    At the child's site, in the parent's site axes. Where the translations are along axes of the
    child, the force is along a line through the parent's site.
    """
    total = np.zeros((len(motion.displacements), 3))
    chain = model.placement.tree.chains[joint.name]
    for connector in model.springs.get(joint.name, ()):
        if connector.kind is not JointKind.PRISMATIC:
            continue
        index = connector.axis_index
        size = generalized_force(
            connector.springs[0], motion.displacements[:, index], motion.rates[:, index], NUMPY
        )
        weights = np.asarray(connector.output_weights)
        if len(chain.translations) == 1:
            weights = unit_vector(chain.joint_axes[index].axis)
        total += np.outer(size, weights)
    moment = np.zeros_like(total)
    if not chain.translations_are_outer:
        total = (motion.pose_in_parent[:, :3, :3] @ total[..., None])[..., 0]
        if len(chain.translations) > 1:
            moment = np.cross(-motion.pose_in_parent[:, :3, 3], total)
    return np.concatenate([total, moment], axis=1)


def _continuous_displacements(chain: Chain, pose_in_parent: Array, start: Array) -> Array:
    """Displacements of a chain over the frames, continuous from one to the next, (n, dof)."""
    near = None if _starts_at_singularity(chain, pose_in_parent[0]) else start
    return chain.continuous_displacements(pose_in_parent, near)


def _starts_at_singularity(chain: Chain, pose: Array) -> bool:
    """Return whether the outer angles are undefined in the first frame (eq. 3.14 and 3.15)."""
    return chain.sequence is not None and chain.sequence.is_singular(pose[:3, :3])


def _displacement_rates(
    chain: Chain, displacements: Array, pose_in_parent: Array, motion: Array
) -> Array:
    """Displacement rates of a relative motion, shape (n, dof)."""
    columns = chain.twists(displacements)
    columns[..., 3:] += np.cross(columns[..., :3], pose_in_parent[:, None, :3, 3])
    inverse = np.linalg.pinv(np.swapaxes(columns, -1, -2), rcond=1e-10)
    return np.asarray((inverse @ motion[..., None])[..., 0])


def energy_by_kind(
    model: RunModel,
    trace: Trace,
    joints: Mapping[str, JointMotion],
    contact: ContactStates | None,
) -> dict[str, Array]:
    """Energy by kind at every frame, shape (n,) each [J], beside `losses_by_kind`.

    `spring` is the stored energy of the springs. For laws without one, which are the weighted law
    and coupled laws that are not a gradient, it is the work against their elastic torques since the
    start. `gravity` is zero at the world's origin.
    """
    bodies = list(model.figure.bodies.values())
    masses = np.array([body.mass for body in bodies], dtype=float)
    inertias = np.array([body.inertia for body in bodies], dtype=float)
    own_spins = (np.swapaxes(trace.rotations, -1, -2) @ trace.angular_velocities[..., None])[..., 0]
    kinetic = 0.5 * np.sum(masses * np.sum(trace.velocities**2, axis=-1), axis=-1)
    kinetic += 0.5 * np.sum(inertias * own_spins**2, axis=(-1, -2))
    gravity = -np.sum(masses * (trace.positions @ np.asarray(model.plan.gravity)), axis=-1)
    energies = {
        "kinetic": kinetic,
        "gravity": gravity,
        "spring": _spring_energy(model, trace, joints),
    }
    if contact is not None:
        energies["contact"] = contact.energy
    return energies


def losses_by_kind(trace: Trace) -> dict[str, Array]:
    """Return the energies of `LOSS_KINDS` at every frame, shape (n,) each [J]."""
    energies = {"dissipated": trace.dissipated, "work": trace.load_work}
    if trace.tone_work is not None:
        energies[TONE_ENERGY_KIND] = trace.tone_work
    if trace.contact is not None:
        energies["contact damping"], energies["friction"] = trace.contact.losses.T
    return energies


def contact_of_trace(model: RunModel, trace: Trace) -> ContactStates | None:
    """Contact of a model in the n frames of a trace; None without props."""
    if model.contacts is None:
        return None
    return evaluate_contacts(
        model.contacts,
        model.figure,
        trace.positions,
        trace.rotations,
        trace.velocities,
        trace.angular_velocities,
    )


def _spring_energy(model: RunModel, trace: Trace, joints: Mapping[str, JointMotion]) -> Array:
    stored = trace.spring_work.copy()
    for name, connectors in model.springs.items():
        motion = joints[name]
        for connector in connectors:
            match connector.kind:
                case JointKind.REVOLUTE | JointKind.PRISMATIC:
                    displacement = motion.displacements[:, connector.axis_index]
                    for spring in connector.springs:
                        stored += total_energy(spring.elastic, displacement)
                case JointKind.SPHERICAL:
                    assert connector.law is not None
                    if connector.law.is_conservative:
                        stored += connector.law.energy(motion.rotation_vectors)
                case _:
                    assert_never(connector.kind)
    for coupled in model.coupled:
        if coupled.law.is_conservative:
            stored += coupled_motion(model, joints).energy(coupled)
    return stored


def constraint_wrenches(
    model: ExudynModel, trace: Trace, joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """Force and moment of all links and drives on the child of each constrained joint, at its site.

    Returns:
        Wrenches in the parent's site axes, shape (n, 6) [N, N m].
    """
    wrenches: dict[str, Array] = {}
    column = 0
    for constraint in model.coordinate_constraints:
        for row in constraint.equations:
            for term in row:
                size = -term.factor * trace.coordinate_multipliers[:, column]
                chain, motion = model.placement.tree.chains[term.joint], joints[term.joint]
                if term.curve is not None and isinstance(term.component, int):
                    size = size * term.curve.at(motion.displacements[:, term.component], 1)
                wrench = size[:, None] * _rate_wrench(term, chain, motion)
                wrenches[term.joint] = wrenches.get(term.joint, 0.0) + wrench
            column += 1
    return wrenches


def drive_torques(
    model: RunModel, torques: Mapping[str, Array], joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """Torque of each drive about the axis of each displacement, whose power is torque times rate.

    Args:
        model: the simulated model.
        torques: moments of `constraint_wrenches`, or of the reactions, shape (n, 3) [N m].
        joints: motion of every joint.

    Returns:
        Torques by driven joint, shape (n, degrees of freedom) [N m].
    """
    about_axes: dict[str, Array] = {}
    for name in model.prescribed.drives:
        axes = model.placement.tree.chains[name].twists(joints[name].displacements)[..., :3]
        about_axes[name] = (axes @ torques[name][..., None])[..., 0]
    return about_axes


def _rate_wrench(term: RateTerm, chain: Chain, motion: JointMotion) -> Array:
    """Force and moment on the child at its site whose power is the rate, parent's axes, (n, 6)."""
    wrenches = np.zeros((len(motion.displacements), 6))
    if not isinstance(term.component, int):
        wrenches[:, 3:] = term.component
    elif term.component in chain.translations:
        force = chain.translation_gradient(term.component)
        if chain.translations_are_outer:
            wrenches[:, :3] = force
        else:
            wrenches[:, :3] = motion.pose_in_parent[:, :3, :3] @ force
            wrenches[:, 3:] = np.cross(-motion.pose_in_parent[:, :3, 3], wrenches[:, :3])
    else:
        axes = chain.twists(motion.displacements)[:, list(chain.rotations), :3]
        duals = np.linalg.pinv(np.swapaxes(axes, -1, -2))
        wrenches[:, 3:] = duals[:, chain.rotations.index(term.component)]
    return wrenches
