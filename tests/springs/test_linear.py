import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import Linear

springs = st.builds(Linear, st.floats(0.1, 1e3), st.floats(-2.0, 2.0))
angles = st.floats(-3.0, 3.0)


@given(springs, angles)
def test_torque_is_minus_the_slope_of_energy(spring, angle):
    h = 1e-4  # the central difference of a parabola has no other error than rounding
    slope = (spring.energy(angle + h) - spring.energy(angle - h)) / (2.0 * h)
    assert spring.torque(angle) == pytest.approx(-slope, rel=1e-7, abs=1e-7)


def test_a_known_value():
    spring = Linear(100.0, rest=0.5)
    assert spring.torque(0.7) == pytest.approx(-20.0)
    assert spring.energy(0.7) == pytest.approx(2.0)
    assert spring.torque(0.5) == spring.energy(0.5) == 0.0
    assert spring.breakpoints == ()


@given(springs, angles)
def test_the_mirrored_spring_is_the_same_seen_from_the_other_side(spring, angle):
    assert spring.mirrored().torque(-angle) == -spring.torque(angle)
    assert spring.mirrored().energy(-angle) == spring.energy(angle)
    assert spring.mirrored().mirrored() == spring
