import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import FLOATS, Cubic, Linear, Stop
from springs.exponential import Exponential
from springs.transformed import Transformed
from tests.slopes import slope

BASES = [Cubic((1.0, -2.0, 3.0, 4.0)), Linear(30.0, 0.4), Stop(-0.6, 1.1)]
numbers = st.floats(-3.0, 3.0)
laws = st.builds(Transformed, st.sampled_from(BASES), numbers, numbers, numbers)


@given(laws, numbers)
def test_torque_is_minus_the_slope_of_energy(law, angle):
    assert law.torque(angle) == pytest.approx(-slope(law.energy, angle), rel=1e-10, abs=1e-9)


@given(laws, numbers)
def test_the_curve_is_scaled_moved_and_raised(law, angle):
    torque = law.scale * law.law.torque(angle) + law.constant
    assert law.torque(angle + law.offset) == pytest.approx(torque, rel=1e-9, abs=1e-9)
    assert law.torque(angle, FLOATS) == pytest.approx(law.torque(angle), rel=1e-12)


@given(laws, numbers)
def test_the_mirrored_law_is_the_same_seen_from_the_other_side(law, angle):
    mirrored = law.mirrored()
    assert mirrored.torque(-angle) == pytest.approx(-law.torque(angle), rel=1e-12, abs=1e-10)
    assert mirrored.energy(-angle) == pytest.approx(law.energy(angle), rel=1e-12, abs=1e-10)
    assert mirrored.mirrored() == law


def test_corners_and_range_move_with_the_curve():
    moved = Transformed(Stop(-0.6, 1.1, onset=0.1), 2.0, 0.2)
    assert moved.breakpoints == pytest.approx((-0.5, -0.4, 1.3, 1.4))
    assert moved.valid_range is None
    law = Transformed(Exponential((), valid_range=(-1.0, 2.0)), offset=0.5)
    assert law.valid_range == (-0.5, 2.5)
