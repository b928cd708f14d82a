"""Triangles that lie within concave faces: they cover the face, and nothing else."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from generator.geometry import Surface
from generator.geometry.intersections import triangulate
from generator.rotations import matrix_from_rotation_vector


def area(ring):
    """Area of a polygon in the plane, by the shoelace formula."""
    x, y = np.asarray(ring, float).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0


def is_within(point, ring):
    """Return whether a ray from the point crosses the ring an odd number of times."""
    inside = False
    for (x1, y1), (x2, y2) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        if (y1 > point[1]) != (y2 > point[1]):
            inside ^= point[0] < (x2 - x1) * (point[1] - y1) / (y2 - y1) + x1
    return inside


@st.composite
def stars(draw):
    """A polygon round the origin, its corners at any distance: concave in most cases."""
    radii = draw(st.lists(st.floats(0.2, 3.0), min_size=4, max_size=14))
    turns = 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    return np.array(radii)[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])


def cut(ring, turn=(0.0, 0.0, 0.0)):
    """The triangles of a polygon that is turned in space, back in its plane."""
    rotation = matrix_from_rotation_vector(np.array(turn))
    points = np.column_stack([ring, np.zeros(len(ring))]) @ rotation.T
    triangles, owner = triangulate(Surface.from_faces(points, [tuple(range(len(ring)))]))
    assert (owner == 0).all()
    return (triangles @ rotation)[..., :2]


@given(stars(), st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_triangles_cover_the_face_and_nothing_else(ring, turn):
    triangles = cut(ring, turn)
    assert len(triangles) == len(ring) - 2
    areas = [area(triangle) for triangle in triangles]
    assert min(areas) > -1e-9
    assert sum(areas) == pytest.approx(area(ring), rel=1e-9)
    for triangle, size in zip(triangles, areas, strict=True):
        if size > 1e-6:
            assert is_within(triangle.mean(axis=0), ring)


@given(stars(), st.integers(1, 4))
def test_corners_on_a_straight_side_do_no_harm(ring, parts):
    steps = np.arange(parts) / parts
    split = np.concatenate(
        [a + steps[:, None] * (b - a) for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True)]
    )
    assume(len(split) > 3)
    areas = [area(triangle) for triangle in cut(split)]
    assert min(areas) > -1e-9
    assert sum(areas) == pytest.approx(area(ring), rel=1e-9)


def test_convex_faces_keep_their_fans():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    triangles, _ = triangulate(Surface.from_faces(points, [(0, 1, 2, 3), (3, 2, 1, 0)]))
    assert triangles.tolist() == points[[[0, 1, 2], [0, 2, 3], [3, 2, 1], [3, 1, 0]]].tolist()


def test_a_face_whose_sides_cross_is_cut_somehow():
    bow = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1.5, 0], [1, 3, 0]], float)
    triangles, _ = triangulate(Surface.from_faces(bow, [(0, 1, 2, 3, 4)]))
    assert len(triangles) == 3
