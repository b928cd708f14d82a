"""Picture of an identification."""

from dataclasses import replace

import numpy as np
import pytest

from generator.identification.fit import FitOptions
from plots.identification_drawing import draw_identification
from tests.swings import SCALE, TRUTH, fitted, standard_fit


@pytest.mark.parametrize("texts", [(SCALE,), tuple(TRUTH)])
def test_angles_residuals_and_profiles_are_drawn(texts: tuple[str, ...]):
    fit = standard_fit() if texts == tuple(TRUTH) else fitted(texts, FitOptions(starts=1))
    panels = [axes for axes in draw_identification(fit).get_axes() if axes.get_visible()]
    assert len(panels) == 2 + len(texts) + 1
    measured, drawn = panels[0].get_lines()
    np.testing.assert_allclose(measured.get_ydata(), np.degrees(fit.data.angles[:, 0]))
    np.testing.assert_allclose(drawn.get_ydata(), np.degrees(fit.simulated[:, 0]))
    residuals = panels[1].get_lines()[1]
    np.testing.assert_allclose(residuals.get_ydata(), np.degrees(fit.residuals[:, 0]))
    profile, parabola = panels[2].get_lines()[:2]
    assert np.min(profile.get_ydata()) == pytest.approx(0.0, abs=0.01)
    np.testing.assert_allclose(profile.get_ydata(), parabola.get_ydata(), rtol=0.1, atol=0.2)


def test_without_profiles_the_autocorrelation_stays():
    fit = standard_fit()
    bare = tuple(replace(one, profile=None) for one in fit.estimates)
    assert len(draw_identification(replace(fit, estimates=bare)).get_axes()) == 3


def test_measured_angles_have_the_colours_of_their_fits():
    fit = standard_fit()
    data = replace(
        fit.data,
        columns=(("left_knee", 0), ("left_knee", 0)),
        angles=np.hstack([fit.data.angles, 0.5 * fit.data.angles]),
    )
    bare = tuple(replace(one, profile=None) for one in fit.estimates)
    two = np.hstack([fit.simulated, 0.5 * fit.simulated])
    lines = (
        draw_identification(replace(fit, data=data, simulated=two, estimates=bare))
        .get_axes()[0]
        .get_lines()
    )
    colours = [line.get_color() for line in lines]
    assert colours[0] == colours[1] != colours[2] == colours[3]
