"""Surfaces in other frames, several as one, and without the vertices that no face has."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.geometry.primitives import box, sphere
from generator.geometry.psurf import PSURF_FILE, format_psurf
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


FACES = st.lists(st.lists(st.integers(0, 5), min_size=3, max_size=7), min_size=1, max_size=6)


@given(FACES)
def test_faces_that_pass_a_vertex_twice_become_triangles_of_the_same_area(faces):
    """The sum of the area vectors, and the volume that the faces add up to, stay."""
    corners = np.random.default_rng(8).uniform(-1.0, 1.0, (6, 3))
    surface = Surface.from_faces(corners, faces)
    sound = surface.with_distinct_corners
    assert all(len(set(face)) == len(face) for face in sound.faces)
    kept = [face for face in surface.faces if len(set(face)) == len(face)]
    assert [face for face in sound.faces if face in kept] != [] or not kept
    for one, other in zip(sums(surface), sums(sound), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    again = PSURF_FILE.parse_text(format_psurf(sound)).value
    assert (again is not None) == bool(sound.face_count)


def sums(surface: Surface):
    one, two, three = (surface.vertices[k] for k in surface.fan_triangles[0])
    area = np.cross(two - one, three - one).sum(axis=0)
    return area, np.einsum("ij,ij->", one, np.cross(two, three))


def test_sound_faces_stay_as_they_are():
    surface = box(1.0, 2.0, 3.0)
    assert surface.with_distinct_corners is surface
