"""Change of the segments with the build: printed regressions, and their blend with the table."""

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from generator.person.segment_regression import (
    BAND,
    BLEND,
    BUILD_RANGE,
    HEAVIEST_BUILD,
    PAIRED_SEGMENTS,
    STATURE_RANGE,
    build_change,
    regression_weight,
    zatsiorsky_regressions,
)
from generator.person.segment_table import de_leva_table
from generator.person.sources import load_data_file
from generator.person.survey import Sex
from tests.generator.person.test_segment_table import ZATSIORSKY

FITS = zatsiorsky_regressions().segments
MAN = de_leva_table(Sex.MALE)

builds = st.tuples(st.sampled_from(Sex), st.floats(0.5, 2.6), st.floats(0.3, 5.0))
"""Sex, stature [m], and mass over that of a similar body."""


def mass_of(sex: Sex, stature: float, build: float) -> float:
    table = de_leva_table(sex)
    return build * table.mass * (stature / table.stature) ** 3


def sides(name: str) -> int:
    return 2 if name in PAIRED_SEGMENTS else 1


@pytest.mark.parametrize(
    ("place", "total", "tolerance"), [(0, 0, 0.05), (1, 1, 2e-3), (2, 0, 1e-3)]
)
def test_the_coefficients_of_the_masses_sum_to_those_of_the_body(
    place: int, total: float, tolerance: float
):
    rows = load_data_file("zatsiorsky_2002").content
    found = sum(sides(name) * rows[name]["mass"][place] for name in FITS)
    assert found == pytest.approx(total, abs=tolerance)


@pytest.mark.parametrize("name", FITS)
def test_the_mean_man_has_the_means_of_the_sample(name: str):
    mass, *moments = ZATSIORSKY[Sex.MALE][name]
    fit = FITS[name]
    assert fit.mass.evaluate(MAN.stature, MAN.mass) == pytest.approx(mass, rel=0.01)
    for moment, mean in zip(fit.moments, moments, strict=True):
        assert moment.evaluate(MAN.stature, MAN.mass) == pytest.approx(1e-4 * mean, rel=0.012)


def test_a_wrong_digit_would_be_seen():
    """The sum of the per-mass coefficients is known to 2 g/kg: a thigh of 0.1643 for 0.1463."""
    rows = load_data_file("zatsiorsky_2002").content
    wrong = sum(sides(name) * rows[name]["mass"][1] for name in FITS) + 2 * (0.1643 - 0.1463)
    assert abs(wrong - 1.0) > 2e-3


@pytest.mark.parametrize("sex", Sex)
def test_the_weight_is_zero_in_the_band_and_one_beyond_the_blend(sex: Sex):
    stature = de_leva_table(sex).stature
    heaviest = HEAVIEST_BUILD[sex]
    for build in (1.0 - BAND, 1.0, heaviest):
        assert regression_weight(sex, stature, mass_of(sex, stature, build)) < 1e-20
    for build in (1.0 - BAND - BLEND, heaviest + BLEND):
        assert regression_weight(sex, stature, mass_of(sex, stature, build)) == pytest.approx(1.0)
    for tall in (1.0 - BAND - BLEND, 1.0 + BAND + BLEND):
        other = tall * stature
        assert regression_weight(sex, other, mass_of(sex, other, 1.0)) == pytest.approx(1.0)


@pytest.mark.parametrize("sex", Sex)
@pytest.mark.parametrize("edge", ["light", "heavy", "short", "tall"])
def test_the_weight_begins_without_a_kink(sex: Sex, edge: str):
    """It grows with the square of the distance from the band: 3 (d / blend)^2."""
    stature = de_leva_table(sex).stature
    step = 1e-4
    if edge in ("short", "tall"):
        tall = 1.0 - BAND - step if edge == "short" else 1.0 + BAND + step
        found = regression_weight(sex, tall * stature, mass_of(sex, tall * stature, 1.0))
    else:
        build = 1.0 - BAND - step if edge == "light" else HEAVIEST_BUILD[sex] + step
        found = regression_weight(sex, stature, mass_of(sex, stature, build))
    assert found == pytest.approx(3.0 * (step / BLEND) ** 2, rel=1e-2)


@given(builds)
@example((Sex.MALE, 0.4, 0.3))
@example((Sex.FEMALE, 3.0, 5.0))
def test_shares_are_positive_and_sum_to_the_body(body: tuple[Sex, float, float]):
    sex, stature, build = body
    change = build_change(sex, stature, mass_of(sex, stature, build))
    assume(change is not None)
    assert change is not None
    assert sum(sides(name) * share for name, share in change.shares.items()) == pytest.approx(1.0)
    assert min(change.shares.values()) > 0.003
    for factors in change.radius_factors.values():
        assert all(0.5 < factor < 1.6 for factor in factors)


@given(st.floats(*STATURE_RANGE), st.floats(*BUILD_RANGE))
def test_a_man_within_the_range_has_the_printed_masses_and_moments(tall: float, build: float):
    stature = tall * MAN.stature
    mass = mass_of(Sex.MALE, stature, build)
    change = build_change(Sex.MALE, stature, mass)
    assume(change is not None)
    assert change is not None
    for name, fit in FITS.items():
        printed = fit.mass.evaluate(stature, mass)
        assert mass * change.shares[name] == pytest.approx(printed, rel=5e-3)
        usual, radii = fit.radii(MAN.stature, MAN.mass), fit.radii(stature, mass)
        for old, new, factor in zip(usual, radii, change.radius_factors[name], strict=True):
            assert tall * old * factor == pytest.approx(new)


def test_a_woman_changes_as_a_man_of_her_build():
    table = de_leva_table(Sex.FEMALE)
    mass = mass_of(Sex.FEMALE, table.stature, 2.0)
    woman = build_change(Sex.FEMALE, table.stature, mass)
    man = build_change(Sex.MALE, MAN.stature, 2.0 * MAN.mass)
    assert woman is not None
    assert man is not None
    usual = zatsiorsky_regressions().shares(MAN.stature, MAN.mass)
    changes = {
        name: woman.shares[name] / table.mass_fraction(name) / (man.shares[name] / usual[name])
        for name in FITS
    }
    assert max(changes.values()) == pytest.approx(min(changes.values()))
    assert woman.radius_factors["thigh"] == pytest.approx(man.radius_factors["thigh"])
