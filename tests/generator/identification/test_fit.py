"""Fits to swings whose springs are known."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from generator.diagnostics import ModelError, MoverError, UsageError
from generator.identification.comparison import _scale_masses
from generator.identification.fit import MAX_BIAS, Fit, FitOptions, fit_springs
from generator.simulation.run import simulate
from tests.swings import NOISE, OFFSET, SCALE, TRUTH, VISCOUS, leg_case, paths, swing

ALONE = FitOptions(starts=1, profiles=False)
START = "pose.left_knee"


@cache
def standard_fit() -> Fit:
    return fit_springs(leg_case(), swing(), paths(*TRUTH), FitOptions(starts=2))


def test_the_truth_is_within_the_uncertainty():
    fit = standard_fit()
    truth = {**TRUTH, START: 50.0}
    assert list(fit.values) == list(truth)
    for one in fit.estimates:
        assert abs(one.value - truth[one.path]) < 3.5 * one.sd, one.path
        assert 0.0 < one.sd < 0.05 * max(1.0, abs(truth[one.path]))
    assert fit.noise_sd == pytest.approx(NOISE, rel=0.15)
    assert fit.tests.rms == pytest.approx(NOISE, rel=0.15)
    assert not fit.tests.are_autocorrelated
    assert [one.is_best for one in fit.starts] == [True, True]
    assert [one.is_start for one in fit.estimates] == [False, False, False, True]


def test_profiles_agree_with_standard_deviations():
    for one in standard_fit().estimates[:3]:
        assert one.profile_interval is not None
        for end, other in zip(one.profile_interval, one.interval, strict=True):
            assert end == pytest.approx(other, abs=0.1 * one.sd)


def test_the_fitted_case_gives_the_simulated_angles():
    fit = standard_fit()
    recording = simulate(fit.case.figure, replace(fit.case.plan, tolerance=1e-8))
    np.testing.assert_allclose(recording.displacements["left_knee"], fit.simulated, atol=1e-5)
    np.testing.assert_allclose(fit.residuals, fit.simulated - swing().angles)


def test_the_bias_of_the_runs_is_small():
    fit = standard_fit()
    assert fit.accuracy.step is None
    assert max(abs(one.bias) for one in fit.estimates) < MAX_BIAS


def test_a_wrong_mass_moves_the_estimates_as_stated_and_leaves_the_residuals():
    fit, case = standard_fit(), leg_case()
    heavier = replace(case, figure=_scale_masses(case.figure, 1.05))
    other = fit_springs(heavier, swing(), paths(*TRUTH), ALONE)
    assert other.tests.rms == pytest.approx(fit.tests.rms, rel=1e-4)
    for one, moved in zip(fit.estimates, other.estimates, strict=True):
        assert one.mass_slope is not None
        assert moved.value - one.value == pytest.approx(0.05 * one.mass_slope, abs=0.1 * one.sd)
    assert fit.estimates[0].mass_percent == pytest.approx(1.0, abs=0.01)
    assert fit.estimates[2].mass_percent == pytest.approx(1.0, abs=0.01)


def test_noise_of_the_first_sample_does_not_bias_the_fit():
    data = swing()
    angles = data.angles.copy()
    angles[0] += 6.0 * NOISE
    moved = fit_springs(leg_case(), replace(data, angles=angles), paths(*TRUTH), ALONE)
    for one, other in zip(standard_fit().estimates[:3], moved.estimates, strict=False):
        assert abs(other.value - one.value) < 0.5 * one.sd + 0.5 * other.sd


def test_a_start_angle_that_is_set_stays():
    case = leg_case()
    plan = replace(case.plan, displacements={"left_knee": (np.radians(50.0),)})
    fit = fit_springs(replace(case, plan=plan), swing(), paths(SCALE, VISCOUS), ALONE)
    assert list(fit.values) == [SCALE, VISCOUS]
    named = fit_springs(case, swing(), paths(SCALE, START), ALONE)
    assert list(named.values) == [SCALE, START]
    assert not named.estimates[1].is_start


def test_mass_and_stiffness_together_are_refused():
    mass = "segments.shank.mass"
    with pytest.raises(ModelError) as caught:
        fit_springs(leg_case(), swing(), paths(SCALE, VISCOUS, mass), ALONE)
    message = str(caught.value)
    assert f"does not determine {SCALE}, {VISCOUS} and {mass} together" in message
    assert "the changes +10 %, +10 % and +10 % leave the angles as they are" in message
    assert f"measure the mass and leave out {mass}" in message


def test_a_quantity_without_effect_is_refused():
    case = leg_case()
    weightless = replace(case, plan=replace(case.plan, gravity=(0.0, 0.0, 0.0)))
    with pytest.raises(ModelError, match="gravity does not change the measured angles"):
        fit_springs(weightless, swing(), paths(SCALE, "gravity"), ALONE)


def test_a_coarse_step_is_detected():
    options = replace(ALONE, step=0.02)
    coarse = fit_springs(leg_case(), swing(), paths(*TRUTH), options)
    worst = max(coarse.estimates, key=lambda one: abs(one.bias))
    assert abs(worst.bias) > 1.0
    fine = next(one for one in standard_fit().estimates if one.path == worst.path)
    assert worst.value + worst.bias * worst.sd == pytest.approx(fine.value, abs=0.5 * fine.sd)


def test_failed_runs_are_survived():
    # A start at which nothing moves the leg far enough: the nominal damping is beyond its range.
    case = leg_case()
    limited = replace(case, plan=replace(case.plan, wall_limit=1e-9))
    with pytest.raises(MoverError, match="no run reaches the last sample: the wall-time limit"):
        fit_springs(limited, swing(), paths(SCALE), ALONE)


def test_stated_noise_scales_the_standard_deviations():
    options = replace(ALONE, sd=2.0 * NOISE)
    stated = fit_springs(leg_case(), swing(), paths(*TRUTH), options)
    free = standard_fit()
    for one, other in zip(stated.estimates, free.estimates, strict=True):
        assert one.sd / other.sd == pytest.approx(2.0 * NOISE / free.noise_sd, rel=1e-3)
    assert stated.tests.misfit is not None
    assert stated.tests.misfit > 0.999


def test_wrong_choices_are_refused():
    case = leg_case()
    with pytest.raises(UsageError, match="2 angles cannot determine 2 unknowns"):
        fit_springs(case, swing().between(0.0, 0.02), paths(SCALE))
    with pytest.raises(UsageError, match="fitted twice"):
        fit_springs(case, swing(), paths(SCALE, SCALE))
    with pytest.raises(UsageError, match="nothing to fit"):
        fit_springs(case, swing(), [])
    with pytest.raises(UsageError, match="one start or more"):
        FitOptions(starts=0)
    with pytest.raises(UsageError, match="the sd of a fit must be positive"):
        FitOptions(sd=0.0)
    locked = replace(case, plan=replace(case.plan, locked=("left_knee",)))
    with pytest.raises(UsageError, match="locked or prescribed"):
        fit_springs(locked, swing(), paths(SCALE))
    assert OFFSET in TRUTH
