"""`mover settle`: what it says and writes, and a figure that finds no rest."""

from pathlib import Path
from typing import Any

import pytest

from generator import read_figure
from generator.simulation.statics import equilibrium, resting
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


LYING = ("prototype", "--set", "root_torso=90,0,0")


@pytest.fixture(scope="module")
def lying() -> Any:
    return answer("settle", *LYING, "--floor")


def test_a_figure_rests_on_a_floor(lying: Any, tmp_path: Path) -> None:
    """The pose that is written holds the orientation, so that the same segments carry it."""
    pose = tmp_path / "lying.pose"
    done = mover("settle", *LYING, "--floor", "-o", pose)
    assert done.exit_code == 0
    assert "prototype rests on floor in a stable pose" in done.stdout
    assert "creep by smooth friction" in done.stdout
    assert f"wrote {pose}" in done.stdout
    assert "holds the joints and the orientation, but not the place" in done.stderr
    assert "may fall to the other side" not in done.stderr
    assert lying["asymmetric_joints"] == []
    assert lying["stable"] is True
    assert lying["props"] == ["floor"]
    assert lying["orientations_lost"] == []
    assert sum(lying["shares"].values()) == pytest.approx(lying["weight_carried"])
    assert lying["weight_carried"] == pytest.approx(1.0, abs=0.005)
    assert lying["weight_N"] == pytest.approx(49.28 * 9.81, rel=1e-3)
    assert lying["height_m"] == lying["centre_of_mass_m"][1] < 0.12
    assert lying["energy_J"] < lying["start_energy_J"]
    again = answer("settle", "prototype", "--pose", pose, "--floor")
    assert again["height_m"] == pytest.approx(lying["height_m"], abs=2e-3)
    assert again["simulated_s"] <= lying["simulated_s"]
    for name, share in lying["shares"].items():
        assert again["shares"][name] == pytest.approx(share, abs=0.1)
    shown = answer("pose", "prototype", "--pose", pose)
    written = {joint["name"]: joint["displacement"] for joint in shown["joints"]}
    for joint in lying["joints"]:
        assert written[joint["name"]] == pytest.approx(joint["displacement"], abs=1e-9)


def test_locks_springs_and_gravity_of_a_figure_on_a_floor(lying: Any) -> None:
    options = ("--lock", "waist", "--springs", "none", "--gravity", "0,-1.62,0")
    held = answer("settle", *LYING, "--floor", *options)
    assert held["weight_N"] == pytest.approx(lying["weight_N"] * 1.62 / 9.81)
    assert max(held["depths_m"].values()) < max(lying["depths_m"].values())
    waist = next(joint for joint in held["joints"] if joint["name"] == "waist")
    assert waist["displacement"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


SEAT = """[[surface]]
name = "wood"

[[box]]
name = "far seat"
centre_m = [9, 0.2, 0]
size_m = [0.4, 0.4, 0.4]
surface = "wood"
"""


def test_a_figure_that_misses_the_props_has_no_pose(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resting, "MAX_TESTS", 2)
    scene, pose = tmp_path / "far.scene.toml", tmp_path / "rest.pose"
    scene.write_text(SEAT, encoding="utf-8")
    done = mover("settle", *LYING, "--scene", scene, "-o", pose)
    assert done.exit_code == 3
    assert "prototype does not come to rest on far seat; nothing was written" in done.stdout
    assert "nothing touches a prop; the centre of mass has fallen" in done.stderr
    assert not pose.exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--height", "0.1"), "--height needs --floor or --scene"),
        (("--friction", "0.1"), "--friction needs --floor"),
        (("--floor", "--height", "-1"), "below the floor"),
    ],
)
def test_options_of_props_that_do_not_apply(options: tuple[str, ...], message: str) -> None:
    done = mover("settle", "prototype", *options)
    assert done.exit_code == 2
    assert message in done.stderr


def test_a_limb_without_its_mirror_image_rests(tmp_path: Path) -> None:
    """Nothing about such a figure is symmetric."""
    limb = tmp_path / "limb.fig"
    limb.write_text(
        """figure { segment world { mass = -1kg; site base->location = trans(0cm,0cm,0cm); }
  segment left_arm { mass = 2kg; inertia = (80 kg cm2,80 kg cm2,80 kg cm2);
    contact = sphere(0cm,0cm,0cm,10cm); site CM->location = trans(0cm,0cm,0cm); }
  joint left_pin { connect world.base to left_arm.CM; type = R(0,0,1); displacement = (0deg); }
  root = world.base; }
""",
        encoding="utf-8",
    )
    assert answer("settle", limb, "--floor")["asymmetric_joints"] == []
