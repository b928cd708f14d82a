"""`mover simulate --replay`: the motion of a live simulation again."""

import json
from pathlib import Path

import numpy as np
import pytest

from generator import read_action, read_figure
from generator.input_files.live import (
    LiveStart,
    SetForce,
    SetGravity,
    SetRoot,
    SetScales,
    SetSprings,
    write_live,
)
from generator.motion_files import motion_from_recording
from generator.motion_files.motion import file_sha256
from generator.simulation.live.live_run import LiveRun
from tests.command import mover, run
from tests.motion_readers import Page


@pytest.fixture(scope="module")
def live() -> LiveRun:
    """The pendulum for half a second, pulled, freed and with weaker gravity."""
    made = LiveRun(read_figure("pendulum"), LiveStart())
    segment = next(iter(made.figure.bodies))
    for k in range(30):
        if k == 5:
            made.apply(SetScales(2.0, 1.0))
        if k == 10:
            made.apply(SetForce(segment, (0.0, 0.0, 0.1), (0.0, 0.0, 1.0)))
        if k == 20:
            made.apply(SetRoot(True))
            made.apply(SetGravity((0.0, -1.0, 0.0)))
        made.advance()
    return made


@pytest.fixture
def file(live: LiveRun, tmp_path: Path) -> Path:
    path = tmp_path / "a.live.toml"
    path.write_text(write_live(live.log("pendulum.fig", file_sha256(live.figure.path))))
    return path


def test_the_motion_is_the_same(live: LiveRun, file: Path):
    out = file.with_name("again.action")
    result = run("simulate", "--replay", file, "-o", out, "--json")
    data = json.loads(result.stdout)
    assert (data["figure"], data["frames"], data["changes"]) == ("pendulum.fig", 31, 4)
    assert data["simulated_s"] == pytest.approx(0.5)
    assert data["agreement_with_exudyn"] == live.recording().agreement_with_exudyn
    assert data["files"] == [str(out)]
    again = read_action(out)
    expected = motion_from_recording(live.recording())
    assert again.displacements.keys() == expected.displacements.keys()
    for name, values in expected.displacements.items():
        assert np.array_equal(again.displacements[name], values)


def test_a_page_of_a_replay_has_the_curves_of_changed_springs(tmp_path: Path):
    joint = next(n for n, each in read_figure("pendulum").joints.items() if each.chain)
    made = LiveRun(read_figure("pendulum"), LiveStart())
    stiff = f'[[spring]]\njoints = ["{joint}"]\naxis = "x"\nstiffness_Nm_rad = 40\n'
    made.apply(SetSprings(stiff))
    made.advance()
    file, page = tmp_path / "a.live.toml", tmp_path / "a.html"
    file.write_text(write_live(made.log("pendulum.fig", None)))
    run("simulate", "--replay", file, "-o", page)
    curves = [row["curve"] for row in Page(page).data["rows"] if "curve" in row]
    angles, law = (Page.floats(curves[0][key]) for key in ("angles", "law"))
    assert np.allclose(law, -40.0 * np.radians(angles), atol=1e-4)


def test_the_text_of_a_replay(file: Path):
    text = run("simulate", "pendulum", "--replay", file).output
    assert "Live simulation of 0.5 s with 4 changes." in text
    assert "31, 4 changes" in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--stop", 2), "leave out --stop"),
        (("--set", "shoulder=1,2,3"), "leave out --set"),
        (("--free-root",), "leave out --free-root"),
        (("--springs", "none"), "leave out --springs"),
        (("-o", "a.txt"), "is not a known suffix"),
    ],
)
def test_options_that_contradict_the_file_are_usage_errors(file: Path, words, message):
    result = mover("simulate", "--replay", file, *words)
    assert result.exit_code == 2
    assert message in result.output


def test_another_figure_is_a_usage_error(file: Path):
    result = mover("simulate", "prototype", "--replay", file)
    assert result.exit_code == 2
    assert "is a live simulation of `pendulum.fig`, not of `prototype.fig`" in result.output


def test_another_version_of_the_figure_is_a_warning(file: Path):
    text = file.read_text()
    digest = next(line for line in text.splitlines() if line.startswith("sha256"))
    file.write_text(text.replace(digest, 'sha256 = "00"'))
    result = mover("simulate", "--replay", file)
    assert result.exit_code == 0
    assert "another version of pendulum.fig" in result.output


def test_wrong_files_are_wrong_input(file: Path):
    file.write_text("end_frame = 3")
    result = mover("simulate", "--replay", file)
    assert result.exit_code == 1
    assert "this live file has no `figure`" in result.output
    file.write_text('figure = "nowhere.fig"\nend_frame = 3')
    result = mover("simulate", "--replay", file)
    assert result.exit_code == 1
    assert "nowhere.fig" in result.output


def test_a_figure_is_still_needed_otherwise():
    result = mover("simulate")
    assert result.exit_code == 2
    assert "Missing argument 'FIGURE'" in result.output
