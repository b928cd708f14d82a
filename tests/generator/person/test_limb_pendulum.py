"""Limbs as pendulums: against the parallel axis theorem by hand, and against measured limbs."""

from functools import cache
from math import pi

import pytest

from generator.person.body import build_body
from generator.person.limb_pendulum import LIMBS, TRUNK, LimbPendulum, limb_pendulum
from generator.person.measures import Sex, estimate_measures


@cache
def body():
    return build_body(estimate_measures(Sex.MALE, 1.75, 75.0))


def test_the_hand_swings_about_its_centre_and_the_wrist():
    hand = body().segments["hand"]
    found = limb_pendulum(body(), "wrist", "y")
    assert found.inertia == pytest.approx(hand.inertia[1] + hand.mass * hand.centre[2] ** 2)
    assert found.weight_moment == pytest.approx(9.81 * hand.mass * hand.centre[2])


def test_the_leg_is_the_sum_of_its_parts():
    leg, parts = limb_pendulum(body(), "hip_joint", "x"), body().segments
    places = {"upper_leg": 0.0, "lower_leg": parts["upper_leg"].length}
    places["foot"] = places["lower_leg"] + parts["lower_leg"].length
    expected = sum(
        parts[name].inertia[0]
        + parts[name].mass * (parts[name].centre[1] ** 2 + (start + parts[name].centre[2]) ** 2)
        for name, start in places.items()
    )
    assert leg.inertia == pytest.approx(expected)


def test_periods_of_limbs_under_gravity_are_those_of_limbs():
    """De Leva's shank and foot swing in 1.20 s, the leg at 0.67 Hz, the arm at 0.78 Hz."""
    knee = limb_pendulum(body(), "knee", "y")
    assert 2.0 * pi / knee.frequency(0.0) == pytest.approx(1.20, abs=0.03)
    leg, arm = (limb_pendulum(body(), joint, "y") for joint in ("hip_joint", "shoulder"))
    assert leg.frequency(0.0) / (2.0 * pi) == pytest.approx(0.67, abs=0.03)
    assert arm.frequency(0.0) / (2.0 * pi) == pytest.approx(0.78, abs=0.03)


@pytest.mark.parametrize("joint", [*LIMBS, *TRUNK])
def test_every_joint_swings_something_about_every_axis(joint):
    for axis in "xyz":
        found = limb_pendulum(body(), joint, axis)
        assert found.inertia > 0.0
        assert found.weight_moment > 0.0 or (axis == "z" and joint in TRUNK)


def test_a_bent_limb_turns_about_the_part_above_as_it_swings_about_the_joint_between():
    arm, elbow = limb_pendulum(body(), "shoulder", "z"), limb_pendulum(body(), "elbow", "y")
    assert arm.weight_moment == pytest.approx(elbow.weight_moment)
    own = body().segments["upper_arm"].inertia[2]
    assert arm.inertia == pytest.approx(elbow.inertia + own)


def test_the_waist_carries_head_arms_and_the_trunk_above():
    waist = limb_pendulum(body(), "waist", "y")
    names = ("middle_torso", "upper_torso", "head")
    above = sum(body().segments[name].mass for name in names)
    above += 2.0 * sum(body().segments[name].mass for name in LIMBS["shoulder"])
    assert waist.weight_moment / (9.81 * above) == pytest.approx(0.28, abs=0.06)
    assert limb_pendulum(body(), "waist", "z").inertia < 0.3 * waist.inertia


def test_damping_of_a_unit_pendulum():
    assert LimbPendulum(2.0, 6.0).damping(0.1, 2.0) == pytest.approx(2.0 * 0.1 * 2.0 * 2.0)
