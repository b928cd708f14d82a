"""The shipped swings of a leg, against MuJoCo that made them and this program with their truth."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from generator import Plan, read_figure, read_springs, simulate
from springs import SpringSet
from springs.transformed import Transformed
from tests.paths import FIGURES

mujoco = pytest.importorskip("mujoco")

from benchmarks.swinging_leg import (  # noqa: E402
    FIGURE,
    JOINT,
    NOISE,
    SHIPPED,
    SHIPPED_TRUTH,
    add_noise,
    shipped_text,
    swing_in_mujoco,
)


def table(text: str) -> np.ndarray:
    rows = [line for line in text.splitlines() if line[0].isdigit()]
    return np.array([[float(cell) for cell in line.split(",")] for line in rows])


def true_springs() -> SpringSet:
    springs = read_springs(None, read_figure(FIGURE))
    (axis,) = springs.joints[JOINT].axes
    scale, offset = SHIPPED_TRUTH.scale, radians(SHIPPED_TRUTH.offset)
    changed = replace(
        axis,
        elastic=tuple(Transformed(law, scale, offset) for law in axis.elastic),
        damping=replace(axis.damping, viscous=SHIPPED_TRUTH.viscous),
    )
    return replace(springs, joints={JOINT: replace(springs.joints[JOINT], axes=(changed,))})


@pytest.mark.parametrize("name", SHIPPED)
def test_the_file_is_that_of_its_command(name: str) -> None:
    """Another version of MuJoCo may round the last digit differently."""
    file, made = (FIGURES / f"{name}.csv").read_text(encoding="utf-8"), shipped_text(name)
    assert table(file) == pytest.approx(table(made), abs=2e-3)
    assert file.split("by MuJoCo")[0] == made.split("by MuJoCo")[0]
    assert file.splitlines()[1:5] == made.splitlines()[1:5]


@pytest.mark.parametrize("name", SHIPPED)
def test_another_engine_swings_alike(name: str) -> None:
    """MuJoCo without noise within 1e-4 deg; the file within its noise, which is white."""
    start, _ = SHIPPED[name]
    plan = Plan(
        stop=6.0,
        tolerance=1e-8,
        springs=true_springs(),
        displacements={JOINT: (radians(start),)},
    )
    ours = np.degrees(simulate(read_figure(FIGURE), plan).displacements[JOINT][:, 0])
    _, theirs = swing_in_mujoco(SHIPPED_TRUTH, start, plan.stop)
    assert ours == pytest.approx(theirs, abs=1e-4)
    samples = table((FIGURES / f"{name}.csv").read_text(encoding="utf-8"))[: len(ours), 1]
    noise = samples - ours
    assert np.std(noise) == pytest.approx(NOISE, rel=4.0 / np.sqrt(2.0 * len(noise)))
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 4.0 / np.sqrt(len(noise))


def test_noise_is_that_of_its_seed() -> None:
    angles = np.zeros(1000)
    assert np.array_equal(add_noise(angles, 3), add_noise(angles, 3))
    assert not np.array_equal(add_noise(angles, 3), add_noise(angles, 4))
    assert np.std(add_noise(angles, 3, sd=2.0)) == pytest.approx(2.0, rel=0.1)
