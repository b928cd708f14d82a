"""Static forces of a figure: on its displacements, and as joint torques of the Exudyn model.

`StaticState` computes the generalized forces of gravity, loads and springs without damping and
friction, by the laws of the model's connectors. `static_torques` evaluates no law: Exudyn computes
the right-hand side of the equations of motion in a pose, and the forces on the bodies are summed
beyond each joint, so that everything in the model contributes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from generator.contact.scene import Scene
from generator.diagnostics import ModelError, NamedMapping
from generator.figure import Figure, Site
from generator.kinematics.links import Links
from generator.kinematics.placement import (
    Displacements,
    Placement,
    forward_kinematics,
    relative_jacobian,
    segment_jacobians,
    site_pose,
)
from generator.loads import LoadKind, TimedLoad
from generator.model import Model
from generator.rotations import Array, cross_product, matrix_from_rotation_vector
from generator.simulation.exudyn_model.bodies import body_pose
from generator.simulation.exudyn_model.exudyn_api import exu, rigid
from generator.simulation.exudyn_model.model import ExudynModel, build_model
from generator.simulation.joint_motion import (
    JointMotion,
    SegmentMotion,
    coupled_motion,
    energy_by_kind,
)
from generator.simulation.plan import Plan, resolve_model
from generator.simulation.preconditions import singular_orientation
from generator.simulation.run_model import JointKind, RunModel, initial_state
from generator.simulation.trace import Trace
from springs import total_torque


@dataclass(frozen=True)
class StaticState:
    """n poses of a model at rest.

    Attributes:
        model: the model.
        values: displacements of its tree, shape (n, m) [rad or m].
        poses: poses of each segment in the world, shape (n, 4, 4).
        joints: joint motions with zero velocities.
        trace: states of the bodies with zero velocities.
    """

    model: RunModel
    values: Array
    poses: Mapping[str, Array]
    joints: Mapping[str, JointMotion]
    trace: Trace

    @classmethod
    def from_displacements(cls, model: RunModel, values: Array) -> "StaticState":
        """Place a figure at displacements of its tree with closed loops, shape (n, m)."""
        tree, bodies = model.placement.tree, model.figure.bodies
        poses, count = tree.kinematics.poses(values), len(values)
        rotations = np.stack([poses[name][:, :3, :3] for name in bodies], axis=1)
        centres = [
            poses[name] @ _homogeneous_point(body.centre_of_mass) for name, body in bodies.items()
        ]
        positions = np.stack([centre[:, :3] for centre in centres], axis=1)
        at_rest, zeros = np.zeros_like(positions), np.zeros(count)
        trace = Trace(
            np.arange(float(count)), positions, rotations, at_rest, at_rest, {}, zeros, zeros, zeros
        )
        motion = SegmentMotion(model, trace)
        joints: dict[str, JointMotion] = {}
        for name, joint in model.figure.joints.items():
            if name not in tree.kinematics.columns:
                joints[name] = motion.joint(joint, model.placement.displacements[name])
                continue
            joint_values = values[:, tree.kinematics.columns[name]]
            pose_in_parent = tree.chains[name].pose(joint_values)
            at_rest_too = partial(np.zeros, (count, 6))
            joints[name] = JointMotion(tree.chains[name], pose_in_parent, at_rest_too, joint_values)
        return cls(model, values, poses, joints, trace)

    def energy(self) -> Array:
        """Energy of gravity and of conservative springs, shape (n,) [J]."""
        energies = energy_by_kind(self.model, self.trace, self.joints, None)
        return energies["gravity"] + energies["spring"]

    def forces(self) -> Array:
        """Generalized forces on the tree's displacements, shape (n, m) [N m or N]."""
        kinematics = self.model.placement.tree.kinematics
        forces = self._external_forces()
        for name, joint_forces in self._elastic_forces().items():
            if name in kinematics.columns:
                forces[:, kinematics.columns[name]] += joint_forces
            else:
                forces += self._closure_forces(name, joint_forces)
        return forces

    def inertia(self) -> Array:
        """Generalized inertia of the first pose, shape (m, m) [kg m2, kg m or kg]."""
        kinematics = self.model.placement.tree.kinematics
        twists = kinematics.twists(self.values[0])
        total = np.zeros((kinematics.size, kinematics.size))
        for k, (name, body) in enumerate(self.model.figure.bodies.items()):
            motion = twists * kinematics.motion_masks[name][:, None]
            speeds = motion[:, 3:] + np.cross(motion[:, :3], self.trace.positions[0, k])
            body_rates = motion[:, :3] @ self.trace.rotations[0, k]
            assert body.mass is not None
            assert body.inertia is not None
            total += (
                body.mass * speeds @ speeds.T
                + (body_rates * np.asarray(body.inertia)) @ body_rates.T
            )
        return total

    def _external_forces(self) -> Array:
        """Gravity and loads on the tree's displacements, shape (n, m)."""
        kinematics = self.model.placement.tree.kinematics
        twists = kinematics.twists(self.values)
        wrenches = {name: np.zeros((len(self.values), 6)) for name in self.model.figure.bodies}
        gravity = np.asarray(self.model.plan.gravity)
        for k, (name, body) in enumerate(self.model.figure.bodies.items()):
            assert body.mass is not None
            _add_force(wrenches[name], body.mass * gravity, self.trace.positions[:, k])
        for load in self.model.loads:
            self._add_load(load, wrenches[load.site.segment])
        forces = np.zeros_like(self.values)
        for name, wrench in wrenches.items():
            forces += (twists @ wrench[..., None])[..., 0] * kinematics.motion_masks[name]
        return forces

    def _add_load(self, load: TimedLoad, wrench: Array) -> None:
        """Add a load with its value at the start of the plan."""
        value = load.components(self.model.plan.start)
        pose = self.poses[load.site.segment]
        if load.kind.is_local:
            value = pose[:, :3, :3] @ value
        if load.kind in (LoadKind.GLOBAL_FORCE, LoadKind.LOCAL_FORCE):
            site = self.model.figure.site(load.site).pose_in_segment
            _add_force(wrench, value, (pose @ site)[:, :3, 3])
        else:
            wrench[:, :3] += value

    def _elastic_forces(self) -> dict[str, Array]:
        """Elastic forces on the displacements of each joint with springs, shape (n, dof)."""
        chains = self.model.placement.tree.chains
        forces: dict[str, Array] = {}
        for name, connectors in self.model.springs.items():
            motion = self.joints[name]
            forces[name] = np.zeros_like(motion.displacements)
            for connector in connectors:
                if connector.law is not None:
                    torque = connector.law.torque(motion.rotation_vectors)
                    forces[name] += self._project_onto_axes(name, torque)
                    continue
                displacement = motion.displacements[:, connector.axis_index]
                for spring in connector.springs:
                    forces[name][:, connector.axis_index] += total_torque(
                        spring.elastic, displacement
                    )
        moved = coupled_motion(self.model, self.joints)
        for coupled in self.model.coupled:
            for name, torque in moved.torques(coupled).items():
                if torque.ndim == 1:
                    forces[name][:, chains[name].rotations[0]] += torque
                else:
                    forces[name] += self._project_onto_axes(name, torque)
        return forces

    def _project_onto_axes(self, name: str, torque: Array) -> Array:
        """Project a torque (n, 3) in the half-way frame onto the displacements, shape (n, dof)."""
        motion = self.joints[name]
        half = matrix_from_rotation_vector(0.5 * motion.rotation_vectors)
        axes = self.model.placement.tree.chains[name].twists(motion.displacements)[..., :3]
        return np.asarray((axes @ (half @ torque[..., None]))[..., 0])

    def _closure_forces(self, name: str, closure_forces: Array) -> Array:
        """Convert forces on a closing joint to forces on the tree's displacements, shape (n, m)."""
        tree, joint = self.model.placement.tree, self.model.figure.joints[name]
        forces = np.zeros_like(self.values)
        for k, placement in enumerate(self.placements()):
            motion = relative_jacobian(placement, segment_jacobians(placement), joint)
            columns = tree.chains[name].twists(self.joints[name].displacements[k])
            columns[:, 3:] += np.cross(columns[:, :3], self.joints[name].pose_in_parent[k, :3, 3])
            forces[k] = (np.linalg.pinv(columns.T) @ motion).T @ closure_forces[k]
        return forces

    def placements(self) -> list[Placement]:
        """Return the placement of each pose."""
        tree = self.model.placement.tree
        return [
            forward_kinematics(
                tree, {name: motion.displacements[k] for name, motion in self.joints.items()}
            )
            for k in range(len(self.values))
        ]


def _homogeneous_point(point: Array | None) -> Array:
    assert point is not None
    return np.append(point, 1.0)


def _add_force(wrench: Array, force: Array, point: Array) -> None:
    """Add a force at points (n, 3) to wrenches (n, 6): moment about the origin, force."""
    wrench[:, :3] += np.cross(point, force)
    wrench[:, 3:] += force


def static_torques(
    model: Model | Figure, poses: Sequence[Displacements], plan: Plan | None = None
) -> Mapping[str, Array]:
    """Torque of every joint's passive springs on its child, in n poses at rest.

    Gravity, props, loads, velocities, links, locks and drives are ignored.

    Args:
        model: Figure without closed loops, with springs, as for `simulate`.
        poses: n poses, as displacements by joint [rad or m]; other joints have the displacements of
            the plan, or of the figure. A revolute may be rotated more than once.
        plan: choice of springs, law and kind of torques; None for `Plan()`.

    Returns:
        Torque by joint about the child's site, parent's site axes, shape (n, 3) [N m].

    Raises:
        ModelError: the figure has loops, or a joint with springs is at 180 deg.
        MoverError: the figure cannot be built, or a pose does not fit it.
    """
    static_plan = replace(
        plan or Plan(),
        gravity=(0.0, 0.0, 0.0),
        scene=Scene(),
        self_contact=False,
        velocities={},
        loads=(),
        links=Links(),
        locked=(),
        drives={},
    )
    model, static_plan = resolve_model(model, static_plan)
    unloaded = _remove_loads(model.figure)
    static_model = _StaticModel.from_model(
        build_model(replace(model, figure=unloaded), static_plan)
    )
    placements = [
        initial_state(
            unloaded, replace(static_plan, displacements={**static_plan.displacements, **pose})
        ).placement
        for pose in poses
    ]
    zeros = {name: np.zeros((len(placements), 3)) for name in static_model.model.figure.joints}
    torques = NamedMapping(zeros, "the figure has no joint")
    for row, placement in enumerate(placements):
        for name, torque in static_model.torques(placement).items():
            torques[name][row] = torque
    return torques


@dataclass(frozen=True)
class _StaticModel:
    """A model whose equations of motion are evaluated in poses.

    Attributes:
        model: the model, without gravity and loads.
        solver: solver that evaluates the right-hand side and never takes a step.
        coordinates: indices of each body's position and Euler parameters among all coordinates.
        revolute_springs: revolute springs for each revolute with a spring its joint, the index of
            its axis in the chain, and the index of its last angle in Exudyn's data, by which turns
            are counted.
        spherical_joints: names of the joints whose springs depend on a rotation vector.
        reference: reference values that Exudyn adds to its coordinates.
    """

    model: ExudynModel
    solver: Any
    coordinates: Mapping[str, Sequence[int]]
    revolute_springs: tuple[tuple[str, int, Sequence[int]], ...]
    spherical_joints: tuple[str, ...]
    reference: Array

    @classmethod
    def from_model(cls, model: ExudynModel) -> "_StaticModel":
        """Prepare a model. Raises ModelError for loops."""
        closures = model.placement.tree.closures
        if closures:
            names = ", ".join(joint.name for joint in closures)
            raise ModelError(
                f"the loop closed by {names} makes joint torques ambiguous: "
                "static torques need a figure without loops"
            )
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        solver = exu.MainSolverImplicitSecondOrder()
        solver.InitializeSolver(model.mbs, settings)
        data = model.mbs.systemData
        connectors = [
            (name, connector)
            for name, joint_connectors in model.springs.items()
            for connector in joint_connectors
        ]
        return cls(
            model,
            solver,
            {name: data.GetObjectLTGODE2(model.bodies[name]) for name in model.figure.bodies},
            tuple(
                (name, connector.axis_index, data.GetObjectLTGData(connector.item))
                for name, connector in connectors
                if connector.kind is JointKind.REVOLUTE
            ),
            tuple(name for name, connector in connectors if connector.kind is JointKind.SPHERICAL),
            np.array(data.GetODE2Coordinates(configuration=exu.ConfigurationType.Reference)),
        )

    def torques(self, placement: Placement) -> dict[str, Array]:
        """Torque of each joint on its child about the child's site, parent's axes, (3,) [N m]."""
        self._check_half_turn(placement)
        wrenches = self._body_wrenches(placement)
        torques: dict[str, Array] = {}
        for tree_joint in reversed(placement.tree.joints):
            wrench, joint = wrenches[tree_joint.outboard], tree_joint.joint
            if tree_joint.inboard in wrenches:
                wrenches[tree_joint.inboard] = wrenches[tree_joint.inboard] + wrench
            child = site_pose(placement, joint, "child")
            moment = wrench[3:] - cross_product(child[:3, 3], wrench[:3])
            torque = site_pose(placement, joint, "parent")[:3, :3].T @ moment
            torques[joint.name] = torque if tree_joint.parent_is_inboard else -torque
        return torques

    def _check_half_turn(self, placement: Placement) -> None:
        """Raise ModelError for a spring whose rotation vector has an undefined sign."""
        for name in self.spherical_joints:
            joint, law = placement.tree.figure.joints[name], self.model.spring_set.law
            where = singular_orientation(placement, joint, law)
            if where is not None:
                raise ModelError(
                    f"joint {name} is {where}, where the torque of its springs is not defined"
                )

    def _body_wrenches(self, placement: Placement) -> dict[str, Array]:
        """Force on each body, and moment about the world's origin, world axes, (6,) [N, N m]."""
        data = self.model.mbs.systemData
        coordinates = np.zeros_like(self.reference)
        figure = placement.tree.figure
        for name, indices in self.coordinates.items():
            pose = body_pose(placement, figure.segments[name])
            parameters = rigid.RotationMatrix2EulerParameters(pose[:3, :3])
            coordinates[indices] = [*pose[:3, 3], *parameters]
        data.SetODE2Coordinates(coordinates - self.reference)
        angles = np.array(data.GetDataCoordinates())
        for name, factor, indices in self.revolute_springs:
            angles[indices] = placement.displacements[name][factor]
        data.SetDataCoordinates(angles)
        self.solver.ComputeODE2RHS(self.model.mbs)
        right_hand_side = self.solver.GetSystemResidual()
        wrenches: dict[str, Array] = {}
        for name, indices in self.coordinates.items():
            pose_coordinates = coordinates[indices]
            force = right_hand_side[indices]
            # The angular velocity is G times the parameter rates, so their force is G^T times the
            # torque, and G G^T is four times the identity.
            torque = 0.25 * np.asarray(rigid.EulerParameters2G(pose_coordinates[3:])) @ force[3:]
            wrenches[name] = np.concatenate(
                [force[:3], torque + cross_product(pose_coordinates[:3], force[:3])]
            )
        return wrenches


def _remove_loads(figure: Figure) -> Figure:
    """Return the figure without the forces and moments at its sites."""

    def bare(site: Site) -> Site:
        return replace(
            site, global_force=None, local_force=None, global_moment=None, local_moment=None
        )

    segments = {
        name: replace(
            segment, sites={site_name: bare(site) for site_name, site in segment.sites.items()}
        )
        for name, segment in figure.segments.items()
    }
    return replace(figure, segments=segments)
