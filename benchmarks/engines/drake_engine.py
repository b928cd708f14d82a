"""Drake: a multibody plant with roll-pitch-yaw balls, and its own integrator."""

from importlib.metadata import version
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    RevoluteJoint,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.symbolic import Expression, Variable, atan2, cos, sin, sqrt
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import SymbolicVectorSystem
from scipy.spatial.transform import Rotation

from benchmarks.outside import Clock, Fall
from benchmarks.passive_law import RadialLaw
from benchmarks.tree import GRAVITY, TreeModel
from generator.rotations import Array

NAME = "Drake"
VERSION = version("drake")


class Drake:
    """A tree in Drake. A ball's velocities are its angular velocity in the base."""

    def __init__(self, tree: TreeModel, native: RadialLaw | None = None) -> None:
        """Build it; with `native` all joints have springs as symbolic expressions."""
        self.tree = tree
        builder = DiagramBuilder()
        plant = builder.AddSystem(MultibodyPlant(0.0))
        plant.mutable_gravity_field().set_gravity_vector([0.0, -GRAVITY, 0.0])
        bodies: list[Any] = []
        viscous = 0.0 if native is None else native.viscous
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
            if link.axis is None:
                joint = BallRpyJoint(link.joint, *frames, viscous)
            else:
                joint = RevoluteJoint(link.joint, *frames, link.axis, viscous)
            plant.AddJoint(joint)
            bodies.append(body)
        plant.Finalize()
        at = {link.joint: plant.GetJointByName(link.joint) for link in tree.links}
        balls = [at[link.joint] for link in tree.balls]
        hinges = [at[link.joint] for link in tree.hinges]
        self._ball_q = np.array([j.position_start() + np.arange(3) for j in balls])
        self._ball_v = np.array([j.velocity_start() + np.arange(3) for j in balls])
        self._hinge_q = np.array([j.position_start() for j in hinges], dtype=int)
        self._hinge_v = np.array([j.velocity_start() for j in hinges], dtype=int)
        if native is not None:
            springs = builder.AddSystem(self._springs(plant.num_positions(), native))
            builder.Connect(plant.get_state_output_port(), springs.get_input_port())
            builder.Connect(
                springs.get_output_port(), plant.get_applied_generalized_force_input_port()
            )
        self._plant = plant
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._own = plant.GetMyContextFromRoot(self._context)
        self._q, self._v, self._force = (np.zeros(plant.num_positions()) for _ in range(3))

    def _springs(self, count: int, law: RadialLaw) -> SymbolicVectorSystem:
        """(linear + cubic a^2) r of all joints as expressions of the state."""
        state = [Variable(f"x{k}") for k in range(2 * count)]
        forces = [Expression(0.0)] * count
        for places in self._ball_q:
            r = _rotation_vector([state[k] for k in places])
            size = -(law.linear + law.cubic * sum(x * x for x in r))
            for k, x in zip(places, r, strict=True):
                forces[k] = size * x
        for k in self._hinge_q:
            forces[k] = -(law.linear + law.cubic * state[k] * state[k]) * state[k]
        # Without any dynamics of its own the system fails an assertion of Drake's.
        idle = Variable("idle")
        return SymbolicVectorSystem(
            state=[idle], input=state, dynamics=[Expression(0.0)], output=forces
        )

    def _set(self, quaternions: Array, angles: Array, spins: Array, rates: Array) -> Array:
        """Put a state; returns the rotations of the balls, shape (b, 3, 3)."""
        turns = Rotation.from_quat(quaternions[:, [1, 2, 3, 0]])
        matrices = turns.as_matrix()
        self._q[self._ball_q], self._q[self._hinge_q] = turns.as_euler("xyz"), angles
        self._v[self._ball_v] = np.einsum("bij,bj->bi", matrices, spins)
        self._v[self._hinge_v] = rates
        self._plant.SetPositions(self._own, self._q)
        self._plant.SetVelocities(self._own, self._v)
        return matrices

    def accelerations(
        self,
        quaternions: Array,
        angles: Array,
        spins: Array,
        rates: Array,
        torques: tuple[Array, Array],
    ) -> tuple[Array, Array]:
        """See `outside.Accelerator`."""
        matrices = self._set(quaternions, angles, spins, rates)
        self._force[self._ball_v] = np.einsum("bij,bj->bi", matrices, torques[0])
        self._force[self._hinge_v] = torques[1]
        port = self._plant.get_applied_generalized_force_input_port()
        port.FixValue(self._own, self._force)
        gained = self._plant.EvalTimeDerivatives(self._own).CopyToVector()[self._q.size :]
        return np.einsum("bji,bj->bi", matrices, gained[self._ball_v]), gained[self._hinge_v]

    def book(
        self, quaternions: Array, angles: Array, spins: Array, rates: Array
    ) -> tuple[Array, float]:
        """See `outside.Accelerator`."""
        self._set(quaternions, angles, spins, rates)
        plant, own = self._plant, self._own
        centre = plant.CalcCenterOfMassPositionInWorld(own)
        return centre, plant.CalcKineticEnergy(own) + plant.CalcPotentialEnergy(own)

    def fall(self, stop: float, accuracy: float) -> Fall:
        """The motion by Drake's default, Runge-Kutta 3 with error control; the last state only."""
        self._set(*self.tree.parts(self.tree.start))
        context = self._context.Clone()
        simulator = Simulator(self._diagram, context)
        config = SimulatorConfig(accuracy=accuracy)
        if config.integration_scheme != "runge_kutta3" or not config.use_error_control:
            raise RuntimeError(f"Drake's default integrator is now {config.integration_scheme}")
        ApplySimulatorConfig(config, simulator)
        simulator.Initialize()
        with Clock() as clock:
            simulator.AdvanceTo(stop)
        own = self._plant.GetMyContextFromRoot(simulator.get_context())
        q = self._plant.GetPositions(own)
        turns = Rotation.from_euler("xyz", q[self._ball_q]).as_quat()[:, [3, 0, 1, 2]]
        last = np.concatenate([turns.ravel(), q[self._hinge_q], np.zeros(self._v.size)])
        states = np.array([self.tree.start, last])
        rotations = self.tree.rotations(states)
        return Fall(rotations, np.zeros(0), np.zeros(0), clock.wall, cpu=clock.cpu)


def _rotation_vector(rpy: Any) -> list[Any]:
    """Of the turn Rz(y) Ry(p) Rx(r), by its quaternion; not at zero, where it divides by zero."""
    (cr, sr), (cp, sp), (cy, sy) = ((cos(x / 2.0), sin(x / 2.0)) for x in rpy)
    w = cr * cp * cy + sr * sp * sy
    v = (sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy)
    s = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    factor = 2.0 * atan2(s, w) / s
    return [factor * x for x in v]
