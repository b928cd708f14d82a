"""Contact of runs as external forces of inverse dynamics."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.conversion import read_motion
from generator.diagnostics import InputError
from generator.input_files.coordinates import NO_COORDINATES
from generator.inverse.moments import joint_moments
from generator.inverse.run_contact import contact_of_run
from tests.command import answer, mover, run

TWO_BODIES = """<mujoco model="box"><worldbody><body name="top" pos="0 0 0.5">
<freejoint name="root"/><geom type="sphere" size="0.1" pos="0.1 0 0" mass="2"/>
<body name="leg" pos="0 0 -0.2"><joint name="j" type="hinge" axis="0 1 0"/>
<geom type="sphere" size="0.08" pos="0.05 0 -0.1" mass="1"/><site name="low" pos="0 0 -0.2"/>
</body></body></worldbody></mujoco>"""


@pytest.fixture(scope="module")
def fall(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fall of two bodies, of a model whose world is turned, on a floor."""
    folder = tmp_path_factory.mktemp("fall")
    (folder / "box.xml").write_text(TWO_BODIES)
    run("convert", folder / "box.xml", folder / "box.fig")
    words = ("--floor", "--stop", "0.5", "--frame", "0.001", "-o", folder / "box.npz")
    run("simulate", folder / "box.fig", *words)
    return folder / "box.npz"


def test_contact_of_a_run_leaves_nothing_over(fall: Path):
    motion = read_motion(fall)
    forces = contact_of_run(motion)
    assert {one.segment for one in forces} == {"leg", "top"}
    with_them = joint_moments(motion, NO_COORDINATES, forces)
    assert with_them.mean_residual_share < 0.01
    assert float(np.median(np.abs(with_them.coordinates["j_1"].forces))) < 1e-3
    assert joint_moments(motion, NO_COORDINATES).mean_residual_share > 0.5


def test_frames_that_are_too_far_apart_for_blows_are_told(fall: Path, tmp_path: Path):
    far, figure = tmp_path / "far.npz", fall.with_suffix(".fig")
    run("simulate", figure, "--floor", "--stop", "0.5", "--frame", "0.01", "-o", far)
    said = mover("inverse", figure, far)
    assert "body weights, " in said.stderr
    assert "with frames 0.01 s apart" in said.stderr
    air = tmp_path / "air.npz"
    run("simulate", figure, "--stop", "0.5", "--frame", "0.01", "-o", air)
    assert "residual" not in mover("inverse", figure, air).stderr


def test_moments_of_contact_are_those_of_the_whole(fall: Path):
    motion = read_motion(fall)
    contact = motion.recording.contact
    total = sum(one.wrench(motion.times, motion.poses, np.eye(4)) for one in contact_of_run(motion))
    scale = np.abs(contact.ground_reaction).max(axis=0) + 1.0
    moved = np.hstack([total[:, 3:], total[:, :3]])
    assert np.abs((moved - contact.ground_reaction) / scale).max() < 1e-6


def test_contact_of_another_figure_is_refused(fall: Path):
    motion = read_motion(fall)
    contact = motion.recording.contact
    other = replace(contact, forces={n: 1.01 * one for n, one in contact.forces.items()})
    run_of_other = replace(motion.recording, contact=other)
    with pytest.raises(InputError, match="do not follow from its figure and scene"):
        contact_of_run(replace(motion, recording=run_of_other))


def test_the_command_takes_the_contact_of_a_run(fall: Path):
    data = answer("inverse", fall.with_name("box.fig"), fall)
    assert set(data["forces"]) == {"leg", "top"}
    assert data["residuals"]["top_5"]["share"] < 0.1


@pytest.mark.slow
def test_a_person_that_trips_carries_its_contact(tmp_path: Path):
    """Parts of the body span segments; each segment has its own force and moment."""
    fall = tmp_path / "fall.npz"
    words = ("--fall", "trip", "--stop", "0.6", "--frame", "0.002", "-o", fall)
    run("simulate", "male50", *words)
    motion = read_motion(fall)
    forces = contact_of_run(motion)
    assert len(forces) > 2
    assert joint_moments(motion, NO_COORDINATES, forces).mean_residual_share < 0.01
    assert joint_moments(motion, NO_COORDINATES).mean_residual_share > 0.3
