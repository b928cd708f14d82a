"""Drake on a floor: its discrete solver with point contact of spheres.

A ball is a roll-pitch-yaw joint, which is singular at a pitch of 90 deg. Before it gets there the
joint's frame in the base is turned, so that roll, pitch and yaw begin at zero again.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import (
    AddContactMaterial,
    CollisionFilterDeclaration,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiscreteContactApproximation,
)
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from scipy.spatial.transform import Rotation

from benchmarks.outside import Landing
from benchmarks.passive_law import PassiveLaw
from benchmarks.tree import GRAVITY, Link, TreeModel, quaternion
from generator.rotations import Array

LARGEST_PITCH = 1.0
"""Pitch of a ball at which its frame is turned [rad]."""

RIGID = 1e12
"""Stiffness of the floor [N/m], beside which that of the spheres counts."""


class DrakeOnFloor:
    """A tree with a free root above a plane y = 0 that its spheres touch."""

    def __init__(
        self,
        tree: TreeModel,
        spheres: Mapping[str, Array],
        stiffness: float,
        damping: float,
        friction: float,
        step: float,
    ) -> None:
        """Build it.

        Args:
            tree: what falls.
            spheres: centres and radii by segment, shape (n, 4) [m].
            stiffness: of a sphere [N/m].
            damping: of Hunt and Crossley [s/m].
            friction: coefficient.
            step: [s].
        """
        self.tree, self._spheres, self._step = tree, spheres, step
        builder = DiagramBuilder()
        plant, scene = AddMultibodyPlantSceneGraph(builder, step)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
        plant.mutable_gravity_field().set_gravity_vector([0.0, -GRAVITY, 0.0])
        bodies: list[Any] = []
        joints: dict[str, Any] = {}
        self._frames: dict[str, Any] = {}
        geometries: list[Any] = []
        for link in tree.links:
            inertia = SpatialInertia.MakeFromCentralInertia(
                link.mass, link.centre, RotationalInertia(*link.inertia)
            )
            body = plant.AddRigidBody(link.name, inertia)
            base = plant.world_body() if link.base < 0 else bodies[link.base]
            frames = [
                plant.AddFrame(
                    FixedOffsetFrame(f"{link.joint}_{k}", one.body_frame(), RigidTransform(pose))
                )
                for k, (one, pose) in enumerate(((base, link.in_base), (body, link.in_tip)))
            ]
            joints[link.joint] = plant.AddJoint(_joint(link, frames))
            self._frames[link.joint] = frames[0]
            bodies.append(body)
            for number, (*centre, radius) in enumerate(spheres.get(link.name, ())):
                geometries.append(
                    plant.RegisterCollisionGeometry(
                        body,
                        RigidTransform(np.array(centre)),
                        Sphere(radius),
                        f"{link.name}_{number}",
                        _material(stiffness, damping, friction),
                    )
                )
        up = Rotation.from_euler("x", -90.0, degrees=True).as_matrix()
        pose = np.eye(4)
        pose[:3, :3] = up
        plant.RegisterCollisionGeometry(
            plant.world_body(),
            RigidTransform(pose),
            HalfSpace(),
            "floor",
            _material(RIGID, damping, friction),
        )
        scene.collision_filter_manager().Apply(
            CollisionFilterDeclaration().ExcludeWithin(GeometrySet(geometries))
        )
        plant.Finalize()
        self._plant, self._joints, self._bodies = plant, joints, bodies
        self._diagram = builder.Build()

    def land(self, stop: float, law: PassiveLaw, velocity: Array) -> Landing:
        """The motion onto the floor, from where the lowest sphere touches it.

        `velocity` [m/s] is that of all segments in addition to their spins.
        """
        plant, tree = self._plant, self.tree
        simulator = Simulator(self._diagram)
        context = simulator.get_mutable_context()
        own = plant.GetMyMutableContextFromRoot(context)
        turned = {link.joint: link.in_base[:3, :3] for link in tree.balls}
        self._set_start(own, velocity)
        simulator.Initialize()
        port, results = (
            plant.get_applied_generalized_force_input_port(),
            plant.get_contact_results_output_port(),
        )
        steps = round(stop / self._step)
        centres = np.zeros((steps, 3))
        forces = {link.name: np.zeros(steps) for link in tree.links if link.name in self._spheres}
        names = {int(body.index()): body.name() for body in self._bodies}
        for k in range(steps):
            self._turn_frames(own, turned)
            port.FixValue(own, self._torques(own, law, turned))
            centres[k] = plant.CalcCenterOfMassPositionInWorld(own)
            touched = results.Eval(own)
            for number in range(touched.num_point_pair_contacts()):
                pair = touched.point_pair_contact_info(number)
                of = names.get(int(pair.bodyA_index())) or names[int(pair.bodyB_index())]
                forces[of][k] += abs(pair.contact_force()[1])
            simulator.AdvanceTo((k + 1) * self._step)
        state = self._state(own, turned)
        made = self.tree.rotations(np.concatenate([part.ravel() for part in state])[None])
        rotations = {name: turns[0] for name, turns in made.items()}
        return Landing(self._step * np.arange(steps), centres, forces, rotations)

    def _set_start(self, own: Any, velocity: Array) -> None:
        plant, tree = self._plant, self.tree
        q, angles, spins, rates = tree.parts(tree.start)
        for link, four, spin in zip(tree.balls, q, spins, strict=True):
            joint = self._joints[link.joint]
            turn = Rotation.from_quat(four[[1, 2, 3, 0]])
            if link.is_free:
                joint.SetQuaternion(own, Quaternion(four))
                joint.SetTranslation(own, np.zeros(3))
                joint.set_angular_velocity(own, turn.apply(spin))
                joint.set_translational_velocity(own, velocity)
            else:
                joint.set_angles(own, turn.as_euler("xyz"))
                joint.set_angular_velocity(own, turn.apply(spin))
        for link, angle, rate in zip(tree.hinges, angles, rates, strict=True):
            self._joints[link.joint].set_angle(own, angle)
            self._joints[link.joint].set_angular_rate(own, rate)
        heights = [
            float(np.min((pose[:3, :3] @ rows[:, :3].T)[1] + pose[1, 3] - rows[:, 3]))
            for name, rows in self._spheres.items()
            for pose in [plant.GetBodyByName(name).EvalPoseInWorld(own).GetAsMatrix4()]
        ]
        free = next(link for link in tree.links if link.is_free)
        self._joints[free.joint].SetTranslation(own, np.array([0.0, -min(heights), 0.0]))

    def _turn_frames(self, own: Any, turned: dict[str, Array]) -> None:
        """Turn the frames of balls that come near a pitch of 90 deg."""
        for link in self.tree.balls:
            joint = self._joints[link.joint]
            if link.is_free or abs(joint.get_angles(own)[1]) < LARGEST_PITCH:
                continue
            turn = self._turn(own, link)
            spin = joint.get_angular_velocity(own)
            turned[link.joint] = turned[link.joint] @ turn
            pose = link.in_base.copy()
            pose[:3, :3] = turned[link.joint]
            self._frames[link.joint].SetPoseInParentFrame(own, RigidTransform(pose))
            joint.set_angles(own, np.zeros(3))
            joint.set_angular_velocity(own, turn.T @ spin)

    def _state(self, own: Any, turned: Mapping[str, Array]) -> tuple[Array, Array, Array, Array]:
        """Quaternions, angles, spins in the tips and rates, as `TreeModel.parts`.

        Those of the free root are zero: no law acts on it.
        """
        quaternions, spins = [], []
        for link in self.tree.balls:
            joint = self._joints[link.joint]
            if link.is_free:
                quaternions.append(np.array([1.0, 0.0, 0.0, 0.0]))
                spins.append(np.zeros(3))
                continue
            turn = self._turn(own, link)
            whole = link.in_base[:3, :3].T @ turned[link.joint] @ turn
            quaternions.append(quaternion(whole))
            spins.append(turn.T @ joint.get_angular_velocity(own))
        joints = [self._joints[link.joint] for link in self.tree.hinges]
        angles = np.array([joint.get_angle(own) for joint in joints])
        rates = np.array([joint.get_angular_rate(own) for joint in joints])
        return np.array(quaternions), angles, np.array(spins), rates

    def _torques(self, own: Any, law: PassiveLaw, turned: Mapping[str, Array]) -> Array:
        """Generalized forces of a law; of a ball in the axes of its frame in the base."""
        balls, hinges = law.torques(*self._state(own, turned))
        force = np.zeros(self._plant.num_velocities())
        for link, torque in zip(self.tree.balls, balls, strict=True):
            if not link.is_free:
                at = self._joints[link.joint].velocity_start()
                force[at : at + 3] = self._turn(own, link) @ torque
        for link, torque in zip(self.tree.hinges, hinges, strict=True):
            force[self._joints[link.joint].velocity_start()] = torque
        return force

    def _turn(self, own: Any, link: Link) -> Array:
        """Rotation of a ball's tip in its frame in the base, shape (3, 3)."""
        angles = self._joints[link.joint].get_angles(own)
        return Rotation.from_euler("xyz", angles).as_matrix()


def _joint(link: Link, frames: list[Any]) -> Any:
    if link.is_free:
        return QuaternionFloatingJoint(link.joint, *frames)
    if link.axis is None:
        return BallRpyJoint(link.joint, *frames)
    return RevoluteJoint(link.joint, *frames, link.axis)


def _material(stiffness: float, damping: float, friction: float) -> ProximityProperties:
    made = ProximityProperties()
    AddContactMaterial(
        properties=made,
        dissipation=damping,
        point_stiffness=stiffness,
        friction=CoulombFriction(friction, friction),
    )
    return made
