"""`mover check` on curves: doubts beside a figure, everything of a springs file by itself."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from generator.cli.app import app
from tests.paths import FIGURES

SPRINGS = FIGURES / "prototype.springs.toml"
KNEES = '[[spring]]\njoints = ["left_knee", "right_knee"]\n'
WRONG = KNEES + 'motion = "flexion"\ncoefficients_Nm_rad = [0, 10, 0, 100]\nsense = +1\n'


def mover(*words: object) -> Result:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(word) for word in words])


def springs_file(folder: Path, text: str) -> Path:
    path = folder / "own.springs.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_figure_is_checked_with_the_doubts_about_its_curves():
    result = mover("check", "prototype")
    assert result.exit_code == 0
    for sentence in (
        "free motion ends at 97.4 deg, but elbow flexion normally ends at 144.6 deg",
        "free motion ends at 89.0 deg, but knee flexion normally ends at 137.7 deg",
        "36.15 N m at 90.0 deg",
        "soucie_2011: ",
        "11 curves, 15 doubts",
    ):
        assert sentence in result.stdout
    assert "  note" not in result.stdout


def test_a_figure_without_springs_has_no_curves():
    result = mover("check", "prototype", "--springs", "none")
    assert result.exit_code == 0
    assert "curve" not in result.stdout


def test_a_springs_file_is_told_whole():
    result = mover("check", SPRINGS)
    assert result.exit_code == 0, result.output
    assert "right_knee, left_knee about -y, flexion, from -11.0 to 147.7 deg" in result.stdout
    assert "left and right are mirror images" in result.stdout
    assert "a stable equilibrium at 23.2 deg" in result.stdout
    assert result.stdout.endswith("no warnings; the springs can be used for `prototype`\n")


def test_the_findings_in_json():
    said = json.loads(mover("check", SPRINGS, "--json").stdout)["findings"]
    assert {one["severity"] for one in said} == {"doubt", "note"}
    (stop,) = (f for f in said if f["kind"] == "free motion" and "left_elbow" in f["joints"])
    assert stop["severity"] == "doubt"
    assert stop["angles_deg"] == pytest.approx([97.4, 144.6], abs=0.05)
    assert (stop["axis"], stop["motion"]) == ("y", "flexion")
    figure = json.loads(mover("check", "prototype", "--json").stdout)
    assert figure["findings"] == said
    assert [fault["severity"] for fault in figure["faults"]] == ["warning"]
    assert "error" not in figure
    assert figure["verdict"].endswith("the figure can be simulated")


@pytest.mark.parametrize("head", ["", 'figure = "prototype"\n'])
def test_a_wrong_sense_is_flagged(head: str, tmp_path: Path):
    result = mover("check", springs_file(tmp_path, head + WRONG))
    assert result.exit_code == 0
    assert "own.springs.toml" in result.stdout
    assert "in this sense the cubic drives the joint away at both ends" in result.stdout
    assert "the torque drives away from 0.0 deg" in result.stdout
    assert "an unstable equilibrium at 0.0 deg" in result.stdout


def test_a_joint_that_the_figure_lacks_is_an_error_with_its_place(tmp_path: Path):
    text = 'figure = "prototype"\n' + WRONG.replace("left_knee", "left_kene")
    path = springs_file(tmp_path, text)
    result = mover("check", path)
    assert result.exit_code == 1
    assert f"{path}:3:11: error: the figure has no joint `left_kene`" in result.stdout
    assert "did you mean `left_knee`?" in result.stdout
    assert "the springs cannot be used" in result.stdout


def test_the_figure_beside_the_springs_is_preferred(tmp_path: Path):
    """A pendulum that calls itself a prototype lacks the joint."""
    pendulum = (SPRINGS.parent / "pendulum.fig").read_text(encoding="utf-8")
    (tmp_path / "prototype.fig").write_text(pendulum, encoding="utf-8")
    result = mover("check", springs_file(tmp_path, 'figure = "prototype"\n' + WRONG))
    assert result.exit_code == 1
    assert "the figure has no joint `left_knee`" in result.stdout


def test_a_figure_that_is_not_there_is_a_warning(tmp_path: Path):
    result = mover("check", springs_file(tmp_path, 'figure = "nobody"\n' + WRONG))
    assert result.exit_code == 0
    assert "own.springs.toml:1:10: warning: the figure `nobody` is not found" in result.stdout
    assert "left_knee, right_knee about its axis, flexion" in result.stdout


@pytest.mark.parametrize("head", ["", 'figure = "prototype"\n'])
@pytest.mark.parametrize(
    "text",
    [
        '[[spring]]\njoints = ["left_knee", "left_knee"]\nstiffness_Nm_rad = 1\n',
        KNEES + "stiffness_Nm_rad = 1\n" + KNEES + "viscous_Nms_rad = 1\n",
        KNEES + 'axis = "y"\nstiffness_Nm_rad = 1\n' + KNEES + 'axis = "y"\ncoulomb_Nm = 1\n',
        KNEES + 'axis = "joint"\nstiffness_Nm_rad = 1\n' + KNEES + 'axis = "y"\ncoulomb_Nm = 1\n',
    ],
)
def test_a_second_spring_about_one_axis_is_an_error_without_a_figure_too(
    head: str, text: str, tmp_path: Path
):
    result = mover("check", springs_file(tmp_path, head + text))
    assert result.exit_code == 1
    assert "a second spring about one axis of `left_knee`" in result.stdout
    assert "the springs cannot be used" in result.stdout


def test_several_axes_of_one_joint_are_none_too_many(tmp_path: Path):
    axes = [f'axis = "{axis}"\nstiffness_Nm_rad = 1\n' for axis in "xyz"]
    text = "".join('[[spring]]\njoints = ["left_hip"]\n' + axis for axis in axes)
    assert mover("check", springs_file(tmp_path, text)).exit_code == 0


COUPLED = (
    '[[coupled]]\njoints = ["left_hip_joint", "left_knee"]\naxes = ["y", "joint"]\n'
    'coordinates = ["hip flexion", "knee flexion"]\npublished = "riener_edrich_1999/leg"\n'
    'held = ["ankle dorsiflexion"]\nheld_deg = [0]\n'
)


@pytest.mark.parametrize("head", ["", 'figure = "prototype"\n'])
def test_one_law_over_several_joints_twice_is_an_error_too(head: str, tmp_path: Path):
    result = mover("check", springs_file(tmp_path, head + COUPLED + COUPLED))
    assert result.exit_code == 1
    assert "this law is bound to `left_hip_joint` and `left_knee` already" in result.stdout
    once = mover("check", springs_file(tmp_path, head + COUPLED))
    assert once.exit_code == 0


def test_an_axis_that_only_a_figure_tells_is_not_invented(tmp_path: Path):
    path = springs_file(tmp_path, KNEES + "stiffness_Nm_rad = 1\n" + COUPLED)
    result = mover("check", path)
    assert "left_knee, right_knee about its axis, from" in result.stdout
    assert "\nleft_hip_joint y, left_knee: hip flexion, knee flexion\n" in result.stdout
    said = json.loads(mover("check", path, "--json").stdout)["findings"]
    assert {one["axis"] for one in said if "axis" in one} == {"joint"}


@pytest.mark.parametrize("head", ["", 'figure = "prototype"\n'])
def test_a_published_curve_of_another_joint_is_a_warning(head: str, tmp_path: Path):
    text = KNEES + 'published = "silder_2007/hip_knee_15"\n'
    result = mover("check", springs_file(tmp_path, head + text))
    assert result.exit_code == 0
    line = 2 + bool(head)
    for column, joint in ((11, "left_knee"), (24, "right_knee")):
        said = f"`silder_2007/hip_knee_15` is a curve of hip flexion, but the joint is `{joint}`"
        assert f"own.springs.toml:{line}:{column}: warning: {said}" in result.stdout


@pytest.mark.parametrize(
    ("joint", "row"),
    [
        ("left_knee", "silder_2007/knee_hip_45_ankle_0"),
        ("waist", "schmidt_1998/flexion"),
        ("lumbar_spine", "schmidt_1998/flexion"),
        ("left_shoulder", "saul_2015/shoulder_elv"),
        ("hinge_3", "silder_2007/hip_knee_15"),
    ],
)
def test_one_of_this_joint_or_of_no_known_one_is_none(joint: str, row: str, tmp_path: Path):
    text = f'[[spring]]\njoints = ["{joint}"]\npublished = "{row}"\n'
    assert "no warnings" in mover("check", springs_file(tmp_path, text)).stdout


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[spring]]\n", "this spring has no `joints`"),
        ("spring = 1\n", "springs are tables"),
        ("what?\n", "a springs file is written in TOML"),
        (
            KNEES + "coefficients_Nm_rad = [1, 0, 1, 0]\n",
            "no sense makes this cubic of `left_knee`",
        ),
    ],
)
def test_a_broken_springs_file_ends_with_1(text: str, message: str, tmp_path: Path):
    result = mover("check", springs_file(tmp_path, text))
    assert result.exit_code == 1
    assert message in result.stdout
    assert "the springs cannot be used" in result.stdout


def test_a_springs_file_that_is_not_there(tmp_path: Path):
    result = mover("check", tmp_path / "none.toml")
    assert result.exit_code == 1
    assert "none.toml` cannot be read: no such file" in result.stdout


def test_springs_of_springs_are_wrong_usage():
    result = mover("check", SPRINGS, "--springs", "none")
    assert result.exit_code == 2
    assert "--springs applies to a figure" in result.stderr


def test_a_law_over_several_joints_is_told_whole():
    path = SPRINGS.with_name("prototype.coupled.springs.toml")
    result = mover("check", path)
    assert result.exit_code == 0, result.output
    for sentence in (
        "left_hip_joint y, left_knee -y; right_hip_joint y, right_knee -y: hip flexion, knee",
        "the torques are the gradient of an energy",
        "the law that was replaced: carried once round hip flexion -15 .. 100 deg and knee flexion "
        "0 .. 135 deg the law does -12.67 J of work",
        "the nearest law of the same exponentials that has an energy differs by rms 0.837 N m "
        "about hip flexion (at most 6), 1.55 N m about knee flexion",
        "it is an extrapolation, with up to",
        "left and right have the same law",
        "9 curves, 1 law over several joints, 11 doubts",
    ):
        assert sentence in result.stdout
    said = json.loads(mover("check", path, "--json").stdout)["findings"]
    (replaced,) = (f for f in said if "replaced" in f["message"] and len(f["values"]) == 1)
    assert replaced["values"] == pytest.approx([-12.67], abs=0.01)
    assert replaced["joints"][1] == ["right_hip_joint", "right_knee"]


def test_the_published_pair_is_a_doubt_beside_the_figure(tmp_path: Path):
    text = SPRINGS.with_name("prototype.coupled.springs.toml").read_text(encoding="utf-8")
    line = 'conservative = "nearest"\n'
    assert line in text
    path = springs_file(tmp_path, text.replace(line, ""))
    result = mover("check", "prototype", "--springs", path)
    assert result.exit_code == 0
    assert "no energy belongs to it" in result.stdout
    assert "  note" not in result.stdout


def test_a_curve_beside_a_coupled_law_is_a_doubt(tmp_path: Path):
    text = SPRINGS.with_name("prototype.coupled.springs.toml").read_text(encoding="utf-8")
    knee = 'joints = ["left_knee", "right_knee"]\n'
    assert text.count(knee) == 1
    path = springs_file(tmp_path, text.replace(knee, knee + "stiffness_Nm_rad = 30\n"))
    result = mover("check", "prototype", "--springs", path)
    assert "`left_knee` and `right_knee` have a curve with up to 70.69 N m" in result.stdout


def test_an_extrapolated_curve_is_told(tmp_path: Path):
    text = KNEES + 'published = "silder_2007/knee_hip_45_ankle_0"\n'
    result = mover("check", springs_file(tmp_path, text))
    assert "left_knee, right_knee about its axis, flexion, from -11.0 to 147.7 deg" in result.stdout
    assert "the curve is known for 0 .. 120 deg only" in result.stdout
    assert "note   known range" in result.stdout


def test_springs_by_name_that_are_not_there_list_what_is():
    result = mover("check", "prototype", "--springs", "couplde")
    assert result.exit_code == 1
    assert "there are no springs `couplde` beside the figure `prototype`" in result.stdout
    assert "there are coupled, none, printed" in result.stdout
