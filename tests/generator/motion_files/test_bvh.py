"""BVH: hierarchy and frames; `tests/properties` places every segment by them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import UsageError
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
    moved = {name: rows[kept] for name, rows in motion.displacements.items()}
    thinned = replace(motion, times=motion.times[kept], displacements=moved, recording=None)
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


@pytest.mark.parametrize(("scale", "decimals"), [(1.0, 8), (1000.0, 6), (39.37, 7)])
def test_lengths_are_scaled_and_angles_are_not(scale: float, decimals: int, tmp_path: Path):
    motion = any_motion(slides())
    write(motion, tmp_path / "cm.bvh")
    losses = write(motion, tmp_path / "scaled.bvh", scale=scale)
    in_cm, scaled = Bvh(tmp_path / "cm.bvh"), Bvh(tmp_path / "scaled.bvh")
    kinds = [each for channels in in_cm.channels.values() for each in channels]
    for k, kind in enumerate(kinds):
        factor = scale / 100.0 if kind.endswith("position") else 1.0
        assert scaled.rows[:, k] == pytest.approx(
            in_cm.rows[:, k] * factor, abs=2e-6 * max(1.0, factor)
        )
    for name, offset in in_cm.offsets.items():
        assert scaled.offsets[name] == pytest.approx(np.array(offset) * scale / 100.0, abs=1e-5)
    assert any(f"{decimals} decimals" in loss.what for loss in losses.entries)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf")])
def test_a_wrong_scale_is_refused(scale: float, tmp_path: Path):
    with pytest.raises(UsageError, match="must be positive"):
        write(any_motion(slides()), tmp_path / "out.bvh", scale=scale)
    assert not (tmp_path / "out.bvh").exists()


@pytest.mark.parametrize("scale", [1e308, 1e-300, 1e10])
def test_a_scale_whose_digits_overflow_is_refused(scale: float, tmp_path: Path):
    with pytest.raises(UsageError, match=r"from 1e-09 to 1e\+09"):
        write(any_motion(slides()), tmp_path / "out.bvh", scale=scale)
    assert not (tmp_path / "out.bvh").exists()


@pytest.mark.parametrize("scale", [1e9, 1e-9])
def test_the_numbers_of_the_extreme_scales_are_finite(scale: float, tmp_path: Path):
    write(any_motion(slides()), tmp_path / "out.bvh", scale=scale)
    assert np.isfinite(Bvh(tmp_path / "out.bvh").rows).all()
