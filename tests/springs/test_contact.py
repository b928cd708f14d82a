"""The law of contact: force and energy, its smoothness, impacts without gravity, friction."""

from itertools import product
from math import inf, log1p, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from springs.backends import FLOATS
from springs.contact import DEFAULT_SURFACE, Surface
from tests.slopes import slope

UNIT = Surface(stiffness=1.0, transition_depth=1.0)
surfaces = st.builds(
    Surface,
    stiffness=st.floats(1.0, 1e9),
    damping=st.floats(0.0, 1e3),
    friction=st.floats(0.0, 10.0),
    transition_depth=st.floats(1e-6, 1.0),
    friction_speed=st.floats(1e-6, 10.0),
)
depths = st.floats(-1.0, 10.0)
speeds = st.floats(-1e3, 1e3)


@given(surfaces, depths)
def test_the_force_is_the_slope_of_the_energy(surface: Surface, depth: float):
    force = surface.elastic_force(depth)
    assert slope(surface.energy, depth) == pytest.approx(force, rel=1e-9, abs=1e-60)
    assert surface.energy(depth) >= 0.0
    assert force > 0.0 if depth > 1e-60 else force >= 0.0


@pytest.mark.parametrize("depth", [0.5, 1.0, 1.0 + 1e-9, 3.0])
def test_the_energy_is_the_integral_of_the_force(depth: float):
    """The slope alone leaves a constant beyond the transition free."""
    work, _ = quad(lambda d: UNIT.elastic_force(d, FLOATS), 0.0, depth, points=(min(depth, 1.0),))
    assert UNIT.energy(depth) == pytest.approx(work, rel=1e-8)


@given(surfaces, st.floats(-1.0, 0.0))
def test_there_is_exactly_no_force_outside(surface: Surface, depth: float):
    assert surface.elastic_force(depth) == 0.0
    assert surface.energy(depth) == 0.0


@pytest.mark.parametrize("place", [0.0, 1.0])
def test_the_force_is_twice_continuously_differentiable(place: float):
    """Differences from both sides have an error of the third derivative, at most 6, times h."""
    h = 1e-4
    before, after = place - h, place + h
    assert UNIT.elastic_force(after) - UNIT.elastic_force(before) == pytest.approx(
        2.0 * h * slope(UNIT.elastic_force, place), abs=6.0 * h**2
    )
    here = slope(UNIT.elastic_force, place)
    left = (here - slope(UNIT.elastic_force, before)) / h
    right = (slope(UNIT.elastic_force, after) - here) / h
    assert left == pytest.approx(0.0, abs=6.0 * h)
    assert right == pytest.approx(0.0, abs=6.0 * h)


def test_the_law_is_a_spring_beyond_the_transition():
    assert UNIT.elastic_force(0.5) == pytest.approx(0.125 - 0.03125)
    assert UNIT.elastic_force(3.0) == 2.5
    assert slope(UNIT.elastic_force, 2.0) == 1.0


@given(surfaces, depths, speeds)
def test_damping_never_pulls(surface: Surface, depth: float, rate: float):
    normal = surface.elastic_force(depth) * surface.impact_factor(rate)
    assert normal >= 0.0
    if rate > 0.0:
        assert normal >= surface.elastic_force(depth)


@given(surfaces, speeds, speeds)
def test_friction_is_bounded_and_opposes_the_sliding(surface: Surface, x: float, z: float):
    factor = surface.friction_factor(x * x + z * z)
    assert factor >= 0.0
    # Products of subnormal numbers, below 1e-307, are rounded to multiples of 5e-324.
    assert factor * np.hypot(x, z) <= surface.friction * (1.0 + 1e-12) + 1e-318


def test_friction_is_nearly_full_well_above_the_friction_speed():
    assert DEFAULT_SURFACE.friction_factor(1.0) == pytest.approx(0.6, rel=1e-3)
    assert DEFAULT_SURFACE.friction_factor(0.02**2) * 0.02 == pytest.approx(0.6 / np.sqrt(2.0))


def restitution(damping: float, speed: float) -> float:
    """Ratio of the speeds after and before an impact without gravity, of any elastic law.

    m v dv = -k q(d) (1 + a v) dd separates: v - ln(1 + a v) / a is the same before and after.
    """
    before = damping * speed - log1p(damping * speed)

    def excess(ratio: float) -> float:
        after = -damping * speed * ratio
        return after - log1p(after) - before

    return brentq(excess, 0.0, min(1.0, (1.0 - 1e-12) / (damping * speed)), xtol=1e-14)


@pytest.mark.parametrize(
    ("damping", "speed", "stiffness"), list(product((0.5, 1.0, 2.0), (0.1, 1.0, 3.0), (5e3, 3e4)))
)
def test_restitution_of_an_impact(damping: float, speed: float, stiffness: float):
    surface = Surface(stiffness=stiffness, damping=damping)

    def rates(_time: float, state: np.ndarray) -> list[float]:
        depth, rate = map(float, state)
        force = surface.elastic_force(depth, FLOATS) * surface.impact_factor(rate, FLOATS)
        return [rate, -force]

    def leaves(_time: float, state: np.ndarray) -> float:
        return state[0] if state[1] < 0.0 else 1.0

    leaves.terminal = True
    impact = solve_ivp(
        rates, (0.0, 10.0), [0.0, speed], "DOP853", rtol=1e-10, atol=1e-14, events=leaves
    )
    assert impact.status == 1
    assert -impact.y[1, -1] / speed == pytest.approx(restitution(damping, speed), abs=1e-5)


def test_the_restitution_that_the_source_of_the_damping_names():
    assert restitution(1.0, 1.0) == pytest.approx(0.59, abs=5e-3)
    assert "leaves it with 0.59 m/s" in DEFAULT_SURFACE.source


@given(surfaces, depths, speeds)
def test_floats_and_arrays_have_one_law(surface: Surface, depth: float, rate: float):
    row = np.array([depth, rate])
    assert surface.elastic_force(row)[0] == surface.elastic_force(depth, FLOATS)
    assert surface.energy(row)[0] == surface.energy(depth, FLOATS)
    assert surface.impact_factor(row)[1] == surface.impact_factor(rate, FLOATS)
    assert surface.friction_factor(row**2)[1] == pytest.approx(
        surface.friction_factor(rate**2, FLOATS), rel=1e-15
    )


@pytest.mark.parametrize("name", ["stiffness", "transition_depth", "friction_speed"])
@pytest.mark.parametrize("value", [0.0, -1.0, inf, nan])
def test_numbers_that_must_be_positive(name: str, value: float):
    with pytest.raises(ValueError, match=f"the {name.replace('_', ' ')} must be positive"):
        Surface(**{name: value})


@pytest.mark.parametrize("name", ["damping", "friction"])
@pytest.mark.parametrize("value", [-1e-9, inf, nan])
def test_numbers_that_must_not_be_negative(name: str, value: float):
    with pytest.raises(ValueError, match=f"the {name} must not be negative"):
        Surface(**{name: value})
    assert getattr(Surface(**{name: 0.0}), name) == 0.0


def test_the_source_is_not_part_of_equality():
    assert Surface(source="measured") == Surface(source="assumed") != Surface(friction=0.5)
