"""Torques of passive joints read out of the Exudyn model while nothing moves.

No law is evaluated here. The bodies are put where a pose has them, Exudyn evaluates the right-hand
side of the equations of motion, and what it gives the bodies is summed beyond each joint. Whatever
the model holds is in the sum, laws over several joints too.

Forces on the displacements of a figure that does not move: gravity, loads and springs.

The laws are those of the connectors that a simulation has; damping and friction, which act on what
moves, are left out. A force on a displacement is the work a unit of it takes: N m or N.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from generator.diagnostics import ModelError
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
from generator.rotations import Array, matrix_from_rotation_vector
from generator.simulation.bodies import body_pose
from generator.simulation.coupled_springs import coupled_torques
from generator.simulation.exudyn_api import exu, rigid
from generator.simulation.integrate import Trace
from generator.simulation.joint_motion import (
    JointMotion,
    SegmentMotion,
    coupled_joint_rotations,
    energy_by_kind,
)
from generator.simulation.model import ExudynModel, build_model, initial_state
from generator.simulation.plan import Plan, resolve_springs
from generator.simulation.preconditions import is_at_half_turn
from generator.simulation.springs import JointKind
from springs import elastic_torque, total_torque


@dataclass(frozen=True)
class StaticState:
    """Poses of an assembly at rest; n of them.

    Attributes:
        assembly: whose.
        values: displacements of its tree, shape (n, m) [rad or m].
        poses: of each segment in the world, shape (n, 4, 4).
        joints: as motions without any.
        trace: the same as states of the bodies.
    """

    assembly: ExudynModel
    values: Array
    poses: Mapping[str, Array]
    joints: Mapping[str, JointMotion]
    trace: Trace

    @classmethod
    def from_displacements(cls, assembly: ExudynModel, values: Array) -> "StaticState":
        """Place a figure at displacements of its tree, shape (n, m), in which its loops close."""
        tree, bodies = assembly.placement.tree, assembly.figure.bodies
        poses, count = tree.kinematics.poses(values), len(values)
        turns = np.stack([poses[name][:, :3, :3] for name in bodies], axis=1)
        centres = [
            poses[name] @ _homogeneous_point(body.centre_of_mass) for name, body in bodies.items()
        ]
        places = np.stack([centre[:, :3] for centre in centres], axis=1)
        still, none = np.zeros_like(places), np.zeros(count)
        trace = Trace(np.arange(float(count)), places, turns, still, still, {}, none, none, none)
        motion = SegmentMotion(assembly, trace)
        joints: dict[str, JointMotion] = {}
        for name, joint in assembly.figure.joints.items():
            if name not in tree.kinematics.columns:
                joints[name] = motion.joint(joint, assembly.placement.displacements[name])
                continue
            own = values[:, tree.kinematics.columns[name]]
            between = tree.chains[name].pose(own)
            joints[name] = JointMotion(between, np.zeros((count, 6)), own, np.zeros_like(own))
        return cls(assembly, values, poses, joints, trace)

    def energy(self) -> Array:
        """Gravity's and the springs', without what the weighted law would need, shape (n,) [J]."""
        book = energy_by_kind(self.assembly, self.trace, self.joints)
        return book["gravity"] + book["spring"]

    def forces(self) -> Array:
        """Forces of all kinds on the tree's displacements, shape (n, m) [N m or N]."""
        kinematics = self.assembly.placement.tree.kinematics
        forces = self._external_forces()
        for name, pushed in self._elastic_forces().items():
            if name in kinematics.columns:
                forces[:, kinematics.columns[name]] += pushed
            else:
                forces += self._closure_forces(name, pushed)
        return forces

    def inertia(self) -> Array:
        """Generalized inertia of the first pose, shape (m, m) [kg m2, kg m or kg]."""
        kinematics = self.assembly.placement.tree.kinematics
        twists = kinematics.twists(self.values[0])
        total = np.zeros((kinematics.size, kinematics.size))
        for k, (name, body) in enumerate(self.assembly.figure.bodies.items()):
            moved = twists * kinematics.motion_masks[name][:, None]
            speeds = moved[:, 3:] + np.cross(moved[:, :3], self.trace.positions[0, k])
            turned = moved[:, :3] @ self.trace.rotations[0, k]
            assert body.mass is not None
            assert body.inertia is not None
            total += body.mass * speeds @ speeds.T + (turned * np.asarray(body.inertia)) @ turned.T
        return total

    def _external_forces(self) -> Array:
        """Gravity and loads on the tree's displacements, shape (n, m)."""
        kinematics = self.assembly.placement.tree.kinematics
        twists = kinematics.twists(self.values)
        wrenches = {name: np.zeros((len(self.values), 6)) for name in self.assembly.figure.bodies}
        gravity = np.asarray(self.assembly.plan.gravity)
        for k, (name, body) in enumerate(self.assembly.figure.bodies.items()):
            assert body.mass is not None
            _add_force(wrenches[name], body.mass * gravity, self.trace.positions[:, k])
        for load, *_ in self.assembly.loads:
            self._add_load(load, wrenches[load.site.segment])
        forces = np.zeros_like(self.values)
        for name, wrench in wrenches.items():
            forces += (twists @ wrench[..., None])[..., 0] * kinematics.motion_masks[name]
        return forces

    def _add_load(self, load: TimedLoad, wrench: Array) -> None:
        """Add a load as it is at the start of the plan."""
        value = load.components(self.assembly.plan.start)
        pose = self.poses[load.site.segment]
        if load.kind.is_local:
            value = pose[:, :3, :3] @ value
        if load.kind in (LoadKind.GLOBAL_FORCE, LoadKind.LOCAL_FORCE):
            site = self.assembly.figure.site(load.site).pose_in_segment
            _add_force(wrench, value, (pose @ site)[:, :3, 3])
        else:
            wrench[:, :3] += value

    def _elastic_forces(self) -> dict[str, Array]:
        """Elastic forces on the displacements of each joint that has any, shape (n, dof)."""
        chains = self.assembly.placement.tree.chains
        joining = self.assembly.spring_set.joining
        forces: dict[str, Array] = {}
        for name, connectors in self.assembly.springs.items():
            moved = self.joints[name]
            forces[name] = np.zeros_like(moved.displacements)
            for one in connectors:
                if one.kind is JointKind.SPHERICAL:
                    torque = elastic_torque(joining, one.springs, moved.rotation_vectors)
                    forces[name] += self._project_onto_axes(name, torque)
                    continue
                along = moved.displacements[:, one.axis_index]
                for spring in one.springs:
                    forces[name][:, one.axis_index] += total_torque(spring.elastic, along)
        turned = coupled_joint_rotations(self.assembly, self.joints)
        for one in self.assembly.coupled:
            for name, torque in coupled_torques(one.spring, chains, turned).items():
                if torque.ndim == 1:
                    forces[name][:, chains[name].rotations[0]] += torque
                else:
                    forces[name] += self._project_onto_axes(name, torque)
        return forces

    def _project_onto_axes(self, name: str, torque: Array) -> Array:
        """A torque (n, 3) in the half-way frame as forces on the displacements, shape (n, dof)."""
        moved = self.joints[name]
        half = matrix_from_rotation_vector(0.5 * moved.rotation_vectors)
        axes = self.assembly.placement.tree.chains[name].twists(moved.displacements)[..., :3]
        return np.asarray((axes @ (half @ torque[..., None]))[..., 0])

    def _closure_forces(self, name: str, closure_forces: Array) -> Array:
        """Forces on the displacements of a closing joint as forces on the tree's, shape (n, m)."""
        tree, joint = self.assembly.placement.tree, self.assembly.figure.joints[name]
        forces = np.zeros_like(self.values)
        for k, placement in enumerate(self.placements()):
            motion = relative_jacobian(placement, segment_jacobians(placement), joint)
            columns = tree.chains[name].twists(self.joints[name].displacements[k])
            columns[:, 3:] += np.cross(columns[:, :3], self.joints[name].pose_in_parent[k, :3, 3])
            forces[k] = (np.linalg.pinv(columns.T) @ motion).T @ closure_forces[k]
        return forces

    def placements(self) -> list[Placement]:
        """Each pose by itself."""
        tree = self.assembly.placement.tree
        return [
            forward_kinematics(
                tree, {name: moved.displacements[k] for name, moved in self.joints.items()}
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
    figure: Figure, poses: Sequence[Displacements], plan: Plan | None = None
) -> Mapping[str, Array]:
    """Torque of every joint's passive springs on its child, in n poses at rest.

    Gravity, loads, velocities, links, locks and drives of the figure and the plan are left out.

    Args:
        figure: whose joints are read; it has no closed loops.
        poses: n of them; each gives displacements by joint [rad or m], and where it does not name
            a joint the plan's count, else the figure's own. A hinge may be turned more than once.
        plan: chooses the springs, how they join, and the kind of torques; None as in `Plan()`.

    Returns:
        By joint, about the child's site in the parent's site axes, shape (n, 3) [N m].

    Raises:
        ModelError: the figure has loops, or a joint with springs is turned by 180 deg.
        MoverError: the figure cannot be built, or a pose does not fit it.
    """
    still = replace(
        plan or Plan(),
        gravity=(0.0, 0.0, 0.0),
        velocities={},
        loads=(),
        links=Links(),
        locked=(),
        drives={},
    )
    unloaded = _remove_loads(figure)
    model = _StaticModel.from_assembly(build_model(unloaded, still, resolve_springs(figure, still)))
    placements = [
        initial_state(
            unloaded, replace(still, displacements={**still.displacements, **pose})
        ).placement
        for pose in poses
    ]
    torques = {name: np.zeros((len(placements), 3)) for name in model.assembly.figure.joints}
    for row, placement in enumerate(placements):
        for name, torque in model.torques(placement).items():
            torques[name][row] = torque
    return torques


@dataclass(frozen=True)
class _StaticModel:
    """An assembly whose equations of motion are evaluated at poses.

    Attributes:
        assembly: built without gravity and loads.
        solver: evaluates the right-hand side; it never takes a step.
        coordinates: places of each body's position and Euler parameters among all coordinates.
        revolute_springs: for each hinge with a spring its joint, the factor of the joint's chain, and the
            place where Exudyn keeps the last angle, from which it counts whole turns.
        spherical_joints: names of the joints whose springs see a rotation vector.
        reference: what Exudyn adds to its coordinates.
    """

    assembly: ExudynModel
    solver: Any
    coordinates: Mapping[str, Sequence[int]]
    revolute_springs: tuple[tuple[str, int, Sequence[int]], ...]
    spherical_joints: tuple[str, ...]
    reference: Array

    @classmethod
    def from_assembly(cls, assembly: ExudynModel) -> "_StaticModel":
        """Prepare an assembly. Raises ModelError for loops."""
        closures = assembly.placement.tree.closures
        if closures:
            names = ", ".join(joint.name for joint in closures)
            raise ModelError(
                f"the loop that {names} closes hides which joint a torque comes from: "
                "only figures without loops can be read at rest"
            )
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        solver = exu.MainSolverImplicitSecondOrder()
        solver.InitializeSolver(assembly.mbs, settings)
        data = assembly.mbs.systemData
        connectors = [(name, one) for name, all_of in assembly.springs.items() for one in all_of]
        return cls(
            assembly,
            solver,
            {name: data.GetObjectLTGODE2(assembly.bodies[name]) for name in assembly.figure.bodies},
            tuple(
                (name, one.axis_index, data.GetObjectLTGData(one.item))
                for name, one in connectors
                if one.kind is JointKind.REVOLUTE
            ),
            tuple(name for name, one in connectors if one.kind is JointKind.SPHERICAL),
            np.array(data.GetODE2Coordinates(configuration=exu.ConfigurationType.Reference)),
        )

    def torques(self, placement: Placement) -> dict[str, Array]:
        """Torque of each joint on its child about the child's site, parent's axes, (3,) [N m]."""
        self._check_half_turn(placement)
        pushes = self._body_wrenches(placement)
        torques: dict[str, Array] = {}
        for branch in reversed(placement.tree.joints):
            push, joint = pushes[branch.outboard], branch.joint
            if branch.inboard in pushes:
                pushes[branch.inboard] = pushes[branch.inboard] + push
            child = site_pose(placement, joint, "child")
            about_child = push[3:] - np.cross(child[:3, 3], push[:3])
            turned = site_pose(placement, joint, "parent")[:3, :3].T @ about_child
            torques[joint.name] = turned if branch.parent_is_inboard else -turned
        return torques

    def _check_half_turn(self, placement: Placement) -> None:
        """Raise ModelError where springs see a rotation vector that may point either way."""
        for name in self.spherical_joints:
            if is_at_half_turn(placement, placement.tree.figure.joints[name]):
                raise ModelError(
                    f"joint {name} is turned by 180 deg, where the torque of its springs is not "
                    "defined"
                )

    def _body_wrenches(self, placement: Placement) -> dict[str, Array]:
        """Force on each body, and moment about the world's origin, world axes, (6,) [N, N m]."""
        data = self.assembly.mbs.systemData
        coordinates = np.zeros_like(self.reference)
        figure = placement.tree.figure
        for name, places in self.coordinates.items():
            pose = body_pose(placement, figure.segments[name])
            parameters = rigid.RotationMatrix2EulerParameters(pose[:3, :3])
            coordinates[places] = [*pose[:3, 3], *parameters]
        data.SetODE2Coordinates(coordinates - self.reference)
        counted = np.array(data.GetDataCoordinates())
        for name, factor, places in self.revolute_springs:
            counted[places] = placement.displacements[name][factor]
        data.SetDataCoordinates(counted)
        self.solver.ComputeODE2RHS(self.assembly.mbs)
        right_hand_side = self.solver.GetSystemResidual()
        pushes: dict[str, Array] = {}
        for name, places in self.coordinates.items():
            here = coordinates[places]
            given = right_hand_side[places]
            # The angular velocity is G times the rates of the parameters, so they get G^T times the
            # torque; and G G^T is four times the identity.
            torque = 0.25 * np.asarray(rigid.EulerParameters2G(here[3:])) @ given[3:]
            pushes[name] = np.concatenate([given[:3], torque + np.cross(here[:3], given[:3])])
        return pushes


def _remove_loads(figure: Figure) -> Figure:
    """The figure without the forces and moments written at its sites."""

    def bare(site: Site) -> Site:
        return replace(
            site, global_force=None, local_force=None, global_moment=None, local_moment=None
        )

    segments = {
        name: replace(segment, sites={key: bare(site) for key, site in segment.sites.items()})
        for name, segment in figure.segments.items()
    }
    return replace(figure, segments=segments)
