"""From the states of the bodies to a motion in the figure's own terms.

The energy book of a run, from the states of its frames.

What the multipliers of servos are as torques on the joints.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import assert_never

import numpy as np

from generator.figure import Joint, SiteRef
from generator.joint_chain import Chain
from generator.rotations import (
    Array,
    inverse_pose,
    matrix_from_rotation_vector,
    pose_matrix,
    rotation_vector_from_matrix,
    unit_vector,
)
from generator.simulation.constraints import RateTerm
from generator.simulation.coupled_springs import coupled_energy, coupled_torques
from generator.simulation.integrate import Trace
from generator.simulation.model import ExudynModel
from generator.simulation.springs import JointKind, generalized_force
from springs import (
    NUMPY,
    Joining,
    JointSprings,
    conservative_energy,
    damping_torque,
    elastic_torque,
    total_energy,
)


@dataclass(frozen=True)
class JointMotion:
    """How a joint moved; n frames.

    Attributes:
        pose_in_parent: pose of the child's site in the parent's, shape (n, 4, 4).
        relative_velocity: (angular, linear) velocity of the child's site relative to the parent's, in the
            parent's site axes, shape (n, 6).
        displacements: shape (n, dof) [rad or m].
        rates: of the displacements, shape (n, dof).
    """

    pose_in_parent: Array
    relative_velocity: Array
    displacements: Array
    rates: Array

    @property
    def rotation_vectors(self) -> Array:
        """Rotation vectors of the child's site in the parent's, shape (n, 3) [rad]."""
        return rotation_vector_from_matrix(self.pose_in_parent[:, :3, :3])


def coupled_joint_rotations(
    assembly: ExudynModel, joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """The turns of the joints that coupled laws are about, as `coupled_torques` takes them."""
    turned: dict[str, Array] = {}
    for name in {axis.joint for one in assembly.coupled for axis in one.spring.axes}:
        turns = assembly.placement.tree.chains[name].rotations
        moved = joints[name]
        turned[name] = (
            moved.displacements[:, turns[0]] if len(turns) == 1 else moved.rotation_vectors
        )
    return turned


class SegmentMotion:
    """Poses and velocities of segments and joints over a trace."""

    def __init__(self, assembly: ExudynModel, trace: Trace) -> None:
        """Place the segments at every frame."""
        self._figure = assembly.figure
        self._trace = trace
        self._assembly = assembly
        self._places = {name: k for k, name in enumerate(self._figure.bodies)}
        self.poses: Mapping[str, Array] = {name: self._pose(name) for name in self._figure.segments}

    def _pose(self, segment: str) -> Array:
        count = len(self._trace)
        if segment not in self._places:
            fixed = self._assembly.placement.poses[segment]
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
        spin = self._trace.angular_velocities[:, k]
        arm = point - self._trace.positions[:, k]
        return spin, self._trace.velocities[:, k] + np.cross(spin, arm)

    def site(self, ref: SiteRef) -> Array:
        """Pose of a site in the world, shape (n, 4, 4)."""
        return self.poses[ref.segment] @ self._figure.site(ref).pose_in_segment

    def joint(self, joint: Joint, start: Array) -> JointMotion:
        """The motion of a joint; `start` is the displacement it was given at the start, (dof,)."""
        parent, child = self.site(joint.parent), self.site(joint.child)
        between = inverse_pose(parent) @ child
        point = child[:, :3, 3]
        spin, velocity = self._velocity(joint.child.segment, point)
        base_spin, base_velocity = self._velocity(joint.parent.segment, point)
        turn = np.swapaxes(parent[:, :3, :3], -1, -2)
        angular = (turn @ (spin - base_spin)[..., None])[..., 0]
        linear = (turn @ (velocity - base_velocity)[..., None])[..., 0]
        motion = np.concatenate([angular, linear], axis=1)
        chain = self._assembly.placement.tree.chains[joint.name]
        displacements = _continuous_displacements(chain, between, start)
        return JointMotion(
            between,
            motion,
            displacements,
            _displacement_rates(chain, displacements, between, motion),
        )

    def passive_torques(self, joints: Mapping[str, JointMotion]) -> dict[str, Array]:
        """Torque of each joint's springs and damping on the child, parent's axes, (n, 3) [N m].

        Args:
            joints: the motion of every joint.
        """
        torques = {
            name: self._uncoupled_torque(self._figure.joints[name], moved)
            for name, moved in joints.items()
        }
        chains = self._assembly.placement.tree.chains
        turned = coupled_joint_rotations(self._assembly, joints)
        for one in self._assembly.coupled:
            for name, torque in coupled_torques(one.spring, chains, turned).items():
                if torque.ndim == 1:
                    torques[name] += np.outer(torque, unit_vector(chains[name].rotation_axes[0]))
                else:
                    half = matrix_from_rotation_vector(0.5 * turned[name])
                    torques[name] += (half @ torque[..., None])[..., 0]
        return torques

    def _uncoupled_torque(self, joint: Joint, joint_motion: JointMotion) -> Array:
        """Torque of the springs and damping of one joint alone, as `passive_torques`."""
        springs = self._assembly.spring_set.joints.get(joint.name, JointSprings(joint.name))
        chain = self._assembly.placement.tree.chains[joint.name]
        if not springs.axes or joint.name not in self._assembly.springs:
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
        torque = elastic_torque(self._assembly.spring_set.joining, springs.axes, r)
        torque = torque + damping_torque(springs.axes, r, rate)
        return (half @ torque[..., None])[..., 0]

    def reaction(self, joint: Joint, joint_motion: JointMotion) -> Array:
        """Force and moment of the constraints on the child at its site, shape (n, 6) [N, N m]."""
        total = np.zeros((len(self._trace), 6))
        constraints = self._assembly.joints.get(joint.name, ())
        for number, constraint in enumerate(constraints):
            multipliers = self._trace.multipliers[joint.name][:, number]
            lock = constraint.locked_axes
            turn = joint_motion.pose_in_parent[:, :3, :3]
            rest = inverse_pose(lock.zero_pose)
            child = turn @ rest[:3, :3] @ lock.frame
            parent = np.broadcast_to(lock.frame, child.shape)
            first, second = (child, parent) if lock.from_child else (parent, child)
            if constraint.is_spherical:
                first = np.swapaxes(self.site(joint.parent)[:, :3, :3], -1, -2)
            force = -(first @ multipliers[:, :3, None])[..., 0]
            moment = np.zeros_like(force)
            for u, v, k in _rotation_equations(lock.rotations):
                across = np.cross(second[..., v], first[..., u])
                moment -= multipliers[:, 3 + k, None] * across
            if lock.from_child:
                # The second marker is the parent's: turn the pair round, and move its point.
                force, moment = -force, -moment
                moment += np.cross(-joint_motion.pose_in_parent[:, :3, 3], force)
            moment += np.cross(turn @ rest[:3, 3], force)
            total += np.concatenate([force, moment], axis=1)
        return total


def _rotation_equations(locks: tuple[int, int, int]) -> list[tuple[int, int, int]]:
    """Exudyn's equations u0 . v1 = 0 of locked rotations: (axis u, axis v, multiplier)."""
    x, y, z = 0, 1, 2
    table = {
        (1, 1, 1): [(z, y, 0), (z, x, 1), (x, y, 2)],
        (0, 1, 1): [(x, y, 1), (x, z, 2)],
        (1, 0, 1): [(y, x, 0), (y, z, 2)],
        (1, 1, 0): [(z, x, 0), (z, y, 1)],
        (1, 0, 0): [(y, z, 0)],
        (0, 1, 0): [(x, z, 1)],
        (0, 0, 1): [(x, y, 2)],
        (0, 0, 0): [],
    }
    return table[locks]


def _continuous_displacements(chain: Chain, pose_in_parent: Array, start: Array) -> Array:
    """Displacements of a chain over the frames, continuous from one to the next, (n, dof)."""
    rows: list[Array] = []
    near: Array | None = None if _starts_at_singularity(chain, pose_in_parent[0]) else start
    for pose in pose_in_parent:
        near = chain.displacements(pose, near)
        rows.append(near)
    return np.array(rows).reshape(len(pose_in_parent), len(chain.joint_axes))


def _starts_at_singularity(chain: Chain, pose: Array) -> bool:
    """Whether the first frame leaves the outer angles open (eq. 3.14 and 3.15 then share them)."""
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
    assembly: ExudynModel, trace: Trace, joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """Energy by kind at every frame, shape (n,) each [J].

    `spring` is the stored energy of the springs; where there is none, for spherical joints with the
    weighted law and for coupled laws that are no gradient, the work done against their elastic
    torques since the start. `gravity` is counted from the world's origin.
    """
    bodies = list(assembly.figure.bodies.values())
    masses = np.array([body.mass for body in bodies], dtype=float)
    inertias = np.array([body.inertia for body in bodies], dtype=float)
    own_spins = (np.swapaxes(trace.rotations, -1, -2) @ trace.angular_velocities[..., None])[..., 0]
    kinetic = 0.5 * np.sum(masses * np.sum(trace.velocities**2, axis=-1), axis=-1)
    kinetic += 0.5 * np.sum(inertias * own_spins**2, axis=(-1, -2))
    gravity = -np.sum(masses * (trace.positions @ np.asarray(assembly.plan.gravity)), axis=-1)
    return {
        "kinetic": kinetic,
        "gravity": gravity,
        "spring": _spring_energy(assembly, trace, joints),
        "dissipated": trace.dissipated,
        "work": trace.load_work,
    }


def _spring_energy(assembly: ExudynModel, trace: Trace, joints: Mapping[str, JointMotion]) -> Array:
    weighted = assembly.spring_set.joining is Joining.WEIGHTED
    stored = trace.spring_work.copy()
    for name, connectors in assembly.springs.items():
        moved = joints[name]
        for connector in connectors:
            match connector.kind:
                case JointKind.REVOLUTE | JointKind.PRISMATIC:
                    along = moved.displacements[:, connector.axis_index]
                    for spring in connector.springs:
                        stored += total_energy(spring.elastic, along)
                case JointKind.SPHERICAL:
                    if not weighted:
                        stored += conservative_energy(connector.springs, moved.rotation_vectors)
                case _:
                    assert_never(connector.kind)
    chains = assembly.placement.tree.chains
    for one in assembly.coupled:
        if one.is_conservative:
            stored += coupled_energy(one.spring, chains, coupled_joint_rotations(assembly, joints))
    return stored


def constraint_torques(
    assembly: ExudynModel, trace: Trace, joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """Torque of all links and drives on the child of each joint concerned.

    Args:
        assembly: what was simulated.
        trace: n frames.
        joints: the motion of every joint.

    Returns:
        In the parent's site axes, shape (n, 3) [N m].
    """
    torques: dict[str, Array] = {}
    column = 0
    for servo in assembly.coordinate_constraints:
        for row in servo.equations:
            for term in row:
                size = -term.factor * trace.coordinate_multipliers[:, column]
                chain = assembly.placement.tree.chains[term.joint]
                torque = size[:, None] * _rate_axis(term, chain, joints[term.joint].displacements)
                torques[term.joint] = torques.get(term.joint, 0.0) + torque
            column += 1
    return torques


def drive_torques(
    assembly: ExudynModel, torques: Mapping[str, Array], joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """Torque of each drive about the axis of each displacement, whose power is torque times rate.

    Args:
        assembly: what was simulated.
        torques: as `servo_torques` gives them.
        joints: the motion of every joint.

    Returns:
        By driven joint, shape (n, degrees of freedom) [N m].
    """
    found: dict[str, Array] = {}
    for name in assembly.prescribed.drives:
        axes = assembly.placement.tree.chains[name].twists(joints[name].displacements)[..., :3]
        found[name] = (axes @ torques[name][..., None])[..., 0]
    return found


def _rate_axis(term: RateTerm, chain: Chain, displacements: Array) -> Array:
    """What a term's rate is of the angular velocity in the parent's axes, shape (n, 3) or (3,)."""
    if not isinstance(term.component, int):
        return np.asarray(term.component)
    axes = chain.twists(displacements)[:, list(chain.rotations), :3]
    duals = np.linalg.pinv(np.swapaxes(axes, -1, -2))
    return np.asarray(duals[:, chain.rotations.index(term.component)], dtype=float)
