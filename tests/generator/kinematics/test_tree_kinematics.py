"""The prepared kinematics give what the chains give one by one, for one pose and for many."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.kinematics.placement import (
    forward_kinematics,
    initial_displacements,
    segment_jacobians,
)
from generator.kinematics.tree import build_tree
from generator.rotations import inverse_pose
from tests.chains import chain, two_bodies

WORDS = ["Rz", "R-x", "Rs", "Ts", "T-y", "Rx R-y", "Rs Ra Ts", "Tx Ty Tz", "Rx Ry Rz Tx Ty T-z"]


@cache
def prototype():
    return build_tree(read_figure("prototype"))


def displacements(tree, seed, *lead):
    """Displacements of all joints that have nothing in common, shape (*lead, n) a joint."""
    random = np.random.default_rng(seed)
    return {
        name: random.uniform(-2.0, 2.0, (*lead, joint.degrees_of_freedom))
        for name, joint in tree.figure.joints.items()
    }


@given(
    st.sampled_from(WORDS),
    st.lists(st.floats(-10.0, 10.0), min_size=6, max_size=6),
    st.booleans(),
)
def test_a_tip_is_its_base_moved_by_the_joint_s_chain(words, values, reverse):
    factors = chain(words)
    tree = build_tree(two_bodies(factors, values[: len(factors)], reverse=reverse))
    placement = forward_kinematics(tree, initial_displacements(tree))
    joint = tree.figure.joints["tested"]
    moved = tree.chains["tested"].pose(values[: len(factors)])
    assert np.allclose(placement.pose_in_parent(joint), moved, atol=1e-12)


def test_a_whole_motion_is_placed_as_its_frames_are():
    tree = prototype()
    motion = displacements(tree, 1, 7)
    together = forward_kinematics(tree, motion)
    maps = segment_jacobians(together)
    for frame in range(7):
        alone = forward_kinematics(tree, {name: rows[frame] for name, rows in motion.items()})
        for name, pose in alone.poses.items():
            assert np.allclose(together.poses[name][frame], pose, atol=1e-14)
        for name, motion_map in segment_jacobians(alone).items():
            assert np.allclose(maps[name][frame], motion_map, atol=1e-14)


@pytest.mark.parametrize("words", WORDS)
@pytest.mark.parametrize("reverse", [False, True])
def test_jacobians_are_the_slopes_of_the_poses(words, reverse):
    """Angular velocity and velocity at the world's origin of every segment."""
    tree = build_tree(two_bodies(chain(words), np.zeros(len(words.split())), reverse=reverse))
    kinematics = tree.kinematics
    values = np.random.default_rng(2).uniform(-1.0, 1.0, kinematics.size)
    placed, twists = kinematics.poses(values), kinematics.twists(values)
    cuts = np.cumsum([b.joint.degrees_of_freedom for b in tree.joints])[:-1]
    names = [b.joint.name for b in tree.joints]
    start = dict(zip(names, np.split(values, cuts), strict=True))
    maps = segment_jacobians(forward_kinematics(tree, start))
    for k, side in enumerate(np.eye(kinematics.size)):
        after, before = (kinematics.poses(values + h * side) for h in (1e-6, -1e-6))
        for segment in ("first", "second"):
            spin = (after[segment] - before[segment]) / 2e-6 @ inverse_pose(placed[segment])
            expected = [spin[2, 1], spin[0, 2], spin[1, 0], *spin[:3, 3]]
            assert np.allclose(maps[segment][:, k], expected, atol=1e-8)
        assert np.allclose(twists[k], expected, atol=1e-8)


def test_a_displacement_moves_what_hangs_on_its_joint_and_nothing_else():
    tree = prototype()
    kinematics = tree.kinematics
    values = kinematics.displacement_vector(displacements(tree, 3))
    before = kinematics.poses(values)
    for k, side in enumerate(np.eye(kinematics.size)):
        after = kinematics.poses(values + 0.1 * side)
        moved = {name for name in before if not np.array_equal(before[name], after[name])}
        assert moved == {name for name, moves in kinematics.motion_masks.items() if moves[k]}


def test_a_figure_without_displacements_is_placed():
    figure = two_bodies((), ())
    tree = build_tree(figure)
    assert forward_kinematics(tree, initial_displacements(tree)).poses["second"].shape == (4, 4)
