"""The closed forms of contact: known values, limits, and the equations they solve."""

from dataclasses import replace
from math import cos, radians, sin, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import ModelError
from plots import contact_cases
from plots.contact_cases import (
    BALL,
    BALL_INERTIA,
    BLOCK,
    BLOCK_HALF_SIZE,
    BLOCK_INERTIA,
    BODY,
    GRAVITY,
    HORIZONTAL,
    MASS,
    ball_acceleration,
    creep_speed,
    creeping_block,
    free_body,
    friction_angle_of_rolling,
    peak_force,
    resting_depth,
    restitution,
    rolling_speed,
    simulate_contact,
    slope_normal,
    stopping_distance,
    tipping_rate,
)
from springs.contact import Surface

speeds = st.floats(0.01, 10.0)
surfaces = st.builds(
    Surface,
    stiffness=st.floats(1e3, 1e7),
    damping=st.floats(0.0, 5.0),
    friction=st.floats(0.1, 2.0),
    transition_depth=st.floats(1e-4, 1e-2),
    friction_speed=st.floats(1e-4, 0.1),
)


def test_an_impact_without_damping_gives_all_back() -> None:
    assert restitution(0.0, 3.0) == 1.0
    assert restitution(1e-3, 1.0) == pytest.approx(1.0 - 2e-3 / 3.0, abs=1e-6)


def test_rolling_ends_where_both_accelerations_are_equal() -> None:
    surface = Surface(friction=0.6)
    angle = friction_angle_of_rolling(surface)
    below, above = (ball_acceleration(angle + change, surface) for change in (-1e-9, 1e-9))
    assert below == pytest.approx(above, abs=1e-6)
    assert rolling_speed(2.0) == pytest.approx(10.0 / 7.0, abs=1e-12)


def test_coulombs_stopping_distance() -> None:
    coulomb = Surface(friction=0.6, friction_speed=1e-9)
    assert stopping_distance(2.0, coulomb) == pytest.approx(0.33979, abs=1e-5)


@given(speeds, surfaces)
def test_the_peak_force_stores_the_kinetic_energy(speed: float, surface: Surface) -> None:
    depth = resting_depth(peak_force(speed, surface), surface)
    assert float(surface.energy(depth)) == pytest.approx(0.5 * MASS * speed**2, rel=1e-6)


def test_a_rod_begins_to_tip_as_an_inverted_pendulum() -> None:
    """Near the vertical its rate grows with the angle: omega = lambda sqrt(b^2 - a^2)."""
    h, r = 0.5 * contact_cases.ROD_LENGTH, contact_cases.ROD_FOOT
    about_contact = contact_cases.ROD_INERTIA + MASS * (h + r) ** 2
    rate = sqrt(MASS * GRAVITY * h / about_contact)
    expected = rate * sqrt(0.02**2 - 0.01**2)
    assert tipping_rate(0.01, 0.02) == pytest.approx(expected, rel=1e-3)


def test_the_block_is_as_large_as_its_spheres() -> None:
    for axis, half in enumerate(BLOCK_HALF_SIZE):
        ends = [sphere.centre[axis] + sphere.radius for sphere in BLOCK]
        assert max(ends) == pytest.approx(half)
    x, y, z = (2.0 * half for half in BLOCK_HALF_SIZE)
    assert (
        pytest.approx([MASS / 12.0 * (p**2 + q**2) for p, q in ((y, z), (x, z), (x, y))])
        == BLOCK_INERTIA
    )
    assert slope_normal(0.0) == (0.0, 1.0, 0.0)


def test_a_run_starts_as_it_is_told() -> None:
    figure = free_body(BALL, (BALL_INERTIA,) * 3, (0.1, 0.5, -0.2), 0.3)
    given = {"velocity": (0.4, -0.1, 0.2), "spin": (0.0, 0.0, 2.0)}
    run = simulate_contact(figure, HORIZONTAL, Surface(), 0.1, frames=10, **given)
    assert len(run.times) == 11
    assert run.centre_of_mass[0] == pytest.approx([0.1, 0.5, -0.2])
    assert run.velocities[BODY][0] == pytest.approx([2.0, 0.0, 0.0, 0.4, -0.1, 0.2])
    assert run.poses[BODY][0, :3, 0] == pytest.approx([cos(0.3), sin(0.3), 0.0])
    with pytest.raises(ModelError):
        simulate_contact(
            free_body(BALL, (BALL_INERTIA,) * 3, (0.0, 0.0, 0.0)), HORIZONTAL, Surface(), 0.1
        )


def test_another_closed_form_is_refuted() -> None:
    """With a friction of 0.61 in place of 0.6 in the formula alone."""
    case = creeping_block(radians(20.0))
    other = replace(contact_cases.FIRM, friction=0.61)
    wrong = replace(case, closed_form=creep_speed(radians(20.0), other))
    assert case.relative_error < 1e-6
    assert wrong.relative_error > 1e-2
