"""Residuals of a case, and their derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.identification.comparison import (
    FAILED_RUN_ERROR,
    Accuracy,
    Comparison,
    FailedRunError,
    make_unknown,
    unknown_release,
)
from tests.swings import NOISE, OFFSET, SCALE, TRUTH, VISCOUS, leg_case, paths, swing

FINE = Accuracy(1e-8)


def comparison(data=None, texts=(SCALE, OFFSET, VISCOUS)) -> Comparison:
    unknowns = [make_unknown(path, leg_case()) for path in paths(*texts)]
    return Comparison(leg_case(), swing() if data is None else data, unknowns)


def test_residuals_at_the_truth_are_the_noise():
    exact, noisy = swing(noise=0.0), swing()
    truth = np.array(list(TRUTH.values()))
    noise = (noisy.angles - exact.angles).ravel()
    np.testing.assert_allclose(comparison().residuals(truth, FINE), -noise, atol=1e-7)
    assert np.std(noise) == pytest.approx(NOISE, rel=0.2)


def test_samples_between_frames_are_interpolated():
    data = swing(noise=0.0, frame=0.003, stop=1.5)
    times = np.linspace(0.0, 1.5, 38) ** 1.1 / 1.5**0.1
    times = data.times[np.unique(np.searchsorted(data.times, times))]
    uneven = replace(data, times=times, angles=data.angles[np.searchsorted(data.times, times)])
    truth = np.array(list(TRUTH.values()))
    assert np.abs(comparison(uneven).residuals(truth, FINE)).max() < 2e-6


@settings(max_examples=10)
@given(
    epoch=st.integers(-(2**37), 2**37).map(lambda count: count / 64.0),
    release=st.floats(-0.1, 0.1),
)
def test_residuals_do_not_depend_on_the_epoch(epoch: float, release: float):
    """Times and epoch are multiples of 1/64 s, so that the shifted times are exact."""
    data = swing(frame=1.0 / 64.0, stop=0.5)
    texts = [make_unknown(path, leg_case()) for path in paths(SCALE)]
    unknowns = [*texts, unknown_release(release, 1.0 / 64.0)]
    values = np.array([1.3, release])
    here, there = (
        Comparison(leg_case(), replace(data, times=times), unknowns)
        for times in (data.times, data.times + epoch)
    )
    assert np.array_equal(here.residuals(values, FINE), there.residuals(values, FINE))
    assert there.in_time_of_data(values)[1] == epoch + release
    assert there.failed_runs == 0


def test_a_release_at_the_wrong_end_of_the_data_fails():
    unknowns = [unknown_release(0.0, 0.02)]
    one = Comparison(leg_case(), swing(), unknowns)
    for release in (3.5, -3.5):
        assert np.all(one.residuals(np.array([release]), FINE) == FAILED_RUN_ERROR)
    assert "is too far away" in one.failure


def test_derivatives_agree_with_wide_differences():
    one = comparison()
    truth = np.array(list(TRUTH.values()))
    steps = one.difference_steps(one.jacobian(truth, FINE, one.difference_steps()))
    central = one.jacobian(truth, FINE, steps)
    half = one.jacobian(truth, FINE, 0.5 * steps)
    sizes = np.abs(central).max(axis=0)
    assert (np.abs(central - half).max(axis=0) / sizes).max() < 1e-4
    forward = one.jacobian(truth, FINE, steps, one.residuals(truth, FINE))
    assert (np.abs(central - forward).max(axis=0) / sizes).max() < 0.02
    assert one.failed_runs == 0


def test_beyond_a_bound_differences_are_to_one_side():
    one = comparison()
    at_bound = np.array([1.3, -4.0, 0.0])
    jacobian = one.jacobian(at_bound, FINE, np.array([1e-4, 1e-3, 1e-5]))
    inside = one.jacobian(np.array([1.3, -4.0, 1e-4]), FINE, np.array([1e-4, 1e-3, 1e-5]))
    assert np.abs(jacobian - inside).max() < 2e-3 * np.abs(inside).max()


def test_a_failed_run_is_survived_and_counted():
    one = comparison()
    differences = one.residuals(np.array([1.0, 0.0, -1.0]), FINE)
    assert np.all(differences == FAILED_RUN_ERROR)
    assert (one.runs, one.failed_runs) == (1, 1)
    assert one.failure
    with pytest.raises(FailedRunError, match="the runs beside"):
        one.jacobian(np.array([-1.0, 0.0, -1.0]), FINE, np.array([0.1, 1.0, 0.1]))


def test_the_mass_acts_as_the_inverse_of_stiffness_and_damping():
    one = comparison()
    truth = np.array(list(TRUTH.values()))
    steps = one.difference_steps(one.jacobian(truth, FINE, one.difference_steps()))
    jacobian = one.jacobian(truth, FINE, steps)
    mass = one.mass_derivative(truth, FINE)
    ratio = -(truth[0] * jacobian[:, 0] + truth[2] * jacobian[:, 2])
    assert np.abs(mass - ratio).max() < 1e-3 * np.abs(mass).max()


def test_starts_are_about_the_nominal_value():
    scale, offset, viscous = comparison().unknowns
    assert (scale.nominal, offset.nominal, viscous.nominal) == (1.0, 0.0, 0.3)
    assert (scale.spread(0.0), scale.spread(1.0)) == pytest.approx((1 / 3, 3.0))
    assert (offset.spread(0.0), offset.spread(0.5)) == (-10.0, 0.0)
    assert viscous.spread(0.5) == pytest.approx(0.3)
    assert (scale.lower, offset.lower, viscous.lower) == (1e-3, -np.inf, 0.0)
