"""Cases made by values of parameters: torques, masses and starts, and the form of the laws."""

from dataclasses import replace
from math import isnan, radians
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.contact.scene import Scene
from generator.diagnostics import ModelError, MoverError
from generator.figure import AxisKind, Joint, JointAxis, Vector
from generator.figure_file.read import read_figure
from generator.model import Model
from generator.person.survey import Sex
from generator.simulation.compiled import mechanism
from generator.simulation.compiled.law_code import LawUse
from generator.simulation.compiled_run import compile_model
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from generator.study.parameter_paths import Case, parse_path
from generator.study.parameters import apply_values, build_case, nominal_value
from generator.study.person_figure import make_person
from generator.study.study import Design, DesignKind, Parameter, PersonArguments, Study, Uniform
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet, Stop
from springs.hysteresis import Hysteresis

ANGLES = np.radians(np.linspace(-100.0, 150.0, 41))
FACTORS = st.floats(0.1, 4.0)
SHIFTS = st.floats(-20.0, 20.0)


def case(name: str = "male50", choice: str | None = None) -> Case:
    figure = read_figure(name)
    return Case(Model.of(figure, choice), Plan(scene=Scene.floor(), free_root=True))


MALE, PROTOTYPE, COUPLED = case(), case("prototype"), case("prototype", "coupled")
MALE = replace(
    MALE, model=replace(MALE.model, contact=None)
)  # its spheres feel the floor's surface


def two_curves() -> Case:
    """A pendulum with a directional law, a stop and friction about its first axis."""
    figure = read_figure("pendulum")
    curves = Hysteresis(Linear(2.0, 0.1), Linear(1.5, -0.1))
    axis = AxisSpring((1.0, 0.0, 0.0), (curves, Stop(-0.5, 0.5)), Damping(0.3, 0.2), "flexion")
    springs = SpringSet({"shoulder": JointSprings("shoulder", (axis,))})
    return Case(Model(figure, springs), Plan())


def vary(one: Case, **values: float) -> Case:
    """Return a case with values of its paths, whose dots are written as `__`."""
    named = {name.replace("__", "."): value for name, value in values.items()}
    return apply_values(one, [(parse_path(path, one), value) for path, value in named.items()])


def axis_of(one: Case, joint: str, number: int = 0) -> AxisSpring:
    return one.springs.joints[joint].axes[number]


def elastic(axis: AxisSpring, angles: np.ndarray = ANGLES, *, stops: bool = True) -> np.ndarray:
    laws = [law for law in axis.elastic if stops or not isinstance(law, Stop)]
    return np.sum([law.torque(angles) for law in laws], axis=0)


class _RecordedError(Exception):
    """The laws are recorded, and need not be compiled."""


def forms(one: Case) -> list[tuple[str, ...]]:
    """Compiled form of each law of a case."""
    recorded: list[LawUse] = []

    def record(uses: list[LawUse]) -> None:
        recorded.extend(uses)
        raise _RecordedError

    model = build_model(one.model, Plan())
    with patch.object(mechanism, "build_law_tables", record), pytest.raises(_RecordedError):
        compile_model(model)
    return [use.form for use in recorded]


@pytest.mark.parametrize("one", [MALE, PROTOTYPE, COUPLED, two_curves()])
def test_scale_of_one_and_offset_of_zero_leave_the_torques(one: Case) -> None:
    same = vary(one, springs__scale=1.0, springs__damping_scale=1.0)
    joint = "left_hip_joint" if "left_hip_joint" in one.figure.joints else "shoulder"
    same = vary(same, **{f"springs__{joint}__flexion__offset_deg": 0.0})
    for name, joint_springs in one.springs.joints.items():
        for axis, other in zip(joint_springs.axes, same.springs.joints[name].axes, strict=True):
            np.testing.assert_array_equal(elastic(axis), elastic(other))
            assert axis.resistance(0.3, 0.7) == other.resistance(0.3, 0.7)
    for spring, other in zip(one.springs.coupled, same.springs.coupled, strict=True):
        angles = [0.3, 0.7, 0.1][: len(spring.axes)]
        assert spring.law.torques(angles) == other.law.torques(angles)


@settings(max_examples=25)
@given(first=FACTORS, second=FACTORS)
def test_scales_multiply(first: float, second: float) -> None:
    for one, joint in ((MALE, "left_knee"), (two_curves(), "shoulder")):
        path = parse_path(f"springs.{joint}.scale", one)
        damping = parse_path(f"springs.{joint}.damping_scale", one)
        twice = apply_values(one, [(path, first), (damping, second), (path, second)])
        axis, changed = axis_of(one, joint), axis_of(twice, joint)
        np.testing.assert_allclose(
            elastic(changed, stops=False),
            first * second * elastic(axis, stops=False),
            rtol=1e-12,
            atol=1e-12,
        )
        assert changed.resistance(0.2, 0.5) == pytest.approx(second * axis.resistance(0.2, 0.5))


@settings(max_examples=25)
@given(scale=FACTORS, degrees_of_shift=SHIFTS)
def test_offset_moves_curves_and_leaves_stops(scale: float, degrees_of_shift: float) -> None:
    for one, joint in ((MALE, "left_knee"), (two_curves(), "shoulder")):
        values = {f"springs.{joint}.scale": scale, f"springs.{joint}.offset_deg": degrees_of_shift}
        moved = apply_values(one, [(parse_path(p, one), value) for p, value in values.items()])
        axis, changed = axis_of(one, joint), axis_of(moved, joint)
        expected = scale * elastic(axis, ANGLES - radians(degrees_of_shift), stops=False)
        np.testing.assert_allclose(elastic(changed, stops=False), expected, rtol=1e-9, atol=1e-9)
        assert [law for law in axis.elastic if isinstance(law, Stop)] == [
            law for law in changed.elastic if isinstance(law, Stop)
        ]


@pytest.mark.parametrize("reverse", [False, True])
@settings(max_examples=25)
@given(shift=SHIFTS, scale=FACTORS)
def test_both_sides_get_mirrored_torques(reverse: bool, shift: float, scale: float) -> None:
    """Also of a right hip whose axes are counted the other way."""
    one = MALE
    if reverse:
        hip = one.springs.joints["right_hip_joint"]
        turned = replace(hip, axes=tuple(axis.with_opposite_axis() for axis in hip.axes))
        joints = {**one.springs.joints, "right_hip_joint": turned}
        one = one.with_springs(replace(one.springs, joints=joints))
    values = {"springs.hip.flexion.offset_deg": shift, "springs.hip.abduction.scale": scale}
    changed = apply_values(one, [(parse_path(p, one), value) for p, value in values.items()])
    sign = -1.0 if reverse else 1.0
    for number in range(3):
        left, right = (axis_of(changed, f"{side}_hip_joint", number) for side in ("left", "right"))
        np.testing.assert_allclose(
            elastic(left), sign * elastic(right, sign * ANGLES), rtol=1e-9, atol=1e-9
        )
    assert axis_of(changed, "left_knee") is axis_of(one, "left_knee")


@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_slides_of_both_sides_are_mirrored(direction: Vector) -> None:
    """As the displacements of the pose are, whose signs have tests of their own."""
    knees = [MALE.figure.joints[name] for name in ("left_knee", "right_knee")]
    slide = (JointAxis(AxisKind.TRANSLATION, direction),)
    figure = MALE.figure.with_parts(
        *(Joint(knee.name, knee.parent, knee.child, slide) for knee in knees)
    )
    spring = AxisSpring(direction, (Linear(100.0),), Damping(5.0))
    joints = {knee.name: JointSprings(knee.name, (), (spring,)) for knee in knees}
    one = Case(Model(figure, SpringSet(joints)), MALE.plan)
    changed = vary(
        one, springs__knee__offset_cm=2.0, springs__knee__viscous_Ns_m=7.0, pose__knee=2.0
    )
    for knee in knees:
        (moved,) = changed.springs.joints[knee.name].translations
        (start,) = changed.plan.displacements[knee.name]
        assert moved.elastic[0].torque(start) == pytest.approx(0.0, abs=1e-12)
        assert moved.damping.viscous == 7.0
        assert abs(start) == 0.02


def test_one_side_alone() -> None:
    changed = vary(MALE, springs__left_knee__scale=2.0, segments__left_foot__mass=3.0)
    assert axis_of(changed, "right_knee") == axis_of(MALE, "right_knee")
    assert changed.figure.segments["right_foot"] == MALE.figure.segments["right_foot"]


@pytest.mark.parametrize("one", [MALE, PROTOTYPE, COUPLED])
def test_form_of_the_laws_does_not_change_with_the_values(one: Case) -> None:
    def change(scale: float, shift: float, damping: float) -> Case:
        return vary(
            one,
            springs__scale=scale,
            springs__hip__flexion__offset_deg=shift,
            springs__knee__viscous_Nms_rad=damping,
            springs__elbow__damping_scale=damping,
        )

    plain = forms(change(1.0, 0.0, 0.5))
    assert plain == forms(change(1.7, -12.0, 0.1)) == forms(change(0.3, 5.0, 2.0))
    assert len(set(plain)) < len(plain)


def test_form_of_a_directional_law() -> None:
    one = two_curves()
    first, second = (
        forms(vary(one, springs__shoulder__scale=s, springs__damping_scale=d))
        for s, d in ((1.0, 1.0), (2.0, 0.5))
    )
    assert first == second


def test_coupled_law_is_scaled_and_shifted() -> None:
    law, angles = COUPLED.springs.coupled[0].law, [0.6, 1.1]
    doubled = vary(COUPLED, springs__coupled__scale=2.0)
    assert doubled.springs.coupled[0].law.torques(angles) == pytest.approx(
        [2.0 * torque for torque in law.torques(angles)]
    )
    assert doubled.springs.joints == COUPLED.springs.joints
    moved = vary(COUPLED, springs__knee__offset_deg=8.0)
    back = [angles[0], angles[1] - radians(8.0)]
    for spring in moved.springs.coupled:
        assert spring.law.torques(angles) == pytest.approx(list(law.torques(back)))


@pytest.mark.parametrize(
    ("joint", "place"), [("hip_joint.flexion", 0), ("knee", 1), ("ankle", 2), ("left_knee", 1)]
)
def test_scale_of_a_joint_is_that_of_all_terms_that_depend_on_it(joint: str, place: int) -> None:
    changed = vary(MALE, **{f"springs.{joint}.scale": 3.0})
    for spring, other in zip(MALE.springs.coupled, changed.springs.coupled, strict=True):
        is_meant = "left" not in joint or spring.axes[0].joint.startswith("left")
        for term, scaled in zip(spring.law.terms, other.law.terms, strict=True):
            factor = 3.0 if is_meant and term.rates[place] else 1.0
            assert scaled.amplitudes == tuple(factor * a for a in term.amplitudes)
            assert replace(scaled, amplitudes=term.amplitudes) == term
        assert other.law.is_conservative
    is_same = axis_of(MALE, "left_ankle") == axis_of(changed, "left_ankle")
    assert is_same is (joint != "ankle")


def test_damping_replaces_or_adds() -> None:
    changed = vary(MALE, springs__knee__viscous_Nms_rad=0.7, springs__knee__coulomb_Nm=0.4)
    for side in ("left", "right"):
        assert axis_of(changed, f"{side}_knee").damping == Damping(0.7, 0.4)
    figure = read_figure("fourbar")
    bare = Case(Model.of(figure), Plan())
    pinned = vary(bare, springs__crank_pin__viscous_Nms_rad=0.1)
    assert axis_of(pinned, "crank_pin").resistance(0.0, 2.0) == pytest.approx(-0.2)


@settings(max_examples=25)
@given(mass=st.floats(0.1, 50.0), inertia=FACTORS)
def test_mass_keeps_the_radius_of_gyration(mass: float, inertia: float) -> None:
    heavy = vary(MALE, segments__lower_leg__mass=mass)
    for side in ("left", "right"):
        before, after = (x.figure.segments[f"{side}_lower_leg"] for x in (MALE, heavy))
        assert after.mass == mass
        assert before.inertia is not None
        assert after.inertia is not None
        assert before.mass
        np.testing.assert_allclose(
            np.array(after.inertia) / mass, np.array(before.inertia) / before.mass
        )
    own = MALE.figure.segments["left_lower_leg"].mass or 0.0
    assert heavy.figure.total_mass == pytest.approx(MALE.figure.total_mass + 2.0 * (mass - own))
    wide = vary(MALE, segments__lower_leg__inertia_scale=inertia)
    assert wide.figure.total_mass == MALE.figure.total_mass


@settings(max_examples=25)
@given(factor=FACTORS)
def test_total_mass(factor: float) -> None:
    changed = vary(MALE, segments__mass_scale=factor)
    assert changed.figure.total_mass == pytest.approx(factor * MALE.figure.total_mass)


def test_pose_and_velocity_of_both_sides() -> None:
    changed = vary(MALE, pose__hip__2=10.0, velocity__knee=-30.0, velocity__head__4=25.0)
    hips = [changed.plan.displacements[f"{side}_hip_joint"][1] for side in ("left", "right")]
    assert hips == [radians(10.0)] * 2
    assert list(changed.plan.velocities["left_knee"]) == [radians(-30.0)]
    assert list(changed.plan.velocities["head"]) == [0.0, 0.0, 0.0, 0.25, 0.0, 0.0]
    one = replace(
        MALE.figure.joints["right_hip_joint"],
        chain=tuple(
            replace(factor, axis=tuple(-part for part in factor.axis))
            for factor in MALE.figure.joints["right_hip_joint"].chain
        ),
    )
    turned = vary(MALE.with_figure(MALE.figure.with_parts(one)), pose__hip__2=10.0)
    assert turned.plan.displacements["right_hip_joint"][1] == -radians(10.0)


def test_surroundings() -> None:
    changed = vary(MALE, gravity=0.5, height=1.5, floor__friction=0.3, floor__stiffness=5e4)
    assert changed.plan.gravity == pytest.approx((0.0, -4.905, 0.0))
    assert changed.plan.height == 1.5
    (floor,) = changed.plan.scene.props
    assert (floor.surface.friction, floor.surface.stiffness) == (0.3, 5e4)


@pytest.mark.parametrize(
    "path",
    [
        "springs.scale",
        "springs.knee.offset_deg",
        "springs.knee.viscous_Nms_rad",
        "segments.head.mass",
        "segments.mass_scale",
        "pose.left_hip.2",
        "velocity.neck.1",
        "gravity",
        "floor.friction",
        "floor.stiffness",
    ],
)
def test_nominal_value_leaves_the_case(path: str) -> None:
    start = vary(MALE, pose__left_hip__2=15.0, springs__knee__coulomb_Nm=0.3)
    parsed = parse_path(path, start)
    nominal = nominal_value(parsed, start)
    once = apply_values(start, [(parsed, nominal)])
    assert nominal_value(parsed, once) == nominal
    assert once.figure == start.figure
    assert once.plan.gravity == start.plan.gravity
    assert once.plan.scene == start.plan.scene
    for name, values in start.plan.displacements.items():
        assert list(once.plan.displacements[name]) == pytest.approx(list(values))


def test_open_height_has_no_nominal_value() -> None:
    assert isnan(nominal_value(parse_path("height", MALE), MALE))


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("segments.head.mass", 0.0, "must be positive"),
        ("gravity", float("nan"), "must be finite"),
        ("gravity", 1e9, "gravity would be larger than 1e\\+09 m/s2"),
        ("pose.left_knee", 1e7, "an angle is at most 1e6 deg"),
    ],
)
def test_impossible_value(path: str, value: float, reason: str) -> None:
    with pytest.raises(ModelError, match=reason) as failure:
        apply_values(MALE, [(parse_path(path, MALE), value)])
    assert str(failure.value).startswith(f"`{path}` cannot be {value:g}: ")


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("springs.knee.scale", 1e12, "must be from 0 to 1000, not 1e+12"),
        ("springs.scale", -0.5, "must be from 0 to 1000, not -0.5"),
        ("segments.mass_scale", 1001.0, "must be from 0 to 1000, not 1001"),
        ("springs.knee.viscous_Nms_rad", 1e12, "must be from 0 to 10000 N m s/rad, not 1e+12"),
        ("springs.knee.offset_deg", 1e5, "must be from -360 to 360 deg, not 100000"),
        ("springs.knee.coulomb_Nm", -1.0, "must be from 0 to 10000 N m, not -1"),
        ("floor.friction", 50.0, "must be from 0 to 10, not 50"),
        ("floor.stiffness", 0.0, "must be from 1 to 1e+09 N/m, not 0"),
        ("height", 1e7, "must be from -1e+06 to 1e+06 m, not 1e+07"),
    ],
)
def test_value_beyond_the_bounds_of_its_option(path: str, value: float, reason: str) -> None:
    with pytest.raises(ModelError) as failure:
        apply_values(MALE, [(parse_path(path, MALE), value)])
    assert str(failure.value) == f"`{path}` {reason}"


def study(person: PersonArguments | None, **paths: str) -> Study:
    model, plan = MALE.model, MALE.plan
    if person is not None:
        model, plan = make_person(person, with_spheres=False), Plan()
    names = {name: path.split() for name, path in paths.items()}
    parameters = {
        name: Parameter(name, tuple(texts), Uniform(0.0, 1.0)) for name, texts in names.items()
    }
    persons = () if person is None else (person,)
    return Study("test", model, plan, parameters, Design(DesignKind.SOBOL, 1), {}, persons)


def test_case_of_a_study() -> None:
    one = study(None, scale="springs.knee.scale springs.elbow.scale", mass="segments.head.mass")
    built = build_case(one, (1.5, 6.0))
    expected = vary(
        MALE, springs__knee__scale=1.5, springs__elbow__scale=1.5, segments__head__mass=6.0
    )
    assert built.figure == expected.figure
    assert built.springs == expected.springs
    assert build_case(one, (1.5, 6.0)).springs == built.springs


def test_case_of_a_person() -> None:
    person = PersonArguments(Sex.FEMALE, 1.63, 68.0)
    one = study(
        person, size="person.stature", waist="person.waist_circumference", s="springs.scale"
    )
    built = build_case(one, (1.70, 0.85, 2.0))
    taller = replace(person, stature=1.70)
    model = make_person(taller, {"waist_circumference": 0.85}, with_spheres=False)
    assert built.figure == model.figure != one.model.figure
    assert built.springs == vary(Case(model, Plan()), springs__scale=2.0).springs
    with pytest.raises(MoverError, match="stature"):
        build_case(one, (5.0, 0.85, 1.0))


def test_hip_datum_of_a_person() -> None:
    person = PersonArguments(Sex.MALE, 1.756, 85.5, hip_datum=radians(5.0))
    one = study(person, datum="person.hip_datum")
    path = parse_path("person.hip_datum", Case(one.model, one.plan), [person])
    assert (path.unit, nominal_value(path, Case(one.model, one.plan))) == (
        "deg",
        pytest.approx(5.0),
    )
    hips = [
        build_case(one, (datum,)).springs.coupled[0].law.torques((0.0, 0.0, 0.0))[0]
        for datum in (5.0, 10.0)
    ]
    assert hips == pytest.approx([4.87, 2.82], abs=0.01)
    with pytest.raises(MoverError, match="hip datum is from 0 to 15 deg"):
        build_case(one, (16.0,))


def test_person_with_a_floor_has_contact_spheres() -> None:
    person = PersonArguments(Sex.MALE, 1.75, 75.0, "none")
    one = study(person, size="person.stature")
    floor = replace(one.plan, scene=Scene.floor(), free_root=True)
    for plan, has_spheres in ((floor, True), (one.plan, False)):
        head = build_case(replace(one, plan=plan), (1.7,)).figure.segments["head"]
        assert bool(head.contact_spheres) is has_spheres


def test_case_of_a_person_of_whom_only_springs_vary() -> None:
    one = study(PersonArguments(Sex.MALE, 1.75, 75.0), s="springs.scale")
    assert build_case(one, (2.0,)).figure is one.model.figure


def test_mass_of_a_person_follows_from_the_mass_index() -> None:
    person = PersonArguments(Sex.MALE, 1.75, 75.0, "none")
    one = study(person, size="person.stature", index="person.mass_index")
    case = build_case(one, [1.8, 24.0])
    model = make_person(replace(person, stature=1.8, mass=24.0 * 1.8**2), with_spheres=False)
    assert case.model == model
