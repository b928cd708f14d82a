"""The figure let go: no joint to the ground, one of six freedoms for each loose part."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.diagnostics import ModelError
from generator.kinematics.free_root import FREE_CHAINS, detach_root, free_joints, lowest_point
from generator.kinematics.placement import (
    forward_kinematics,
    initial_displacements,
    segment_jacobians,
)
from generator.kinematics.tree import build_tree
from generator.simulation.plan import Plan
from generator.simulation.run_model import initial_state
from tests.chains import BALL, at, body, figure, ground, joint, row

PARTS = figure(
    [ground(post=at(shift=(1.0, 0.0, 0.0))), body("a"), body("b"), body("c")],
    [
        joint("one", "ground.base", "a.near", BALL, (0.1, 0.2, 0.3)),
        joint("two", "b.near", "ground.post", BALL, (0.3, 0.2, 0.1)),
        joint("three", "b.near", "c.near", BALL),
    ],
)
"""Two loose parts, one of them connected the other way round."""

NAMESAKE = figure(
    [ground(), body("link"), body("b")],
    [
        joint("pin", "ground.base", "link.near", BALL, (0.1, 0.2, 0.3)),
        joint("link", "link.near", "b.near", BALL, (0.3, 0.1, 0.0)),
    ],
)
"""A joint has the name of the segment that becomes free."""


@pytest.mark.parametrize(
    ("made", "joints"),
    [
        (row(3), ["bar0", "joint1", "joint2"]),
        (PARTS, ["a", "b", "three"]),
        (read_figure("fourbar"), ["crank", "crank_pin", "rocker_pin"]),
        (NAMESAKE, ["free_link", "link"]),
    ],
    ids=["row", "loose parts", "linkage", "namesake"],
)
def test_a_figure_that_is_let_go_keeps_its_pose_and_inner_joints(made, joints) -> None:
    tree = build_tree(made)
    before = forward_kinematics(tree, initial_displacements(tree))
    freed, moved = detach_root(made, before.displacements)
    after = forward_kinematics(build_tree(freed), moved)
    for name in made.segments:
        assert np.allclose(after.poses[name], before.poses[name], atol=1e-12)
    assert list(freed.joints) == joints
    assert build_tree(freed).closures == ()


def test_the_prototype_gets_six_freedoms_for_three() -> None:
    made = read_figure("prototype")
    freed, _ = detach_root(made, initial_displacements(build_tree(made)))
    assert next(iter(freed.joints)) == "lower_torso"
    assert "root_torso" not in freed.joints
    assert freed.joints["lower_torso"].chain == FREE_CHAINS[0]
    assert freed.degrees_of_freedom == 22 - 3 + 6


def test_a_free_joint_is_zero_at_the_orientation_of_the_file() -> None:
    made = row(2)
    freed, moved = detach_root(made, initial_displacements(build_tree(made)))
    before = forward_kinematics(build_tree(made), initial_displacements(build_tree(made)))
    assert list(free_joints(freed)) == ["bar0"]
    assert moved["bar0"][:3] == pytest.approx(np.zeros(3), abs=1e-12)
    assert moved["bar0"][3:] == pytest.approx(before.poses["bar0"][:3, 3])


@given(angles=st.tuples(*[st.floats(-4.0, 4.0)] * 3))
def test_a_free_joint_is_far_from_its_poles_wherever_it_starts(angles) -> None:
    made = read_figure("pendulum")
    (root,) = made.joints
    freed, moved = detach_root(made, {root: np.array(angles)})
    ((name, joint),) = free_joints(freed).items()
    sequence = build_tree(freed).chains[name].sequence
    assert joint.chain in FREE_CHAINS
    assert abs(np.cos(moved[name][1])) > 0.7
    assert sequence is not None


def test_a_plan_lets_go_after_its_displacements_are_set() -> None:
    made = read_figure("prototype")
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
    tree, pose = start.placement.tree, start.placement.poses["lower_torso"]
    twist = segment_jacobians(start.placement)["lower_torso"] @ np.concatenate(
        [start.rates[branch.joint.name] for branch in tree.joints]
    )
    centre = pose[:3, :3] @ made.segments["lower_torso"].centre_of_mass + pose[:3, 3]
    assert twist[:3] == pytest.approx([0, 0, 1])
    assert twist[3:] + np.cross(twist[:3], centre) == pytest.approx([0, 2, 0])


@pytest.mark.parametrize(
    ("gravity", "up"), [((0.0, -9.81, 0.0), (0, 1, 0)), ((0.0, 0.0, 3.0), (0, 0, -1))]
)
def test_a_height_is_that_of_the_lowest_point(gravity, up) -> None:
    plan = Plan(free_root=True, height=0.7, gravity=gravity, displacements={"left_knee": (0.5,)})
    placement = initial_state(read_figure("prototype"), plan).placement
    assert lowest_point(placement, np.array(up)) == pytest.approx(0.7)
    without = initial_state(read_figure("prototype"), replace(plan, height=None)).placement
    moved = placement.poses["lower_torso"][:3, 3] - without.poses["lower_torso"][:3, 3]
    assert np.cross(moved, up) == pytest.approx(np.zeros(3))


def test_a_height_of_a_figure_without_shapes_is_that_of_its_sites() -> None:
    placement = initial_state(row(3), Plan(free_root=True, height=-0.2)).placement
    lowest = min(
        (placement.poses[name] @ site.pose_in_segment)[1, 3]
        for name, segment in placement.tree.figure.bodies.items()
        for site in segment.sites.values()
    )
    assert lowest == pytest.approx(-0.2)


def test_a_velocity_at_a_pole_is_refused() -> None:
    plan = Plan(
        displacements={"waist": (0.0, np.pi / 2.0, 0.0)}, velocities={"waist": (1.0, 0.0, 0.0)}
    )
    with pytest.raises(ModelError, match="waist starts at a pole"):
        initial_state(read_figure("prototype"), plan)


def test_springs_of_a_removed_joint_do_not_act_on_the_free_one() -> None:
    """A free joint takes the name of no joint of the figure, not even of one that is removed."""
    made = figure([ground(), body("link")], [joint("link", "ground.base", "link.near", BALL)])
    freed, _ = detach_root(made, initial_displacements(build_tree(made)))
    assert list(freed.joints) == ["free_link"]
