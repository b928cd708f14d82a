import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs.smooth_limit import SmoothLimit

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
def test_it_restores_and_is_free_between_the_limits(law, angle):
    torque = law.torque(angle)
    if angle > law.upper:
        assert torque <= 0.0
    elif angle < law.lower:
        assert torque >= 0.0
    else:
        assert torque == law.energy(angle) == 0.0


def test_half_way_through_the_transition_half_the_stiffness_acts():
    law = SmoothLimit(-1.0, 0.5, 10.0, 20.0, 0.4)
    assert law.torque(0.7) == pytest.approx(-20.0 * 0.2 * 0.5)
    assert law.torque(1.5) == pytest.approx(-20.0 * 1.0)
    assert law.torque(-1.2) == pytest.approx(10.0 * 0.2 * 0.5)
