"""Arms of figures that are positioned: where the elbow and the thumb come to be."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.diagnostics import ModelError
from generator.figure import AxisKind, JointAxis, Location, Rotation, Translation
from generator.figure_file import read_figure
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.shoulder import (
    MAX_LONGITUDE,
    MIN_LONGITUDE,
    RHYTHMS,
    Side,
    printed_angle_error,
    shoulder_angles,
)
from generator.kinematics.shoulder_pose import pose_arm
from generator.kinematics.tree import build_tree

FIGURES = {name: read_figure(name) for name in ("clavicles", "prototype")}
TREES = {name: build_tree(figure) for name, figure in FIGURES.items()}
LATITUDES = st.floats(0.0, np.pi)
LONGITUDES = st.floats(MIN_LONGITUDE, MAX_LONGITUDE)
SIDES = st.sampled_from(Side)
WHERE = {
    "figure_name": st.sampled_from(sorted(FIGURES)),
    "side": SIDES,
    "latitude": LATITUDES,
    "longitude": LONGITUDES,
    "rhythm": st.sampled_from(sorted(RHYTHMS)),
}

_, UP, AHEAD = np.eye(3)
"""Axes of the world, in which the figure stands."""


def posed(figure_name, side, latitude, longitude, rhythm="otani", figure=None, waist=0.0):
    """Poses of the segments, with the arm positioned and the waist turned."""
    figure = figure or FIGURES[figure_name]
    tree = build_tree(figure)
    arm = pose_arm(figure, side, latitude, longitude, RHYTHMS[rhythm])
    displacements = {**initial_displacements(tree), **arm.displacements}
    displacements["waist"] = np.array([waist, -waist, waist])
    return forward_kinematics(tree, displacements).poses


def elbow(poses, side):
    """Direction of the upper arm's z axis, which runs to the elbow, in the torso."""
    return poses["center_torso"][:3, :3].T @ poses[f"{side.value}_upper_arm"][:3, 2]


@settings(max_examples=60)
@given(**WHERE, waist=st.floats(-0.5, 0.5))
def test_the_elbow_points_where_it_was_asked_for(
    figure_name, side, latitude, longitude, rhythm, waist
):
    poses = posed(figure_name, side, latitude, longitude, rhythm, waist=waist)
    outwards = 1.0 if side is Side.LEFT else -1.0
    asked = [
        np.sin(latitude) * np.cos(longitude),
        outwards * np.sin(latitude) * np.sin(longitude),
        np.cos(latitude),
    ]
    assert elbow(poses, side) == pytest.approx(np.array(asked), abs=1e-9)


@settings(max_examples=40)
@given(latitude=LATITUDES, longitude=LONGITUDES, rhythm=WHERE["rhythm"])
def test_left_and_right_are_mirror_images(latitude, longitude, rhythm):
    """In the world's x, and in the segments' own y: each has the same shape on both sides."""
    mirror, own = np.diag([-1.0, 1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0, 1.0])
    left, right = (posed("clavicles", side, latitude, longitude, rhythm) for side in Side)
    for part in ("clavicle", "upper_arm", "lower_arm"):
        image = mirror @ left[f"left_{part}"] @ own
        assert image == pytest.approx(right[f"right_{part}"], abs=1e-9)


@settings(max_examples=40)
@given(latitude=LATITUDES, longitude=LONGITUDES, rhythm=WHERE["rhythm"], side=SIDES)
def test_the_clavicles_displacements_are_its_angles(latitude, longitude, rhythm, side):
    arm = pose_arm(FIGURES["clavicles"], side, latitude, longitude, RHYTHMS[rhythm])
    angles = shoulder_angles(latitude, longitude, RHYTHMS[rhythm])
    asked = np.array([angles.clavicle_elevation, angles.clavicle_abduction])
    assert arm.displacements[f"{side.value}_clavicle"] == pytest.approx(asked, abs=1e-9)
    assert arm.elbow_error < np.radians(0.1)
    assert arm.printed_angle_error == printed_angle_error(latitude, longitude, angles)


@pytest.mark.parametrize("figure_name", FIGURES)
@pytest.mark.parametrize("side", Side)
def test_the_thumb_points_back_overhead_up_in_front_and_ahead_when_hanging(figure_name, side):
    """The thumb is the lower arm's x axis: it is ahead while the figure stands as drawn."""
    for longitude in np.linspace(MIN_LONGITUDE, MAX_LONGITUDE, 13):
        for latitude, thumb in ((0.0, -AHEAD), (np.pi, AHEAD)):
            poses = posed(figure_name, side, latitude, longitude)
            assert poses[f"{side.value}_lower_arm"][:3, 0] == pytest.approx(thumb, abs=1e-9)
    for longitude, thumb in ((0.0, UP), (np.pi / 2, UP), (np.pi, -UP)):
        poses = posed(figure_name, side, np.pi / 2, longitude)
        assert poses[f"{side.value}_lower_arm"][:3, 0] == pytest.approx(thumb, abs=1e-9)


def test_the_shoulder_rises_with_the_clavicle_and_comes_forwards():
    poses = posed("clavicles", Side.LEFT, np.pi / 2, 0.0)
    height, ahead = np.radians(21.3074), np.radians(18.0)
    offset = 0.172 * np.array(
        [np.cos(height) * np.cos(ahead), np.sin(height), np.cos(height) * np.sin(ahead)]
    )
    found = poses["left_upper_arm"][:3, 3] - poses["left_clavicle"][:3, 3]
    assert found == pytest.approx(offset, abs=1e-9)


def test_the_other_joints_stay():
    arm = pose_arm(FIGURES["clavicles"], Side.RIGHT, 1.0, 1.0)
    assert set(arm.displacements) == {"right_clavicle", "right_shoulder"}
    assert set(pose_arm(FIGURES["prototype"], Side.RIGHT, 1.0, 1.0).displacements) == {
        "right_shoulder"
    }


def test_a_hanging_arm_without_a_clavicle_stays_as_drawn():
    arm = pose_arm(FIGURES["prototype"], Side.LEFT, np.pi, 0.3)
    assert arm.displacements["left_shoulder"] == pytest.approx(np.zeros(3), abs=1e-9)


def with_joint(figure, name, **changes):
    return replace(figure, joints={**figure.joints, name: replace(figure.joints[name], **changes)})


def with_site(figure, segment, site, location):
    old = figure.segments[segment]
    sites = {**old.sites, site: replace(old.sites[site], location=location)}
    return replace(figure, segments={**figure.segments, segment: replace(old, sites=sites)})


def test_the_order_within_connect_does_not_matter():
    figure = FIGURES["clavicles"]
    for name in ("left_clavicle", "left_shoulder"):
        joint = figure.joints[name]
        chain = tuple(
            JointAxis(AxisKind.ROTATION, tuple(-x for x in one.axis))
            for one in reversed(joint.chain)
        )
        figure = with_joint(figure, name, parent=joint.child, child=joint.parent, chain=chain)
    poses = posed("", Side.LEFT, 1.0, 0.4, figure=figure)
    same = posed("clavicles", Side.LEFT, 1.0, 0.4)
    for segment, pose in same.items():
        assert poses[segment] == pytest.approx(pose, abs=1e-9)


def test_an_arm_that_is_drawn_to_the_side_is_posed_as_one_that_hangs():
    drawn = FIGURES["prototype"]
    location = Location((Rotation((np.radians(-90.0), 0.0, 0.0)), Translation((0.0, 0.172, 0.5))))
    figure = with_site(drawn, "center_torso", "lcl_lateral", location)
    sideways = forward_kinematics(
        build_tree(figure), initial_displacements(build_tree(figure))
    ).poses
    assert elbow(sideways, Side.LEFT) == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    poses, same = (posed("", Side.LEFT, 0.7, 0.9, figure=one) for one in (figure, drawn))
    assert poses["left_upper_arm"] == pytest.approx(same["left_upper_arm"], abs=1e-9)


def test_what_is_no_arm_is_refused():
    figure = FIGURES["clavicles"]
    nameless = replace(
        figure,
        joints={
            each.name: each
            for joint in figure.joints.values()
            for each in [
                replace(joint, name="left_shouldr") if joint.name == "left_shoulder" else joint
            ]
        },
    )
    with pytest.raises(ModelError, match="no joint `left_shoulder`; did you mean `left_should"):
        pose_arm(nameless, Side.LEFT, 1.0, 1.0)
    apart = with_joint(figure, "left_elbow", parent=figure.joints["right_elbow"].parent)
    with pytest.raises(ModelError, match="share no segment; the upper arm"):
        pose_arm(apart, Side.LEFT, 1.0, 1.0)
    at_one_point = with_site(figure, "left_upper_arm", "distal", Location())
    with pytest.raises(ModelError, match="are at the same point"):
        pose_arm(at_one_point, Side.LEFT, 1.0, 1.0)
    beside = with_joint(figure, "left_clavicle", child=figure.joints["right_clavicle"].child)
    with pytest.raises(ModelError, match="`left_clavicle` does not carry `left_shoulder`"):
        pose_arm(beside, Side.LEFT, 1.0, 1.0)


def test_a_joint_that_cannot_reach_is_named():
    figure = FIGURES["clavicles"]
    hinge = with_joint(
        figure,
        "left_shoulder",
        chain=(JointAxis(AxisKind.ROTATION, (0.0, 1.0, 0.0)),),
        displacement=(0.0,),
        stiff=None,
        rest=None,
        damp=None,
    )
    with pytest.raises(
        ModelError, match=r"`left_shoulder` cannot reach this orientation: it is off by .* deg"
    ):
        pose_arm(hinge, Side.LEFT, 1.0, 1.0)
