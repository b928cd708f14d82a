"""`mover settle`: what it says and writes, and a figure that finds no rest."""

from pathlib import Path
from typing import Any

import pytest

from generator import read_figure
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


PAIR = """figure {
  segment wall { mass = -1kg; site left->location = trans(10cm,0cm,0cm);
    site right->location = trans(-10cm,0cm,0cm); }
  segment left_arm { mass = 1kg; inertia = (0.01 kg m2,0.01 kg m2,0.01 kg m2);
    site near->location = trans(0cm,0cm,0cm); site CM->location = trans(0cm,-20cm,0cm); }
  segment right_arm { mass = 1kg; inertia = (0.01 kg m2,0.01 kg m2,0.01 kg m2);
    site near->location = trans(0cm,0cm,0cm); site CM->location = trans(0cm,-20cm,0cm); }
  joint left_pin { connect wall.left to left_arm.near; type = R(0,0,1); displacement = (30deg);
    stiff = (1 N m/rad); rest = (90deg); }
  joint right_pin { connect wall.right to right_arm.near; type = R(0,0,1);
    displacement = (RIGHTdeg); stiff = (1 N m/rad); rest = (RESTdeg); }
  root = wall.left;
}
"""


@pytest.mark.parametrize(
    ("right", "rest", "options", "warned"),
    [
        ("-30", "0", (), True),
        ("-30", "-90", (), False),
        ("30", "0", (), False),
        ("-30", "0", ("--lock", "right_pin"), False),
        ("30", "0", ("--set", "right_pin=-30"), True),
    ],
)
def test_an_asymmetric_rest_of_a_symmetric_start_is_a_warning(
    right: str, rest: str, options: tuple[str, ...], warned: bool, tmp_path: Path
) -> None:
    """Joints about the same axis on both sides mirror each other with opposite angles."""
    path = tmp_path / "pair.fig"
    path.write_text(PAIR.replace("RIGHT", right).replace("REST", rest), encoding="utf-8")
    done = mover("settle", path, *options)
    assert done.exit_code == 0
    assert "J less than at the start" in done.stdout
    sentence = "the figure rests asymmetrically after a symmetric start: left_pin at "
    assert (sentence in done.stderr) is warned
    assert ("but right_pin at 0.0 deg" in done.stderr) is warned
    said = answer("settle", path, *options)
    assert said["asymmetric_joints"] == (["left_pin"] if warned else [])


def test_the_wall_limit_ends_a_search() -> None:
    done = mover("settle", "prototype", "--wall-limit", "1e-6")
    assert done.exit_code == 3
    assert "the wall-time limit of 1e-06 s was reached after 0 steps, with " in done.stderr
    assert mover("settle", "prototype", "--wall-limit", "0").exit_code == 2


def test_the_progress_of_a_search_is_told() -> None:
    figure, seen = read_figure("fourbar"), list[equilibrium.SearchProgress]()
    rest = equilibrium.find_equilibrium(figure, watch=seen.append)
    assert [one.steps for one in seen] == list(range(1, rest.steps + 1))
    assert seen[-1].force == pytest.approx(rest.residual)


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
