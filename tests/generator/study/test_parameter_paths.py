"""Paths of quantities: their meaning in shipped figures, and the sentences about unknown ones."""

import pytest

from generator.contact.scene import Scene
from generator.figure_file.read import read_figure
from generator.model import Model
from generator.person.survey import Sex
from generator.simulation.plan import Plan
from generator.study.parameter_paths import Case, UnknownPathError, parse_path
from generator.study.study import PersonArguments
from generator.tone import Tone

PERSONS = (PersonArguments(Sex.MALE, 1.75, 75.0), PersonArguments(Sex.FEMALE, 1.6, 60.0))


def case(name: str = "male50", choice: str | None = None, floor: bool = True) -> Case:
    figure = read_figure(name)
    tone = Tone({"knee": 0.1})
    plan = Plan(scene=Scene.floor(), free_root=True, tone=tone) if floor else Plan()
    return Case(Model.of(figure, choice), plan)


@pytest.mark.parametrize(
    ("path", "unit", "names"),
    [
        ("springs.scale", "", []),
        ("springs.damping_scale", "", []),
        ("springs.knee.scale", "", ["left_knee", "right_knee"]),
        ("springs.left_knee.scale", "", ["left_knee"]),
        ("springs.hip.flexion.offset_deg", "deg", ["left_hip_joint", "right_hip_joint"]),
        ("springs.right_hip.2.coulomb_Nm", "N m", ["right_hip_joint"]),
        ("springs.waist.flexion.viscous_Nms_rad", "N m s/rad", ["waist"]),
        ("springs.waist.twist.scale", "", ["waist"]),
        ("segments.foot.mass", "kg", ["left_foot", "right_foot"]),
        ("segments.head.inertia_scale", "", ["head"]),
        ("pose.left_knee", "deg", ["left_knee"]),
        ("pose.hip.3", "deg", ["left_hip_joint", "right_hip_joint"]),
        ("velocity.knee", "deg/s", ["left_knee", "right_knee"]),
        ("velocity.head.5", "cm/s", ["head"]),
        ("gravity", "", []),
        ("height", "m", []),
        ("floor.friction", "", ["floor"]),
        ("springs.stop_scale", "", []),
        ("springs.knee.stop_scale", "", ["left_knee", "right_knee"]),
        ("contact.head.stiffness_scale", "", ["head"]),
        ("contact.pelvis.stiffness_scale", "", ["pelvis", "buttocks"]),
        ("contact.knee.damping_scale", "", ["left_knee", "right_knee"]),
        ("tone.scale", "", []),
        ("fall.seed", "", []),
        ("person", "", []),
        ("person.stature", "m", ["stature"]),
        ("person.mass", "kg", ["mass"]),
        ("person.waist_circumference", "m", ["waist_circumference"]),
    ],
)
def test_meaning(path: str, unit: str, names: list[str]) -> None:
    parsed = parse_path(path, case(), PERSONS, falls=True)
    found = list(dict.fromkeys(target.name for target in parsed.targets))
    assert (str(parsed), parsed.unit, found) == (path, unit, names)


def test_all_axes_of_a_joint_are_scaled() -> None:
    targets = parse_path("springs.hip.scale", case()).targets
    assert [target.name for target in targets] == ["left_hip_joint"] * 3 + ["right_hip_joint"] * 3


def test_all_segments() -> None:
    one = case()
    targets = parse_path("segments.mass_scale", one).targets
    assert [target.name for target in targets] == list(one.figure.bodies)


@pytest.mark.parametrize(
    ("path", "sentence"),
    [
        ("spring.knee.scale", "did you mean `springs.knee.scale`?"),
        ("springs.kne.scale", "did you mean `springs.knee.scale`?"),
        ("springs.left_nee.scale", "did you mean `springs.left_knee.scale`?"),
        ("springs.knee.scal", "did you mean `springs.knee.scale`?"),
        ("springs.knee.offset", "did you mean `springs.knee.offset_deg`?"),
        ("springs.hip.flexon.scale", "did you mean `springs.hip.flexion.scale`?"),
        ("springs.hip.offset_deg", "`springs.hip.medial_rotation.offset_deg`"),
        ("springs.offset_deg", "a `scale`, a `damping_scale` and a `stop_scale` only"),
        ("floor.stiffness", "`contact.stiffness_scale` varies them"),
        ("springs.root_torso.stop_scale", "`root_torso` has no stop"),
        ("contact.hed.stiffness_scale", "did you mean `contact.head.stiffness_scale`?"),
        ("contact.head.stiffness", "did you mean `contact.head.stiffness_scale`?"),
        ("contact.head", "unknown quantity `head`"),
        ("tone", "the path is written `tone.scale`"),
        ("fall.start", "the path is written `fall.seed`"),
        ("fall.seed", "the option `fall` of a study gives it"),
        ("springs.knee", "`springs.knee.scale`, for example"),
        ("springs.knee.offset_cm", "`left_knee` does not slide"),
        ("springs.root_torso.scale", "`root_torso` has no elastic law"),
        ("segments.fot.mass", "did you mean `segments.foot.mass`?"),
        ("segments.foot.weight", "known here: inertia_scale, mass, mass_scale"),
        ("segments.mass", "known here: inertia_scale, mass_scale"),
        ("pose.hip", "write `pose.hip.1`"),
        ("pose.hip.4", "has the numbers 1 to 3"),
        ("gravity.x", "the path is written `gravity`"),
        ("floor.roughness", "known here: friction, stiffness"),
        ("person.statur", "did you mean `person.stature`?"),
        ("person.hip_bredth", "did you mean `person.hip_breadth`?"),
        ("", "known here: contact, fall, floor, gravity"),
    ],
)
def test_unknown_path(path: str, sentence: str) -> None:
    with pytest.raises(UnknownPathError) as failure:
        parse_path(path, case(), PERSONS)
    assert f"`{path}`: " in str(failure.value)
    assert sentence in str(failure.value)
    assert "\n" not in str(failure.value)


def test_paths_that_need_something_else() -> None:
    bare = case(floor=False)
    for path, sentence in (
        ("floor.friction", "the option `floor` adds one"),
        ("height", "needs `free_root`, `floor`, `scene` or `fall`"),
        ("person.mass", "`[person]`"),
        ("person", "`[person]`"),
        ("tone.scale", "the option `tone` gives it"),
        ("velocity.head.1", "no joint `head`"),
    ):
        with pytest.raises(UnknownPathError, match="`") as failure:
            parse_path(path, bare)
        assert sentence in str(failure.value)


def test_scale_of_laws_over_several_joints() -> None:
    coupled = case("prototype", "coupled")
    for path in ("springs.scale", "springs.coupled.scale", "springs.knee.scale"):
        parse_path(path, coupled)
    with pytest.raises(UnknownPathError, match="no joint `coupled`"):
        parse_path("springs.coupled.scale", case("prototype"))
