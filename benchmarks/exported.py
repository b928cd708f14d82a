"""Exported models in the programs that they are for: moments of their springs, and their motions.

The files are those that `mover convert` writes. A program gives poses of the segments in the
figure's world, by segment, shape (4, 4).
"""

import re
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from generator.figure import Figure, Joint
from generator.joint_chain import build_chain
from generator.losses import Losses
from generator.model import Model
from generator.model_files.fit_error import are_in_range, joint_ranges
from generator.model_files.formats import model_format
from generator.model_files.mjcf.passive import PassiveSprings
from generator.rotations import Array, pose_matrix
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from generator.simulation.statics.static_forces import StaticState
from springs import JointSprings, SphericalLaw, SpringSet
from springs.coordinates import LARGEST_SINE

Poses = dict[str, Array]
Values = Mapping[str, Array]
Motion = Mapping[str, Array]
"""Poses of each segment, shape (frames, 4, 4)."""

GRID = {1: 41, 2: 11, 3: 7}
"""Angles of each displacement of a joint with this number of displacements."""

HALF_TURN = np.radians(170.0)
"""Rotations beyond are left out: there the law of a joint of several rotations is not smooth."""


class ExportedModel(Protocol):
    """A model in its program, in the pose of the file.

    Attributes:
        name: of the program.
        losses: what the file does not hold.
        warnings: lines that the program printed when it read the file.
    """

    name: str
    losses: Losses
    warnings: list[str]

    def __init__(self, figure: Figure, springs: SpringSet, folder: Path) -> None:
        """Write the model into a folder and read it."""
        ...

    def fall(self, times: Sequence[float], accuracy: float) -> Motion:
        """The motion of the file by itself.

        `accuracy` is a step [s] or an accuracy of the program's own integrator.
        """
        ...


class SpringModel(ExportedModel, Protocol):
    """A model whose springs are read."""

    def moments(self, values: Values, joint: str) -> Array:
        """Generalized forces of the springs on a joint's displacements at rest [N m], (n,)."""
        ...


def write_model(figure: Figure, springs: SpringSet, path: Path) -> Losses:
    """Write a model as `mover convert` does."""
    return model_format(path).format_files(figure, springs, path).write()


class MuJoCoModel:
    """A model in MuJoCo, with the options of its file."""

    name = "MuJoCo"

    def __init__(self, figure: Figure, springs: SpringSet, folder: Path) -> None:
        """Write it and compile it."""
        import mujoco

        self.api: Any = mujoco
        self.warnings: list[str] = []
        self.figure, self.path = figure, folder / "figure.xml"
        self.losses = write_model(figure, springs, self.path)
        before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(self.warnings.append)
        try:
            self.model = mujoco.MjModel.from_xml_path(str(self.path))
        finally:
            mujoco.set_mju_user_warning(before)
        self.data = mujoco.MjData(self.model)
        self._reset()

    def _reset(self) -> None:
        self.api.mj_resetDataKeyframe(self.model, self.data, self.model.key("start").id)
        self.api.mj_forward(self.model, self.data)

    def poses(self) -> Poses:
        """Poses of all segments that move."""
        bodies = {name: self.data.body(name) for name in self.figure.bodies}
        return {
            name: pose_matrix(body.xmat.reshape(3, 3), body.xpos) for name, body in bodies.items()
        }

    def _joint(self, name: str) -> int:
        return self.api.mj_name2id(self.model, self.api.mjtObj.mjOBJ_JOINT, name)

    def position(self, joint: Joint, values: Array) -> dict[int, Array]:
        """Positions by address among `qpos` of a joint's displacements."""
        chain, ball = build_chain(joint.chain), self._joint(joint.name)
        if len(chain.rotations) == 3 and ball >= 0:
            tip = self.figure.site(joint.child).pose_in_segment[:3, :3]
            turn = tip @ chain.pose(values)[:3, :3] @ tip.T
            quaternion = Rotation.from_matrix(turn).as_quat()[[3, 0, 1, 2]]
            return {int(self.model.jnt_qposadr[ball]): quaternion}
        names = [f"{joint.name}_{k + 1}" for k in range(len(values))]
        names = [joint.name] if len(values) == 1 else names
        return {
            int(self.model.jnt_qposadr[self._joint(name)]): np.array([value])
            for name, value in zip(names, values, strict=True)
        }

    def moments(self, values: Values, joint: str) -> Array:
        """See `SpringModel`; positions that change with a displacement give its force."""
        at_rest = self.model.key("start").qpos.copy()
        for name, numbers in values.items():
            for at, part in self.position(self.figure.joints[name], numbers).items():
                at_rest[at : at + len(part)] = part
        self.data.qpos[:], self.data.qvel[:] = at_rest, 0.0
        self.api.mj_forward(self.model, self.data)
        forces = self.data.qfrc_passive + self._spring_actuators().T @ self.data.actuator_force
        found = np.zeros(len(values[joint]))
        for k in range(len(found)):
            ends: list[Array] = []
            for change in (-1e-5, 1e-5):
                moved, end = values[joint].copy(), at_rest.copy()
                moved[k] += change
                for at, part in self.position(self.figure.joints[joint], moved).items():
                    end[at : at + len(part)] = part
                ends.append(end)
            rate = np.zeros(self.model.nv)
            self.api.mj_differentiatePos(self.model, rate, 2e-5, *ends)
            found[k] = rate @ forces
        return found

    def _spring_actuators(self) -> Array:
        """Moments of the actuators by degrees of freedom, zero for those of loads."""
        moments = np.zeros((self.model.nu, self.model.nv))
        if self.model.nu:
            self.api.mju_sparse2dense(
                moments,
                self.data.actuator_moment,
                self.data.moment_rownnz,
                self.data.moment_rowadr,
                self.data.moment_colind,
            )
        moments[self._loads()] = 0.0
        return moments

    def _loads(self) -> list[int]:
        """Numbers of the actuators that are constant forces and moments of the figure."""
        names = [self.model.actuator(k).name for k in range(self.model.nu)]
        return [k for k, name in enumerate(names) if name.endswith(" load")]

    def fall(
        self, times: Sequence[float], accuracy: float, springs: SpringSet | None = None
    ) -> Motion:
        """See `ExportedModel`; `accuracy` is the step [s].

        `springs` act by our own formulas in a callback, on a model that was written without.
        """
        self._reset()
        self.model.opt.timestep = accuracy
        if springs is not None:
            self.api.set_mjcb_passive(PassiveSprings(self.model, self.figure, springs))
        rows = [self.poses()]
        try:
            for time in times[1:]:
                steps = round((time - self.data.time) / accuracy)
                self.api.mj_step(self.model, self.data, steps)
                self.api.mj_forward(self.model, self.data)
                rows.append(self.poses())
        finally:
            self.api.set_mjcb_passive(None)
        self.warnings += [
            self.api.mju_warningText(k, self.data.warning[k].lastinfo)
            for k in range(len(self.data.warning))
            if self.data.warning[k].number
        ]
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}


class OpenSimModel:
    """A model in OpenSim."""

    name = "OpenSim"

    def __init__(self, figure: Figure, springs: SpringSet, folder: Path) -> None:
        """Write it and read it, and keep what OpenSim writes into its log."""
        import opensim

        self.api: Any = opensim
        self.figure, self.path = figure, folder / "figure.osim"
        self.losses = write_model(figure, springs, self.path)
        log = folder / "opensim.log"
        opensim.Logger.removeFileSink()
        opensim.Logger.setLevelString("Warn")
        opensim.Logger.addFileSink(str(log))
        self.model = opensim.Model(str(self.path))
        self.state = self.model.initSystem()
        opensim.Logger.removeFileSink()
        self.warnings = [
            line
            for line in (log.read_text(encoding="utf-8") if log.exists() else "").splitlines()
            if "[warning]" in line or "[error]" in line
        ]
        self._springs: tuple[Any, Any, Any, dict[str, int]] | None = None

    def poses(self, state: Any) -> Poses:
        """Poses of all segments that move."""
        self.model.realizePosition(state)
        return {name: self._frame(f"/bodyset/{name}", state) for name in self.figure.bodies}

    def _frame(self, path: str, state: Any) -> Array:
        frame = self.api.Frame.safeDownCast(self.model.getComponent(path))
        transform = frame.getTransformInGround(state)
        turn, shift = transform.R(), transform.p()
        rows = [[turn.get(i, j) for j in range(3)] for i in range(3)]
        return pose_matrix(rows, [shift.get(i) for i in range(3)])

    def _spring_model(self) -> tuple[Any, Any, Any, dict[str, int]]:
        """The model with its springs alone: state, solver, and index of each coordinate's force."""
        if self._springs is None:
            model = self.api.Model(str(self.path))
            model.setGravity(self.api.Vec3(0.0))
            for k in range(model.getForceSet().getSize()):
                force = model.getForceSet().get(k)
                if force.getConcreteClassName() == "PrescribedForce":
                    force.set_appliesForce(False)
            state = model.initSystem()
            places: dict[str, int] = {}
            for k in range(model.getCoordinateSet().getSize()):
                coordinate = model.getCoordinateSet().get(k)
                state.setU(self.api.Vector(state.getNU(), 0.0))
                coordinate.setSpeedValue(state, 1.0)
                places[coordinate.getName()] = int(np.argmax(state.getU().to_numpy()))
            state.setU(self.api.Vector(state.getNU(), 0.0))
            self._springs = model, state, self.api.InverseDynamicsSolver(model), places
        return self._springs

    def moments(self, values: Values, joint: str) -> Array:
        """See `SpringModel`."""
        model, state, solver, places = self._spring_model()
        for name, numbers in values.items():
            for k, value in enumerate(numbers, 1):
                model.getCoordinateSet().get(f"{name}_{k}").setValue(state, float(value), False)
        needed = solver.solve(state).to_numpy()
        return -needed[[places[f"{joint}_{k}"] for k in range(1, len(values[joint]) + 1)]]

    def fall(self, times: Sequence[float], accuracy: float) -> Motion:
        """See `ExportedModel`; `accuracy` is that of OpenSim's manager."""
        state = self.model.initSystem()
        manager = self.api.Manager(self.model)
        manager.setIntegratorAccuracy(accuracy)
        manager.initialize(state)
        rows = [self.poses(state)]
        for time in times[1:]:
            rows.append(self.poses(manager.integrate(float(time))))
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def joint_grid(joint: Joint, springs: JointSprings, law: SphericalLaw) -> Array:
    """Displacements of orientations in the range of a joint, shape (poses, n) [rad or m].

    Under the law of coordinates those beyond the pole of three rotations, at which a run ends, are
    left out.
    """
    count = GRID[min(len(joint.chain), 3)]
    ranges = joint_ranges(joint, springs)
    rows = np.array(list(product(*(np.linspace(*ends, count) for ends in ranges))))
    chain = build_chain(joint.chain)
    turns = Rotation.from_matrix(chain.pose(rows)[:, :3, :3])
    inside = (turns.magnitude() < HALF_TURN) & are_in_range(chain, ranges, rows)
    if law is SphericalLaw.COORDINATES and len(chain.rotations) == 3:
        inside &= np.abs(rows[:, chain.rotations[1]]) < np.arcsin(LARGEST_SINE)
    return rows[inside]


def our_moments(figure: Figure, springs: SpringSet, joint: str, rows: Array) -> Array:
    """Generalized forces of the springs of a joint at displacements of it, shape (poses, n)."""
    still = Plan(gravity=(0.0, 0.0, 0.0))
    with_springs = build_model(Model(figure, springs), still)
    tree = with_springs.placement.tree
    columns = tree.kinematics.columns[joint]
    values = np.zeros((len(rows), tree.kinematics.size))
    values[:, columns] = rows
    forces = StaticState.from_displacements(with_springs, values).forces()
    bare = build_model(Model(figure), still)
    forces = forces - StaticState.from_displacements(bare, values).forces()
    return forces[:, columns]


def moment_differences(
    model: SpringModel, figure: Figure, springs: SpringSet, joint: str, sparse: int = 1
) -> tuple[Array, float]:
    """Differences of a joint's spring moments from ours, shape (poses, n), and our largest [N m].

    Every `sparse`-th pose of the grid is taken; the other joints are at zero.
    """
    at_zero = {name: np.zeros(len(each.chain)) for name, each in figure.joints.items()}
    rows = joint_grid(figure.joints[joint], springs.joints[joint], springs.law)[::sparse]
    theirs = np.array([model.moments({**at_zero, joint: row}, joint) for row in rows])
    ours = our_moments(figure, springs, joint, rows)
    return theirs - ours, float(np.abs(ours).max())


_STATED = re.compile(r"([\w ]+) \(([\d.e+-]+) N m at most")


def stated_errors(losses: Losses, springs: SpringSet) -> dict[str, float]:
    """Largest errors of the fits by joint with springs, as the losses state them [N m]."""
    stated: dict[str, float] = {}
    text = "; ".join(f"{loss.what}: {', '.join(loss.where)}" for loss in losses.entries)
    for names, size in _STATED.findall(text):
        for name in names.strip().split(" and "):
            joint = name if name in springs.joints else name.rpartition("_")[0]
            if joint in springs.joints:
                stated[joint] = max(float(size), stated.get(joint, 0.0))
    return stated


def drawn_motion(figure: Figure, motion: Motion) -> Array:
    """Positions of all sites of the segments that move, shape (frames, sites, 3) [m]."""
    places = [
        (motion[name] @ site.pose_in_segment)[:, :3, 3]
        for name in figure.bodies
        for site in figure.segments[name].sites.values()
    ]
    return np.stack(places, axis=1)


def difference(figure: Figure, one: Motion, other: Motion) -> tuple[float, float]:
    """Largest distance of a site [m] and largest angle of a segment [rad] of two motions."""
    places = [drawn_motion(figure, motion) for motion in (one, other)]
    distance = float(np.linalg.norm(places[0] - places[1], axis=-1).max())
    angle = max(
        Rotation.from_matrix(np.swapaxes(one[name][:, :3, :3], -1, -2) @ other[name][:, :3, :3])
        .magnitude()
        .max()
        for name in figure.bodies
    )
    return distance, float(angle)
