"""Editing a pose: history, coordinates, mirror images, arms, files and the ranges of sliders."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from generator import read_figure
from generator.diagnostics import InputError, ModelError, UsageError
from generator.kinematics.links import Coordinate, mirrored_differences, mirrored_name
from generator.kinematics.loops import MAX_LOOP_GAP, OpenLoopError
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.reach import Target, follow_and_close
from generator.kinematics.shoulder import Side
from generator.kinematics.tree import build_tree
from generator.springs_file.read import read_springs
from generator.viewer.pose_editor import (
    Mirroring,
    PoseEditor,
    coordinate_range,
    drag_point,
    end_segments,
    limb_joints,
    spring_dead_zone,
)
from springs import AxisSpring, Cubic, JointSprings, SpringSet
from springs.exponential import Exponential, ExponentialTerm
from springs.stop import Stop
from tests.chains import BALL, at, body, chain, ground, joint, one_body, row
from tests.chains import figure as make_figure
from tests.generator.kinematics.test_loops import gaps

FIGURES = {name: read_figure(name) for name in ("prototype", "clavicles", "fourbar")}
TREES = {name: build_tree(figure) for name, figure in FIGURES.items()}
SEEDS = st.integers(0, 2**32 - 1)


def editor(name: str = "prototype") -> PoseEditor:
    tree = TREES[name]
    return PoseEditor(follow_and_close(tree, initial_displacements(tree)))


def randomize(made: PoseEditor, seed: int, size: float = 1.2) -> None:
    draw = np.random.default_rng(seed)
    made.set({n: draw.uniform(-size, size, len(v)) for n, v in made.displacements.items()})


def equal(one, other) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[n], other[n]) for n in one)


def test_one_coordinate_is_set_and_no_other() -> None:
    made = editor()
    before = made.displacements
    made.set_coordinate(Coordinate("left_shoulder", 1), 0.3)
    assert made.displacements["left_shoulder"] == pytest.approx([0.0, 0.3, 0.0])
    assert equal({**before, "left_shoulder": made.displacements["left_shoulder"]},
                 dict(made.displacements))  # fmt: skip
    poses = forward_kinematics(made.tree, made.displacements).poses
    for name, pose in poses.items():
        assert made.placement.poses[name] == pytest.approx(pose)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e9])
def test_a_value_that_is_not_a_displacement_is_refused(value) -> None:
    made = editor()
    with pytest.raises(UsageError, match="not a displacement"):
        made.set_coordinate(Coordinate("left_elbow", 0), value)
    assert not made.can_undo


@settings(max_examples=30, deadline=None)
@given(st.lists(st.sampled_from(["set", "undo", "redo", "reset", "mirror"]), max_size=25), SEEDS)
@example(["set", "set", "undo", "set", "redo"], 1)
def test_undo_and_redo_walk_through_the_poses(actions, seed) -> None:
    """The history is compared with a list of all poses and a place in it."""
    draw = np.random.default_rng(seed)
    made = editor()
    poses, at = [dict(made.displacements)], 0
    for action in actions:
        if action == "undo":
            made.undo()
            at = max(at - 1, 0)
        elif action == "redo":
            made.redo()
            at = min(at + 1, len(poses) - 1)
        else:
            if action == "set":
                made.set_coordinate(Coordinate("waist", int(draw.integers(3))), draw.uniform(-1, 1))
            elif action == "reset":
                made.reset()
            else:
                made.mirror(Mirroring.SWAP)
            made.end_group()
            del poses[at + 1 :]
            poses.append(dict(made.displacements))
            at += 1
        assert equal(dict(made.displacements), poses[at])
        assert (made.can_undo, made.can_redo) == (at > 0, at < len(poses) - 1)


def test_moves_of_one_slider_in_a_row_are_undone_together() -> None:
    made = editor()
    for value in (0.1, 0.2, 0.3):
        made.set_coordinate(Coordinate("left_elbow", 0), value)
    made.set_coordinate(Coordinate("right_elbow", 0), 0.5)
    made.end_group()
    made.set_coordinate(Coordinate("right_elbow", 0), 0.6)
    made.undo()
    assert made.displacements["right_elbow"] == pytest.approx([0.5])
    made.undo()
    assert made.displacements["right_elbow"] == pytest.approx([0.0])
    made.undo()
    assert made.displacements["left_elbow"] == pytest.approx([0.0])
    assert not made.can_undo


@pytest.mark.parametrize("name", ["crank_bearing", "rocker_bearing", "rocker_pin", "crank_pin"])
def test_a_loop_closes_around_the_joint_that_is_set(name) -> None:
    made = editor("fourbar")
    value = float(made.displacements[name][0]) + 0.2
    made.set_coordinate(Coordinate(name, 0), value)
    assert made.displacements[name] == pytest.approx([value], abs=1e-9)
    assert gaps(made.placement) <= MAX_LOOP_GAP


def test_a_pose_that_opens_a_loop_is_refused_and_the_pose_stays() -> None:
    made = editor("fourbar")
    before = dict(made.displacements)
    with pytest.raises(OpenLoopError):
        made.set_coordinate(Coordinate("rocker_bearing", 0), 0.0)
    assert equal(dict(made.displacements), before)
    assert not made.can_undo


@pytest.mark.parametrize("name", ["prototype", "clavicles"])
@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_exchanged_sides_are_the_mirror_image_in_the_world(name, seed) -> None:
    """Of each segment the frame's origin goes to the mirror image of the other side's."""
    made = editor(name)
    randomize(made, seed)
    before = made.placement
    made.mirror(Mirroring.SWAP)
    mirror = np.diag([-1.0, 1.0, 1.0])
    for segment, pose in made.placement.poses.items():
        image = before.poses[mirrored_name(segment)]
        point = (image @ np.array([0.0, 0.0, 0.0, 1.0]))[:3]
        assert pose[:3, 3] == pytest.approx(mirror @ point, abs=1e-3)
    made.mirror(Mirroring.SWAP)
    for segment, pose in made.placement.poses.items():
        assert pose == pytest.approx(before.poses[segment], abs=1e-9)


@pytest.mark.parametrize(
    ("mirroring", "kept"), [(Mirroring.LEFT_TO_RIGHT, "left"), (Mirroring.RIGHT_TO_LEFT, "right")]
)
def test_a_side_is_mirrored_to_the_other_and_the_middle_stays(mirroring, kept) -> None:
    made = editor("clavicles")
    randomize(made, 7)
    before = dict(made.displacements)
    made.mirror(mirroring)
    for name, values in made.displacements.items():
        if kept in name or mirrored_name(name) == name:
            assert np.array_equal(values, before[name])
    differences = mirrored_differences(made.figure, made.displacements)
    assert differences
    assert max(differences.values()) == pytest.approx(0.0, abs=1e-12)


def test_ball_joints_with_other_axes_are_mirrored_by_their_rotation() -> None:
    """The right shoulder turns about its axes in another order than the left one."""
    figure = FIGURES["prototype"]
    turned = replace(figure.joints["right_shoulder"], chain=chain("Rx Ry Rz"))
    tree = build_tree(figure.with_parts(turned))
    start = initial_displacements(tree) | {"left_shoulder": np.array([0.4, -0.7, 0.2])}
    made = PoseEditor(forward_kinematics(tree, start))
    made.mirror(Mirroring.LEFT_TO_RIGHT)
    elbows = [made.placement.poses[f"{side}_lower_arm"][:3, 3] for side in ("left", "right")]
    assert elbows[1] == pytest.approx(np.diag([-1.0, 1.0, 1.0]) @ elbows[0], abs=1e-3)


def test_a_ball_joint_is_mirrored_to_one_of_the_opposite_sense() -> None:
    """The right hand is the parent of its joint, and its axes are in another order."""
    far = {"far": at(shift=(0.1, 0.3, 0.2))}
    hands = [
        body("left_hand", sites=far),
        body("right_hand", sites={"far": at(shift=(-0.1, 0.3, 0.2))}),
    ]
    joints = [
        joint("left_wrist", "ground.base", "left_hand.near", chain("Rx Ry Rz")),
        joint("right_wrist", "right_hand.near", "ground.base", chain("Rz Ry Rx")),
    ]
    tree = build_tree(make_figure([ground(), *hands], joints))
    made = PoseEditor(forward_kinematics(tree, initial_displacements(tree)))
    made.set({"left_wrist": np.array([0.4, -0.7, 0.3])})
    made.mirror(Mirroring.LEFT_TO_RIGHT)
    ends = [
        made.placement.poses[hand.name] @ hand.sites["far"].pose_in_segment[:, 3] for hand in hands
    ]
    assert ends[1][:3] == pytest.approx(np.diag([-1.0, 1.0, 1.0]) @ ends[0][:3], abs=1e-9)


def test_a_figure_without_sides_cannot_be_mirrored() -> None:
    tree = build_tree(row(2))
    made = PoseEditor(forward_kinematics(tree, initial_displacements(tree)))
    assert not made.can_mirror
    assert editor().can_mirror


@settings(max_examples=20, deadline=None)
@given(st.floats(0.05, np.pi - 0.05), st.floats(-1.5, 3.0), st.sampled_from(Side), SEEDS)
def test_the_elbow_has_the_latitude_and_longitude_that_were_set(latitude, longitude, side, seed):
    made = editor("clavicles")
    randomize(made, seed, 0.4)
    made.pose_arm(side, latitude, longitude)
    assert made.arm_direction(side) == pytest.approx((latitude, longitude), abs=1e-6)


def test_a_figure_without_arms_says_so() -> None:
    made = editor("fourbar")
    assert made.arm_direction(Side.LEFT) is None
    with pytest.raises(ModelError, match="no joint `left_shoulder`"):
        made.pose_arm(Side.LEFT, 1.0, 1.0)


def test_a_pose_of_another_figure_is_refused(tmp_path: Path) -> None:
    made = editor()
    path = tmp_path / "a.pose"
    path.write_text(editor("fourbar").text())
    with pytest.raises(InputError, match="crank_bearing"):
        made.load(path)
    with pytest.raises(InputError, match="missing"):
        made.load(tmp_path / "missing.pose")
    assert not made.can_undo


def test_dragging_is_one_step_of_the_history() -> None:
    made = editor()
    segment = "left_lower_arm"
    point = drag_point(made.tree, segment)
    target = partial(Target, segment, point)
    start = target(np.zeros(3)).place(made.placement.poses[segment])
    held = frozenset(made.figure.joints.keys() - set(limb_joints(made.tree, segment)))
    for k in range(1, 6):
        made.drag(target(start + 0.02 * k * np.array([0.3, 1.0, 0.5])), held)
    end = target(np.zeros(3)).place(made.placement.poses[segment])
    assert end == pytest.approx(start + 0.1 * np.array([0.3, 1.0, 0.5]), abs=1e-6)
    assert np.array_equal(made.displacements["waist"], np.zeros(3))
    made.undo()
    assert not made.can_undo


def test_a_dragged_elbow_does_not_bend_backwards() -> None:
    figure = FIGURES["prototype"]
    springs = read_springs(None, figure)
    made = PoseEditor(editor().placement, springs=springs)
    normal = coordinate_range(figure.joints["left_elbow"], 0, springs).normal
    assert normal is not None
    point = drag_point(made.tree, "left_lower_arm")
    draw = np.random.default_rng(2)
    for _ in range(20):
        target = Target("left_lower_arm", point, np.array([0.2, 1.2, 0.0]) + draw.normal(0, 0.2, 3))
        made.drag(target, frozenset())
        assert normal[0] <= made.displacements["left_elbow"][0] <= normal[1]


def test_slides_of_two_sides_are_mirrored() -> None:
    """A slide across goes to the other side; one along the plane goes the same way."""
    chains = chain("Tx Ty")
    bodies = [body("left_hand"), body("right_hand")]
    joints = [joint(f"{side}_slide", "ground.base", f"{side}_hand.near", chains)
              for side in ("left", "right")]  # fmt: skip
    tree = build_tree(make_figure([ground(), *bodies], joints))
    made = PoseEditor(forward_kinematics(tree, initial_displacements(tree)))
    made.set({"left_slide": np.array([0.2, 0.3])})
    made.mirror(Mirroring.LEFT_TO_RIGHT)
    assert made.displacements["right_slide"] == pytest.approx([-0.2, 0.3])


def test_displacements_of_a_motion_are_taken_over_for_the_joints_that_the_figure_has() -> None:
    made = editor()
    made.take_over({"left_elbow": np.array([0.4]), "torso": np.zeros(6), "waist": np.zeros(2)})
    assert made.displacements["left_elbow"] == pytest.approx([0.4])
    made.undo()
    assert made.displacements["left_elbow"] == pytest.approx([0.0])
    made.take_over(made.displacements)
    assert not made.can_undo


def test_limbs_end_where_the_tree_branches() -> None:
    tree = TREES["clavicles"]
    assert limb_joints(tree, "left_lower_arm") == ("left_elbow", "left_shoulder", "left_clavicle")
    assert limb_joints(tree, "right_lower_leg") == ("right_knee", "right_hip_joint")
    assert set(end_segments(tree)) == {
        f"{side}_lower_{limb}" for side in ("left", "right") for limb in ("arm", "leg")
    }
    assert limb_joints(TREES["fourbar"], "coupler") == ("crank_pin", "crank_bearing")
    assert set(end_segments(TREES["fourbar"])) == {"coupler", "rocker"}


def test_a_segment_is_dragged_by_the_site_farthest_from_its_joint() -> None:
    assert drag_point(TREES["fourbar"], "coupler") == pytest.approx([0.3, 0.0, 0.0])
    assert drag_point(build_tree(row(2)), "bar1") == pytest.approx([0.3, 0.0, 0.0])


def springs_of(name: str, *axes: AxisSpring) -> SpringSet:
    return SpringSet({name: JointSprings(name, axes)})


ZONE = Cubic((0.0, 1.0, 0.0, 5.0), -1, (-0.2, 0.4), 0.1)
LAW = Exponential((ExponentialTerm(1.0, 2.0, 0.0),), 0.0, (-0.5, 1.5))


def test_a_slider_has_the_limits_of_the_figure() -> None:
    pin = joint("pin", "ground.base", "link.near", chain("Rz Tx"),
                lower_limit=(-0.5, -np.inf), upper_limit=(np.inf, 0.2))  # fmt: skip
    known = coordinate_range(pin, 0, SpringSet())
    assert (known.low, known.high, known.limits) == (-0.5, np.pi, (-0.5, np.inf))
    slide = coordinate_range(pin, 1, SpringSet())
    assert (slide.low, slide.high) == (-0.8, 0.2)
    assert coordinate_range(one_body(BALL).joints["pin"], 0, SpringSet()).limits is None


def test_a_slider_without_limits_goes_beyond_the_normal_range() -> None:
    figure = FIGURES["prototype"]
    springs = read_springs(None, figure)
    known = coordinate_range(figure.joints["left_elbow"], 0, springs)
    assert known.motion == "flexion"
    assert known.normal is not None
    low, high = known.normal
    assert known.low < low < high < known.high < np.pi
    assert np.degrees(known.high) % 5.0 == pytest.approx(0.0, abs=1e-9)
    unknown = coordinate_range(one_body(BALL).joints["pin"], 0, SpringSet())
    assert (unknown.low, unknown.high) == (-np.pi, np.pi)


@pytest.mark.parametrize("sign", [1, -1])
def test_dead_zone_and_measured_range_are_in_the_sense_of_the_slider(sign) -> None:
    pin = one_body(chain("Rz")).joints["pin"]
    axis = (0.0, 0.0, float(sign))
    zone = coordinate_range(pin, 0, springs_of("pin", AxisSpring(axis, (ZONE,)))).dead_zone
    ends = coordinate_range(pin, 0, springs_of("pin", AxisSpring(axis, (LAW,)))).measured
    assert zone == pytest.approx((-0.1, 0.5) if sign > 0 else (-0.5, 0.1))
    assert ends == pytest.approx((-0.5, 1.5) if sign > 0 else (-1.5, 0.5))


def test_a_spring_about_another_axis_says_nothing() -> None:
    pin = one_body(BALL).joints["pin"]
    springs = springs_of("pin", AxisSpring((1.0, 0.0, 0.0), (ZONE,), motion="flexion"))
    assert [coordinate_range(pin, k, springs).motion for k in range(3)] == ["flexion", "", ""]


def test_dead_zones_of_sums_of_laws() -> None:
    axis = (0.0, 0.0, 1.0)
    assert spring_dead_zone(AxisSpring(axis, (LAW,))) is None
    narrow = Cubic((0.0, 1.0, 0.0, 5.0), -1, (-0.1, 0.2))
    assert spring_dead_zone(AxisSpring(axis, (ZONE, narrow))) == pytest.approx((-0.1, 0.2))
    assert spring_dead_zone(AxisSpring(axis, (ZONE, Stop(-1.0, 1.0)))) == pytest.approx((-0.1, 0.5))
