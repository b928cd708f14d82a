"""The body of a person: the published table at its own bodies, closed lengths, sound inertias."""

from collections.abc import Mapping
from dataclasses import replace
from math import sqrt

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from generator.diagnostics import ModelError, UsageError
from generator.kinematics.centre_of_mass import centre_of_mass
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.person.body import ARM_SEGMENTS, LIMB_SEGMENTS, TRUNK_SEGMENTS, Body, build_body
from generator.person.joints import person_figure
from generator.person.measures import MAX_STATURE, MIN_STATURE, Measures, estimate_measures
from generator.person.segment_table import de_leva_table
from generator.person.sources import Origin
from generator.person.survey import Sex, survey
from tests.generator.person.test_segment_table import ZATSIORSKY

ROWS = {
    "lower_torso": ("lower_trunk", "OMPH", "MIDH"),
    "middle_torso": ("middle_trunk", "XYPH", "OMPH"),
    "upper_torso": ("upper_trunk", "CERV", "XYPH"),
    "head": ("head", "VERT", "CERV"),
    "upper_arm": ("upper_arm", "SJC", "EJC"),
    "lower_arm": ("forearm", "EJC", "WJC"),
    "hand": ("hand", "WJC", "DAC3"),
    "upper_leg": ("thigh", "HJC", "KJC"),
    "lower_leg": ("shank", "KJC", "AJC"),
    "foot": ("foot", "HEEL", "TTIP"),
}

AXES = {"hand": "tsl", "foot": "lts"}
"""Sagittal, transverse and longitudinal axis along x, y, z; of the other segments "stl"."""

LEGS = ("upper_leg", "lower_leg")


def reference_body(sex: Sex) -> Body:
    table = de_leva_table(sex)
    return build_body(estimate_measures(sex, table.stature, table.mass))


def man(**measured: float) -> Body:
    return build_body(estimate_measures(Sex.MALE, 1.70, 70.0, measured))


def anatomical(body: Body, name: str) -> list[float]:
    """Moments about the sagittal, transverse and longitudinal axes [kg m2]."""
    return [body.segments[name].inertia[AXES.get(name, "stl").index(axis)] for axis in "stl"]


def total_mass(body: Body) -> float:
    trunk = sum(body.segments[name].mass for name in TRUNK_SEGMENTS)
    return trunk + 2 * sum(body.segments[name].mass for name in LIMB_SEGMENTS)


def value(body: Body, part: str, quantity: str) -> float:
    (number,) = (one for one in body.sources if one.part == part and one.quantity == quantity)
    return number.value


@pytest.mark.parametrize("sex", Sex)
def test_the_reference_body_has_the_numbers_of_the_table(sex: Sex):
    table, body = de_leva_table(sex), reference_body(sex)
    assert tuple(body.segments) == (*TRUNK_SEGMENTS, *LIMB_SEGMENTS)
    factor = value(body, "person", "length factor of the legs")
    for name, (segment, *ends) in ROWS.items():
        row, made = table.row(segment, *ends), body.segments[name]
        length = row.length * (factor if name in LEGS else 1.0)
        if name not in ("hand", "foot"):
            assert made.length == pytest.approx(length, rel=1e-3)
        # The masses of the women sum to 99.99 %.
        assert made.mass == pytest.approx(table.mass_fraction(segment) * table.mass, rel=1.1e-4)
        for moment, radius in zip(anatomical(body, name), row.radii, strict=True):
            assert sqrt(moment / made.mass) / length == pytest.approx(radius, rel=1e-3)
        centre = made.centre[2] / made.length
        if name in TRUNK_SEGMENTS:
            centre = 1 - centre
        if name == "foot":
            centre = (made.centre[0] + body.heel_distance) / made.length
        assert centre == pytest.approx(row.centre, rel=1e-3)
    assert abs(total_mass(body) - table.mass) < 1e-9


# Means of Zatsiorsky's women that miss the table by more: mass of the foot 9 %, from which its
# moments follow, and the head about its long axis 3 %.
UNLIKE_THE_MEANS = {
    (Sex.FEMALE, "foot", 0): 0.10,
    (Sex.FEMALE, "foot", 1): 0.10,
    (Sex.FEMALE, "foot", 2): 0.10,
    (Sex.FEMALE, "foot", 3): 0.10,
    (Sex.FEMALE, "head", 3): 0.035,
}


@pytest.mark.parametrize("sex", Sex)
@pytest.mark.parametrize("name", ROWS)
def test_the_reference_body_has_the_means_of_the_sample(sex: Sex, name: str):
    body = reference_body(sex)
    factor = value(body, "person", "length factor of the legs") if name in LEGS else 1.0
    mass, *moments = ZATSIORSKY[sex][ROWS[name][0]]
    made = [body.segments[name].mass, *(1e4 * one / factor**2 for one in anatomical(body, name))]
    for index, (ours, mean) in enumerate(zip(made, (mass, *moments), strict=True)):
        assert ours == pytest.approx(mean, rel=UNLIKE_THE_MEANS.get((sex, name, index), 0.02))


@pytest.mark.parametrize("sex", Sex)
def test_the_centre_of_mass_is_at_55_percent_of_the_stature(sex: Sex):
    body = reference_body(sex)
    tree = build_tree(person_figure(body))
    centre = centre_of_mass(forward_kinematics(tree, initial_displacements(tree)))
    assert 0.545 < centre[1] / body.measures.stature < 0.57


@pytest.mark.parametrize("sex", Sex)
def test_hands_and_feet_are_as_long_as_the_survey_has_them(sex: Sex):
    body = reference_body(sex)
    lengths = {name: body.segments[name].length for name in ("hand", "foot")}
    assert lengths["foot"] == body.measures.length("foot_length")
    assert lengths["hand"] == pytest.approx(body.measures.length("hand_length") - 0.002)
    for name, length in lengths.items():
        segment, *ends = ROWS[name]
        printed = de_leva_table(sex).row(segment, *ends).length
        assert (0.95 if sex is Sex.MALE else 0.86) < printed / length < 1


def test_axes_of_hand_and_foot_are_those_of_the_standing_person():
    hand, foot = (reference_body(Sex.MALE).segments[name].inertia for name in ("hand", "foot"))
    assert hand[1] > hand[0] > hand[2]  # the palm faces the thigh
    assert foot[2] > foot[1] > foot[0]  # heel to toe is forward


def check_closure(body: Body) -> None:
    """Check that the segments reach from the sole to the vertex, with the shoulders in between."""
    segments, stature = body.segments, body.measures.stature
    trunk = sum(segments[name].length for name in TRUNK_SEGMENTS)
    assert body.hip_height + trunk == pytest.approx(stature, abs=1e-9)
    malleolus = body.measures.length("lateral_malleolus_height")
    factor = survey().length_factor(body.measures.sex, stature)
    assert body.ankle_height == pytest.approx(malleolus - 0.006 * factor, abs=1e-9)
    acromion = body.measures.length("acromial_height")
    neck = stature - segments["head"].length
    shoulder = neck - segments["upper_torso"].length + body.shoulder_height
    assert shoulder == pytest.approx(acromion - 0.0345 * factor, abs=1e-9)
    assert 0.0 < body.shoulder_height < segments["upper_torso"].length
    assert shoulder > sum(segments[name].length for name in ARM_SEGMENTS)
    assert abs(total_mass(body) - body.measures.mass) < 1e-9


def check_segments(body: Body) -> None:
    """Check lengths, masses, and the triangle inequality of moments of inertia."""
    for segment in body.segments.values():
        x, y, z = segment.inertia
        assert segment.length > 0
        assert segment.mass > 0
        assert 0 < 2 * max(x, y, z) < x + y + z
        assert 0 < segment.centre[2] < segment.length
    assert 0 < body.heel_distance < body.segments["foot"].length
    assert body.hip_spacing > 0
    assert body.shoulder_spacing > 0


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(Sex), st.floats(0.9, 2.3), st.floats(10, 250))
@example(Sex.MALE, 0.9, 80.0)
@example(Sex.FEMALE, 0.9, 80.0)
@example(Sex.MALE, 2.3, 45.0)
@example(Sex.FEMALE, 2.3, 45.0)
def test_every_person_closes_and_has_sound_inertias(sex: Sex, stature: float, mass: float):
    try:
        measures = estimate_measures(sex, stature, mass)
    except UsageError:
        return
    body = build_body(measures)
    check_closure(body)
    check_segments(body)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(Sex),
    st.dictionaries(
        st.sampled_from(
            [
                *("lateral_malleolus_height", "tibial_height", "trochanterion_height"),
                *("lateral_femoral_epicondyle_height", "waist_height", "acromial_height"),
                *("cervicale_height", "foot_length", "biacromial_breadth", "hand_length"),
            ]
        ),
        st.floats(0.95, 1.05),
        max_size=4,
    ),
)
def test_measured_dimensions_fit_or_are_refused(sex: Sex, factors: Mapping[str, float]):
    expected = estimate_measures(sex, 1.70, 70.0)
    measured = {name: factor * expected.length(name) for name, factor in factors.items()}
    try:
        body = build_body(estimate_measures(sex, 1.70, 70.0, measured))
    except (ModelError, UsageError):
        return
    check_closure(body)
    check_segments(body)


@pytest.mark.parametrize(
    ("dimension", "segment"),
    [
        ("acromion_radiale_length", "upper_arm"),
        ("radiale_stylion_length", "lower_arm"),
        ("hand_length", "hand"),
        ("foot_length", "foot"),
    ],
)
def test_a_measured_length_changes_its_segment_alone(dimension: str, segment: str):
    mean = man()
    made = man(**{dimension: 1.04 * mean.measures.length(dimension)})
    for name, before in mean.segments.items():
        ratio = 1.04 if name == segment else 1.0
        after = made.segments[name]
        offset = 0.002 if name == "hand" else 0.0
        assert after.length + offset == pytest.approx(ratio * (before.length + offset))
        assert after.mass == before.mass
        assert after.inertia == pytest.approx([ratio**2 * one for one in before.inertia])
    rules = [n.rule for n in made.sources if n.part == segment and n.quantity.startswith("length")]
    assert "times 1.0400 by measured dimensions" in rules[-1]


@pytest.mark.parametrize("sex", Sex)
@pytest.mark.parametrize("stature", [MIN_STATURE, MAX_STATURE])
def test_the_smallest_and_the_largest_person_close(sex: Sex, stature: float):
    """Offsets between landmarks and joint centres are scaled beyond the sample as its lengths."""
    body = build_body(estimate_measures(sex, stature, 15.0 * stature**2))
    check_closure(body)
    check_segments(body)
    factor = survey().length_factor(sex, stature)
    hand = body.measures.length("hand_length") - 0.002 * factor
    assert body.segments["hand"].length == pytest.approx(hand)
    spacing = body.measures.length("biacromial_breadth") - 0.035 * factor
    assert body.shoulder_spacing == pytest.approx(spacing)
    (source,) = (one for one in body.sources if one.quantity == "height of the ankle centre")
    assert source.rule.startswith(f"lateral malleolus height less {6 * factor:.3g} mm ")


def change_dimension(measures: Measures, name: str, factor: float) -> Measures:
    """Measures with a dimension that `estimate_measures` might refuse."""
    one = measures.dimensions[name]
    changed = replace(one, value=factor * one.expected, is_measured=True)
    return replace(measures, dimensions={**measures.dimensions, name: changed})


@pytest.mark.parametrize(
    ("dimension", "factor", "message"),
    [
        ("lateral_malleolus_height", 8.0, "the lower leg would be -0"),
        ("lateral_malleolus_height", 0.05, "the ankle height would be -0"),
        ("lateral_femoral_epicondyle_height", 2.0, "the upper leg would be -0"),
        ("trochanterion_height", 1.3, "the lower torso would be -0"),
        ("waist_height", 1.5, "the middle torso would be -0"),
        ("acromial_height", 1.2, "the shoulders would be"),
        ("acromial_height", 0.8, "the shoulders would be -0"),
        ("biacromial_breadth", 0.05, "from each other"),
    ],
)
def test_impossible_dimensions_are_one_sentence(dimension: str, factor: float, message: str):
    measures = change_dimension(estimate_measures(Sex.MALE, 1.70, 70.0), dimension, factor)
    with pytest.raises(ModelError, match=message) as refused:
        build_body(measures)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("sex", Sex)
def test_every_number_has_its_source(sex: Sex):
    body = reference_body(sex)
    numbers = {(one.part, one.quantity): one for one in body.sources}
    assert len(numbers) == len(body.sources)
    for name, segment in body.segments.items():
        assert numbers[name, "mass"].value == segment.mass
        assert numbers[name, "length"].value == segment.length
        for axis, moment in zip("xyz", segment.inertia, strict=True):
            assert numbers[name, f"moment of inertia about {axis}"].value == moment
    values = {one.value for one in body.sources}
    assert {
        *(body.hip_spacing, body.shoulder_spacing, body.shoulder_height),
        *(body.ankle_height, body.heel_distance),
    } <= values
    for one in body.sources:
        assert one.rule
        assert (one.reference is None) <= (one.origin is Origin.ESTIMATE)
    estimates = {one.quantity for one in body.sources if one.origin is Origin.ESTIMATE}
    assert "distance of the hip centres" in estimates
    assert ("height of the shoulder centres above its own joint" in estimates) == (
        sex is Sex.FEMALE
    )


def changed_by(sex: Sex, stature: float, mass: float, step: float) -> float:
    """Largest change of a mass or moment, relative to its size, from a step of stature and mass."""
    before, after = (
        build_body(estimate_measures(sex, factor * stature, factor * mass)).segments
        for factor in (1.0, 1.0 + step)
    )
    return max(
        abs(new / old - 1.0)
        for name in before
        for old, new in zip(
            (before[name].mass, *before[name].inertia),
            (after[name].mass, *after[name].inertia),
            strict=True,
        )
    )


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(Sex), st.floats(1.3, 2.1), st.floats(14.0, 50.0))
@example(Sex.MALE, 1.741, 1.15 * 73.0 / 1.741**2)
@example(Sex.MALE, 1.741, 0.85 * 73.0 / 1.741**2)
@example(Sex.MALE, 1.741, 1.30 * 73.0 / 1.741**2)
@example(Sex.FEMALE, 1.735, 1.525 * 61.9 / 1.735**2)
@example(Sex.MALE, 1.15 * 1.741, 26.0)
def test_masses_and_moments_have_no_step(sex: Sex, stature: float, index: float):
    """A step of a millionth changes masses and moments by millionths: no rule begins abruptly."""
    assert changed_by(sex, stature, index * stature**2, 1e-6) < 2e-5


@pytest.mark.parametrize(
    ("sex", "stature", "mass", "origin"),
    [
        (Sex.MALE, 1.756, 85.5, Origin.PUBLISHED),
        (Sex.MALE, 1.60, 120.0, Origin.PUBLISHED),
        (Sex.MALE, 1.741, 1.2 * 73.0, Origin.SCALED),
        (Sex.MALE, 1.40, 90.0, Origin.SCALED),
        (Sex.FEMALE, 1.60, 120.0, Origin.ESTIMATE),
    ],
)
def test_sources_say_which_rule_made_a_mass(sex: Sex, stature: float, mass: float, origin: Origin):
    body = build_body(estimate_measures(sex, stature, mass))
    (head,) = (one for one in body.sources if (one.part, one.quantity) == ("head", "mass"))
    weights = [one for one in body.sources if one.quantity.startswith("weight of the regressions")]
    assert head.origin is origin
    assert head.reference is not None
    if mass == 85.5:
        assert "de Leva" in head.reference.text
        assert weights == []
        return
    assert "Zatsiorsky" in head.reference.text
    (weight,) = weights
    assert f"{weight.value:.4g} of" in head.rule or weight.value == 1.0
    assert ("de Leva" in head.rule) == (weight.value < 1.0)
    assert "regression 1.296 kg +0.0171 of the body's mass +1.43 kg/m stature" in head.rule
    total = sum(
        one.value * (2 if one.part in LIMB_SEGMENTS else 1)
        for one in body.sources
        if one.quantity == "mass" and one.part != "person"
    )
    assert total == pytest.approx(mass, abs=1e-9)
