"""`mover convert` of a figure at the start of a run, and of its pose as a motion of one frame."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from generator import read_action, read_figure
from generator.figure_file.write import write_pose
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from tests.command import answer, mover, run
from tests.motion_readers import Bvh, Glb, Page, read_table

STARTS = [
    ("prototype", ("--set", "waist=10,20,30", "--set", "left_knee=40"), 22),
    ("prototype", ("--set", "left_knee=40", "--free-root"), 25),
    ("prototype", ("--set", "root_torso=0,0,90", "--free-root"), 25),  # other axes of a free joint
    ("prototype", ("--pose", "bent.pose", "--set", "left_knee=20", "--free-root"), 25),
    ("fourbar", ("--set", "crank_bearing=10"), 4),
    ("fourbar", ("--free-root",), 8),
]
"""Figures, options, and number of displacements."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    figure = read_figure("prototype")
    values = initial_displacements(build_tree(figure)) | {"left_elbow": np.array([0.3])}
    values |= {"left_hip_joint": np.array([0.1, -0.2, 0.3])}
    text = write_pose(figure, {name: row.tolist() for name, row in values.items()})
    (tmp_path / "bent.pose").write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(("figure", "options", "count"), STARTS)
def test_a_model_starts_as_the_run_with_the_same_options(
    figure: str, options: tuple[str, ...], count: int, folder: Path
):
    run("simulate", figure, *options, "--stop", 0.02, "-o", "run.sto", "-o", "run.action")
    run("convert", figure, "pose.sto", "pose.action", *options)
    moving, still = read_table(folder / "run.sto"), read_table(folder / "pose.sto")
    assert still.labels == moving.labels
    assert len(still.labels) == 1 + count
    assert still.rows.shape == (1, 1 + count)
    assert still.rows[0] == pytest.approx(moving.rows[0], abs=1e-9)
    run_chains = [line for line in moving.header if line.startswith("joint.")]
    assert run_chains
    assert [still.header[key] for key in run_chains] == [moving.header[key] for key in run_chains]
    action = read_action("pose.action")
    assert (action.header.figure, action.times.tolist()) == (f"{figure}.fig", [0.0])
    run("com", figure, "--along", "pose.action")
    if figure == "prototype":
        run("convert", figure, "model.osim", *options)
        root = ElementTree.parse("model.osim").getroot()
        default = {
            each.attrib["name"]: float(each.findtext("default_value", "nan"))
            for each in root.iter("Coordinate")
        }
        assert default.keys() == set(still.labels[1:])
        values = [default[label] for label in still.labels[1:]]
        assert values == pytest.approx(still.rows[0, 1:], abs=1e-12)


def test_a_figure_without_options_keeps_its_own_displacements(folder: Path):
    run("convert", "prototype", "same.fig", "pose.sto")
    assert read_figure("same.fig") == read_figure("prototype")
    run("convert", "prototype", "bent.fig", "--set", "left_knee=40")
    bent = read_figure("bent.fig").joints["left_knee"].displacement
    assert bent == pytest.approx([np.radians(40.0)], rel=1e-15)


def test_a_pose_is_a_motion_of_one_frame(folder: Path):
    names = ("a.glb", "a.bvh", "a.html")
    options = ("--set", "left_knee=40", "--free-root")
    said = answer("convert", "prototype", *names, *options)
    assert said["files"] == list(names)
    run("simulate", "prototype", *options, "--stop", 0.02, "-o", "run.glb", "-o", "run.bvh")
    assert len(Bvh(folder / "a.bvh").rows) == 1
    assert Bvh(folder / "a.bvh").rows[0] == pytest.approx(Bvh(folder / "run.bvh").rows[0], abs=1e-6)
    for name, poses in Glb(folder / "run.glb").poses().items():
        assert Glb(folder / "a.glb").poses()[name][0] == pytest.approx(poses[0], abs=1e-6), name
    assert Page(folder / "a.html").glb().times.tolist() == [0.0]
    text = run("convert", "prototype", "b.glb", "b.urdf").stdout
    assert text.splitlines()[0].endswith("; its pose as a single frame: b.glb")


def test_springs_and_their_law_are_those_of_the_options(folder: Path):
    words = ("--springs", "none", "--law", "weighted")
    run("convert", "prototype", "a.action", *words)
    assert read_action("a.action").header.springs == "none"
    assert read_action("a.action").header.law == "weighted"
    run("convert", "prototype", "b.action", "--free-root")
    assert read_action("b.action").header.law == "conservative"
    run("convert", "prototype", "a.html", "b.html")
    assert len(Page(folder / "a.html").data["rows"]) > 0


def test_every_written_file_is_listed(folder: Path):
    (folder / "out").mkdir()
    said = answer("convert", "prototype", "out/a.xml", "out/b.urdf", "out/c.glb")
    written = {str(path.relative_to(folder)) for path in folder.rglob("out/*") if path.is_file()}
    written |= {str(path.relative_to(folder)) for path in folder.rglob("out/*/*")}
    assert set(said["files"]) == written
    assert len(said["files"]) == len(written)
    text = run("convert", "prototype", "out/b.urdf").stdout
    meshes = len(list((folder / "out" / "b_geometry").iterdir()))
    assert f"wrote {meshes} files in out/b_geometry\n" in text
    assert "wrote out/b_springs.csv\n" in text


def test_a_start_beyond_the_range_of_motion_is_a_warning(folder: Path):
    said = run("convert", "prototype", "a.osim", "--set", "left_knee=-50").stderr
    assert "joint left_knee starts at" in said


def test_a_loop_that_cannot_be_closed_is_refused(folder: Path):
    result = mover(
        "convert", "fourbar", "a.osim", "--set", "crank_bearing=10", "--set", "rocker_bearing=170"
    )
    assert result.exit_code == 1
    assert "the pose opens the loop at joint rocker_pin" in result.stderr
    assert not (folder / "a.osim").exists()


def test_the_frames_and_the_scale_of_a_motion_are_chosen(folder: Path):
    run("simulate", "pendulum", "--stop", 0.1, "-o", "run.npz")
    assert answer("convert", "run.npz", "a.glb", "--fps", 100)["frames"] == 11
    assert Glb(folder / "a.glb").times == pytest.approx(np.arange(11) / 100.0, abs=1e-6)
    run("convert", "run.npz", "cm.bvh")
    run("convert", "run.npz", "m.bvh", "m.glb", "--scale", 1)
    lengths = {
        name: sum(np.abs(offset).sum() for offset in Bvh(folder / name).offsets.values())
        for name in ("cm.bvh", "m.bvh")
    }
    assert lengths["cm.bvh"] == pytest.approx(100.0 * lengths["m.bvh"], rel=1e-6)


def test_a_table_of_opensim_is_a_motion_of_every_command(folder: Path):
    run("simulate", "pendulum", "--stop", 0.1, "-o", "run.mot", "-o", "run.action")
    run("convert", "run.mot", "again.action")
    back, there = read_action("again.action"), read_action("run.action")
    assert (back.header, back.chains) == (there.header, there.chains)
    assert back.displacements["shoulder"] == pytest.approx(
        there.displacements["shoulder"], rel=1e-15, abs=1e-300
    )
    ours = answer("com", "pendulum", "--along", "run.mot")["centre_of_mass_cm"]
    theirs = answer("com", "pendulum", "--along", "run.action")["centre_of_mass_cm"]
    assert np.array(ours) == pytest.approx(np.array(theirs), rel=1e-12)
    run("simulate", "pendulum", "--drive", "run.mot", "-o", "driven.action")
    driven = read_action("driven.action")
    assert driven.times.tolist() == there.times.tolist()
    assert driven.displacements["shoulder"] == pytest.approx(
        there.displacements["shoulder"], abs=1e-9
    )


def test_a_table_that_names_no_figure_takes_the_one_that_is_named(folder: Path):
    text = "inDegrees=yes\nendheader\ntime\tshoulder_1\tload\n0.0\t10\t1\n0.1\t20\t2\n"
    (folder / "theirs.mot").write_text(text, encoding="utf-8")
    result = run("convert", "theirs.mot", "a.action", "--figure", "pendulum")
    assert "left out: load" in result.stderr
    assert "figure's own value: shoulder_2, shoulder_3" in result.stderr
    moved = read_action("a.action").displacements["shoulder"]
    assert moved[:, 0] == pytest.approx(np.radians([10.0, 20.0]), rel=1e-15)
