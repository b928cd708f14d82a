"""BVH: hierarchy and frames; `tests/properties` places every segment by them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.losses import Losses
from generator.motion_files.bvh import write
from generator.motion_files.motion import FigureMotion
from tests.chains import BALL, body, figure, ground, joint, row
from tests.motion_readers import Bvh
from tests.motions import MOTIONS, any_motion, clip, shipped, site, slides, standing

Written = Callable[[FigureMotion], tuple[Bvh, Losses]]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    def write_and_read(motion: FigureMotion) -> tuple[Bvh, Losses]:
        losses = write(motion, tmp_path / "out.bvh")
        return Bvh(tmp_path / "out.bvh"), losses

    return write_and_read


@pytest.mark.verify
@pytest.mark.parametrize("name", MOTIONS)
def test_another_reader_finds_the_same_bones_and_frames(name: str, tmp_path: Path):
    bvh = pytest.importorskip("bvh")
    path = tmp_path / "out.bvh"
    write(clip(name), path)
    theirs, ours = bvh.Bvh(path.read_text(encoding="utf-8")), Bvh(path)
    assert theirs.get_joints_names() == list(ours.channels)
    for joint_name, channels in ours.channels.items():
        assert theirs.joint_channels(joint_name) == channels
        assert list(theirs.joint_offset(joint_name)) == ours.offsets[joint_name]
        above = theirs.joint_parent(joint_name)
        assert ours.parents.get(joint_name) == (above and above.name)
    assert np.array_equal(np.array(theirs.frames, dtype=float), ours.rows)
    assert theirs.frame_time == ours.interval


def test_the_ends_of_limbs_are_sites(written: Written):
    motion = any_motion(shipped("prototype"))
    poses = written(motion)[0].poses()
    for bone, segment in (("left_knee", "left_lower_leg"), ("right_elbow", "right_lower_arm")):
        expected = site(motion, segment, "distal")
        assert np.allclose(poses[f"{bone} end"][:, :3, 3], expected, atol=1e-6)


def test_angles_do_not_jump(written: Written):
    read, _ = written(clip("flying"))
    assert np.max(np.abs(np.diff(read.rows, axis=0))) < 120.0


def test_a_figure_at_rest_stands_upright(written: Written):
    """The offsets alone, without any channels, are the figure with all displacements zero."""
    read, _ = written(standing(shipped("prototype")))

    def height(name: str) -> float:
        above = read.parents.get(name)
        return read.offsets[name][1] + (height(above) if above else 0.0)

    assert height("left_knee") < height("left_hip_joint") < height("left_elbow") < 70.0
    assert read.offsets["left_hip_joint"] == pytest.approx((6.12, 0.0, 0.0))


@pytest.mark.parametrize(
    ("motion", "expected"),
    [
        (any_motion(shipped("prototype")), ["root_torso"]),
        (any_motion(shipped("fourbar")), []),
        (any_motion(slides()), ["rail", "telescope"]),
        (any_motion(shipped("prototype"), is_free=True), ["lower_torso"]),
    ],
    ids=MOTIONS,
)
def test_only_the_root_and_slides_have_positions(
    motion: FigureMotion, expected: list[str], written: Written
):
    channels = written(motion)[0].channels
    assert [name for name, each in channels.items() if "Xposition" in each] == expected


def test_a_last_frame_that_comes_too_soon_is_left_out_and_told(written: Written):
    motion = any_motion(slides(), 0.02 * np.arange(51))
    times = motion.times.copy()
    times[-1] -= 0.013
    read, losses = written(replace(motion, times=times))
    assert any("the last frame, at 0.987 s" in loss.what for loss in losses.entries)
    assert (len(read.rows), read.interval) == (50, 0.02)


def test_uneven_frames_are_interpolated_and_told(written: Written):
    motion = clip("slides")
    even, _ = written(motion)
    kept = np.delete(np.arange(motion.times.size), [5, 17, 18])
    assert motion.recording is not None
    poses = {name: rows[kept] for name, rows in motion.poses.items()}
    thinned = replace(
        motion, times=motion.times[kept], recording=replace(motion.recording, poses=poses)
    )
    read, losses = written(thinned)
    assert any("interpolated" in loss.what for loss in losses.entries)
    assert len(read.rows) == len(kept)
    assert read.interval == pytest.approx(0.4 / (len(kept) - 1))
    assert np.allclose(read.rows[[0, -1]], even.rows[[0, -1]], atol=1e-5)
    middle = np.interp(read.interval * 7, even.interval * np.arange(21), even.rows[:, 1])
    assert read.rows[7, 1] == pytest.approx(middle, abs=0.5)


def test_a_long_chain_of_bones_is_written(shallow_stack: int, tmp_path: Path):
    write(standing(row(shallow_stack, bend=0.0)), tmp_path / "out.bvh")
    text = (tmp_path / "out.bvh").read_text(encoding="utf-8")
    assert text.count("{") == text.count("}") == shallow_stack + 1
    assert set(text.splitlines()[-1].split()) == {"0.000000"}


def test_a_joint_may_have_the_name_of_the_ground(written: Written):
    made = figure(
        [ground(), body("a"), body("b")],
        [joint("ground", "ground.base", "a.near", BALL), joint("b", "ground.base", "b.near", BALL)],
    )
    assert list(written(standing(made))[0].channels) == ["ground_ground", "ground", "b"]


def test_loops_and_what_else_is_lost_are_told(written: Written):
    motion = clip("fourbar")
    lost = {loss.what: loss.where for loss in written(motion)[1].entries}
    (loop,) = [where for what, where in lost.items() if what.startswith("joints that close")]
    assert loop == tuple(joint.name for joint in motion.tree.closures)
    assert lost["results of the run other than the motion"][0] == "velocities"
