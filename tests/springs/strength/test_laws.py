"""Laws of the largest voluntary torque."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs.strength.laws import CosineLaw, GaussianLaw, PointLaw
from springs.strength.strengths import (
    LEAST_ENDURANCE_USE,
    Age,
    Body,
    StrengthClass,
    anderson_rows,
    endurance,
    norm,
    norms,
    percent_capable,
    percentile_5,
    strength,
    strength_rows,
)

ANGLES = st.floats(-7.0, 7.0)
ROWS = st.sampled_from(anderson_rows())


@given(ROWS, ANGLES, st.floats(-20.0, 20.0))
def test_torque_of_curves_is_never_below_zero(row, angle, rate):
    law = CosineLaw(1000.0, row.coefficients)
    assert law.torque(angle, rate) >= 0.0
    assert law.torque(angle) <= law.largest * (1.0 + 1e-12)


@given(ROWS)
def test_curve_has_its_marks(row):
    _, _, best, half, quarter, _ = row.coefficients
    law = CosineLaw(1000.0, row.coefficients)
    assert law.torque(best) == pytest.approx(1000.0 * row.coefficients[0])
    # C4 is the rate of 3/4 of the torque, C5 that of 1/2.
    assert law.torque(best, half) == pytest.approx(0.75 * law.largest)
    assert law.torque(best, quarter) == pytest.approx(0.5 * law.largest)
    for end in law.angles:
        assert law.torque(end) == pytest.approx(0.0, abs=1e-9)
        assert law.torque(end + 2.0 * (end - best)) == 0.0


def test_fast_plantarflexion_never_vanishes_as_published():
    endless = {
        row.motion for row in anderson_rows() if row.coefficients[4] > 3 * row.coefficients[3]
    }
    assert endless == {"ankle plantarflexion"}


def test_angles_are_those_of_the_publication():
    men = strength("left_knee", "flexion", Body(72.0, 1.75))
    assert men is not None
    low, high = np.degrees(men.law(True).angles)
    assert (low, high) == (pytest.approx(-6.6, abs=0.1), pytest.approx(136.5, abs=0.1))
    assert men.capacity(0.0, True) == pytest.approx(29.2, abs=0.1)


def test_all_36_rows_are_there_once():
    keys = {(row.motion, row.sex, row.age) for row in anderson_rows()}
    assert len(anderson_rows()) == len(keys) == 6 * 2 * 3
    young = [row.spread for row in anderson_rows() if row.age is Age.YOUNG]
    assert (min(young), max(young)) == (
        pytest.approx(0.15, abs=0.01),
        pytest.approx(0.33, abs=0.01),
    )


@pytest.mark.parametrize("is_female", [False, True])
def test_old_knees_have_the_norm_and_not_the_curve(is_female):
    body = Body(60.0, 1.63, is_female, Age.OLD)
    found = strength("left_knee", "flexion", body)
    assert found is not None
    assert found.origins == (StrengthClass.SCALED, StrengthClass.SCALED)
    for largest, motion in zip(found.largest, ("knee flexion", "knee extension"), strict=True):
        assert largest / body.mass == pytest.approx(norm(motion, body.sex, Age.OLD))
    for joint, motion in (("left_hip", "flexion"), ("left_ankle", "dorsiflexion")):
        old = strength(joint, motion, body)
        middle = strength(joint, motion, Body(60.0, 1.63, is_female, Age.MIDDLE))
        assert old is not None
        assert middle is not None
        assert old.origin is StrengthClass.ESTIMATE
        assert old.spreads == middle.spreads


def test_young_knees_beside_the_norms():
    # Extension of men is 4 % under the interval, all others are inside.
    for one in norms():
        if one.age != "adult":
            continue
        body = Body(1.0, 1.75 if one.sex == "male" else 1.63, one.sex == "female")
        found = strength("knee", one.motion.removeprefix("knee "), body)
        assert found is not None
        low, high = one.interval
        short = 0.042 if (one.motion, one.sex) == ("knee extension", "male") else 0.0
        assert low * (1.0 - short) <= found.largest[0] <= high


@pytest.mark.parametrize("law", [PointLaw(70.0), GaussianLaw(70.0, 0.3, 1.2)])
@given(angle=ANGLES)
def test_laws_of_one_number_do_not_exceed_it(law, angle):
    assert 0.0 <= law.torque(angle) <= law.largest
    assert law.torque(np.full((2, 3), angle)).shape == (2, 3)


@given(st.sampled_from(strength_rows()), ANGLES, st.booleans(), st.sampled_from(Age))
def test_opposite_motion_mirrors_the_law(row, angle, is_opposite, age):
    own = row.strength(Body(70.0, 1.7, True, age))
    assert own is not None
    back = own.reversed()
    assert back.capacity(-angle, not is_opposite) == own.capacity(angle, is_opposite)
    assert back.reversed().origins == own.origins


def test_endurance_is_the_power_law_within_its_bounds():
    assert endurance("left_elbow", 0.5) == pytest.approx(17.98 * 0.5**-2.21)
    assert endurance("waist", 0.5) == pytest.approx(22.69 * 0.5**-2.27)
    assert endurance("neck", 0.5) == endurance("left_hip_joint", 0.5) == 21.92 * 0.5**-1.98
    assert endurance("waist", LEAST_ENDURANCE_USE - 1e-6) is None
    assert endurance("waist", 1.0001) == 0.0


def test_percent_of_a_known_normal_law_is_exact():
    # Standard normal distribution at -1.96, 0, 1 and 3.
    for x, percent in (
        (-1.96, 2.499789514822),
        (0.0, 50.0),
        (1.0, 84.134474606854),
        (3.0, 99.865010196837),
    ):
        assert percent_capable(100.0 - 20.0 * x, 100.0, 0.2) == pytest.approx(percent, abs=1e-10)
    assert percent_capable(percentile_5(100.0, 0.2), 100.0, 0.2) == pytest.approx(95.0)
    assert percent_capable(1.0, 0.0, 0.2) == 0.0
    assert percent_capable(0.0, 0.0, 0.2) == 100.0
    assert (percent_capable(99.0, 100.0, 0.0), percent_capable(101.0, 100.0, 0.0)) == (100.0, 0.0)
