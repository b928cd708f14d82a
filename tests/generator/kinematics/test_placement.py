"""Positions of segments at known displacements, and the zero pose of the thesis's figures."""

import numpy as np
import pytest

from generator import read_figure
from generator.diagnostics import ModelError, UnknownNameError
from generator.kinematics.placement import (
    checked_joint_values,
    forward_kinematics,
    initial_displacements,
    pose_figure,
    relative_jacobian,
    segment_jacobians,
    site_pose,
)
from generator.kinematics.tree import build_tree
from tests.chains import BALL, chain, row


def zero_pose():
    tree = build_tree(read_figure("prototype"))
    zero = {name: np.zeros(j.degrees_of_freedom) for name, j in tree.figure.joints.items()}
    return forward_kinematics(tree, zero)


def test_zero_pose_of_the_prototype() -> None:
    """Upright, arms down: shoulders and hips where appendix A puts them."""
    standing = zero_pose()
    joints = standing.tree.figure.joints

    def where(name: str) -> np.ndarray:
        return site_pose(standing, joints[name], "child")[:3, 3]

    assert np.allclose(where("left_shoulder"), [0.172, 1.572, 0.0], atol=1e-9)
    assert np.allclose(where("right_shoulder"), [-0.172, 1.572, 0.0], atol=1e-9)
    assert np.allclose(where("left_hip_joint"), [0.0612, 0.941, 0.0], atol=1e-9)
    assert np.allclose(where("right_hip_joint"), [-0.0612, 0.941, 0.0], atol=1e-9)
    for name in ("left_elbow", "right_elbow"):
        assert where(name)[1] == pytest.approx(1.572 - 0.334)
    for name in ("left_knee", "right_knee"):
        assert where(name)[1] == pytest.approx(0.941 - 0.434)


def test_figure_3_4_gives_the_numbers_of_figure_3_2() -> None:
    tree = build_tree(read_figure("pendulum"))
    placement = forward_kinematics(tree, initial_displacements(tree))
    joint = tree.figure.joints["shoulder"]
    triad = site_pose(placement, joint, "parent")
    assert np.allclose(triad[:3, :3], [[0, 0, -1], [0, 1, 0], [1, 0, 0]], atol=1e-12)
    assert np.allclose(triad[:3, 3], [0.0, 1.2, 0.0])
    m = placement.pose_in_parent(joint)[:3, :3]
    zyx = (np.arctan2(m[1, 0], m[0, 0]), -np.arcsin(m[2, 0]), np.arctan2(m[2, 1], m[2, 2]))
    assert zyx == pytest.approx((0.349066, 0.698132, 0.0), abs=1e-6)


def test_a_joint_s_own_rates_move_its_child_by_its_twists() -> None:
    tree = build_tree(row(2, (BALL, chain("Rs Ts"))))
    placement = forward_kinematics(tree, initial_displacements(tree))
    joint = tree.figure.joints["joint1"]
    motion = relative_jacobian(placement, segment_jacobians(placement), joint)
    assert np.allclose(motion[:, :3], 0.0, atol=1e-12)
    twists = tree.chains["joint1"].twists(placement.displacements["joint1"])
    offset = placement.pose_in_parent(joint)[:3, 3]
    twists[:, 3:] += np.cross(twists[:, :3], offset)
    assert np.allclose(motion[:, 3:], twists.T)


def test_values_are_checked_against_their_joints() -> None:
    figure = row(2, (BALL, chain("Rx Tz")))
    first, second = figure.joints
    checked = checked_joint_values(figure, {second: [1, 2], first: (1.0, 2.0, 3.0)})
    assert {name: values.tolist() for name, values in checked.items()} == {
        first: [1.0, 2.0, 3.0],
        second: [1.0, 2.0],
    }
    with pytest.raises(UnknownNameError):
        checked_joint_values(figure, {"nose": [1.0]})
    with pytest.raises(ModelError, match="has 3 displacements, not 2"):
        checked_joint_values(figure, {first: [1.0, 2.0]})
    with pytest.raises(ModelError, match="is not finite"):
        checked_joint_values(figure, {second: [1.0, np.nan]})


def test_a_figure_in_a_pose_is_there_in_its_file() -> None:
    figure = row(2, (BALL, chain("Rx Tz")))
    values = {
        name: np.linspace(0.1, 0.3, one.degrees_of_freedom) for name, one in figure.joints.items()
    }
    placed = forward_kinematics(build_tree(figure), values)
    posed = build_tree(pose_figure(figure, values))
    found = forward_kinematics(posed, initial_displacements(posed))
    for name, pose in placed.poses.items():
        assert np.array_equal(found.poses[name], pose)
