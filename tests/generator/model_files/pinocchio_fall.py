"""A robot in Pinocchio and its figure, falling side by side.

`python -m tests.generator.model_files.pinocchio_fall MODEL.urdf ...` prints how far they are
apart, for robots whose joints are hinges and slides. Dry friction is left out.
"""

import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from generator.model_files.formats import read_model
from generator.rotations import Array
from tests.generator.model_files.imported_models import coordinate, fall, without_limits

SINGLE = ("turntable", "shoulder_pitch", "shoulder_roll", "lift")
PLANAR = ("glide_tx", "glide_ty", "glide_turn")
FLYING = ("flight_tx", "flight_ty", "flight_tz", "flight_x", "flight_y", "flight_z")


class Pinocchio:
    """A model in Pinocchio."""

    def __init__(self, path: Path) -> None:
        self.api: Any = pytest.importorskip("pinocchio")
        self.model = self.api.buildModelFromUrdf(str(path))
        self.data = self.model.createData()

    def configuration(self, values: dict[str, float]) -> Array:
        """Pinocchio's vector of the coordinates, which has other numbers for some joints."""
        q = self.api.neutral(self.model)
        for k in range(1, self.model.njoints):
            name, at = self.model.names[k], self.model.joints[k].idx_q
            if self.model.joints[k].nq == 1:
                q[at] = values.get(name, 0.0)
            elif self.model.joints[k].shortname() == "JointModelRUBZ":
                q[at : at + 2] = np.cos(values.get(name, 0.0)), np.sin(values.get(name, 0.0))
            elif self.model.joints[k].shortname() == "JointModelPlanar":
                turn = values[f"{name}_turn"]
                q[at : at + 2] = values[f"{name}_tx"], values[f"{name}_ty"]
                q[at + 2 : at + 4] = np.cos(turn), np.sin(turn)
            else:
                q[at : at + 3] = [values[f"{name}_t{letter}"] for letter in "xyz"]
                angles = [values[f"{name}_{letter}"] for letter in "xyz"]
                turn = self.api.Quaternion(self.api.rpy.rpyToMatrix(np.array(angles)))
                q[at + 3 : at + 7] = turn.coeffs()
        return q

    def frames(self, q: Array) -> dict[str, Array]:
        """Pose of every link in the world, shape (4, 4)."""
        self.api.framesForwardKinematics(self.model, self.data, q)
        kind = self.api.FrameType.BODY
        return {
            frame.name: self.data.oMf[k].homogeneous
            for k, frame in enumerate(self.model.frames)
            if frame.type == kind
        }


def runge_kutta_step(
    api: Any, model: Any, data: Any, q: Array, v: Array, damping: Array, h: float
) -> tuple[Array, Array]:
    """One step of the classical Runge-Kutta method."""

    def slope(stage: Array, rate: Array) -> Array:
        return api.aba(model, data, stage, rate, -damping * rate).copy()

    def moved(rate: Array, time: float) -> Array:
        return api.integrate(model, q, rate * time)

    a = slope(q, v)
    v2 = v + 0.5 * h * a
    b = slope(moved(v, 0.5 * h), v2)
    v3 = v + 0.5 * h * b
    c = slope(moved(v2, 0.5 * h), v3)
    v4 = v + h * c
    d = slope(moved(v3, h), v4)
    mean = (v + 2.0 * v2 + 2.0 * v3 + v4) / 6.0
    return moved(mean, h), v + h * (a + 2.0 * b + 2.0 * c + d) / 6.0


def difference(path: Path, folder: Path, names: tuple[str, ...], h: float = 1e-3) -> float:
    """Largest difference of the coordinates with these names in a fall of 0.5 s [rad or m].

    `h` is the step of Pinocchio's Runge-Kutta method [s].
    """
    imported, twin = without_limits(read_model(path, separate=True)), Pinocchio(path)
    rng = np.random.default_rng(4)
    values = dict(zip(names, rng.uniform(-0.4, 0.4, len(names)), strict=True))
    speeds = dict(zip(names, rng.uniform(-1.0, 1.0, len(names)), strict=True))
    recording = fall(imported, folder, values, speeds)
    for name in (*PLANAR, *FLYING):
        values.setdefault(name, 0.0)
    q, v = twin.configuration(values), np.zeros(twin.model.nv)
    damping = np.zeros(twin.model.nv)
    for name in names:
        at = twin.model.joints[twin.model.getJointId(name)].idx_v
        joint = imported.figure.joints[imported.coordinates[name].joint]
        v[at] = speeds[name]
        damping[at] = (joint.damp or (0.0,))[imported.coordinates[name].index]
    worst = moved = 0.0
    steps = round(0.02 / h)
    for k in range(len(recording.times)):
        for _ in range(steps if k else 0):
            q, v = runge_kutta_step(twin.api, twin.model, twin.data, q, v, damping, h)
        for name in names:
            at = twin.model.joints[twin.model.getJointId(name)]
            theirs = q[at.idx_q] if at.nq == 1 else np.arctan2(q[at.idx_q + 1], q[at.idx_q])
            ours = float(coordinate(imported, recording, name)[k])
            gap = ours - theirs
            if at.nq == 2:
                gap -= 2.0 * np.pi * round(gap / (2.0 * np.pi))
            worst, moved = max(worst, abs(gap)), max(moved, abs(ours - values[name]))
    assert moved > 0.3
    return worst


def main() -> None:
    """Print a row for each robot that is named."""
    for path in map(Path, sys.argv[1:]):
        with TemporaryDirectory() as folder:
            smooth = Path(folder) / "smooth.urdf"
            smooth.write_text(re.sub(r'friction="[^"]*"', 'friction="0"', path.read_text()))
            names = tuple(list(Pinocchio(smooth).model.names)[1:])
            worst = difference(smooth, Path(folder), names, 2e-4)
        print(f"| {path.name} | {len(names)} | {worst:.1e} |")


if __name__ == "__main__":
    main()
