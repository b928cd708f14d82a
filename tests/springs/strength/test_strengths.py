"""Strengths by joint and motion."""

import pytest

from springs.strength.strengths import (
    Body,
    StrengthClass,
    strength,
    strength_rows,
    women_factor,
)

MAN = Body(72.0, 1.75)
WOMAN = Body(60.0, 1.63, is_female=True)


def test_knee_is_within_the_norms() -> None:
    # Sarabon, Kozinc & Perman 2021: mid-range, N m/kg; the extension of these men is 4 % under.
    found = strength("left_knee", "flexion", MAN)
    assert found is not None
    assert found.origin is StrengthClass.PUBLISHED
    flexion, extension = (torque / MAN.mass for torque in found.largest)
    assert 1.15 <= flexion <= 1.62
    assert 0.95 * 2.92 <= extension <= 3.45
    of_women = strength("right_knee", "flexion", WOMAN)
    assert of_women is not None
    assert 2.08 <= of_women.largest[1] / WOMAN.mass <= 2.74


def test_opposite_motion_exchanges_the_directions() -> None:
    flexion, extension = (strength("neck", motion) for motion in ("flexion", "extension"))
    assert flexion is not None
    assert extension is not None
    assert flexion.largest == (30.0, 51.0)
    assert extension.largest == (51.0, 30.0)


@pytest.mark.parametrize(
    ("joint", "motion", "largest"),
    [
        ("waist", "lumbar lateral bend to the right", (150.0, 150.0)),
        ("left_elbow", "forearm pronation", (9.0, 9.0)),
        ("neck", "twist to the left", (13.0, 13.0)),
        ("left_hip_joint", "abduction", (100.0, 100.0)),
    ],
)
def test_motions_of_persons(joint: str, motion: str, largest: tuple[float, float]) -> None:
    found = strength(joint, motion)
    assert found is not None
    assert found.largest == largest


def test_women_have_a_share_where_only_men_were_measured() -> None:
    men, women = strength("neck", "flexion", MAN), strength("neck", "flexion", WOMAN)
    assert men is not None
    assert women is not None
    assert women.largest[0] == pytest.approx(women_factor() * men.largest[0])
    assert women.origin is StrengthClass.ESTIMATE
    assert men.origin is StrengthClass.PUBLISHED


def test_unknown_motions_and_bodies_have_none() -> None:
    assert strength("left_knee", "rotation", MAN) is None
    assert strength("hinge", "", MAN) is None
    assert strength("left_knee", "flexion") is None


def test_every_row_has_numbers_and_a_source_unless_it_is_an_estimate() -> None:
    assert len(strength_rows()) > 20
    for row in strength_rows():
        assert (row.torque is None) != (row.share is None)
        assert bool(row.reference) == (row.origin is not StrengthClass.ESTIMATE), row.motion
        assert min(row.torque or row.share or ()) > 0.0
        largest = row.torque or row.share
        assert largest is not None
        assert max(largest) <= 3.0 * min(largest), "the bound of each direction needs this"
