"""`mover shoulder`: what it says and what it writes."""

import json
import re

import numpy as np
import pytest

from generator.cli.shoulder import Rhythm
from generator.figure_file import read_figure
from generator.input_files.pose import read_pose
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.shoulder import RHYTHMS
from generator.kinematics.tree import build_tree
from tests.command import run
from tests.paths import DOCS


def ask(latitude, longitude, *more, side="left", figure="clavicles"):
    words = ("--side", side, "--latitude", latitude, "--longitude", longitude)
    return run("shoulder", figure, *words, *more)


def test_the_choices_are_those_of_the_library():
    assert {rhythm.value for rhythm in Rhythm} == set(RHYTHMS)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("rhythm", sorted(RHYTHMS))
def test_the_pose_that_it_writes_points_the_elbow(tmp_path, side, rhythm):
    path = tmp_path / "arm.pose"
    done = ask(60, 30, "--rhythm", rhythm, "-o", path, side=side)
    assert f"wrote {path}" in done.stdout
    figure = read_figure("clavicles")
    given = read_pose(path, figure)
    assert set(given) == {f"{side}_clavicle", f"{side}_shoulder"}
    tree = build_tree(figure)
    poses = forward_kinematics(tree, {**initial_displacements(tree), **given}).poses
    along = poses[f"{side}_lower_arm"][:3, 3] - poses[f"{side}_upper_arm"][:3, 3]
    outwards = 1.0 if side == "left" else -1.0
    sine, cosine = np.sin(np.radians(60.0)), np.cos(np.radians(60.0))
    asked = [outwards * sine * 0.5, cosine, sine * np.cos(np.radians(30.0))]
    miss = np.degrees(np.arccos(np.clip(along @ asked / np.linalg.norm(along), -1.0, 1.0)))
    assert miss < 0.1


def test_the_json_has_what_the_text_says():
    data = json.loads(ask(90, 0, "--json").stdout)
    assert data["angles_deg"]["clavicle_elevation"] == pytest.approx(21.3074)
    assert data["angles_deg"]["humerus_elevation"] == pytest.approx(90.0 - 21.3074)
    assert abs(data["angles_deg"]["twist"]) == pytest.approx(180.0)
    assert data["displacements"]["left_clavicle"] == pytest.approx([21.3074, 18.0])
    assert data["elbow_error_deg"] < 0.1
    assert data["printed_miss_deg"] > 10.0
    assert data["near"] == []
    assert data["files"] == []
    text = ask(90, 0).stdout
    assert f"would miss by {data['printed_miss_deg']:.1f} deg" in text
    assert "21.307,18.000" in text
    assert "Near a discontinuity" not in text


def test_the_table_of_the_page_is_what_the_command_says():
    page = (DOCS / "shoulder.md").read_text(encoding="utf-8")
    row = re.compile(r"^\| (\d+), (\d+)[ a-z]*\| ([-0-9., ]+) \| ([-0-9., ]+) \|$", re.MULTILINE)
    rows = row.findall(page)
    assert len(rows) == 4
    for latitude, longitude, *printed in rows:
        for rhythm, numbers in zip(("otani", "de_groot_brand"), printed, strict=True):
            data = json.loads(ask(latitude, longitude, "--rhythm", rhythm, "--json").stdout)
            angles = data["angles_deg"]
            said = (
                angles["clavicle_elevation"],
                angles["clavicle_abduction"],
                data["printed_miss_deg"],
            )
            told = [float(number) for number in numbers.split(",")]
            assert told == pytest.approx(said, abs=0.051)


def test_jumps_near_by_are_told():
    told = ask(40, 224).stdout
    assert "Near a discontinuity, where a small motion of the arm changes an angle by much:" in told
    assert "twist jumps by 40 deg" in told
    assert "the seam behind the back" in told
    (near,) = json.loads(ask(40, 224, "--json").stdout)["near"]
    assert near["angle"] == "twist"
    assert near["size_deg"] == pytest.approx(40.0, abs=1e-4)


def test_the_modern_rhythm_is_named_with_its_reference():
    assert (
        "rhythm de_groot_brand: J. H. de Groot" in ask(90, 0, "--rhythm", "de_groot_brand").stdout
    )


def test_a_figure_without_clavicles_is_posed_from_the_torso():
    done = ask(90, 0, figure="prototype", side="right")
    assert "no joint `right_clavicle`: the arm turns on the torso" in done.stdout
    data = json.loads(ask(90, 0, "--json", figure="prototype", side="right").stdout)
    assert data["displacements"] == {"right_shoulder": pytest.approx([0.0, 0.0, 90.0])}
