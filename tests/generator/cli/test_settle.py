"""The command `settle`: what it says, what it writes, and what it refuses."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from generator.cli.app import app

LINKS = """
[[link]]
joints = ["crank_pin"]
control = "crank_bearing"
"""


def mover(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_a_rest_pose_is_told_and_written(tmp_path) -> None:
    """Settling from the pose that was written takes no way."""
    pose = tmp_path / "rest.pose"
    done = mover("settle", "fourbar", "-o", pose)
    assert done.exit_code == 0
    assert "fourbar is at rest in a stable pose" in done.stdout
    assert f"wrote {pose}" in done.stdout
    again = mover("settle", "fourbar", "--pose", pose, "--json")
    first = json.loads(mover("settle", "fourbar", "--json").stdout)
    second = json.loads(again.stdout)
    assert first["steps"] > second["steps"]
    assert second["residual_Nm_or_N"] < 1e-8
    assert second["slowest_per_s2"] == pytest.approx(first["slowest_per_s2"], rel=1e-6)
    assert first["energy_J"] < first["start_energy_J"]
    for one, other in zip(first["joints"], second["joints"], strict=True):
        assert one["displacement"] == pytest.approx(other["displacement"], abs=1e-9)
        assert one["units"] == other["units"]


def test_gravity_sets_and_locks(tmp_path) -> None:
    """Upwards the four-bar settles elsewhere; locked it stays where it is set."""
    down = json.loads(mover("settle", "fourbar", "--json").stdout)
    up = json.loads(mover("settle", "fourbar", "--gravity", "0,9.81,0", "--json").stdout)
    assert abs(down["joints"][0]["displacement"][0] - up["joints"][0]["displacement"][0]) > 10.0
    words = ("--set", "crank_bearing=40", "--lock", "crank_bearing", "--json")
    held = json.loads(mover("settle", "fourbar", *words).stdout)
    assert held["joints"][0]["displacement"] == pytest.approx([40.0])
    assert held["stiffness_Nm_per_rad_or_N_per_m"] is None


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("--lock", "crank"), 2, "--lock crank: the figure has no joint `crank`; did you mean"),
        (("--lock", "rocker_pin"), 2, "rocker_pin closes a loop and cannot be locked"),
        (("-o", "rest.action"), 2, "a pose file ends in .pose"),
        (("--gravity", "down"), 2, "--gravity down: expected three numbers"),
        (("--links", "links.toml"), 1, "the pose opens the loop at joint rocker_pin"),
        (("--links", "none.toml"), 1, "none.toml"),
    ],
)
def test_what_is_refused(words, code, said, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("links.toml").write_text(LINKS, encoding="utf-8")
    done = mover("settle", "fourbar", *words)
    assert done.exit_code == code
    assert said in done.stderr


FALLING = """figure falling {
  segment frame { mass = -1kg; site base->location = trans(0cm,0cm,0cm); }
  segment weight {
    mass = 2kg;
    inertia = (0.1 kg m2,0.1 kg m2,0.1 kg m2);
    site near->location = trans(0cm,0cm,0cm);
    site CM->location = trans(0cm,0cm,0cm);
  }
  joint slide { connect frame.base to weight.near; type = T(0,1,0); displacement = (0cm);%s }
  root = frame.base;
}
"""


def test_no_rest_is_a_failed_run(tmp_path) -> None:
    """And no pose is written."""
    made, pose = tmp_path / "falling.fig", tmp_path / "rest.pose"
    made.write_text(FALLING % "", encoding="utf-8")
    done = mover("settle", made, "-o", pose)
    assert done.exit_code == 3
    assert "slide 1 has moved 200 m: add a spring or a lock" in done.stderr
    assert not pose.exists()
