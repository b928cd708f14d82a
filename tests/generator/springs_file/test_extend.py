"""Springs files that change some springs of another file."""

from dataclasses import replace
from pathlib import Path

import pytest

from generator import read_figure
from generator.figure_file import FIGURE_FILE
from generator.springs_file.read import joints_without_elastic_law, load_springs, load_springs_file
from springs import Damping, Linear, SphericalLaw, SpringSet, Stop

PROTOTYPE = read_figure("prototype")
FOLDER = FIGURE_FILE.shipped()["prototype"].parent
ELBOW = '[[spring]]\njoints = ["left_elbow"]\nstiffness_Nm_rad = 4\n'


def loaded(path: Path | None, text: str = "") -> SpringSet:
    if path is not None:
        path.write_text(text, encoding="utf-8")
    reading = load_springs(PROTOTYPE, FOLDER, "prototype", path)
    assert reading.value is not None, reading.diagnostics
    assert reading.diagnostics == ()
    return reading.value.springs


def failures(path: Path, text: str) -> list[str]:
    path.write_text(text, encoding="utf-8")
    reading = load_springs(PROTOTYPE, FOLDER, "prototype", path)
    assert reading.value is None
    return [one.message for one in reading.diagnostics]


OWN = loaded(None)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "my.springs.toml"


def test_a_file_changes_the_springs_that_it_names_and_no_other(path: Path) -> None:
    springs = loaded(path, ELBOW)
    changed = {name for name, joint in springs.joints.items() if joint != OWN.joints[name]}
    assert changed == {"left_elbow"}
    (axis,) = springs.joints["left_elbow"].axes
    assert axis.elastic == (Linear(4.0),)
    assert axis.damping == OWN.joints["left_elbow"].axes[0].damping
    assert axis.motion == "flexion"
    assert axis.reference == ""
    assert springs.origin == "my.springs.toml over prototype.springs.toml"


def test_stated_damping_replaces_damping_alone(path: Path) -> None:
    springs = loaded(path, '[[spring]]\njoints = ["left_elbow"]\nviscous_Nms_rad = 0.5\n')
    (axis,), (before,) = springs.joints["left_elbow"].axes, OWN.joints["left_elbow"].axes
    assert axis.damping == Damping(0.5)
    assert (axis.elastic, axis.reference) == (before.elastic, before.reference)


def test_one_axis_of_a_ball_keeps_the_others(path: Path) -> None:
    text = '[[spring]]\njoints = ["waist"]\naxis = "x"\nstiffness_Nm_rad = 4\n'
    axes = {one.direction: one for one in loaded(path, text).joints["waist"].axes}
    before = {one.direction: one for one in OWN.joints["waist"].axes}
    assert [d for d in before if axes[d] != before[d]] == [(1.0, 0.0, 0.0)]


def test_without_a_base_the_other_joints_are_limp(path: Path) -> None:
    path.write_text('base = "none"\n' + ELBOW, encoding="utf-8")
    reading = load_springs(PROTOTYPE, FOLDER, "prototype", path)
    assert len(joints_without_elastic_law(PROTOTYPE, reading.value.springs)) == 9
    assert joints_without_elastic_law(PROTOTYPE, OWN) == ("root_torso",)
    assert reading.value.springs.joints["left_elbow"].axes[0].damping == Damping()


@pytest.mark.parametrize("name", ["coupled", "prototype.coupled", "base.springs.toml"])
def test_a_file_extends_the_one_that_it_names(name: str, path: Path) -> None:
    base = (FOLDER / "prototype.coupled.springs.toml").read_text(encoding="utf-8")
    path.with_name("base.springs.toml").write_text(base, encoding="utf-8")
    springs = loaded(path, f'extends = "{name}"\nlaw = "weighted"\n{ELBOW}')
    assert len(springs.coupled) == 2
    assert springs.law is SphericalLaw.WEIGHTED
    assert springs.joints["left_elbow"].axes[0].elastic == (Linear(4.0),)
    assert springs.origin.count(" over ") == 2


def test_a_law_over_several_joints_replaces_the_curves_of_its_axes() -> None:
    springs = load_springs(PROTOTYPE, FOLDER, "prototype", "coupled").require_value().springs
    changed = {name for name, joint in springs.joints.items() if joint != OWN.joints[name]}
    assert changed == {"left_knee", "right_knee", "left_hip_joint", "right_hip_joint"}
    assert springs.joints["left_knee"].axes[0].elastic == ()
    assert "Yoon" not in "".join(springs.references)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('extends = "nothing"\n' + ELBOW, "there are no springs `nothing` to extend"),
        ('extends = "prototype"\nbase = "none"\n' + ELBOW, "`base` excludes `extends`"),
        ('base = "prototype"\n' + ELBOW, "`base` cannot be `prototype`"),
        (
            'extends = "my.springs.toml"\n' + ELBOW,
            "the files extend each other in a circle: my.springs.toml",
        ),
        (
            'extends = "coupled"\n' + ELBOW.replace("elbow", "knee"),
            "`left_knee` has a law over several joints about this axis in "
            "prototype.coupled.springs.toml over prototype.springs.toml, to which this one would "
            "add",
        ),
    ],
)
def test_a_file_that_cannot_extend(text: str, message: str, path: Path) -> None:
    assert failures(path, text) == [message]


def test_a_check_of_a_file_finds_what_its_base_makes_wrong(path: Path) -> None:
    path.write_text(
        'figure = "prototype"\nextends = "coupled"\n' + ELBOW.replace("elbow", "knee"), "utf-8"
    )
    (fault,) = load_springs_file(path).diagnostics
    assert fault.message.startswith("`left_knee` has a law over several joints")
    path.write_text('figure = "prototype"\n' + ELBOW, "utf-8")
    loaded = load_springs_file(path).require_value()
    assert set(loaded.springs.joints) == {"left_elbow"}
    assert loaded.complete.joints.keys() == OWN.joints.keys()


def test_damping_alone_leaves_the_stops_as_they_are(path: Path, tmp_path: Path) -> None:
    text = ELBOW + "stop_stiffness_Nm_rad = 999\n"
    path.with_name("base.springs.toml").write_text('base = "none"\n' + text, "utf-8")
    path.write_text(
        'extends = "base.springs.toml"\n[[spring]]\njoints = ["left_elbow"]\ncoulomb_Nm = 1\n',
        "utf-8",
    )
    limited = replace(PROTOTYPE.joints["left_elbow"], lower_limit=(0.0,), upper_limit=(2.0,))
    figure = PROTOTYPE.with_parts(limited)
    springs = load_springs(figure, FOLDER, "prototype", path).require_value().springs
    (stop,) = (s for s in springs.joints["left_elbow"].axes[0].elastic if isinstance(s, Stop))
    assert stop.stiffness == 999.0
