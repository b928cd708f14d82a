"""`mover hold`: answers in text, JSON and tables; `refusals/hold.txt` has what it refuses."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from generator.figure_file import FIGURE_FILE
from generator.hold.posture import Holder, JointDemand, hold
from generator.hold.statics import Load
from generator.hold.support import OutOfBalanceError
from generator.model import Model
from generator.motion_files import FigureMotion, motion_writer
from generator.tone import Tone
from springs import SpringSet
from tests.command import answer, mover, run
from tests.motions import header_of
from tests.paths import DOCS

ARMS = ("--set", "left_shoulder=0,0,90", "--set", "right_shoulder=0,0,90")
SQUAT = tuple(
    word
    for joint, value in {
        "root_torso": "0,30,0",
        "left_hip_joint": "0,0,80",
        "right_hip_joint": "0,0,80",
        "left_knee": "70",
        "right_knee": "70",
        "left_ankle": "0,20",
        "right_ankle": "0,20",
    }.items()
    for word in ("--set", f"{joint}={value}")
)


@pytest.fixture(scope="module")
def man() -> Holder:
    return Holder.of(Model.of(FIGURE_FILE.read("male50")))


def rows_of(said: dict) -> dict:
    return {(row["joint"], row["direction"]): row for row in said["joints"]}


@pytest.mark.parametrize(
    ("net", "passive", "is_marked"),
    [(0.2, -7.3, True), (-0.2, -7.3, True), (8.0, -7.3, False), (9.0, 7.3, False)],
)
def test_rows_against_a_larger_passive_moment_are_marked(
    net: float, passive: float, is_marked: bool
):
    row = JointDemand("knee", "extension", 0.0, net, passive, net - passive, 34.8, 0.2, None, "")
    assert row.is_antagonist is is_marked


def test_json_has_the_keys_of_its_page():
    said = answer("hold", "male50", *ARMS, "--load", "right_hand=2kg")
    assert set(said) == {
        *("figure", "person", "loads", "joints", "weakest", "percent_capable", "spine"),
        *("beyond_range", "balance", "hands", "max", "notes", "files"),
    }
    assert list(said["joints"][0]) == [
        *("joint", "direction", "angle_deg", "net_Nm", "passive_Nm", "active_Nm", "capacity_Nm"),
        *("capacity_5_Nm", "use", "percent_capable", "endurance_s", "class", "source"),
    ]
    assert set(said["weakest"]) == {"joint", "direction", "use"}
    moments = ["moment_Nm", "lateral_Nm"]
    assert list(said["spine"]) == [*moments, "compression_N", "low_N", "high_N", "limits_N"]
    assert said["spine"]["limits_N"] == [3400.0, 6400.0]
    assert {"centre_of_pressure_m", "margin_m"} <= set(said["balance"])
    (hand,) = said["hands"]
    assert {"hand", "force_N", "capacity_N", "percent_capable"} <= set(hand)
    assert hand["force_N"] == pytest.approx(2.0 * 9.81)
    for row in said["joints"]:
        assert row["net_Nm"] - row["passive_Nm"] == pytest.approx(row["active_Nm"], abs=1e-9)
        assert row["use"] == pytest.approx(row["active_Nm"] / row["capacity_Nm"])
        assert (row["source"] is None) == (row["class"] == "estimate"), row
    largest = max(said["joints"], key=lambda row: row["use"])
    assert said["weakest"]["use"] == largest["use"]
    used = [row["percent_capable"] for row in said["joints"] if row["use"] >= 0.05]
    assert said["percent_capable"] == min(used)


def test_arms_at_90_deg_use_what_the_register_states():
    for name, low, high in (("male50", 0.22, 0.25), ("female50", 0.335, 0.345)):
        row = rows_of(answer("hold", name, *ARMS))["left_shoulder", "flexion"]
        assert low <= row["use"] <= high
        assert row["class"] == "scaled"


def test_force_and_site_of_loads(man):
    found = answer(
        *("hold", "male50", "--load", "right_hand.distal=1kg", "--load", "left_hand=0,-9.81,0N")
    )
    masses = [load["mass_kg"] for load in found["loads"]]
    assert masses == [1.0, 0.0]
    own = man.posture(
        None, [Load("right_hand", 1.0, site="distal"), Load("left_hand", force=(0.0, -9.81, 0.0))]
    )
    assert found["weakest"]["use"] == pytest.approx(own.largest_use)


def test_text_fits_a_screen_and_names_the_verdict():
    load = ("--load", "right_hand=10kg", "--load", "left_hand=10kg")
    lines = run("hold", "male50", *load, *SQUAT, "--balance").stdout.splitlines()
    assert len(lines) <= 24
    assert "strong enough; weakest joint is" in lines[0]
    assert any(line.startswith("L5/S1: ") for line in lines)
    more = run("hold", "male50", *load, *SQUAT, "--balance", "--verbose").stdout
    assert "Anderson" in more
    assert len(more.splitlines()) > 40


def test_bending_to_the_side_is_stated():
    for side, sign in (("left", 1.0), ("right", -1.0)):
        load = ("hold", "male50", "--load", f"{side}_hand=40kg")
        said = answer(*load)
        bend = said["spine"]["lateral_Nm"]
        waist = rows_of(said)[
            "waist", f"lumbar lateral bend to the {'right' if sign > 0 else 'left'}"
        ]
        assert bend == pytest.approx(sign * waist["net_Nm"], rel=0.02)
        assert f"{abs(bend):.0f} N m to the {side}, compression" in run(*load).stdout


def test_verdict_counts_hands():
    load = ("hold", "male50", "--load", "right_hand=40kg")
    said = answer(*load)
    (hand,) = said["hands"]
    assert hand["percent_capable"] < 1.0 < 50.0 < said["percent_capable"]
    first = run(*load).stdout.splitlines()[0]
    start = (
        "male50: 0 % of men of 18-25 years are strong enough (right_hand by the Arm Force Field)"
    )
    assert first.startswith(f"{start}; weakest joint is waist")


def test_heaviest_load_is_at_the_limit_of_a_joint_or_of_balance(man):
    said = answer("hold", "male50", "--max", "right_hand", "--set", "right_elbow=0,90")
    assert said["weakest"]["use"] == pytest.approx(1.0, abs=2e-3)
    assert said["max"]["limited_by"] == "right_wrist radial deviation"
    assert said["percent_capable"] == pytest.approx(50.0, abs=0.5)
    far = answer("hold", "male50", *ARMS, "--max", "left_hand.distal")
    assert far["max"]["mass_kg"] < said["max"]["mass_kg"]
    giant = giant_of(man)
    held = giant.heaviest("right_hand", {"right_shoulder": np.array([0.0, 0.0, np.pi / 2])})
    assert held.limited_by == "balance"
    assert held.posture.standing is not None
    assert held.posture.standing.margin == pytest.approx(0.0, abs=1e-4)


def giant_of(man: Holder) -> Holder:
    """The man with arms, trunk and legs that no load exceeds."""
    parts = ("wrist", "shoulder", "elbow", "hip_joint", "knee", "ankle")
    joints = [f"{side}_{part}" for side in ("left", "right") for part in parts]
    strengths = dict.fromkeys([*joints, "waist", "thorax"], (1e4, 1e4))
    return Holder.of(man.model, stated=Tone(strengths=strengths))


@pytest.mark.slow
def test_heaviest_load_is_sought_in_a_posture_balanced_for_each_load(man):
    arm = {"right_shoulder": np.array([0.0, 0.0, np.pi / 2])}
    giant = giant_of(man)
    fixed, shifted = (giant.heaviest("right_hand", arm, balance=each) for each in (False, True))
    assert shifted.mass > fixed.mass + 5.0
    load = Load("right_hand", shifted.mass)
    expected = giant.posture(giant.balanced(arm, [load]), [load])
    for joint, row in shifted.posture.placement.displacements.items():
        assert row == pytest.approx(expected.placement.displacements[joint], abs=1e-8)
    said = answer(
        *("hold", "male50", "--set", "right_shoulder=0,0,90"), "--max", "right_hand", "--balance"
    )
    mean = man.heaviest("right_hand", arm, balance=True)
    assert said["max"]["mass_kg"] == mean.mass
    assert said["balance"]["margin_m"] == mean.posture.standing.margin


def test_heaviest_load_is_in_addition_to_the_loads_named():
    words = ("hold", "male50", "--max", "right_hand", "--set", "right_elbow=0,90")
    alone = answer(*words)["max"]["mass_kg"]
    beside = answer(*words, "--load", "right_hand=4kg")["max"]["mass_kg"]
    assert beside == pytest.approx(alone - 4.0, abs=2e-3)
    said = run(*words, "--load", "right_hand=4kg").stdout
    assert f"is {beside:.2f} kg in addition to the loads named, limited by right_wrist" in said
    assert "in addition" not in run(*words).stdout
    over = run(*words, "--load", "right_hand=40kg").stdout
    assert "loads named exceed the strength of right_wrist radial deviation already (" in over
    assert "right_hand holds nothing more" in over


def test_directions_are_named():
    said = answer("hold", "male50", *ARMS)["balance"]["centre_of_pressure_m"]
    place = f"0.0 cm to the left and {100 * said[2]:.1f} cm forward of the world's origin"
    assert place in run("hold", "male50", *ARMS).stdout
    for words, way in (
        (("--support", "right_foot"), "outside the right foot, to the left: the person tips"),
        (("--support", "left_foot"), "outside the left foot, to the right: the person tips"),
    ):
        result = mover("hold", "male50", *words)
        assert result.exit_code == 1
        assert way in result.output


def test_balance_is_advised_only_where_a_shift_fore_and_aft_helps(man):
    sideways = "lean to the other side, or name what else bears it by --support"
    fore = "shift the pelvis by --balance"
    for turn, advices in ((0.0, (sideways, fore)), (np.pi / 2, (fore, sideways))):
        root = {"root_torso": np.array([0.0, 0.0, turn])}
        forwards = man.forwards(man.posture(root).placement)
        assert np.allclose(forwards, (np.sin(turn), 0.0, np.cos(turn)))
        for force, advice in zip(((-600.0, 0.0, 0.0), (0.0, 0.0, 500.0)), advices, strict=True):
            with pytest.raises(OutOfBalanceError, match=advice):
                man.posture(root, [Load("right_hand", force=force)])
    bar = Holder(man.model, man.body, None, ("right_hand.CM",), SpringSet())
    with pytest.raises(OutOfBalanceError, match=r"tips over; change the pose$"):
        bar.posture()


def test_balance_keeps_knees_trunk_and_feet(man):
    pose = {"waist": np.array([0.0, 0.0, 0.6]), "left_hip_joint": np.array([0.0, 0.03, 0.4])}
    pose |= {"right_hip_joint": np.array([0.0, 0.03, 0.4]), "root_torso": np.array([0.0, 0.4, 0.0])}
    loads = [Load("right_hand", 5.0), Load("left_hand", 5.0)]
    balanced = man.balanced(pose, loads)
    before = man.posture(pose, loads, must_balance=False)
    after = man.posture(balanced, loads)
    for name in ("upper_torso", "left_hand", "head"):
        assert np.allclose(before.placement.poses[name], after.placement.poses[name])
    for name in ("left_foot", "right_foot"):
        turns = [one.placement.poses[name][:3, :3] for one in (before, after)]
        assert np.allclose(*turns, atol=0.02)
    assert balanced["left_knee"] == pytest.approx(before.placement.displacements["left_knee"])
    corners = after.standing.stability.corners[:, 2]
    assert after.standing.centre_of_pressure[2] == pytest.approx(
        0.5 * (corners.min() + corners.max()), abs=1e-6
    )


def test_feet_share_by_their_distance_from_the_centre_of_pressure(man):
    load = [Load("right_hand", 20.0)]
    standing = man.posture(None, load).standing
    assert standing is not None
    forces = {one.name: one.force[1] for one in standing.bearings}
    points = {one.name: one.point for one in standing.bearings}
    assert forces["right_foot"] > forces["left_foot"]
    centre = standing.centre_of_pressure[0]
    arms = {name: abs(point[0] - centre) for name, point in points.items()}
    assert forces["right_foot"] * arms["right_foot"] == pytest.approx(
        forces["left_foot"] * arms["left_foot"], rel=1e-9
    )
    one = Holder.of(man.model, supports=("right_foot",))
    single = one.posture(None, load, must_balance=False).standing
    assert single is not None
    assert single.bearings[0].force[1] == pytest.approx((man.model.figure.total_mass + 20.0) * 9.81)


def test_lifted_foot_bears_nothing(man):
    pose = {"left_hip_joint": np.array([0.0, 0.03, 0.9]), "left_knee": np.array([1.2])}
    found = man.posture(pose, must_balance=False)
    assert "left_foot is lifted, and bears nothing" in found.notes
    assert [one.name for one in found.standing.bearings] == ["right_foot"]


def test_posture_beyond_a_range_is_the_verdict_and_has_no_use():
    words = ("hold", "male50", "--set", "left_elbow=0,160")
    said = answer(*words)
    (one,) = said["beyond_range"]
    assert one["joint"] == "left_elbow"
    assert one["angle_deg"] == pytest.approx(160.0)
    assert one["range_deg"][0] < 0.0 < 140.0 < one["range_deg"][1] < 150.0
    assert said["percent_capable"] is None
    uses = {row["joint"]: row["use"] for row in said["joints"] if row["use"] is None}
    assert set(uses) == {"left_elbow"}
    first = run(*words).stdout.splitlines()[0]
    assert first == "male50: this posture is beyond the range of left_elbow (-1 to 145 deg)"
    assert answer("hold", "male50", "--set", "left_elbow=0,158")["beyond_range"] == []


def test_what_nobody_holds_is_said():
    legs = ("--load", "right_hand=450kg", "--load", "left_hand=450kg")
    for loads, times in (
        (("--load", "left_hand=100kg", "--load", "right_hand=100kg", *ARMS), 10.0),
        (("--load", "left_hand=600kg", "--load", "right_hand=600kg"), 1.0),
    ):
        said = answer("hold", "male50", *loads, "--balance")
        assert said["weakest"]["use"] > times
        first = run("hold", "male50", *loads, "--balance").stdout.splitlines()[0]
        weakest = said["weakest"]
        expected = f"{weakest['use']:.3g} times the strength of {weakest['joint']}"
        assert first.startswith(f"male50: nobody holds this: {expected}")
    assert "strong enough" in run("hold", "male50", *legs).stdout


def test_age_and_sex_choose_the_sample():
    young, old = (
        answer("hold", "female50", *SQUAT, "--balance", "--age", age)
        for age in ("18-25", "over-65")
    )
    key = "left_knee", "extension"
    assert rows_of(old)[key]["capacity_Nm"] < 0.7 * rows_of(young)[key]["capacity_Nm"]
    assert rows_of(old)[key]["class"] == "scaled"
    other = answer("hold", "female50", *SQUAT, "--balance", "--sex", "male")
    assert rows_of(other)[key]["capacity_Nm"] > rows_of(young)[key]["capacity_Nm"]


def test_stated_strengths_precede_the_table(tmp_path: Path):
    path = tmp_path / "own.strength.toml"
    path.write_text(
        '[[strength]]\nmotion = "left_knee extension"\ntorque_Nm = [90, 50]\nclass = "published"\n'
        'source = "our test bench"\n',
        encoding="utf-8",
    )
    said = answer("hold", "male50", *SQUAT, "--balance", "--strength", path)
    row = rows_of(said)["left_knee", "extension"]
    assert (row["capacity_Nm"], row["class"]) == (90.0, "published")
    assert rows_of(said)["right_knee", "extension"]["capacity_Nm"] != 90.0


def test_table_of_joints(tmp_path: Path):
    path = tmp_path / "hold.csv"
    said = answer("hold", "male50", *ARMS, "-o", path)
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line[0] != "#"]
    rows = list(csv.DictReader(lines))
    assert [row["joint"] for row in rows] == [row["joint"] for row in said["joints"]]
    for row, expected in zip(rows, said["joints"], strict=True):
        assert float(row["active_Nm"]) == pytest.approx(expected["active_Nm"], abs=1e-9)
        assert row["source"] == (expected["source"] or "")


def test_poses_of_the_page_are_in_it(tmp_path: Path):
    page = (DOCS / "hold.md").read_text(encoding="utf-8")
    assert set(re.findall(r"--pose (\S+)", page)) == {"stoop.pose", "FILE.pose`,"}
    path = tmp_path / "stoop.pose"
    (text,) = re.findall(r"```\n(# [^`]+)```", page)
    path.write_text(text, encoding="utf-8")
    picture = tmp_path / "hold.svg"
    loads = ("--load", "left_hand=10kg", "--load", "right_hand=10kg")
    said = answer("hold", "male50", "--pose", path, *loads, "--balance", "-o", picture)
    assert said["balance"]["margin_m"] > 0.05
    assert said["weakest"]["joint"] == "waist"
    kept = DOCS / "pictures" / "hold.svg"
    shown, drawn = (
        re.findall(r">([1-9]\d* %)</text>", one.read_text(encoding="utf-8"))
        for one in (picture, kept)
    )
    assert shown == drawn
    assert len(shown) > 5


@pytest.mark.slow
def test_along_a_motion(tmp_path: Path):
    motion, table = tmp_path / "fall.action", tmp_path / "hold.csv"
    run("simulate", "male50", "--stop", "0.1", "--frame", "0.05", "--free-root", "-o", motion)
    said = answer("hold", "male50", "--along", motion, "--load", "left_hand=3kg", "-o", table)
    count = len(said["times_s"])
    assert count == len(said["use"]) == len(said["margin_m"]) == 3
    first = hold(FIGURE_FILE.read("male50"), loads=[Load("left_hand", 3.0)])
    assert said["use"][0] == pytest.approx(first.largest_use, rel=1e-6)
    assert len(table.read_text(encoding="utf-8").splitlines()) > count
    text = run("hold", "male50", "--along", motion).stdout
    assert "each taken as a posture at rest" in text


def test_frames_off_the_feet_have_no_numbers(tmp_path: Path, man: Holder):
    figure, path = man.model.figure, tmp_path / "roll.action"
    moved = {name: np.tile(joint.displacement, (3, 1)) for name, joint in figure.joints.items()}
    moved["root_torso"][:, 0] = np.radians([0.0, 90.0, 180.0])
    times = np.array([0.0, 0.1, 0.2])
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    motion_writer(path)(FigureMotion(figure, header_of(times), chains, times, moved), path)
    said = answer("hold", "male50", "--along", path)
    assert said["use"][0] is not None
    assert said["use"][-1] is None
    assert "off its feet" in run("hold", "male50", "--along", path).stdout


def test_examples_of_the_page_print_what_it_says():
    page = (DOCS / "hold.md").read_text(encoding="utf-8")
    command = re.search(r"mover (hold female50 .*)", page)
    printed = re.search(r"```\n(female50: .*?)```", page, re.DOTALL)
    assert command is not None
    assert printed is not None
    said = [line.rstrip() for line in run(*command[1].split()).stdout.splitlines()]
    expected = [line for line in printed[1].splitlines() if line not in ("...", "")]
    assert len(expected) == 9
    assert [line for line in expected if line not in said] == []


def test_squat_of_the_page_needs_the_shin_muscles_it_says():
    page = (DOCS / "hold.md").read_text(encoding="utf-8")
    numbers = re.search(
        r"the ankle's net moment is ([\d.]+)\s+N m, but the calf, stretched, pulls with ([\d.]+) "
        r"N m the other way, so that the shin's muscles need ([\d.]+) N m, (\d+) % of their "
        r"strength; without\s+passive moments they would need (\d+) %",
        page,
    )
    assert numbers is not None
    row = rows_of(answer("hold", "male50", *SQUAT))["left_ankle", "dorsiflexion"]
    bare = rows_of(answer("hold", "male50", *SQUAT, "--springs", "none"))
    assert [float(number) for number in numbers.groups()] == [
        round(row["net_Nm"], 1),
        round(-row["passive_Nm"], 1),
        round(row["active_Nm"], 1),
        round(100 * row["use"]),
        round(100 * bare["left_ankle", "dorsiflexion"]["use"]),
    ]
