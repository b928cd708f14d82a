"""The springs of a person: a law about every axis, scaled by a rule, damped by a ratio."""

from dataclasses import replace
from functools import cache
from math import radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.diagnostics import UsageError
from generator.person.body import build_body
from generator.person.joints import PERSON_JOINTS, motion_range, person_figure
from generator.person.measures import Sex, estimate_measures
from generator.person.passive_joints import (
    HIP_DATUM,
    leg_springs,
    passive_axes,
    person_springs,
    reach_springs,
    springs_comment,
)
from generator.person.sources import Origin
from generator.springs_file.read import load_springs
from generator.springs_file.write import write_springs
from springs import Damping, SpringSet
from springs.elastic import total_torque
from springs.lint.finding import FindingKind
from springs.lint.report import report_coupled, report_curves


@cache
def make(sex=Sex.MALE, stature=1.756, mass=85.5):
    body = build_body(estimate_measures(sex, stature, mass))
    return body, person_figure(body)


@cache
def axes(*person):
    return passive_axes(make(*person)[0])


def leg(kind="published", hip_datum=HIP_DATUM, *person):
    return leg_springs(make(*person)[0], axes(*person), kind, hip_datum)


def all_springs(kind="published", *person, hip_datum=HIP_DATUM):
    reach = reach_springs(make(*person)[0], axes(*person))
    return person_springs(axes(*person), leg(kind, hip_datum, *person), reach)


def bound(content):
    _, figure = make()
    loaded = load_springs(figure, choice="me.springs.toml", text=write_springs(content))
    return loaded.require_value()


def label(axis):
    return f"{axis.joint} {axis.motion}"


AXES = [pytest.param(axis, id=label(axis)) for axis in axes()]


def test_every_axis_of_every_joint_has_a_law_in_the_sense_of_its_motion():
    wanted = {
        (joint.names, None if len(joint.rotations) == 1 else one.axis_name, one.motion)
        for joint in PERSON_JOINTS
        for one in joint.rotations
    }
    assert {(axis.names, axis.axis, axis.motion) for axis in axes()} == wanted


@pytest.mark.parametrize("axis", AXES)
def test_the_torque_restores_at_both_ends_of_the_normal_range(axis):
    joint = next(joint for joint in PERSON_JOINTS if joint.name == axis.joint)
    rotation = next(one for one in joint.rotations if one.motion == axis.motion)
    low, high = (end.angle for end in motion_range(joint, rotation, Sex.MALE))
    law = axis.law.elastic
    assert law.torque(low) > 0.0 > law.torque(high)
    angles = np.linspace(low, high, 500)
    assert np.all(np.diff(law.torque(angles)) <= 1e-9), "the stiffness is nowhere negative"
    margin = 0.1 * (high - low)
    for beyond in (low - margin, high + margin):
        assert abs(axis.scale * law.torque(beyond)) < 250.0, "no exponential explodes"


@given(st.sampled_from(Sex), st.floats(1.5, 1.95), st.floats(50.0, 110.0))
@settings(max_examples=8, deadline=None)
def test_torques_go_with_mass_times_stature_squared(sex, stature, mass):
    for one, other in zip(axes(sex, stature, mass), axes(), strict=True):
        ratio = mass * stature**2 / (85.5 * 1.756**2)
        assert one.scale / other.scale == pytest.approx(ratio, rel=2e-4)


@pytest.mark.parametrize(
    ("joint", "mass", "stature"), [("knee", 72.0, 1.75), ("elbow", 72.0, 1.75)]
)
def test_the_factor_is_that_of_the_stated_reference_body(joint, mass, stature):
    axis = next(axis for axis in axes() if axis.joint == joint)
    factor = 85.5 * 1.756**2 / (mass * stature**2)
    assert axis.scale == pytest.approx(factor, rel=5e-5)
    assert f"{mass:g} kg x ({stature:g} m)^2, an estimate" in axis.why


def test_lumbar_bend_has_the_reference_body_of_its_own_sample_and_an_estimated_range():
    axis = next(axis for axis in axes() if "lateral bend" in axis.motion)
    assert axis.origin is Origin.SCALED
    assert axis.scale == pytest.approx(85.5 * 1.756**2 / (70.2 * 1.69**2), rel=5e-5)


def test_bound_springs_are_those_of_the_axes_and_equal_on_both_sides():
    springs = bound(all_springs())
    legs = {(one.joints, one.motion) for one in leg().entries}
    for axis in axes():
        angles = np.radians(np.linspace(-20.0, 20.0, 5))
        for name in axis.names:
            found = [one for one in springs.joints[name].axes if one.motion == axis.motion]
            assert len(found) == 1
            assert found[0].damping == axis.damping
            if springs.joints[name].reach is not None:
                assert not found[0].elastic
            elif (axis.names, axis.motion) not in legs:
                torques = axis.scale * np.asarray(axis.law.elastic.torque(angles))
                assert total_torque(found[0].elastic[:1], angles) == pytest.approx(
                    torques, abs=1e-9
                )


def test_doubts_about_the_curves_are_only_firm_ends_of_range():
    springs = bound(all_springs("riener"))
    laws = {
        name: replace(one, axes=tuple(replace(axis, elastic=axis.elastic[:1]) for axis in one.axes))
        for name, one in springs.joints.items()
    }
    reports = report_curves(SpringSet(laws))
    doubts = {doubt.kind for report in reports for doubt in report.doubts}
    assert doubts == {FindingKind.EARLY_RESISTANCE}
    firm = {report.joints[0].removeprefix("left_") for report in reports if report.doubts}
    assert firm == {"waist", "thorax", "hip_joint", "ankle"}


def test_the_head_of_the_file_says_what_the_rules_leave_out():
    comment = " ".join(springs_comment().split())
    for words in (
        "87 healthy children",
        "the rule is an estimate",
        "Women's joints are softer",
        "damping ratio",
    ):
        assert words in comment
    assert max(map(len, springs_comment().splitlines())) <= 96


@pytest.mark.parametrize(("kind", "count"), [("published", 3), ("riener", 2)])
def test_the_law_of_the_leg_has_an_energy_and_only_the_doubt_of_its_source(kind, count):
    springs = bound(leg(kind))
    assert {axis.joint for one in springs.coupled for axis in one.axes} == {
        f"{side}_{joint}"
        for side in ("left", "right")
        for joint in ("hip_joint", "knee", "ankle")[:count]
    }
    doubts = [doubt.sentence for one in report_coupled(springs) for doubt in one.doubts]
    ankle = "at the lower end of ankle dorsiflexion, -30 deg, the torque drives the joint on"
    assert doubts == ([] if kind == "riener" else [f"{ankle}, with up to 0.486 N m"])
    knee = next(axis for axis in axes() if axis.joint == "knee")
    damping = springs.joints["left_knee"].axes[0].damping
    assert damping == knee.damping


def leg_torques(datum, *degrees_of_joints):
    """Torques of the left leg of the man at hip, knee and ankle [deg], stops left out [N m]."""
    springs = bound(all_springs(hip_datum=radians(datum)))
    angles = np.radians(degrees_of_joints)
    hip, knee, ankle = springs.coupled[0].law.torques(angles)
    own = next(one for one in springs.joints["left_ankle"].axes if one.motion == "dorsiflexion")
    return hip, knee, ankle + total_torque(own.elastic[:1], angles[2])


def test_moments_of_the_leg_are_those_of_people():
    """Woodhull's standing hip, Soucie's end of extension, the ankle of two studies."""
    hip, knee, ankle = leg_torques(10.0, 0.0, 0.0, 0.0)
    assert (hip, knee, ankle) == pytest.approx((2.82, 7.30, -7.57), abs=0.02)
    assert 8.0 < leg_torques(10.0, -17.4, 0.0, 0.0)[0] < 25.0
    assert 30.0 < -leg_torques(10.0, 0.0, 0.0, 20.0)[2] < 62.0
    assert 0.0 < -leg_torques(10.0, 0.0, 60.0, 0.0)[2] < 4.0
    assert leg_torques(0.0, 0.0, 0.0, 0.0)[0] == pytest.approx(8.0, abs=0.02)
    assert leg_torques(0.0, 10.0, 0.0, 0.0) == pytest.approx(leg_torques(10.0, 0.0, 0.0, 0.0))


def torque(joint, motion, angle):
    """Torque about an axis of the mean body of the law's sample [N m] at an angle [deg]."""
    (axis,) = (one for one in axes() if (one.joint, one.motion) == (joint, motion))
    return float(axis.law.elastic.torque(radians(angle)))


def test_the_waist_is_as_soft_as_that_of_living_people():
    """Beach et al.: 0, 0.1 and 0.7 N m per percent in thirds of a range of 69.6 deg."""
    zones = {23.2: 0.0, 34.8: 1.67, 46.4: 3.33, 58.0: 15.0, 69.6: 26.67}
    for angle, moment in zones.items():
        assert -torque("waist", "lumbar flexion", angle) == pytest.approx(moment, abs=0.5)
    assert -torque("waist", "lumbar flexion", 10.0) > 0.0, "there is an angle of rest"


def test_the_elbow_is_as_soft_at_its_straight_end_as_those_of_ten_men():
    """Engin & Chen 1987: 1.0, 3.7, 7.1 and 12.1 N m at 0, 5, 10 and 15 deg of hyperextension."""
    for angle, moment in {0.0: 1.014, -5.0: 3.66, -10.0: 7.07, -15.0: 12.09}.items():
        assert torque("elbow", "flexion", angle) == pytest.approx(moment, abs=0.01)
    assert 0.4 < torque("elbow", "flexion", 0.0) / radians(90.0) < 1.8, "Wiegner & Watts 1986"
    assert torque("elbow", "flexion", 60.0) == pytest.approx(0.85 * radians(30.0), abs=0.01)


def test_the_hip_resists_abduction_and_adduction_as_cadavers_do():
    """van Arkel et al. 2015: 5 N m at 30 deg of abduction and 40 deg of adduction."""
    assert torque("hip_joint", "abduction", 30.0) == pytest.approx(-5.0)
    assert torque("hip_joint", "abduction", -40.0) == pytest.approx(5.0)
    assert -20.0 < torque("hip_joint", "abduction", 45.0) < -10.0, "as an examiner ends a motion"


@pytest.mark.parametrize("kind", ["published", "riener"])
def test_thigh_and_calf_meet_beside_the_law_of_the_leg(kind):
    springs = bound(leg(kind))
    (elastic, *_) = springs.joints["left_knee"].axes[0].elastic
    knee = next(axis for axis in axes() if axis.joint == "knee")
    assert elastic.torque(radians(90.0)) == 0.0
    assert elastic.torque(radians(150.0)) == pytest.approx(-2.63 * knee.scale, abs=0.01)


def test_dorsiflexors_resist_plantarflexion_where_the_law_of_the_leg_does_not():
    assert leg_torques(10.0, 0.0, 60.0, -30.0)[2] == pytest.approx(-0.1, abs=0.1)
    assert 4.0 < leg_torques(10.0, 0.0, 60.0, -50.0)[2] < 10.0


@pytest.mark.parametrize("datum", [-0.01, radians(15.1)])
def test_a_hip_datum_that_no_person_has_is_refused(datum):
    with pytest.raises(UsageError, match="the hip datum is from 0 to 15 deg"):
        leg(hip_datum=datum)


def test_damping_is_twice_ratio_times_frequency_times_inertia():
    for axis in axes():
        pendulum = axis.pendulum
        expected = 2.0 * axis.ratio * pendulum.frequency(axis.stiffness) * pendulum.inertia
        assert axis.damping == Damping(float(f"{expected:.5g}"))
        assert axis.damping.viscous > 0.0
