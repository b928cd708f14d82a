from math import inf, radians

import numpy as np
import pytest

from springs import Stop
from springs.stop import DEFAULT_STOP_ONSET, DEFAULT_STOP_STIFFNESS


def test_the_default_is_1000_newton_metres_a_radian_grown_over_one_degree():
    assert DEFAULT_STOP_STIFFNESS == 1000.0
    assert radians(1.0) == DEFAULT_STOP_ONSET
    assert Stop(0.0, 1.0) == Stop(0.0, 1.0, 1000.0, radians(1.0))


def test_between_the_limits_it_does_nothing():
    angle = np.linspace(-0.5, 0.8, 50)
    assert not Stop(-0.5, 0.8).torque(angle).any()
    assert not Stop(-0.5, 0.8).energy(angle).any()


@pytest.mark.parametrize("beyond", [0.1, 0.5])
def test_beyond_the_onset_it_is_a_spring_that_starts_half_an_onset_late(beyond):
    stop = Stop(-0.3, 0.4, 1000.0, 0.02)
    assert stop.torque(0.4 + beyond) == pytest.approx(-1000.0 * (beyond - 0.01))
    assert stop.torque(-0.3 - beyond) == pytest.approx(1000.0 * (beyond - 0.01))


def test_breakpoints_are_where_a_stop_begins_and_where_its_onset_ends():
    assert Stop(-1.0, 2.0, 1000.0, 0.25).breakpoints == (-1.25, -1.0, 2.0, 2.25)
    assert Stop(None, 2.0, 1000.0, 0.25).breakpoints == (2.0, 2.25)
    assert Stop(-1.0, None, 1000.0, 0.25).breakpoints == (-1.25, -1.0)


def test_one_limit_stops_one_way():
    assert Stop(None, 0.5).torque(-9.0) == 0.0
    assert Stop(None, 0.5).torque(1.0) < 0.0
    assert Stop(0.5, None).torque(0.0) > 0.0
    assert Stop(0.5, None).mirrored() == Stop(None, -0.5)


def test_an_infinite_limit_does_not_stop():
    angle, open_below = np.linspace(-3.0, 3.0, 50), Stop(-inf, 1.0)
    assert np.array_equal(open_below.torque(angle), Stop(None, 1.0).torque(angle))
    assert not Stop(-inf, inf).torque(angle).any()
