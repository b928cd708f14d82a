from math import e, exp, inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import FLOATS
from springs.exponential import Exponential, ExponentialTerm
from tests.slopes import slope

rates = st.one_of(st.floats(-20.0, -0.1), st.floats(0.1, 20.0))
terms = st.builds(ExponentialTerm, st.floats(-50.0, 50.0), rates, st.floats(-1.0, 1.0))
laws = st.builds(Exponential, st.lists(terms, max_size=3).map(tuple), st.floats(-20.0, 20.0))
angles = st.floats(-3.0, 3.0)


def test_a_known_value():
    law = Exponential((ExponentialTerm(3.0, -2.0, 0.5), ExponentialTerm(-4.0, 1.0)), constant=1.5)
    assert law.torque(0.0) == pytest.approx(3.0 * e - 4.0 + 1.5)
    assert law.torque(0.5) == pytest.approx(3.0 - 4.0 * exp(0.5) + 1.5)
    assert law.energy(0.0) == pytest.approx(3.0 * e / 2.0 + 4.0)


@given(laws, angles)
def test_torque_is_minus_the_slope_of_energy(law, angle):
    assert law.torque(angle) == pytest.approx(-slope(law.energy, angle), rel=1e-12, abs=1e-12)


@given(laws, st.lists(angles, min_size=1, max_size=4))
def test_arrays_and_floats_agree(law, values):
    for function in (law.torque, law.energy):
        single = [function(value, FLOATS) for value in values]
        assert np.allclose(function(np.array(values)), single, rtol=1e-12, atol=1e-12)


@given(laws, angles)
def test_the_mirrored_law_is_the_same_seen_from_the_other_side(law, angle):
    mirrored = law.mirrored()
    assert mirrored.torque(-angle) == pytest.approx(-law.torque(angle), rel=1e-12, abs=1e-12)
    assert mirrored.energy(-angle) == pytest.approx(law.energy(angle), rel=1e-12, abs=1e-12)
    assert mirrored.mirrored() == law


def test_the_range_is_mirrored_too():
    assert Exponential((), valid_range=(-0.2, 1.0)).mirrored().valid_range == (-1.0, 0.2)
    assert Exponential((), valid_range=None).mirrored().valid_range is None


def test_far_outside_the_torque_is_infinite_for_every_kind_of_number():
    law = Exponential((ExponentialTerm(-1.0, 40.0),))
    assert law.torque(50.0) == law.torque(50.0, FLOATS) == -inf


def test_it_is_smooth():
    assert Exponential((ExponentialTerm(1.0, 1.0),)).breakpoints == ()


def test_a_rate_of_zero_is_refused():
    with pytest.raises(ValueError, match="write a constant instead"):
        ExponentialTerm(1.0, 0.0)
