"""`mover check`: a figure with the doubts about its curves, and everything of a springs file."""

import json
from pathlib import Path

import pytest

from generator import read_figure
from tests.command import answer, mover, run
from tests.paths import FAULTS, FIGURES

SPRINGS = FIGURES / "prototype.springs.toml"
COUPLED_SPRINGS = FIGURES / "prototype.coupled.springs.toml"
REFUSED = Path(__file__).parent / "refusals" / "files"
KNEES = '[[spring]]\njoints = ["left_knee", "right_knee"]\n'
WRONG = KNEES + 'motion = "flexion"\ncoefficients_Nm_rad = [0, 10, 0, 100]\nsense = +1\n'
SECOND = "a second spring about one axis of `left_knee`"
COUPLED = (
    '[[coupled]]\njoints = ["left_hip_joint", "left_knee"]\naxes = ["y", "joint"]\n'
    'coordinates = ["hip flexion", "knee flexion"]\npublished = "riener_edrich_1999/leg"\n'
    'held = ["ankle dorsiflexion"]\nheld_deg = [0]\n'
)


def springs_file(folder: Path, text: str) -> Path:
    path = folder / "own.springs.toml"
    path.write_text(text, encoding="utf-8")
    return path


def replaced(path: Path, old: str, new: str) -> str:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    return text.replace(old, new)


# Figures

ARM = """  segment {side}_arm {{
    mass = 2kg; inertia = (0.02 kg m2, 0.02 kg m2, 0.002 kg m2);
    site near->location = trans(0cm,0cm,0cm); site CM->location = trans(0cm,-10cm,0cm);
  }}
  joint {side}_shoulder {{
    connect trunk.{side} to {side}_arm.near; type = R({axis});
    stiff = (3 N m/rad); rest = ({rest}deg); damp = (0.1 N m s/rad);
  }}
"""
TRUNK = """figure {{
  segment trunk {{
    mass = -1kg;
    site left->location = trans(20cm,0cm,0cm); site right->location = trans(-20cm,0cm,0cm);
  }}
{arms}  root = trunk.left;
}}
"""


def symmetry_findings(path: Path) -> list[tuple[str, str]]:
    """Severities and messages of the findings about left and right."""
    findings = answer("check", path)["findings"]
    return [(one["severity"], one["message"]) for one in findings if one["kind"] == "symmetry"]


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [
        (("0,1,0", 20), None, []),
        (("0,1,0", 20), ("0,-1,0", 20), [("note", "left and right are mirror images")]),
        (("0,1,0", 20), ("0,1,0", -20), [("note", "left and right are mirror images")] * 2),
        (("0.6,0.8,0", 20), ("0.6,-0.8,0", 20), [("note", "left and right are mirror images")]),
        (("1,0,0", 20), ("1,0,0", 20), [("note", "left and right are mirror images")]),
        (("0,1,0", 20), ("0,1,0", 20), [("doubt", "differs by up to 2.09 N m")] * 2),
        (("1,0,0", 20), ("0,1,0", 20), [("doubt", "has no spring about this axis")] * 2),
    ],
)
def test_sides_are_compared_as_mirror_images(
    left: tuple[str, int],
    right: tuple[str, int] | None,
    expected: list[tuple[str, str]],
    tmp_path: Path,
):
    """A joint that the figure has on one side only has no other side."""
    sides = {"left": left} if right is None else {"left": left, "right": right}
    arms = "".join(
        ARM.format(side=side, axis=axis, rest=rest) for side, (axis, rest) in sides.items()
    )
    path = tmp_path / "arms.fig"
    path.write_text(TRUNK.format(arms=arms), encoding="utf-8")
    found = symmetry_findings(path)
    assert len(found) == len(expected)
    for (severity, message), (kind, part) in zip(found, expected, strict=True):
        assert severity == kind
        assert part in message


def test_a_figure_is_checked_with_the_doubts_about_its_curves():
    brief, said = run("check", "prototype").stdout, run("check", "prototype", "--doubts").stdout
    assert "free motion ends" not in brief
    counts = "11 curves, 15 doubts (early resistance 10, free motion 4, slope 1)"
    assert f"\n{counts}; --doubts prints them\n\nprototype: no errors" in brief
    assert f"\n{counts}\n\nprototype: no errors" in said
    for sentence in (
        "note: total mass 49.28 kg",
        "free motion ends at 97.4 deg, but elbow flexion normally ends at 144.6 deg",
        "free motion ends at 89.0 deg, but knee flexion normally ends at 137.7 deg",
        "36.15 N m at 90.0 deg",
        "soucie_2011: ",
        "11 curves, 15 doubts",
    ):
        assert sentence in said
    assert "  note" not in said
    assert said.endswith("prototype: no errors, no warnings; the figure can be simulated\n")


def test_a_figure_without_springs_has_no_curves():
    assert "curve" not in run("check", "prototype", "--springs", "none").stdout


@pytest.mark.parametrize(
    ("path", "code", "sentences"),
    [
        (REFUSED / "broken.fig", 1, ["did you mean `root`?", "the figure cannot be used"]),
        (FAULTS / "figure" / "binary.fig", 1, ["binary.fig:", "the figure cannot be used"]),
        (REFUSED / "massless.fig", 0, ["the figure can be read, but not simulated"]),
        (REFUSED / "stone.fig", 1, ["none of its segments moves"]),
    ],
)
def test_a_figure_that_cannot_be_simulated(path: Path, code: int, sentences: list[str]):
    result = mover("check", path)
    assert result.exit_code == code
    assert all(sentence in result.stdout for sentence in sentences)


def test_a_loop_that_cannot_close_is_an_error(tmp_path: Path):
    path = tmp_path / "wide.fig"
    text = replaced(FIGURES / "fourbar.fig", "trans(30cm,0cm,0cm)", "trans(3m,0cm,0cm)")
    path.write_text(text, encoding="utf-8")
    result = mover("check", path)
    assert result.exit_code == 1
    assert "opens the loop" in result.stdout
    assert mover("check", "fourbar").exit_code == 0


def test_faults_in_json():
    path = FAULTS / "figure" / "unknown_field.fig"
    result = mover("check", path, "--json")
    assert result.exit_code == 1
    said = json.loads(result.stdout)
    assert said["error"] == "the input is wrong"
    assert said["verdict"].endswith("the figure cannot be used")
    assert {fault["severity"] for fault in said["faults"]} >= {"error"}
    assert all(fault["file"] == str(path) and fault["line"] > 0 for fault in said["faults"])


def test_springs_of_a_figure_by_name_or_file(tmp_path: Path):
    path = springs_file(tmp_path, KNEES.replace("left_knee", "left_kene") + "viscous_Nms_rad = 1\n")
    result = mover("check", "prototype", "--springs", path)
    assert result.exit_code == 1
    assert "did you mean `left_knee`?" in result.stdout
    result = mover("check", "prototype", "--springs", "couplde")
    assert result.exit_code == 1
    assert "there are no springs `couplde` beside the figure `prototype`" in result.stdout
    assert "there are coupled, none, printed" in result.stdout


# Springs files


def test_a_springs_file_is_listed_whole():
    said = run("check", SPRINGS).stdout
    assert "right_knee, left_knee about -y, flexion, from -11.0 to 147.7 deg" in said
    assert "left and right are mirror images" in said
    assert "a stable equilibrium at 23.2 deg" in said
    assert said.endswith("no warnings; the springs can be used for `prototype`\n")


def test_the_findings_in_json():
    said = answer("check", SPRINGS)["findings"]
    assert {one["severity"] for one in said} == {"doubt", "note"}
    (stop,) = (f for f in said if f["kind"] == "free motion" and "left_elbow" in f["joints"])
    assert stop["severity"] == "doubt"
    assert stop["angles_deg"] == pytest.approx([97.4, 144.6], abs=0.05)
    assert (stop["axis"], stop["motion"]) == ("y", "flexion")
    figure = answer("check", "prototype")
    assert figure["findings"] == said
    assert [fault["severity"] for fault in figure["faults"]] == ["note"]
    assert "error" not in figure
    assert figure["verdict"].endswith("the figure can be simulated")


HEADS = pytest.mark.parametrize("head", ["", 'figure = "prototype"\n'], ids=["alone", "figure"])


@HEADS
def test_a_wrong_sense_is_flagged(head: str, tmp_path: Path):
    said = run("check", springs_file(tmp_path, head + WRONG)).stdout
    assert "own.springs.toml" in said
    assert "in this sense the cubic drives the joint away at both ends" in said
    assert "the torque drives away from 0.0 deg" in said
    assert "an unstable equilibrium at 0.0 deg" in said


def knees(*springs: str) -> str:
    return "".join(KNEES + spring for spring in springs)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("what?\n", "a springs file is written in TOML"),
        (knees("coefficients_Nm_rad = [1, 0, 1, 0]\n"), "no sense makes this cubic of `left_knee`"),
        (knees("stiffness_Nm_rad = 1\n", "viscous_Nms_rad = 1\n"), SECOND),
        (knees('axis = "y"\nstiffness_Nm_rad = 1\n', 'axis = "y"\ncoulomb_Nm = 1\n'), SECOND),
        (knees('axis = "joint"\nstiffness_Nm_rad = 1\n', 'axis = "y"\ncoulomb_Nm = 1\n'), SECOND),
        (COUPLED + COUPLED, "this law is bound to `left_hip_joint` and `left_knee` already"),
    ],
)
def test_a_broken_springs_file_without_a_figure(text: str, message: str, tmp_path: Path):
    result = mover("check", springs_file(tmp_path, text))
    assert result.exit_code == 1
    assert message in result.stdout
    assert "the springs cannot be used" in result.stdout


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
    pendulum = (FIGURES / "pendulum.fig").read_text(encoding="utf-8")
    (tmp_path / "prototype.fig").write_text(pendulum, encoding="utf-8")
    result = mover("check", springs_file(tmp_path, 'figure = "prototype"\n' + WRONG))
    assert result.exit_code == 1
    assert "the figure has no joint `left_knee`" in result.stdout


def test_a_figure_or_a_springs_file_that_is_missing(tmp_path: Path):
    said = run("check", springs_file(tmp_path, 'figure = "nobody"\n' + WRONG)).stdout
    assert "own.springs.toml:1:10: warning: the figure `nobody` is not found" in said
    assert "left_knee, right_knee about its axis, flexion" in said
    result = mover("check", tmp_path / "none.toml")
    assert result.exit_code == 1
    assert "none.toml` cannot be read: no such file" in result.stdout


@HEADS
def test_several_axes_of_one_joint_and_one_coupled_law_are_accepted(head: str, tmp_path: Path):
    axes = [f'axis = "{axis}"\nstiffness_Nm_rad = 1\n' for axis in "xyz"]
    text = "".join('[[spring]]\njoints = ["left_hip_joint"]\n' + axis for axis in axes)
    run("check", springs_file(tmp_path, head + text))
    run("check", springs_file(tmp_path, head + COUPLED))


def test_an_axis_that_only_a_figure_defines_is_not_invented(tmp_path: Path):
    path = springs_file(tmp_path, KNEES + "stiffness_Nm_rad = 1\n" + COUPLED)
    said = run("check", path).stdout
    assert "left_knee, right_knee about its axis, from" in said
    assert "\nleft_hip_joint y, left_knee: hip flexion, knee flexion\n" in said
    findings = answer("check", path)["findings"]
    assert {one["axis"] for one in findings if "axis" in one} == {"joint"}


def test_a_published_curve_of_another_joint_is_a_warning(tmp_path: Path):
    text = knees('published = "silder_2007/hip_knee_15"\n')
    said = run("check", springs_file(tmp_path, text)).stdout
    for column, joint in ((11, "left_knee"), (24, "right_knee")):
        warning = f"`silder_2007/hip_knee_15` is a curve of hip flexion, but the joint is `{joint}`"
        assert f"own.springs.toml:2:{column}: warning: {warning}" in said


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
def test_a_published_curve_of_this_joint_or_of_an_unknown_one(joint: str, row: str, tmp_path: Path):
    text = f'[[spring]]\njoints = ["{joint}"]\npublished = "{row}"\n'
    assert "no warnings" in run("check", springs_file(tmp_path, text)).stdout


def test_a_law_over_several_joints_is_listed_whole():
    printed = run("check", COUPLED_SPRINGS).stdout
    for sentence in (
        "left_hip_joint y, left_knee -y; right_hip_joint y, right_knee -y: hip flexion, knee",
        "the torques are the gradient of an energy",
        "the law that was replaced: carried once round hip flexion -15 .. 100 deg and knee flexion "
        "0 .. 135 deg the law does -12.67 J of work",
        "the nearest law of the same exponentials that has an energy differs by rms 0.837 N m "
        "about hip flexion (at most 6), 1.55 N m about knee flexion",
        "it is an extrapolation, with up to",
        "left and right have the same law",
        "no curves, 1 law over several joints, no doubts",
    ):
        assert sentence in printed
    said = answer("check", COUPLED_SPRINGS)["findings"]
    (work,) = (f for f in said if "replaced" in f["message"] and len(f["values"]) == 1)
    assert work["values"] == pytest.approx([-12.67], abs=0.01)
    assert work["joints"][1] == ["right_hip_joint", "right_knee"]


@pytest.mark.parametrize(
    ("old", "new", "doubt"),
    [
        ('conservative = "nearest"\n', "", "no energy belongs to it"),
        (
            'joints = ["left_knee", "right_knee"]\n',
            'joints = ["left_knee", "right_knee"]\nstiffness_Nm_rad = 30\n',
            "`left_knee` and `right_knee` have a curve with up to 70.69 N m",
        ),
    ],
    ids=["published", "curve"],
)
def test_a_doubt_about_a_coupled_law_beside_the_figure(
    old: str, new: str, doubt: str, tmp_path: Path
):
    path = springs_file(tmp_path, replaced(COUPLED_SPRINGS, old, new))
    said = run("check", "prototype", "--springs", path, "--doubts").stdout
    assert doubt in said
    assert "  note" not in said


# Scenes

SCENE = """[[surface]]
name = "wood"
friction = 0.5

[[box]]
name = "ramp"
centre_m = [0, -0.5, 1]
size_m = [1, 1, 2]
angles_deg = [-10, 0, 0]
surface = "wood"

[[plane]]
name = "wall"
normal = [0, 0, 1]
surface = "wood"
"""


def test_a_scene_is_listed_with_its_warnings(tmp_path: Path):
    path = tmp_path / "own.scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    text = run("check", path).stdout
    for sentence in (
        "own.scene.toml:1:1: warning: this surface has no `source`",
        "box 1 x 1 x 2 m at (0, -0.5, 1) m, turned by xyz(-10, 0, 0) deg",
        "plane through (0, 0, 0) m, normal (0, 0, 1)",
        "30000 N/m, 1 s/m, friction 0.5",
        "own.scene.toml: no errors, 1 warning; the scene can be used",
    ):
        assert sentence in text


@pytest.mark.parametrize("name", ["bed", "seat", "step"])
def test_a_shipped_scene_is_found_by_its_name(name: str):
    verdict = answer("check", name)["verdict"]
    assert verdict == f"{name}: no errors, no warnings; the scene can be used"


STUDY = """\
figure = "pendulum"
[design]
kind = "sobol"
runs = 6
[parameters]
a = { path = "gravity", low = 0.8, high = 1.2 }
[measures]
end = { column = "kinetic [J]", take = "last" }
"""


def test_a_study_has_its_warnings_and_its_runs(tmp_path: Path):
    path = tmp_path / "own.study.toml"
    path.write_text(STUDY, encoding="utf-8")
    text = run("check", path).stdout
    assert "own.study.toml:4:8: warning: 6 is not a power of two" in text
    verdict = "no errors, 1 warning; the study can be run, with 6 runs of pendulum"
    assert f"own.study.toml: {verdict}" in text


@pytest.mark.parametrize(
    ("noun", "text", "use", "messages"),
    [
        (
            "scene",
            SCENE.replace('surface = "wood"', 'surface = "wod"'),
            "the scene cannot be used",
            ["there is no surface `wod`"] * 2,
        ),
        (
            "study",
            STUDY.replace("gravity", "gravty").replace("kinetic", "kinetc"),
            "the study cannot be run",
            ["did you mean `gravity`?", "did you mean `kinetic [J]`?"],
        ),
    ],
)
def test_a_wrong_scene_or_study_has_its_errors(
    noun: str, text: str, use: str, messages: list[str], tmp_path: Path
):
    path = tmp_path / f"own.{noun}.toml"
    path.write_text(text, encoding="utf-8")
    result = mover("check", path, "--json")
    assert result.exit_code == 1
    data = json.loads(result.stdout)
    assert data["verdict"] == f"{path}: 2 errors, 1 warning; {use}"
    errors = [one for one in data["faults"] if one["severity"] == "error"]
    assert [one["message" if noun == "scene" else "hint"] for one in errors] == messages


@pytest.mark.parametrize("name", ["female50", FIGURES / "female50.springs.toml"])
def test_a_woman_is_compared_with_ranges_of_women(name: str | Path):
    """Her neck and wrists end before the ranges of men."""
    doubts = [one for one in answer("check", name)["findings"] if one["severity"] == "doubt"]
    joints = {joint for one in doubts for joint in one["joints"] if isinstance(joint, str)}
    assert joints
    assert not {"neck", "left_wrist"} & joints


def test_parts_beside_a_figure_that_do_not_fit_it_are_an_error(tmp_path: Path):
    text = (
        (FIGURES / "leg.fig")
        .read_text(encoding="utf-8")
        .replace('psurf = "', f'psurf = "{FIGURES}/')
    )
    path, beside = tmp_path / "leg.fig", tmp_path / "leg.contact.toml"
    path.write_text(text, encoding="utf-8")
    part = """[[part]]
name = "sole"
spheres = ["NAME 0"]
from_m = [0]
stiffness_N_m = [3e4]
damping_s_m = 1
class = "estimate"
source = "assumed"
"""
    segment = next(iter(read_figure(path).bodies))
    beside.write_text(part.replace("NAME", segment), encoding="utf-8")
    assert answer("check", path)["verdict"].startswith(f"{path}: no errors")
    beside.write_text(part.replace("NAME 0", f"{segment} 99"), encoding="utf-8")
    result = mover("check", path)
    assert result.exit_code == 1
    assert "part `sole` has sphere 99 of segment" in result.output
    beside.write_text(part.replace("3e4", "-3e4"), encoding="utf-8")
    result = mover("check", path)
    assert result.exit_code == 1
    assert "leg.contact.toml:5" in result.output
