"""Appearance of segments: colours from attributes, capsules and sticks instead of a psurf."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.figure import Figure
from generator.geometry.appearance import (
    linear_colour,
    mass_capsule,
    segment_appearances,
)
from generator.geometry.validate import build_solid
from generator.kinematics.placement import forward_kinematics, site_pose, with_followers
from generator.kinematics.tree import build_tree
from generator.model_files.formats import read_model
from generator.rotations import inverse_pose
from tests.chains import BALL, at, body, figure, ground, joint
from tests.generator.model_files.imported_models import MODELS


def test_colours_of_a_display_as_shares_of_light():
    """Values of the sRGB transfer function, IEC 61966-2-1."""
    assert linear_colour((0.0, 0.5, 1.0)) == pytest.approx((0.0, 0.21404114, 1.0), abs=1e-8)
    assert linear_colour((0.04, 0.04045, 0.2))[0] == pytest.approx(0.04 / 12.92)


def without_masses(made: Figure) -> Figure:
    """The figure with segments that have no mass, which are drawn as sticks."""
    return made.with_parts(*(replace(each, mass=None) for each in made.bodies.values()))


def single_link(centre: tuple[float, float, float]) -> Figure:
    return figure(
        [ground(), body("link", centre=centre)], [joint("pin", "ground.base", "link.near", BALL)]
    )


def test_a_stick_goes_to_the_next_joint_and_else_to_all_sites():
    upper = body("upper", sites={"far": at(shift=(0.0, 0.3, 0.0)), "mark": at(shift=(1.0, 0, 0))})
    lower = body("lower", centre=(0.0, 0.1, 0.0), sites={"end": at(shift=(0.0, 0.0, 0.2))})
    made = figure(
        [ground(post=at(shift=(3.0, 0.0, 0.0))), upper, lower],
        [
            joint("a", "ground.base", "upper.near", BALL),
            joint("b", "upper.far", "lower.near", BALL),
        ],
    )
    looks, losses = segment_appearances(without_masses(made))
    assert set(looks) == {"upper", "lower"}
    assert np.ptp(looks["upper"].surface.vertices[:, 1]) == pytest.approx(0.3)
    assert np.max(looks["upper"].surface.vertices[:, 0]) < 0.1
    assert len(looks["lower"].surface.faces) == 16
    assert np.allclose(looks["lower"].surface.vertices.max(axis=0)[1:], [0.1, 0.2], atol=0.01)
    assert losses[0].where == ("upper", "lower")


def test_a_stick_is_a_closed_body_with_its_faces_outward():
    made = without_masses(single_link((0.3, -0.4, 1.2)))
    surface = segment_appearances(made)[0]["link"].surface
    assert build_solid(surface).volume == pytest.approx(1.3 * 2.0 * (0.04 * 1.3) ** 2 / 3.0)


def test_a_body_with_a_single_place_and_no_mass_is_not_drawn():
    assert segment_appearances(without_masses(single_link((0.0, 0.0, 0.0)))) == ({}, ())


@given(centre=st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_a_segment_with_a_mass_is_a_closed_capsule_around_its_centre(
    centre: tuple[float, float, float],
):
    made = single_link(centre)
    capsule = mass_capsule(made, made.segments["link"])
    assert capsule is not None
    looks, losses = segment_appearances(made)
    assert [(loss.what, loss.where) for loss in losses] == [
        ("segments without a psurf are capsules of their mass", ("link",))
    ]
    solid = build_solid(looks["link"].surface)
    length, radius = 2.0 * float(np.linalg.norm(centre)), capsule.radius
    # corners lie on the capsule, so that the body between them is smaller, by less than 6 %
    volume = pi * radius**2 * length + 4.0 / 3.0 * pi * radius**3
    assert 0.94 * volume < solid.volume < volume
    assert np.allclose(solid.mass_properties(1.0).centre, centre, atol=1e-6)
    points = looks["link"].surface.vertices - np.array(centre)
    along = np.array(centre) / (0.5 * length) if length > 1e-6 else np.zeros(3)
    nearest = np.clip(points @ along, -0.5 * length, 0.5 * length)[:, None] * along
    assert np.allclose(np.linalg.norm(points - nearest, axis=1), radius, atol=2e-6)


def test_a_capsule_with_a_bend_reaches_all_joints():
    upper = body("upper", centre=(0.1, 0.1, 0.0), sites={"far": at(shift=(0.0, 0.3, 0.0))})
    made = figure(
        [ground(), upper, body("lower")],
        [
            joint("a", "ground.base", "upper.near", BALL),
            joint("b", "upper.far", "lower.near", BALL),
        ],
    )
    capsule = mass_capsule(made, made.segments["upper"])
    assert capsule is not None
    corners = segment_appearances(made)[0]["upper"].surface.vertices
    for end in [(0.0, 0.0, 0.0), (0.0, 0.3, 0.0)]:
        beyond = np.array(end) - [0.1, 0.1, 0.0]
        beyond /= np.linalg.norm(beyond)
        assert (corners @ beyond).max() == pytest.approx(np.dot(end, beyond) + capsule.radius)


def test_a_capsule_ends_where_a_curve_has_the_child_at_zero():
    made = read_model(MODELS / "knee.osim").figure
    knee = made.joints["knee"]
    zeros = {name: np.zeros(len(one.chain)) for name, one in made.joints.items()}
    placement = forward_kinematics(build_tree(made), with_followers(made, zeros))
    end = (
        inverse_pose(placement.poses[knee.parent.segment]) @ site_pose(placement, knee, "child")
    )[:3, 3]
    assert np.linalg.norm(end - made.site(knee.parent).pose_in_segment[:3, 3]) > 0.3
    capsule = mass_capsule(made, made.segments[knee.parent.segment])
    assert capsule is not None
    assert np.linalg.norm(capsule.ends - end, axis=1).min() < 1e-12
    sticks = segment_appearances(without_masses(made))[0][knee.parent.segment].surface.vertices
    assert np.linalg.norm(sticks - end, axis=1).min() < 1e-12


def test_capsules_are_the_same_whichever_end_a_joint_connects_to_the_other():
    made = read_model(MODELS / "knee.osim").figure
    glide = made.joints["patella_glide"]
    curves = tuple(replace(one, curve=one.curve.scaled(-1.0)) for one in glide.followers if one)
    ends = {"parent": glide.child, "child": glide.parent}
    turned = replace(glide, **ends, chain=glide.chain[::-1], followers=curves[::-1])
    for name in ("thigh", "patella"):
        one, other = (
            mass_capsule(each, each.segments[name]) for each in (made, made.with_parts(turned))
        )
        assert one is not None
        assert other is not None
        np.testing.assert_allclose(other.ends, one.ends, atol=1e-12)
        assert other.radius == pytest.approx(one.radius)
