"""Forward kinematics: poses and velocities of the segments at given displacements."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import ModelError, NamedMapping
from generator.figure import Figure, Joint
from generator.kinematics.tree import Tree
from generator.rotations import Array, cross_matrix, inverse_pose
from springs.short_repr import short_repr

MAX_FRAMES_PER_PLACEMENT = 2000
"""Frames of one placement in a batch: poses of a figure like the prototype take some 30 MB."""

Displacements = Mapping[str, Array]
"""By joint name: a value for each factor of its chain, shape (n,) [rad or m]."""


@short_repr
@dataclass(frozen=True)
class Placement:
    """A tree in a pose.

    Attributes:
        tree: tree of the figure.
        displacements: displacements of the joints of the tree; those of closures follow from the
            poses.
        poses: poses of each segment in the world, shape (4, 4); ground first, then branch by
            branch.
    """

    tree: Tree
    displacements: Displacements
    poses: Mapping[str, Array]

    def pose_in_parent(self, joint: Joint) -> Array:
        """Pose of the child's site in the parent's at a joint, shape (4, 4)."""
        parent = site_pose(self, joint, "parent")
        return inverse_pose(parent) @ site_pose(self, joint, "child")


def initial_displacements(tree: Tree) -> dict[str, Array]:
    """Return the displacements in the figure file, shape (n,) per joint, after the followers'."""
    written = {name: np.array(joint.displacement) for name, joint in tree.figure.joints.items()}
    return with_followers(tree.figure, written)


def with_followers(figure: Figure, displacements: Displacements) -> dict[str, Array]:
    """Return displacements with those set that follow others in the figure's file.

    Args:
        figure: Figure whose joints they are.
        displacements: Displacements by joint, shape (..., n) [rad or m].
    """
    moved = dict(displacements)
    for name in displacements.keys() & figure.joints.keys():
        for k, one in enumerate(figure.joints[name].followers):
            if one is not None and one.joint in displacements:
                moved[name] = np.array(moved[name], dtype=float)
                moved[name][..., k] = one.curve.at(displacements[one.joint][..., one.index])
    return moved


def checked_joint_values(figure: Figure, values: Mapping[str, ArrayLike]) -> dict[str, Array]:
    """Return values as arrays, shape (n,) per joint, after checking them against the joints.

    Three values of an elastic joint, such as a neck, are those of its rotations.

    Raises UnknownNameError for an unknown joint, and ModelError for a wrong number of values or one
    that is not finite.
    """
    checked: dict[str, Array] = {}
    for name, numbers in values.items():
        joint = figure.joints[name]
        try:
            array = np.atleast_1d(np.asarray(numbers, dtype=float))
        except ValueError:
            raise ModelError(f"the values for joint {name} are not numbers: {numbers!r}") from None
        if array.ndim == 1 and not {joint.parent.segment, joint.child.segment} & figure.ground:
            array = np.array(joint.complete(array.tolist()))
        if array.shape != (len(joint.chain),):
            raise ModelError(f"joint {name} has {len(joint.chain)} displacements, not {array.size}")
        if not np.all(np.isfinite(array)):
            raise ModelError(f"a value for joint {name} is not finite")
        checked[name] = array
    return checked


def pose_figure(figure: Figure, displacements: Displacements) -> Figure:
    """Return the figure with these displacements in place of those of its file."""
    joints = {
        name: replace(joint, displacement=tuple(float(value) for value in displacements[name]))
        for name, joint in figure.joints.items()
    }
    return replace(figure, joints=joints)


def site_pose(placement: Placement, joint: Joint, side: str) -> Array:
    """Pose in the world of a joint's `parent` or `child` site, shape (4, 4)."""
    ref = joint.parent if side == "parent" else joint.child
    return placement.poses[ref.segment] @ placement.tree.figure.site(ref).pose_in_segment


def forward_kinematics(tree: Tree, displacements: Displacements) -> Placement:
    """Return the pose of every segment in the world.

    The root's site is the world's origin. `displacements` needs the joints of the tree.
    With a leading dimension, shape (frames, n) per joint, poses have shape (frames, 4, 4).

    Raises UnknownNameError for a joint that the figure does not have, and ModelError for a joint of
    the tree that is missing.
    """
    for name in displacements.keys() - tree.figure.joints.keys():
        _ = tree.figure.joints[name]
    missing = tree.kinematics.columns.keys() - displacements.keys()
    if missing:
        raise ModelError(f"the displacements of joint `{min(missing)}` are missing")
    kinematics = tree.kinematics
    return Placement(
        tree,
        displacements,
        NamedMapping(
            kinematics.poses(kinematics.displacement_vector(displacements)),
            "the figure has no segment",
        ),
    )


def batched_placements(
    tree: Tree, displacements: Mapping[str, Array], batch_size: int = MAX_FRAMES_PER_PLACEMENT
) -> Iterator[Placement]:
    """Yield the placements of a motion in batches of frames.

    Args:
        tree: tree of the figure.
        displacements: displacements of its joints, shape (frames, n) each [rad or m]. Those of
            joints that close loops are passed through.
        batch_size: maximum number of frames in a placement.
    """
    frames = len(next(iter(displacements.values()), ()))
    for start in range(0, frames, batch_size):
        some = slice(start, start + batch_size)
        yield forward_kinematics(tree, {name: rows[some] for name, rows in displacements.items()})


def segment_jacobians(placement: Placement) -> dict[str, Array]:
    """Return the Jacobian of each segment by the tree's displacements, shape (6, n).

    Rows: angular velocity, then velocity of the segment's material point at the world's origin, in
    world axes. Columns: the displacements of the tree's joints, in their order.
    """
    kinematics = placement.tree.kinematics
    columns = np.swapaxes(
        kinematics.twists(kinematics.displacement_vector(placement.displacements)), -1, -2
    )
    return {name: columns * moved for name, moved in kinematics.motion_masks.items()}


def relative_jacobian(placement: Placement, jacobians: Mapping[str, Array], joint: Joint) -> Array:
    """Return the Jacobian of the motion of a joint's child relative to its parent, shape (6, n).

    (angular, linear) in the parent's site frame, linear at the child's site.
    """
    child = site_pose(placement, joint, "child")
    turn = site_pose(placement, joint, "parent")[:3, :3].T
    relative = jacobians[joint.child.segment] - jacobians[joint.parent.segment]
    angular = relative[:3]
    linear = relative[3:] - cross_matrix(child[:3, 3]) @ angular
    return np.vstack([turn @ angular, turn @ linear])
