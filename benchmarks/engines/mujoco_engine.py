"""MuJoCo: minimal coordinates; its own integrators, springs of its own or by its callback.

On a floor it has its own contact.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.outside import Clock, Fall, Landing
from benchmarks.passive_law import CurveLaw, PassiveLaw, RadialLaw
from benchmarks.tree import GRAVITY, TreeModel, quaternion
from generator.rotations import Array

NAME = "MuJoCo"
VERSION = mujoco.__version__

SPLIT = 64
"""Steps in place of one that crosses the edge of a dead zone."""


LANDING_INTEGRATOR = "implicitfast"
"""Integrator of falls on a floor. Its contact forces are those at the start of a step."""


@dataclass(frozen=True)
class Floor:
    """A plane y = 0 that the links touch; no link touches another.

    Friction is of the elliptic cone, Coulomb's.

    Attributes:
        shapes: by segment, in its frame: points whose convex hull touches, shape (n, 3), or centres
            and radii of spheres, shape (n, 4) [m].
        time_constant: of MuJoCo's `solref` [s]; the smaller the stiffer.
        friction: coefficient.
    """

    shapes: Mapping[str, Array]
    time_constant: float = 0.02
    friction: float = 0.6

    def add_plane(self, root: ElementTree.Element, world: ElementTree.Element) -> None:
        """Add the plane and what holds for all contacts."""
        default = ElementTree.SubElement(ElementTree.SubElement(root, "default"), "geom")
        default.attrib.update(
            friction=f"{self.friction!r} 0 0", solref=f"{self.time_constant!r} 1", condim="3"
        )
        up = {"pos": "0 0 0", "zaxis": "0 1 0"}
        ElementTree.SubElement(
            world, "geom", type="plane", size="0 0 1", contype="1", conaffinity="0", **up
        )

    def add_shapes(
        self, root: ElementTree.Element, body: ElementTree.Element, segment: str, pose: Array
    ) -> None:
        """Add the shapes of a segment, whose pose in its body is given."""
        if segment not in self.shapes:
            return
        points = self.shapes[segment]
        centres = points[:, :3] @ pose[:3, :3].T + pose[:3, 3]
        touching = {"contype": "0", "conaffinity": "1"}
        if points.shape[1] == 3:
            asset = root.find("asset")
            if asset is None:
                asset = ElementTree.SubElement(root, "asset")
            ElementTree.SubElement(asset, "mesh", name=segment, vertex=_text(centres.ravel()))
            ElementTree.SubElement(body, "geom", type="mesh", mesh=segment, **touching)
            return
        for centre, radius in zip(centres, points[:, 3].tolist(), strict=True):
            ElementTree.SubElement(
                body, "geom", type="sphere", pos=_text(centre), size=repr(radius), **touching
            )


@dataclass(frozen=True)
class _Places:
    """Indices of the coordinates of spherical and revolute joints in MuJoCo's."""

    ball_q: Array
    ball_v: Array
    hinge_q: Array
    hinge_v: Array


class MuJoCo:
    """A tree in MuJoCo. Its bodies' axes are those of their joints."""

    def __init__(
        self, tree: TreeModel, native: RadialLaw | None = None, floor: Floor | None = None
    ) -> None:
        """Build it; with `native` all joints have MuJoCo's own polynomial springs."""
        root = ElementTree.Element("mujoco")
        ElementTree.SubElement(root, "compiler", angle="radian", autolimits="false")
        option = ElementTree.SubElement(root, "option", gravity=f"0 {-GRAVITY!r} 0")
        option.set("cone", "elliptic")
        contact = "disable" if floor is None else "enable"
        ElementTree.SubElement(option, "flag", contact=contact, energy="enable")
        bodies = {-1: ElementTree.SubElement(root, "worldbody")}
        if floor is not None:
            floor.add_plane(root, bodies[-1])
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
            if floor is not None:
                floor.add_shapes(root, body, link.name, turned)
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
        self._floor = floor
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
        model = self.model
        model.opt.timestep = step
        model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        # Energies cost a tenth of a step; without frames nobody reads them.
        energies = int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        model.opt.enableflags = 0 if frame is None else energies
        data = self.start()
        frames = 1 if frame is None else round(stop / frame)
        steps = round(stop / step / frames)
        states, book = [self.tree.start], []
        if law is not None:
            mujoco.set_mjcb_passive(self._passive(law))
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

    def land(self, stop: float, step: float, law: PassiveLaw, velocity: Array) -> Landing:
        """The motion onto the floor, from where the lowest shape touches it.

        `velocity` [m/s] is that of the free root's joint frame in addition to its spin.
        """
        model, floor = self.model, self._floor
        assert floor is not None
        model.opt.timestep = step
        model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{LANDING_INTEGRATOR.upper()}")
        model.opt.enableflags = 0
        data = self.start()
        free = next(link for link in self.tree.links if link.is_free)
        places, rates = (getattr(model.joint(free.joint), key)[0] for key in ("qposadr", "dofadr"))
        data.qpos[places + 1] -= self._lowest(data, floor)
        data.qvel[rates : rates + 3] = velocity
        names = [model.body(k).name for k in range(model.nbody)]
        owner = model.geom_bodyid
        steps = round(stop / step)
        centres, forces = np.zeros((steps, 3)), np.zeros((steps, model.nbody))
        mujoco.set_mjcb_passive(self._passive(law))
        try:
            for k in range(steps):
                # Forces and places are then those at the start of the step.
                mujoco.mj_step(model, data)
                centres[k] = data.subtree_com[0]
                rows = data.contact.efc_address
                touched = rows >= 0
                bodies = owner[data.contact.geom[touched]].max(axis=1)
                np.add.at(forces[k], bodies, data.efc_force[rows[touched]])
        finally:
            mujoco.set_mjcb_passive(None)
        if any(data.warning.number):
            raise RuntimeError("MuJoCo's fall became unstable")
        by_segment = {name: forces[:, k] for k, name in enumerate(names) if name in floor.shapes}
        made = self.tree.rotations(self._state(data)[None])
        rotations = {name: turns[0] for name, turns in made.items()}
        return Landing(step * np.arange(steps), centres, by_segment, rotations)

    def _lowest(self, data: Any, floor: Floor) -> float:
        """Height of the lowest point of the shapes [m]."""
        mujoco.mj_kinematics(self.model, data)
        heights: list[float] = []
        for link in self.tree.links:
            if link.name in floor.shapes:
                points = floor.shapes[link.name]
                body = data.body(link.name)
                pose = np.linalg.inv(link.in_tip)
                placed = points[:, :3] @ pose[:3, :3].T + pose[:3, 3]
                up = placed @ body.xmat.reshape(3, 3)[1] + body.xpos[1]
                heights.append(float(np.min(up - np.sum(points[:, 3:], axis=1))))
        return min(heights)

    def _passive(self, law: PassiveLaw) -> Callable[[Any, Any], None]:
        """The callback that adds the torques of a law."""
        at = self._places

        def add(_: Any, now: Any) -> None:
            torques = law.torques(
                now.qpos[at.ball_q],
                now.qpos[at.hinge_q],
                now.qvel[at.ball_v],
                now.qvel[at.hinge_v],
            )
            now.qfrc_passive[at.ball_v] += torques[0]
            now.qfrc_passive[at.hinge_v] += torques[1]

        return add

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
