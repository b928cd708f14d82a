"""The plate of a person's postures: the landmarks, the partial centres, the rest."""

import numpy as np
import pytest

from generator import build_tree, forward_kinematics, static_torques
from plots.person_facts import person_facts
from plots.plate import Outcome
from plots.plates.person_posture import LANDMARKS, PERSONS, ear_below_vertex, stand
from tests.plots.drawn import data, plate


@pytest.mark.parametrize("name", PERSONS)
def test_the_landmarks_are_where_people_have_them(name: str) -> None:
    standing = data("person_posture").standing[name]
    facts = person_facts().facts
    for landmark in LANDMARKS[1:]:
        forward, _ = standing.landmarks[landmark]
        assert 100.0 * forward == pytest.approx(facts[f"{landmark}_before_ankle"].value)
    assert standing.landmarks["ankle"][0] == pytest.approx(0.0, abs=1e-12)
    heights = [standing.landmarks[landmark][1] for landmark in LANDMARKS]
    assert heights == sorted(heights)
    flat = standing.poses["left_foot"][:3, :3]
    upright = forward_kinematics(
        build_tree(standing.body),
        {one: np.zeros(joint.degrees_of_freedom) for one, joint in standing.body.joints.items()},
    ).poses["left_foot"][:3, :3]
    assert flat == pytest.approx(upright, abs=1e-12)


def test_the_centre_of_all_is_that_of_its_parts() -> None:
    """All above the knee and the four segments below it make the whole."""
    standing = data("person_posture").standing["male50"]
    body = standing.body
    below = [f"{side}_{name}" for side in ("left", "right") for name in ("lower_leg", "foot")]
    mass = {name: body.segments[name].mass for name in body.bodies}
    whole, _ = standing.centre_above(())
    above, _ = standing.centre_above(below)
    others = [name for name in body.bodies if name not in below]
    legs, _ = standing.centre_above(others)
    share = sum(mass[name] for name in below) / sum(mass.values())
    assert whole == pytest.approx((1.0 - share) * above + share * legs)
    assert standing.centre_in_front("knee") == pytest.approx(
        100.0 * (above - standing.landmarks["knee"][0])
    )


def test_standing_people_agree() -> None:
    claims = [c for c in plate("person_posture").claims if c.sentence.startswith("Standing")]
    assert len(claims) == 4
    assert all(claim.outcome is Outcome.AGREES for claim in claims)


def test_a_lower_ear_bends_the_head_further() -> None:
    one = data("person_posture").standing["male50"]
    other = stand(one.body, ear_below_vertex("male50") + 0.05)
    assert other.landmarks["ear"][0] == pytest.approx(one.landmarks["ear"][0])
    assert other.centre_in_front("hip") > one.centre_in_front("hip") + 0.01


@pytest.mark.parametrize("name", ["man", "man with Riener's leg"])
def test_the_angle_is_that_of_hip_and_spine(name: str) -> None:
    relaxed = data("person_posture").relaxed[name]
    bent = relaxed.angle("left_hip_joint", 2)
    assert relaxed.trunk_to_thigh == pytest.approx(180.0 - bent, abs=5.0)
    for joint in ("hip_joint", "knee", "elbow"):
        left, right = (relaxed.displacements[f"{side}_{joint}"] for side in ("left", "right"))
        assert left[-1] == pytest.approx(right[-1], abs=1e-3)


def test_without_gravity_no_torque_is_left() -> None:
    relaxed = data("person_posture").relaxed["man"]
    standing = {name: np.zeros_like(values) for name, values in relaxed.displacements.items()}
    torques = static_torques(relaxed.body, [relaxed.displacements, standing])
    for name, rows in torques.items():
        assert np.abs(rows[0]).max() < 1e-6, name
    assert max(np.abs(rows[1]).max() for rows in torques.values()) > 1.0


def test_what_differs_says_why() -> None:
    for claim in plate("person_posture").claims:
        assert bool(claim.explanation) == (claim.outcome is not Outcome.AGREES), claim.sentence
