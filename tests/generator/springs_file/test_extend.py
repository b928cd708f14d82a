"""Springs files that change some springs of another file."""

from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure, read_springs
from generator.diagnostics import Severity
from generator.figure import AxisKind, JointAxis
from generator.figure_file import FIGURE_FILE
from generator.passive_curve import initial_angles, passive_torque
from generator.springs_file.edit import format_all, format_besides_fields, format_changes
from generator.springs_file.read import joints_without_elastic_law, load_springs, load_springs_file
from springs import Damping, Linear, SphericalLaw, SpringSet, Stop

Z = (0.0, 0.0, 1.0)
PROTOTYPE = read_figure("prototype")
FOLDER = FIGURE_FILE.shipped()["prototype"].parent
ELBOW = '[[spring]]\njoints = ["left_elbow"]\nstiffness_Nm_rad = 4\n'


def loaded(path: Path | None, text: str = "") -> SpringSet:
    if path is not None:
        path.write_text(text, encoding="utf-8")
    reading = load_springs(PROTOTYPE, FOLDER, "prototype", path)
    assert reading.value is not None, reading.diagnostics
    assert reading.diagnostics == ()
    return reading.value


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
    assert len(joints_without_elastic_law(PROTOTYPE, reading.value)) == 9
    assert joints_without_elastic_law(PROTOTYPE, OWN) == ("root_torso",)
    assert reading.value.joints["left_elbow"].axes[0].damping == Damping()


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
    springs = load_springs(PROTOTYPE, FOLDER, "prototype", "coupled").require_value()
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
    ],
)
def test_a_file_that_cannot_extend(text: str, message: str, path: Path) -> None:
    assert failures(path, text) == [message]


def test_a_check_of_a_file_finds_what_it_does_to_its_base(path: Path) -> None:
    path.write_text(
        'figure = "prototype"\nextends = "coupled"\n' + ELBOW.replace("elbow", "knee"), "utf-8"
    )
    (told,) = load_springs_file(path).diagnostics
    assert told.severity is Severity.WARNING
    assert told.message == (
        "the law of hip flexion, knee flexion in prototype.coupled.springs.toml over "
        "prototype.springs.toml acts about hip flexion only, as if knee flexion were 67.5 deg all "
        "the time: `left_knee` has curves of this file"
    )
    assert told.hint == "for another angle, state a law of hip flexion here"
    path.write_text('figure = "prototype"\n' + ELBOW, "utf-8")
    springs, complete, _ = load_springs_file(path).require_value()
    assert set(springs.joints) == {"left_elbow"}
    assert complete.joints.keys() == OWN.joints.keys()


MALE = read_figure("male50")
KNEES = """[[spring]]
joints = ["left_knee", "right_knee"]
motion = "flexion"
points_deg_Nm = [[-5, 12], [0, 6], [30, 1], [90, -1], [130, -10]]
"""


def of_male50(text: str) -> tuple[SpringSet, list[str]]:
    found = load_springs(MALE, FOLDER, "male50", FOLDER / "knee.springs.toml", text=text)
    return found.require_value(), [one.message for one in found.diagnostics]


def test_curves_replace_the_law_over_several_joints_about_their_axis_alone() -> None:
    springs, told = of_male50(KNEES)
    assert told == [
        "the law of hip flexion, knee flexion, ankle dorsiflexion in male50.springs.toml acts "
        "about hip flexion, ankle dorsiflexion only, as if knee flexion were 60 deg all the time: "
        "`left_knee` and `right_knee` have curves of this file"
    ]
    own = read_springs(None, MALE)
    for held, whole in zip(springs.coupled, own.coupled, strict=True):
        assert held.law.is_conservative
        assert held.axes == (whole.axes[0], whole.axes[2])
        for hip, ankle in np.radians([(0, 0), (60, -20), (-20, 15)]).tolist():
            before = whole.law.torques((hip, radians(60.0), ankle))
            assert held.law.torques((hip, ankle)) == pytest.approx((before[0], before[2]))
    (knee,) = springs.joints["left_knee"].axes
    (law,) = (one for one in knee.elastic if not isinstance(one, Stop))
    at = passive_torque(MALE, springs, "left_knee", initial_angles(MALE))
    assert float(at @ knee.direction) == pytest.approx(float(law.torque(0.0)))
    assert knee.damping == own.joints["left_knee"].axes[0].damping


def test_curves_of_one_side_leave_the_other() -> None:
    springs, _ = of_male50(KNEES.replace(', "right_knee"', ""))
    own = read_springs(None, MALE)
    assert [len(one.axes) for one in springs.coupled] == [2, 3]
    assert springs.coupled[1] == own.coupled[1]


def test_a_law_with_one_axis_left_is_a_curve_about_it() -> None:
    hips = '[[spring]]\njoints = ["left_hip_joint"]\naxis = "y"\nstiffness_Nm_rad = 4\n'
    springs, told = of_male50(KNEES + hips)
    assert len(told) == 2
    assert any("if hip flexion were 22.5 deg, knee flexion were 60 deg all" in one for one in told)
    (whole, _), (right,) = read_springs(None, MALE).coupled, springs.coupled
    assert right.axes[0].joint == "right_hip_joint"
    (curve,) = (one for one in springs.joints["left_ankle"].axes if abs(one.direction[1]) == 1.0)
    own, law, _ = curve.elastic
    _, below = read_springs(None, MALE).joints["left_ankle"].axes
    assert own == below.oriented_along(curve.direction).elastic[0]
    sign = float(np.dot(curve.direction, whole.axes[2].direction))
    for angle in np.radians([-25.0, 0.0, 15.0]).tolist():
        _, _, before = whole.law.torques((radians(22.5), radians(60.0), angle))
        assert sign * law.torque(sign * angle) == pytest.approx(before)
    assert springs.joints["right_ankle"] == read_springs(None, MALE).joints["right_ankle"]


def test_a_law_whose_axes_all_have_curves_is_gone() -> None:
    others = """[[spring]]
joints = ["left_hip_joint", "right_hip_joint", "left_ankle", "right_ankle"]
axis = "y"
stiffness_Nm_rad = 4
"""
    springs, told = of_male50(KNEES + others)
    assert (springs.coupled, told) == ((), [])


def test_damping_alone_leaves_the_stops_as_they_are(path: Path, tmp_path: Path) -> None:
    text = ELBOW + "stop_stiffness_Nm_rad = 999\n"
    path.with_name("base.springs.toml").write_text('base = "none"\n' + text, "utf-8")
    path.write_text(
        'extends = "base.springs.toml"\n[[spring]]\njoints = ["left_elbow"]\ncoulomb_Nm = 1\n',
        "utf-8",
    )
    limited = replace(PROTOTYPE.joints["left_elbow"], lower_limit=(0.0,), upper_limit=(2.0,))
    figure = PROTOTYPE.with_parts(limited)
    springs = load_springs(figure, FOLDER, "prototype", path).require_value()
    (stop,) = (s for s in springs.joints["left_elbow"].axes[0].elastic if isinstance(s, Stop))
    assert stop.stiffness == 999.0


@pytest.mark.parametrize(
    ("text", "stop"),
    [
        ("stop_stiffness_Nm_rad = 500", Stop(0.0, 2.0, stiffness=500.0)),
        ("stop_onset_deg = 3", Stop(0.0, 2.0, onset=radians(3.0))),
        ("stop_stiffness_Nm_rad = 1000", Stop(0.0, 2.0)),
    ],
)
def test_a_file_of_stops_alone_keeps_them_when_extended(path: Path, text: str, stop: Stop) -> None:
    limited = replace(
        PROTOTYPE.joints["left_elbow"], lower_limit=(0.0,), upper_limit=(2.0,), stiff=(7.0,)
    )
    figure = PROTOTYPE.with_parts(limited)
    base = path.with_name("base.springs.toml")
    base.write_text(f'base = "none"\n[[spring]]\njoints = ["left_elbow"]\n{text}\n', "utf-8")
    path.write_text(f'extends = "{base.name}"\n{ELBOW.replace("left", "right")}', "utf-8")
    for file in (base, path):
        springs = load_springs(figure, FOLDER, "prototype", file).require_value()
        assert springs.joints["left_elbow"].axes[0].elastic == (stop,)


SLIDER = replace(
    read_figure("male50"),
    path=None,
    springs_text="""[[spring]]
joints = ["waist"]
axis = "z"
stiffness_Nm_rad = 4

[[spring]]
joints = ["waist"]
axis = "along z"
stiffness_N_m = 5000
rest_m = 0.01
viscous_Ns_m = 7
coulomb_N = 2
""",
).with_parts(
    replace(
        read_figure("male50").joints["waist"],
        chain=(*read_figure("male50").joints["waist"].chain, JointAxis(AxisKind.TRANSLATION, Z)),
        displacement=(0.0,) * 4,
        lower_limit=None,
        upper_limit=None,
    )
)
"""A person whose waist slides, with springs about and along one axis."""


def test_springs_about_and_along_one_axis_stand_side_by_side():
    springs = load_springs(SLIDER).require_value().joints["waist"]
    assert [(one.direction, one.elastic) for one in springs.axes] == [(Z, (Linear(4.0),))]
    (slide,) = springs.translations
    assert (slide.direction, slide.elastic) == (Z, (Linear(5000.0, 0.01),))
    assert slide.damping == Damping(7.0, 2.0)


def test_a_spring_along_an_axis_changes_that_along_it_only(path: Path):
    text = '[[spring]]\njoints = ["waist"]\naxis = "along z"\nviscous_Ns_m = 9\n'
    changed = load_springs(SLIDER, choice=path, text=text).require_value().joints["waist"]
    own = load_springs(SLIDER).require_value().joints["waist"]
    assert changed.axes == own.axes
    assert changed.translations[0].elastic == own.translations[0].elastic
    assert changed.translations[0].damping == Damping(9.0)


def with_waist_scaled(springs: SpringSet, elastic: float, damping: float) -> SpringSet:
    scaled = springs.of_joints({"waist"}).scaled(elastic, damping)
    return replace(springs, joints={**springs.joints, **scaled.joints})


def test_springs_along_an_axis_are_written_and_read(path: Path):
    own = load_springs(SLIDER).require_value()
    bare = replace(SLIDER, springs_text=None)
    for factor in (1.0, 3.0):
        springs = with_waist_scaled(own, factor, 1.0)
        text = format_besides_fields(SLIDER, springs)
        assert load_springs(bare, choice=path, text=text).require_value().joints == (springs.joints)
    edited = with_waist_scaled(own, 2.0, 0.5)
    text = format_changes(SLIDER, own, edited)
    assert 'axis = "along z"' in text
    assert load_springs(SLIDER, choice=path, text=text).require_value().joints == (edited.joints)
    whole = format_all(SLIDER, own)
    assert load_springs(bare, choice=path, text=whole).require_value().joints == own.joints


def test_a_file_without_its_figure_has_them_too(path: Path):
    path.write_text(SLIDER.springs_text or "", encoding="utf-8")
    springs = load_springs_file(path).require_value()[0].joints["waist"]
    assert len(springs.axes) == len(springs.translations) == 1
    assert springs.translations[0].elastic == (Linear(5000.0, 0.01),)
