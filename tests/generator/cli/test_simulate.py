"""`mover simulate`: what reaches the run, and what is written and printed of it."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from typer.testing import Result

from generator import read_action
from generator.motion_files import MOTION_FORMATS
from generator.motion_files.action import ActionFile
from generator.motion_files.npz import read_npz
from generator.recording import ENERGY_KINDS, Ending
from generator.study.run_case import run_case
from tests.command import answer, mover, run
from tests.study_runs import parse_study_text


class Fall(NamedTuple):
    files: tuple[Path, Path]
    result: Result
    data: Any


@pytest.fixture(scope="module")
def fall(tmp_path_factory: pytest.TempPathFactory) -> Fall:
    """The prototype falls for 0.1 s, into an action file and a table."""
    folder = tmp_path_factory.mktemp("fall")
    files = folder / "fall.action", folder / "fall.csv"
    result = run("simulate", "prototype", "--stop", 0.1, "--json", "-o", files[0], "-o", files[1])
    return Fall(files, result, json.loads(result.stdout))


def swing(tmp_path: Path, *words: object) -> ActionFile:
    """Two frames of the pendulum without springs and gravity."""
    path = tmp_path / "swing.action"
    words = ("--stop", 0.02, "--step", 0.01, "--springs", "none", "--gravity", "0,0,0", *words)
    run("simulate", "pendulum", *words, "--quiet", "-o", path)
    return read_action(path)


def test_an_action_file_holds_the_run(fall: Fall):
    action = read_action(fall.files[0])
    assert action.times.tolist() == pytest.approx(np.arange(6) * 0.02)
    assert sum(part.shape[1] for part in action.displacements.values()) == 22
    assert action.header.outcome is Ending.DONE
    assert action.header.springs == "prototype.springs.toml"
    assert action.header.law == "conservative"


def test_the_json_of_a_run(fall: Fall):
    """Notes are for `mover check`, and progress is for a terminal."""
    said = fall.data
    assert fall.result.stderr == ""
    assert said["figure"] == "prototype"
    assert said["outcome"] == "done"
    assert said["simulated_s"] == said["held_until_s"] == pytest.approx(0.1)
    assert min(said["wall_s"], said["build_s"], said["steps"]) > 0
    assert 0.0 < said["step_s"] <= 0.02
    assert said["tolerance_rad"] == 1e-3
    assert 0.0 < said["error_estimate_rad"] <= 1e-3
    assert set(said["energy"]) == set(ENERGY_KINDS)
    assert all(set(ends) == {"first", "last"} for ends in said["energy"].values())
    assert said["energy"]["gravity"]["last"] < said["energy"]["gravity"]["first"]
    assert 0.0 <= said["constraint_drift_m"] < 1e-4
    assert said["files"] == [str(path) for path in fall.files]
    assert all(path.stat().st_size > 0 for path in fall.files)


def test_every_format_is_written_and_its_losses_are_listed(tmp_path: Path):
    paths = [tmp_path / f"swing{suffix}" for suffix in MOTION_FORMATS]
    outputs = [word for path in paths for word in ("-o", path)]
    result = run("simulate", "pendulum", "--stop", 0.04, "-v", *outputs)
    assert result.stdout.startswith("Finished 0.04 s. Estimated joint-angle error ")
    assert "energy [J]" in result.stdout
    for path in paths:
        assert path.stat().st_size > 0
        assert f"not in {path}:\n" in result.stdout


def test_set_and_velocity_are_in_degrees(tmp_path: Path):
    words = ("--set", "shoulder=30,0,-45", "--velocity", "shoulder=100,0,0")
    (moved,) = swing(tmp_path, *words).displacements.values()
    assert moved[0] == pytest.approx(np.radians([30.0, 0.0, -45.0]), abs=1e-12)
    assert moved[1, 0] - moved[0, 0] == pytest.approx(np.radians(2.0), rel=1e-3)


def test_a_free_figure_has_a_row_named_after_its_segment(tmp_path: Path):
    action = swing(tmp_path, "--free-root", "--velocity", "link1=0,0,0,0,0.5,0")
    ((name, moved),) = action.displacements.items()
    assert (name, moved.shape[1]) == ("link1", 6)
    assert moved[-1, 4] - moved[0, 4] == pytest.approx(0.01, abs=1e-9)


@pytest.mark.parametrize(("start", "stop"), [(1.0, 1.04), (-0.06, -0.02)])
def test_start_law_and_python_torques_reach_the_run(start: float, stop: float, tmp_path: Path):
    words = ("--start", start, "--stop", stop, "--law", "weighted", "--python-torques")
    action = swing(tmp_path, *words)
    assert action.times.tolist() == pytest.approx([start, start + 0.02, stop])
    assert action.header.law == "weighted"


def test_a_run_starts_from_a_pose(tmp_path: Path):
    path = tmp_path / "bent.pose"
    path.write_text("joint shoulder { displacement = (10deg,20deg,30deg); }", encoding="utf-8")
    (moved,) = swing(tmp_path, "--pose", path).displacements.values()
    assert moved[0] == pytest.approx(np.radians([10.0, 20.0, 30.0]), abs=1e-12)
    words = ("--pose", path, "--set", "shoulder=0,20,0")
    (moved,) = swing(tmp_path, *words).displacements.values()
    assert moved[0] == pytest.approx(np.radians([0.0, 20.0, 0.0]), abs=1e-12)


@pytest.mark.parametrize(
    ("scaled", "plain"),
    [
        (
            ("gravity=0.5", "pose.left_knee=-20", "velocity.left_elbow=50"),
            ("--gravity", "0,-4.905,0", "--set", "left_knee=-20", "--velocity", "left_elbow=50"),
        ),
        (
            ("floor.friction=0.1", "height=0.002"),
            ("--floor", "--friction", "0.1", "--height", "0.002"),
        ),
    ],
)
def test_a_scaled_run_is_that_of_the_option(
    scaled: tuple[str, ...], plain: tuple[str, ...], tmp_path: Path
):
    """Bit by bit, and the summary and the JSON tell the values."""
    words = ("simulate", "prototype", "--stop", 0.04, *plain[: "--floor" in plain], "-o")
    scales = [word for each in scaled for word in ("--scale", each)]
    one, other = tmp_path / "one.npz", tmp_path / "other.npz"
    told = run(*words, one, *scales).stdout
    run(*words, other, *plain)
    first, second = (read_npz(path)[1] for path in (one, other))
    assert first.displacements.keys() == second.displacements.keys()
    for name, rows in first.displacements.items():
        assert np.array_equal(rows, second.displacements[name])
    for each in scaled:
        assert f"scale    {each.replace('=', ' = ')}\n" in told


@pytest.mark.slow
def test_a_scaled_run_is_that_of_a_study(tmp_path: Path):
    """Of springs and masses, with the same measures bit by bit; the springs of a person too."""
    values = {"springs.knee.scale": 4.0, "segments.mass_scale": 1.1, "springs.hip.damping_scale": 2}
    rows = "\n".join(f'p{k} = {{ path = "{path}" }}' for k, path in enumerate(values))
    (tmp_path / "one.csv").write_text("p0,p1,p2\n4,1.1,2\n4,1.1,2\n", "utf-8")
    text = 'figure = "male50"\nstop = 0.04\n[design]\nkind = "list"\nfile = "one.csv"\n'
    text += f"[parameters]\n{rows}\n[measures]\n"
    text += 'end = { column = "kinetic [J]", take = "last" }\n'
    study = parse_study_text(text, tmp_path).require_value()
    expected = run_case(study, list(values.values()))
    words = [word for path, value in values.items() for word in ("--scale", f"{path}={value}")]
    data = answer("simulate", "male50", "--stop", 0.04, *words)
    assert data["scale"] == values
    assert data["energy"]["kinetic"]["last"] == expected.measures["end"]
    assert "scale" not in answer("simulate", "pendulum", "--stop", 0.02, "--step", 0.01)


def test_loads_do_work(tmp_path: Path):
    loads = tmp_path / "push.csv"
    loads.write_text(
        "site,kind,time [s],x [N],y [N],z [N]\n"
        "link1.CM,globalforce,0,5,5,5\nlink1.CM,globalforce,1,5,5,5\n",
        encoding="utf-8",
    )
    said = answer("simulate", "pendulum", "--stop", 0.1, "--step", 0.01, "--loads", loads)
    assert abs(said["energy"]["work"]["last"]) > 1e-6


def test_a_run_beyond_its_tolerance_fails_and_says_until_when_it_held(tmp_path: Path):
    path = tmp_path / "swing.action"
    words = ("simulate", "pendulum", "--stop", 0.5, "--tolerance", 1e-14, "-o", path)
    result = mover(*words, "--json")
    assert result.exit_code == 3
    said = json.loads(result.stdout)
    assert said["outcome"] == "tolerance not met"
    assert said["error_estimate_rad"] > 1e-14
    assert 0.0 <= said["held_until_s"] < said["simulated_s"] == 0.5
    assert f"is met only until {said['held_until_s']:.4g} s of 0.5 s" in said["message"]
    assert "the frames up to 0.5 s were written" in result.stderr
    assert read_action(path).header.outcome is Ending.INACCURATE


def test_a_failure_at_the_first_frame_has_no_error_estimate():
    words = ("simulate", "prototype", "--velocity", "left_elbow=1e6", "--stop", 0.1)
    result = mover(*words, "--json")
    assert result.exit_code == 3
    said = json.loads(result.stdout)
    assert said["simulated_s"] == 0.0
    assert (said["error_estimate_rad"], said["held_until_s"]) == (None, None)
    text = mover(*words).stdout
    assert "error not estimated: the run failed at its first frame" in text
    assert "met until" not in text


# --drive, --links, --lock

TABLE = "time [s], left_knee [deg], left_shoulder.1 [deg]\n0.1, 0, 0\n0.2, 10, 5\n0.3, 20, -5\n"
LINKS = """
[[link]]
joints = ["right_knee"]
control = "left_knee"
factor = 0.5

[[link]]
joints = ["right_shoulder"]
control = "left_shoulder"
"""


def test_a_run_follows_its_table_its_links_and_its_locks(tmp_path: Path):
    table, links, path = (tmp_path / name for name in ("knee.csv", "links.toml", "out.action"))
    table.write_text(TABLE, encoding="utf-8")
    links.write_text(LINKS, encoding="utf-8")
    words = ("--drive", table, "--links", links, "--lock", "waist", "-o", path)
    data = answer("simulate", "prototype", *words)
    assert data["simulated_s"] == pytest.approx(0.2)
    assert 0.0 <= data["strayed_rad_or_m"] < 1e-6
    action = read_action(path)
    q = {name: np.degrees(rows) for name, rows in action.displacements.items()}
    assert action.times[[0, -1]] == pytest.approx([0.1, 0.3])
    assert q["left_knee"][[0, 5, 10], 0] == pytest.approx([0.0, 10.0, 20.0], abs=1e-6)
    assert q["right_knee"] == pytest.approx(0.5 * q["left_knee"], abs=1e-6)
    assert q["right_shoulder"] == pytest.approx(q["left_shoulder"], abs=1e-6)
    assert np.ptp(q["left_shoulder"][:, 2]) > 1.0
    assert np.ptp(q["waist"], axis=0) == pytest.approx(0.0, abs=1e-12)


def test_a_motion_from_an_action_file_is_driven_again(tmp_path: Path):
    """All of its joints, or those that are chosen."""
    one, two, three = (tmp_path / f"{name}.action" for name in ("one", "two", "three"))
    words = ("--stop", "0.05", "--frame", "0.0025", "--quiet", "-o")
    run("simulate", "prototype", *words, one)
    run("simulate", "prototype", "--drive", one, *words, two)
    chosen = ("--driven", "left_knee", "--driven", "waist")
    run("simulate", "prototype", "--drive", one, *chosen, *words, three)
    first, second, third = map(read_action, (one, two, three))
    assert second.times == pytest.approx(first.times)
    for name, rows in first.displacements.items():
        assert second.displacements[name] == pytest.approx(rows, abs=1e-9)
        # The others fall as they fell, but for the accelerations of splines at their ends.
        assert third.displacements[name] == pytest.approx(rows, abs=2e-3)
    assert third.displacements["waist"] == pytest.approx(first.displacements["waist"], abs=1e-9)


def test_a_spline_that_overshoots_its_rows_is_a_warning(tmp_path: Path):
    table = tmp_path / "jump.csv"
    table.write_text("time [s], left_knee [deg]\n0,0\n0.1,0\n0.12,90\n0.2,90\n0.4,90\n", "utf-8")
    words = ("--stop", "0.02", "--step", "0.001")
    done = run("simulate", "prototype", "--drive", table, *words)
    assert "jump.csv:2:3: warning: between this row and the next the spline takes" in done.stderr
    assert "to -221.1 deg at 0.04097 s, though the rows are from 0 to 90 deg" in done.stderr


def test_a_run_imports_only_what_it_uses(tmp_path: Path):
    """Each of these packages takes longer to import than a fall takes to simulate."""
    line = [sys.executable, "-X", "importtime", "-m", "generator.cli.app", "simulate", "prototype"]
    line += ["--stop", "0.02", "--step", "0.01", "-o", str(tmp_path / "fall.action")]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=True)
    packages = re.findall(r"\| +([a-z_]+(?:\.[a-z_]+)?)", done.stderr)
    assert "exudyn" in packages
    slow = {"matplotlib", "trimesh", "rich", "xml.sax", "generator.geometry"}
    slow |= {f"scipy.{name}" for name in ("interpolate", "linalg", "optimize", "sparse", "spatial")}
    assert not slow & set(packages)
