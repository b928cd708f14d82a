"""Output of a run: few lines, details on demand, warnings of doubtful starts."""

from pathlib import Path

import pytest

from generator.cli.app import MAX_BRIEF_WARNINGS
from generator.motion_files import MOTION_FORMATS
from tests.command import mover, run

SHORT = ("--stop", 0.02, "--step", 0.01)


def test_a_run_prints_few_lines_and_that_it_wrote_nothing():
    result = run("simulate", "prototype", *SHORT)
    lines = result.stdout.splitlines()
    assert len(lines) <= 8
    assert "prototype.springs.toml, conservative law; 9 of 10 joints are elastic" in lines[2]
    assert lines[-1].startswith("wrote    nothing")
    assert all(suffix in lines[-1] for suffix in MOTION_FORMATS)
    assert result.stderr == ""


def test_details_stand_below_the_summary(tmp_path: Path):
    words = ("simulate", "prototype", *SHORT, "-o", tmp_path / "fall.action")
    brief, full = run(*words).stdout, run(*words, "-v").stdout
    assert brief.splitlines()[-1] == f"wrote    {tmp_path / 'fall.action'}"
    assert len(brief.splitlines()) <= 8
    for detail in ("sum less work", "largest gap", "in the finest pass", "not in "):
        assert detail in full
        assert detail not in brief
    (tmp_path / "fall.action").unlink()
    assert run(*words, "-q").output == ""
    assert (tmp_path / "fall.action").exists()


def test_springs_that_leave_most_joints_limp_are_counted(tmp_path: Path):
    path = tmp_path / "elbow.springs.toml"
    table = '[[spring]]\njoints = ["left_elbow"]\nstiffness_Nm_rad = 4\n'
    path.write_text(table, encoding="utf-8")
    extended = run("simulate", "prototype", *SHORT, "--springs", path)
    assert "over prototype.springs.toml, conservative law; 9 of 10" in extended.stdout
    assert extended.stderr == ""
    path.write_text(f'base = "none"\n{table}', encoding="utf-8")
    alone = run("simulate", "prototype", *SHORT, "--springs", path)
    assert "elbow.springs.toml, conservative law; 1 of 10" in alone.stdout
    assert alone.stderr == (
        "warning: 9 of 10 joints have no elastic law with the springs of elbow.springs.toml\n"
    )


@pytest.mark.parametrize(
    ("figure", "start", "expected"),
    [
        (
            "prototype",
            "left_elbow=-60",
            "left_elbow starts at -60 deg of flexion; its normal range of motion is -0.8 to 144.6",
        ),
        ("prototype", "left_elbow=-8", None),
        ("prototype", "left_elbow=150", None),
        ("prototype", "right_elbow=156", "right_elbow starts at 156 deg of flexion"),
        ("limited.fig", "pin=50", "pin starts at 50 deg, outside its limits -10 to 45 deg"),
        ("limited.fig", "pin=45", None),
    ],
)
def test_a_start_out_of_range_is_a_warning(figure, start, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("limited.fig").write_text(LIMITED, encoding="utf-8")
    stderr = mover("simulate", figure, "--stop", 0.001, "--step", 0.001, "--set", start).stderr
    assert (expected or "") in stderr
    assert ("warning" in stderr) is (expected is not None)


LIMITED = """
figure {
    segment base { site s->location = trans(0,0,0); }
    segment arm {
        mass = 1kg; inertia = (0.005 kg m2,0.005 kg m2,0.005 kg m2);
        site s->location = trans(0,0,0);
        site CM->location = trans(0,-0.1m,0);
    }
    joint pin {
        connect base.s to arm.s;
        type = R(0,0,1); llimit = (-10deg); ulimit = (45deg);
    }
    root = base.s;
}
"""


def test_only_the_first_warnings_are_printed_a_line_each(tmp_path: Path):
    words = [f"--set={name}=-90" for name in ("left_elbow", "right_elbow", "left_knee")]
    pushed = ("simulate", "prototype", *SHORT, *words, "--set=right_knee=-90")
    brief, full = mover(*pushed).stderr, mover(*pushed, "-v").stderr
    lines = [line for line in brief.splitlines() if not line.startswith("error")]
    assert len(lines) == MAX_BRIEF_WARNINGS + 1
    assert lines[-1] == "1 more: see them with --verbose"
    assert full.count("its normal range of motion is") == 4
