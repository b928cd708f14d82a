"""`simulate --links --lock --drive`: from files to a motion."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from generator import read_action
from generator.cli.app import app

TABLE = """time [s], left_knee [deg], left_shoulder.1 [deg]
0.1, 0, 0
0.2, 10, 5
0.3, 20, -5
"""
LINKS = """
[[link]]
joints = ["right_knee"]
control = "left_knee"
factor = 0.5

[[link]]
joints = ["right_shoulder"]
control = "left_shoulder"
"""


def mover(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("knee.csv").write_text(TABLE, encoding="utf-8")
    Path("links.toml").write_text(LINKS, encoding="utf-8")
    return tmp_path


def test_a_run_goes_over_its_table_with_all_that_follows(folder) -> None:
    words = ("--drive", "knee.csv", "--links", "links.toml", "--lock", "waist", "--json")
    done = mover("simulate", "prototype", *words, "-o", "out.action")
    assert done.exit_code == 0
    data = json.loads(done.stdout)
    assert data["simulated_s"] == pytest.approx(0.2)
    assert 0.0 <= data["strayed_rad_or_m"] < 1e-6
    action = read_action("out.action")
    q = {name: np.degrees(rows) for name, rows in action.displacements.items()}
    assert action.times[[0, -1]] == pytest.approx([0.1, 0.3])
    assert q["left_knee"][[0, 5, 10], 0] == pytest.approx([0.0, 10.0, 20.0], abs=1e-6)
    assert q["right_knee"] == pytest.approx(0.5 * q["left_knee"], abs=1e-6)
    assert q["right_shoulder"] == pytest.approx(q["left_shoulder"], abs=1e-6)
    assert np.ptp(q["left_shoulder"][:, 2]) > 1.0
    assert np.ptp(q["waist"], axis=0) == pytest.approx(0.0, abs=1e-12)


def test_a_motion_from_an_action_file_is_driven_again(folder) -> None:
    """All of its joints, or those that are chosen."""
    words = ("--stop", "0.1", "--frame", "0.0025", "--quiet")
    assert mover("simulate", "prototype", *words, "-o", "one.action").exit_code == 0
    words = ("--drive", "one.action", *words)
    assert mover("simulate", "prototype", *words, "-o", "two.action").exit_code == 0
    chosen = ("--driven", "left_knee", "--driven", "waist")
    assert mover("simulate", "prototype", *words, *chosen, "-o", "three.action").exit_code == 0
    one, two, three = (read_action(f"{name}.action") for name in ("one", "two", "three"))
    assert two.times == pytest.approx(one.times)
    for name, rows in one.displacements.items():
        assert two.displacements[name] == pytest.approx(rows, abs=1e-9)
        # The others fall as they fell, but for the accelerations of splines at their ends.
        assert three.displacements[name] == pytest.approx(rows, abs=2e-3)
    assert three.displacements["waist"] == pytest.approx(one.displacements["waist"], abs=1e-9)


REFUSED = [
    (("--drive", "knee.csv", "--stop", "0.5"), 2, "the run goes from 0.1 s to 0.5 s, but the"),
    (("--drive", "knee.csv", "--start", "0"), 2, "the run goes from 0 s to 0.3 s, but the drive"),
    (("--drive", "knee.csv", "--lock", "left_knee"), 2, "left_knee is both locked and driven"),
    (("--links", "links.toml", "--lock", "right_knee"), 2, "right_knee 1 follows left_knee 1 and"),
    (("--drive", "knee.csv", "--set", "left_knee=4"), 2, "--set left_knee: the joint is linked or"),
    (("--links", "links.toml", "--set", "right_knee=4"), 2, "--set right_knee: the joint is"),
    (("--lock", "waist", "--velocity", "waist=1,0,0"), 2, "--velocity waist: the joint is locked"),
    (("--drive", "knee.csv", "--velocity", "left_knee=500"), 2, "--velocity left_knee: the joint"),
    (("--drive", "knee.csv", "--start", "0.6"), 2, "but the drives are from 0.1 s to 0.3 s"),
    (("--lock", "left_kne"), 2, "has no joint `left_kne`; did you mean `left_knee`?"),
    (("--driven", "left_knee"), 2, "--driven chooses joints of the --drive file, which is missing"),
    (
        ("--drive", "knee.csv", "--driven", "waist"),
        1,
        "knee.csv: joint `waist` is not driven there",
    ),
    (("--drive", "none.csv"), 1, "none.csv"),
    (("--drive", "none.action"), 1, "none.action"),
    (("--free-root", "--lock", "root_torso"), 2, "root_torso connects the figure to the ground"),
    (
        ("--drive", "knee.csv", "-o", "knee.csv"),
        1,
        "`knee.csv` cannot be written: the run reads it",
    ),
]


@pytest.mark.parametrize(("words", "code", "said"), REFUSED)
def test_what_is_refused(folder, words, code, said) -> None:
    done = mover("simulate", "prototype", *words)
    assert done.exit_code == code
    assert said in done.stderr


def test_an_action_file_of_another_figure_is_refused(folder) -> None:
    """Joints that it does not have, and joints of other axes."""
    assert mover("simulate", "fourbar", "--stop", "0.05", "-o", "bar.action").exit_code == 0
    done = mover("simulate", "prototype", "--drive", "bar.action")
    assert done.exit_code == 1
    assert "bar.action: the figure has no joint `crank_bearing`" in done.stderr
    text = Path("bar.action").read_text(encoding="utf-8")
    Path("turned.action").write_text(text.replace("R(0,0,1)", "R(0,1,0)"), encoding="utf-8")
    done = mover("simulate", "fourbar", "--drive", "turned.action")
    assert done.exit_code == 1
    assert "has other axes than in the figure" in done.stderr


JUMP = "time [s], left_knee [deg]\n0,0\n0.1,0\n0.12,90\n0.2,90\n0.4,90\n"


def test_a_spline_that_leaves_its_rows_is_told(folder) -> None:
    """Of a table with the place; of an action file by its name."""
    Path("jump.csv").write_text(JUMP, encoding="utf-8")
    words = ("--stop", "0.02", "--step", "0.001")
    done = mover("simulate", "prototype", "--drive", "jump.csv", *words)
    assert "jump.csv:2:3: warning: between this row and the next the spline takes" in done.stderr
    assert "to -221.1 deg at 0.04097 s, though the rows are from 0 to 90 deg" in done.stderr


def test_rows_of_an_action_file_that_are_too_near(folder) -> None:
    words = ("--stop", "2e-7", "--frame", "1e-7", "--step", "1e-7", "-o", "near.action")
    assert mover("simulate", "fourbar", *words).exit_code == 0
    done = mover("simulate", "fourbar", "--drive", "near.action", "--driven", "crank_bearing")
    assert done.exit_code == 1
    assert "near.action: joint `crank_bearing`: rows of a drive must be" in done.stderr
