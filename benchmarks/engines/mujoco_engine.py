"""MuJoCo: minimal coordinates; its own integrators, springs of its own or by its callback."""

from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.outside import Clock, Fall
from benchmarks.passive_law import CurveLaw, PassiveLaw, RadialLaw
from benchmarks.tree import GRAVITY, TreeModel, quaternion
from generator.rotations import Array

NAME = "MuJoCo"
VERSION = mujoco.__version__

SPLIT = 64
"""Steps in place of one that crosses the edge of a dead zone."""


@dataclass(frozen=True)
class _Places:
    """Indices of the coordinates of spherical and revolute joints in MuJoCo's."""

    ball_q: Array
    ball_v: Array
    hinge_q: Array
    hinge_v: Array


class MuJoCo:
    """A tree in MuJoCo. Its bodies' axes are those of their joints."""

    def __init__(self, tree: TreeModel, native: RadialLaw | None = None) -> None:
        """Build it; with `native` all joints have MuJoCo's own polynomial springs."""
        root = ElementTree.Element("mujoco")
        ElementTree.SubElement(root, "compiler", angle="radian", autolimits="false")
        option = ElementTree.SubElement(root, "option", gravity=f"0 {-GRAVITY!r} 0")
        ElementTree.SubElement(option, "flag", contact="disable", energy="enable")
        bodies = {-1: ElementTree.SubElement(root, "worldbody")}
        in_body = {-1: np.eye(4)}
        for number, link in enumerate(tree.links):
            pose = in_body[link.base] @ link.in_base
            body = ElementTree.SubElement(
                bodies[link.base], "body", name=link.name, **_placed(pose)
            )
            turned = np.linalg.inv(link.in_tip)
            centre = turned @ np.append(link.centre, 1.0)
            ElementTree.SubElement(
                body,
                "inertial",
                mass=repr(link.mass),
                diaginertia=_text(link.inertia),
                pos=_text(centre[:3]),
                quat=_text(quaternion(turned[:3, :3])),
            )
            given = {"name": link.joint}
            if link.is_free:
                ElementTree.SubElement(body, "freejoint", **given)
                bodies[number], in_body[number] = body, turned
                continue
            if native is not None:
                given["stiffness"] = f"{native.linear!r} 0 {native.cubic!r}"
                given["damping"] = repr(native.viscous)
            if link.axis is None:
                ElementTree.SubElement(body, "joint", type="ball", **given)
            else:
                ElementTree.SubElement(body, "joint", type="hinge", axis=_text(link.axis), **given)
            bodies[number], in_body[number] = body, turned
        self.tree = tree
        self.model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, "unicode"))
        self._native = native
        at = {link.joint: self.model.joint(link.joint) for link in tree.links}
        balls = [at[link.joint] for link in tree.balls]
        hinges = [at[link.joint] for link in tree.hinges]
        # Of a free joint the place comes first.
        past = [3 * link.is_free for link in tree.balls]
        self._places = _Places(
            np.array([j.qposadr[0] + k + np.arange(4) for j, k in zip(balls, past, strict=True)]),
            np.array([j.dofadr[0] + k + np.arange(3) for j, k in zip(balls, past, strict=True)]),
            np.array([j.qposadr[0] for j in hinges], dtype=int),
            np.array([j.dofadr[0] for j in hinges], dtype=int),
        )

    def start(self) -> Any:
        """The state at the start."""
        data, at = mujoco.MjData(self.model), self._places
        q, angles, spins, rates = self.tree.parts(self.tree.start)
        data.qpos[at.ball_q], data.qpos[at.hinge_q] = q, angles
        data.qvel[at.ball_v], data.qvel[at.hinge_v] = spins, rates
        return data

    @staticmethod
    def defaults() -> tuple[str, float]:
        """Name of the integrator and time step [s] of a model that chooses neither."""
        options = mujoco.MjModel.from_xml_string("<mujoco/>").opt
        name = mujoco.mjtIntegrator(options.integrator).name.removeprefix("mjINT_")
        return name.capitalize(), float(options.timestep)

    def fall(
        self,
        stop: float,
        step: float,
        integrator: str = "RK4",
        law: PassiveLaw | None = None,
        frame: float | None = 0.02,
        split: bool = True,
    ) -> Fall:
        """The motion with a fixed step, its springs native or by the callback.

        `split` tells whether steps that cross the edge of a dead zone are cut into small ones.
        `frame` [s] is that of the result; None keeps the last state only, and no book.
        """
        model, at = self.model, self._places
        model.opt.timestep = step
        model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        # Energies cost a tenth of a step; without frames nobody reads them.
        energies = int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        model.opt.enableflags = 0 if frame is None else energies
        data = self.start()
        frames = 1 if frame is None else round(stop / frame)
        steps = round(stop / step / frames)
        states, book = [self.tree.start], []

        def passive(_: Any, now: Any) -> None:
            torques = law.torques(
                now.qpos[at.ball_q],
                now.qpos[at.hinge_q],
                now.qvel[at.ball_v],
                now.qvel[at.hinge_v],
            )
            now.qfrc_passive[at.ball_v] += torques[0]
            now.qfrc_passive[at.hinge_v] += torques[1]

        if law is not None:
            mujoco.set_mjcb_passive(passive)
        clock = Clock()
        try:
            if frame is not None:
                book.append(self._book(data, law))
            for _ in range(frames):
                with clock:
                    if split and isinstance(law, CurveLaw):
                        for _ in range(steps):
                            self._step(data, law, step)
                    else:
                        mujoco.mj_step(model, data, steps)
                states.append(self._state(data))
                if frame is not None:
                    book.append(self._book(data, law))
        finally:
            mujoco.set_mjcb_passive(None)
        centres = np.array([row[0] for row in book])
        energies = np.array([row[1] for row in book])
        rotations = self.tree.rotations(np.array(states))
        return Fall(rotations, centres, energies, clock.wall, frames * steps, clock.cpu)

    def _step(self, data: Any, law: CurveLaw, step: float) -> None:
        """One step; where it crosses the edge of a dead zone, many small ones in its place.

        An edge within a step of RK4 takes its order away.
        """
        before = data.qpos.copy(), data.qvel.copy()
        zones = self._zones(data, law)
        mujoco.mj_step(self.model, data)
        if np.array_equal(zones, self._zones(data, law)):
            return
        data.qpos, data.qvel = before
        self.model.opt.timestep = step / SPLIT
        mujoco.mj_step(self.model, data, SPLIT)
        self.model.opt.timestep = step

    def _zones(self, data: Any, law: CurveLaw) -> Array:
        return law.zones(data.qpos[self._places.ball_q], data.qpos[self._places.hinge_q])

    def _state(self, data: Any) -> Array:
        at = self._places
        return np.concatenate(
            [
                data.qpos[at.ball_q].ravel(),
                data.qpos[at.hinge_q],
                data.qvel[at.ball_v].ravel(),
                data.qvel[at.hinge_v],
            ]
        )

    def _book(self, data: Any, law: PassiveLaw | None) -> tuple[Array, float]:
        mujoco.mj_forward(self.model, data)
        total = float(data.energy[0] + data.energy[1])
        if law is not None:
            q, angles, _, _ = self.tree.parts(self._state(data))
            total += law.energy(q, angles)
        return data.subtree_com[0].copy(), total


def _placed(pose: Array) -> dict[str, str]:
    turn = Rotation.from_matrix(pose[:3, :3]).as_quat()[[3, 0, 1, 2]]
    return {"pos": _text(pose[:3, 3]), "quat": _text(turn)}


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number)) for number in numbers)
