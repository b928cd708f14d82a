import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import Cubic
from springs.cubic import antiderivative, polynomial

coefficients = st.tuples(*[st.floats(-300.0, 300.0)] * 4)
senses = st.sampled_from([-1, 1])
rests = st.floats(-1.0, 1.0)
zones = st.tuples(st.floats(-1.5, 0.0), st.floats(0.0, 1.5))
dead = st.builds(Cubic, coefficients, senses, zones, rests)
angles = st.floats(-3.0, 3.0)


@given(coefficients, angles)
def test_the_polynomial_is_that_of_the_thesis(c, a):
    assert polynomial(c, a) == pytest.approx(np.polyval(c[::-1], a), rel=1e-12, abs=1e-10)
    whole = np.polyint(np.array(c[::-1]))
    assert antiderivative(c, a) == pytest.approx(np.polyval(whole, a), rel=1e-12, abs=1e-10)


@given(dead)
def test_the_dead_zone_is_free_and_the_torque_grows_from_zero_at_its_edges(law):
    low, high = (law.rest + edge for edge in law.dead_zone)
    inside = np.linspace(low, high, 9)[1:-1]
    assert not law.torque(inside).any()
    assert not law.energy(inside).any()
    c = np.abs(law.coefficients)
    steepest = c[1] + 2.0 * c[2] * 3.0 + 3.0 * c[3] * 9.0
    assert abs(law.torque(low - 1e-9)) <= steepest * 1e-8 + 1e-10
    assert abs(law.torque(high + 1e-9)) <= steepest * 1e-8 + 1e-10


def test_breakpoints_are_the_edges_of_the_dead_zone():
    assert Cubic((1.0, 2.0, 3.0, 4.0)).breakpoints == ()
    assert Cubic((1.0, 2.0, 3.0, 4.0), -1, (-0.5, 0.25), 0.5).breakpoints == (0.0, 0.75)


def test_rest_is_where_the_angle_of_the_law_is_zero():
    at_rest = Cubic((1.0, 2.0, 3.0, 4.0), -1, (-0.1, 0.2))
    shifted = Cubic((1.0, 2.0, 3.0, 4.0), -1, (-0.1, 0.2), 0.5)
    for angle in (-0.6, 0.0, 0.9):
        assert shifted.torque(angle + 0.5) == pytest.approx(at_rest.torque(angle))
