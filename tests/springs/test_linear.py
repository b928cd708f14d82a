import pytest

from springs import Linear


def test_a_known_value():
    spring = Linear(100.0, rest=0.5)
    assert spring.torque(0.7) == pytest.approx(-20.0)
    assert spring.energy(0.7) == pytest.approx(2.0)
    assert spring.torque(0.5) == spring.energy(0.5) == 0.0
    assert spring.breakpoints == ()
