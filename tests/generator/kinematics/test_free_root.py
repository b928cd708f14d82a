"""The figure let go: no joint to the ground, one of six freedoms for each loose part."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.kinematics.free_root import FREE_CHAIN, detach_root
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.simulation.model import initial_state
from generator.simulation.plan import Plan
from tests.chains import BALL, at, body, figure, ground, joint, row

FIGURES = Path(str(files("figures")))


def same_pose(made) -> None:
    tree = build_tree(made)
    before = forward_kinematics(tree, initial_displacements(tree))
    freed, moved = detach_root(made, before.displacements)
    after = forward_kinematics(build_tree(freed), moved)
    for name in made.segments:
        assert np.allclose(after.poses[name], before.poses[name], atol=1e-12)


def test_the_prototype_keeps_its_pose() -> None:
    made = read_figure(FIGURES / "prototype.fig")
    same_pose(made)
    freed, _ = detach_root(made, initial_displacements(build_tree(made)))
    assert next(iter(freed.joints)) == "lower_torso"
    assert "root_torso" not in freed.joints
    assert freed.joints["lower_torso"].chain == FREE_CHAIN
    assert freed.degrees_of_freedom == 22 - 3 + 6


def test_a_bent_row_keeps_its_pose() -> None:
    same_pose(row(3))


def test_the_free_joint_tells_the_pose_of_the_segment_in_the_world() -> None:
    made = row(2)
    freed, moved = detach_root(made, initial_displacements(build_tree(made)))
    before = forward_kinematics(build_tree(made), initial_displacements(build_tree(made)))
    pose = build_tree(freed).chains["bar0"].pose(moved["bar0"])
    assert np.allclose(pose, before.poses["bar0"])


def test_every_loose_part_gets_a_joint() -> None:
    made = figure(
        [ground(post=at(shift=(1.0, 0.0, 0.0))), body("a"), body("b"), body("c")],
        [
            joint("one", "ground.base", "a.near", BALL, (0.1, 0.2, 0.3)),
            joint("two", "b.near", "ground.post", BALL, (0.3, 0.2, 0.1)),
            joint("three", "b.near", "c.near", BALL),
        ],
    )
    same_pose(made)
    freed, _ = detach_root(made, initial_displacements(build_tree(made)))
    assert list(freed.joints) == ["a", "b", "three"]


def test_a_linkage_that_is_let_go_keeps_its_inner_joints() -> None:
    made = read_figure(FIGURES / "fourbar.fig")
    same_pose(made)
    freed, _ = detach_root(made, initial_displacements(build_tree(made)))
    assert list(freed.joints) == ["crank", "crank_pin", "rocker_pin"]
    assert build_tree(freed).closures == ()


def test_a_joint_called_like_the_segment_keeps_its_name() -> None:
    made = figure(
        [ground(), body("link"), body("b")],
        [
            joint("pin", "ground.base", "link.near", BALL, (0.1, 0.2, 0.3)),
            joint("link", "link.near", "b.near", BALL, (0.3, 0.1, 0.0)),
        ],
    )
    same_pose(made)
    freed, _ = detach_root(made, initial_displacements(build_tree(made)))
    assert list(freed.joints) == ["free link", "link"]


def test_a_plan_lets_go_after_its_displacements_are_set() -> None:
    made = read_figure(FIGURES / "prototype.fig")
    plan = Plan(
        free_root=True,
        displacements={"root_torso": (0.3, 0.2, 0.1)},
        velocities={"lower_torso": (0.0, 0.0, 1.0, 0.0, 2.0, 0.0)},
    )
    start = initial_state(made, plan)
    tree = build_tree(made)
    held = forward_kinematics(
        tree, initial_displacements(tree) | {"root_torso": np.array([0.3, 0.2, 0.1])}
    )
    assert np.allclose(start.placement.poses["center_torso"], held.poses["center_torso"])
    assert start.rates["lower_torso"] == pytest.approx([0, 0, 1, 0, 2, 0])
