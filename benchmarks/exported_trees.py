"""Exported models in Pinocchio and biorbd, whose accelerations SciPy integrates."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.exported import Motion, Poses, Values, write_model
from generator.figure import Figure
from generator.identifiers import coordinate_names
from generator.rotations import Array
from springs import SpringSet


class _Tree(Protocol):
    figure: Figure
    coordinates: list[str]

    def accelerations(self, values: Array, rates: Array) -> Array:
        """Of all coordinates, shape (n,)."""
        ...

    def poses(self, values: Array) -> Poses:
        """Of the segments that move, in the figure's world."""
        ...


def _vector(tree: _Tree, values: Values) -> Array:
    """Displacements of joints in the order of a program's coordinates, shape (n,)."""
    chains = {name: joint.chain for name, joint in tree.figure.joints.items()}
    named = {
        own: float(number)
        for joint, owns in coordinate_names(chains).items()
        for own, number in zip(owns, values[joint], strict=True)
    }
    return np.array([named[own] for own in tree.coordinates])


def _fall(tree: _Tree, times: Sequence[float], tolerance: float) -> Motion:
    """The motion from rest in the pose in which the figure is drawn."""
    start = _vector(tree, {n: np.array(one.displacement) for n, one in tree.figure.joints.items()})
    count = len(start)
    done = solve_ivp(
        lambda _, y: np.concatenate([y[count:], tree.accelerations(y[:count], y[count:])]),
        (times[0], times[-1]),
        np.concatenate([start, np.zeros(count)]),
        "DOP853",
        t_eval=times,
        rtol=tolerance,
        atol=tolerance,
    )
    if not done.success:
        raise RuntimeError(done.message)
    rows = [tree.poses(state[:count]) for state in done.y.T]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


class PinocchioModel:
    """A model in Pinocchio, which has no springs; gravity is from its own default."""

    name = "Pinocchio"

    _UPRIGHT = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])
    """From z up, x ahead to y up, z ahead."""

    def __init__(self, figure: Figure, springs: SpringSet, folder: Path) -> None:
        """Write it and read it."""
        import pinocchio

        self.api: Any = pinocchio
        self.warnings: list[str] = []
        self.figure, path = figure, folder / "figure.urdf"
        self.losses = write_model(figure, springs, path)
        self.model = pinocchio.buildModelFromUrdf(str(path))
        self.data = self.model.createData()
        names = [self.model.names[k] for k in range(1, self.model.njoints)]
        self.coordinates = [
            f"{name}_1" if name in figure.joints and len(figure.joints[name].chain) == 1 else name
            for name in names
        ]

    def _configuration(self, values: Array) -> Array:
        q = self.api.neutral(self.model)
        for k, value in enumerate(values, 1):
            joint = self.model.joints[k]
            parts = [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
            q[joint.idx_q : joint.idx_q + joint.nq] = parts
        return q

    def accelerations(self, values: Array, rates: Array) -> Array:
        """See `_Tree`."""
        q = self._configuration(values)
        return self.api.aba(self.model, self.data, q, rates, -self.model.damping * rates).copy()

    def poses(self, values: Array) -> Poses:
        """See `_Tree`."""
        self.api.framesForwardKinematics(self.model, self.data, self._configuration(values))
        frames = {name: self.data.oMf[self.model.getFrameId(name)] for name in self.figure.bodies}
        return {name: self._UPRIGHT @ frame.homogeneous for name, frame in frames.items()}

    def fall(self, times: Sequence[float], accuracy: float) -> Motion:
        """See `ExportedModel`; `accuracy` is SciPy's tolerance."""
        return _fall(self, times, accuracy)


class BiorbdModel:
    """A model in biorbd, with its passive torques."""

    name = "biorbd"

    def __init__(self, figure: Figure, springs: SpringSet, folder: Path) -> None:
        """Write it and read it."""
        import biorbd

        self.warnings: list[str] = []
        self.figure, path = figure, folder / "figure.bioMod"
        self.losses = write_model(figure, springs, path)
        self.model: Any = biorbd.Model(str(path))
        segments = re.findall(r"segment .*?endsegment", path.read_text("utf-8"), re.DOTALL)
        self.coordinates = [
            name.strip()
            for segment in segments
            for comment in re.findall(r"//(.*)", segment)
            for name in comment.split(",")
        ]

    def accelerations(self, values: Array, rates: Array) -> Array:
        """See `_Tree`."""
        passive = self.model.passiveJointTorque(values, rates)
        return self.model.ForwardDynamics(values, rates, passive.to_array()).to_array()

    def poses(self, values: Array) -> Poses:
        """See `_Tree`."""
        return {name: self.model.globalJCS(values, name).to_array() for name in self.figure.bodies}

    def moments(self, values: Values, joint: str) -> Array:
        """See `SpringModel`."""
        q = _vector(self, values)
        torques = self.model.passiveJointTorque(q, np.zeros_like(q)).to_array()
        found = dict(zip(self.coordinates, torques.tolist(), strict=True))
        chains = {joint: self.figure.joints[joint].chain}
        return np.array([found[own] for own in coordinate_names(chains)[joint]])

    def fall(self, times: Sequence[float], accuracy: float) -> Motion:
        """See `ExportedModel`; `accuracy` is SciPy's tolerance."""
        return _fall(self, times, accuracy)
