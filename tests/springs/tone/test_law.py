"""Tone about one axis and several, and activation."""

from dataclasses import replace
from itertools import pairwise
from math import inf

import numpy as np
import pytest

from springs import FLOATS, JointSprings, SphericalLaw, rotation_law
from springs.tone.activation import Activation
from springs.tone.law import AxisTone, rest_angle, rotation_tone, vector_tone

TONE = AxisTone((0.0, 0.0, 1.0), (30.0, 51.0), rest=0.3)
ANGLES = np.linspace(-3.0, 3.0, 601)


def test_torque_is_odd_with_the_strengths_exchanged() -> None:
    mirrored = replace(TONE, largest=(51.0, 30.0), rest=-0.3)
    for rate in (0.0, 2.0):
        there = TONE.torque(ANGLES, rate, 1.0)
        back = mirrored.torque(-ANGLES, -rate, 1.0)
        assert np.allclose(there, -back, rtol=0.0, atol=1e-12)


def test_torque_is_bounded_by_the_strength_in_its_direction() -> None:
    torque = TONE.torque(ANGLES, 0.0, 0.4)
    assert torque.max() <= 0.4 * 30.0
    assert torque.min() >= -0.4 * 51.0
    assert torque[0] == pytest.approx(0.4 * 30.0, rel=1e-6)
    assert torque[-1] == pytest.approx(-0.4 * 51.0, rel=1e-6)
    assert np.all((torque > 0.0) == (ANGLES < 0.3))


def test_slope_is_continuous_at_the_angle_that_is_held() -> None:
    step = 1e-6
    below, at, above = (float(TONE.torque(0.3 + d, 0.0, 1.0)) for d in (-step, 0.0, step))
    assert at == 0.0
    assert (above - at) / step == pytest.approx((at - below) / step, rel=1e-4)
    assert (above - at) / step == pytest.approx(-0.5 * (30.0 + 51.0) / 0.2, rel=1e-4)


def test_rate_damps() -> None:
    assert TONE.torque(0.3, 1.0, 1.0) == pytest.approx(TONE.torque(0.4, 0.0, 1.0), rel=1e-12)
    assert TONE.torque(0.3, 1.0, 1.0) < 0.0


def test_opposite_axis_is_the_same_tone() -> None:
    other = TONE.oriented_along((0.0, 0.0, -1.0))
    assert other.torque(-0.7, -1.5, 0.6) == pytest.approx(-TONE.torque(0.7, 1.5, 0.6), rel=1e-14)
    assert TONE.oriented_along((0.0, 0.0, 1.0)) is TONE


@pytest.mark.parametrize("change", [{"largest": (-1.0, 2.0)}, {"width": 0.0}])
def test_impossible_tones_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"muscles|width"):
        replace(TONE, **change)  # pyright: ignore[reportArgumentType]


AXES = (
    AxisTone((0.0, 1.0, 0.0), (30.0, 51.0), 0.2),
    AxisTone((-1.0, 0.0, 0.0), (32.0, 20.0), -0.1),
    AxisTone((0.0, 0.0, 1.0), (13.0, 13.0)),
)
CHAIN = ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


@pytest.mark.parametrize("law", SphericalLaw)
def test_turn_about_an_axis_has_the_torque_of_this_axis(law: SphericalLaw) -> None:
    own = rotation_law(JointSprings("neck"), law, CHAIN)
    tones = tuple(replace(axis, rest=0.0) for axis in AXES)
    for axis in tones:
        direction = np.array(axis.direction)
        found = rotation_tone(own, tones, 0.5 * direction, -2.0 * direction, 0.7)
        assert found == pytest.approx(axis.torque(0.5, -2.0, 0.7) * direction, abs=1e-12)
        assert rest_angle(own, axis.direction, 0.5 * direction) == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize("law", SphericalLaw)
def test_floats_and_arrays_agree(law: SphericalLaw) -> None:
    own = rotation_law(JointSprings("neck"), law, CHAIN)
    random = np.random.default_rng(1)
    for r, rate in random.normal(size=(20, 2, 3)):
        one = rotation_tone(own, AXES, r, rate, 0.5, FLOATS)
        assert rotation_tone(own, AXES, r, rate, 0.5) == pytest.approx(one, abs=1e-12)


def test_power_of_coordinates_is_that_of_their_torques() -> None:
    own = rotation_law(JointSprings("neck"), SphericalLaw.COORDINATES, CHAIN)
    assert own.axes == []
    r, rate = np.array([0.3, -0.4, 0.5]), np.array([1.0, 2.0, -0.5])
    at = own.coordinates.at(r, FLOATS)  # pyright: ignore[reportAttributeAccessIssue]
    rates = at.rates(rate, FLOATS)
    own_axes = [a.oriented_along(c) for a, c in zip(AXES, CHAIN, strict=True)]
    power = sum(a.torque(q, v, 1.0) * v for a, q, v in zip(own_axes, at.angles, rates, strict=True))
    assert rotation_tone(own, AXES, r, rate, 1.0) @ rate == pytest.approx(power, rel=1e-12)


def test_vector_tone_is_bounded() -> None:
    torque = vector_tone(AXES, np.array([9.0, -9.0, 9.0]), np.zeros(3), 1.0)
    assert torque == pytest.approx([-32.0, 30.0, -13.0], rel=1e-12)


@pytest.mark.parametrize("ops_time", [0.0, 0.1, 0.12, 0.15, 0.3, 0.5, 0.53, 0.55, 2.0])
def test_activation_rises_and_falls(ops_time: float) -> None:
    activation = Activation(0.1, 0.5)
    value = activation.at(ops_time, FLOATS)
    assert value == pytest.approx(float(activation.at(np.array(ops_time))), abs=1e-15)
    expected = {0.0: 0.0, 0.1: 0.0, 0.15: 1.0, 0.3: 1.0, 0.5: 1.0, 0.55: 0.0, 2.0: 0.0}
    if ops_time in expected:
        assert value == pytest.approx(expected[ops_time], abs=1e-12)
    else:
        assert 0.0 < value < 1.0


def test_activation_rises_and_falls_without_kinks() -> None:
    """Values and slopes agree on both sides of each knot."""
    activation, step = Activation(0.1, 0.5, 0.08), 1e-7
    assert len(activation.knots) == 4
    for knot in activation.knots:
        before, at, after = activation.at(knot + step * np.array([-1.0, 0.0, 1.0]))
        assert before == pytest.approx(at, abs=1e-9)
        assert (after - at) / step == pytest.approx((at - before) / step, abs=1e-4)


def test_cubics_are_the_activation() -> None:
    activation = Activation(0.1, 0.5, 0.08)
    ends = [0.0, 0.03, *activation.knots, 0.7, 1.0]
    ends.sort()
    for start, stop in pairwise(ends):
        times = np.linspace(start, stop, 7)
        cubic = np.polynomial.Polynomial(activation.cubic(start, stop))
        assert cubic(times - start) == pytest.approx(activation.at(times), abs=1e-12)


def test_activation_without_times_is_one() -> None:
    activation = Activation()
    assert activation.knots == ()
    assert activation.at(0.3) == 1.0
    assert activation.cubic(0.0, 1.0) == (1.0, 0.0, 0.0, 0.0)
    assert Activation(release=0.4).at(np.array([0.2, 0.6])) == pytest.approx([1.0, 0.0])
    assert Activation(-inf, 0.4).knots == (0.4, 0.4 + 0.05)
