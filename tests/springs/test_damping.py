from math import tanh

import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import Damping
from springs.damping import DEFAULT_SLIP_RATE

laws = st.builds(Damping, st.floats(0.0, 10.0), st.floats(0.0, 10.0), st.floats(1e-3, 1.0))
rates = st.floats(-50.0, 50.0)


@given(laws, rates)
def test_damping_never_feeds_energy(law, rate):
    assert law.torque(rate) * rate <= 0.0


@given(laws, rates)
def test_damping_is_the_same_in_both_directions(law, rate):
    assert law.torque(-rate) == -law.torque(rate)


def test_viscous_damping_is_proportional_to_the_rate():
    assert Damping(0.08).torque(2.5) == -0.2
    assert Damping().torque(2.5) == 0.0


def test_friction_opposes_velocity_with_its_full_value_beyond_the_slip_rate():
    law = Damping(coulomb=3.0)
    assert law.torque(0.0) == 0.0
    assert law.torque(DEFAULT_SLIP_RATE) == pytest.approx(-3.0 * tanh(1.0))
    assert law.torque(1.0) == pytest.approx(-3.0, rel=1e-12)
    assert law.torque(-1.0) == pytest.approx(3.0, rel=1e-12)
