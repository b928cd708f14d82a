"""Closing loops: poses, velocities, refusals."""

from dataclasses import replace

import numpy as np
import pytest

from generator import read_figure
from generator.kinematics.loops import OpenLoopError, close_loops, consistent_rates
from generator.kinematics.placement import (
    initial_displacements,
    relative_jacobian,
    segment_jacobians,
)
from generator.kinematics.tree import build_tree
from tests.chains import BALL, at, body, chain, figure, ground, joint, row

FOURBAR = read_figure("fourbar")


def fourbar(**moved: float):
    tree = build_tree(FOURBAR)
    values = initial_displacements(tree)
    values.update({name: np.array([value]) for name, value in moved.items()})
    return tree, values


def gaps(placement) -> float:
    joints = placement.tree.closures
    return max(
        float(
            np.max(np.abs(placement.tree.chains[j.name].pose_residual(placement.pose_in_parent(j))))
        )
        for j in joints
    )


def test_a_tree_is_placed_as_asked() -> None:
    tree = build_tree(row(3))
    asked = initial_displacements(tree)
    assert close_loops(tree, asked).displacements == asked


def test_a_closed_pose_stays() -> None:
    tree, asked = fourbar()
    placement = close_loops(tree, asked)
    for name, values in asked.items():
        assert placement.displacements[name] == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize("crank", [-170.0, -90.0, 0.0, 10.0, 60.0, 150.0, 230.0, 270.0, 359.0])
def test_an_open_pose_is_closed_around_the_held_joint(crank) -> None:
    """The others end within half a turn of where they are drawn."""
    tree, asked = fourbar(crank_bearing=np.radians(crank))
    placement = close_loops(tree, asked, fixed={"crank_bearing"})
    assert placement.displacements["crank_bearing"] == pytest.approx(np.radians([crank]), abs=1e-12)
    assert gaps(placement) < 1e-9
    coupler, rocker = (
        (placement.poses[name] @ [length, 0.0, 0.0, 1.0])[:3]
        for name, length in (("coupler", 0.3), ("rocker", 0.4))
    )
    assert coupler == pytest.approx(rocker, abs=1e-8)
    for name in ("crank_pin", "rocker_bearing", "rocker_pin"):
        assert abs(placement.displacements[name][0] - asked[name][0]) <= np.pi + 1e-9


def test_a_closing_joint_can_be_held() -> None:
    tree, asked = fourbar()
    closing = tree.closures[0].name
    asked[closing] = asked[closing] + 0.2
    placement = close_loops(tree, asked, fixed={closing})
    assert placement.displacements[closing] == pytest.approx(asked[closing], abs=1e-8)
    assert gaps(placement) < 1e-9


def test_displacements_of_the_closing_joint_follow_from_the_pose() -> None:
    tree, asked = fourbar(crank_bearing=np.radians(200.0))
    placement = close_loops(tree, asked, fixed={"crank_bearing"})
    joint = tree.closures[0]
    found = tree.chains[joint.name].pose(placement.displacements[joint.name])
    assert np.allclose(found, placement.pose_in_parent(joint), atol=1e-8)


def test_a_pose_that_cannot_close_is_refused_with_the_gap() -> None:
    """Crank and rocker held so that their ends stay 43 mm too far apart for the coupler."""
    tree, asked = fourbar(crank_bearing=np.radians(180.0), rocker_bearing=np.radians(160.0))
    crank = np.array([-0.2, 0.0])
    rocker = np.array([0.2, 0.3]) + 0.4 * np.array(
        [np.cos(np.radians(160)), np.sin(np.radians(160))]
    )
    missing = 1000.0 * (np.linalg.norm(rocker - crank) - 0.3)
    with pytest.raises(OpenLoopError, match=r"mm") as caught:
        close_loops(tree, asked, fixed={"crank_bearing", "rocker_bearing"})
    told = float(str(caught.value).split(" mm")[0].split()[-1])
    assert told == pytest.approx(missing, rel=0.01)


def test_a_loop_with_nothing_free_is_refused() -> None:
    tree, asked = fourbar(crank_bearing=np.radians(200.0))
    with pytest.raises(OpenLoopError, match="mm"):
        close_loops(tree, asked, fixed=set(asked))


def test_a_held_closing_joint_that_cannot_stay_is_refused() -> None:
    tree, asked = fourbar()
    closing = tree.closures[0].name
    asked[closing] = asked[closing] + 0.2
    with pytest.raises(OpenLoopError, match=closing):
        close_loops(tree, asked, fixed={closing, "crank_bearing"})


def test_velocities_keep_the_loop_closed() -> None:
    tree, asked = fourbar()
    placement = close_loops(tree, asked)
    rates = {name: np.zeros(1) for name in asked} | {"crank_bearing": np.array([2.0])}
    found = consistent_rates(placement, rates, {"crank_bearing"})
    column = [b.joint.name for b in tree.joints].index("crank_bearing")
    assert found[column] == pytest.approx(2.0)
    joint = tree.closures[0]
    motion = relative_jacobian(placement, segment_jacobians(placement), joint) @ found
    assert np.allclose(motion[:2], 0.0, atol=1e-9)
    assert np.allclose(motion[3:], 0.0, atol=1e-9)


def test_the_rate_of_a_closing_joint_can_be_held() -> None:
    tree, asked = fourbar()
    placement = close_loops(tree, asked)
    joint = tree.closures[0]
    rates = {name: np.zeros(1) for name in asked} | {joint.name: np.array([1.5])}
    found = consistent_rates(placement, rates, {joint.name})
    motion = relative_jacobian(placement, segment_jacobians(placement), joint) @ found
    assert motion == pytest.approx([0.0, 0.0, 1.5, 0.0, 0.0, 0.0], abs=1e-9)


def test_velocities_that_tear_a_loop_are_refused() -> None:
    tree, asked = fourbar()
    placement = close_loops(tree, asked)
    rates = {name: np.ones(1) for name in asked}
    with pytest.raises(OpenLoopError, match="opens the loop closed by rocker_pin"):
        consistent_rates(placement, rates, set(asked))


def test_rates_of_a_tree_are_those_asked_for() -> None:
    tree = build_tree(row(2))
    placement = close_loops(tree, initial_displacements(tree))
    rates = {"joint0": np.array([1.0, 2.0, 3.0]), "joint1": np.array([4.0, 5.0, 6.0])}
    assert consistent_rates(placement, rates, set()) == pytest.approx([1, 2, 3, 4, 5, 6])


def test_a_spatial_loop_of_balls_closes() -> None:
    made = figure(
        [
            ground(post=at(shift=(0.5, 0.1, 0.2))),
            body("a", sites={"far": at(shift=(0.3, 0.0, 0.0))}),
            body("b", sites={"far": at(shift=(0.4, 0.0, 0.0))}),
        ],
        [
            joint("one", "ground.base", "a.near", BALL, (0.1, -0.2, 0.6)),
            joint("two", "a.far", "b.near", chain("Ry Rz"), (0.2, -1.0)),
            joint("three", "b.far", "ground.post", BALL, (0.0, 0.0, 0.0)),
        ],
    )
    tree = build_tree(made)
    asked = initial_displacements(tree)
    placement = close_loops(tree, asked)
    assert gaps(placement) < 1e-9
    assert [b.joint.name for b in tree.joints] == ["one", "three"]


def test_the_order_of_the_joints_does_not_matter() -> None:
    tree, asked = fourbar(crank_bearing=np.radians(200.0))
    other = build_tree(replace(tree.figure, joints=dict(reversed(tree.figure.joints.items()))))
    assert other.closures != tree.closures
    placements = [close_loops(t, asked, fixed={"crank_bearing"}) for t in (tree, other)]
    # One freedom is held and the linkage has no other: the pose is the same.
    for name in ("crank", "coupler", "rocker"):
        assert np.allclose(placements[0].poses[name], placements[1].poses[name], atol=1e-8)
