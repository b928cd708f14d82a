"""Numbers of a swing, against the closed forms of a damped oscillator."""

from math import exp, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plots.pendulum import Swing


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
