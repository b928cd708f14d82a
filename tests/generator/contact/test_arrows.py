"""Arrows of contact forces: their scale, and where they begin and end."""

import numpy as np
import pytest

from generator import read_figure
from generator.contact.arrows import LONGEST_ARROW, ArrowScale, part_forces_at
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from tests.contacts import contact_record


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


def test_forces_between_frames():
    """Forces are linear; a point is that of the frame with a force where only one has it."""
    contact, times = contact_record(["trunk", "foot"], 4), np.array([0.0, 0.1, 0.3, 0.4])
    forces, points = contact.part_forces["pelvis"], contact.force_points["pelvis"]
    at_frames, where = part_forces_at(contact, times, times)["pelvis"]
    np.testing.assert_allclose(at_frames, forces, rtol=1e-14)
    np.testing.assert_allclose(where[1:], points[1:], rtol=1e-14)
    found, where = part_forces_at(contact, times, np.array([0.05, 0.25]))["pelvis"]
    np.testing.assert_allclose(found[0], 0.5 * forces[1])
    np.testing.assert_allclose(where[0], points[1])  # nothing touches at the first frame
    np.testing.assert_allclose(found[1], 0.25 * forces[1] + 0.75 * forces[2])
    np.testing.assert_allclose(where[1], 0.25 * points[1] + 0.75 * points[2])


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
