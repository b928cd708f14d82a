"""`mover link`: what follows, and the pose that it writes."""

import json

import pytest
from typer.testing import CliRunner

from generator.cli.app import app
from generator.figure_file import read_figure
from generator.input_files.pose import read_pose

LINKS = """
figure = "prototype"

[[link]]
joints = ["right_elbow"]
control = "left_elbow"
factor = 0.5
offset_deg = 5

[[link]]
joints = ["right_shoulder"]
control = "left_shoulder"
mirror = true

[[link]]
joints = ["left_knee"]
control = "right_elbow"
factor = 2
"""


def mover(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def links(tmp_path):
    path = tmp_path / "my.links.toml"
    path.write_text(LINKS, encoding="utf-8")
    return path


def joints_of(done):
    return {one["name"]: one["displacement"] for one in json.loads(done.stdout)["joints"]}


def test_what_is_set_is_followed(links):
    words = ("--set", "left_elbow=30", "--set", "left_shoulder=10,20,30")
    done = mover("link", "prototype", links, *words, "--json")
    assert done.exit_code == 0
    joints = joints_of(done)
    assert joints["right_elbow"] == pytest.approx([20.0])
    assert joints["left_knee"] == pytest.approx([40.0])
    assert joints["right_shoulder"] == pytest.approx([10.0, 20.0, 30.0])
    assert joints["waist"] == [0.0, 0.0, 0.0]
    text = mover("link", "prototype", links, *words).stdout
    assert "left_knee 1       1 * left_elbow 1 + 10 deg" in text
    assert "right_elbow     20 deg" in text
    assert "waist" not in text


def test_the_pose_that_it_writes_follows_and_stays(links, tmp_path):
    path, again = tmp_path / "a.pose", tmp_path / "b.pose"
    assert mover("link", "prototype", links, "--set", "left_elbow=30", "-o", path).exit_code == 0
    pose = read_pose(path, read_figure("prototype"))
    assert pose["right_elbow"] == pytest.approx(pose["left_elbow"] * 0.5 + 5 * 0.017453292519943295)
    assert mover("link", "prototype", links, "--pose", path, "-o", again).exit_code == 0
    assert again.read_text() == path.read_text()


def test_the_links_are_told_resolved(links):
    data = json.loads(mover("link", "prototype", links, "--json").stdout)
    assert data["links"][-1] == {
        "joint": "left_knee",
        "dof": 1,
        "control": "left_elbow",
        "control_dof": 1,
        "factor": 1.0,
        "offset": pytest.approx(10.0),
        "unit": "deg",
    }


def test_a_follower_goes_nowhere_else(links):
    done = mover("link", "prototype", links, "--set", "left_knee=3")
    assert done.exit_code == 2
    assert "left_knee 1 follows left_elbow 1 and is at 10 deg, not 3 deg" in done.stderr
    agreed = ("--set", "left_elbow=30", "--set", "left_knee=40")
    assert mover("link", "prototype", links, *agreed).exit_code == 0


def test_factors_beyond_reason_are_told(tmp_path):
    path = tmp_path / "big.links.toml"
    path.write_text('[[link]]\njoints = ["left_knee"]\ncontrol = "right_knee"\nfactor = 1e299\n')
    done = mover("link", "prototype", path, "--set", "right_knee=9e3", "--json")
    assert done.exit_code == 1
    assert f"{path}:4:10: error: no joint follows another by such a factor" in done.stderr


def test_links_that_open_a_loop_are_refused(tmp_path):
    path = tmp_path / "bar.links.toml"
    path.write_text('[[link]]\njoints = ["crank_pin"]\ncontrol = "rocker_bearing"\n')
    assert mover("pose", "fourbar", "--set", "crank_bearing=95").exit_code == 0
    done = mover("link", "fourbar", path, "--set", "crank_bearing=95", "--json")
    assert done.exit_code == 1
    assert "loop" in done.stderr


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[link]]\njoints = ["left_elbw"]\ncontrol = "left_elbow"\n', "did you mean `left_elbow`"),
        ("", "there is no link in this file"),
    ],
)
def test_wrong_links_are_wrong_input(tmp_path, text, said):
    path = tmp_path / "my.links.toml"
    path.write_text(text, encoding="utf-8")
    done = mover("link", "prototype", path)
    assert done.exit_code == 1
    assert said in done.stderr


def test_missing_and_unwritable_files_are_told(links, tmp_path):
    done = mover("link", "prototype", tmp_path / "none.toml")
    assert done.exit_code == 1
    assert "cannot be read: no such file" in done.stderr
    done = mover("link", "prototype", links, "-o", tmp_path / "none" / "a.pose")
    assert done.exit_code == 1
    assert "cannot be written" in done.stderr
    assert mover("link", "prototype", links, "-o", tmp_path / "a.txt").exit_code == 2
    assert mover("link", "prototype", links, "--set", "left_elbow").exit_code == 2
