"""What is said of jumps is what the angles do."""

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
    angle_between,
    arm_direction,
    arm_orientation,
    jumps_near,
    shoulder_angles,
)


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


def test_below_the_level_there_is_no_seam():
    assert near(100.0, 225.0) == []


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


def test_a_common_posture_is_near_none():
    assert near(80.0, 40.0) == []
    assert near(80.0, 40.0, DE_GROOT_BRAND) == []


def test_what_is_no_direction_is_refused():
    with pytest.raises(ModelError, match="between 0 deg"):
        jumps_near(4.0, 0.0, OTANI)


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
