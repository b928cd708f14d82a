import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import FLOATS
from springs.smooth_limit import SmoothLimit
from tests.slopes import slope

stiffness = st.floats(0.0, 1e3)
limits = st.builds(
    SmoothLimit,
    st.floats(-1.5, 0.0),
    st.floats(0.0, 1.5),
    stiffness,
    stiffness,
    st.floats(0.05, 8.0),
)
angles = st.floats(-4.0, 4.0)


@given(limits, angles)
def test_torque_is_minus_the_slope_of_energy(law, angle):
    assert law.torque(angle) == pytest.approx(-slope(law.energy, angle), rel=1e-9, abs=1e-9)


@given(limits)
def test_torque_and_energy_have_no_jump_at_a_corner(law):
    for corner in law.breakpoints:
        for function in (law.torque, law.energy):
            before, after = function(corner - 1e-9), function(corner + 1e-9)
            assert after == pytest.approx(before, rel=1e-6, abs=1e-4)


@given(limits, angles)
def test_it_restores_and_is_free_between_the_limits(law, angle):
    torque = law.torque(angle)
    if angle > law.upper:
        assert torque <= 0.0
    elif angle < law.lower:
        assert torque >= 0.0
    else:
        assert torque == law.energy(angle) == 0.0


@given(limits, st.lists(angles, min_size=1, max_size=4))
def test_arrays_and_floats_agree(law, values):
    for function in (law.torque, law.energy):
        single = [function(value, FLOATS) for value in values]
        assert np.allclose(function(np.array(values)), single, rtol=1e-12, atol=1e-12)


@given(limits, angles)
def test_the_mirrored_law_is_the_same_seen_from_the_other_side(law, angle):
    mirrored = law.mirrored()
    assert mirrored.torque(-angle) == pytest.approx(-law.torque(angle), rel=1e-12, abs=1e-12)
    assert mirrored.mirrored() == law


def test_half_way_through_the_transition_half_the_stiffness_acts():
    law = SmoothLimit(-1.0, 0.5, 10.0, 20.0, 0.4)
    assert law.torque(0.7) == pytest.approx(-20.0 * 0.2 * 0.5)
    assert law.torque(1.5) == pytest.approx(-20.0 * 1.0)
    assert law.torque(-1.2) == pytest.approx(10.0 * 0.2 * 0.5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1.0, 0.0, 1.0, 1.0, 1.0), "the lower limit 1 is above the upper 0"),
        ((0.0, 1.0, -1.0, 1.0, 1.0), "not negative"),
        ((0.0, 1.0, 1.0, -1.0, 1.0), "not negative"),
        ((0.0, 1.0, 1.0, 1.0, 0.0), "transition is positive"),
    ],
)
def test_limits_that_are_none_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        SmoothLimit(*arguments)
