"""Surfaces of simple solids: closed, outwards, with their corners on the solids."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.geometry.primitives import SIDES, box, capsule, cylinder, ellipsoid
from generator.geometry.surface import Surface
from generator.geometry.validate import build_solid

SIZES = st.floats(0.01, 10.0)

POLYGON = SIDES / (2.0 * pi) * np.sin(2.0 * pi / SIDES)
"""Area of a regular polygon in a circle, relative to the circle's."""


def volume(surface: Surface) -> float:
    """Of a surface that is closed and looks outwards."""
    body = build_solid(surface).mass_properties(1.0)
    np.testing.assert_allclose(body.centre, 0.0, atol=1e-9 * np.abs(surface.vertices).max())
    return body.mass


@given(SIZES, SIZES, SIZES)
def test_a_box_has_its_volume(x: float, y: float, z: float):
    assert volume(box(x, y, z)) == pytest.approx(8.0 * x * y * z)


@given(SIZES, SIZES)
def test_a_cylinder_has_the_volume_of_its_polygon(radius: float, half: float):
    exact = 2.0 * pi * radius**2 * half
    assert volume(cylinder(radius, half)) == pytest.approx(POLYGON * exact)


@given(SIZES, SIZES, SIZES)
def test_corners_of_an_ellipsoid_lie_on_it(x: float, y: float, z: float):
    surface = ellipsoid(x, y, z)
    np.testing.assert_allclose(((surface.vertices / [x, y, z]) ** 2).sum(axis=1), 1.0, rtol=1e-12)
    assert 0.96 < volume(surface) / (4.0 / 3.0 * pi * x * y * z) < 1.0


@given(SIZES, SIZES)
def test_corners_of_a_capsule_have_its_radius_from_its_axis(radius: float, half: float):
    surface = capsule(radius, half)
    nearest = np.clip(surface.vertices[:, 2], -half, half)
    across = surface.vertices - np.stack([0.0 * nearest, 0.0 * nearest, nearest], axis=1)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), radius, rtol=1e-9)
    exact = 4.0 / 3.0 * pi * radius**3 + 2.0 * pi * radius**2 * half
    assert 0.96 < volume(surface) / exact < 1.0
