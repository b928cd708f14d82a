"""Surfaces in other frames, several as one, and without the vertices that no face has."""

import numpy as np
import pytest

from generator.geometry.primitives import box, sphere
from generator.geometry.surface import Surface, join_surfaces
from generator.geometry.validate import build_solid
from generator.rotations import matrix_from_xyz, pose_matrix


def test_a_surface_in_another_frame_keeps_its_volume():
    pose = pose_matrix(matrix_from_xyz(0.3, -0.4, 1.2), np.array([1.0, -2.0, 3.0]))
    moved = build_solid(box(1.0, 2.0, 3.0).transformed(pose)).mass_properties(1.0)
    assert moved.mass == pytest.approx(48.0)
    np.testing.assert_allclose(moved.centre, [1.0, -2.0, 3.0])


def test_faces_of_a_mirror_image_look_outwards():
    mirrored = sphere(1.0).transformed(np.diag([1.0, -1.0, 2.0, 1.0]))
    assert build_solid(mirrored).mass_properties(1.0).mass > 7.0


def test_several_surfaces_are_one_with_all_faces():
    apart = pose_matrix(np.eye(3), np.array([10.0, 0.0, 0.0]))
    one = join_surfaces([box(1.0, 1.0, 1.0), sphere(1.0), box(2.0, 1.0, 1.0).transformed(apart)])
    assert one.face_count == 12 + sphere(1.0).face_count
    assert one.faces[-1] == tuple(k + 8 + len(sphere(1.0).vertices) for k in box(1, 1, 1).faces[-1])
    assert join_surfaces([]).face_count == 0


def test_vertices_without_a_face_are_left_out():
    surface = Surface.from_faces(np.eye(4, 3), [(0, 1, 3)])
    kept = surface.without_unused_vertices
    np.testing.assert_array_equal(kept.vertices, surface.vertices[[0, 1, 3]])
    assert kept.faces == ((0, 1, 2),)
    assert kept.without_unused_vertices is kept
