"""`mover settle`: what it says and writes, and a figure that finds no rest."""

from pathlib import Path
from typing import Any

import pytest

from generator.simulation import equilibrium
from tests.command import answer, mover, run

REFUSED = Path(__file__).parent / "refusals" / "files"


@pytest.fixture(scope="module")
def rest() -> Any:
    return answer("settle", "fourbar")


def test_a_rest_pose_is_printed_and_written(rest: Any, tmp_path: Path) -> None:
    """Settling from the pose that was written takes no way."""
    pose = tmp_path / "rest.pose"
    said = run("settle", "fourbar", "-o", pose).stdout
    assert "fourbar is at rest in a stable pose" in said
    assert f"wrote {pose}" in said
    again = answer("settle", "fourbar", "--pose", pose)
    assert rest["steps"] > again["steps"]
    assert again["residual_Nm_or_N"] < 1e-8
    assert again["slowest_per_s2"] == pytest.approx(rest["slowest_per_s2"], rel=1e-6)
    assert rest["energy_J"] < rest["start_energy_J"]
    for one, other in zip(rest["joints"], again["joints"], strict=True):
        assert one["displacement"] == pytest.approx(other["displacement"], abs=1e-9)
        assert one["units"] == other["units"]


def test_gravity_sets_and_locks(rest: Any) -> None:
    """Upwards the four-bar settles elsewhere; locked it stays where it is set."""
    up = answer("settle", "fourbar", "--gravity", "0,9.81,0")
    assert abs(rest["joints"][0]["displacement"][0] - up["joints"][0]["displacement"][0]) > 10.0
    held = answer("settle", "fourbar", "--set", "crank_bearing=40", "--lock", "crank_bearing")
    assert held["joints"][0]["displacement"] == pytest.approx([40.0])
    assert held["stiffness_Nm_per_rad_or_N_per_m"] is None


def test_no_rest_is_a_failed_run_without_a_pose(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(equilibrium, "MAX_STEPS", 100)
    monkeypatch.setattr(equilibrium, "RUNAWAY_DISPLACEMENT", 5.0)
    pose = tmp_path / "rest.pose"
    done = mover("settle", REFUSED / "fall.fig", "-o", pose)
    assert done.exit_code == 3
    assert "slide 1 has moved 10 m: add a spring or a lock" in done.stderr
    assert not pose.exists()
