"""The shoulder's angles: the thesis's numbers, and where they are continuous."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import ModelError
from generator.kinematics.shoulder import (
    MAX_LONGITUDE,
    MIN_LONGITUDE,
    RHYTHMS,
    TWIST_SEAM_LONGITUDE,
    arm_orientation,
    shoulder_angles,
)

LATITUDES = st.floats(0.0, np.pi)
LONGITUDES = st.floats(MIN_LONGITUDE, MAX_LONGITUDE)
TURN = 2.0 * np.pi


def grid(steps):
    """Latitudes and longitudes of the whole sphere, `steps` cells a quarter turn."""
    return np.meshgrid(
        np.linspace(0.0, np.pi, 2 * steps + 1),
        np.linspace(MIN_LONGITUDE, MAX_LONGITUDE, 4 * steps + 1),
        indexing="ij",
    )


def attitudes(latitude, longitude):
    return arm_orientation(latitude, longitude, shoulder_angles(latitude, longitude).twist)


def turned(one, other):
    """Angle between orientations (..., 3, 3) [rad]."""
    cosine = (np.einsum("...ij,...ij->...", one, other) - 1.0) / 2.0
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def largest_steps(steps):
    """Largest turn between neighbours of the grid, off the seam and across it [rad]."""
    latitude, longitude = grid(steps)
    arms = attitudes(latitude, longitude)
    down, along = turned(arms[1:], arms[:-1]), turned(arms[:, 1:], arms[:, :-1])
    middle = (longitude[:, 1:] + longitude[:, :-1]) / 2.0
    seam = (np.abs(middle - TWIST_SEAM_LONGITUDE) < np.pi / steps) & (latitude[:, 1:] < np.pi / 2.0)
    return max(down.max(), along[~seam].max()), along[seam].max()


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


def test_the_twist_is_continuous_but_for_the_seam():
    (coarse, seam), (fine, still) = largest_steps(60), largest_steps(120)
    assert fine < 0.55 * coarse
    assert seam > np.radians(170.0)
    assert still > np.radians(170.0)


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
    for function in (shoulder_angles,):
        with pytest.raises(ModelError, match=said):
            function(latitude, longitude)
