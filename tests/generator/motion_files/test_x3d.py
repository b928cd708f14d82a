"""X3D: an XML reader with HAnim's own kinematics finds every site where it was simulated."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from generator.motion_files.motion import FigureMotion
from generator.motion_files.x3d import hanim_names, write
from generator.rotations import Array
from tests.motions import FIGURES, MOTIONS, all_sites, clip, site, ten_frames

WITHIN = 1e-6


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("x3d")


def numbers(text: str | None, width: int) -> Array:
    return np.array((text or "").split(), dtype=float).reshape(-1, width)


class Scene:
    """An X3D file, with the kinematics of HAnimJoint: T C R -C (ISO/IEC 19774-1, 6.3)."""

    def __init__(self, path: Path) -> None:
        self.root = ElementTree.parse(path).getroot()
        self.parents = {child: each for each in self.root.iter() for child in each}
        self.named = {each.get("DEF"): each for each in self.root.iter() if each.get("DEF")}
        routes = [route.attrib for route in self.root.iter("ROUTE")]
        clocked = {r["toNode"]: r["fromNode"] for r in routes if r["toField"] == "set_fraction"}
        self.driven = {
            (r["toNode"], r["toField"]): self.named[r["fromNode"]]
            for r in routes
            if r["fromField"] == "value_changed" and clocked[r["fromNode"]] == "clock"
        }
        self.period = float(self.named["clock"].attrib["cycleInterval"])

    def value(self, joint: ElementTree.Element, field: str, fraction: float) -> Array:
        width = 4 if field == "rotation" else 3
        source = self.driven.get((joint.attrib["DEF"], field))
        if source is None:
            return numbers(joint.get(field, "0 0 0" if width == 3 else "0 1 0 0"), width)[0]
        keys, values = numbers(source.get("key"), 1)[:, 0], numbers(source.get("keyValue"), width)
        assert len(keys) == len(values)
        assert (keys[0], keys[-1]) == (0.0, 1.0)
        if width == 3:
            return np.array([np.interp(fraction, keys, values[:, k]) for k in range(3)])
        turned = Slerp(keys, turns(values))(np.clip(fraction, keys[0], keys[-1])).as_rotvec()
        angle = np.linalg.norm(turned)
        return np.array([*(turned / angle if angle else [0.0, 1.0, 0.0]), angle])

    def pose(self, element: ElementTree.Element, fraction: float) -> Array:
        """What carries the element from the default pose to where it is."""
        above = self.parents.get(element)
        outer = np.eye(4) if above is None else self.pose(above, fraction)
        if element.tag != "HAnimJoint":
            return outer
        centre = numbers(element.get("center", "0 0 0"), 3)[0]
        turn = turns(self.value(element, "rotation", fraction)[None])[0].as_matrix()
        here = np.eye(4)
        here[:3, :3] = turn
        here[:3, 3] = self.value(element, "translation", fraction) + centre - turn @ centre
        return outer @ here


def turns(values: Array) -> Rotation:
    return Rotation.from_rotvec(values[:, :3] * values[:, 3:])


@cache
def scene(name: str, folder: Path) -> Scene:
    path = folder / f"{name}.x3d"
    write(clip(name), path)
    return Scene(path)


@pytest.mark.parametrize("name", MOTIONS)
def test_another_reader_finds_every_site_in_its_place(name: str, folder: Path):
    motion, read = clip(name), scene(name, folder)
    frames = ten_frames(motion)
    assert read.period == pytest.approx(1.0)
    for segment, place in all_sites(motion):
        element = read.named[f"{segment}_{place}"]
        start = np.array([*numbers(element.get("translation"), 3)[0], 1.0])
        fractions = [motion.times[k] / read.period for k in frames]
        found = [(read.pose(element, f) @ start)[:3] for f in fractions]
        assert np.allclose(found, site(motion, segment, place, frames), rtol=0.0, atol=WITHIN)


def test_without_a_clock_the_first_frame_is_seen(folder: Path):
    motion, read = clip("flying"), scene("flying", folder)
    read.driven, driven = {}, read.driven
    for segment, place in all_sites(motion):
        element = read.named[f"{segment}_{place}"]
        start = np.array([*numbers(element.get("translation"), 3)[0], 1.0])
        found = (read.pose(element, 0.5) @ start)[:3]
        assert np.allclose(found, site(motion, segment, place, [0])[0], atol=WITHIN)
    read.driven = driven


def test_a_human_figure_has_the_joints_of_hanim(folder: Path):
    read = scene("prototype", folder)
    joints = {e.get("name"): e for e in read.root.iter("HAnimJoint") if e.get("DEF")}
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
        assert read.parents[joints[below]] is joints[above]
    segments = {e.get("name") for e in read.root.iter("HAnimSegment") if e.get("DEF")}
    assert {"sacrum", "l5", "l_thigh", "r_calf", "l_upperarm", "r_forearm"} <= segments
    (humanoid,) = read.root.iter("HAnimHumanoid")
    listed = [e.get("USE") for e in humanoid if e.get("containerField") == "joints"]
    assert sorted(listed) == sorted(joints)


def test_the_default_pose_is_upright_with_the_arms_down(folder: Path):
    read = scene("prototype", folder)

    def centre(name: str) -> Array:
        return numbers(read.named[name].get("center"), 3)[0]

    assert np.allclose(
        centre("l_shoulder") - centre("humanoid_root"), [0.172, 0.631, 0.0], atol=1e-9
    )
    assert np.allclose(centre("l_elbow")[[0, 2]], centre("l_shoulder")[[0, 2]], atol=1e-9)
    assert centre("l_elbow")[1] < centre("l_shoulder")[1]


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
    losses = write(clip("fourbar"), tmp_path / "out.x3d")
    (lost,) = [
        loss for loss in losses.entries if loss.what.startswith("joints that HAnim does not")
    ]
    assert set(lost.where) == {b.joint.name for b in clip("fourbar").tree.joints}


def test_shapes_stand_in_the_default_pose_with_their_colours(folder: Path):
    read = scene("prototype", folder)
    (thigh,) = [e for e in read.root.iter("HAnimSegment") if e.get("DEF") == "l_thigh"]
    points = numbers(next(thigh.iter("Coordinate")).get("point"), 3)
    hip = numbers(read.named["l_hip"].get("center"), 3)[0]
    knee = numbers(read.named["l_knee"].get("center"), 3)[0]
    assert points[:, 1].max() == pytest.approx(hip[1], abs=0.1)
    assert points[:, 1].min() == pytest.approx(knee[1], abs=0.1)
    assert next(thigh.iter("Material")).get("diffuseColor") == "1 0.37 0"
    faces = next(thigh.iter("IndexedFaceSet")).attrib["coordIndex"].split("-1")
    assert len(faces) - 1 == sum(
        line.rstrip().endswith(";") and line.strip() != ";;"
        for line in (FIGURES / "eupleg.pss").read_text(encoding="utf-8").splitlines()
    )


def test_odd_names_are_escaped(tmp_path: Path):
    motion: FigureMotion = clip("fourbar")
    header = replace(motion.header, message='a <b> & "c" \x01 \ufffe')
    write(replace(motion, header=header), tmp_path / "out.x3d")
    root = ElementTree.parse(tmp_path / "out.x3d").getroot()
    said = {e.get("name"): e.get("content") for e in root.iter("meta")}
    assert said["message"] == 'a <b> & "c" ? ?'
