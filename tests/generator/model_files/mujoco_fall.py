"""A model in MuJoCo and its figure, falling side by side.

`python -m tests.generator.model_files.mujoco_fall MODEL.xml ...` prints how far they are
apart, with the hinges of a body as joints of their own and as one joint.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from generator.model_files.formats import read_model
from generator.model_files.model_files import Imported
from generator.rotations import Array
from tests.generator.model_files.imported_models import coordinate, fall, without_limits


class MuJoCo:
    """A model in MuJoCo with what a figure does not have taken away."""

    def __init__(self, path: Path) -> None:
        self.api: Any = pytest.importorskip("mujoco")
        spec = self.api.MjSpec.from_file(str(path))
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 0
        for joint in spec.joints:
            joint.armature, joint.limited = 0.0, 0
        spec.option.integrator = self.api.mjtIntegrator.mjINT_RK4
        spec.option.timestep = 2e-4
        self.model = spec.compile()
        self.data = self.api.MjData(self.model)

    @property
    def scalars(self) -> list[int]:
        """Numbers of the joints that have one coordinate."""
        return [k for k in range(self.model.njnt) if self.model.jnt_type[k] >= 2]

    @property
    def names(self) -> list[str]:
        return [self.model.joint(k).name for k in self.scalars]

    def set(self, values: Array, speeds: Array) -> None:
        for k, value, speed in zip(self.scalars, values, speeds, strict=True):
            self.data.qpos[self.model.jnt_qposadr[k]] = value
            self.data.qvel[self.model.jnt_dofadr[k]] = speed
        self.api.mj_forward(self.model, self.data)

    def reach(self, time: float) -> Array:
        """The coordinates at a time."""
        while self.data.time < time - 1e-9:
            self.api.mj_step(self.model, self.data)
        return np.array([self.data.qpos[self.model.jnt_qposadr[k]] for k in self.scalars])


def difference(path: Path, imported: Imported, folder: Path) -> float:
    """Largest difference of the hinges' and slides' coordinates in a fall of 0.5 s [rad or m]."""
    twin = MuJoCo(path)
    rng = np.random.default_rng(5)
    values, speeds = rng.uniform(-0.4, 0.4, len(twin.names)), rng.uniform(-1, 1, len(twin.names))
    twin.set(values, speeds)
    start = dict(zip(twin.names, values, strict=True))
    speed = dict(zip(twin.names, speeds, strict=True))
    gravity = float(np.linalg.norm(twin.model.opt.gravity))
    recording = fall(imported, folder, start, speed, gravity)
    theirs = np.array([twin.reach(time) for time in recording.times])
    ours = np.stack([coordinate(imported, recording, name) for name in twin.names], axis=1)
    assert np.ptp(ours, axis=0).max() > 0.3
    return float(np.abs(ours - theirs).max())


def main() -> None:
    """Print a row for each model that is named."""
    for path in map(Path, sys.argv[1:]):
        figures = [without_limits(read_model(path, separate=apart)) for apart in (True, False)]
        with TemporaryDirectory() as folder:
            apart, joined = (difference(path, each, Path(folder)) for each in figures)
        freedoms = figures[0].figure.degrees_of_freedom
        print(f"| {path.name} | {freedoms} | {apart:.1e} | {joined:.1e} |")


if __name__ == "__main__":
    main()
