"""Appearance of segments: colours from attributes, sticks where there is no psurf."""

import numpy as np
import pytest

from generator.geometry.validate import build_solid
from generator.motion_files.appearance import (
    linear_colour,
    segment_appearances,
)
from tests.chains import BALL, at, body, figure, ground, joint


def test_colours_of_a_display_as_shares_of_light():
    """Values of the sRGB transfer function, IEC 61966-2-1."""
    assert linear_colour((0.0, 0.5, 1.0)) == pytest.approx((0.0, 0.21404114, 1.0), abs=1e-8)
    assert linear_colour((0.04, 0.04045, 0.2))[0] == pytest.approx(0.04 / 12.92)


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
    looks, losses = segment_appearances(made)
    assert set(looks) == {"upper", "lower"}
    assert np.ptp(looks["upper"].surface.vertices[:, 1]) == pytest.approx(0.3)
    assert np.max(looks["upper"].surface.vertices[:, 0]) < 0.1
    assert len(looks["lower"].surface.faces) == 16
    assert np.allclose(looks["lower"].surface.vertices.max(axis=0)[1:], [0.1, 0.2], atol=0.01)
    assert losses[0].where == ("upper", "lower")


def test_a_stick_is_a_closed_body_with_its_faces_outward():
    link = body("link", centre=(0.3, -0.4, 1.2))
    made = figure([ground(), link], [joint("pin", "ground.base", "link.near", BALL)])
    surface = segment_appearances(made)[0]["link"].surface
    assert build_solid(surface).volume == pytest.approx(1.3 * 2.0 * (0.04 * 1.3) ** 2 / 3.0)


def test_a_body_with_a_single_place_has_no_look():
    dot = body("dot", centre=(0.0, 0.0, 0.0))
    made = figure([ground(), dot], [joint("pin", "ground.base", "dot.near", BALL)])
    assert segment_appearances(made) == ({}, ())
