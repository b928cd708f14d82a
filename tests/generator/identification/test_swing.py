"""Numbers of a swing, against the closed forms of a damped oscillator."""

from collections.abc import Callable, Mapping, Sequence
from math import exp, pi, radians, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import savgol_filter

from generator.identification.swing import Swing, smooth_swing
from springs.backends import Array


def damped(ratio: float, natural: float, start: float, rest: float, stop: float = 20.0) -> Swing:
    """Linear oscillator with a damping ratio and a natural angular frequency [rad/s]."""
    times = np.linspace(0.0, stop, round(200.0 * stop) + 1)
    decay, angular = ratio * natural, natural * sqrt(1.0 - ratio**2)
    fade = np.exp(-decay * times)
    shape = fade * (np.cos(angular * times) + decay / angular * np.sin(angular * times))
    rate = -fade * natural**2 / angular * np.sin(angular * times)
    return Swing(times, rest + (start - rest) * shape, (start - rest) * rate)


@given(
    ratio=st.floats(0.07, 0.4),
    natural=st.floats(4.0, 8.0),
    start=st.floats(-2.0, -0.1),
    rest=st.floats(0.1, 2.0),
)
def test_a_damped_oscillator(ratio: float, natural: float, start: float, rest: float) -> None:
    swing = damped(ratio, natural, start, rest)
    angular = natural * sqrt(1.0 - ratio**2)
    overshoot = exp(-pi * ratio / sqrt(1.0 - ratio**2))
    assert swing.rest == pytest.approx(rest, abs=1e-3)
    assert swing.relaxation_index == pytest.approx(1.0 + overshoot, rel=1e-3)
    assert swing.turning_times[:2] == pytest.approx([pi / angular, 2.0 * pi / angular], rel=1e-3)
    assert swing.turning_angles[1] == pytest.approx(
        rest + (start - rest) * overshoot**2, abs=1e-3 * (rest - start)
    )
    assert swing.period(1) == pytest.approx(2.0 * pi / angular, rel=1e-3)
    peak = natural * exp(-ratio / sqrt(1.0 - ratio**2) * np.arccos(ratio))
    assert swing.peak_rates[0] == pytest.approx((rest - start) * peak, rel=2e-3)
    assert swing.peak_rates[1] == pytest.approx((rest - start) * peak * overshoot, rel=2e-3)


def test_the_number_of_swings_is_that_of_peaks_beyond_an_amplitude() -> None:
    """Peaks decay as 0.5 exp(-(2 k + 1) pi z): the last above 0.05 is the fourth."""
    ratio = 0.1
    swing = damped(ratio, 2.0 * pi, 0.5, 0.0)
    peaks = [0.5 * exp(-(2 * k + 1) * pi * ratio / sqrt(1.0 - ratio**2)) for k in range(9)]
    assert swing.swings(0.05) == sum(peak > 0.05 for peak in peaks) == 4
    assert swing.swings(0.6) == 0


def test_without_damping_the_index_is_two_and_the_swings_go_on() -> None:
    times = np.linspace(0.0, 2.0, 2001)
    swing = Swing(times, 1.0 - np.cos(5.0 * times), 5.0 * np.sin(5.0 * times))
    assert swing.relaxation_index == pytest.approx(2.0, abs=1e-5)
    assert np.isnan(swing.period(5))
    with pytest.raises(ValueError, match="goes on"):
        swing.swings(0.1)


@pytest.mark.parametrize(("rate", "message"), [(1.0, "begins at rest"), (0.0, "turning points")])
def test_what_is_not_a_swing(rate: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Swing(np.arange(3.0), np.zeros(3), np.array([rate, 1.0, 1.0]))


def angle_samples(
    ratio: float,
    natural: float,
    start: float,
    rest: float,
    *,
    rate: float = 50.0,
    stop: float = 10.0,
    release: float = 0.0,
) -> tuple[Array, Array]:
    """Samples a second of the oscillator's angle, fixed at its start until it is released."""
    times = np.arange(round(stop * rate) + 1) / rate
    swung = np.maximum(times - release, 0.0)
    decay, angular = ratio * natural, natural * sqrt(1.0 - ratio**2)
    shape = np.cos(angular * swung) + decay / angular * np.sin(angular * swung)
    return times, rest + (start - rest) * np.exp(-decay * swung) * shape


NOISE = radians(0.5)

QUANTITIES: Mapping[str, Callable[[Swing], float]] = {
    "start": lambda swing: swing.start,
    "rest": lambda swing: swing.rest,
    "first swing": lambda swing: swing.first_swing,
    "relaxation index": lambda swing: swing.relaxation_index,
    "period": lambda swing: swing.period(1),
    "peak rate": lambda swing: float(swing.peak_rates[0]),
}


def numbers(swing: Swing) -> Array:
    return np.array([quantity(swing) for quantity in QUANTITIES.values()])


KNEE = (0.07, 5.7, 0.0, radians(65.0))
"""Damping ratio, natural angular frequency [rad/s], start and rest [rad] of an oscillator."""


@given(
    ratio=st.floats(0.05, 0.15),
    natural=st.floats(4.5, 7.0),
    start=st.floats(-0.5, 0.5),
    drop=st.floats(0.8, 1.3),
    sign=st.sampled_from((-1.0, 1.0)),
    seed=st.integers(0, 1000),
)
def test_measured_angles_have_the_numbers_of_the_closed_form(
    ratio: float, natural: float, start: float, drop: float, sign: float, seed: int
) -> None:
    times, angles = angle_samples(ratio, natural, start, start + sign * drop)
    noise = np.random.default_rng(seed).normal(0.0, NOISE, len(angles))
    measured = smooth_swing(times, angles + noise)
    overshoot = exp(-pi * ratio / sqrt(1.0 - ratio**2))
    assert measured.noise == pytest.approx(NOISE, rel=0.2)
    assert measured.swing.start == pytest.approx(start, abs=4.0 * NOISE)
    assert measured.swing.rest == pytest.approx(start + sign * drop, abs=4.0 * NOISE)
    assert measured.swing.first_swing == pytest.approx(
        sign * drop * (1.0 + overshoot), abs=4.0 * NOISE
    )
    assert measured.swing.relaxation_index == pytest.approx(1.0 + overshoot, abs=0.06)
    angular = natural * sqrt(1.0 - ratio**2)
    assert measured.swing.period(1) == pytest.approx(2.0 * pi / angular, rel=0.05)


def test_smoothing_bends_the_numbers_by_less_than_the_noise() -> None:
    times, angles = angle_samples(*KNEE)
    assert smooth_swing(times, angles).noise < 0.05 * NOISE
    ratio, natural, start, rest = KNEE
    exact = numbers(damped(ratio, natural, start, rest))
    assert numbers(smooth_swing(times, angles).swing) == pytest.approx(exact, rel=3e-3, abs=1.5e-3)


def test_smoothed_angles_are_those_of_savitzky_and_golay() -> None:
    times, angles = angle_samples(*KNEE)
    noisy = angles + np.random.default_rng(1).normal(0.0, NOISE, len(angles))
    swing = smooth_swing(times, noisy).swing
    values, slopes = (savgol_filter(noisy, 11, 3, deriv=k, delta=0.02) for k in range(2))
    assert swing.angles[6:] == pytest.approx(values[6:], abs=1e-12)
    assert swing.rates[6:] == pytest.approx(slopes[6:], abs=1e-10)


def test_uncertainties_are_the_scatter_over_records() -> None:
    """The chi-squared ratio of 60 records and 100 resamples lies between 0.6 and 1.6."""
    times, angles = angle_samples(*KNEE)
    rng = np.random.default_rng(5)
    records = [smooth_swing(times, angles + rng.normal(0.0, NOISE, len(angles))) for _ in range(60)]
    scatter = np.std([numbers(record.swing) for record in records], axis=0, ddof=1)
    estimated = records[0].uncertainties(QUANTITIES)
    assert list(estimated) == list(QUANTITIES)
    ratios = np.array(list(estimated.values())) / scatter
    assert 0.6 < ratios.min() < ratios.max() < 1.6
    assert records[0].uncertainties(QUANTITIES) == estimated
    assert records[0].uncertainties(QUANTITIES, seed=1) != estimated


def test_an_uncertainty_of_a_missing_number_is_nan() -> None:
    measured = smooth_swing(*angle_samples(*KNEE, stop=4.0))
    found = measured.uncertainties(
        {"swings": lambda swing: swing.swings(radians(2.0)), "periods": lambda s: s.period(9)}
    )
    assert np.isnan(list(found.values())).all()


def test_the_mirror_image_of_a_record_swings_as_the_mirror_image() -> None:
    times, angles = angle_samples(*KNEE)
    noisy = angles + np.random.default_rng(3).normal(0.0, NOISE, len(angles))
    one, other = smooth_swing(times, noisy).swing, smooth_swing(times, -noisy).swing
    assert other.turning_times == pytest.approx(one.turning_times, rel=1e-12)
    signs = np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
    assert numbers(other) == pytest.approx(signs * numbers(one), rel=1e-9)
    assert other.swings(radians(3.0)) == one.swings(radians(3.0))


def test_the_time_of_the_first_sample_does_not_matter() -> None:
    times, angles = angle_samples(*KNEE)
    noisy = angles + np.random.default_rng(4).normal(0.0, NOISE, len(angles))
    early, late = smooth_swing(times, noisy).swing, smooth_swing(times + 1000.0, noisy).swing
    assert numbers(late) == pytest.approx(numbers(early), rel=1e-8)
    assert late.turning_times == pytest.approx(early.turning_times + 1000.0, abs=1e-8)


@pytest.mark.parametrize("release", [0.5, 1.7])
def test_a_joint_may_rest_before_its_release(release: float) -> None:
    _, angles = angle_samples(*KNEE)
    times, waited = angle_samples(*KNEE, release=release, stop=10.0 + release)
    noise = np.random.default_rng(6).normal(0.0, NOISE, len(times))
    directly = smooth_swing(times[: len(angles)], angles + noise[-len(angles) :]).swing
    later = smooth_swing(times, waited + noise).swing
    assert len(later.turning_times) == len(directly.turning_times)
    assert later.turning_times - release == pytest.approx(directly.turning_times, abs=1e-3)
    assert later.relaxation_index == pytest.approx(directly.relaxation_index, abs=0.03)


@pytest.mark.parametrize("late", [-1.0, -0.5, 0.5, 1.5, 2.0, 4.5])
def test_a_release_beside_the_first_sample_does_not_bias_the_numbers(late: float) -> None:
    """It is some samples late, or early; over 20 records the mean error is 0.22 sd of one."""
    times, angles = angle_samples(*KNEE, release=late / 50.0)
    exact = numbers(damped(*KNEE))
    records = [
        smooth_swing(times, angles + np.random.default_rng(seed).normal(0.0, NOISE, len(angles)))
        for seed in range(20)
    ]
    errors = np.mean([numbers(record.swing) - exact for record in records], axis=0)
    sd = np.array(list(records[0].uncertainties(QUANTITIES).values()))
    assert np.abs(errors / sd).max() < 0.9


def test_noise_at_rest_makes_no_turning_point() -> None:
    """After 30 s the oscillator stands still to 1e-4 deg."""
    times, angles = angle_samples(*KNEE, stop=30.0)
    for seed in range(5):
        noise = np.random.default_rng(seed).normal(0.0, NOISE, len(angles))
        swing = smooth_swing(times, angles + noise).swing
        assert swing.turning_times[-1] < 10.0
        assert np.all(np.abs(np.diff(swing.turning_angles)) > swing.least_move)


REFUSED: Sequence[tuple[Callable[[Array, Array], tuple[Array, Array]], str]] = (
    (lambda t, a: (t[:13], a[:13]), "14 samples"),
    (lambda t, a: (t[:60], a[:60]), "turning points: record it for longer"),
    (lambda t, a: (t[:300:5], a[:300:5]), "30 are needed"),
    (lambda t, a: (t[5:] - t[5], a[5:]), "already moves"),
    (lambda t, a: (t, 0.0 * a + 0.5), "does not move"),
    (lambda t, a: (t**1.01, a), "not evenly spaced"),
    (lambda t, a: (0.0 * t, a), "not evenly spaced"),
    (lambda t, a: (t / 100.0, a), "shorter than 0.2 s"),
)


@pytest.mark.parametrize(("change", "message"), REFUSED)
def test_records_that_are_refused(
    change: Callable[[Array, Array], tuple[Array, Array]], message: str
) -> None:
    times, angles = angle_samples(*KNEE)
    noisy = angles + np.random.default_rng(0).normal(0.0, NOISE, len(angles))
    with pytest.raises(ValueError, match=message):
        smooth_swing(*change(times, noisy))
