"""OpenSim: Simbody's accelerations; its own integrator where it can hold the springs itself."""

from typing import Any

import numpy as np
import opensim as osim
from scipy.spatial.transform import Rotation

from benchmarks.outside import Clock, Fall
from benchmarks.passive_law import RadialLaw
from benchmarks.tree import GRAVITY, Link, TreeModel
from generator.rotations import Array

NAME = "OpenSim"
VERSION = osim.GetVersion()

osim.Logger.setLevelString("Error")


class OpenSim:
    """A tree in OpenSim, on ball and pin joints.

    A ball's speeds are its angular velocity in the base. Without springs of its own every
    coordinate has an actuator, by which torques are given to it.
    """

    def __init__(self, tree: TreeModel, native: RadialLaw | None = None) -> None:
        """Build it; with `native` all joints have springs of OpenSim's own."""
        self.tree = tree
        model = osim.Model()
        model.setGravity(osim.Vec3(0.0, -GRAVITY, 0.0))
        bodies: list[Any] = []
        joints: list[Any] = []
        for link in tree.links:
            body = osim.Body(link.name, link.mass, _vec(link.centre), osim.Inertia(*link.inertia))
            model.addBody(body)
            base = model.getGround() if link.base < 0 else bodies[link.base]
            turn = np.eye(3) if link.axis is None else _z_along(link.axis)
            kind = osim.BallJoint if link.axis is None else osim.PinJoint
            joint = kind(
                link.joint, base, *_placed(link.in_base, turn), body, *_placed(link.in_tip, turn)
            )
            model.addJoint(joint)
            bodies.append(body)
            joints.append(joint)
        self._joints = {link.joint: joint for link, joint in zip(tree.links, joints, strict=True)}
        for link, joint in zip(tree.links, joints, strict=True):
            for k in range(joint.numCoordinates()):
                coordinate = joint.get_coordinates(k)
                coordinate.setName(f"{link.joint}_{k}")
                if native is None:
                    actuator = osim.CoordinateActuator(coordinate.getName())
                    actuator.setName(f"{coordinate.getName()}_torque")
                    actuator.setOptimalForce(1.0)
                    _hang(model, actuator)
            if native is not None:
                _add_springs(model, link, joint, native)
        self._model = model
        self._state = model.initSystem()
        self._places()

    def _places(self) -> None:
        """Find the coordinates among the system's: OpenSim leaves their order to Simbody.

        A ball's are the angles X-Y-Z of the tip in the base.
        """
        state = self._state
        count = state.getNU()
        at_q, at_u = ({}, {})
        coordinates = self._model.getCoordinateSet()
        for k in range(coordinates.getSize()):
            coordinate = coordinates.get(k)
            state.setQ(osim.Vector(state.getNQ(), 0.0))
            state.setU(osim.Vector(count, 0.0))
            coordinate.setValue(state, 0.5, False)
            coordinate.setSpeedValue(state, 1.0)
            at_q[coordinate.getName()] = int(np.argmax(state.getQ().to_numpy()))
            at_u[coordinate.getName()] = int(np.argmax(state.getU().to_numpy()))
        balls, hinges = self.tree.balls, self.tree.hinges
        self._ball_q, self._ball_u = (
            np.array([[at[f"{b.joint}_{k}"] for k in range(3)] for b in balls]).reshape(-1, 3)
            for at in (at_q, at_u)
        )
        self._hinge_q, self._hinge_u = (
            np.array([at[f"{h.joint}_0"] for h in hinges], dtype=int) for at in (at_q, at_u)
        )
        forces = self._model.getActuators()
        names = [forces.get(k).getName() for k in range(forces.getSize())]
        self._control = np.array([at_u[n.removesuffix("_torque")] for n in names], dtype=int)
        self._q, self._u, self._force = (np.zeros(n) for n in (state.getNQ(), count, count))

    def _set(self, quaternions: Array, angles: Array, spins: Array, rates: Array) -> Array:
        """Put a state; returns the rotations of the balls, shape (b, 3, 3)."""
        turns = Rotation.from_quat(quaternions[:, [1, 2, 3, 0]])
        matrices = turns.as_matrix()
        self._q[self._ball_q] = turns.as_euler("XYZ")
        self._q[self._hinge_q] = angles
        self._u[self._ball_u] = np.einsum("bij,bj->bi", matrices, spins)
        self._u[self._hinge_u] = rates
        self._state.setQ(osim.Vector.createFromMat(self._q))
        self._state.setU(osim.Vector.createFromMat(self._u))
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
        self._force[self._ball_u] = np.einsum("bij,bj->bi", matrices, torques[0])
        self._force[self._hinge_u] = torques[1]
        self._model.realizeVelocity(self._state)
        self._model.setControls(self._state, osim.Vector.createFromMat(self._force[self._control]))
        self._model.realizeAcceleration(self._state)
        gained = self._state.getUDot().to_numpy()
        return np.einsum("bji,bj->bi", matrices, gained[self._ball_u]), gained[self._hinge_u]

    def book(
        self, quaternions: Array, angles: Array, spins: Array, rates: Array
    ) -> tuple[Array, float]:
        """See `outside.Accelerator`."""
        self._set(quaternions, angles, spins, rates)
        model, state = self._model, self._state
        model.realizeVelocity(state)
        centre = model.calcMassCenterPosition(state).to_numpy()
        return centre, model.calcKineticEnergy(state) + model.calcPotentialEnergy(state)

    def fall(self, stop: float, accuracy: float | None) -> Fall:
        """The motion by OpenSim's own manager, by its default method; the last state only.

        An accuracy of None leaves the manager's own.
        """
        model = self._model
        state = model.initSystem()
        self._state = state
        self._set(*self.tree.parts(self.tree.start))
        manager = osim.Manager(model)
        if accuracy is not None:
            manager.setIntegratorAccuracy(accuracy)
        manager.setPerformAnalyses(False)
        manager.setWriteToStorage(False)
        manager.initialize(state)
        with Clock() as clock:
            end = manager.integrate(stop)
        q = end.getQ().to_numpy()
        turns = Rotation.from_euler("XYZ", q[self._ball_q]).as_quat()[:, [3, 0, 1, 2]]
        last = np.concatenate([turns.ravel(), q[self._hinge_q], np.zeros(end.getNU())])
        states = np.array([self.tree.start, last])
        rotations = self.tree.rotations(states)
        return Fall(rotations, np.zeros(0), np.zeros(0), clock.wall, cpu=clock.cpu)


def _add_springs(model: Any, link: Link, joint: Any, law: RadialLaw) -> None:
    """(linear + cubic a^2) r as a bushing of expressions, damping as a force on the speeds.

    A bushing's expressions are the moments that its angles X-Y-Z feel: minus the slopes of the
    energy by them, found from w = cos(a/2).
    """
    for k in range(joint.numCoordinates()):
        name = joint.get_coordinates(k).getName()
        if link.axis is None:
            damper = osim.SpringGeneralizedForce(name)
            damper.setStiffness(0.0)
            damper.setRestLength(0.0)
            damper.setViscosity(law.viscous)
        else:
            expression = f"-({law.linear!r}+{law.cubic!r}*q*q)*q-{law.viscous!r}*qdot"
            damper = osim.ExpressionBasedCoordinateForce(name, expression)
        damper.setName(f"{name}_passive")
        _hang(model, damper)
    if link.axis is not None:
        return
    c, s = ([f"{f}(theta_{x}/2)" for x in "xyz"] for f in ("cos", "sin"))
    w = f"({c[0]}*{c[1]}*{c[2]}-{s[0]}*{s[1]}*{s[2]})"
    slopes = [
        f"({s[0]}*{c[1]}*{c[2]}+{c[0]}*{s[1]}*{s[2]})",
        f"({c[0]}*{s[1]}*{c[2]}+{s[0]}*{c[1]}*{s[2]})",
        f"({c[0]}*{c[1]}*{s[2]}+{s[0]}*{s[1]}*{c[2]})",
    ]
    # a by the slope of a: -2/sqrt(1-w^2) times that of w, which is -slope/2.
    angle = f"2*acos(min({w},1-1e-12))"
    size = f"({law.linear!r}+{law.cubic!r}*a*a)*a/sqrt(1-w*w)"
    bushing = osim.ExpressionBasedBushingForce()
    bushing.setName(f"{link.joint}_bushing")
    frames = joint.getParentFrame(), joint.getChildFrame()
    bushing.connectSocket_frame1(frames[0])
    bushing.connectSocket_frame2(frames[1])
    for axis, slope in zip("xyz", slopes, strict=True):
        put = getattr(bushing, f"setM{axis}Expression")
        put(f"{size}*{slope};a={angle};w={w}".replace(" ", ""))
    _hang(model, bushing)


def _hang(model: Any, force: Any) -> None:
    """Add a force; `Model.addForce` sets the whole model up anew each time."""
    force._markAdopted()
    model.updForceSet().adoptAndAppend(force)


def _z_along(axis: Array) -> Array:
    """A rotation matrix whose third column is an axis."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(axis, first), axis])


def _placed(pose: Array, turn: Array) -> tuple[Any, Any]:
    angles = Rotation.from_matrix(pose[:3, :3] @ turn).as_euler("XYZ")
    return _vec(pose[:3, 3]), _vec(angles)


def _vec(numbers: Array) -> Any:
    return osim.Vec3(*map(float, numbers))
