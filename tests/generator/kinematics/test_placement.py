"""Where segments are at given displacements, and the zero pose of the thesis's figures."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.kinematics.placement import (
    forward_kinematics,
    initial_displacements,
    relative_jacobian,
    segment_jacobians,
    site_pose,
)
from generator.kinematics.tree import build_tree
from generator.rotations import inverse_pose
from tests.chains import BALL, chain, row, two_bodies

FIGURES = Path(str(files("figures")))


def zero_pose():
    tree = build_tree(read_figure(FIGURES / "prototype.fig"))
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


def test_the_prototype_faces_plus_z() -> None:
    """Torso: x forward, y left, z up; limbs: x forward, z down, y to the right."""
    standing = zero_pose()
    for name, segment in standing.tree.figure.bodies.items():
        rotation = standing.poses[segment.name][:3, :3]
        assert np.allclose(rotation[:, 0], [0.0, 0.0, 1.0], atol=1e-9)
        side, up = (1.0, 1.0) if "torso" in name else (-1.0, -1.0)
        assert np.allclose(rotation[:, 1], [side, 0.0, 0.0], atol=1e-9)
        assert np.allclose(rotation[:, 2], [0.0, up, 0.0], atol=1e-9)


def test_figure_3_4_gives_the_numbers_of_figure_3_2() -> None:
    tree = build_tree(read_figure(FIGURES / "pendulum.fig"))
    placement = forward_kinematics(tree, initial_displacements(tree))
    joint = tree.figure.joints["shoulder"]
    triad = site_pose(placement, joint, "parent")
    assert np.allclose(triad[:3, :3], [[0, 0, -1], [0, 1, 0], [1, 0, 0]], atol=1e-12)
    assert np.allclose(triad[:3, 3], [0.0, 1.2, 0.0])
    m = placement.pose_in_parent(joint)[:3, :3]
    zyx = (np.arctan2(m[1, 0], m[0, 0]), -np.arcsin(m[2, 0]), np.arctan2(m[2, 1], m[2, 2]))
    assert zyx == pytest.approx((0.349066, 0.698132, 0.0), abs=1e-6)


@pytest.mark.parametrize("text", ["Rz", "Rx R-y", "Rs Ts", "Tx Ty Rz", "Rx Ry Rz Tx Ty Tz"])
def test_connect_the_other_way_round_inverts_the_joint(text) -> None:
    factors = chain(text)
    values = np.linspace(0.5, -0.4, len(factors))
    for reverse in (False, True):
        tree = build_tree(two_bodies(factors, values, reverse=reverse))
        placement = forward_kinematics(tree, initial_displacements(tree))
        joint = tree.figure.joints["tested"]
        found = tree.chains["tested"].displacements(placement.pose_in_parent(joint), values)
        assert np.allclose(found, values)
    there, back = (
        forward_kinematics(tree, initial_displacements(tree))
        for tree in (build_tree(two_bodies(factors, values, reverse=r)) for r in (False, True))
    )
    first, second = (inverse_pose(p.poses["first"]) @ p.poses["second"] for p in (there, back))
    assert not np.allclose(first, second)


@pytest.mark.parametrize("reverse", [False, True])
def test_motion_maps_are_the_slopes_of_the_poses(reverse) -> None:
    """Angular velocity and velocity at the world's origin of every segment, column by column."""
    tree = build_tree(two_bodies(chain("Ry R-x"), (0.4, -0.3), reverse=reverse))
    start = initial_displacements(tree)
    placement = forward_kinematics(tree, start)
    maps = segment_jacobians(placement)
    column = 0
    for branch in tree.joints:
        name = branch.joint.name
        for k in range(branch.joint.degrees_of_freedom):
            poses = []
            for side in (1e-6, -1e-6):
                moved = {n: v.copy() for n, v in start.items()}
                moved[name][k] += side
                poses.append(forward_kinematics(tree, moved).poses)
            for segment in ("first", "second"):
                slope = (poses[0][segment] - poses[1][segment]) / 2e-6
                spin = slope @ inverse_pose(placement.poses[segment])
                expected = [spin[2, 1], spin[0, 2], spin[1, 0], *spin[:3, 3]]
                assert np.allclose(maps[segment][:, column], expected, atol=1e-8)
            column += 1


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
