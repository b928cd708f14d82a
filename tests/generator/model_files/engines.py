"""Written models in the programs that they are for: poses, coordinates and passive motion."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pytest

from generator.figure import Figure
from generator.losses import Losses
from generator.model_files.mjcf.write import format_mjcf
from generator.model_files.opensim import write as osim
from generator.model_files.urdf.write import format_urdf
from generator.rotations import Array, pose_matrix
from springs import SpringSet
from tests.generator.model_files.model_cases import FRAME, STOP
from tests.generator.model_files.pinocchio_fall import runge_kutta_step

Displacements = Mapping[str, Sequence[float]]
Poses = dict[str, Array]


class Engine(Protocol):
    """A program with a model of a figure, in the pose of the file."""

    losses: Losses

    def __init__(self, of: Figure, springs: SpringSet, folder: Path) -> None: ...

    def set(self, values: Displacements) -> None: ...

    def poses(self) -> Poses:
        """Of the bodies in the figure's world."""
        ...

    def reach(self, time: float) -> None:
        """Integrate up to a time [s]."""
        ...


def moved(engine: Engine, stop: float = STOP) -> Poses:
    """The motion from the pose of the file, shape (frames, 4, 4)."""
    rows = [engine.poses()]
    for k in range(1, round(stop / FRAME) + 1):
        engine.reach(k * FRAME)
        rows.append(engine.poses())
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


class MuJoCo:
    """MuJoCo, with the options of the file."""

    def __init__(self, of: Figure, springs: SpringSet, _: Path | None = None) -> None:
        self.api: Any = pytest.importorskip("mujoco")
        text, self.losses = format_mjcf(of, springs)
        self.figure = of
        self.model = self.api.MjModel.from_xml_string(text)
        self.data = self.api.MjData(self.model)
        self.api.mj_resetDataKeyframe(self.model, self.data, self.model.key("start").id)
        self.api.mj_forward(self.model, self.data)

    def poses(self) -> Poses:
        bodies = {n: self.data.body(n if n != "world" else "world_2") for n in self.figure.bodies}
        return {n: pose_of(body) for n, body in bodies.items()}

    def site(self, segment: str, site: str) -> Array:
        return pose_of(self.data.site(f"{segment}.{site}"))

    def reach(self, time: float) -> None:
        steps = round((time - self.data.time) / self.model.opt.timestep)
        self.api.mj_step(self.model, self.data, steps)
        self.api.mj_forward(self.model, self.data)


def pose_of(place: Any) -> Array:
    return pose_matrix(place.xmat.reshape(3, 3), place.xpos)


class OpenSim:
    """OpenSim, with an accuracy of its integrator."""

    accuracy = 1e-9

    def __init__(self, of: Figure, springs: SpringSet, folder: Path) -> None:
        self.api: Any = pytest.importorskip("opensim")
        self.api.Logger.removeFileSink()
        self.api.Logger.setLevelString("Error")
        path = folder / "figure.osim"
        self.losses = osim.format_files(of, springs, path).write()
        self.figure = of
        self.model = self.api.Model(str(path))
        self.state = self.model.initSystem()
        self.manager: Any = None

    def set(self, values: Displacements) -> None:
        for name, numbers in values.items():
            for k, number in enumerate(numbers, 1):
                coordinate = self.model.getCoordinateSet().get(f"{name}_{k}")
                coordinate.setValue(self.state, float(number), False)

    def poses(self) -> Poses:
        self.model.realizePosition(self.state)
        return {name: self.frame(f"/bodyset/{name}") for name in self.figure.bodies}

    def frame(self, path: str) -> Array:
        component = self.api.Frame.safeDownCast(self.model.getComponent(path))
        transform = component.getTransformInGround(self.state)
        turn, shift = transform.R(), transform.p()
        rows = [[turn.get(i, j) for j in range(3)] for i in range(3)]
        return pose_matrix(rows, [shift.get(i) for i in range(3)])

    def site(self, segment: str, site: str) -> Array:
        if segment in self.figure.ground:
            return self.frame(f"/ground/{segment}_{site}".replace(" ", "_"))
        return self.frame(f"/bodyset/{segment}/{site}".replace(" ", "_"))

    def reach(self, time: float) -> None:
        if self.manager is None:
            self.manager = self.api.Manager(self.model)
            self.manager.setIntegratorAccuracy(self.accuracy)
            self.manager.initialize(self.state)
        self.state = self.manager.integrate(time)


STEP = 1e-3
"""Of Pinocchio's Runge-Kutta method [s]."""

UPRIGHT = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])
"""From z up, x ahead to y up, z ahead."""


class Pinocchio:
    """Pinocchio, which has the pose in which the figure is drawn and gravity from us."""

    def __init__(self, of: Figure, springs: SpringSet, _: Path | None = None) -> None:
        self.api: Any = pytest.importorskip("pinocchio")
        text, self.losses = format_urdf(of, springs)
        self.figure = of
        self.model = self.api.buildModelFromXML(text)
        self.model.gravity.linear = np.array([0.0, 0.0, -9.81])
        self.data = self.model.createData()
        self.time, self.v = 0.0, np.zeros(self.model.nv)
        self.set({name: one.displacement for name, one in of.joints.items()})

    def joint(self, name: str, number: int) -> Any:
        """The joint of one displacement, counted from 0."""
        single = len(self.figure.joints[name].chain) == 1
        own = name if single else f"{name}_{number + 1}"
        if own in self.figure.joints and not single:
            own += "_2"
        return self.model.joints[self.model.getJointId(own)]

    def set(self, values: Displacements) -> None:
        self.q = self.api.neutral(self.model)
        for name, numbers in values.items():
            for number, value in enumerate(numbers):
                joint = self.joint(name, number)
                around = [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
                self.q[joint.idx_q : joint.idx_q + joint.nq] = around

    def poses(self) -> Poses:
        self.api.framesForwardKinematics(self.model, self.data, self.q)
        frames = {name: self.data.oMf[self.model.getFrameId(name)] for name in self.figure.bodies}
        return {name: UPRIGHT @ x.homogeneous for name, x in frames.items()}

    def reach(self, time: float) -> None:
        for _ in range(round((time - self.time) / STEP)):
            damping = self.model.damping
            self.q, self.v = runge_kutta_step(
                self.api, self.model, self.data, self.q, self.v, damping, STEP
            )
        self.time = time
