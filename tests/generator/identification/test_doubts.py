"""Doubts about fits whose model is wrong, or whose data say too little."""

from dataclasses import replace

import numpy as np
import pytest

from generator.identification.comparison import RELEASE
from generator.identification.doubts import fit_doubts
from generator.identification.fit import Fit, fit_springs
from generator.identification.measured_angles import MeasuredAngles
from generator.identification.whiteness import check_residuals
from generator.simulation.run import simulate
from generator.study.parameter_paths import Case, parse_path
from generator.study.parameters import apply_values
from springs import total_torque
from springs.interpolated import Interpolated
from tests.swings import (
    ALONE,
    COULOMB,
    NOISE,
    OFFSET,
    SCALE,
    TRUTH,
    VISCOUS,
    coarse_fit,
    leg_case,
    paths,
    standard_fit,
    swing,
)


def with_stated_noise(fit: Fit, sd: float) -> Fit:
    """The fit with another stated noise, whose residuals are the same."""
    tests = check_residuals(fit.residuals, len(fit.estimates), sd)
    return replace(fit, options=replace(fit.options, sd=sd), tests=tests)


def doubts_beside_tails(fit: Fit) -> tuple[str, ...]:
    """The doubts without those about tails of the law, which a right model has as well."""
    return fit_doubts(replace(fit, tails=()))


@pytest.mark.slow
def test_a_good_fit_has_none_beside_those_about_tails():
    assert doubts_beside_tails(standard_fit()) == ()
    assert doubts_beside_tails(with_stated_noise(standard_fit(), NOISE)) == ()


def stiffer_tail(first: float, last: float, share: float) -> Case:
    """The leg, whose torque grows by a share between two angles [deg] and stays so beyond."""
    case = leg_case()
    own = case.springs.joints["left_knee"]
    (axis,) = own.axes
    angles = np.radians(np.linspace(-90.0, 90.0, 181))
    part = np.clip((np.degrees(angles) - first) / (last - first), 0.0, 1.0)
    torques = share * part * np.asarray(total_torque(axis.elastic, angles))
    extra = Interpolated(tuple(zip(angles.tolist(), torques.tolist(), strict=True)))
    changed = replace(own, axes=(replace(axis, elastic=(*axis.elastic, extra)),))
    springs = replace(case.springs, joints={"left_knee": changed})
    return case.with_springs(springs)


@pytest.mark.parametrize(
    ("first", "last", "tail"), [(30.0, 31.0, "32 and 50"), (-10.0, -11.0, "-34 and -21")]
)
def test_a_tail_that_is_3_percent_off_raises_a_doubt(first: float, last: float, tail: str):
    """The residuals show nothing, and the scale is off by more than five standard deviations."""
    case = apply_values(
        stiffer_tail(first, last, 0.03),
        [(parse_path(text, leg_case()), value) for text, value in TRUTH.items()],
    )
    run = simulate(case.model, replace(case.plan, stop=3.0, tolerance=1e-9))
    angles = run.displacements["left_knee"]
    angles = angles + NOISE * np.random.default_rng(1).standard_normal(angles.shape)
    data = MeasuredAngles("swing.csv", run.times, (("left_knee", 0),), angles)
    fit = fit_springs(leg_case(), data, paths(*TRUTH), ALONE)
    scale = fit.estimates[0]
    assert (scale.value - TRUTH[SCALE]) / scale.sd > 5.0
    assert not fit.tests.are_autocorrelated
    found = [one for one in fit_doubts(fit) if f"on the law of left_knee between {tail} deg" in one]
    assert len(found) == 1
    assert found[0].startswith(SCALE)
    assert "% of the torque at its end moves springs.left_knee.scale by" in found[0]


def test_a_tail_that_moves_no_estimate_by_its_sd_is_not_named():
    fit = standard_fit()
    small = tuple(
        replace(tail, changes=tuple(0.9 * one.sd for one in fit.estimates)) for tail in fit.tails
    )
    assert small
    assert fit_doubts(replace(fit, tails=small)) == ()


def test_a_tail_beyond_the_measured_range_of_the_law_is_called_extrapolated():
    fit = standard_fit()
    tail = replace(fit.tails[0], known=(np.radians(-25.0), np.radians(60.0)))
    found = "".join(fit_doubts(replace(fit, tails=(tail,))))
    assert "deg, where it is extrapolated (known from -25 to 60 deg)" in found


def test_estimates_that_the_release_alone_correlates_are_not_named():
    fit = standard_fit()
    first, second, *_ = fit.estimates
    release = replace(fit.estimates[-1], path=RELEASE)
    correlations = np.array([[1.0, 0.96, 0.97], [0.96, 1.0, 0.97], [0.97, 0.97, 1.0]])
    three = replace(fit, estimates=(first, second, release), correlations=correlations, tails=())
    assert fit_doubts(three) == ()
    correlations = np.array([[1.0, 0.96, 0.0], [0.96, 1.0, 0.0], [0.0, 0.0, 1.0]])
    (found,) = fit_doubts(replace(three, correlations=correlations))
    assert found.endswith("(correlation 0.960): leave out one of them")


def test_a_noise_that_is_too_small_or_too_large_is_named():
    (small,) = doubts_beside_tails(with_stated_noise(standard_fit(), 0.5 * NOISE))
    (large,) = doubts_beside_tails(with_stated_noise(standard_fit(), 2.0 * NOISE))
    assert "the residuals are 1." in small or "the residuals are 2." in small
    assert "the model does not explain the data" in small
    assert "which is too large" in large


def test_a_law_that_is_missing_shows_in_the_residuals():
    data = swing({**TRUTH, COULOMB: 0.3})
    found = fit_doubts(fit_springs(leg_case(), data, paths(SCALE, VISCOUS), ALONE))
    assert "successive residuals are alike" in found[0]
    assert "the intervals are too narrow, by a factor of" in found[0]


@pytest.mark.slow
def test_a_coarse_step_is_named_with_its_bias():
    found = fit_doubts(coarse_fit())
    assert "of its standard deviations by the step of 0.02 s, which is too long" in found[0]


def test_damping_and_friction_from_one_swing_are_named():
    data = swing({**TRUTH, COULOMB: 0.1}, stop=1.0)
    found = fit_doubts(fit_springs(leg_case(), data, paths(VISCOUS, COULOMB), ALONE))
    assert "one swing hardly separates damping from friction" in "".join(found)


def test_an_estimate_at_its_bound_is_named():
    fit = standard_fit()
    at_bound = tuple(replace(one, at_bound=one.path == VISCOUS) for one in fit.estimates)
    (found,) = doubts_beside_tails(replace(fit, estimates=at_bound))
    assert found.startswith(f"{VISCOUS} is at its smallest value")


@pytest.mark.slow
def test_exact_data_are_not_called_wrong():
    data = swing(noise=0.0)
    fit = fit_springs(leg_case(), data, paths(SCALE, VISCOUS, OFFSET), ALONE)
    assert doubts_beside_tails(fit) == ()
    (found,) = doubts_beside_tails(with_stated_noise(fit, NOISE))
    assert "which is too large" in found


@pytest.mark.parametrize("rms", [None, 0.1])
def test_a_start_that_ends_elsewhere_is_named(rms: float | None):
    fit = standard_fit()
    starts = (fit.starts[0], replace(fit.starts[1], rms=rms, is_best=False))
    (found,) = doubts_beside_tails(replace(fit, starts=starts))
    assert found.startswith("1 of 2 starts found the least sum of squares")


def with_residuals(fit: Fit, residuals: np.ndarray) -> Fit:
    """The fit with other residuals, shape (n, k)."""
    tests = check_residuals(residuals, len(fit.estimates), None)
    return replace(fit, simulated=fit.data.angles + residuals, tests=tests)


def test_residuals_as_large_as_the_motion_are_the_first_doubt():
    fit = standard_fit()
    found = fit_doubts(with_residuals(fit, fit.data.angles.mean() - fit.data.angles))
    assert found[0].startswith("the model explains hardly any of the motion: rms residual ")
    assert "successive residuals are alike" in found[1]


def test_residuals_that_alternate_are_a_doubt():
    fit = standard_fit()
    signs = np.where(np.arange(len(fit.residuals)) % 2, 1.0, -1.0)[:, None]
    (found,) = doubts_beside_tails(with_residuals(fit, fit.residuals + NOISE * signs))
    assert "successive residuals are not independent (autocorrelation -0." in found
    assert "the intervals are wrong" in found


def test_a_step_longer_than_a_frame_is_that_of_the_frame():
    fit = coarse_fit()
    (found, *_) = fit_doubts(replace(fit, accuracy=replace(fit.accuracy, step=5.0)))
    assert "by the step of 0.02 s, which is too long" in found
