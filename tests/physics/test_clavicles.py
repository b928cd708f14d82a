"""The shipped figure with clavicles is the prototype with five degrees of freedom a shoulder."""

import numpy as np
import pytest

from generator.figure_file import read_figure
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.springs_file.read import load_springs

GRAVITY = 9.81
FIGURE, PROTOTYPE = read_figure("clavicles"), read_figure("prototype")
CLAVICLES = {"left_clavicle", "right_clavicle"}


def springs_of(figure):
    assert figure.path is not None
    reading = load_springs(figure, figure.path.parent, figure.path.stem)
    assert reading.diagnostics == ()
    assert reading.value is not None
    return reading.value


def potential(tree, displacements):
    """Energy of the weights [J]."""
    poses = forward_kinematics(tree, displacements).poses
    return sum(
        GRAVITY * segment.mass * (poses[name] @ segment.sites["CM"].pose_in_segment)[1, 3]
        for name, segment in tree.figure.bodies.items()
    )


def test_it_adds_two_segments_and_two_joints_to_the_prototype():
    added = set(FIGURE.segments) - set(PROTOTYPE.segments)
    assert added == set(FIGURE.joints) - set(PROTOTYPE.joints) == CLAVICLES
    assert all(FIGURE.segments[name] == part for name, part in PROTOTYPE.segments.items())
    shoulders = {"left_shoulder", "right_shoulder"}
    for name, joint in PROTOTYPE.joints.items():
        own = FIGURE.joints[name]
        assert (own.chain, own.child, own.stiff) == (joint.chain, joint.child, joint.stiff)
        assert (own == joint) == (name not in shoulders)
    assert FIGURE.degrees_of_freedom == PROTOTYPE.degrees_of_freedom + 4 == 26


def test_as_drawn_every_segment_is_where_the_prototype_has_it():
    here, there = (
        forward_kinematics(tree, initial_displacements(tree)).poses
        for tree in map(build_tree, (FIGURE, PROTOTYPE))
    )
    for name, pose in there.items():
        assert here[name] == pytest.approx(pose, abs=1e-12)


@pytest.mark.parametrize("side", ["left", "right"])
def test_positive_displacements_raise_it_and_bring_it_forwards(side):
    tree = build_tree(FIGURE)
    still = initial_displacements(tree)
    raised, swung = (
        forward_kinematics(tree, {**still, f"{side}_clavicle": np.array(given)}).poses[
            f"{side}_upper_arm"
        ]
        for given in ((0.3, 0.0), (0.0, 0.3))
    )
    assert raised[1, 3] - 1.572 == pytest.approx(0.172 * np.sin(0.3))
    assert swung[2, 3] == pytest.approx(0.172 * np.sin(0.3))
    assert swung[1, 3] == pytest.approx(1.572)


def test_the_other_springs_are_the_prototypes():
    own, printed = springs_of(FIGURE), springs_of(PROTOTYPE)
    assert set(own.joints) - set(printed.joints) == CLAVICLES
    for name, joint in printed.joints.items():
        laws = [(axis.direction, axis.elastic, axis.damping) for axis in joint.axes]
        assert laws == [(a.direction, a.elastic, a.damping) for a in own.joints[name].axes]


@pytest.mark.parametrize("name", sorted(CLAVICLES))
def test_the_spring_carries_the_hanging_arm_in_the_pose_as_drawn(name):
    tree = build_tree(FIGURE)
    still, step = initial_displacements(tree), 1e-5
    weight = [
        (
            potential(tree, {**still, name: step * unit})
            - potential(tree, {**still, name: -step * unit})
        )
        / (2.0 * step)
        for unit in np.eye(2)
    ]
    assert weight == pytest.approx([7.07, 0.0], abs=0.01)
    carried = {
        axis.direction: sum(float(law.torque(0.0)) for law in axis.elastic)
        for axis in springs_of(FIGURE).joints[name].axes
    }
    assert sorted(carried.values()) == pytest.approx([0.0, weight[0]], abs=0.05)
