"""The plate of the directional hip: its claims, against widths and areas worked apart."""

import numpy as np
import pytest

from plots.plates.hip_directional import HYSTERESIS_WIDTH, drive_hip, hysteresis_law
from springs import Cubic
from springs.hysteresis import Hysteresis
from springs.transformed import Transformed
from tests.plots.drawn import data, plate

pytestmark = pytest.mark.slow
"""They share the drawing of the plate with the test of the gallery, which checks its claims."""


def thesis(angle: np.ndarray) -> np.ndarray:
    """The hip's y record of appendix A [N m]."""
    return 33.180672 - 144.6 * angle + 188.2 * angle**2 - 82.76 * angle**3


@pytest.fixture(scope="module")
def drawn():
    return plate("hip_directional")


@pytest.fixture(scope="module")
def made():
    return data("hip_directional")


def test_the_branches_are_the_two_curves(made) -> None:
    """Away from the reversals to 0.02 N m: what a frame of 10 ms cannot tell."""
    angles = np.radians(np.arange(5.0, 76.0, 1.0))
    assert made.torque_on_branch(angles, -1) == pytest.approx(thesis(angles), abs=0.02)
    assert made.torque_on_branch(angles, +1) == pytest.approx(
        thesis(angles) - HYSTERESIS_WIDTH, abs=0.02
    )


def test_the_area_is_width_times_range(made, drawn) -> None:
    expected = HYSTERESIS_WIDTH * (made.ends[1] - made.ends[0])
    assert hysteresis_law().cycle_loss(*made.ends) == pytest.approx(expected, rel=1e-9)
    assert drawn.claims[3].measured == pytest.approx(expected, rel=0.005)
    assert np.degrees(made.ends[1] - made.ends[0]) == pytest.approx(80.0, abs=2.0)


def test_the_cycle_is_closed(made) -> None:
    assert np.sum(made.angle_change) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("width", [0.0, 10.0])
def test_another_width_is_measured_as_such(width) -> None:
    """The torque is that of the motion: with other curves it is another."""
    cubic = Cubic((33.180672, -144.6, 188.2, -82.76), sense=1)
    made = drive_hip(Hysteresis(Transformed(cubic, constant=-width), cubic), 0.1, 1.2)
    angles = np.radians(np.arange(15.0, 60.0, 5.0))
    apart = made.torque_on_branch(angles, -1) - made.torque_on_branch(angles, +1)
    assert apart == pytest.approx(np.full_like(angles, width), abs=0.05)
    assert made.energy_loss == pytest.approx(width * (made.ends[1] - made.ends[0]), abs=0.05)
    assert made.dissipated_energy == pytest.approx(made.energy_loss, abs=0.02)
