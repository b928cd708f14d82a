"""X3D: the humanoid of HAnim; `tests/properties` finds every site by its kinematics."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.motion_files.motion import FigureMotion
from generator.motion_files.x3d import hanim_names, write
from generator.rotations import Array
from tests.motion_readers import X3d, numbers
from tests.motions import FIGURES, any_motion, shipped, standing

Written = Callable[[FigureMotion], X3d]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    def write_and_read(motion: FigureMotion) -> X3d:
        write(motion, tmp_path / "out.x3d")
        return X3d(tmp_path / "out.x3d")

    return write_and_read


@pytest.fixture(scope="module")
def prototype(tmp_path_factory: pytest.TempPathFactory) -> X3d:
    path = tmp_path_factory.mktemp("x3d") / "prototype.x3d"
    write(standing(shipped("prototype")), path)
    return X3d(path)


def test_without_a_clock_the_first_frame_is_seen(written: Written):
    motion = any_motion(shipped("prototype"), is_free=True)
    read = written(motion)
    read.driven = {}
    for name, segment in motion.figure.segments.items():
        for site in segment.sites.values():
            (found,) = read.pose(f"{name}_{site.name}")
            expected = motion.poses[name][0] @ site.pose_in_segment
            assert np.allclose(found, expected, atol=1e-6)


def test_a_human_figure_has_the_joints_of_hanim(prototype: X3d):
    joints = {e.get("name"): e for e in prototype.root.iter("HAnimJoint") if e.get("DEF")}
    assert set(joints) == {
        "humanoid_root",
        "vl5",
        *(f"{side}_{name}" for side in "lr" for name in ("hip", "knee", "shoulder", "elbow")),
    }
    for below, above in (
        ("l_knee", "l_hip"),
        ("l_hip", "humanoid_root"),
        ("r_elbow", "r_shoulder"),
    ):
        assert prototype.parents[joints[below]] is joints[above]
    segments = {e.get("name") for e in prototype.root.iter("HAnimSegment") if e.get("DEF")}
    assert {"sacrum", "l5", "l_thigh", "r_calf", "l_upperarm", "r_forearm"} <= segments
    (humanoid,) = prototype.root.iter("HAnimHumanoid")
    listed = [e.get("USE") for e in humanoid if e.get("containerField") == "joints"]
    assert sorted(listed) == sorted(joints)


def centre(read: X3d, name: str) -> Array:
    return numbers(read.named[name], "center", 3)[0]


def test_the_default_pose_is_upright_with_the_arms_down(prototype: X3d):
    shoulder, elbow = centre(prototype, "l_shoulder"), centre(prototype, "l_elbow")
    assert np.allclose(shoulder - centre(prototype, "humanoid_root"), [0.172, 0.631, 0], atol=1e-9)
    assert np.allclose(elbow[[0, 2]], shoulder[[0, 2]], atol=1e-9)
    assert elbow[1] < shoulder[1]


@pytest.mark.parametrize(
    ("joint", "names"),
    [
        ("left_knee", ("l_knee", "l_calf")),
        ("right_hip_joint", ("r_hip", "r_thigh")),
        ("waist", ("vl5", "l5")),
        ("left_clavicle", ("l_sternoclavicular", "l_clavicle")),
        ("crank_pin", None),
        ("leftish_knee", None),
    ],
)
def test_names_of_joints(joint: str, names: tuple[str, str] | None):
    assert hanim_names(joint) == names


def test_what_hanim_does_not_know_is_told(tmp_path: Path):
    motion = standing(shipped("fourbar"))
    losses = write(motion, tmp_path / "out.x3d")
    start = "joints that HAnim does not"
    (lost,) = [loss for loss in losses.entries if loss.what.startswith(start)]
    assert set(lost.where) == {b.joint.name for b in motion.tree.joints}


def test_shapes_stand_in_the_default_pose_with_their_colours(prototype: X3d):
    (thigh,) = [e for e in prototype.root.iter("HAnimSegment") if e.get("DEF") == "l_thigh"]
    points = numbers(next(thigh.iter("Coordinate")), "point", 3)
    assert points[:, 1].max() == pytest.approx(centre(prototype, "l_hip")[1], abs=0.1)
    assert points[:, 1].min() == pytest.approx(centre(prototype, "l_knee")[1], abs=0.1)
    assert next(thigh.iter("Material")).get("diffuseColor") == "1 0.37 0"
    faces = next(thigh.iter("IndexedFaceSet")).attrib["coordIndex"].split("-1")
    assert len(faces) - 1 == sum(
        line.rstrip().endswith(";") and line.strip() != ";;"
        for line in (FIGURES / "eupleg.pss").read_text(encoding="utf-8").splitlines()
    )


def test_odd_names_are_escaped(written: Written):
    motion = standing(shipped("fourbar"))
    header = replace(motion.header, message='a <b> & "c" \x01 \ufffe')
    assert written(replace(motion, header=header)).meta["message"] == 'a <b> & "c" ? ?'
