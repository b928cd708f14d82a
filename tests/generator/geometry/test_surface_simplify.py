"""Surfaces of many faces become simpler ones that are nearly the same."""

import numpy as np
import pytest

from generator.geometry.primitives import box, sphere
from generator.geometry.surface import (
    Surface,
    build_edges,
    build_tetrahedra,
    merge_vertices,
    simplify,
)


def refined(surface: Surface, times: int) -> Surface:
    """The surface with each triangle cut into four, several times."""
    points = surface.vertices[surface.fan_triangles[0].T]
    for _ in range(times):
        a, b, c = points[:, 0], points[:, 1], points[:, 2]
        ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        points = np.concatenate([np.stack(part, axis=1) for part in parts])
    faces = np.arange(3 * len(points)).reshape(-1, 3)
    return merge_vertices(Surface.from_faces(points.reshape(-1, 3), faces))[0]


def test_a_box_of_many_faces_keeps_its_size_and_nearly_its_volume():
    fine = refined(box(0.1, 0.2, 0.3), 5)
    assert fine.face_count == 12 * 4**5
    coarse, moved = simplify(fine, 1000)
    assert 200 < coarse.face_count <= 1000
    assert 0.0 < moved < 0.06
    np.testing.assert_allclose(np.abs(coarse.vertices).max(axis=0), [0.1, 0.2, 0.3])
    assert build_tetrahedra(coarse).volume == pytest.approx(0.048, rel=0.02)
    assert not len(build_edges(coarse).boundary)


def test_vertices_of_the_simpler_surface_are_some_of_the_others():
    fine = refined(sphere(1.0), 1)
    coarse, moved = simplify(fine, 500)
    known = {tuple(row) for row in fine.vertices.tolist()}
    assert {tuple(row) for row in coarse.vertices.tolist()} <= known
    gaps = np.linalg.norm(fine.vertices[:, None] - coarse.vertices[None], axis=2).min(axis=1)
    assert gaps.max() <= moved + 1e-12


def test_a_surface_of_few_faces_stays():
    few, moved = simplify(box(1.0, 1.0, 1.0), 12)
    assert (few.face_count, moved) == (12, 0.0)


def test_many_faces_in_one_point_end():
    for size in (1e-30, 0.0):
        points = np.repeat([[0.0, 0.0, 0.0], [size, 0.0, 0.0], [0.0, size, 0.0]], 20, axis=0)
        faces = np.arange(60).reshape(3, 20).T
        coarse, _ = simplify(Surface.from_faces(points, faces), 5)
        assert coarse.face_count <= 5
