"""How props are drawn."""

import numpy as np
import pytest

from generator.contact.appearance import SHEET_MARGIN, is_level, prop_colour, prop_surface
from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.scene import SHAPES


@pytest.mark.parametrize("kind", SHAPES)
def test_every_shape_has_a_surface_on_itself(kind):
    shape = kind()
    points = np.array([[0.3, 0.1, 0.2], [1.0, 2.0, -3.0]])
    vertices = prop_surface(shape, points).vertices
    assert np.max(np.abs(shape.distance(tuple(vertices.T))[0])) < 1e-12
    assert min(prop_colour(shape)) >= 0.5  # muted


def test_a_sheet_is_around_the_points():
    plane = Plane((0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    points = np.array([[5.0, 1.0, 0.0], [0.0, 3.0, 1.0]])
    vertices = prop_surface(plane, points).vertices @ plane.pose[:3, :3].T + plane.pose[:3, 3]
    assert np.allclose(vertices[:, 0], 0.0)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert np.allclose(high - low, [0.0, 2.0 * (1.0 + SHEET_MARGIN), 2.0 * (1.0 + SHEET_MARGIN)])
    assert np.allclose(0.5 * (low + high)[1:], [2.0, 0.5])


def test_a_floor_is_level():
    assert is_level(Plane())
    assert is_level(Plane(normal=(0.0, 3.0, 0.0)))
    assert not is_level(Plane(normal=(0.0, -1.0, 0.0)))
    assert not is_level(Plane(normal=(0.1, 1.0, 0.0)))
    assert not is_level(Box())
