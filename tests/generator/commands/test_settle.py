"""The command `settle`: what it says, what it writes, and what it refuses."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from generator.cli import app

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
    assert "fourbar is at rest, in a pose to which it comes back" in done.stdout
    assert f"wrote {pose}" in done.stdout
    again = mover("settle", "fourbar", "--pose", pose, "--json")
    first = json.loads(mover("settle", "fourbar", "--json").stdout)
    second = json.loads(again.stdout)
    assert first["steps"] > second["steps"]
    assert second["residual"] < 1e-8
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
    assert held["stiffness"] is None


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("--lock", "crank"), 2, "--lock crank: the figure has no joint `crank`; did you mean"),
        (("--lock", "rocker_pin"), 1, "rocker_pin closes a loop and cannot be locked"),
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
