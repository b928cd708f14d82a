"""`mover link`: what follows, and the pose that it writes."""

import pytest

from generator.figure_file import read_figure
from generator.input_files.pose import read_pose
from tests.command import answer, run

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


@pytest.fixture
def links(tmp_path):
    path = tmp_path / "my.links.toml"
    path.write_text(LINKS, encoding="utf-8")
    return path


def test_joints_follow_what_is_set(links):
    words = (
        "link",
        "prototype",
        links,
        "--set",
        "left_elbow=30",
        "--set",
        "left_shoulder=10,20,30",
    )
    joints = {one["name"]: one["displacement"] for one in answer(*words)["joints"]}
    assert joints["right_elbow"] == pytest.approx([20.0])
    assert joints["left_knee"] == pytest.approx([40.0])
    assert joints["right_shoulder"] == pytest.approx([10.0, 20.0, 30.0])
    assert joints["waist"] == [0.0, 0.0, 0.0]
    text = run(*words).stdout
    assert "left_knee 1       1 * left_elbow 1 + 10 deg" in text
    assert "right_elbow     20 deg" in text
    assert "waist" not in text


def test_the_pose_that_it_writes_follows_and_stays(links, tmp_path):
    path, again = tmp_path / "a.pose", tmp_path / "b.pose"
    run("link", "prototype", links, "--set", "left_elbow=30", "-o", path)
    pose = read_pose(path, read_figure("prototype"))
    assert pose["right_elbow"] == pytest.approx(pose["left_elbow"] * 0.5 + 5 * 0.017453292519943295)
    run("link", "prototype", links, "--pose", path, "-o", again)
    assert again.read_text() == path.read_text()


def test_links_are_resolved_to_one_control(links):
    assert answer("link", "prototype", links)["links"][-1] == {
        "joint": "left_knee",
        "dof": 1,
        "control": "left_elbow",
        "control_dof": 1,
        "factor": 1.0,
        "offset": pytest.approx(10.0),
        "unit": "deg",
    }


def test_a_follower_may_be_set_where_it_is(links):
    run("link", "prototype", links, "--set", "left_elbow=30", "--set", "left_knee=40")
