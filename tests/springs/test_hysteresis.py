from math import tanh

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import Linear, Stop
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis

HIP = Exponential(
    (ExponentialTerm(7.0, -4.0), ExponentialTerm(-1.0, 2.5, 0.2)), valid_range=(-0.3, 1.4)
)
widths = st.floats(0.0, 20.0)
laws = st.builds(Hysteresis.from_mean_and_width, st.sampled_from([HIP, Linear(20.0, 0.3)]), widths)
angles, rates = st.floats(-0.5, 1.5), st.floats(-5.0, 5.0)


@given(laws, angles)
def test_moving_fast_one_of_the_curves_is_followed(law, angle):
    assert law.total_torque(angle, 10.0) == pytest.approx(law.increasing.torque(angle), abs=1e-9)
    assert law.total_torque(angle, -10.0) == pytest.approx(law.decreasing.torque(angle), abs=1e-9)
    middle = 0.5 * (law.increasing.torque(angle) + law.decreasing.torque(angle))
    assert law.total_torque(angle, 0.0) == pytest.approx(middle, abs=1e-9)
    assert law.torque(angle) == pytest.approx(middle, abs=1e-9)


@given(widths, angles, rates)
def test_the_width_lies_between_the_curves_and_takes_energy(width, angle, rate):
    law = Hysteresis.from_mean_and_width(HIP, width)
    gap = law.total_torque(angle, -rate) - law.total_torque(angle, rate)
    assert gap == pytest.approx(width * tanh(rate / law.slip), abs=1e-9)
    assert law.friction(angle, rate) * rate <= 1e-12
    assert law.total_torque(angle, rate) - HIP.torque(angle) == pytest.approx(
        law.friction(angle, rate), abs=1e-9
    )


@given(laws, angles, angles)
def test_a_slow_cycle_loses_what_lies_between_the_curves(law, one, other):
    low, high = min(one, other), max(one, other)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    x = low + 0.5 * (high - low) * (nodes + 1.0)
    gap = law.decreasing.torque(x) - law.increasing.torque(x)
    work = 0.5 * (high - low) * float(weights @ gap)
    assert law.cycle_loss(low, high) == pytest.approx(work, rel=1e-9, abs=1e-9)
    assert law.cycle_loss(low, high) >= -1e-9


def test_curves_in_the_wrong_order_show_in_the_loss():
    right = Hysteresis.from_mean_and_width(HIP, 8.0)
    wrong = Hysteresis(right.decreasing, right.increasing)
    assert right.cycle_loss(0.0, 1.0) == pytest.approx(8.0)
    assert wrong.cycle_loss(0.0, 1.0) == pytest.approx(-8.0)


def test_breakpoints_are_those_of_both_and_the_range_is_common():
    law = Hysteresis(Stop(-0.2, 0.4, onset=0.1), Stop(-0.2, 0.5, onset=0.1))
    assert law.breakpoints == pytest.approx((-0.3, -0.2, 0.4, 0.5, 0.6))
    assert law.valid_range is None
    other = Exponential((), valid_range=(-1.0, 1.0))
    assert Hysteresis(HIP, other).valid_range == (-0.3, 1.0)
