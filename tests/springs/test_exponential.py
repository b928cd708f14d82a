from math import e, exp, inf

import pytest

from springs import FLOATS
from springs.exponential import Exponential, ExponentialTerm


def test_a_known_value():
    law = Exponential((ExponentialTerm(3.0, -2.0, 0.5), ExponentialTerm(-4.0, 1.0)), constant=1.5)
    assert law.torque(0.0) == pytest.approx(3.0 * e - 4.0 + 1.5)
    assert law.torque(0.5) == pytest.approx(3.0 - 4.0 * exp(0.5) + 1.5)
    assert law.energy(0.0) == pytest.approx(3.0 * e / 2.0 + 4.0)


def test_far_outside_the_torque_is_infinite_for_every_kind_of_number():
    law = Exponential((ExponentialTerm(-1.0, 40.0),))
    assert law.torque(50.0) == law.torque(50.0, FLOATS) == -inf
