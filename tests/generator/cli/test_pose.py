"""`mover pose`: what it prints and writes."""

import numpy as np
import pytest

from generator import read_figure
from tests.command import answer, mover, run


def test_the_pose_of_the_standing_prototype():
    said = answer("pose", "prototype")
    assert {joint["name"]: joint["displacement"] for joint in said["joints"]}["waist"] == [0, 0, 0]
    arm = {segment["name"]: segment for segment in said["segments"]}["left_upper_arm"]
    assert arm["sites_cm"]["proximal"] == pytest.approx([17.2, 157.2, 0.0])
    assert arm["position_cm"] == pytest.approx([17.2, 157.2, 0.0])
    assert np.linalg.det(arm["rotation"]) == pytest.approx(1.0)


def test_a_pose_is_shown_in_degrees_and_centimetres():
    text = run("pose", "prototype", "--set", "left_elbow=90").stdout
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


def test_a_pose_goes_into_a_figure(tmp_path, prototype):
    path = tmp_path / "bent.fig"
    said = answer("pose", "prototype", "--set", "waist=1,2,3.3", "-o", path)
    figure = read_figure(path)
    assert figure.joints["waist"].displacement == pytest.approx(np.radians([1.0, 2.0, 3.3]))
    assert figure.segments == prototype.figure.segments
    assert answer("pose", path)["segments"] == said["segments"]


def test_loops_are_closed_around_what_is_set(tmp_path):
    path = tmp_path / "four.pose"
    first = answer("pose", "fourbar", "--set", "crank_bearing=200", "-o", path)
    shown = {joint["name"]: joint["displacement"][0] for joint in first["joints"]}
    assert shown["crank_bearing"] == pytest.approx(200.0, abs=1e-9)
    assert shown["crank_pin"] != pytest.approx(-90.0, abs=1.0)
    sites = {s["name"]: s["sites_cm"] for s in first["segments"]}
    assert sites["coupler"]["far"] == pytest.approx(sites["rocker"]["far"], abs=1e-7)
    assert answer("pose", "fourbar", "--pose", path)["joints"] == first["joints"]
    moved = answer("pose", "fourbar", "--pose", path, "--set", "crank_bearing=150")
    shown = {joint["name"]: joint["displacement"][0] for joint in moved["joints"]}
    assert shown["crank_bearing"] == pytest.approx(150.0, abs=1e-9)


def test_a_displacement_may_be_as_large_as_its_bound():
    said = answer("pose", "prototype", "--set", "left_knee=1e6")
    (knee,) = (joint for joint in said["joints"] if joint["name"] == "left_knee")
    assert knee["displacement"] == pytest.approx([1e6])


def test_a_link_to_no_folder_is_reported_by_its_target(tmp_path):
    (tmp_path / "x.pose").symlink_to("nowhere/x.pose")
    result = mover("pose", "prototype", "-o", tmp_path / "x.pose")
    assert result.exit_code == 1
    assert f"there is no directory `{tmp_path / 'nowhere'}`" in result.stderr
