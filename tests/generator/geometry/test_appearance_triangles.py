"""Faces as triangles: the same area and the same side, concave faces too."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.geometry.appearance import triangles_with_normals
from generator.geometry.psurf import PSURF_FILE
from generator.geometry.surface import Surface
from tests.motions import FIGURES


def area(points: np.ndarray) -> float:
    """The area of a polygon in the plane z = 0, counter-clockwise (shoelace)."""
    x, y = points[:, 0], points[:, 1]
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def parts(corners: np.ndarray) -> np.ndarray:
    a, b, c = corners.reshape(-1, 3, 3).transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


L_SHAPE = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
COMB = [
    (0, 0),
    (5, 0),
    (5, 3),
    (4, 3),
    (4, 1),
    (3, 1),
    (3, 3),
    (2, 3),
    (2, 1),
    (1, 1),
    (1, 3),
    (0, 3),
]


@pytest.mark.parametrize("outline", [L_SHAPE, COMB])
def test_a_concave_face_is_covered_once_from_every_first_corner(outline: list[tuple[int, int]]):
    flat = np.array([(x, y, 0.0) for x, y in outline])
    for first in range(len(outline)):
        turned = np.roll(flat, first, axis=0)
        corners, normals = triangles_with_normals(Surface.from_faces(turned, [range(len(outline))]))
        pieces = parts(corners)
        assert len(pieces) == len(outline) - 2
        assert np.all(pieces[:, 2] >= 0.0)
        assert pieces[:, 2].sum() == pytest.approx(area(flat))
        assert np.allclose(normals, [0.0, 0.0, 1.0])


@given(st.integers(3, 12), st.integers(0, 10_000))
def test_a_star_shaped_face_is_covered_once(count: int, seed: int):
    rng = np.random.default_rng(seed)
    angles = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * 2.0 * np.pi / count
    radii = rng.uniform(0.3, 1.0, count)
    flat = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(count)])
    corners, _ = triangles_with_normals(Surface.from_faces(flat, [range(count)]))
    pieces = parts(corners)[:, 2]
    assert pieces.sum() == pytest.approx(area(flat))
    assert np.abs(pieces).sum() == pytest.approx(area(flat))


@pytest.mark.parametrize("name", ["echest", "eltorso", "eupleg", "floor"])
def test_a_psurf_keeps_its_area_and_its_outside(name: str):
    surface = PSURF_FILE.read(FIGURES / f"{name}.pss")
    corners, normals = triangles_with_normals(surface)
    fans, _ = surface.fan_triangles
    points = surface.vertices[fans]
    whole = 0.5 * np.cross(points[1] - points[0], points[2] - points[0])
    assert np.linalg.norm(parts(corners), axis=1).sum() == pytest.approx(
        np.linalg.norm(whole, axis=1).sum()
    )
    assert np.all(np.sum(parts(corners) * normals[::3], axis=1) > 0.0)


def test_a_surface_without_faces_has_no_triangles():
    corners, normals = triangles_with_normals(Surface.from_faces(np.zeros((0, 3)), []))
    assert corners.shape == normals.shape == (0, 3)
