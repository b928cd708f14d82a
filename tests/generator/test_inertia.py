"""Mass properties: how bodies add up, and how they look from elsewhere."""

from functools import reduce
from operator import add

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.inertia import MassProperties
from generator.rotations import inverse_pose, matrix_from_rotation_vector, pose_matrix

coordinates = st.floats(-3.0, 3.0)
vectors = st.tuples(coordinates, coordinates, coordinates).map(np.array)
rotations = vectors.map(matrix_from_rotation_vector)
poses = st.builds(pose_matrix, rotations, vectors)


def cuboid(mass, size, centre=(0.0, 0.0, 0.0)):
    """A box about `centre`, along the axes."""
    x, y, z = np.square(size)
    return MassProperties(mass, np.array(centre), mass / 12.0 * np.diag([y + z, x + z, x + y]))


@st.composite
def bodies(draw):
    mass, size = draw(st.floats(0.1, 50.0)), draw(st.tuples(*[st.floats(0.05, 2.0)] * 3))
    return cuboid(mass, size).transform(draw(poses))


def same(one, two, tolerance=1e-9):
    assert one.mass == pytest.approx(two.mass, rel=1e-12)
    scale = 1.0 + float(np.abs(one.inertia).max())
    assert one.centre == pytest.approx(two.centre, abs=tolerance)
    assert one.inertia == pytest.approx(two.inertia, abs=tolerance * scale)


def test_unequal_parts_are_the_whole():
    parts = [cuboid(size, (size, 1, 1), (at, 0, 0)) for size, at in ((1, 0.5), (3, 2.5), (4, 6.0))]
    same(reduce(add, parts), cuboid(8.0, (8, 1, 1), (4, 0, 0)), 1e-13)
    halves = [cuboid(3.0, (1, 2, 4), (at, 0, 0)) for at in (-0.5, 0.5)]
    same(add(*halves), cuboid(6.0, (2, 2, 4)), 1e-14)


def test_a_far_pair_keeps_its_digits():
    """Two halves 1e8 m away: the inertia has no large numbers to lose digits between."""
    halves = [cuboid(1.0, (1, 1, 1), (1e8 + at, 0, 0)) for at in (0.0, 1.0)]
    assert (halves[0] + halves[1]).inertia == pytest.approx(cuboid(2.0, (2, 1, 1)).inertia)


@given(bodies(), bodies(), poses)
def test_bodies_may_be_joined_in_any_frame(one, two, pose):
    same((one + two).transform(pose), one.transform(pose) + two.transform(pose), 1e-8)


@given(bodies(), poses, poses)
def test_frames_follow_one_another(body, first, second):
    same(body.transform(first).transform(second), body.transform(second @ first), 1e-8)
    same(body.transform(first).transform(inverse_pose(first)), body, 1e-8)


@given(bodies(), vectors)
def test_inertia_about_a_point_is_that_of_a_frame_there(body, point):
    moved = body.transform(pose_matrix(np.eye(3), -point))
    assert moved.inertia_about(np.zeros(3)) == pytest.approx(body.inertia_about(point), abs=1e-7)
    assert body.inertia_about(body.centre) == pytest.approx(body.inertia, abs=1e-12)


def test_a_point_at_the_end_of_an_arm():
    """Sphere of mass 2 and radius 0.1, 3 m along x from the point."""
    ball = MassProperties(2.0, np.array([3.0, 0, 0]), 0.4 * 2.0 * 0.01 * np.eye(3))
    assert ball.inertia_about([0, 0, 0]) == pytest.approx(np.diag([0.008, 18.008, 18.008]))


@given(bodies())
def test_principal_axes_are_a_right_handed_frame_that_makes_the_tensor_diagonal(body):
    moments, axes = body.principal_inertia.moments, body.principal_inertia.axes
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert list(moments) == sorted(moments)
    tensor = axes @ np.diag(moments) @ axes.T
    assert tensor == pytest.approx(body.inertia, abs=1e-10 * moments[2])


@given(bodies(), rotations)
def test_turning_changes_no_principal_moment(body, turn):
    turned = body.transform(pose_matrix(turn, np.zeros(3)))
    assert turned.principal_inertia.moments == pytest.approx(
        body.principal_inertia.moments, rel=1e-8
    )


def test_a_known_principal_frame_is_found():
    turn = matrix_from_rotation_vector([0.2, -0.1, 0.3])
    body = cuboid(6.0, (3.0, 2.0, 1.0)).transform(pose_matrix(turn, np.zeros(3)))
    assert body.principal_inertia.moments == pytest.approx([2.5, 5.0, 6.5])
    assert np.abs(body.principal_inertia.axes.T @ turn) == pytest.approx(np.eye(3), abs=1e-12)


@given(bodies(), st.floats(0.1, 100.0))
def test_another_mass_is_another_density(body, mass):
    other = body.with_mass(mass)
    assert other.mass == mass
    assert other.inertia / mass == pytest.approx(body.inertia / body.mass, rel=1e-12)
    assert (other.centre == body.centre).all()


@pytest.mark.parametrize(
    ("mass", "centre", "inertia", "said"),
    [
        (0.0, np.zeros(3), np.eye(3), "above zero"),
        (-1.0, np.zeros(3), np.eye(3), "above zero"),
        (np.nan, np.zeros(3), np.eye(3), "above zero"),
        (np.inf, np.zeros(3), np.eye(3), "above zero"),
        (1.0, np.zeros(2), np.eye(3), "shape"),
        (1.0, np.zeros(3), np.ones(3), "shape"),
        (1.0, np.array([0, np.nan, 0]), np.eye(3), "finite"),
        (1.0, np.zeros(3), np.full((3, 3), np.inf), "finite"),
        (1.0, np.zeros(3), np.eye(3) + np.triu(np.ones((3, 3)), 1) / 10, "symmetric"),
        (1.0, np.zeros(3), np.diag([1.0, 1.0, 2.1]), "no body"),
        (1.0, np.zeros(3), np.diag([-0.1, 1.0, 1.0]), "no body"),
    ],
)
def test_what_no_body_has_is_refused(mass, centre, inertia, said):
    with pytest.raises(ValueError, match=said):
        MassProperties(mass, centre, inertia)


def test_a_rod_and_a_plate_are_bodies():
    assert cuboid(1.0, (1, 0, 0)).inertia == pytest.approx(np.diag([0, 1 / 12, 1 / 12]))
    assert cuboid(1.0, (1, 1, 0)).inertia == pytest.approx(np.diag([1, 1, 2]) / 12)
