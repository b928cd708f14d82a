"""Signs that make a joint the mirror image of another, whatever axes a figure declares."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.diagnostics import ModelError
from generator.figure import AxisKind, JointAxis
from generator.figure_file import read_figure
from generator.kinematics.links import Coordinate, Link, Links, mirror_signs
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree

FIGURE = read_figure("clavicles")
PARTS = ("clavicle", "shoulder", "elbow", "hip_joint", "knee")
SIGNS = st.sampled_from([-1, 1])


def declared(figure, name, signs):
    """The figure with the axes of a joint multiplied by signs."""
    joint = figure.joints[name]
    chain = tuple(
        JointAxis(one.kind, tuple(sign * part for part in one.axis))
        for one, sign in zip(joint.chain, signs, strict=True)
    )
    return replace(figure, joints={**figure.joints, name: replace(joint, chain=chain)})


@pytest.mark.parametrize("part", PARTS)
def test_the_shipped_figures_declare_mirrored_axes(part):
    left, right = FIGURE.joints[f"left_{part}"], FIGURE.joints[f"right_{part}"]
    assert mirror_signs(FIGURE, left, right) == (1,) * len(left.chain)
    assert mirror_signs(FIGURE, right, left) == (1,) * len(left.chain)


@settings(max_examples=40)
@given(
    st.sampled_from(PARTS),
    st.lists(SIGNS, min_size=3, max_size=3),
    st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
    st.booleans(),
)
def test_with_the_signs_the_limb_is_the_mirror_image(part, signs, values, turned_round):
    name, other = f"right_{part}", f"left_{part}"
    count = len(FIGURE.joints[name].chain)
    figure = declared(FIGURE, name, signs[:count])
    if turned_round and count == 1:
        joint = figure.joints[name]
        backwards = replace(joint, parent=joint.child, child=joint.parent)
        figure = replace(figure, joints={**figure.joints, name: backwards})
    found = mirror_signs(figure, figure.joints[other], figure.joints[name])
    links = Links(
        tuple(Link(Coordinate(name, k), Coordinate(other, k), sign) for k, sign in enumerate(found))
    )
    tree = build_tree(figure)
    pose = {**initial_displacements(tree), other: np.array(values[:count])}
    poses = forward_kinematics(tree, links.follow(pose)).poses
    mirror, own = np.diag([-1.0, 1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0, 1.0])
    for segment, image in poses.items():
        if segment.startswith("left_"):
            opposite = poses[segment.replace("left_", "right_")]
            assert mirror @ image @ own == pytest.approx(opposite, abs=1e-12)


@pytest.mark.parametrize(
    ("control", "follower"),
    [
        ("left_elbow", "left_knee"),
        ("right_elbow", "left_knee"),
        ("left_shoulder", "waist"),
        ("left_clavicle", "left_clavicle"),
    ],
)
def test_joints_that_are_no_pair_are_refused(control, follower):
    with pytest.raises(ModelError, match=f"`{follower}` is not a mirror image of `{control}`"):
        mirror_signs(FIGURE, FIGURE.joints[control], FIGURE.joints[follower])


def renamed(figure, names):
    joints = {names.get(n, n): replace(j, name=names.get(n, n)) for n, j in figure.joints.items()}
    return replace(figure, joints=joints)


def test_places_make_a_pair_of_joints_with_other_names():
    figure = renamed(FIGURE, {"left_knee": "knie_links", "right_knee": "knie_rechts"})
    assert mirror_signs(figure, figure.joints["knie_links"], figure.joints["knie_rechts"]) == (1,)
    midway = renamed(FIGURE, {"left_clavicle": "one", "right_clavicle": "other"})
    with pytest.raises(ModelError, match="not a mirror image"):  # both lie in the plane itself
        mirror_signs(midway, midway.joints["one"], midway.joints["other"])


def test_joints_that_are_no_images_are_refused():
    joints = FIGURE.joints
    with pytest.raises(ModelError, match="`left_elbow` has 1 degree of freedom and `waist` 3"):
        mirror_signs(FIGURE, joints["left_elbow"], joints["waist"])
    oblique = declared(FIGURE, "right_elbow", [1])
    chain = (JointAxis(AxisKind.ROTATION, (1.0, 0.0, 0.0)),)
    oblique = replace(
        oblique,
        joints={**oblique.joints, "right_elbow": replace(joints["right_elbow"], chain=chain)},
    )
    with pytest.raises(ModelError, match="freedom 1 of `right_elbow` is not a mirror image"):
        mirror_signs(oblique, joints["left_elbow"], oblique.joints["right_elbow"])
