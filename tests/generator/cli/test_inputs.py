"""`mover pose`, `mover com` and `mover stability`: what they say, what they write, how they end."""

import json
import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from generator import read_action, read_figure, read_pose
from generator.cli.app import app
from generator.kinematics.centre_of_mass import centre_of_mass
from generator.kinematics.free_root import detach_root
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.motion_files import format_action
from generator.motion_files.action import ActionFile
from generator.motion_files.motion import Header
from generator.recording import Ending
from tests.paths import FIGURES

PROTOTYPE = FIGURES / "prototype.fig"


def mover(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def answer(*words: object) -> dict:
    result = mover(*words, "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def failure(*words: object) -> tuple[int, str]:
    """Exit code and message; the standard output has nothing for people, and JSON on demand."""
    result = mover(*words)
    assert result.stdout == ""
    assert "error: " in result.stderr
    again = mover(*words, "--json")
    assert again.exit_code == result.exit_code
    assert "error" in json.loads(again.stdout)
    return result.exit_code, result.stderr


@cache
def prototype():
    return build_tree(read_figure(PROTOTYPE))


def motion(path: Path, figure, displacements, times) -> Path:
    """An action file of a motion that is made up."""
    header = Header(
        "prototype.fig", None, times[0], times[-1], None, "none", "none", Ending.DONE, "done"
    )
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    action = ActionFile(header, chains, np.array(times), displacements)
    path.write_text(format_action(action), encoding="utf-8")
    return path


@pytest.fixture
def bending(tmp_path) -> Path:
    """The waist bends back by 5 degrees a frame."""
    times = [0.1 * k for k in range(8)]
    values = initial_displacements(prototype())
    rows = {name: np.tile(value, (8, 1)) for name, value in values.items()}
    rows["waist"] = np.radians(np.outer(np.arange(8), [0.0, 0.0, -5.0]))
    return motion(tmp_path / "bending.action", prototype().figure, rows, times)


@pytest.mark.parametrize("command", ["pose", "com", "stability"])
def test_help_is_there(command):
    result = mover(command, "--help")
    assert result.exit_code == 0
    assert "FIGURE" in result.stdout


# pose


def test_the_pose_of_the_standing_prototype():
    said = answer("pose", "prototype")
    assert {joint["name"]: joint["displacement"] for joint in said["joints"]}["waist"] == [0, 0, 0]
    segments = {segment["name"]: segment for segment in said["segments"]}
    assert segments["left_upper_arm"]["sites_cm"]["proximal"] == pytest.approx([17.2, 157.2, 0.0])
    assert segments["left_upper_arm"]["position_cm"] == pytest.approx([17.2, 157.2, 0.0])
    assert np.linalg.det(segments["left_upper_arm"]["rotation"]) == pytest.approx(1.0)


def test_a_pose_is_shown_in_degrees_and_centimetres():
    text = mover("pose", "prototype", "--set", "left_elbow=90").stdout
    rows = [line.split() for line in text.splitlines()]
    assert ["left_elbow", "90.0000", "deg"] in rows
    # The left forearm points forward from the elbow, 17.2 cm to the left at 123.8 cm.
    assert ["left_lower_arm.distal", "17.20", "123.80", "28.80"] in rows


def test_a_pose_goes_into_a_file_and_comes_back(tmp_path):
    path = tmp_path / "bent.pose"
    sets = ["--set", "waist=1,2,3.3", "--set", "left_knee=0.1"]
    first = answer("pose", "prototype", *sets, "-o", path)
    assert first["files"] == [str(path)]
    second = answer("pose", "prototype", "--pose", path)
    assert second["joints"] == first["joints"]
    assert second["segments"] == first["segments"]
    third = answer("pose", "prototype", "--pose", path, "--set", "waist=0,0,0")
    assert third["joints"][0]["displacement"] == [0.0, 0.0, 0.0]
    assert third["joints"][1:] == first["joints"][1:]


def test_a_pose_goes_into_a_figure(tmp_path):
    path = tmp_path / "bent.fig"
    said = answer("pose", "prototype", "--set", "waist=1,2,3.3", "-o", path)
    figure = read_figure(path)
    assert figure.joints["waist"].displacement == tuple(
        read_pose_text(tmp_path, "joint waist { displacement = (1deg,2deg,3.3deg); }")["waist"]
    )
    assert figure.segments == prototype().figure.segments
    assert answer("pose", path)["segments"] == said["segments"]


def read_pose_text(folder: Path, text: str):
    (folder / "text.pose").write_text(text, encoding="utf-8")
    return read_pose(folder / "text.pose", prototype().figure)


def test_loops_are_closed_around_what_is_asked_for(tmp_path):
    path = tmp_path / "four.pose"
    first = answer("pose", "fourbar", "--set", "crank_bearing=200", "-o", path)
    shown = {joint["name"]: joint["displacement"][0] for joint in first["joints"]}
    assert shown["crank_bearing"] == pytest.approx(200.0, abs=1e-9)
    assert shown["crank_pin"] != pytest.approx(-90.0, abs=1.0)
    sites = {s["name"]: s["sites_cm"] for s in first["segments"]}
    assert sites["coupler"]["far"] == pytest.approx(sites["rocker"]["far"], abs=1e-7)
    again = answer("pose", "fourbar", "--pose", path)
    assert again["joints"] == first["joints"]
    moved = answer("pose", "fourbar", "--pose", path, "--set", "crank_bearing=150")
    shown = {joint["name"]: joint["displacement"][0] for joint in moved["joints"]}
    assert shown["crank_bearing"] == pytest.approx(150.0, abs=1e-9)


def test_a_run_starts_from_a_pose(tmp_path):
    pose, out = tmp_path / "bent.pose", tmp_path / "fall.action"
    answer("pose", "prototype", "--set", "waist=0,0,20", "--set", "left_knee=30", "-o", pose)
    words = ["--stop", 0.02, "--step", 0.002, "--springs", "none", "-o", out, "--quiet"]
    result = mover("simulate", "prototype", "--pose", pose, "--set", "left_knee=40", *words)
    assert result.exit_code == 0, result.stderr
    first = {name: rows[0] for name, rows in read_action(out).displacements.items()}
    assert first["waist"] == pytest.approx(np.radians([0.0, 0.0, 20.0]), abs=1e-12)
    assert first["left_knee"] == pytest.approx(np.radians([40.0]), abs=1e-12)


# com


def test_the_centre_of_mass_of_a_pose():
    said = answer("com", "prototype", "--set", "left_elbow=90")
    tree = prototype()
    values = {**initial_displacements(tree), "left_elbow": np.array([np.pi / 2])}
    expected = 100.0 * centre_of_mass(forward_kinematics(tree, values))
    assert said["centre_of_mass_cm"] == pytest.approx(expected.tolist(), abs=1e-12)
    assert said["mass_kg"] == pytest.approx(49.27798)
    parts = [(part["mass_kg"], part["centre_of_mass_cm"]) for part in said["segments"]]
    mean = sum(mass * np.array(where) for mass, where in parts) / said["mass_kg"]
    assert mean == pytest.approx(expected)
    assert "49.28 kg" in mover("com", "prototype").stdout


def test_the_slopes_are_what_a_degree_more_brings():
    bent = ["--set", "waist=0,0,20"]
    slopes = answer("com", "prototype", *bent)["slopes"]
    assert len(slopes) == 22
    flexion = next(one for one in slopes if (one["joint"], one["displacement"]) == ("waist", 3))
    assert flexion["unit"] == "cm/deg"
    ends = [
        np.array(answer("com", "prototype", "--set", f"waist=0,0,{bend}")["centre_of_mass_cm"])
        for bend in (20.5, 19.5)
    ]
    assert flexion["slope"] == pytest.approx((ends[0] - ends[1]).tolist(), abs=1e-4)


def test_the_centre_of_mass_of_some_segments():
    said = answer("com", "prototype", "--segments", "left_lower_leg, left_upper_leg")
    assert [part["name"] for part in said["segments"]] == ["left_lower_leg", "left_upper_leg"]
    assert said["mass_kg"] == pytest.approx(12.20632)


def test_the_centre_of_mass_along_a_motion(bending, tmp_path):
    table = tmp_path / "com.csv"
    said = answer("com", "prototype", "--along", bending, "-o", table)
    lines = table.read_text(encoding="utf-8").splitlines()
    head = [line for line in lines if line.startswith("#")]
    assert "# figure prototype.fig" in head
    assert any(line.startswith("# segments right_lower_leg left_lower_leg") for line in head)
    assert lines[len(head)] == "time [s],x [cm],y [cm],z [cm]"
    rows = np.array([line.split(",") for line in lines[len(head) + 1 :]], dtype=float)
    assert rows[:, 0].tolist() == said["times_s"]
    assert rows[:, 1:] == pytest.approx(np.array(said["centre_of_mass_cm"]), abs=1e-12)
    for k in range(8):
        bent = answer("com", "prototype", "--set", f"waist=0,0,{-5 * k}")
        assert rows[k, 1:].tolist() == pytest.approx(bent["centre_of_mass_cm"], abs=1e-9)
    assert "8 frames, 0 to 0.7 s" in mover("com", "prototype", "--along", bending).stdout


def test_a_motion_of_the_figure_let_go(tmp_path):
    freed, values = detach_root(prototype().figure, initial_displacements(prototype()))
    rows = {name: np.tile(value, (2, 1)) for name, value in values.items()}
    rows["lower_torso"] = rows["lower_torso"] + [[0.0] * 6, [0, 0, 0, 0.1, -0.2, 0.3]]
    path = motion(tmp_path / "free.action", freed, rows, [0.0, 1.0])
    first, last = np.array(answer("com", "prototype", "--along", path)["centre_of_mass_cm"])
    assert last - first == pytest.approx([10.0, -20.0, 30.0])


# stability


def test_the_standing_figure_is_balanced():
    said = answer("stability", "prototype", "--below", "0cm")
    assert said["balance"] == "inside"
    assert said["margin_cm"] == pytest.approx(5.0443186, abs=1e-6)
    assert said["direction"] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)
    assert {said["corners"][k]["of"] for k in said["pivot"]} == {
        "left_lower_leg:496",
        "right_lower_leg:496",
    }
    text = mover("stability", "prototype", "--below", "0cm").stdout
    assert "prototype: balanced, the centre of mass is 5.04 cm inside the edge" in text


@pytest.mark.parametrize(
    ("words", "balance", "said"),
    [
        (["--below=-5 mm"], "unsupported", "not balanced, nothing supports the figure"),
        (["--support", "body_root.base"], "outside", "is a single point and the centre of mass"),
        (
            ["--support", "left_lower_leg.distal", "--support", "right_lower_leg.distal"],
            "outside",
            "is a single line and the centre of mass is 0.44 cm off it",
        ),
        (["--support", "left_lower_leg"], "outside", "cm outside the support"),
        (["--below", "0", "--set", "waist=0,0,-60"], "outside", "cm outside the support"),
        (["--support", "left_lower_leg:496, 497"], "outside", "cm outside the support"),
    ],
)
def test_what_does_not_stand_is_told_in_a_sentence(words, balance, said):
    data = answer("stability", "prototype", *words)
    assert data["balance"] == balance
    assert said in data["sentence"]
    assert data["sentence"] in mover("stability", "prototype", *words).stdout
    assert (data["margin_cm"] is None) is (balance == "unsupported")


def top(folder: Path, body: str) -> Path:
    """A figure that stands on the tip of its one segment."""
    path = folder / "top.fig"
    path.write_text(
        "figure { segment floor { mass=-1g; site a->location=trans(0,0,0); }"
        f"segment top {{ {body} }}"
        "joint ball { connect floor.a to top.tip; type=R(1,0,0)*R(0,1,0)*R(0,0,1); }"
        "root=floor.a; }",
        encoding="utf-8",
    )
    return path


def test_a_point_right_under_the_centre_is_on_the_verge(tmp_path):
    body = "mass=1kg; inertia=(1,1,1); site tip->location=trans(0,0,0);"
    figure = top(tmp_path, body + "site CM->location=trans(0,5cm,0);")
    said = answer("stability", figure, "--support", "top.tip")
    assert (said["balance"], said["margin_cm"], said["direction"]) == ("on the edge", 0.0, None)
    assert said["sentence"] == (
        "marginal, the support is a single point directly below the centre of mass"
    )
    leaning = answer("stability", figure, "--support", "top.tip", "--set", "ball=0,0,90")
    assert leaning["margin_cm"] == pytest.approx(-5.0)


def test_the_ground_may_have_another_normal():
    said = answer("stability", "prototype", "--support", "center_torso", "--up", "0,0,-3")
    assert said["up"] == [0.0, 0.0, -1.0]
    lying = answer("stability", "prototype", "--support", "center_torso", "--up", "0,0,-1")
    assert lying["margin_cm"] == said["margin_cm"]
    assert all(corner["on_ground_cm"][2] == 0.0 for corner in said["corners"])


def test_the_stability_along_a_motion(bending, tmp_path):
    table = tmp_path / "standing.csv"
    said = answer("stability", "prototype", "--below", "0", "--along", bending, "-o", table)
    assert said["balance"] == ["inside"] * 5 + ["outside"] * 3
    lines = [li for li in table.read_text(encoding="utf-8").splitlines() if li[0] != "#"]
    assert lines[0] == "time [s],balance,margin [cm],x [cm],y [cm],z [cm]"
    for k, line in enumerate(lines[1:]):
        time, balance, margin, *centre = line.split(",")
        one = answer("stability", "prototype", "--below", "0", "--set", f"waist=0,0,{-5 * k}")
        assert float(time) == pytest.approx(0.1 * k)
        assert balance == one["balance"]
        assert float(margin) == pytest.approx(one["margin_cm"], abs=1e-9)
        assert list(map(float, centre)) == pytest.approx(one["centre_of_mass_cm"], abs=1e-9)
    text = mover("stability", "prototype", "--below", "0", "--along", bending).stdout
    assert "5 inside, 3 outside" in text
    assert "first not balanced" in text
    assert "0.5 s" in text


def test_frames_without_support_have_no_margin(bending, tmp_path):
    table = tmp_path / "air.csv"
    said = answer("stability", "prototype", "--below=-1cm", "--along", bending, "-o", table)
    assert said["margin_cm"] == [None] * 8
    assert table.read_text(encoding="utf-8").splitlines()[-1].split(",")[1:3] == ["unsupported", ""]


# What is wrong


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["pose", "prototype", "--set", "left_kne=3"], "did you mean `left_knee`?"),
        (["pose", "prototype", "--set", "waist=3"], "takes 3 values"),
        (["pose", "prototype", "-o", "x.txt"], "known are .pose, .fig"),
        (["pose", "prototype", "-o", "x"], "the suffix is missing"),
        (["com", "prototype", "--segments", "waist"], "no segment `waist`"),
        (["com", "prototype", "--segments", ""], "no segment ``"),
        (["com", "prototype", "--segments", "body_root"], "part of the ground"),
        (["com", "prototype", "-o", "x.csv"], "add --along"),
        (
            ["com", "prototype", "-o", "x.txt", "--along", "a.action"],
            "the table must be a .csv file",
        ),
        (
            ["com", "prototype", "--along", "a.action", "--set", "waist=0,0,0"],
            "leave out --pose and --set",
        ),
        (["stability", "prototype"], "give either --support or --below"),
        (
            ["stability", "prototype", "--below", "1cm", "--support", "a"],
            "give either --support or",
        ),
        (["stability", "prototype", "--below", "high"], "expected a length such as 1cm"),
        (["stability", "prototype", "--below", "1kg"], "not a unit of a length"),
        (["stability", "prototype", "--below", "1cn"], "unknown unit `cn`"),
        (["stability", "prototype", "--below", "1e999cm"], "a length is at most 1e9 m"),
        (["stability", "prototype", "--below", "1e12cm"], "a length is at most 1e9 m"),
        (["stability", "prototype", "--below", "1"], "the unit is missing; give one of cm, m"),
        (["pose", "prototype", "--set", "left_knee=1e100"], "`1e100` is beyond 1e6 deg"),
        (["pose", "prototype", "--set", "left_knee=-1.1e6"], "`-1.1e6` is beyond 1e6 deg"),
        (["stability", "prototype", "--below", "nan"], "expected a length"),
        (["stability", "prototype", "--support", "left_leg"], "no segment `left_leg`"),
        (["stability", "prototype", "--support", "left_lower_leg:627"], "no face 627"),
        (["stability", "prototype", "--support", "left_lower_leg:"], "expected SEGMENT"),
        (["stability", "prototype", "--support", "left_lower_leg:x"], "expected SEGMENT"),
        (["stability", "prototype", "--support", "left_lower_leg.top"], "no site `top`"),
        (["stability", "prototype", "--support", ""], "expected SEGMENT"),
        (["stability", "prototype", "--below", "1cm", "--up", "0,0,0"], "must not be zero"),
        (["stability", "prototype", "--below", "1cm", "--up", "0,nan,0"], "finite"),
        (["stability", "prototype", "--below", "1cm", "--up", "up"], "X,Y,Z"),
    ],
)
def test_a_wrong_command_line_is_told(words, message):
    code, said = failure(*words)
    assert code == 2
    assert message in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["pose", "prototipe"], "did you mean `prototype`?"),
        (["pose", "prototype", "--pose", "none.pose"], "cannot be read"),
        (["pose", "prototype", "-o", "none/x.pose"], "there is no directory"),
        (["com", "prototype", "--along", "none.action"], "cannot be read"),
        (["stability", "prototype", "--below", "1cm", "--along", PROTOTYPE], "expected `action`"),
        (["stability", "prototype", "--support", "body_root"], "no psurf"),
    ],
)
def test_wrong_input_is_told(words, message):
    code, said = failure(*words)
    assert code == 1
    assert message in said


def test_a_wrong_pose_file_is_told_with_its_places(tmp_path):
    path = tmp_path / "bad.pose"
    path.write_text(
        "joint left_kne { displacement = (3deg); }\njoint waist { displacement = (1); }"
    )
    for command in (
        ["pose"],
        ["com"],
        ["stability", "--below", "1cm"],
        ["simulate", "--stop", "0.1"],
    ):
        code, said = failure(command[0], "prototype", *command[1:], "--pose", path)
        assert code == 1
        assert f"{path}:1:7: error: the figure has no joint `left_kne`" in said
        assert f"{path}:2:30: error: 1 value instead of 3" in said


def test_a_loop_that_cannot_close_is_told():
    code, said = failure("pose", "fourbar", "--set", "crank_bearing=0", "--set", "rocker_bearing=0")
    assert code == 1
    assert "opens the loop" in said


def test_a_motion_of_another_figure_is_told(bending):
    assert "unknown to the figure" in failure("com", "pendulum", "--along", bending)[1]


def test_a_motion_with_other_axes_is_told(bending, tmp_path):
    path = tmp_path / "other.action"
    text = bending.read_text(encoding="utf-8")
    path.write_text(text.replace("left_knee R(0,-1,0)", "left_knee R(0,1,0)"), encoding="utf-8")
    said = failure("com", "prototype", "--along", path)[1]
    assert "joint `left_knee` has different axes in the motion and in the figure" in said


def test_a_motion_of_the_figure_as_it_was_is_warned_of(bending, tmp_path):
    path = tmp_path / "old.action"
    text = bending.read_text(encoding="utf-8")
    path.write_text(text.replace("sha256 none", f"sha256 {'0' * 64}"), encoding="utf-8")
    result = mover("com", "prototype", "--along", path)
    assert result.exit_code == 0
    assert "warning" in result.stderr
    assert "another version of" in result.stderr
    assert "another version of" not in mover("com", "prototype", "--along", bending).stderr


def test_a_figure_is_not_written_over():
    before = PROTOTYPE.read_bytes()
    code, said = failure("pose", PROTOTYPE, "--set", "left_knee=3", "-o", PROTOTYPE)
    assert (code, PROTOTYPE.read_bytes()) == (1, before)
    assert "the command reads it" in said


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_in_is_told(tmp_path):
    tmp_path.chmod(0o500)
    code, said = failure("pose", "prototype", "-o", tmp_path / "x.pose")
    assert (code, "permission denied" in said) == (1, True)


@pytest.mark.parametrize("length", ["1e300", "1", "1e-300", "5e-324"])
def test_the_length_of_up_does_not_matter(length):
    words = ("stability", "prototype", "--below", "0cm")
    assert answer(*words, "--up", f"0,{length},0") == answer(*words)


def test_a_link_to_no_folder_is_told_by_where_it_leads(tmp_path):
    (tmp_path / "x.pose").symlink_to("nowhere/x.pose")
    code, said = failure("pose", "prototype", "-o", tmp_path / "x.pose")
    assert (code, f"there is no directory `{tmp_path / 'nowhere'}`" in said) == (1, True)


def test_a_displacement_may_be_as_large_as_is_said():
    said = answer("pose", "prototype", "--set", "left_knee=1e6")
    (knee,) = (joint for joint in said["joints"] if joint["name"] == "left_knee")
    assert knee["displacement"] == pytest.approx([1e6])


def test_poses_out_of_this_world_are_refused(tmp_path):
    freed, values = detach_root(prototype().figure, initial_displacements(prototype()))
    rows = {name: np.tile(value, (2, 1)) for name, value in values.items()}
    rows["lower_torso"][1, 4] = 1e300
    path = motion(tmp_path / "far.action", freed, rows, [0.0, 1.0])
    for command in (["com"], ["stability", "--below", "1cm"]):
        code, said = failure(command[0], "prototype", *command[1:], "--along", path)
        assert code == 1
        assert "segment `lower_torso` is more than" in said


def test_a_body_out_of_this_world_is_refused(tmp_path):
    text = 'mass=1kg; inertia=(1,1,1); psurf="far.pss"; site tip->location=trans(0,0,0);'
    path = top(tmp_path, text + "site CM->location=trans(1e300cm,1e300cm,0);")
    for command in (["com"], ["stability", "--support", "top.tip"]):
        assert "the centre of mass" in failure(command[0], path, *command[1:])[1]
    path = top(tmp_path, text + "site CM->location=trans(0,0,0);")
    (tmp_path / "far.pss").write_text("1e300 0 0\n0 1e300 0\n0 0 1e300\n;;\n1 2 3;\n;;\n")
    code, said = failure("stability", path, "--support", "top")
    assert (code, "a point of support is more than" in said) == (1, True)


def test_a_figure_without_masses_has_no_centre(tmp_path):
    path = tmp_path / "light.fig"
    text = PROTOTYPE.read_text(encoding="utf-8").replace("mass = 1815.81g;", "", 1)
    path.write_text(text, encoding="utf-8")
    code, said = failure("com", path)
    assert (code, "segment `right_lower_arm` has no mass" in said) == (1, True)
    assert answer("com", path, "--segments", "left_lower_arm")["mass_kg"] == pytest.approx(1.81581)
