"""Arrows of contact forces: their scale, and where they begin and end."""

import numpy as np
import pytest

from generator import read_figure
from generator.contact.arrows import LONGEST_ARROW, ArrowScale
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree


def test_arrows_end_at_their_points_and_are_in_scale():
    scale = ArrowScale(0.2, 500.0)
    forces = np.array([[0.0, 250.0, 0.0], [300.0, 0.0, -400.0], [0.5, 0.5, 0.0], [0.0, -1e6, 0.0]])
    points = np.arange(12.0).reshape(4, 3)
    arrows = scale.arrows(forces, points)
    assert arrows.shape == (3, 2, 3)  # none for less than a newton
    assert np.array_equal(arrows[:, 1], points[[0, 1, 3]])
    along = arrows[:, 1] - arrows[:, 0]
    expected = [[0.0, 0.1, 0.0], [0.12, 0.0, -0.16], [0.0, -LONGEST_ARROW * 0.2, 0.0]]
    assert along == pytest.approx(np.array(expected))
    assert scale.arrows(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0, 2, 3)


@pytest.mark.parametrize(
    ("name", "text"),
    [("male50", "Arrow of 20 cm: 500 N; cut at 1 m"), ("pendulum", None)],
)
def test_the_scale_is_round(name: str, text: str | None):
    figure = read_figure(name)
    tree = build_tree(figure)
    poses = forward_kinematics(tree, initial_displacements(tree)).poses
    scale = ArrowScale.of_figure(figure, poses)
    assert f"{scale.length:.0e}"[0] in "125"
    assert f"{scale.force:.0e}"[0] in "125"
    assert text in (None, scale.text)
