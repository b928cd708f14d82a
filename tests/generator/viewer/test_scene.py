"""Meshes of the segments of a figure in the scene of the page."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.geometry.surface import Surface
from generator.geometry.validate import build_solid
from generator.rotations import Array, matrix_from_rotation_vector, pose_matrix
from generator.viewer import scene
from generator.viewer.viewer import Driver, FigureState
from tests.bodies import box
from tests.browser import node_pose
from tests.generator.viewer.conftest import wait_until


def test_the_browser_has_the_poses_of_the_server(run_viewer, open_page):
    running = run_viewer("prototype")
    page = open_page(running)
    nodes = list(map(scene.node_name, running.viewer.scene.meshes))
    wait_until(lambda: all(node_pose(page, node) is not None for node in nodes))
    viewer = running.viewer
    # a small movement, below the change of about 1e-5 that the library of the page leaves out
    small = pose_matrix(matrix_from_rotation_vector(np.full(3, 2e-6)), np.full(3, 3e-6))
    for turn in (np.eye(4), small):
        poses = {name: turn @ pose for name, pose in viewer.content.placement.poses.items()}
        running.call(lambda poses=poses: viewer.show(FigureState(Driver.POSE, {}, poses)))
        for segment, node in zip(viewer.scene.meshes, nodes, strict=True):
            wait_until(
                lambda pose=poses[segment], node=node: (
                    np.abs(node_pose(page, node) - pose).max() < 1e-6
                )
            )


def prism(sides: int) -> Surface:
    """A prism with a regular polygon as its base."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angles), np.zeros(sides), np.sin(angles)], axis=1)
    vertices = np.concatenate([ring, ring + np.array([0.0, 1.0, 0.0])])
    walls = [(k, sides + k, sides + (k + 1) % sides, (k + 1) % sides) for k in range(sides)]
    ends = [tuple(range(sides)), tuple(range(2 * sides - 1, sides - 1, -1))]
    return Surface.from_faces(vertices, [*walls, *ends])


def test_a_box_has_creases_at_all_edges():
    vertices, triangles = scene.mesh_with_creases(Surface.from_faces(*box((1.0, 2.0, 3.0))))
    assert (len(vertices), len(triangles)) == (24, 12)


@pytest.mark.parametrize(("sides", "corners_of_a_wall"), [(8, 4), (16, 2)])
def test_walls_of_a_prism_are_smooth_where_they_are_many(sides: int, corners_of_a_wall: int):
    """Walls of an octagon meet at 45 degrees, those of a polygon of 16 sides at half of that."""
    vertices, triangles = scene.mesh_with_creases(prism(sides))
    assert len(vertices) == sides * corners_of_a_wall + 2 * sides
    assert len(triangles) == 4 * sides - 4


def test_the_triangles_of_a_mesh_are_those_of_its_surface():
    vertices, triangles = scene.mesh_with_creases(prism(12))
    volume = float(np.sum(np.linalg.det(vertices[triangles]))) / 6.0
    assert volume == pytest.approx(build_solid(prism(12)).volume, rel=1e-12)


@given(
    points=st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), max_size=8),
    aspect=st.floats(0.5, 3.0),
    covered=st.floats(0.0, 0.5),
    view=st.sampled_from(list(scene.VIEW_DIRECTIONS)),
)
def test_a_framed_figure_is_beside_the_controls_and_fills_the_page(
    points: list[tuple[float, float, float]], aspect: float, covered: float, view: str
):
    places = np.array([*points, (0.5, 0.0, -0.5), (-0.5, 0.0, 0.5), (0.0, 2.0, 0.0)])
    direction = np.array(scene.VIEW_DIRECTIONS[view])
    direction /= np.linalg.norm(direction)
    camera, centre = scene.camera_position(places, aspect, covered, view)
    assert np.allclose((camera - centre) / np.linalg.norm(camera - centre), direction)
    x, y = on_page(places, camera, aspect, direction).T
    assert np.abs(y).max() <= scene.FILL + 1e-9
    # the free part of the page is from -1 to 1 - 2 covered
    beside = (x + covered) / (1.0 - covered)
    assert np.abs(beside).max() <= scene.FILL + 1e-9
    assert max(np.abs(y).max(), np.abs(beside).max()) == pytest.approx(scene.FILL)


def on_page(points: Array, camera: Array, aspect: float, direction: Array) -> Array:
    """Places of points on a page from -1 to 1, shape (n, 2)."""
    right = np.cross([0.0, 1.0, 0.0], direction)
    right /= np.linalg.norm(right)
    up = np.cross(direction, right)
    arms = points - camera
    depths = -arms @ direction * np.tan(0.5 * scene.VIEW_ANGLE)
    return np.stack([arms @ right / (depths * aspect), arms @ up / depths], axis=1)
