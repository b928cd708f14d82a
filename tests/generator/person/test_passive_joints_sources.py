"""Every number of a person's springs has a row: its value, where it is from, and how it follows."""

from functools import cache
from math import pi, radians

import pytest

from generator.person.body import build_body
from generator.person.measures import Sex, estimate_measures
from generator.person.passive_joints import leg_springs, passive_axes, spring_sources
from generator.person.sources import Origin


@cache
def body():
    return build_body(estimate_measures(Sex.FEMALE, 1.628, 67.8))


@cache
def axes():
    return passive_axes(body())


@cache
def sources():
    legs = [leg_springs(body(), axes(), kind) for kind in ("published", "riener")]
    return spring_sources(body(), axes(), legs)


def test_factor_ratio_and_damping_of_every_axis_have_a_row():
    values = {(one.part, one.quantity): one.value for one in sources()}
    for axis in axes():
        for quantity, value in (
            ("factor of the torque", axis.scale),
            ("damping ratio of the limb", axis.ratio),
            ("viscous damping", axis.damping.viscous),
        ):
            assert values[axis.joint, f"{axis.motion}: {quantity}"] == value


def test_published_numbers_have_a_publication_and_estimates_say_so():
    for one in sources():
        assert one.rule
        if one.origin is Origin.PUBLISHED:
            assert one.reference is not None
    neck = [one for one in sources() if one.part == "neck" and "torque at" in one.quantity]
    assert neck
    assert {one.origin for one in neck} == {Origin.ESTIMATE}


@pytest.mark.parametrize(
    ("part", "quantity", "value"),
    [
        ("waist", "lumbar lateral bend to the right: torque at 28 deg", -53.5),
        ("wrist", "radial deviation: stiffness", 1.74),
        ("elbow", "flexion: torque at -10 deg", 7.067),
        ("knee", "thigh-calf contact: torque at 150 deg", -2.63),
        ("knee", "flexion: damping ratio of the limb", 0.068),
        ("hip_joint and knee", "law of the leg, constant about hip flexion", 8.072),
        ("hip_joint and knee and ankle", "law of the leg, exponential 2: hip flexion", 2.314),
        ("ankle", "dorsiflexors: rate of exponential 1", -0.1949 * 180.0 / pi),
        (
            "hip_joint and knee and ankle",
            "law of the leg: hip flexion of the upright person",
            radians(10.0),
        ),
    ],
)
def test_numbers_are_those_of_the_publications(part, quantity, value):
    found = [one for one in sources() if (one.part, one.quantity) == (part, quantity)]
    assert [one.value for one in found] == [pytest.approx(value)]


def test_each_point_has_the_publication_of_its_own_piece():
    points = [one for one in sources() if one.quantity.startswith("lumbar flexion: torque at")]
    for one in points:
        author = "Schmidt" if one.quantity.split()[4].startswith("-") else "Watt"
        assert author in one.reference.text
    elbow = {one.quantity: one.reference for one in sources() if one.part == "elbow"}
    assert "Engin" in elbow["flexion: torque at 0 deg"].text
    assert "Saul" in elbow["flexion: torque at 130 deg"].text


def test_no_row_stands_twice():
    rows = [(one.part, one.quantity) for one in sources()]
    assert len(rows) == len(set(rows))
