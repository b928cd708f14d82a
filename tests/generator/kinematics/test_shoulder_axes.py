"""Directions and turns of the arm in the torso's frame: x ahead, y left, z up."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.kinematics.shoulder import (
    DE_GROOT_BRAND,
    OTANI,
    Side,
    angle_between,
    arm_direction,
    arm_orientation,
    clavicle_orientation,
    printed_angle_error,
    shoulder_angles,
)

ANGLES = st.floats(-7.0, 7.0)
LATITUDES = st.floats(0.0, np.pi)
MIRROR = np.diag([1.0, -1.0, 1.0])
DOWN = np.array([0.0, 0.0, -1.0])


@pytest.mark.parametrize(
    ("latitude", "longitude", "direction"),
    [(0, 50, (0, 0, 1)), (180, 50, (0, 0, -1)), (90, 0, (1, 0, 0)), (90, 90, (0, 1, 0))],
)
def test_directions(latitude, longitude, direction):
    where = np.radians(latitude), np.radians(longitude)
    assert arm_direction(*where) == pytest.approx(np.array(direction), abs=1e-15)


@given(LATITUDES, ANGLES, ANGLES, st.sampled_from(Side))
def test_an_arm_turned_from_hanging_points_where_it_should(latitude, longitude, twist, side):
    turn = arm_orientation(latitude, longitude, twist, side)
    assert turn @ DOWN == pytest.approx(arm_direction(latitude, longitude, side), abs=1e-12)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)


@given(LATITUDES, ANGLES, ANGLES)
def test_the_right_side_is_the_mirror_image(latitude, longitude, twist):
    left, right = (arm_orientation(latitude, longitude, twist, side) for side in Side)
    assert right == pytest.approx(MIRROR @ left @ MIRROR, abs=1e-12)
    left, right = (clavicle_orientation(longitude, twist, side) for side in Side)
    assert right == pytest.approx(MIRROR @ left @ MIRROR, abs=1e-12)
    left, right = (arm_direction(latitude, longitude, side) for side in Side)
    assert right == pytest.approx(MIRROR @ left, abs=1e-12)


def test_a_clavicle_is_raised_and_swung_forwards():
    left = np.array([0.0, 1.0, 0.0])
    assert clavicle_orientation(np.radians(30.0), 0.0) @ left == pytest.approx([0, 0.75**0.5, 0.5])
    assert clavicle_orientation(0.0, np.radians(30.0)) @ left == pytest.approx([0.5, 0.75**0.5, 0])
    both = clavicle_orientation(np.radians(30.0), np.radians(90.0)) @ left
    assert both == pytest.approx([0.75**0.5, 0.0, 0.5])


def test_hanging_is_no_turn():
    latitude, longitude = np.pi, np.linspace(-1.5, 4.7, 30)
    turns = arm_orientation(latitude, longitude, shoulder_angles(latitude, longitude).twist)
    assert turns == pytest.approx(np.broadcast_to(np.eye(3), turns.shape), abs=1e-12)


def test_the_printed_angles_hit_on_a_clavicle_that_keeps_still():
    class Still:
        name, references, breaks = "still", (), ()

        def clavicle(self, elevation, plane):
            return np.zeros_like(elevation), np.zeros_like(plane)

    latitude, longitude = np.meshgrid(np.linspace(0, np.pi, 19), np.linspace(-1.5, 4.7, 25))
    angles = shoulder_angles(latitude, longitude, Still())
    assert printed_angle_error(latitude, longitude, angles) == pytest.approx(0.0, abs=1e-12)


def test_the_printed_angles_hit_where_rotations_do_subtract():
    """In the frontal plane the thesis's clavicle turns about the axis of the arm's elevation."""
    latitude = np.radians(np.arange(0.0, 181.0, 5.0))
    angles = shoulder_angles(latitude, np.pi / 2)
    assert printed_angle_error(latitude, np.pi / 2, angles) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("rhythm", [OTANI, DE_GROOT_BRAND])
def test_the_printed_angles_miss_ahead(rhythm):
    """Worked with plain rotations: the clavicle's turn of the printed direction on it."""
    angles = shoulder_angles(np.pi / 2, 0.0, rhythm)
    up, forwards = angles.clavicle_elevation, angles.clavicle_abduction
    on = np.array(
        [
            np.sin(angles.humerus_elevation) * np.sin(angles.humerus_abduction),
            np.sin(angles.humerus_elevation) * np.cos(angles.humerus_abduction),
            -np.cos(angles.humerus_elevation),
        ]
    )
    raised = [
        on[0],
        np.cos(up) * on[1] - np.sin(up) * on[2],
        np.sin(up) * on[1] + np.cos(up) * on[2],
    ]
    ahead = np.cos(forwards) * raised[0] + np.sin(forwards) * raised[1]
    missed = printed_angle_error(np.pi / 2, 0.0, angles)
    assert missed == pytest.approx(np.arccos(ahead), abs=1e-9)
    assert np.degrees(missed) > 5.0


def test_small_angles_are_kept():
    one, other = np.array([1.0, 0.0, 0.0]), np.array([1.0, 1e-12, 0.0])
    assert angle_between(one, other) == pytest.approx(1e-12, rel=1e-9)
