"""Lofts: girths, round ends, parts that lie within each other, reliefs."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.geometry.intersections import triangles_intersect
from generator.geometry.surface import Surface
from generator.geometry.validate import build_solid, validate_surface, winding_numbers
from generator.person.loft import (
    Cap,
    Loft,
    Relief,
    Section,
    loft_surface,
    ring_places,
    section_girth,
    section_outline,
)

SIDES = 40


def circle(at: float, radius: float) -> Section:
    return Section(at, 2.0 * radius, radius, radius)


def surface_of(loft: Loft, low: float, high: float, *caps: Cap) -> Surface:
    return loft_surface(*loft.part(low, high, caps[0], caps[1]), np.eye(3), "part")


def triangles_of(surface: Surface) -> np.ndarray:
    return surface.vertices[surface.corners.reshape(-1, 3)]


def test_girths_of_circle_ellipse_and_square() -> None:
    from scipy.special import ellipe

    assert section_girth(circle(0.0, 0.3)) == pytest.approx(2.0 * pi * 0.3, rel=1e-4)
    ellipse = Section(0.0, 0.4, 0.1, 0.1)
    assert section_girth(ellipse) == pytest.approx(4.0 * 0.2 * ellipe(1.0 - 0.25), rel=1e-4)
    square = Section(0.0, 0.4, 0.2, 0.2, 0.0, 200.0, 200.0)
    assert section_girth(square) == pytest.approx(1.6, rel=0.01)


def test_outline_has_the_sizes_of_its_section() -> None:
    section = Section(0.0, 0.3, 0.1, 0.2, 0.05, 2.3, 3.0)
    forward, across = section_outline(section, SIDES).T
    assert forward.max() == pytest.approx(0.15)
    assert forward.min() == pytest.approx(-0.15)
    assert np.ptp(across) == pytest.approx(0.3)
    np.testing.assert_allclose(across[1:], -across[:0:-1], atol=1e-15)
    steps = np.diff(np.append(np.unwrap(np.arctan2(across, forward - 0.05)), 2.0 * pi))
    assert (steps > 0.0).all()


def test_focus_brings_corners_to_the_front() -> None:
    even, near = (section_outline(circle(0.0, 1.0), SIDES, focus) for focus in (0.0, 0.4))
    assert near[1, 1] == pytest.approx(0.6 * even[1, 1], rel=0.01)


def test_cylinder_with_round_ends_is_a_capsule() -> None:
    loft = Loft((circle(0.0, 0.05), circle(0.4, 0.05)), SIDES, np.linspace(0.0, 0.4, 9))
    solid = build_solid(surface_of(loft, 0.0, 0.4, Cap(0.05, rings=12), Cap(0.05, rings=12)))
    expected = pi * 0.05**2 * 0.4 + 4.0 / 3.0 * pi * 0.05**3
    assert solid.volume == pytest.approx(expected, rel=0.01)
    assert solid.surface.vertices[:, 2].min() == -0.05
    assert solid.surface.vertices[:, 2].max() == 0.45


def test_places_of_rings_are_the_same_on_both_sides_of_a_joint() -> None:
    places = ring_places([(0.0, 0.03), (0.3, 0.02), (0.4, 0.0)], [0.3])
    assert {0.294, 0.3, 0.306} <= {round(place, 6) for place in places.tolist()}
    assert (np.diff(places) > 1e-3).all()
    assert places[[0, -1]].tolist() == [0.0, 0.4]


def test_round_end_lies_within_the_next_part() -> None:
    sections = (circle(0.0, 0.06), circle(0.3, 0.04), circle(0.6, 0.05))
    loft = Loft(sections, SIDES, ring_places([(0.0, 0.03), (0.6, 0.0)], [0.3]))
    upper = surface_of(loft, 0.0, 0.3, Cap(0.03), Cap(0.04))
    lower = surface_of(loft, 0.3, 0.6, Cap(0.04), Cap(0.03))
    beyond = upper.vertices[upper.vertices[:, 2] > 0.3 + 1e-9]
    assert len(beyond) > 2 * SIDES
    assert (winding_numbers(triangles_of(lower), beyond) > 0.5).all()


def test_relief_rises_in_front_and_vanishes_at_the_widest_line() -> None:
    relief = Relief(0.2, 0.0, 0.01, 0.05, 0.05, 0.03)
    section = circle(0.2, 0.1)
    ring = np.column_stack([section_outline(section, SIDES), np.full(SIDES, 0.2)])
    rise = relief.rise(ring, section)
    assert rise[0] == pytest.approx(0.01)
    assert rise[SIDES // 4 : 3 * SIDES // 4 + 1] == pytest.approx(0.0)
    behind = Relief(0.2, 0.0, 0.01, 0.05, 0.05, 0.03, is_behind=True).rise(ring, section)
    assert behind[SIDES // 2] == pytest.approx(-0.01)
    assert behind[0] == 0.0


sizes = st.floats(0.02, 0.2)
exponents = st.floats(1.7, 4.0)
rows = st.tuples(sizes, sizes, sizes, st.floats(-0.1, 0.1), exponents, exponents)


@settings(max_examples=15, deadline=None)
@given(st.lists(rows, min_size=2, max_size=5), st.floats(2.0, 3.0))
def test_any_loft_is_closed_outward_and_does_not_meet_itself(
    rows: list[tuple[float, ...]], exponent: float
) -> None:
    sections = [Section(0.1 * k, *row) for k, row in enumerate(rows)]
    end = sections[-1].at
    loft = Loft(sections, 16, ring_places([(0.0, 0.03), (end, 0.0)], []))
    surface = surface_of(loft, 0.0, end, Cap(0.04, exponent), Cap(0.02, exponent))
    found = validate_surface(surface)
    assert not found.diagnostics
    assert build_solid(surface).volume > 0.0
    triangles = triangles_of(surface)
    assert not triangles_intersect(triangles, triangles)
