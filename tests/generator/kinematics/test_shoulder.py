"""The shoulder's angles, rhythms and jumps, and the arm in the torso: x ahead, y left, z up."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.diagnostics import ModelError
from generator.kinematics.shoulder import (
    DE_GROOT_BRAND,
    MAX_LONGITUDE,
    MIN_LONGITUDE,
    NEARBY_ANGLE,
    OTANI,
    RHYTHMS,
    TWIST_SEAM_LONGITUDE,
    Side,
    angle_between,
    arm_direction,
    arm_orientation,
    clavicle_orientation,
    jumps_near,
    printed_angle_error,
    shoulder_angles,
)

LATITUDES = st.floats(0.0, np.pi)
LONGITUDES = st.floats(MIN_LONGITUDE, MAX_LONGITUDE)
TURN = 2.0 * np.pi


def attitudes(latitude, longitude):
    return arm_orientation(latitude, longitude, shoulder_angles(latitude, longitude).twist)


def turned(one, other):
    """Angle between orientations (..., 3, 3) [rad]."""
    cosine = (np.einsum("...ij,...ij->...", one, other) - 1.0) / 2.0
    return np.arccos(np.clip(cosine, -1.0, 1.0))


@pytest.mark.parametrize(
    ("elevation", "frontal", "sagittal"),
    [(0.0, 1.076, 2.348), (90.0, 23.702, 21.3074), (131.4, 34.10996, 30.0), (150.0, 33.45, 30.0)],
)
def test_clavicle_elevations_worked_by_hand(elevation, frontal, sagittal):
    latitude = np.radians(180.0 - elevation)
    to_the_side, ahead = shoulder_angles(latitude, np.pi / 2), shoulder_angles(latitude, 0.0)
    assert np.degrees(to_the_side.clavicle_elevation) == pytest.approx(frontal, abs=1e-9)
    assert np.degrees(ahead.clavicle_elevation) == pytest.approx(sagittal, abs=1e-9)
    assert np.degrees(to_the_side.clavicle_abduction) == pytest.approx(0.0, abs=1e-9)
    assert np.degrees(ahead.clavicle_abduction) == pytest.approx(18.0, abs=1e-9)


@pytest.mark.parametrize(
    ("latitude", "longitude", "twist"),
    [
        (0, 0, 180),
        (90, 0, 180),
        (45, 60, 150),
        (135, -30, -195),  # the corrected row; as printed it would be 135
        (135, 45, -157.5),
        (120, 180, 0),
        (150, 240, 80),
        (60, 120, -180),
        (30, 200, 120),
        (30, 250, -120),
        (90, 225, 90),
    ],
)
def test_twists_worked_by_hand(latitude, longitude, twist):
    found = shoulder_angles(np.radians(latitude), np.radians(longitude)).twist
    off = (np.degrees(found) - twist) / 360.0
    assert off == pytest.approx(np.round(off), abs=1e-12)


def test_the_twist_continues_where_the_longitude_starts_again():
    latitude = np.linspace(0.0, np.pi, 181)
    first, last = attitudes(latitude, MIN_LONGITUDE), attitudes(latitude, MAX_LONGITUDE)
    assert first == pytest.approx(last, abs=1e-12)


@pytest.mark.parametrize("pole", [0.0, np.pi])
def test_the_twist_makes_one_attitude_of_each_pole(pole):
    arms = attitudes(pole, np.linspace(MIN_LONGITUDE, MAX_LONGITUDE, 721))
    assert np.ptp(arms, axis=0).max() < 1e-12


def test_the_seam_closes_at_45_deg_and_is_half_a_turn_at_22_and_67():
    latitude = np.radians([0.0, 22.5, 45.0, 67.5, 90.0])
    before, behind = (attitudes(latitude, TWIST_SEAM_LONGITUDE + step) for step in (-1e-9, 1e-9))
    closed, half = 0.0, np.pi
    assert turned(before, behind) == pytest.approx([closed, half, closed, half, closed], abs=1e-6)


def test_on_the_seam_the_twist_is_the_middle_of_its_limits():
    latitude = np.radians(30.0)
    middle = (
        shoulder_angles(latitude, TWIST_SEAM_LONGITUDE - 1e-9).twist
        + shoulder_angles(latitude, TWIST_SEAM_LONGITUDE + 1e-9).twist
    ) / 2.0
    assert shoulder_angles(latitude, TWIST_SEAM_LONGITUDE).twist == pytest.approx(middle, abs=1e-6)


def test_the_printed_clavicle_jumps_where_the_longitude_starts_again_and_at_130_deg():
    level = shoulder_angles(np.pi / 2, [MIN_LONGITUDE, MAX_LONGITUDE])
    assert np.degrees(np.ptp(level.clavicle_abduction)) == pytest.approx(72.0)
    assert np.ptp(level.clavicle_elevation) == pytest.approx(0.0, abs=1e-12)
    at = np.pi - np.radians(130.0)
    ahead = shoulder_angles([at - 1e-9, at + 1e-9], 0.0).clavicle_elevation
    assert np.degrees(ahead[0] - ahead[1]) == pytest.approx(120.0 - 119.7338, abs=1e-6)


@given(LATITUDES, LONGITUDES, st.integers(-3, 3), st.sampled_from(sorted(RHYTHMS)))
def test_whole_turns_of_the_longitude_change_nothing(latitude, longitude, turns, name):
    if (
        abs(longitude - TWIST_SEAM_LONGITUDE) < 1e-6
        or min(longitude - MIN_LONGITUDE, MAX_LONGITUDE - longitude) < 1e-6
    ):
        return
    one = shoulder_angles(latitude, longitude, RHYTHMS[name])
    other = shoulder_angles(latitude, longitude + turns * TURN, RHYTHMS[name])
    for angle in vars(one):
        assert getattr(one, angle) == pytest.approx(getattr(other, angle), abs=1e-9)


@given(LATITUDES, LONGITUDES, st.sampled_from(sorted(RHYTHMS)))
def test_humerus_and_clavicle_add_up_to_the_arm_as_printed(latitude, longitude, name):
    angles = shoulder_angles(latitude, longitude, RHYTHMS[name])
    raised = angles.humerus_elevation + angles.clavicle_elevation
    swung = angles.humerus_abduction + angles.clavicle_abduction
    assert raised == pytest.approx(np.pi - latitude, abs=1e-12)
    assert swung == pytest.approx(np.pi / 2 - longitude, abs=1e-12)


@pytest.mark.parametrize("name", sorted(RHYTHMS))
def test_arrays_give_what_their_numbers_give(name):
    latitude, longitude = (
        np.linspace(0.0, np.pi, 7)[:, None],
        np.linspace(MIN_LONGITUDE, MAX_LONGITUDE, 9),
    )
    together = shoulder_angles(latitude, longitude, RHYTHMS[name])
    for angle, values in vars(together).items():
        assert values.shape == (7, 9)
        apart = [
            [getattr(shoulder_angles(phi, theta, RHYTHMS[name]), angle) for theta in longitude]
            for phi in latitude[:, 0]
        ]
        assert values == pytest.approx(np.array(apart), abs=1e-15)


@pytest.mark.parametrize(
    ("latitude", "longitude", "said"),
    [
        (-0.01, 0.0, r"between 0 deg \(overhead\) and 180 deg \(hanging\)"),
        (np.pi + 0.01, 0.0, "between 0 deg"),
        (np.nan, 0.0, "finite"),
        (1.0, np.inf, "finite"),
    ],
)
def test_what_is_no_direction_is_refused(latitude, longitude, said):
    for function in (shoulder_angles, partial(jumps_near, rhythm=OTANI)):
        with pytest.raises(ModelError, match=said):
            function(latitude, longitude)


ANGLES = st.floats(-7.0, 7.0)
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


def test_the_regression_worked_by_hand():
    up, forwards = DE_GROOT_BRAND.clavicle(np.radians(90.0), np.radians([0.0, 90.0]))
    raised = 3.917 + 0.123 * 90.0 + (0.493 - 1.0) * 11.680
    swung = -4.983 - 0.242 * 90.0 + (0.851 - 1.0) * -28.573
    assert np.degrees(up) == pytest.approx([raised, raised - 0.046 * 90.0])
    assert np.degrees(forwards) == pytest.approx([swung, swung + 0.120 * 90.0])


def test_between_the_planes_the_thesis_weighs_by_the_cosine():
    elevation = np.radians(60.0)
    (side, oblique, ahead), _ = OTANI.clavicle(elevation, np.radians([0.0, 60.0, 90.0]))
    assert oblique == pytest.approx((side + ahead) / 2.0)


@pytest.mark.parametrize("name", sorted(RHYTHMS))
def test_the_clavicle_moves_up_and_forwards_with_the_arm(name):
    elevation, forward = np.radians(np.arange(0.0, 131.0)), np.radians(np.arange(0.0, 121.0))
    for plane in (0.0, np.pi / 2):
        up, _ = RHYTHMS[name].clavicle(elevation, np.full_like(elevation, plane))
        assert np.all(np.diff(up) > 0.0)
    _, forwards = RHYTHMS[name].clavicle(np.full_like(forward, np.pi / 2), forward)
    assert np.all(np.diff(forwards) > 0.0)


def near(latitude, longitude, rhythm=OTANI):
    """The jumps near a direction [deg]: angle, and size and distance [deg]."""
    jumps = jumps_near(np.radians(latitude), np.radians(longitude), rhythm)
    return [(j.angle, np.degrees(j.size), np.degrees(j.distance)) for j in jumps]


def test_the_seam_behind_the_back():
    ((angle, size, distance),) = near(40.0, 224.0)
    assert angle == "twist"
    assert size == pytest.approx(40.0, abs=1e-4)  # 8 latitudes, less a turn
    assert distance == pytest.approx(np.sin(np.radians(40.0)), rel=1e-3)
    (seam,) = jumps_near(np.radians(40.0), np.radians(224.0), OTANI)
    assert seam.place == "longitude 225 deg, the seam behind the back"


def test_where_the_longitude_starts_again():
    ((angle, size, distance),) = near(90.0, -89.0)
    assert (angle, size, distance) == ("clavicle_abduction", pytest.approx(72.0), pytest.approx(1))
    modern = {angle: size for angle, size, _ in near(90.0, 269.0, DE_GROOT_BRAND)}
    assert modern == pytest.approx(
        {"clavicle_abduction": 360.0 * 0.12, "clavicle_elevation": 360.0 * 0.046}, abs=1e-4
    )


def test_between_two_lines():
    ((angle, size, distance),) = near(51.0, 0.0)
    assert angle == "clavicle_elevation"
    assert size == pytest.approx(0.2662, abs=1e-6)
    assert distance == pytest.approx(1.0)
    sizes = [size for _, size, _ in near(48.6, 90.0)]
    assert sizes == pytest.approx([34.10996 - 34.101], abs=1e-6)
    assert near(50.0, 0.0, DE_GROOT_BRAND) == []


@pytest.mark.parametrize(("latitude", "name"), [(0.5, "overhead"), (179.5, "hanging")])
def test_the_poles(latitude, name):
    jumps = jumps_near(np.radians(latitude), np.radians(30.0), OTANI)
    size = {j.angle: np.degrees(j.size) for j in jumps if f"the arm {name}" in j.place}
    assert set(size) == {"clavicle_abduction", "clavicle_elevation"}
    assert size["clavicle_abduction"] == pytest.approx(72.0)


def test_the_nearest_comes_first():
    distances = [distance for *_, distance in near(1.0, 224.0)]
    assert len(distances) > 2
    assert distances == sorted(distances)


def test_a_common_posture_is_near_none_and_below_the_level_there_is_no_seam():
    assert near(80.0, 40.0) == near(80.0, 40.0, DE_GROOT_BRAND) == near(100.0, 225.0) == []


@settings(max_examples=60)
@given(
    st.floats(0.0, np.pi),
    st.floats(MIN_LONGITUDE, MAX_LONGITUDE),
    st.floats(0.0, 2.0 * np.pi),
    st.sampled_from(sorted(RHYTHMS)),
)
def test_away_from_what_is_told_a_small_motion_is_small(latitude, longitude, way, name):
    if jumps_near(latitude, longitude, RHYTHMS[name], within=0.3 * NEARBY_ANGLE):
        return
    step = 1e-6
    other = (
        float(np.clip(latitude + step * np.cos(way), 0.0, np.pi)),
        longitude + step * np.sin(way) / max(np.sin(latitude), 1e-3),
    )
    moved = angle_between(arm_direction(latitude, longitude), arm_direction(*other))
    here, there = (
        shoulder_angles(latitude, longitude, RHYTHMS[name]),
        shoulder_angles(*other, RHYTHMS[name]),
    )
    slope = 1e3  # the clavicle's angles grow steep near the poles, 1 / sin(latitude)
    for angle in ("clavicle_elevation", "clavicle_abduction"):
        assert abs(getattr(here, angle) - getattr(there, angle)) <= slope * (moved + 1e-9)
    one, two = (
        arm_orientation(*at, shoulder_angles(*at).twist) for at in ((latitude, longitude), other)
    )
    if abs(longitude - TWIST_SEAM_LONGITUDE) > 1e-3:
        assert np.abs(one - two).max() <= slope * (moved + 1e-9)
