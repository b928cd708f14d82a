"""BVH: another reader's hierarchy and channels place every joint where it was simulated."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from generator.motion_files.bvh import write
from generator.motion_files.motion import FigureMotion
from generator.rotations import Array
from tests.chains import BALL, body, figure, ground, joint, row
from tests.motions import MOTIONS, clip, site, ten_frames

WITHIN = 1e-4
AXES = {"X": 0, "Y": 1, "Z": 2}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bvh")


@cache
def read(name: str, folder: Path):
    bvh = pytest.importorskip("bvh")
    path = folder / f"{name}.bvh"
    write(clip(name), path)
    return bvh.Bvh(path.read_text(encoding="utf-8"))


def pose(mocap, joint, frame: int) -> Array:
    """Pose of a joint in the world: offset, then its channels from left to right [cm]."""
    here = np.eye(4)
    here[:3, 3] = mocap.joint_offset(joint.name)
    for channel in mocap.joint_channels(joint.name):
        value = mocap.frame_joint_channel(frame, joint.name, channel)
        step, axis = np.eye(4), np.eye(3)[AXES[channel[0]]]
        if channel.endswith("position"):
            step[:3, 3] = value * axis
        else:
            step[:3, :3] = Rotation.from_rotvec(np.radians(value) * axis).as_matrix()
        here = here @ step
    above = mocap.joint_parent(joint.name)
    return here if above is None else pose(mocap, above, frame) @ here


def joint_places(motion: FigureMotion, joint: str, frames: list[int]) -> Array:
    """Where the site that a joint moves truly is [m]."""
    (branch,) = [b for b in motion.tree.joints if b.joint.name == joint]
    moved = branch.joint.child if branch.parent_is_inboard else branch.joint.parent
    made = motion.tree.figure.site(moved).pose_in_segment
    return (motion.poses[branch.outboard][frames] @ made)[:, :3, 3]


@pytest.mark.verify
@pytest.mark.parametrize("name", MOTIONS)
def test_another_reader_finds_every_joint_in_its_place(name: str, folder: Path):
    motion, mocap = clip(name), read(name, folder)
    frames = ten_frames(motion)
    names = mocap.get_joints_names()
    assert set(names) >= {branch.joint.name for branch in motion.tree.joints}
    for bone in mocap.get_joints():
        if bone.name == motion.figure.root.segment:
            continue
        found = [pose(mocap, bone, k)[:3, 3] / 100.0 for k in frames]
        assert np.allclose(found, joint_places(motion, bone.name, frames), atol=WITHIN)


@pytest.mark.verify
def test_the_ends_of_limbs_are_sites(folder: Path):
    motion, mocap = clip("prototype"), read("prototype", folder)
    frames = ten_frames(motion)
    for bone, segment in (("left_knee", "left_lower_leg"), ("right_elbow", "right_lower_arm")):
        (end,) = mocap.get_joint(bone).filter("End")
        offset = np.array([*map(float, end["OFFSET"]), 1.0])
        found = [(pose(mocap, mocap.get_joint(bone), k) @ offset)[:3] / 100.0 for k in frames]
        assert np.allclose(found, site(motion, segment, "distal", frames), atol=WITHIN)


@pytest.mark.verify
@pytest.mark.parametrize("name", MOTIONS)
def test_frames_are_those_of_the_motion(name: str, folder: Path):
    motion, mocap = clip(name), read(name, folder)
    assert mocap.nframes == motion.times.size == len(mocap.frames)
    assert mocap.frame_time == 0.02
    widths = {len(row) for row in mocap.frames}
    assert widths == {sum(len(mocap.joint_channels(n)) for n in mocap.get_joints_names())}


@pytest.mark.verify
def test_angles_do_not_jump(folder: Path):
    mocap = read("flying", folder)
    rows = np.array(mocap.frames, dtype=float)
    assert np.max(np.abs(np.diff(rows, axis=0))) < 120.0


@pytest.mark.verify
def test_a_figure_at_rest_stands_upright(folder: Path):
    """The offsets alone, without any channels, are the figure with all displacements zero."""
    mocap = read("prototype", folder)

    def height(name: str) -> float:
        above = mocap.joint_parent(name)
        return mocap.joint_offset(name)[1] + (height(above.name) if above else 0.0)

    assert height("left_knee") < height("left_hip_joint") < height("left_elbow") < 70.0
    assert mocap.joint_offset("left_hip_joint") == pytest.approx((6.12, 0.0, 0.0))


@pytest.mark.verify
def test_only_the_root_and_slides_have_positions(folder: Path):
    with_positions = {
        name: [
            joint
            for joint in read(name, folder).get_joints_names()
            if "Xposition" in read(name, folder).joint_channels(joint)
        ]
        for name in MOTIONS
    }
    assert with_positions == {
        "prototype": ["root_torso"],
        "fourbar": [],
        "slides": ["rail", "telescope"],
        "flying": ["lower_torso"],
    }


def frames_of(path: Path) -> tuple[int, float, Array]:
    lines = path.read_text(encoding="utf-8").splitlines()
    start = lines.index("MOTION")
    rows = np.array([line.split() for line in lines[start + 3 :]], dtype=float)
    return int(lines[start + 1].split()[-1]), float(lines[start + 2].split()[-1]), rows


def test_a_last_frame_that_comes_too_soon_is_left_out_and_told(tmp_path: Path):
    motion = clip("slides")
    times = motion.times.copy()
    times[-1] -= 0.013
    losses = write(replace(motion, times=times), tmp_path / "out.bvh")
    assert any("the last frame, at 0.987 s" in loss.what for loss in losses.entries)
    count, interval, rows = frames_of(tmp_path / "out.bvh")
    assert (count, interval, len(rows)) == (motion.times.size - 1, 0.02, motion.times.size - 1)


def test_uneven_frames_are_interpolated_and_told(tmp_path: Path):
    motion = clip("slides")
    path = tmp_path / "out.bvh"
    write(motion, path)
    _, _, even = frames_of(path)
    kept = np.delete(np.arange(motion.times.size), [5, 17, 18])
    poses = {name: rows[kept] for name, rows in motion.poses.items()}
    assert motion.recording is not None
    thinned = replace(
        motion, times=motion.times[kept], recording=replace(motion.recording, poses=poses)
    )
    losses = write(thinned, path)
    assert any("interpolated" in loss.what for loss in losses.entries)
    count, interval, rows = frames_of(path)
    assert count == len(kept)
    assert interval == pytest.approx(1.0 / (len(kept) - 1))
    assert np.allclose(rows[[0, -1]], even[[0, -1]], atol=1e-5)


def test_a_single_frame_is_a_motion(tmp_path: Path):
    motion = clip("fourbar")
    assert motion.recording is not None
    poses = {name: rows[:1] for name, rows in motion.poses.items()}
    still = replace(
        motion, times=motion.times[:1], recording=replace(motion.recording, poses=poses)
    )
    write(still, tmp_path / "out.bvh")
    assert frames_of(tmp_path / "out.bvh")[0] == 1


def test_a_chain_of_a_thousand_bones_is_written(tmp_path: Path):
    made = row(1000)
    zero = {name: np.zeros((2, 3)) for name in made.joints}
    chains = {name: joint.chain for name, joint in made.joints.items()}
    motion = FigureMotion(made, clip("fourbar").header, chains, np.array([0.0, 0.1]), zero)
    write(motion, tmp_path / "out.bvh")
    text = (tmp_path / "out.bvh").read_text(encoding="utf-8")
    assert text.count("{") == text.count("}") == 1001
    assert np.allclose(frames_of(tmp_path / "out.bvh")[2], 0.0)


def test_a_joint_may_have_the_name_of_the_ground(tmp_path: Path):
    made = figure(
        [ground(), body("a"), body("b")],
        [joint("ground", "ground.base", "a.near", BALL), joint("b", "ground.base", "b.near", BALL)],
    )
    zero = {name: np.zeros((2, 3)) for name in made.joints}
    chains = {name: joint.chain for name, joint in made.joints.items()}
    write(
        FigureMotion(made, clip("fourbar").header, chains, np.array([0.0, 0.1]), zero),
        tmp_path / "out.bvh",
    )
    lines = (tmp_path / "out.bvh").read_text(encoding="utf-8").splitlines()
    names = [line.split()[1] for line in lines if "ROOT" in line or "JOINT" in line]
    assert names == ["ground_ground", "ground", "b"]


def test_loops_and_what_else_is_lost_are_told(tmp_path: Path):
    losses = write(clip("fourbar"), tmp_path / "out.bvh")
    said = {loss.what: loss.where for loss in losses.entries}
    (loop,) = [where for what, where in said.items() if what.startswith("joints that close")]
    assert loop == tuple(joint.name for joint in clip("fourbar").tree.closures)
    assert said["results of the run other than the motion"][0] == "velocities"
