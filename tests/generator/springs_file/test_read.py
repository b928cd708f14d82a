from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import Parsed, select_errors
from generator.figure import AxisKind, Figure, Joint, JointAxis, Segment, SiteRef
from generator.figure_file import FIGURE_FILE, read_figure
from generator.springs_file.read import load_springs
from springs import (
    AxisSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    Stop,
    elastic_torque,
    passive_cubic,
)
from springs.stop import DEFAULT_TRANSLATION_STOP_ONSET, DEFAULT_TRANSLATION_STOP_STIFFNESS
from tests.laws import VECTOR_LAWS

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
PROTOTYPE = read_figure("prototype")
FOLDER = FIGURE_FILE.shipped()["prototype"].parent
PAIRS = ("shoulder", "hip_joint")

CHAIN = "R(0,0,1)*R(1,0,0)*R(0,1,0)"
ZYZ = "R(0,0,1)*R(0,1,0)*R(0,0,1)"
CUBIC = "1e7 2e7 3e7 4e7"  # 1 2 3 4 in N m
CURVE = passive_cubic((1.0, 2.0, 3.0, 4.0))


def figure(**joints: str) -> Figure:
    """Segments on one base, each by a joint of the given fields."""
    parts = ["segment base { site s->location = trans(0,0,0); }"]
    for name, fields in joints.items():
        parts.append(f"segment {name}_body {{ site s->location = trans(0,0,0); }}")
        parts.append(f"joint {name} {{ connect base.s to {name}_body.s; {fields} }}")
    reading = FIGURE_FILE.parse_text("\n".join(["figure {", *parts, "root = base.s;", "}"]))
    assert reading.value is not None, reading.diagnostics
    return reading.value


def own(whole: Figure) -> SpringSet:
    return good(load_springs(whole))


def good(reading: Parsed[SpringSet]) -> SpringSet:
    assert reading.diagnostics == ()
    assert reading.value is not None
    return reading.value


def with_file(tmp_path: Path, whole: Figure, text: str, name: str) -> Parsed[SpringSet]:
    path = tmp_path / name
    path.write_text(text)
    return load_springs(whole, None, None, path)


def optional(tmp_path: Path, whole: Figure, *records: str) -> Parsed[SpringSet]:
    """Read with records `joint axis | coefficients | angles`."""
    lines: list[str] = []
    for record in records:
        head, coefficients, *angles = (part.strip() for part in record.split("|"))
        lines += [head, coefficients, "800000 0", *(angles or ["0 0 0"])]
    return with_file(tmp_path, whole, "\n".join(lines), "my.optional")


def toml(tmp_path: Path, whole: Figure, *tables: str, top: str = "") -> Parsed[SpringSet]:
    text = top + "".join(f"[[spring]]\n{table}\n" for table in tables)
    return with_file(tmp_path, whole, text, "my.springs.toml")


def said(reading: Parsed[SpringSet]) -> list[str]:
    assert reading.value is None or not select_errors(reading.diagnostics)
    faults = [fault.to_json() for fault in reading.diagnostics]
    return [f"{f.get('line')}:{f.get('column')} {f['message']}" for f in faults]


# The shipped prototype


def test_the_shipped_springs_file_is_the_rule_applied_to_the_printed_records():
    shipped = good(load_springs(PROTOTYPE, FOLDER, "prototype"))
    ruled = good(load_springs(PROTOTYPE, choice=FOLDER / "prototype.optional"))
    assert (shipped.origin, ruled.origin) == ("prototype.springs.toml", "prototype.optional")
    assert shipped.law is ruled.law is SphericalLaw.CONSERVATIVE
    assert list(shipped.joints) == list(ruled.joints)
    for name, joint in shipped.joints.items():
        assert joint.translations == ruled.joints[name].translations == ()
        for mine, rule in zip(joint.axes, ruled.joints[name].axes, strict=True):
            assert (mine.direction, mine.damping) == (rule.direction, rule.damping)
            (law,), (expected,) = mine.elastic, rule.elastic
            assert isinstance(law, Cubic)
            assert isinstance(expected, Cubic)
            assert replace(law, dead_zone=None) == replace(expected, dead_zone=None)
            if expected.dead_zone is None:
                assert law.dead_zone is None
            else:  # the file has six decimals of a degree
                written = np.degrees(law.dead_zone)
                assert written == pytest.approx(np.degrees(expected.dead_zone), abs=5.1e-7)


@pytest.mark.parametrize("law", VECTOR_LAWS)
@pytest.mark.parametrize("choice", [None, "printed"])
def test_the_right_side_is_the_mirror_image_of_the_left(law, choice):
    joints = good(load_springs(PROTOTYPE, FOLDER, "prototype", choice)).joints
    mirror = np.array([-1.0, 1.0, -1.0])
    vectors = np.random.default_rng(1).uniform(-1.5, 1.5, (200, 3))
    for pair in PAIRS:
        left = elastic_torque(law, joints[f"left_{pair}"].axes, vectors)
        right = elastic_torque(law, joints[f"right_{pair}"].axes, mirror * vectors)
        assert np.allclose(right, mirror * left, rtol=1e-12, atol=1e-10)


def test_printed_values_resist_everywhere_and_only_revolutes_have_dead_zones():
    springs = good(load_springs(PROTOTYPE, FOLDER, "prototype", "printed"))
    laws = {
        (name, axis.direction): axis.elastic[0]
        for name, joint in springs.joints.items()
        for axis in joint.axes
    }
    assert len(laws) == 19
    assert {law.sense for law in laws.values()} == {-1}
    zones = {name: law.dead_zone for (name, _), law in laws.items() if law.dead_zone}
    assert zones == {
        "left_elbow": (0.0, 1.7),
        "right_elbow": (0.0, 1.7),
        "left_knee": (0.0, 1.553),
        "right_knee": (0.0, 1.553),
    }
    # The tables give the moment about the positive axis at the angle about the declared one.
    printed = (-0.916317, -8.6218689, 14.15546098, -5.26654657)
    torque_about_positive_x = -laws["right_shoulder", (-1.0, 0.0, 0.0)].torque(0.4)
    assert torque_about_positive_x == pytest.approx(-np.polyval(printed[::-1], 0.4))


def test_the_rule_is_told_in_a_sentence():
    springs = good(load_springs(PROTOTYPE, choice=FOLDER / "prototype.optional"))

    def why(joint: str, k: int) -> str:
        return springs.joints[joint].axes[k].why

    assert why("waist", 2) == (
        "c3 is positive, so the moment resists; the dead zone, -42.3 to 53.9 deg, lies between "
        "the outer two of three roots."
    )
    assert why("right_hip_joint", 2) == (
        "c3 is negative, so the moment acts on the child; there is no dead zone."
    )
    assert why("right_hip_joint", 1).endswith(
        "Negated on reading, since the joint declares the axis negative."
    )
    assert "the dead zone, 0.0 to 97.4 deg, is given." in why("left_elbow", 0)
    assert springs.references == ("prototype.optional",)


def test_the_rule_is_told_for_a_straight_line(tmp_path):
    reading = optional(tmp_path, figure(knee="type = R(0,1,0);"), "1 3 | 0 -1e7 0 0")
    assert good(reading).joints["knee"].axes[0].why == (
        "c3 is zero and c1 is negative, so the moment acts on the child; there is no dead zone."
    )


# Where springs come from


def test_springs_are_looked_for_beside_the_figure(tmp_path):
    whole = figure(knee="type = R(0,1,0); stiff = (3e7);")

    def found(choice=None):
        return good(load_springs(whole, tmp_path, "my", choice))

    assert found().origin == "figure's own stiff/rest/damp"
    assert found().joints["knee"].axes[0].elastic == (Linear(3.0),)
    (tmp_path / "my.optional").write_text(f"1 3\n{CUBIC}\n0 0\n0 0 0\n")
    assert found().origin == "my.optional"
    assert found().joints["knee"].axes[0].elastic == (CURVE,)
    (tmp_path / "my.springs.toml").write_text('[[spring]]\njoints=["knee"]\nstiffness_Nm_rad=5\n')
    assert found().origin == "my.springs.toml"
    assert found().joints["knee"].axes[0].elastic == (Linear(5.0),)
    assert found("printed").origin == "my.optional"
    assert found(str(tmp_path / "my.optional")).origin == "my.optional"
    assert load_springs(whole, tmp_path, "other").value.origin.startswith("figure's own")


def test_none_means_no_springs_and_no_stops():
    whole = figure(knee="type = R(0,1,0); stiff = (3e7); llimit = (0); ulimit = (1 rad);")
    assert good(load_springs(whole, choice="none")) == SpringSet(
        {}, SphericalLaw.CONSERVATIVE, "none"
    )
    weighted = load_springs(whole, choice="none", law=SphericalLaw.WEIGHTED)
    assert good(weighted).law is SphericalLaw.WEIGHTED


def test_the_law_is_the_callers_else_the_file_s_else_conservative(tmp_path):
    whole = figure(knee="type = R(0,1,0);")
    table, path = 'joints = ["knee"]\nstiffness_Nm_rad = 5', tmp_path / "my.springs.toml"
    assert good(toml(tmp_path, whole, table)).law is SphericalLaw.CONSERVATIVE
    assert good(toml(tmp_path, whole, table, top='law = "weighted"\n')).law is SphericalLaw.WEIGHTED
    chosen = load_springs(whole, choice=path, law=SphericalLaw.CONSERVATIVE)
    assert good(chosen).law is SphericalLaw.CONSERVATIVE


# What the figure itself says


def test_a_joint_s_fields_are_in_the_order_of_its_type_line():
    whole = figure(
        hip="type = R(0,0,-1)*R(-1,0,0)*R(0,1,0); stiff = (1e7,0,3e7); rest = (0,0,20deg);"
        "damp = (0,2e7,0); llimit = (-1 rad,-2 rad,-3 rad); ulimit = (1 rad,2 rad,3 rad);"
    )
    assert own(whole).joints == {
        "hip": JointSprings(
            "hip",
            (
                AxisSpring((0.0, 0.0, -1.0), (Linear(1.0), Stop(-1.0, 1.0))),
                AxisSpring((-1.0, 0.0, 0.0), (Stop(-2.0, 2.0),), Damping(2.0)),
                AxisSpring(Y, (Linear(3.0, radians(20.0)), Stop(-3.0, 3.0))),
            ),
        )
    }


def test_slides_are_linear_springs_along_their_axes():
    whole = figure(
        slider="type = R(0,0,1)*T(0,1,0)*T(1,0,0); stiff = (1e7,2e3,0); rest = (0,5cm,0);"
        "damp = (0,0,4e3); llimit = (-1 rad,-10cm,0cm);"
    )
    joint = own(whole).joints["slider"]
    assert joint.axes == (AxisSpring(Z, (Linear(1.0), Stop(-1.0, None))),)
    assert joint.translations == (
        AxisSpring(
            Y,
            (
                Linear(2.0, 0.05),
                Stop(
                    -0.1, None, DEFAULT_TRANSLATION_STOP_STIFFNESS, DEFAULT_TRANSLATION_STOP_ONSET
                ),
            ),
        ),
        AxisSpring(
            X,
            (Stop(0.0, None, DEFAULT_TRANSLATION_STOP_STIFFNESS, DEFAULT_TRANSLATION_STOP_ONSET),),
            Damping(4.0),
        ),
    )


def test_a_joint_without_springs_and_limits_has_no_entry():
    whole = figure(
        free="type = R(1,0,0)*R(0,1,0)*R(0,0,1);",
        slack="type = R(1,0,0); stiff = (0); rest = (1 rad);",
        rigid="",
        one="type = R(1,0,0)*R(0,1,0); stiff = (0,1e7);",
    )
    assert own(whole).joints == {"one": JointSprings("one", (AxisSpring(Y, (Linear(1.0),)),))}


def test_an_axis_declared_twice_keeps_the_springs_of_both_factors():
    whole = figure(ball=f"type = {ZYZ}; stiff = (1e7,2e7,3e7);")
    axes = own(whole).joints["ball"].axes
    assert [(axis.direction, axis.elastic) for axis in axes] == [
        (Z, (Linear(1.0),)),
        (Y, (Linear(2.0),)),
        (Z, (Linear(3.0),)),
    ]


def test_a_figure_made_in_python_may_have_axes_of_any_length():
    segments = {name: Segment(name) for name in ("a", "b")}
    joint = Joint(
        "hinge",
        SiteRef("a", "s"),
        SiteRef("b", "s"),
        (JointAxis(AxisKind.ROTATION, (0.0, -2.0, 0.0)),),
        stiff=(3.0,),
    )
    springs = own(Figure(segments, {"hinge": joint}, SiteRef("a", "s")))
    assert springs.joints["hinge"].axes[0].direction == (0.0, -1.0, 0.0)


def test_negative_damping_is_refused_with_its_place():
    whole = figure(knee="type = R(0,1,0); damp = (-5);")
    assert said(load_springs(whole)) == ["4:69 the damping of `knee` is negative"]


# How files and figure combine


LIMITS = "llimit = (-1 rad,-2 rad,-3 rad); ulimit = (1 rad,2 rad,3 rad);"


COMBINED = {
    "a record replaces stiff on its axis only": (
        f"type = {CHAIN}; stiff = (1e7,2e7,3e7);",
        f"1 1 | {CUBIC}",
        [(Z, (Linear(1.0),)), (X, (CURVE,)), (Y, (Linear(3.0),))],
    ),
    "stops are added to every axis": (
        f"type = {CHAIN}; {LIMITS}",
        f"1 1 | {CUBIC}",
        [(Z, (Stop(-1.0, 1.0),)), (X, (CURVE, Stop(-2.0, 2.0))), (Y, (Stop(-3.0, 3.0),))],
    ),
    "stops of all factors about an axis": (
        "type = R(0,0,1)*R(0,1,0)*R(0,0,-1); llimit = (-1 rad,0,-2 rad); ulimit = (1 rad,0,3 rad);",
        f"1 3 | {CUBIC}",
        [(Z, (CURVE, Stop(-1.0, 1.0), Stop(-3.0, 2.0))), (Y, (Stop(0.0, 0.0),))],
    ),
    "an axis that the chain does not name": (
        f"type = {ZYZ}; stiff = (0,2e7,0);",
        f"1 1 | {CUBIC}",
        [(Y, (Linear(2.0),)), (X, (CURVE,))],
    ),
    "a revolute's declared axis, not negated": (
        "type = R(0,-1,0);",
        f"1 3 | {CUBIC} | 0.5 -0.2 0.3",
        [((0.0, -1.0, 0.0), (Cubic((1.0, 2.0, 3.0, 4.0), -1, (-0.2, 0.3), 0.5),))],
    ),
}


@pytest.mark.parametrize("name", COMBINED)
def test_the_record_of_an_axis_and_the_fields_of_its_joint(tmp_path, name):
    fields, record, axes = COMBINED[name]
    (joint,) = good(optional(tmp_path, figure(joint=fields), record)).joints.values()
    assert [(axis.direction, axis.elastic) for axis in joint.axes] == axes


def test_a_record_replaces_damp_on_its_axis_only(tmp_path):
    whole = figure(hip=f"type = {CHAIN}; damp = (1e7,1e7,1e7);")
    axes = good(optional(tmp_path, whole, f"1 1 | {CUBIC}")).joints["hip"].axes
    assert [axis.damping.viscous for axis in axes] == [1.0, 0.08, 1.0]


def test_a_table_states_stiffness_and_onset_of_its_stops(tmp_path):
    table = 'joints = ["hip"]\naxis = "y"\nviscous_Nms_rad = 1\nstop_stiffness_Nm_rad = 50'
    reading = toml(
        tmp_path, figure(hip=f"type = {CHAIN}; {LIMITS}"), table + "\nstop_onset_deg = 2"
    )
    assert good(reading).joints["hip"].axes[2].elastic == (Stop(-3.0, 3.0, 50.0, radians(2.0)),)


def test_a_revolute_without_a_dead_zone_of_its_own_takes_that_of_the_roots(tmp_path):
    whole = figure(knee="type = R(0,1,0);")
    (axis,) = good(optional(tmp_path, whole, "1 3 | 0 -1e7 0 1e7 | 0.5 0 0")).joints["knee"].axes
    (law,) = axis.elastic
    assert isinstance(law, Cubic)
    assert law.dead_zone == pytest.approx((-1.0, 1.0))
    assert law.rest == 0.5


def test_rest_and_dead_zone_of_a_spherical_axis_are_ignored(tmp_path):
    whole = figure(hip=f"type = {CHAIN};")
    reading = optional(tmp_path, whole, f"1 1 | {CUBIC} | 0.5 -0.2 0.3")
    assert reading.value is not None
    (axis,) = reading.value.joints["hip"].axes
    assert axis.elastic == (CURVE,)


def test_what_a_springs_file_states_wins_over_the_rule(tmp_path):
    whole = figure(knee="type = R(0,1,0);")
    cubic = 'joints = ["knee"]\ncoefficients_Nm_rad = [0, -1, 0, 1]\n'

    def law(more: str) -> Cubic:
        reading = toml(tmp_path, whole, cubic + more)
        assert reading.value is not None, reading.diagnostics
        (found,) = reading.value.joints["knee"].axes[0].elastic
        assert isinstance(found, Cubic)
        return found

    assert law("") == passive_cubic((0.0, -1.0, 0.0, 1.0))
    assert law("dead_zone_deg = [-90, 0]").dead_zone == (radians(-90.0), 0.0)
    assert law("dead_zone_deg = [0, 0]").dead_zone == (0.0, 0.0)
    assert law('dead_zone_deg = "none"') == Cubic((0.0, -1.0, 0.0, 1.0), -1)
    assert law("sense = 1").sense == 1
    assert law("rest_deg = 180").rest == radians(180.0)
    assert law("").dead_zone == pytest.approx((-1.0, 1.0))


def test_joints_that_share_a_curve_are_mirror_images_by_their_declared_axes(tmp_path):
    right = "type = R(0,0,-1)*R(-1,0,0)*R(0,1,0);"
    whole = figure(left=f"type = {CHAIN};", right=right)
    table = 'joints = ["left", "right"]\naxis = "x"\nmotion = "abduction"\n'
    more = 'coefficients_Nm_rad = [1, 2, 3, 4]\nreference = "a study"\nwhy = "a reason"'
    springs = good(toml(tmp_path, whole, table + more))
    (left,), (right_axis,) = (springs.joints[name].axes for name in ("left", "right"))
    assert (left.direction, right_axis.direction) == (X, (-1.0, 0.0, 0.0))
    assert replace(right_axis, direction=X) == left
    assert (left.motion, left.reference, left.why) == ("abduction", "a study", "a reason")


def test_a_parabola_needs_limits_on_both_sides(tmp_path):
    limits = ("", "ulimit = (1 rad);", "llimit = (-1 rad); ulimit = (1 rad);")
    whole = figure(**{f"j{k}": f"type = R(0,1,0); {text}" for k, text in enumerate(limits, 1)})
    for number in (1, 2, 3):
        table = f'joints = ["j{number}"]\ncoefficients_Nm_rad = [0, 1, 2, 0]'
        for reading in (
            toml(tmp_path, whole, table),
            optional(tmp_path, whole, f"{number} 3 | 0 1e7 2e7 0"),
        ):
            if number < 3:
                assert reading.value is None
                continue
            (axis,) = good(reading).joints["j3"].axes[:1]
            assert axis.elastic == (Cubic((0.0, 1.0, 2.0, 0.0), -1), Stop(-1.0, 1.0))
            assert axis.why.startswith("No sense restores at both ends; the limits bound the range")


# What is wrong

KNEE = "type = R(0,1,0);"
K = "stiffness_Nm_rad = 1"


def test_springs_for_another_figure_are_used_with_a_warning(tmp_path):
    (tmp_path / "my.springs.toml").write_text(
        'figure = "other"\n[[spring]]\njoints = ["left_knee"]\n' + K
    )
    reading = load_springs(figure(left_knee=KNEE), tmp_path, "my")
    assert said(reading) == ["1:10 these springs were written for the figure `other`"]
    assert reading.value is not None
    assert list(reading.value.joints) == ["left_knee"]


def test_printed_values_need_an_optional_file(tmp_path):
    whole = figure(left_knee=KNEE)
    (fault,) = load_springs(whole, tmp_path, "my", "printed").diagnostics
    assert fault.message == "there is no `my.optional` beside the figure"
    (fault,) = load_springs(whole, None, None, "printed").diagnostics
    assert fault.message == "a figure from no file has no printed values"


def test_many_faults_end_with_the_hundredth(tmp_path):
    whole = figure(left_knee=KNEE)
    reading = toml(tmp_path, whole, *['joints = ["knee"]\n' + K] * 150)
    assert len(reading.diagnostics) == 100
    assert reading.value is None
    assert "100 errors" in reading.diagnostics[-1].hint
