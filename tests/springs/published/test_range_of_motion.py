from math import degrees

import pytest

from springs.published.range_of_motion import normal_range


@pytest.mark.parametrize(
    ("joint", "motion", "low", "high"),
    [
        ("left_elbow", "flexion", -0.8, 144.6),
        ("right_knee", "flexion", -1.0, 137.7),
        ("left_hip_joint", "flexion", -17.4, 130.4),
        ("left_hip_joint", "medial rotation", -41.8, 35.2),
        ("left_shoulder", "flexion", -62.0, 168.8),
        ("waist", "twist to the left", -45.0, 45.0),
        ("waist", "lateral bend to the right", -35.0, 35.0),
        ("shoulder", "abduction", None, 184.0),
        ("left_ankle", "flexion", None, None),
        ("knee", "", None, None),
        ("hinge", "swing", None, None),
    ],
)
def test_normal_ranges(joint: str, motion: str, low: float | None, high: float | None):
    ends = normal_range(joint, motion)
    assert all(end is None or end.reference.text for end in ends)
    found = [None if end is None else round(degrees(end.angle), 6) for end in ends]
    assert found == [low, high]
