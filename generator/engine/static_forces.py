"""Forces on the displacements of a figure that does not move: gravity, loads and springs.

The laws are those of the connectors that a simulation has; damping and friction, which act on what
moves, are left out. A force on a displacement is the work a unit of it takes: N m or N.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from generator.engine.assembly import Assembly
from generator.engine.coupled_torques import coupled_torques
from generator.engine.energy import energy_book
from generator.engine.motion import JointMotion, Motion, turned_joints
from generator.engine.trace import Trace
from generator.frames import Array, matrix_from_rotation_vector
from generator.loads import LoadKind, TimedLoad
from generator.posture.placement import (
    Placement,
    motion_maps,
    place,
    relative_motion_map,
)
from springs import elastic_torque, total_torque


@dataclass(frozen=True)
class Still:
    """Poses of an assembly at rest; n of them.

    Attributes:
        assembly: whose.
        values: displacements of its tree, shape (n, m) [rad or m].
        poses: of each segment in the world, shape (n, 4, 4).
        joints: as motions without any.
        trace: the same as states of the bodies.
    """

    assembly: Assembly
    values: Array
    poses: Mapping[str, Array]
    joints: Mapping[str, JointMotion]
    trace: Trace

    @classmethod
    def of(cls, assembly: Assembly, values: Array) -> "Still":
        """Place a figure at displacements of its tree, shape (n, m), in which its loops close."""
        tree, bodies = assembly.placement.tree, assembly.figure.bodies
        poses, count = tree.kinematics.poses(values), len(values)
        turns = np.stack([poses[name][:, :3, :3] for name in bodies], axis=1)
        centres = [poses[name] @ _homogeneous(body.centre_of_mass) for name, body in bodies.items()]
        places = np.stack([centre[:, :3] for centre in centres], axis=1)
        still, none = np.zeros_like(places), np.zeros(count)
        trace = Trace(np.arange(float(count)), places, turns, still, still, {}, none, none, none)
        motion = Motion(assembly, trace)
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
        book = energy_book(self.assembly, self.trace, self.joints)
        return book["gravity"] + book["spring"]

    def forces(self) -> Array:
        """Forces of all kinds on the tree's displacements, shape (n, m) [N m or N]."""
        kinematics = self.assembly.placement.tree.kinematics
        forces = self._pushes()
        for name, pushed in self._springs().items():
            if name in kinematics.columns:
                forces[:, kinematics.columns[name]] += pushed
            else:
                forces += self._from_closure(name, pushed)
        return forces

    def inertia(self) -> Array:
        """Generalized inertia of the first pose, shape (m, m) [kg m2, kg m or kg]."""
        kinematics = self.assembly.placement.tree.kinematics
        twists = kinematics.twists(self.values[0])
        total = np.zeros((kinematics.size, kinematics.size))
        for k, (name, body) in enumerate(self.assembly.figure.bodies.items()):
            moved = twists * kinematics.moves[name][:, None]
            speeds = moved[:, 3:] + np.cross(moved[:, :3], self.trace.positions[0, k])
            turned = moved[:, :3] @ self.trace.rotations[0, k]
            assert body.mass is not None
            assert body.inertia is not None
            total += body.mass * speeds @ speeds.T + (turned * np.asarray(body.inertia)) @ turned.T
        return total

    def _pushes(self) -> Array:
        """Gravity and loads on the tree's displacements, shape (n, m)."""
        kinematics = self.assembly.placement.tree.kinematics
        twists = kinematics.twists(self.values)
        wrenches = {name: np.zeros((len(self.values), 6)) for name in self.assembly.figure.bodies}
        gravity = np.asarray(self.assembly.plan.gravity)
        for k, (name, body) in enumerate(self.assembly.figure.bodies.items()):
            assert body.mass is not None
            _act(wrenches[name], body.mass * gravity, self.trace.positions[:, k])
        for load, *_ in self.assembly.loads:
            self._load(load, wrenches[load.site.segment])
        forces = np.zeros_like(self.values)
        for name, wrench in wrenches.items():
            forces += (twists @ wrench[..., None])[..., 0] * kinematics.moves[name]
        return forces

    def _load(self, load: TimedLoad, wrench: Array) -> None:
        """Add a load as it is at the start of the plan."""
        value = load.at(self.assembly.plan.start)
        pose = self.poses[load.site.segment]
        if load.kind.is_local:
            value = pose[:, :3, :3] @ value
        if load.kind in (LoadKind.GLOBAL_FORCE, LoadKind.LOCAL_FORCE):
            site = self.assembly.figure.site(load.site).pose_in_segment
            _act(wrench, value, (pose @ site)[:, :3, 3])
        else:
            wrench[:, :3] += value

    def _springs(self) -> dict[str, Array]:
        """Elastic forces on the displacements of each joint that has any, shape (n, dof)."""
        chains = self.assembly.placement.tree.chains
        joining = self.assembly.plan.joining or self.assembly.spring_set.joining
        forces: dict[str, Array] = {}
        for name, connectors in self.assembly.springs.items():
            moved = self.joints[name]
            forces[name] = np.zeros_like(moved.displacements)
            for one in connectors:
                if one.kind == "ball":
                    torque = elastic_torque(joining, one.springs, moved.rotation_vectors)
                    forces[name] += self._about_axes(name, torque)
                    continue
                along = moved.displacements[:, one.place]
                for spring in one.springs:
                    forces[name][:, one.place] += total_torque(spring.elastic, along)
        turned = turned_joints(self.assembly, self.joints)
        for one in self.assembly.coupled:
            for name, torque in coupled_torques(one.spring, chains, turned).items():
                if torque.ndim == 1:
                    forces[name][:, chains[name].turns[0]] += torque
                else:
                    forces[name] += self._about_axes(name, torque)
        return forces

    def _about_axes(self, name: str, torque: Array) -> Array:
        """A torque (n, 3) in the half-way frame as forces on the displacements, shape (n, dof)."""
        moved = self.joints[name]
        half = matrix_from_rotation_vector(0.5 * moved.rotation_vectors)
        axes = self.assembly.placement.tree.chains[name].twists(moved.displacements)[..., :3]
        return np.asarray((axes @ (half @ torque[..., None]))[..., 0])

    def _from_closure(self, name: str, pushed: Array) -> Array:
        """Forces on the displacements of a closing joint as forces on the tree's, shape (n, m)."""
        tree, joint = self.assembly.placement.tree, self.assembly.figure.joints[name]
        forces = np.zeros_like(self.values)
        for k, placement in enumerate(self.placements()):
            motion = relative_motion_map(placement, motion_maps(placement), joint)
            columns = tree.chains[name].twists(self.joints[name].displacements[k])
            columns[:, 3:] += np.cross(columns[:, :3], self.joints[name].between[k, :3, 3])
            forces[k] = (np.linalg.pinv(columns.T) @ motion).T @ pushed[k]
        return forces

    def placements(self) -> list[Placement]:
        """Each pose by itself."""
        tree = self.assembly.placement.tree
        return [
            place(tree, {name: moved.displacements[k] for name, moved in self.joints.items()})
            for k in range(len(self.values))
        ]


def _homogeneous(point: Array | None) -> Array:
    assert point is not None
    return np.append(point, 1.0)


def _act(wrench: Array, force: Array, point: Array) -> None:
    """Add a force at points (n, 3) to wrenches (n, 6): moment about the origin, force."""
    wrench[:, :3] += np.cross(point, force)
    wrench[:, 3:] += force
