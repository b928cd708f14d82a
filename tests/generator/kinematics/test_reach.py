"""Inverse kinematics: targets are reached, or the nearest pose is; limits and loops hold."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from generator import read_figure
from generator.diagnostics import ModelError
from generator.figure import Figure
from generator.kinematics.loops import MAX_LOOP_GAP, OpenLoopError
from generator.kinematics.placement import (
    Placement,
    forward_kinematics,
    initial_displacements,
    segment_jacobians,
)
from generator.kinematics.reach import Target, follow_and_close, reach
from generator.kinematics.tree import build_tree
from generator.rotations import cross_matrix, matrix_from_rotation_vector
from tests.chains import chain, row
from tests.generator.kinematics.test_loops import gaps

FOURBAR = build_tree(read_figure("fourbar"))
POINT = np.array([0.02, -0.01, 0.25])
LOW, HIGH = -1.2, 1.6


def limited(figure: Figure, low: float = LOW, high: float = HIGH) -> Figure:
    """Return a figure with the same limits at all displacements [rad or m]."""
    joints = [
        replace(
            joint,
            lower_limit=(low,) * joint.degrees_of_freedom,
            upper_limit=(high,) * joint.degrees_of_freedom,
        )
        for joint in figure.joints.values()
    ]
    return figure.with_parts(*joints)


TREES = {
    "prototype": build_tree(limited(read_figure("prototype"))),
    "clavicles": build_tree(limited(read_figure("clavicles"))),
    "slides": build_tree(limited(row(3, (chain("Rz Tx"), chain("Rx Ry"), chain("T-y Rs"))))),
}
TIPS = {"prototype": "left_lower_arm", "clavicles": "right_lower_arm", "slides": "bar2"}
FIGURES = st.sampled_from(sorted(TREES))
SEEDS = st.integers(0, 2**32 - 1)


def random_pose(tree, seed: int, low: float = LOW, high: float = HIGH) -> Placement:
    draw = np.random.default_rng(seed)
    return forward_kinematics(
        tree,
        {
            name: draw.uniform(low, high, joint.degrees_of_freedom)
            for name, joint in tree.figure.joints.items()
        },
    )


def place(placement: Placement, segment: str, point=POINT):
    pose = placement.poses[segment]
    return pose[:3, :3] @ point + pose[:3, 3]


def distance(placement: Placement, target: Target) -> float:
    return float(np.linalg.norm(target.error(placement.poses[target.segment])))


def slopes(placement: Placement, target: Target):
    """Change of half the squared distance by each displacement that may go on to reduce it."""
    tree = placement.tree
    jacobian = segment_jacobians(placement)[target.segment]
    where = target.place(placement.poses[target.segment])
    moved = jacobian[3:] - cross_matrix(where) @ jacobian[:3]
    slope = -moved.T @ (target.position - where)
    values = tree.kinematics.displacement_vector(placement.displacements)
    joints = [branch.joint for branch in tree.joints]
    low = np.concatenate([joint.lower_limit for joint in joints])
    high = np.concatenate([joint.upper_limit for joint in joints])
    stopped = ((values <= low) & (slope > 0.0)) | ((values >= high) & (slope < 0.0))
    return np.where(stopped, 0.0, slope)


def within_limits(placement: Placement) -> bool:
    return all(
        np.all(np.array(joint.lower_limit) <= placement.displacements[name])
        and np.all(placement.displacements[name] <= np.array(joint.upper_limit))
        for name, joint in placement.tree.figure.joints.items()
        if joint.lower_limit is not None
    )


@settings(max_examples=50, deadline=None)
@given(FIGURES, SEEDS, SEEDS)
@example("clavicles", 0, 2283973)
def test_a_reachable_target_is_reached_or_no_displacement_leads_nearer(name, start, goal) -> None:
    tree, segment = TREES[name], TIPS[name]
    begin = random_pose(tree, start)
    target = Target(segment, POINT, place(random_pose(tree, goal), segment))
    end = reach(tree, begin.displacements, target)
    assert within_limits(end)
    assert distance(end, target) <= distance(begin, target)
    assert distance(end, target) < 1e-3 or np.max(np.abs(slopes(end, target))) < 1e-5


def test_nearly_all_reachable_targets_are_reached() -> None:
    tree, segment = TREES["prototype"], TIPS["prototype"]
    missed = 0
    for seed in range(60):
        target = Target(segment, POINT, place(random_pose(tree, 1000 + seed), segment))
        end = reach(tree, random_pose(tree, seed).displacements, target)
        missed += distance(end, target) > 1e-3
    assert missed <= 3


@settings(max_examples=50, deadline=None)
@given(SEEDS, st.floats(0.8, 50.0), st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_a_target_out_of_reach_stretches_the_chain_towards_it(seed, far, direction) -> None:
    """Three bars of 0.3 m on ball joints, without limits."""
    tree = build_tree(row(3))
    way = np.array(direction) + np.array([0.0, 0.0, 1.5])
    way /= np.linalg.norm(way)
    tip = np.array([0.3, 0.0, 0.0])
    begin = random_pose(tree, seed)
    end = reach(tree, begin.displacements, Target("bar2", tip, (0.9 + far) * way))
    assert place(end, "bar2", tip) == pytest.approx(0.9 * way, abs=1e-3)


def test_a_stretched_limb_bends_towards_a_target_on_its_own_line() -> None:
    """The gradient is zero there: no displacement changes the distance in first order."""
    tree = build_tree(row(2, (chain("Rz"),)))
    straight = {name: np.zeros(1) for name in tree.figure.joints}
    tip = np.array([0.3, 0.0, 0.0])
    target = Target("bar1", tip, np.array([0.4, 0.0, 0.0]))
    assert distance(reach(tree, straight, target), target) < 1e-6


def test_a_limb_at_the_limit_of_its_elbow_bends_to_the_free_side() -> None:
    tree = build_tree(limited(row(2, (chain("Rz"),)), 0.0, 2.0))
    straight = {name: np.zeros(1) for name in tree.figure.joints}
    tip = np.array([0.3, 0.0, 0.0])
    target = Target("bar1", tip, np.array([0.3, 0.35, 0.0]))
    end = reach(tree, straight, target)
    assert distance(end, target) < 1e-6
    assert end.displacements["joint1"][0] > 0.1


def test_a_ball_joint_at_its_pole_moves_in_every_direction_without_a_jump() -> None:
    tree = build_tree(row(1))
    pole = {"joint0": np.array([0.3, 0.5 * np.pi, 0.2])}
    tip = np.array([0.3, 0.1, 0.05])
    begin = forward_kinematics(tree, pole)
    for k in range(12):
        turn = matrix_from_rotation_vector(0.02 * np.random.default_rng(k).normal(size=3))
        target = Target("bar0", tip, turn @ place(begin, "bar0", tip))
        end = reach(tree, pole, target)
        assert distance(end, target) < 1e-6
        assert np.max(np.abs(end.displacements["joint0"] - pole["joint0"])) < 0.5


def test_small_moves_of_the_target_move_the_joints_a_little() -> None:
    tree, segment = TREES["prototype"], TIPS["prototype"]
    placement = forward_kinematics(tree, initial_displacements(tree))
    where = place(placement, segment)
    for k in range(120):
        where = where + 0.004 * np.array([np.sin(0.11 * k), np.cos(0.05 * k), np.sin(0.07 * k)])
        moved = reach(tree, placement.displacements, Target(segment, POINT, where))
        change = [
            np.max(np.abs(moved.displacements[name] - values), initial=0.0)
            for name, values in placement.displacements.items()
        ]
        assert max(change) < 0.1
        placement = moved


def test_the_orientation_is_reached_too() -> None:
    tree = build_tree(row(3))
    goal = random_pose(tree, 5, -0.6, 0.6)
    pose = goal.poses["bar2"]
    target = Target("bar2", POINT, place(goal, "bar2"), pose[:3, :3])
    end = reach(tree, random_pose(tree, 6, -0.6, 0.6).displacements, target)
    assert end.poses["bar2"] == pytest.approx(pose, abs=1e-5)


def test_locked_joints_do_not_move() -> None:
    tree, segment = TREES["prototype"], TIPS["prototype"]
    begin = random_pose(tree, 1)
    locked = tree.figure.joints.keys() - {"left_shoulder", "left_elbow"}
    target = Target(segment, POINT, place(begin, segment) + np.array([0.05, 0.1, -0.05]))
    end = reach(tree, begin.displacements, target, locked=locked)
    for name in locked:
        assert np.array_equal(end.displacements[name], begin.displacements[name])
    assert distance(end, target) < distance(begin, target)


def test_a_start_outside_the_limits_does_not_jump_and_does_not_go_further_out() -> None:
    tree = build_tree(limited(row(2, (chain("Rz"),)), -0.1, 0.1))
    begin = forward_kinematics(tree, {"joint0": np.array([0.6]), "joint1": np.array([0.0])})
    same = reach(tree, begin.displacements, Target("bar1", POINT, place(begin, "bar1")))
    assert same.displacements["joint0"] == pytest.approx([0.6])
    high = Target("bar1", np.zeros(3), np.array([0.0, 5.0, 0.0]))
    assert reach(tree, begin.displacements, high).displacements["joint0"][0] <= 0.6


@settings(max_examples=15, deadline=None)
@given(st.floats(-np.pi, np.pi), st.floats(-0.5, 0.5), st.floats(-0.3, 0.7))
def test_loops_stay_closed(crank, x, y) -> None:
    start = initial_displacements(FOURBAR) | {"crank_bearing": np.array([crank])}
    begin = follow_and_close(FOURBAR, start, {"crank_bearing"})
    assert begin.displacements["crank_bearing"] == pytest.approx([crank], abs=1e-12)
    target = Target("coupler", np.array([0.15, 0.1, 0.0]), np.array([x, y, 0.0]))
    end = reach(FOURBAR, begin.displacements, target)
    assert gaps(end) <= MAX_LOOP_GAP
    assert distance(end, target) <= distance(begin, target)
    closing = FOURBAR.closures[0]
    chain_pose = FOURBAR.chains[closing.name].pose(end.displacements[closing.name])
    assert chain_pose == pytest.approx(end.pose_in_parent(closing), abs=1e-8)


def test_a_loop_is_led_to_a_pose_that_it_can_take() -> None:
    begin = follow_and_close(FOURBAR, initial_displacements(FOURBAR))
    start = initial_displacements(FOURBAR) | {"crank_bearing": np.radians([150.0])}
    goal = follow_and_close(FOURBAR, start, {"crank_bearing"})
    point = np.array([0.2, 0.0, 0.0])
    target = Target("crank", point, place(goal, "crank", point))
    end = reach(FOURBAR, begin.displacements, target)
    assert distance(end, target) < 1e-6
    assert end.displacements["crank_bearing"] == pytest.approx(np.radians([150.0]), abs=1e-5)


def test_limits_of_a_joint_that_closes_a_loop_are_kept() -> None:
    figure = read_figure("fourbar")
    closing = FOURBAR.closures[0].name
    value = figure.joints[closing].displacement[0]
    bound = replace(figure.joints[closing], lower_limit=(value - 0.2,), upper_limit=(value + 0.2,))
    tree = build_tree(figure.with_parts(bound))
    point = np.array([0.2, 0.0, 0.0])
    ends = []
    for crank in (90.0, 270.0):
        angle = np.radians(crank)
        target = Target("crank", point, 0.2 * np.array([np.cos(angle), np.sin(angle), 0.0]))
        end = reach(tree, follow_and_close(tree, initial_displacements(tree)).displacements, target)
        assert within_limits(end)
        assert gaps(end) <= MAX_LOOP_GAP
        ends.append(end.displacements[closing][0] - value)
    assert max(ends) == pytest.approx(0.2, abs=1e-3)
    assert min(ends) == pytest.approx(-0.2, abs=1e-3)


def test_a_loop_that_cannot_be_closed_is_an_error() -> None:
    start = initial_displacements(FOURBAR) | {"rocker_bearing": np.radians([0.0])}
    with pytest.raises(OpenLoopError, match="opens the loop"):
        follow_and_close(FOURBAR, start, {"rocker_bearing", "crank_bearing"})


def test_a_target_must_be_finite_and_of_this_figure() -> None:
    tree = TREES["slides"]
    start = initial_displacements(tree)
    with pytest.raises(ModelError, match="finite"):
        reach(tree, start, Target("bar0", POINT, np.array([np.nan, 0.0, 0.0])))
    with pytest.raises(ModelError, match="no segment `hand`"):
        reach(tree, start, Target("hand", POINT, POINT))


def test_a_segment_of_the_ground_stays() -> None:
    tree = TREES["slides"]
    start = initial_displacements(tree)
    end = reach(tree, start, Target("ground", POINT, np.ones(3)))
    assert end.displacements.keys() == start.keys()
    assert all(np.array_equal(end.displacements[name], start[name]) for name in start)


def test_a_long_chain_is_moved_without_its_curvature() -> None:
    tree = build_tree(row(60, bend=0.02))
    begin = forward_kinematics(tree, initial_displacements(tree))
    target = Target("bar59", POINT, place(begin, "bar59") + np.array([-1.5, 2.0, 1.0]))
    assert distance(reach(tree, begin.displacements, target), target) < 1e-6
