"""The same figure in MuJoCo: an independent model to compare motions with.

What is shared with the program is the figure, as it was read, and the numbers of its springs. Tree,
kinematics, dynamics and integration are MuJoCo's; the passive law is written here a second time, in
another form. Joints are balls (three rotations), hinges (one) and, for a free root, free joints;
figures are trees without loops.

MuJoCo turns a ball by a quaternion Q: the axes of the tip, the body that hangs on the joint, are
those of the zero pose turned by Q, and the force on the joint is the torque on the tip in the tip's
own axes. With S the site in the tip, the site turns by S^T Q S; so springs are told in the tip's
axes, and nothing else needs turning.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from generator.figure import AxisKind, Figure, Joint, JointAxis, SiteRef
from generator.recording import Recording
from generator.rotations import Array, matrix_from_rotation_vector
from springs import AxisSpring, Linear, SpringSet
from tests.mujoco_law import Hung, PassiveLaw

mujoco: Any = pytest.importorskip("mujoco")

GRAVITY = (0.0, -9.81, 0.0)
SPLIT = 64
"""Steps in place of one that crosses a corner."""

Values = Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class Fall:
    """A motion as MuJoCo has it. n frames; SI units.

    Attributes:
        times: shape (n,) [s].
        joints: rotation of the child's site in the parent's, shape (n, 3, 3) each.
        rotations: of each segment in the world, shape (n, 3, 3) each.
        origins: of each segment in the world, shape (n, 3) each [m].
        kinetic: shape (n,) [J].
        potential: of gravity and springs, shape (n,) [J].
    """

    times: Array
    joints: dict[str, Array]
    rotations: dict[str, Array]
    origins: Mapping[str, Array]
    kinetic: Array
    potential: Array


class Twin:
    """A figure as a MuJoCo model."""

    def __init__(
        self,
        figure: Figure,
        springs: SpringSet,
        displacements: Values | None = None,
        velocities: Values | None = None,
        *,
        native: bool = False,
        free_root: bool = False,
    ) -> None:
        """Build the model and its start.

        Args:
            figure: a tree, held by one segment.
            springs: one law an axis, conservative.
            displacements: by joint, in place of the figure's own [rad].
            velocities: rates by joint [rad/s]; of a free root [rad/s, m/s] by its segment, whose
                start must then not be at a pole of its angles.
            native: whether MuJoCo's own linear springs stand for `springs`, which must then be
                equal about all axes of a joint and rest at zero.
            free_root: whether the joint to the ground is taken away.
        """
        self._figure = figure
        self._free_root = free_root
        self._shown = {name: joint.displacement for name, joint in figure.joints.items()}
        self._shown.update({name: tuple(v) for name, v in (displacements or {}).items()})
        self._hung: list[Hung] = []
        root = ElementTree.Element("mujoco")
        ElementTree.SubElement(root, "compiler", angle="radian", autolimits="false")
        option = ElementTree.SubElement(root, "option", integrator="RK4", gravity=_text(GRAVITY))
        ElementTree.SubElement(option, "flag", contact="disable", energy="enable")
        world = ElementTree.SubElement(root, "worldbody")
        self._hang(world, figure.root.segment, springs if native else SpringSet())
        self.model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, "unicode"))
        used = {h.joint.name: h for h in self._hung if not self._is_free(h)}
        law = SpringSet() if native else springs
        self.law = PassiveLaw(figure, self.model, used, law) if law.joints else None
        self._velocities = velocities or {}

    def _is_free(self, hung: Hung) -> bool:
        return self._free_root and hung.base.segment == self._figure.root.segment

    def _hang(self, element: ElementTree.Element, base: str, springs: SpringSet) -> None:
        """Hang on a segment's element all that its joints carry, at the zero pose."""
        done = {hung.joint.name for hung in self._hung}
        for joint in self._figure.joints.values():
            if joint.name in done or base not in (joint.parent.segment, joint.child.segment):
                continue
            forward = joint.parent.segment == base
            hung = Hung(joint, *(joint.ends if forward else joint.ends[::-1]))
            self._hung.append(hung)
            pose = (
                self._on_world(hung) @ self._site(hung.base) @ np.linalg.inv(self._site(hung.tip))
            )
            segment = self._figure.segments[hung.tip.segment]
            body = ElementTree.SubElement(
                element,
                "body",
                name=segment.name,
                pos=_text(pose[:3, 3]),
                quat=_text(_quaternion(pose[:3, :3])),
            )
            ElementTree.SubElement(
                body,
                "inertial",
                pos=_text(segment.centre_of_mass),
                mass=repr(segment.mass),
                diaginertia=_text(segment.inertia),
            )
            self._add_joint(body, hung, springs)
            self._hang(body, segment.name, springs)

    def _add_joint(self, body: ElementTree.Element, hung: Hung, springs: SpringSet) -> None:
        joint = hung.joint
        if self._is_free(hung):
            ElementTree.SubElement(body, "freejoint", name=joint.name)
            return
        tip = self._site(hung.tip)
        given: dict[str, str] = {"name": joint.name, "pos": _text(tip[:3, 3])}
        if joint.name in springs.joints:
            stiffness, damping = _isotropic(springs.joints[joint.name].axes)
            given |= {"stiffness": repr(stiffness), "damping": repr(damping)}
        if len(joint.chain) == 1:
            axis = hung.sign * tip[:3, :3] @ joint.chain[0].axis
            ElementTree.SubElement(body, "joint", type="hinge", axis=_text(axis), **given)
        else:
            assert [factor.kind for factor in joint.chain] == [AxisKind.ROTATION] * 3
            ElementTree.SubElement(body, "joint", type="ball", **given)

    def _on_world(self, hung: Hung) -> Array:
        """Pose of what MuJoCo hangs a joint on: the world, where the base is the ground."""
        if hung.base.segment != self._figure.root.segment:
            return np.eye(4)
        return np.linalg.inv(self._site(self._figure.root))

    def _site(self, ref: SiteRef) -> Array:
        return self._figure.site(ref).pose_in_segment

    def start(self) -> Any:
        """The state at the start."""
        data = mujoco.MjData(self.model)
        for hung in self._hung:
            joint = hung.joint
            item = self.model.joint(joint.name)
            q, v = int(item.qposadr[0]), int(item.dofadr[0])
            shown = self._shown[joint.name]
            rates = np.asarray(self._velocities.get(joint.name, np.zeros(len(joint.chain))))
            if self._is_free(hung):
                self._let_go(data, hung, q, v)
            elif len(joint.chain) == 1:
                data.qpos[q], data.qvel[v] = shown[0], rates[0]
            else:
                between, spin = _turned(joint.chain, shown, rates)
                site = self._site(hung.tip)[:3, :3]
                if hung.sign > 0.0:
                    turn, spin = between, between.T @ spin
                else:
                    turn, spin = between.T, -spin
                data.qpos[q : q + 4] = _quaternion(site @ turn @ site.T)
                data.qvel[v : v + 3] = site @ spin
        return data

    def _let_go(self, data: Any, hung: Hung, q: int, v: int) -> None:
        """Pose and velocity of a body that the ground no longer holds."""
        turn = np.eye(4)
        between, _ = _turned(hung.joint.chain, self._shown[hung.joint.name], np.zeros(3))
        turn[:3, :3] = between if hung.sign > 0.0 else between.T
        base = self._on_world(hung) @ self._site(hung.base)
        pose = base @ turn @ np.linalg.inv(self._site(hung.tip))
        data.qpos[q : q + 3] = pose[:3, 3]
        data.qpos[q + 3 : q + 7] = _quaternion(pose[:3, :3])
        rates = self._velocities.get(hung.tip.segment)
        if rates is not None:
            # The angles of a free root are about x, y, z of the world, x innermost.
            factors = [JointAxis(AxisKind.ROTATION, (x, y, z)) for x, y, z in np.eye(3)]
            shown = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz")
            _, spin = _turned(factors, shown, np.asarray(rates[:3]))
            data.qvel[v : v + 3] = rates[3:]
            data.qvel[v + 3 : v + 6] = pose[:3, :3].T @ spin

    def fall(self, stop: float, step: float, frame: float = 0.02) -> Fall:
        """The motion with RK4 in steps of about `step` [s], read every `frame` [s]."""
        model, data = self.model, self.start()
        count, steps = round(stop / frame), round(frame / step)
        rows: list[tuple[dict[str, Array], dict[str, Array], tuple[float, float]]] = []
        mujoco.set_mjcb_passive(self.law)
        try:
            for number in range(count + 1):
                for _ in range(steps if number else 0):
                    self._step(data, frame / steps)
                mujoco.mj_forward(model, data)
                stored = self.law.energy(data.qpos) if self.law else 0.0
                energy = (float(data.energy[1]), float(data.energy[0]) + stored)
                places = {name: data.body(name).xpos.copy() for name in self._tips}
                rows.append((self.rotations(data), places, energy))
        finally:
            mujoco.set_mjcb_passive(None)
        turns, places, energies = zip(*rows, strict=True)
        rotations = {name: np.array([turn[name] for turn in turns]) for name in turns[0]}
        energy = np.array(energies).T
        return Fall(
            frame * np.arange(count + 1),
            {h.joint.name: self._between(rotations, h.joint) for h in self._hung},
            rotations,
            {name: np.array([place[name] for place in places]) for name in places[0]},
            *energy,
        )

    def rotations(self, data: Any) -> dict[str, Array]:
        """Rotation of each segment in the world, shape (3, 3)."""
        ground = self._figure.root.segment
        turned = {n: data.body(n).xmat.reshape(3, 3).copy() for n in self._tips}
        return {ground: np.linalg.inv(self._site(self._figure.root))[:3, :3], **turned}

    @property
    def _tips(self) -> list[str]:
        return [hung.tip.segment for hung in self._hung]

    def _step(self, data: Any, step: float) -> None:
        """One step; where it crosses a corner of a spring's curve, many small ones instead.

        A corner within a step of RK4 takes its order away.
        """
        before = data.qpos.copy(), data.qvel.copy()
        self.model.opt.timestep = step
        mujoco.mj_step(self.model, data)
        if self.law is None or np.array_equal(*map(self.law.zones, (before[0], data.qpos))):
            return
        data.qpos, data.qvel = before
        self.model.opt.timestep = step / SPLIT
        mujoco.mj_step(self.model, data, SPLIT)

    def _between(self, rotations: Mapping[str, Array], joint: Joint) -> Array:
        """Rotation of the child's site in the parent's over the frames."""
        parent, child = (rotations[r.segment] @ self._site(r)[:3, :3] for r in joint.ends)
        return np.swapaxes(parent, -1, -2) @ child


def joint_errors(fall: Fall, recording: Recording) -> Array:
    """Largest angle of R_a^T R_b over the joints at each frame of the recording [rad], shape (n,).

    A free root counts as a joint, which the recording names after its segment.
    """
    count = len(recording.times)
    assert np.allclose(fall.times[:count], recording.times, rtol=0.0, atol=1e-9)
    turns = fall.rotations | fall.joints
    errors = [
        angles_between(turns[name][:count], matrix_from_rotation_vector(vectors))
        for name, vectors in recording.rotation_vectors.items()
    ]
    return np.max(errors, axis=0)


def angles_between(one: Array, other: Array) -> Array:
    """Angle of R_a^T R_b for two rows of rotations, shape (n,) [rad]."""
    apart = Rotation.from_matrix(np.swapaxes(one, -1, -2) @ other)
    return np.asarray(apart.magnitude())


def _isotropic(axes: Sequence[AxisSpring]) -> tuple[float, float]:
    """Stiffness [N m/rad] and damping [N m s/rad] that all axes of a joint share."""
    laws = {(axis.elastic, axis.damping) for axis in axes}
    ((elastic, damping),) = laws
    (law,) = elastic
    assert isinstance(law, Linear)
    assert (law.rest, damping.coulomb) == (0.0, 0.0)
    return law.stiffness, damping.viscous


def _turned(chain: Sequence[JointAxis], angles: ArrayLike, rates: ArrayLike) -> tuple[Array, Array]:
    """Rotation of the child in the parent, and its angular velocity in the parent's axes.

    The first factor of the chain is innermost, next to the child.
    """
    turn, spin = np.eye(3), np.zeros(3)
    for factor, angle, rate in zip(chain, np.asarray(angles), np.asarray(rates), strict=True):
        axis = np.asarray(factor.axis)
        outer = Rotation.from_rotvec(axis * angle).as_matrix()
        turn, spin = outer @ turn, outer @ spin + axis * rate
    return turn, spin


def _quaternion(matrix: Array) -> Array:
    """Scalar first, shape (4,)."""
    return Rotation.from_matrix(matrix).as_quat()[[3, 0, 1, 2]]


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number)) for number in numbers)
