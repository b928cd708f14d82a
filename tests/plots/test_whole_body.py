"""Mass properties and extents of a posed figure, against sums by hand."""

from functools import cache

import numpy as np
import pytest

from generator import read_figure
from generator.figure import Figure
from generator.kinematics.centre_of_mass import centre_of_mass
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from plots.figure_image import Body
from plots.whole_body import (
    mass_properties,
    place_in_posture,
    surface_points,
)


@cache
def prototype() -> Figure:
    return read_figure("prototype")


def test_mass_and_centre_are_those_of_the_figure() -> None:
    tree = build_tree(prototype())
    placement = forward_kinematics(tree, initial_displacements(tree))
    whole = mass_properties(prototype(), placement.poses)
    assert whole.centre == pytest.approx(centre_of_mass(placement))
    assert whole.mass == pytest.approx(
        sum(each.mass for each in prototype().bodies.values() if each.mass)
    )


def test_the_inertia_is_the_sum_over_points() -> None:
    """Each segment is six points on its principal axes with its mass and moments."""
    posture = {"left_hip_joint": (10.0, 20.0, 70.0), "right_elbow": (80.0,)}
    poses = place_in_posture(prototype(), posture)
    whole = mass_properties(prototype(), poses)
    total = np.zeros((3, 3))
    for name, segment in prototype().bodies.items():
        moments = np.array(segment.inertia)
        squares = (0.5 * moments.sum() - moments) / (2.0 * segment.mass / 6.0)
        for axis in range(3):
            for side in (-1.0, 1.0):
                # A negative square stands for a point that takes inertia away.
                offset = np.zeros(3)
                offset[axis] = side * np.sqrt(abs(squares[axis]))
                sign = np.sign(squares[axis])
                turned = poses[name][:3, :3] @ offset
                total += sign * segment.mass / 6.0 * (turned @ turned * np.eye(3))
                total -= sign * segment.mass / 6.0 * np.outer(turned, turned)
        centre = poses[name][:3, :3] @ segment.centre_of_mass + poses[name][:3, 3] - whole.centre
        total += segment.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    assert whole.inertia == pytest.approx(total, abs=1e-9)


def test_surface_points_move_with_their_segment() -> None:
    body = Body.of_figure(prototype())
    down = surface_points(body, place_in_posture(prototype(), {}), ["left_upper_arm"])
    level = place_in_posture(prototype(), {"left_shoulder": (0.0, 90.0, 0.0)})
    points = surface_points(body, level, ["left_upper_arm"])
    assert len(points) == len(down) < len(surface_points(body, level))
    assert np.ptp(points[:, 0]) == pytest.approx(np.ptp(down[:, 1]), rel=1e-6)
