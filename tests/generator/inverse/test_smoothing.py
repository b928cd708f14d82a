"""The filter, and splines of measured displacements."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, freqz_sos

from generator.diagnostics import InputError
from generator.inverse.smoothing import low_pass, smooth_motion
from tests.motions import any_motion, slides

RATE, CUTOFF = 100.0, 6.0


@pytest.mark.parametrize("frequency", [1.0, 3.0, 6.0, 9.0])
def test_a_sine_has_the_gain_of_both_passes_and_no_delay(frequency: float):
    times = np.arange(0.0, 10.0, 1.0 / RATE)
    wave = np.sin(2.0 * np.pi * frequency * times)
    found = low_pass(wave[:, None], 1.0 / RATE, CUTOFF)[:, 0]
    sections = butter(3, CUTOFF, fs=RATE, output="sos")
    _, response = freqz_sos(sections, [frequency], fs=RATE)
    inner = slice(200, -200)
    np.testing.assert_allclose(found[inner], abs(response[0]) ** 2 * wave[inner], atol=2e-4)


def test_a_straight_line_stays():
    line = np.linspace(3.0, 5.0, 120)[:, None]
    np.testing.assert_allclose(low_pass(line, 0.01, CUTOFF), line, atol=2e-6)


@pytest.mark.parametrize("cutoff", [1e-9, 0.2, 5.0, 6.0, np.inf])
def test_a_cutoff_that_the_record_cannot_have_is_refused(cutoff: float):
    with pytest.raises(InputError, match="half the 10 frames a second"):
        low_pass(np.zeros((50, 1)), 0.1, cutoff)


def smooth(times: np.ndarray, cutoff: float | None = None):
    motion = any_motion(slides())
    values = {
        name: np.sin(2.0 * times)[:, None] * np.ones(len(chain))
        for name, chain in motion.chains.items()
    }
    motion = replace(motion, times=times, displacements=values)
    return smooth_motion(motion.tree, motion, cutoff)


def test_derivatives_are_those_of_the_motion():
    times = np.linspace(0.0, 3.0, 301)
    found, inner = smooth(times), slice(5, -5)
    np.testing.assert_allclose(found.values[:, 0], np.sin(2.0 * times), atol=1e-12)
    np.testing.assert_allclose(found.rates[inner, 0], 2.0 * np.cos(2.0 * times)[inner], atol=1e-7)
    expected = -4.0 * np.sin(2.0 * times)
    np.testing.assert_allclose(found.accelerations[inner, 0], expected[inner], atol=1e-5)


def test_uneven_frames_are_made_even_for_the_filter():
    times = np.linspace(0.0, 3.0, 301)
    uneven = times + 0.003 * np.sin(40.0 * times)
    uneven[[0, -1]] = times[[0, -1]]
    found = smooth(np.sort(uneven), 10.0)
    expected = np.sin(2.0 * np.sort(uneven))
    np.testing.assert_allclose(found.values[30:-30, 0], expected[30:-30], atol=1e-4)


def test_a_gap_and_a_short_motion_are_refused():
    times = np.linspace(0.0, 3.0, 301)
    with pytest.raises(InputError, match=r"no frame between 1 and 1.5 s"):
        smooth(times[(times <= 1.0) | (times >= 1.5)])
    with pytest.raises(InputError, match="11 frames; accelerations need at least 12"):
        smooth(times[:11])
