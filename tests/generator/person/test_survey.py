"""The survey: its regressions against the sample that they were fitted to, and beyond it."""

import re
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import UnknownNameError
from generator.person.sources import load_data_file
from generator.person.survey import MAX_DEVIATIONS, Scaling, Sex, survey
from springs.published.reference import Sureness

# Values [mm] of a man of 1750 mm and 75 kg and a woman of 1630 mm and 62 kg, computed separately
# from unrounded regressions.
PEOPLE = {Sex.MALE: (1.75, 75.0), Sex.FEMALE: (1.63, 62.0)}
COMPUTED = """
biacromial_breadth 409 363
bideltoid_breadth 488 436
chest_breadth 280 262
chest_depth 236 234
waist_breadth 302 284
waist_depth 214 197
hip_breadth 330 342
buttock_depth 227 220
bicristal_breadth 268 265
head_length 198 189
head_breadth 153 147
tragion_to_top_of_head 131 126
menton_sellion_length 122 112
neck_circumference 381 321
hand_length 192 180
hand_breadth 87 78
palm_length 115 108
wrist_circumference 172 152
forearm_circumference_flexed 296 256
biceps_circumference_flexed 335 289
foot_length 269 245
foot_breadth 100 92
ball_of_foot_length 199 181
heel_breadth 70 66
lateral_malleolus_height 72 63
bimalleolar_breadth 74 67
ankle_circumference 222 211
calf_circumference 373 360
lower_thigh_circumference 387 384
thigh_circumference 583 586
chest_circumference 995 904
waist_circumference 859 808
buttock_circumference 964 981
cervicale_height 1509 1397
suprasternale_height 1430 1329
acromial_height 1431 1335
waist_height 1058 985
iliocristale_height 1059 996
trochanterion_height 899 846
crotch_height 846 785
lateral_femoral_epicondyle_height 490 466
tibial_height 466 438
acromion_radiale_length 333 310
radiale_stylion_length 267 241
sitting_height 915 857
span 1803 1658
wrist_height 839 793
"""
ROWS = {**survey().dimensions, **survey().validation}
NAMES = st.sampled_from(sorted(ROWS))
SEXES = st.sampled_from(list(Sex))


def test_a_regression_has_its_value_for_a_man_and_a_woman():
    for line in COMPUTED.split("\n")[1:-1]:
        name, *expected_mm = line.split()
        for (sex, person), expected in zip(PEOPLE.items(), expected_mm, strict=True):
            value, _ = survey().expected(name, sex, *person)
            assert 1e3 * value == pytest.approx(float(expected), abs=1.0), name


def test_all_rows_have_a_computed_value_and_three_are_for_validation():
    assert {line.split()[0] for line in COMPUTED.split("\n")[1:-1]} == set(ROWS)
    assert list(survey().validation) == ["sitting_height", "span", "wrist_height"]


@pytest.mark.parametrize("sex", Sex)
def test_a_regression_goes_through_the_means_and_leaves_its_standard_error(sex: Sex):
    sample, content = survey().samples[sex], load_data_file("ansur_2012").content["sample"][sex]
    for name, row in ROWS.items():
        fit = row.fits[sex]
        at_means = fit.evaluate(sample.stature.mean, sample.mass.mean)
        # The coefficients are rounded to 1e-4 and 1e-3 mm/kg, at 1756 mm and 86 kg.
        assert at_means == pytest.approx(fit.mean, abs=0.3e-3), name
        of_stature = fit.per_stature * sample.stature.deviation
        of_mass = fit.per_mass * sample.mass.deviation
        covariance = content["stature_mass_correlation"] * of_stature * of_mass
        explained = of_stature**2 + of_mass**2 + 2.0 * covariance
        # All deviations are rounded to 0.1 mm.
        variance = explained + fit.standard_error**2
        assert variance == pytest.approx(fit.deviation**2, abs=0.2e-3 * fit.deviation), name


def test_levels_have_several_dimensions_and_names_say_their_scaling():
    levels = [row.level for row in survey().dimensions.values() if row.level]
    assert all(levels.count(level) > 1 for level in levels)
    for row in survey().dimensions.values():
        if "circumference" in row.name or "depth" in row.name:
            assert row.scaling is Scaling.GIRTH
        if row.name.endswith(("_length", "_height")):
            assert row.scaling is Scaling.LENGTH
        assert row.meaning
        assert not row.meaning.endswith(".")


def test_the_reference_and_the_samples_are_there():
    assert "NATICK/TR-15/007" in survey().reference.text
    assert survey().reference.sureness is Sureness.SEVERAL_CODES
    assert [survey().samples[sex].subjects for sex in Sex] == [4082, 1986]
    for sex in Sex:
        for spread in (survey().samples[sex].stature, survey().samples[sex].mass):
            lower, upper = spread.limits
            assert spread.smallest < lower < spread.mean < upper < spread.largest
            assert upper - lower == pytest.approx(2 * MAX_DEVIATIONS * spread.deviation)


def test_an_unknown_dimension_states_the_nearest():
    with pytest.raises(UnknownNameError, match=r"no dimension `chest_bredth`.*`chest_breadth`"):
        survey().expected("chest_bredth", Sex.MALE, 1.7, 70.0)


def test_the_formula_in_words_has_the_numbers_of_the_fit():
    fit = survey().dimensions["chest_depth"].fits[Sex.MALE]
    numbers = [float(n) for n in re.findall(r"[-+]?[\d.]+", str(fit))]
    expected = [getattr(fit, field.name) * 1e3 for field in fields(fit)][2:]
    assert numbers == pytest.approx(expected)


@given(name=NAMES, sex=SEXES, stature=st.floats(0.5, 2.5), mass_index=st.floats(8.0, 100.0))
def test_a_dimension_of_any_person_is_positive_and_changes_little_with_them(
    name: str, sex: Sex, stature: float, mass_index: float
):
    mass = mass_index * stature**2
    value, standard_error = survey().expected(name, sex, stature, mass)
    fit = ROWS[name].fits[sex]
    assert 0.0 < standard_error < value
    assert 0.2 * fit.mean < value < 5.0 * fit.mean
    near, _ = survey().expected(name, sex, stature * 1.000_001, mass * 1.000_001)
    assert near == pytest.approx(value, rel=1e-5)


@given(
    name=NAMES,
    sex=SEXES,
    stature=st.floats(0.5, 1.4),
    mass=st.floats(5.0, 40.0),
    factor=st.floats(0.5, 1.0),
)
def test_below_the_sample_people_of_equal_proportions_are_similar(
    name: str, sex: Sex, stature: float, mass: float, factor: float
):
    value, error = survey().expected(name, sex, stature, mass)
    small, small_error = survey().expected(name, sex, factor * stature, factor**3 * mass)
    assert small == pytest.approx(factor * value)
    assert small_error == pytest.approx(factor * error)


@given(sex=SEXES, mass=st.floats(115.0, 400.0), factor=st.floats(1.0, 4.0))
def test_above_the_sample_girths_grow_so_that_volume_grows_as_mass(
    sex: Sex, mass: float, factor: float
):
    stature = survey().samples[sex].stature.mean
    for row in survey().dimensions.values():
        value, heavy = (
            survey().expected(row.name, sex, stature, m)[0] for m in (mass, factor * mass)
        )
        power = 0.5 if row.scaling is Scaling.GIRTH else 0.0
        assert heavy == pytest.approx(value * factor**power)
