"""Surfaces of a person: closed, of the measured girths, around joints and centres of mass."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.contact.spheres import LARGEST_ERROR
from generator.geometry.intersections import triangles_intersect
from generator.geometry.surface import Array, Surface
from generator.geometry.validate import build_solid, validate_surface, winding_numbers
from generator.person.body import LIMB_SEGMENTS, TRUNK_SEGMENTS, Body, build_body
from generator.person.densities import place_surfaces
from generator.person.joints import person_figure
from generator.person.measures import Sex, estimate_measures
from generator.person.shape import (
    RELAXED_BICEPS,
    RELAXED_FOREARM,
    body_surfaces,
    foot_contact_spheres,
    shape_sources,
)
from generator.person.stance import standing_stance

NEXT_SEGMENTS = {
    "lower_torso": "middle_torso",
    "middle_torso": "upper_torso",
    "upper_torso": "head",
    "upper_arm": "lower_arm",
    "lower_arm": "hand",
    "upper_leg": "lower_leg",
    "lower_leg": "foot",
}

PERSONS = [
    (Sex.MALE, 1.756, 85.5),
    (Sex.FEMALE, 1.628, 67.8),
    (Sex.MALE, 1.7, 140.0),
    (Sex.FEMALE, 1.75, 45.0),
]


def body_of(sex: Sex, stature: float, mass: float, **measured: float) -> Body:
    return build_body(estimate_measures(sex, stature, mass, measured))


@cache
def person(sex: Sex, stature: float, mass: float) -> tuple[Body, dict[str, Surface]]:
    body = body_of(sex, stature, mass)
    return body, dict(body_surfaces(body))


def triangles_of(surface: Surface) -> Array:
    return surface.vertices[surface.corners.reshape(-1, 3)]


def joint_centres(body: Body) -> dict[str, list[tuple[float, float, float]]]:
    """Centres of the joints of each segment, in its frame."""
    centres = {name: [(0.0, 0.0, 0.0)] for name in (*TRUNK_SEGMENTS, *LIMB_SEGMENTS)}
    for name in NEXT_SEGMENTS:
        centres[name].append((0.0, 0.0, body.segments[name].length))
    for side in (-0.5, 0.5):
        centres["lower_torso"].append((0.0, side * body.hip_spacing, 0.0))
        shoulder = (0.0, side * body.shoulder_spacing, body.shoulder_height)
        centres["upper_torso"].append(shoulder)
    return centres


def check_surfaces(body: Body, surfaces: dict[str, Surface]) -> None:
    """Check what holds for the surfaces of every person."""
    assert surfaces.keys() == {*TRUNK_SEGMENTS, *LIMB_SEGMENTS}
    centres = joint_centres(body)
    for name, surface in surfaces.items():
        assert not validate_surface(surface).diagnostics, name
        assert build_solid(surface).volume > 0.0, name
        inner = np.array([*centres[name], body.segments[name].centre])
        assert (winding_numbers(triangles_of(surface), inner) > 0.5).all(), name
    placed = place_surfaces(person_figure(body), surfaces)
    heights = np.concatenate([surface.vertices[:, 1] for surface in placed.values()])
    assert heights.min() == pytest.approx(0.0, abs=2e-5)
    lower = body.hip_height - standing_stance(body).hip_height(body)
    assert heights.max() == pytest.approx(body.measures.stature - lower, abs=2e-5)


@settings(max_examples=6, deadline=None)
@given(st.sampled_from(Sex), st.floats(1.4, 2.1), st.floats(40.0, 150.0))
def test_surfaces_are_closed_around_joints_and_centres_of_mass(
    sex: Sex, stature: float, mass: float
) -> None:
    body = body_of(sex, stature, mass)
    check_surfaces(body, dict(body_surfaces(body)))


@pytest.mark.parametrize("case", PERSONS[1:3])
def test_surfaces_do_not_meet_themselves(case: tuple[Sex, float, float]) -> None:
    for name, surface in person(*case)[1].items():
        triangles = triangles_of(surface)
        assert not triangles_intersect(triangles, triangles), name


def test_left_and_right_share_a_surface_that_is_its_mirror_image() -> None:
    for name, surface in person(*PERSONS[0])[1].items():
        points = {tuple(vertex) for vertex in (surface.vertices + 0.0).tolist()}
        mirrored = {tuple(vertex) for vertex in (surface.vertices * [1, -1, 1] + 0.0).tolist()}
        assert points == mirrored, name


@pytest.mark.parametrize("case", PERSONS)
def test_parts_of_one_limb_share_the_section_at_their_joint(
    case: tuple[Sex, float, float],
) -> None:
    body, surfaces = person(*case)
    for name in ("lower_torso", "middle_torso", "upper_arm", "lower_arm", "upper_leg"):
        end = np.array([0.0, 0.0, body.segments[name].length])
        rings: list[Array] = []
        for surface, origin in ((surfaces[name], end), (surfaces[NEXT_SEGMENTS[name]], 0.0 * end)):
            local = surface.vertices - origin
            rings.append(local[np.abs(local[:, 2]) < 2e-5])
        np.testing.assert_allclose(rings[0], rings[1], atol=3e-5)


def crossings_with_plane(surface: Surface, axis: int, height: float) -> Array:
    """Ends of the lines in which triangles cross the plane across an axis, shape (n, 2, 3)."""
    triangles = triangles_of(surface)
    above = triangles[..., axis] > height + 1.3e-6
    lines: list[Array] = []
    for triangle, side in zip(triangles, above, strict=True):
        if side.any() and not side.all():
            ends: list[Array] = []
            for a, b in ((0, 1), (1, 2), (2, 0)):
                if side[a] != side[b]:
                    part = (height - triangle[a, axis]) / (triangle[b, axis] - triangle[a, axis])
                    ends.append(triangle[a] + part * (triangle[b] - triangle[a]))
            lines.append(np.array(ends))
    return np.array(lines).reshape(-1, 2, 3)


def girth_at(surface: Surface, height: float) -> float:
    """Perimeter of the section of a surface by a plane across z."""
    lines = crossings_with_plane(surface, 2, height)
    return float(np.linalg.norm(lines[:, 0] - lines[:, 1], axis=1).sum())


def tape_around_trunk(placed: Mapping[str, Surface], height: float) -> float:
    """Length of a tape around trunk and thighs of the standing person at a height."""
    from scipy.spatial import ConvexHull

    points: list[Array] = []
    for name, surface in placed.items():
        if "torso" in name or "upper_leg" in name:
            points.append(crossings_with_plane(surface, 1, height).reshape(-1, 3))
    return float(ConvexHull(np.concatenate(points)[:, [0, 2]]).area)


@pytest.mark.parametrize("case", PERSONS[:3])
def test_girths_of_the_trunk_are_those_of_the_measures(case: tuple[Sex, float, float]) -> None:
    body, surfaces = person(*case)
    length = body.measures.length
    waist = body.segments["lower_torso"].length
    thorax = waist + body.segments["middle_torso"].length
    placed = place_surfaces(person_figure(body), surfaces)
    above = standing_stance(body).hip_height(body)
    hips = max(tape_around_trunk(placed, above + height) for height in (0.0, 0.02, 0.04, 0.06))
    assert hips == pytest.approx(length("buttock_circumference"), rel=0.03)
    at_waist, at_chest = (tape_around_trunk(placed, above + height) for height in (waist, thorax))
    assert at_waist == pytest.approx(length("waist_circumference"), rel=0.02)
    assert at_chest == pytest.approx(length("chest_circumference"), rel=0.02)


@pytest.mark.parametrize("case", PERSONS)
def test_girths_of_limbs_are_those_of_the_measures(case: tuple[Sex, float, float]) -> None:
    body, surfaces = person(*case)
    length = body.measures.length
    span = {name: segment.length for name, segment in body.segments.items()}
    fold = length("trochanterion_height") - length("crotch_height") + 0.003
    arm = RELAXED_BICEPS * length("biceps_circumference_flexed")
    forearm = RELAXED_FOREARM * length("forearm_circumference_flexed")
    levels = (
        ("upper_arm", 0.55 * span["upper_arm"], arm),
        ("lower_arm", 0.2 * span["lower_arm"], forearm),
        ("lower_arm", span["lower_arm"], length("wrist_circumference")),
        ("upper_leg", fold, length("thigh_circumference")),
        ("upper_leg", 0.85 * span["upper_leg"], length("lower_thigh_circumference")),
        ("lower_leg", 0.29 * span["lower_leg"], length("calf_circumference")),
        ("lower_leg", 0.87 * span["lower_leg"], length("ankle_circumference")),
    )
    for name, height, expected in levels:
        found = girth_at(surfaces[name], height)
        assert found == pytest.approx(expected, rel=0.03), (name, height)


@pytest.mark.parametrize("case", PERSONS)
def test_breadths_and_lengths_are_those_of_the_measures(case: tuple[Sex, float, float]) -> None:
    body, surfaces = person(*case)
    length = body.measures.length
    head, hand, foot = (surfaces[name].vertices for name in ("head", "hand", "foot"))
    # Above the nose.
    above = head[head[:, 2] > body.segments["head"].length - 0.8 * length("tragion_to_top_of_head")]
    assert np.ptp(above[:, 1]) == pytest.approx(length("head_breadth"), rel=0.01)
    assert np.ptp(above[:, 0]) == pytest.approx(length("head_length"), rel=0.02)
    assert hand[:, 2].max() == pytest.approx(length("hand_length"), abs=1e-5)
    assert np.ptp(foot[:, 0]) == pytest.approx(length("foot_length"), abs=2e-5)
    assert np.ptp(foot[:, 1]) == pytest.approx(length("foot_breadth"), rel=0.01)
    thigh = surfaces["upper_leg"].vertices
    thighs = 2.0 * thigh[thigh[:, 2] < 0.02, 1].max() + body.hip_spacing
    assert thighs == pytest.approx(length("hip_breadth"), rel=0.01)


@pytest.mark.parametrize("turn", [(0, 0, 0), (60, 0, 0), (0, 60, 0), (0, 0, 60), (0, 0, -60)])
@pytest.mark.parametrize("case", PERSONS)
def test_a_bent_neck_turns_within_the_trunk(
    case: tuple[Sex, float, float], turn: tuple[float, float, float]
) -> None:
    body, surfaces = person(*case)
    figure = person_figure(body)
    neck = replace(figure.joints["neck"], displacement=(*np.radians(turn).tolist(), 0.0, 0.0, 0.0))
    placed = place_surfaces(figure.with_parts(neck), surfaces)
    length = body.segments["upper_torso"].length
    top = surfaces["upper_torso"].vertices[:, 2] > length + 1e-4
    lowest = placed["head"].vertices[surfaces["head"].vertices[:, 2].argmin()]
    highest = placed["upper_torso"].vertices[top]
    for name, points in (("upper_torso", lowest[None]), ("head", highest)):
        assert len(points), name
        assert (winding_numbers(triangles_of(placed[name]), points) > 0.5).all(), name


def test_surface_follows_a_measured_girth() -> None:
    stated = body_of(Sex.MALE, 1.756, 85.5, calf_circumference=0.45)
    level = 0.29 * stated.segments["lower_leg"].length
    assert girth_at(body_surfaces(stated)["lower_leg"], level) == pytest.approx(0.45, rel=0.01)


@pytest.mark.parametrize("case", PERSONS)
def test_spheres_of_the_foot_touch_the_sole_and_follow_the_surface(
    case: tuple[Sex, float, float],
) -> None:
    body, surfaces = person(*case)
    spheres = foot_contact_spheres(body)
    lowest = [sphere.centre[2] + sphere.radius for sphere in spheres]
    assert lowest[:6] == pytest.approx([body.ankle_height] * 6, abs=2e-5)
    assert max(lowest[6:]) < body.ankle_height
    spread = np.random.default_rng(5).normal(size=(500, 3))
    directions = spread / np.linalg.norm(spread, axis=1)[:, None]
    reach = [directions @ sphere.centre + sphere.radius for sphere in spheres]
    extent = (directions @ surfaces["foot"].vertices.T).max(axis=1)
    assert np.abs(np.max(reach, axis=0) - extent).max() < LARGEST_ERROR
    fore = np.array([sphere.centre[0] for sphere in spheres[:6]])
    assert fore.min() < 0.0 < body.segments["foot"].centre[0] < fore.max()


def test_sources_name_each_segment_and_number_once() -> None:
    rows = shape_sources(person(*PERSONS[0])[0])
    assert len({(row.part, row.quantity) for row in rows}) == len(rows)
    assert {row.part for row in rows} <= {*TRUNK_SEGMENTS, *LIMB_SEGMENTS}
