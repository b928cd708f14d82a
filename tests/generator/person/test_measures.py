"""Measures: dimensions follow measured ones, impossible ones are refused, files and sources."""

from math import inf, nan
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from generator.diagnostics import InputError, UnknownNameError, UsageError
from generator.person.measures import (
    MAX_MASS_INDEX,
    MEASURES_FILE,
    MIN_MASS_INDEX,
    Measures,
    estimate_measures,
    measure_sources,
)
from generator.person.sources import Origin
from generator.person.survey import Sex, survey

SEXES = st.sampled_from(list(Sex))
LEVELS = sorted({row.level for row in survey().dimensions.values()} - {"", "leg", "trunk"})
LEG = ("tibial_height", "lateral_femoral_epicondyle_height", "crotch_height")


def man(**measured: float) -> Measures:
    return estimate_measures(Sex.MALE, 1.75, 75.0, measured)


def changed(measures: Measures) -> set[str]:
    return {one.name for one in measures.dimensions.values() if one.value != one.expected}


@pytest.mark.parametrize("sex", Sex)
def test_without_measured_dimensions_all_are_those_of_the_survey(sex: Sex):
    measures = estimate_measures(sex, 1.7, 70.0)
    assert list(measures.dimensions) == list(survey().dimensions)
    for name, one in measures.dimensions.items():
        expected = survey().expected(name, sex, 1.7, 70.0)
        assert (one.value, one.expected, one.standard_error) == (expected[0], *expected)
        assert (one.ratio, one.is_measured) == (1.0, False)
    assert (measures.sex, measures.stature, measures.mass) == (sex, 1.7, 70.0)
    assert not measures.warnings
    assert "span" not in measures.dimensions


def test_a_length_is_asked_for_by_name():
    measures = man(hand_length=0.2)
    assert measures.length("hand_length") == 0.2
    assert measures.ratio("hand_length") == 0.2 / measures.dimensions["hand_length"].expected
    assert measures.ratio("foot_length") == 1.0
    with pytest.raises(UnknownNameError, match=r"no dimension `hand_lenght`.*`hand_length`"):
        measures.length("hand_lenght")


@pytest.mark.parametrize("level", LEVELS)
def test_dimensions_of_a_level_follow_a_measured_one_by_its_ratio(level: str):
    rows = survey().dimensions
    names = [name for name in rows if rows[name].level == level]
    usual = man()
    for name in names:
        measures = man(**{name: 1.05 * usual.length(name)})
        assert changed(measures) == set(names)
        assert [measures.ratio(other) for other in names] == pytest.approx([1.05] * len(names))
        assert [other for other in names if measures.dimensions[other].is_measured] == [name]


def test_dimensions_without_a_level_stand_alone():
    alone = [row.name for row in survey().dimensions.values() if not row.level]
    usual = man()
    assert "biceps_circumference_flexed" in alone
    for name in alone:
        assert changed(man(**{name: 1.05 * usual.length(name)})) == {name}


def test_a_third_dimension_follows_two_measured_ones_by_their_mean_ratio():
    usual = man()
    breadth, girth = 1.1 * usual.length("waist_breadth"), 1.2 * usual.length("waist_circumference")
    measures = man(waist_breadth=breadth, waist_circumference=girth)
    assert measures.length("waist_breadth") == breadth
    assert measures.length("waist_circumference") == girth
    assert measures.ratio("waist_depth") == pytest.approx((1.1 * 1.2) ** 0.5)


@pytest.mark.parametrize("name", ["trochanterion_height", *LEG])
def test_a_measured_height_of_the_leg_scales_the_leg_and_the_trunk_closes_the_stature(name: str):
    usual = man()
    measures = man(**{name: 1.04 * usual.length(name)})
    for other in ("trochanterion_height", *LEG):
        assert measures.ratio(other) == pytest.approx(1.04)
    hip, neck = (usual.length(one) for one in ("trochanterion_height", "cervicale_height"))
    assert measures.ratio("cervicale_height") == 1.0
    shrunk = (neck - 1.04 * hip) / (neck - hip)
    for other in ("waist_height", "iliocristale_height", "suprasternale_height", "acromial_height"):
        below_neck = neck - measures.length(other)
        assert below_neck == pytest.approx(shrunk * (neck - usual.length(other)))
    assert measures.ratio("lateral_malleolus_height") == 1.0


def test_a_measured_cervicale_stretches_the_trunk_and_leaves_the_legs():
    usual = man()
    measures = man(cervicale_height=usual.length("cervicale_height") + 0.02)
    for name in ("trochanterion_height", *LEG):
        assert measures.ratio(name) == 1.0
    hip = usual.length("trochanterion_height")
    stretched = 1.0 + 0.02 / (usual.length("cervicale_height") - hip)
    for name in ("waist_height", "suprasternale_height", "acromial_height"):
        above_hip = measures.length(name) - hip
        assert above_hip == pytest.approx(stretched * (usual.length(name) - hip))


def test_heights_between_two_measured_ones_divide_their_distance_as_expected():
    usual = man()
    tibial, crotch = usual.length("tibial_height"), usual.length("crotch_height")
    measures = man(tibial_height=tibial + 0.02, crotch_height=crotch - 0.01)
    knee = usual.length("lateral_femoral_epicondyle_height")
    part = (knee - tibial) / (crotch - tibial)
    expected = tibial + 0.02 + part * (crotch - tibial - 0.03)
    assert measures.length("lateral_femoral_epicondyle_height") == pytest.approx(expected)
    assert measures.ratio("trochanterion_height") == pytest.approx(1.0 - 0.01 / crotch)


@given(sex=SEXES, stature=st.floats(0.5, 2.5), mass=st.floats(5.0, 300.0))
def test_every_possible_person_has_dimensions_that_agree(sex: Sex, stature: float, mass: float):
    assume(MIN_MASS_INDEX * stature**2 < mass < MAX_MASS_INDEX * stature**2)
    usual = estimate_measures(sex, stature, mass)
    # A dimension that is measured as expected starts the search for contradictions.
    chest = usual.length("chest_breadth")
    same = estimate_measures(sex, stature, mass, {"chest_breadth": chest})
    for name, one in same.dimensions.items():
        assert one.value == pytest.approx(usual.length(name))
    assert same.warnings == usual.warnings
    sample = survey().samples[sex]
    limits = {"stature": sample.stature.limits, "mass": sample.mass.limits}
    outside = [
        noun
        for noun, value in (("stature", stature), ("mass", mass))
        if not limits[noun][0] <= value <= limits[noun][1]
    ]
    assert [warning.split()[1] for warning in usual.warnings] == outside


@given(
    sex=SEXES,
    stature=st.floats(1.4, 2.0),
    mass_index=st.floats(16.0, 40.0),
    names=st.sets(st.sampled_from(sorted(survey().dimensions)), max_size=6),
    data=st.data(),
)
def test_measured_dimensions_near_the_expected_ones_are_kept(
    sex: Sex, stature: float, mass_index: float, names: set[str], data: st.DataObject
):
    mass = mass_index * stature**2
    usual = estimate_measures(sex, stature, mass)
    measured = {
        name: usual.length(name) * data.draw(st.floats(0.997, 1.003)) for name in sorted(names)
    }
    measures = estimate_measures(sex, stature, mass, measured)
    for name, one in measures.dimensions.items():
        assert one.is_measured is (name in names)
        assert one.value == measured.get(name, one.value)
        assert one.ratio == pytest.approx(1.0, abs=0.01)
    assert measures.warnings == usual.warnings


@given(
    names=st.sets(st.sampled_from(sorted(survey().dimensions)), min_size=1, max_size=4),
    data=st.data(),
)
def test_measured_dimensions_are_refused_or_give_a_body_in_order(
    names: set[str], data: st.DataObject
):
    usual = man()
    measured = {name: usual.length(name) * data.draw(st.floats(0.3, 3.0)) for name in sorted(names)}
    try:
        measures = man(**measured)
    except UsageError:
        return
    heights = ["lateral_malleolus_height", *LEG, "trochanterion_height", "waist_height"]
    heights += ["suprasternale_height", "cervicale_height"]
    values = [*(measures.length(name) for name in heights), measures.stature]
    assert values == sorted(values)
    assert values[0] > 0.0
    assert all(0.2 < one.ratio < 5.0 for one in measures.dimensions.values())


def test_a_stature_and_a_mass_beyond_the_sample_are_warnings_with_its_limits():
    measures = estimate_measures(Sex.MALE, 1.2, 140.0)
    short, heavy = measures.warnings
    assert "a stature of 1.2 m is beyond 1.62 to 1.89 m" in short
    assert "a mass of 140 kg is beyond 57.1 to 114 kg" in heavy
    assert "4082 men" in short
    (tall,) = estimate_measures(Sex.FEMALE, 1.8, 70.0).warnings
    assert "beyond 1.5 to 1.76 m" in tall
    assert "1986 women" in tall


def test_a_dimension_far_from_the_expected_one_is_a_warning():
    usual = man()
    one = usual.dimensions["neck_circumference"]
    near, far = (
        man(neck_circumference=one.expected + sign * one.standard_error) for sign in (2.99, -3.01)
    )
    assert not near.warnings
    (warning,) = far.warnings
    assert warning.startswith("`neck_circumference` of 0.33")
    assert "3.0 standard errors below the 0.381 m" in warning


@pytest.mark.parametrize(
    ("stature", "mass", "message"),
    [
        (0.0, 75.0, "a stature of 0 m is impossible; it must be from 0.4 m to 3 m"),
        (-1.75, 75.0, "a stature of -1.75 m"),
        (0.1, 5.0, "a stature of 0.1 m"),
        (5.0, 75.0, "a stature of 5 m"),
        (nan, 75.0, "a stature of nan m"),
        (175.0, 75.0, "a stature of 175 m .* to 3 m; did you mean 1.75 m\\?$"),
        (1.75, 0.0, "a mass of 0 kg is impossible at a stature of 1.75 m; it must be .* 306.2 kg$"),
        (1.75, 765.0, "a mass of 765 kg .* from 24.5 kg to 306.2 kg; did you mean 76.5 kg\\?$"),
        (1.75, 2000.0, "a mass of 2000 kg"),
        (1.75, -inf, "a mass of -inf kg"),
        (1.75, nan, "a mass of nan kg"),
        (2.5, 5.0, "a mass of 5 kg is impossible at a stature of 2.5 m; .* 50.0 kg to 625.0 kg"),
        (0.5, 300.0, "a mass of 300 kg is impossible .* it must be from 2.0 kg to 25.0 kg"),
    ],
)
def test_nobody_has_such_a_stature_or_mass(stature: float, mass: float, message: str):
    with pytest.raises(UsageError, match=message):
        estimate_measures(Sex.MALE, stature, mass)


@pytest.mark.parametrize(
    ("measured", "messages"),
    [
        ({"neck_girth": 0.4}, ["no dimension `neck_girth`; did you mean `neck_circumference`"]),
        ({"chest_depth": -0.2}, ["`chest_depth` cannot be -0.2 m; from 0.0942 m to 0.589 m"]),
        ({"chest_depth": 0.0}, ["`chest_depth` cannot be 0 m"]),
        ({"chest_depth": nan}, ["`chest_depth` cannot be nan m"]),
        ({"chest_depth": inf, "span": 2}, ["`chest_depth` cannot be inf m", "no dimension `span`"]),
        (
            {"cervicale_height": 1.76},
            ["`cervicale_height` (1.76 m) does not fit `stature` (1.75 m)"],
        ),
        (
            {"trochanterion_height": 1.3},
            ["`trochanterion_height` (1.3 m) does not fit `cervicale_height` (1.509 m, estimated)"],
        ),
        (
            {"tibial_height": 0.55, "lateral_femoral_epicondyle_height": 0.5},
            ["(0.55 m) must be smaller than `lateral_femoral_epicondyle_height` (0.5 m)"],
        ),
        (
            {"suprasternale_height": 1.53},
            ["must be smaller than `cervicale_height` (1.509 m, estimated)"],
        ),
        (
            {"acromial_height": 1.28},
            [
                "`acromial_height` (1.28 m) is too far below `cervicale_height` "
                "(1.509 m, estimated); the distance is at most 0.214 m"
            ],
        ),
        (
            {"suprasternale_height": 1.15},
            ["`suprasternale_height` (1.15 m) is too far below"],
        ),
        (
            {"waist_height": 1.3},
            ["`waist_height` (1.3 m) does not fit `cervicale_height` (1.509 m, estimated)"],
        ),
        (
            {"biacromial_breadth": 0.45, "bideltoid_breadth": 0.44},
            ["`biacromial_breadth` (0.45 m) must be smaller than `bideltoid_breadth` (0.44 m)"],
        ),
        (
            {"chest_depth": 0.4, "chest_breadth": 0.24},
            ["`chest_depth` (0.4 m) does not fit `chest_breadth` (0.24 m)"],
        ),
        (
            {"waist_breadth": 0.3, "waist_depth": 0.2, "waist_circumference": 1.2},
            ["`waist_circumference` (1.2 m) does not fit `waist_breadth` (0.3 m)"],
        ),
        (
            {"waist_breadth": 0.3, "waist_depth": 0.2, "waist_circumference": 0.6},
            ["the circumference is from 0.656 m to 1.1 m"],
        ),
        (
            {"acromion_radiale_length": 0.7, "radiale_stylion_length": 0.6},
            ["an arm of 1.49 m reaches the floor from `acromial_height` (1.431 m, estimated)"],
        ),
    ],
)
def test_impossible_and_contradictory_dimensions_are_refused_all_at_once(
    measured: dict[str, float], messages: list[str]
):
    with pytest.raises(UsageError) as raised:
        man(**measured)
    sentences = str(raised.value).splitlines()
    assert len(sentences) == len(messages)
    for message, sentence in zip(messages, sentences, strict=True):
        assert message in sentence


def test_shoulders_at_the_height_of_the_chest_are_refused():
    with pytest.raises(UsageError, match=r"^`acromial_height` \(1\.487 m\) is too far below"):
        estimate_measures(Sex.MALE, 2.03, 95.0, {"acromial_height": 1.487})
    low = estimate_measures(Sex.MALE, 2.03, 95.0, {"acromial_height": 1.56})
    assert any("`acromial_height`" in warning for warning in low.warnings)


def test_a_file_has_keys_that_end_in_units(tmp_path: Path):
    path = tmp_path / "me.toml"
    path.write_text(
        "# measured at home\n"
        "waist_circumference_cm = 94.0\n"
        "hand_length_mm = 190\n"
        "cervicale_height_m = 1.51\n"
        "foot_length_in = 10\n"
        "chest_circumference_ft = 3.25\n",
        encoding="utf-8",
    )
    measured = MEASURES_FILE.read(path)
    assert measured == {
        "waist_circumference": 0.94,
        "hand_length": 0.19,
        "cervicale_height": 1.51,
        "foot_length": 0.254,
        "chest_circumference": 0.9906,
    }
    assert estimate_measures(Sex.MALE, 1.75, 75.0, measured) == man(**measured)


def test_a_wrong_file_raises_all_its_errors(tmp_path: Path):
    path = tmp_path / "me.toml"
    path.write_text("waist_circumference = 94\nfoot_length_cm = -1\n", encoding="utf-8")
    with pytest.raises(InputError) as raised:
        MEASURES_FILE.read(path)
    assert [d.span and d.span.line for d in raised.value.diagnostics] == [1, 2]


def test_impossible_dimensions_of_a_file_are_shown_in_it(tmp_path: Path):
    path = tmp_path / "me.toml"
    path.write_text("hand_length_cm = 19\nchest_breadth_cm = 289\n", encoding="utf-8")
    with pytest.raises(InputError) as raised:
        estimate_measures(Sex.MALE, 1.75, 75.0, MEASURES_FILE.read(path))
    (diagnostic,) = raised.value.diagnostics
    assert diagnostic.span is not None
    assert (diagnostic.span.line, diagnostic.span.text) == (2, "289")
    assert diagnostic.hint == "did you mean `chest_breadth_mm`?"


def test_contradictions_of_a_file_are_shown_at_the_last_measured_dimension(tmp_path: Path):
    path = tmp_path / "me.toml"
    path.write_text("waist_depth_cm = 40\nwaist_breadth_cm = 20\n", encoding="utf-8")
    with pytest.raises(InputError) as raised:
        estimate_measures(Sex.MALE, 1.75, 75.0, MEASURES_FILE.read(path))
    first = raised.value.diagnostics[0]
    assert first.message == "`waist_depth` (0.4 m) does not fit `waist_breadth` (0.2 m)"
    assert first.span is not None
    assert first.span.text == "40"


def test_sources_name_the_regression_the_user_or_the_scaling():
    measures = man(waist_circumference=0.94)
    sources = {one.quantity: one for one in measure_sources(measures)}
    assert len(sources) == len(measures.dimensions) + 2
    assert {one.part for one in sources.values()} == {"person"}
    assert sources["mass"].origin is sources["waist circumference"].origin is Origin.STATED
    assert (sources["stature"].value, sources["stature"].unit) == (1.75, "m")
    breadth, foot = sources["waist breadth"], sources["foot length"]
    assert (breadth.origin, foot.origin) == (Origin.SCALED, Origin.PUBLISHED)
    assert breadth.value == measures.length("waist_breadth")
    assert "times 1.094 as measured ones" in breadth.rule
    assert foot.rule.startswith("regression 44.9 mm +120.4 mm/m stature +0.173 mm/kg mass")
    assert foot.reference is not None
    assert "4082 men" in foot.reference.place
    assert sources["waist circumference"].reference is None


def test_sources_of_a_person_beyond_the_sample_are_scaled():
    for one in measure_sources(estimate_measures(Sex.FEMALE, 1.2, 25.0)):
        if one.origin is not Origin.STATED:
            assert one.origin is Origin.SCALED
            assert "beyond the sample as a" in one.rule
            assert one.reference is not None
            assert "1986 women" in one.reference.place
