"""A figure as a motion of one frame."""

from pathlib import Path

import numpy as np
import pytest

from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import build_tree
from generator.motion_files import MOTION_FORMATS, motion_writer
from generator.motion_files.motion import motion_from_figure
from tests.contacts import with_contact
from tests.motions import bent, clip, shipped, start_of


@pytest.mark.parametrize("is_bent", [False, True])
def test_a_pose_is_a_motion_of_one_frame(is_bent: bool):
    figure = shipped("prototype")
    pose = bent(figure) if is_bent else start_of(figure)
    motion = motion_from_figure(figure, pose if is_bent else None)
    assert np.array_equal(motion.times, [0.0])
    expected = forward_kinematics(build_tree(figure), pose).poses
    for name in figure.segments:
        assert motion.poses[name].shape == (1, 4, 4)
        assert np.allclose(motion.poses[name][0], expected[name], atol=1e-12)
    assert motion.header.figure == "prototype.fig"
    assert motion.header.frame_interval is None


@pytest.mark.parametrize("suffix", MOTION_FORMATS)
def test_every_format_holds_a_pose(suffix: str, tmp_path: Path):
    path = tmp_path / f"pose{suffix}"
    MOTION_FORMATS[suffix](motion_from_figure(shipped("fourbar")), path)
    assert path.stat().st_size > 0


@pytest.mark.parametrize("suffix", MOTION_FORMATS)
def test_a_format_without_a_scene_says_so(suffix: str, tmp_path: Path):
    motion = with_contact(clip("slides"))
    losses = motion_writer(tmp_path / f"run{suffix}")(motion, tmp_path / f"run{suffix}")
    said = "the props of the scene: floor, crate, wall" in map(str, losses.entries)
    assert said == (suffix not in (".npz", ".glb", ".html"))
