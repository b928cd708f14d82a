"""Where the segments of a figure are, and how they move, at given displacements."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from generator.figure import Joint
from generator.frames import Array, cross_matrix, inverse_pose
from generator.posture.tree import Branch, Tree

Displacements = Mapping[str, Array]
"""By joint name: a value for each factor of its chain, shape (n,) [rad or m]."""


@dataclass(frozen=True)
class Placement:
    """A tree in a pose.

    Attributes:
        tree: what is placed.
        displacements: of the joints of the tree; those of closures follow from the poses.
        poses: of each segment in the world, shape (4, 4).
    """

    tree: Tree
    displacements: Displacements
    poses: Mapping[str, Array]

    def between(self, joint: Joint) -> Array:
        """Pose of the child's site in the parent's at a joint, shape (4, 4)."""
        parent = site_pose(self, joint, "parent")
        return inverse_pose(parent) @ site_pose(self, joint, "child")


def drawn_displacements(tree: Tree) -> dict[str, Array]:
    """The displacements that the figure file gives, shape (n,) a joint."""
    return {name: np.array(joint.displacement) for name, joint in tree.figure.joints.items()}


def site_pose(placement: Placement, joint: Joint, side: str) -> Array:
    """Pose in the world of a joint's `parent` or `child` site, shape (4, 4)."""
    ref = joint.parent if side == "parent" else joint.child
    return placement.poses[ref.segment] @ placement.tree.figure.site(ref).pose_in_segment


def place(tree: Tree, displacements: Displacements) -> Placement:
    """Forward kinematics: the pose of every segment in the world.

    The root's site is the world's origin. `displacements` needs the joints of the tree's branches.
    """
    figure = tree.figure
    origin = inverse_pose(figure.site(figure.root).pose_in_segment)
    poses: dict[str, Array] = {figure.root.segment: origin}
    _place_ground(tree, poses)
    for branch in tree.branches:
        poses[branch.tip] = poses[branch.base] @ _step(tree, branch, displacements)
    return Placement(tree, displacements, poses)


def _place_ground(tree: Tree, poses: dict[str, Array]) -> None:
    """Poses of the other parts of the ground, which joints without freedom hold to the root's."""
    figure = tree.figure
    pending = [joint for joint in figure.joints.values() if not joint.chain]
    while len(poses) < len(figure.ground):
        for joint in pending:
            ends = (joint.parent, joint.child)
            for known, new in (ends, ends[::-1]):
                if known.segment in poses and new.segment in figure.ground - poses.keys():
                    site, other = figure.site(known), figure.site(new)
                    poses[new.segment] = (
                        poses[known.segment]
                        @ site.pose_in_segment
                        @ inverse_pose(other.pose_in_segment)
                    )


def _step(tree: Tree, branch: Branch, displacements: Displacements) -> Array:
    """Pose of a branch's tip in its base."""
    figure, joint = tree.figure, branch.joint
    moved = tree.chains[joint.name].pose(displacements[joint.name])
    parent = figure.site(joint.parent).pose_in_segment
    child = figure.site(joint.child).pose_in_segment
    tip_in_base = parent @ moved @ inverse_pose(child)
    return tip_in_base if branch.forward else inverse_pose(tip_in_base)


def motion_maps(placement: Placement) -> dict[str, Array]:
    """For each segment the map from the tree's displacement rates to its motion, shape (6, n).

    Rows: angular velocity, then velocity of the segment's material point at the world's origin, in
    world axes. Columns: the displacements of the branches, in their order.
    """
    tree = placement.tree
    width = sum(branch.joint.degrees_of_freedom for branch in tree.branches)
    maps = {name: np.zeros((6, width)) for name in tree.figure.ground}
    column = 0
    for branch in tree.branches:
        joint = branch.joint
        twists = tree.chains[joint.name].twists(placement.displacements[joint.name])
        carried = twists @ _twist_map(site_pose(placement, joint, "parent")).T
        count = joint.degrees_of_freedom
        motion = maps[branch.base].copy()
        motion[:, column : column + count] += carried.T if branch.forward else -carried.T
        maps[branch.tip] = motion
        column += count
    return maps


def _twist_map(pose: Array) -> Array:
    """The 6x6 map of (angular, linear) motions from a frame's axes and origin to the world's."""
    rotation, offset = pose[:3, :3], pose[:3, 3]
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = rotation
    result[3:, :3] = cross_matrix(offset) @ rotation
    return result


def relative_motion_map(placement: Placement, maps: Mapping[str, Array], joint: Joint) -> Array:
    """Motion of a joint's child relative to its parent for the tree's rates, shape (6, n).

    (angular, linear) in the parent's site frame, linear at the child's site.
    """
    child = site_pose(placement, joint, "child")
    turn = site_pose(placement, joint, "parent")[:3, :3].T
    relative = maps[joint.child.segment] - maps[joint.parent.segment]
    angular = relative[:3]
    linear = relative[3:] - cross_matrix(child[:3, 3]) @ angular
    return np.vstack([turn @ angular, turn @ linear])
