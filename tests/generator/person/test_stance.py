"""The stance of a person: clear of itself, flat on the ground, and with the inertia of people."""

from collections.abc import Iterator, Mapping
from math import cos, degrees

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from generator.contact.self_contact import unjoined_pairs
from generator.figure import Figure
from generator.geometry.intersections import triangles_intersect, triangulate
from generator.geometry.surface import Array, Surface
from generator.geometry.validate import winding_numbers
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.person.body import Body, build_body
from generator.person.densities import place_surfaces
from generator.person.joints import person_figure
from generator.person.measures import estimate_measures
from generator.person.shape import body_surfaces
from generator.person.sources import Origin
from generator.person.stance import (
    FREE_ARM,
    FREE_LEG,
    LEAST_LEGS,
    MAX_ARMS,
    MAX_LEGS,
    stance_sources,
    standing_stance,
)
from generator.person.survey import Sex
from plots.person_facts import person_facts
from plots.whole_body import mass_properties

PERSONS = [
    (Sex.MALE, 1.756, 85.5),
    (Sex.FEMALE, 1.628, 67.8),
    (Sex.MALE, 1.55, 90.0),
    (Sex.FEMALE, 1.55, 90.0),
    (Sex.MALE, 1.60, 120.0),
    (Sex.FEMALE, 1.60, 120.0),
    (Sex.MALE, 1.95, 70.0),
    (Sex.FEMALE, 1.70, 48.0),
]

people = st.tuples(st.sampled_from(Sex), st.floats(1.45, 2.05), st.floats(17.0, 50.0))
"""Sex, stature [m] and mass over its square [kg/m2]."""


def body_of(sex: Sex, stature: float, mass: float) -> Body:
    return build_body(estimate_measures(sex, stature, mass))


def long_axis_inertia(figure: Figure) -> float:
    """Moment of inertia about the vertical through the centre of mass [kg m2]."""
    tree = build_tree(figure)
    poses = forward_kinematics(tree, initial_displacements(tree)).poses
    return float(mass_properties(figure, poses).inertia[1, 1])


def free_triangles(body: Body, name: str, surface: Surface, pair: tuple[str, str]) -> Array:
    """Triangles of a segment that must be clear of the other of a pair, in its frame, (n, 3, 3).

    Upper arms may lie against the trunk above `FREE_ARM` of their length, thighs against each other
    above `FREE_LEG`.
    """
    corners, _ = triangulate(surface)
    other = pair[0] if pair[1] == name else pair[1]
    if name.endswith("upper_arm") and "torso" in other:
        least = FREE_ARM * body.segments["upper_arm"].length
    elif name.endswith("upper_leg") and other.endswith("upper_leg"):
        least = FREE_LEG * body.segments["upper_leg"].length
    else:
        return corners
    return corners[(corners[..., 2] >= least).all(axis=1)]


def penetrations(body: Body, arms: float | None = None, legs: float | None = None) -> Iterator[str]:
    """Yield the pairs of limbs, or limb and trunk, without a common joint whose surfaces meet.

    The ends of thighs and trunk parts that meet within the pelvis are hidden there.
    """
    figure, surfaces = person_figure(body), body_surfaces(body)
    placed = place_surfaces(figure, surfaces, arms, legs)
    for pair in unjoined_pairs(figure):
        if not any(name.endswith(("arm", "hand", "leg", "foot")) for name in pair):
            continue
        if "middle_torso" in pair and any(name.endswith("upper_leg") for name in pair):
            continue
        chosen = [
            placed_triangles(free_triangles(body, name, own, pair), own, placed[name])
            for name, own in ((name, surface_in(surfaces, name)) for name in pair)
        ]
        if meet(*chosen):
            yield " in ".join(sorted(pair))


def surface_in(surfaces: Mapping[str, Surface], name: str) -> Surface:
    return surfaces[name.removeprefix("left_").removeprefix("right_")]


def placed_triangles(chosen: Array, own: Surface, placed: Surface) -> Array:
    """Triangles of a placed surface, those that are chosen in its own frame."""
    kept = {triangle.tobytes() for triangle in chosen}
    here = [triangle.tobytes() in kept for triangle in triangulate(own)[0]]
    return triangulate(placed)[0][here]


def meet(first: Array, second: Array) -> bool:
    """Return whether two sets of triangles intersect, or one is inside the other."""
    boxes = [(each.min(axis=(0, 1)), each.max(axis=(0, 1))) for each in (first, second)]
    if (boxes[0][0] > boxes[1][1]).any() or (boxes[1][0] > boxes[0][1]).any():
        return False
    if triangles_intersect(first, second):
        return True
    inside = [
        winding_numbers(one, other[:, 0]).max() > 0.5
        for one, other in ((first, second), (second, first))
    ]
    return any(inside)


@pytest.mark.parametrize(
    "case",
    [pytest.param(one, marks=pytest.mark.slow) if one in PERSONS[2:7] else one for one in PERSONS],
)
def test_no_limb_is_within_another_segment(case: tuple[Sex, float, float]):
    assert list(penetrations(body_of(*case))) == []


@pytest.mark.slow
def test_straight_limbs_would_be_within_others():
    """Without the stance forearms and hands vanish in hips and thighs of a heavy person."""
    found = set(penetrations(body_of(Sex.MALE, 1.55, 90.0), arms=0.0, legs=0.0))
    assert {
        "left_hand in left_upper_leg",
        "left_lower_arm in lower_torso",
        "left_lower_arm in middle_torso",
        "left_upper_leg in right_upper_leg",
    } <= found


@settings(max_examples=10, deadline=None)
@given(people)
def test_soles_are_flat_on_the_ground(person: tuple[Sex, float, float]):
    sex, stature, index = person
    body = body_of(sex, stature, index * stature**2)
    figure, stance = person_figure(body), standing_stance(body)
    tree = build_tree(figure)
    poses = forward_kinematics(tree, initial_displacements(tree)).poses
    for side in ("left", "right"):
        foot = figure.segments[f"{side}_foot"]
        for site in ("distal", "heel", "sole"):
            place = poses[foot.name] @ foot.sites[site].pose_in_segment
            assert place[1, 3] == pytest.approx(0.0, abs=1e-12)
    head = poses["head"] @ figure.segments["head"].sites["distal"].pose_in_segment
    lower = (1.0 - cos(stance.legs)) * (body.hip_height - body.ankle_height)
    assert head[1, 3] == pytest.approx(stature - lower, abs=1e-12)
    hands, feet = (
        [poses[f"{side}_{name}"][:3, 3] for side in ("left", "right")] for name in ("hand", "foot")
    )
    for left, right in (hands, feet):
        assert left * [-1.0, 1.0, 1.0] == pytest.approx(right, abs=1e-12)
        assert left[0] > 0.0


def test_slim_people_stand_nearly_straight():
    for sex, stature, mass in PERSONS[-2:]:
        stance = standing_stance(body_of(sex, stature, mass))
        assert 0.0 < degrees(stance.arms) < 6.0
        assert stance.legs == LEAST_LEGS


@settings(max_examples=15, deadline=None)
@given(people)
@example((Sex.MALE, 1.89, 25.0))
def test_the_stance_has_no_step(person: tuple[Sex, float, float]):
    """A step of a millionth of stature and mass turns no limb by more than some millionths."""
    sex, stature, index = person
    mass, step = index * stature**2, 1e-6
    here = standing_stance(body_of(sex, stature, mass))
    for tall, heavy in ((1.0 + step, 1.0), (1.0, 1.0 + step)):
        there = standing_stance(body_of(sex, tall * stature, heavy * mass))
        assert there.arms == pytest.approx(here.arms, abs=2e-5)
        assert there.legs == pytest.approx(here.legs, abs=2e-5)
        assert 0.0 <= there.arms <= MAX_ARMS
        assert LEAST_LEGS <= there.legs <= MAX_LEGS


def test_the_long_axis_has_the_inertia_of_measured_men():
    ratios = [
        long_axis_inertia(person_figure(body_of(Sex.MALE, man.stature, man.mass)))
        / man.postures["standing"].moments[2]
        for man in person_facts().men
    ]
    fact = person_facts().facts["body_inertia_ratio"]
    assert fact.low < np.mean(ratios) < fact.high


def test_angles_are_displacements_and_the_joints_keep_their_zero():
    body = body_of(*PERSONS[4])
    figure, stance = person_figure(body), standing_stance(body)
    for side in ("left", "right"):
        assert figure.joints[f"{side}_shoulder"].displacement == (0.0, stance.arms, 0.0)
        assert figure.joints[f"{side}_hip_joint"].displacement == (0.0, stance.legs, 0.0)
        assert figure.joints[f"{side}_ankle"].displacement == (stance.legs, 0.0)
    tree = build_tree(figure)
    zero = {name: np.zeros_like(row) for name, row in initial_displacements(tree).items()}
    straight = forward_kinematics(tree, zero).poses
    shoulder, hand = (straight[f"left_{name}"][:3, 3] for name in ("upper_arm", "hand"))
    assert hand[[0, 2]] == pytest.approx(shoulder[[0, 2]], abs=1e-12)


def test_the_stance_has_its_sources():
    body = body_of(*PERSONS[4])
    stance, rows = standing_stance(body), stance_sources(body)
    assert [row.value for row in rows] == [stance.arms, stance.legs, stance.legs]
    assert all(row.origin is Origin.ESTIMATE and row.rule for row in rows)
