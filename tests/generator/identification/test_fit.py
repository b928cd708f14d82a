"""Fits to swings whose springs are known."""

from dataclasses import replace
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from generator.diagnostics import ModelError, UsageError
from generator.figure_file import FIGURE_FILE
from generator.identification.comparison import RELEASE, _scale_masses
from generator.identification.fit import (
    HELD_TIME,
    MAX_BIAS,
    Fit,
    FitOptions,
    UnfinishedFitError,
    fit_springs,
    start_angles,
)
from generator.identification.measured_angles import MeasuredAngles
from generator.model import Model
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.springs_file.edit import springs_from_text
from generator.study.parameter_paths import Case, parse_path
from generator.study.parameters import apply_values
from tests.swings import (
    ALONE,
    COULOMB,
    NOISE,
    SCALE,
    TRUTH,
    VISCOUS,
    coarse_fit,
    fitted,
    leg_case,
    paths,
    standard_fit,
    swing,
)

START = "pose.left_knee"

FREE = replace(ALONE, release=None)


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
    recording = simulate(fit.case.model, replace(fit.case.plan, tolerance=1e-8))
    np.testing.assert_allclose(recording.displacements["left_knee"], fit.simulated, atol=1e-5)
    np.testing.assert_allclose(fit.residuals, fit.simulated - swing().angles)


def test_the_bias_of_the_runs_is_small():
    fit = standard_fit()
    assert fit.accuracy.step is None
    assert max(abs(one.bias) for one in fit.estimates) < MAX_BIAS


def test_a_wrong_mass_moves_the_estimates_as_stated_and_leaves_the_residuals():
    fit, case = standard_fit(), leg_case()
    heavier = _scale_masses(case, 1.05)
    other = fit_springs(heavier, swing(), paths(*TRUTH), ALONE)
    assert other.tests.rms == pytest.approx(fit.tests.rms, rel=1e-4)
    for one, moved in zip(fit.estimates, other.estimates, strict=True):
        assert one.mass_slope is not None
        assert moved.value - one.value == pytest.approx(0.05 * one.mass_slope, abs=0.1 * one.sd)
    for one in (fit.estimates[0], fit.estimates[2]):
        assert one.mass_slope == pytest.approx(one.value, rel=0.01)


def test_noise_of_the_first_sample_does_not_bias_the_fit():
    data, case = swing(), leg_case()
    angles = data.angles.copy()
    angles[0] = np.radians(50.0) + 3.0 * NOISE
    data = replace(data, angles=angles)
    moved = fit_springs(case, data, paths(*TRUTH), ALONE)
    plan = replace(case.plan, displacements={"left_knee": (float(angles[0, 0]),)})
    trusted = fit_springs(replace(case, plan=plan), data, paths(*TRUTH), ALONE)
    assert list(trusted.values) == list(TRUTH)

    def errors(fit) -> np.ndarray:
        return np.array([(one.value - TRUTH[one.path]) / one.sd for one in fit.estimates[:3]])

    assert np.abs(errors(moved)).max() < 3.0
    assert np.abs(errors(trusted)).max() > 5.0


def test_a_start_angle_of_a_posture_is_estimated():
    case, data = leg_case(), swing()
    case = replace(case, plan=replace(case.plan, displacements={"left_knee": (0.5,)}))
    angles = data.angles[0]
    estimated = start_angles(case, data, paths(SCALE), known=(), angles=angles)
    assert [str(one.path) for one in estimated] == [START]
    assert estimated[0].nominal == pytest.approx(np.degrees(data.angles[0, 0]))
    assert start_angles(case, data, paths(SCALE), ("left_knee",), angles) == []


def test_a_start_angle_that_is_named_is_a_quantity():
    named = fitted((SCALE, START))
    assert list(named.values) == [SCALE, START]
    assert not named.estimates[1].is_start


def test_mass_and_stiffness_together_are_refused():
    mass = "segments.shank.mass"
    with pytest.raises(ModelError) as caught:
        fitted((SCALE, VISCOUS, mass))
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
    coarse = coarse_fit()
    worst = max(coarse.estimates, key=lambda one: abs(one.bias))
    assert abs(worst.bias) > 1.0
    fine = next(one for one in standard_fit().estimates if one.path == worst.path)
    assert worst.value + worst.bias * worst.sd == pytest.approx(fine.value, abs=0.5 * fine.sd)


INVERTED = """
figure pole {
  segment ground { mass = -1kg; site top->location = trans(0,0,0); }
  segment pole {
    mass = 4kg;
    inertia = (0.1 kg m2,0.1 kg m2,0.1 kg m2);
    site foot->location = trans(0,0,0);
    site CM->location = trans(0cm,30cm,0cm);
  }
  joint foot {
    connect ground.top to pole.foot;
    type = R(1,0,0)*R(0,1,0)*R(0,0,1);
    displacement = (10deg,0deg,5deg);
    stiff = (4 N m/rad,4 N m/rad,4 N m/rad);
    damp = (0.01 N m s/rad,0.01 N m s/rad,0.01 N m s/rad);
  }
  root = ground.top;
}
"""


def test_failed_runs_are_survived():
    figure = FIGURE_FILE.parse_text(INVERTED).require_value()
    springs = springs_from_text("", figure, Path("pole.springs.toml"))
    case = Case(Model(figure, springs), Plan(stop=1.2))
    scale = parse_path("springs.foot.scale", case)
    stiff = apply_values(case, [(scale, 4.0)])
    recording = simulate(stiff.model, replace(stiff.plan, tolerance=1e-6))
    noise = 0.01 * np.random.default_rng(0).standard_normal((len(recording.times), 3))
    columns = tuple(("foot", k) for k in range(3))
    angles = recording.displacements["foot"] + noise
    data = MeasuredAngles("sway", recording.times, columns, angles)
    assert not simulate(case.model, case.plan).outcome.succeeded  # it falls over
    fit = fit_springs(case, data, [scale], replace(ALONE, starts=2))
    assert fit.failed_runs > 0
    assert fit.estimates[0].value == pytest.approx(4.0, abs=4.0 * fit.estimates[0].sd)
    assert [one.path for one in fit.estimates[1:]] == [f"pose.foot.{k}" for k in (1, 2, 3)]


def test_stated_noise_scales_the_standard_deviations():
    stated, free = fitted(options=replace(ALONE, sd=2.0 * NOISE)), standard_fit()
    for one, other in zip(stated.estimates, free.estimates, strict=True):
        assert one.sd / other.sd == pytest.approx(2.0 * NOISE / free.noise_sd, rel=1e-3)
    assert stated.tests.misfit is not None
    assert stated.tests.misfit > 0.999


def test_wrong_choices_are_refused():
    case = leg_case()
    with pytest.raises(UsageError, match="2 angles cannot determine 3 unknowns"):
        fit_springs(case, swing().between(0.0, 0.02), paths(SCALE))
    with pytest.raises(UsageError, match="fitted twice"):
        fit_springs(case, swing(), paths(SCALE, SCALE))
    with pytest.raises(UsageError, match="nothing to fit"):
        fit_springs(case, swing(), [])
    with pytest.raises(UsageError, match="one start or more"):
        FitOptions(starts=0)
    with pytest.raises(UsageError, match="the sd of a fit must be positive"):
        FitOptions(sd=0.0)
    with pytest.raises(UsageError, match="the release of a fit must be finite"):
        FitOptions(release=float("nan"))
    locked = replace(case, plan=replace(case.plan, locked=("left_knee",)))
    with pytest.raises(UsageError, match="locked or prescribed"):
        fit_springs(locked, swing(), paths(SCALE))


def held_swing(release: float, seed: int = 2, stop: float = 3.0) -> MeasuredAngles:
    """A swing that is sampled from 0 s on, whose release may lie before, between and after."""
    times = np.arange(round(stop / 0.02) + 1) * 0.02
    fine = swing(noise=0.0, frame=0.005, stop=stop + 1.0)
    curve = CubicSpline(fine.times, fine.angles[:, 0])
    angles = curve(np.maximum(times - release, 0.0))
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(times))
    return MeasuredAngles("held.csv", times, (("left_knee", 0),), (angles + noise)[:, None])


@pytest.mark.parametrize("release", [-0.04, -0.013, 0.0, 0.027, 0.04, 0.731])
def test_the_release_does_not_bias_the_estimates(release: float):
    """It may be two samples off, between samples, or after a time in which the leg is held."""
    fit = fit_springs(leg_case(), held_swing(release), paths(*TRUTH), FREE)
    truth = {**TRUTH, START: 50.0, RELEASE: release}
    assert list(fit.values) == list(truth)
    assert fit.release == fit.values[RELEASE]
    for one in fit.estimates:
        assert abs(one.value - truth[one.path]) < 3.0 * one.sd, one.path
    assert fit.estimates[-1].sd < 0.003
    assert fit.data.times[0] >= release - HELD_TIME - 0.04
    assert not fit.tests.are_autocorrelated


def test_a_release_that_is_stated_wrongly_biases_the_estimates():
    data = held_swing(0.027)
    wrong = fit_springs(leg_case(), data, paths(*TRUTH), ALONE)
    assert abs(wrong.estimates[0].value - TRUTH[SCALE]) > 5.0 * wrong.estimates[0].sd
    right = fit_springs(leg_case(), data, paths(*TRUTH), replace(ALONE, release=0.027))
    assert right.data.times[0] == pytest.approx(0.04)
    assert abs(right.estimates[0].value - TRUTH[SCALE]) < 3.0 * right.estimates[0].sd


def test_with_rates_the_release_is_the_first_sample():
    case, data = leg_case(), swing().between(0.0, 1.0)
    fit = fit_springs(case, data, paths(SCALE, "velocity.left_knee"), FREE)
    assert RELEASE not in fit.values
    assert fit.release == 0.0


def fit_with_time_for(runs: int, patch: pytest.MonkeyPatch, options: FitOptions = ALONE) -> Fit:
    """Fit with a clock that passes the deadline during the n-th run."""
    done, deadline = count(), 1e6
    latest = -1

    def watch() -> None:
        nonlocal latest
        latest = next(done)

    clock = SimpleNamespace(monotonic=lambda: 0.0 if latest + 1 < runs else deadline)
    patch.setattr("generator.identification.comparison.time", clock)
    return fit_springs(leg_case(), swing(), paths(*TRUTH), options, watch, deadline=deadline)


def test_a_deadline_ends_a_fit_with_what_is_known(monkeypatch: pytest.MonkeyPatch):
    whole = standard_fit()
    with pytest.raises(UnfinishedFitError, match="nothing is known yet") as caught:
        fit_with_time_for(0, monkeypatch)
    assert caught.value.values == {}
    with pytest.raises(UnfinishedFitError, match="after 30 runs, before any uncertainty") as caught:
        fit_with_time_for(30, monkeypatch)
    assert list(caught.value.values) == [*TRUTH, START]
    assert caught.value.values[SCALE] == pytest.approx(TRUTH[SCALE], abs=0.1)
    late = fit_with_time_for(whole.runs - 3, monkeypatch, whole.options)
    assert late.unfinished.endswith(f"the profiles of {VISCOUS} are missing")
    assert [one.profile is None for one in late.estimates] == [False, False, True, True]
    assert late.values == whole.values


def test_an_interval_by_profile_ends_at_the_smallest_value():
    data = swing({**TRUTH, VISCOUS: 0.0, COULOMB: 0.0}, stop=1.0)
    options = FitOptions(starts=1, sd=NOISE, release=0.0)
    fit = fit_springs(leg_case(), data, paths(COULOMB), options)
    (one, _) = fit.estimates
    assert one.profile_interval is not None
    low, high = one.profile_interval
    assert low == 0.0
    assert high is not None


def test_a_fit_from_python_needs_figure_data_and_words():
    from generator import read_figure, read_measured_angles
    from tests.paths import ROOT

    leg = read_figure("leg")
    measured, warnings = read_measured_angles(ROOT / "figures/leg_swing.csv", leg)
    words = ["springs.knee.scale", "springs.knee.viscous_Nms_rad"]
    fit = fit_springs(
        Case(Model.of(leg), Plan()), measured.between(0.0, 0.5), words, replace(ALONE, step=0.01)
    )
    assert warnings == ()
    assert [one.path for one in fit.estimates] == [*words, "pose.knee"]
    assert fit.release == 0.0
    assert fit.tests.rms < np.radians(2.0)


def test_a_fit_shows_its_estimates():
    fit = fitted()
    page = fit._repr_html_()
    assert page.count("<tr>") == 1 + len(fit.estimates)
    one = fit.estimates[0]
    assert f"<td>{one.path}</td><td>{one.unit}</td><td>{one.value:.4g}</td>" in page
