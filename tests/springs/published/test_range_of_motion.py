from math import degrees

import pytest

from springs.published.range_of_motion import PREFERRED_PUBLICATIONS, normal_range


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
        ("shoulder", "abduction", -30.0, 184.0),
        ("neck", "lateral bend to the right", -38.5, 38.5),
        ("waist", "lumbar flexion", -21.8, 69.6),
        ("thorax", "twist to the left", -38.0, 38.0),
        ("left_wrist", "flexion", -75.0, 76.0),
        ("left_wrist", "radial deviation", -36.0, 22.0),
        ("left_wrist", "forearm pronation", -85.0, 76.9),
        ("left_ankle", "dorsiflexion", -50.0, 20.0),
        ("left_ankle", "plantarflexion", -20.0, 50.0),
        ("left_ankle", "inversion", -15.0, 35.0),
        ("right_knee", "extension", -137.7, 1.0),
        ("left_elbow", "knee flexion", -1.0, 137.7),
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


def test_a_part_without_ranges_falls_back_on_the_joint():
    _, upper = normal_range("elbow", "waist supination")
    assert upper is None
    _, upper = normal_range("elbow", "forearm flexion")
    assert upper is not None
    assert upper.motion == "elbow flexion"


def test_the_order_of_publications_is_that_of_their_preference():
    sources = ("macedo_magee_2009", *PREFERRED_PUBLICATIONS)
    _, upper = normal_range("left_wrist", "flexion", sources)
    assert upper is not None
    assert (upper.source, round(degrees(upper.angle), 6)) == ("macedo_magee_2009", 93.0)
    assert normal_range("left_wrist", "flexion", ()) == (None, None)


def test_a_rule_of_this_project_is_an_estimate():
    lower, upper = normal_range("waist", "lumbar twist to the left")
    assert lower is not None
    assert upper is not None
    assert lower.is_estimate
    _, measured = normal_range("waist", "twist to the left")
    assert measured is not None
    assert not measured.is_estimate
