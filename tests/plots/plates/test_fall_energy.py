"""The plate of the fall's energy: its claims, against the motion it is from."""

import numpy as np
import pytest

from generator import read_figure
from plots.plates.fall_energy import STEP_SIZES
from tests.plots.drawn import data, plate

pytestmark = pytest.mark.slow
"""They share the drawing of the plate with the test of the gallery, which checks its claims."""


@pytest.fixture(scope="module")
def made():
    return data("fall_energy")


@pytest.fixture(scope="module")
def drawn():
    return plate("fall_energy")


def test_the_order_until_the_first_corner(drawn) -> None:
    """Second order: four, far nearer than the claim asks for."""
    assert [claim.measured for claim in drawn.claims[3:5]] == pytest.approx([4.0, 4.0], abs=0.01)


def test_the_first_corner_is_the_knees_dead_zone(made) -> None:
    """The knees fall straight, onto the edge of their dead zone at 0."""
    knee = made.finest_run.displacements["left_knee"][:, 0]
    assert np.all(knee[: made.breakpoint_frame + 1] > 0.0)
    assert knee[made.breakpoint_frame + 1] <= 0.0


def test_gravity_is_that_of_the_centre_of_mass(made, drawn) -> None:
    mass = read_figure("prototype").total_mass
    height = made.finest_run.centre_of_mass[:, 1]
    expected = 9.81 * mass * (height - height[0])
    assert drawn.tables["energy"]["gravity [J]"] == pytest.approx(expected, abs=1e-6)


def test_the_error_is_the_sum_of_the_columns(drawn) -> None:
    energy, error = drawn.tables["energy"], drawn.tables["error"]
    kinds = ("kinetic", "gravity", "spring", "dissipated")
    total = np.sum([energy[f"{kind} [J]"] for kind in kinds], axis=0) - energy["work [J]"]
    finest = error[f"energy error, {1e3 * min(STEP_SIZES):g} ms [J]"]
    assert total == pytest.approx(finest, abs=1e-9)
    assert np.all(energy["work [J]"] == 0.0)
