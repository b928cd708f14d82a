"""The kinematic tree of a figure, rooted in the ground, and the joints that close its loops.

Every factor of every chain is the exponential of a constant twist: with displacement v, generator G
of its angular part and T of its linear part, 4x4 matrices, it is
`1 + sin(v) G + (1 - cos(v)) G^2 + v T`. All of them are evaluated at once. A joint whose child is
inboard takes its factors in the opposite order, with opposite generators.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from generator.figure import Figure, Joint
from generator.figure_file.check import require_valid_figure
from generator.joint_chain import Chain, build_chain
from generator.rotations import Array, cross_matrix, inverse_pose
from springs.short_repr import short_repr


@short_repr
@dataclass(frozen=True)
class TreeJoint:
    """A joint of the tree, from the segment `inboard` to the segment `outboard`.

    `parent_is_inboard` is true where the file says `connect INBOARD to OUTBOARD`.
    """

    joint: Joint
    inboard: str
    outboard: str
    parent_is_inboard: bool


@dataclass(frozen=True)
class _JointTransform:
    """Transform across a joint: a constant pose, the factors of `columns`, a constant pose."""

    inboard: str
    outboard: str
    pose_before: Array
    columns: range
    pose_after: Array


class Kinematics:
    """Poses and motions of the segments of a tree of m displacements.

    The displacements are those of the tree's joints, one joint after the other, each in the order
    of its chain. Arrays of them may have leading dimensions: shape (..., m).

    Attributes:
        size: the number m.
        columns: indices of each joint's displacements among the m, by joint name.
        motion_masks: motion masks for each segment, which of the displacements move it, shape (m,).
    """

    def __init__(self, figure: Figure, branches: Sequence[TreeJoint]) -> None:
        """Precompute the transforms of joints in an order from inboard to outboard."""
        self._ground = _ground_poses(figure)
        self._links: list[_JointTransform] = []
        self.columns: dict[str, slice] = {}
        self.size = sum(len(branch.joint.chain) for branch in branches)
        self.motion_masks: dict[str, NDArray[np.bool_]] = {
            name: np.zeros(self.size, dtype=bool) for name in figure.ground
        }
        self._rotation_generators, self._translation_generators = (
            np.zeros((self.size, 4, 4)) for _ in range(2)
        )
        start = 0
        for branch in branches:
            joint = branch.joint
            stop = start + len(joint.chain)
            self.columns[joint.name] = slice(start, stop)
            for k, factor in enumerate(joint.chain, start):
                sense = 1.0 if branch.parent_is_inboard else -1.0
                self._rotation_generators[k, :3, :3] = cross_matrix(
                    sense * np.array(factor.twist.angular)
                )
                self._translation_generators[k, :3, 3] = sense * np.array(factor.twist.linear)
            parent, child = (figure.site(ref).pose_in_segment for ref in joint.ends)
            order = range(start, stop)
            self._links.append(
                _JointTransform(
                    branch.inboard, branch.outboard, parent, order[::-1], inverse_pose(child)
                )
                if branch.parent_is_inboard
                else _JointTransform(
                    branch.inboard, branch.outboard, child, order, inverse_pose(parent)
                )
            )
            self.motion_masks[branch.outboard] = self.motion_masks[branch.inboard].copy()
            self.motion_masks[branch.outboard][start:stop] = True
            start = stop
        self._rotation_generators_squared = self._rotation_generators @ self._rotation_generators
        self._rotation_axes = _axes_from_cross_matrices(self._rotation_generators)

    def displacement_vector(self, displacements: Mapping[str, Array]) -> Array:
        """Return the m displacements of a mapping by joint names, shape (..., m)."""
        parts = [displacements[name] for name in self.columns]
        return np.concatenate(parts, axis=-1, dtype=float) if parts else np.zeros(0)

    def poses(self, values: Array) -> dict[str, Array]:
        """Return the pose of every segment in the world, (..., 4, 4), at `values` (..., m)."""
        return self._propagate_poses(values)[0]

    def twists(self, values: Array) -> Array:
        """Return twists of the outboard segments for unit rates of displacements, (..., m, 6).

        Rows are (angular, linear) in world axes; linear is the velocity of the material point that
        is at the world's origin.
        """
        _, frames = self._propagate_poses(values)
        rows = np.zeros((*values.shape, 6))
        if self.size:
            stack = np.stack(frames, axis=-3)
            rotated = stack[..., :3, :3]
            rows[..., :3] = (rotated @ self._rotation_axes[..., None])[..., 0]
            translated = (rotated @ self._translation_generators[:, :3, 3:])[..., 0]
            rows[..., 3:] = np.cross(stack[..., :3, 3], rows[..., :3]) + translated
        return rows

    def _propagate_poses(self, values: Array) -> tuple[dict[str, Array], list[Array]]:
        """Return poses of the segments, and for each displacement the world frame of its axis."""
        steps = self._axis_poses(values)
        leading_shape = values.shape[:-1]
        poses = {
            name: np.broadcast_to(pose, (*leading_shape, 4, 4)) if leading_shape else pose
            for name, pose in self._ground.items()
        }
        frames = [np.empty(0)] * self.size
        for link in self._links:
            pose = poses[link.inboard] @ link.pose_before
            for k in link.columns:
                frames[k] = pose
                pose = pose @ steps[..., k, :, :]
            poses[link.outboard] = pose @ link.pose_after
        return poses, frames

    def _axis_poses(self, values: Array) -> Array:
        """Return the pose matrix of every factor, shape (..., m, 4, 4)."""
        v = values[..., None, None]
        rotated = (
            np.sin(v) * self._rotation_generators
            + (1.0 - np.cos(v)) * self._rotation_generators_squared
        )
        return np.eye(4) + rotated + v * self._translation_generators


def _axes_from_cross_matrices(generators: Array) -> Array:
    """Return the vectors (m, 3) of the cross matrices in `generators` (m, 4, 4)."""
    return np.stack([generators[:, 2, 1], generators[:, 0, 2], generators[:, 1, 0]], axis=-1)


def _ground_poses(figure: Figure) -> dict[str, Array]:
    """Return poses of the ground: the root's segment and those rigidly connected to it."""
    poses = {figure.root.segment: inverse_pose(figure.site(figure.root).pose_in_segment)}
    pending = [joint for joint in figure.joints.values() if not joint.chain]
    while len(poses) < len(figure.ground):
        for joint in pending:
            for known, new in (joint.ends, joint.ends[::-1]):
                if known.segment in poses and new.segment in figure.ground - poses.keys():
                    site, other = figure.site(known), figure.site(new)
                    poses[new.segment] = (
                        poses[known.segment]
                        @ site.pose_in_segment
                        @ inverse_pose(other.pose_in_segment)
                    )
    return poses


@short_repr
@dataclass(frozen=True)
class Tree:
    """Joints oriented from the root, independent of the order within `connect`.

    Attributes:
        joints: each after those inboard of it.
        closures: joints between two segments that the tree already reaches.
        chains: the chain of every joint.
    """

    figure: Figure
    joints: tuple[TreeJoint, ...]
    closures: tuple[Joint, ...]
    chains: Mapping[str, Chain]

    @cached_property
    def kinematics(self) -> Kinematics:
        """Precomputed transforms of the segments."""
        return Kinematics(self.figure, self.joints)


def build_tree(figure: Figure) -> Tree:
    """Return the tree of a figure, breadth first from the ground, joints in the order of the file.

    Trees of the last figures are kept, since many functions need that of one figure.

    Raises:
        InputError: the figure was made in Python and is wrong; it holds all errors.
        ModelError: no single joint can have the chain of a joint.
    """
    return _build_once(_SameFigure(figure))


def build_valid_tree(figure: Figure) -> Tree:
    """Return the tree of a figure that is valid, such as a part of one; see `build_tree`."""
    return _build(figure)


class _SameFigure:
    """A key that equals only keys of the same object, which does not change."""

    def __init__(self, figure: Figure) -> None:
        self.figure = figure

    def __hash__(self) -> int:
        return id(self.figure)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _SameFigure) and other.figure is self.figure


@lru_cache(maxsize=8)
def _build_once(key: _SameFigure) -> Tree:
    """Check a figure and build its tree."""
    require_valid_figure(key.figure)
    return _build(key.figure)


def _build(figure: Figure) -> Tree:
    chains = {name: build_chain(joint.chain) for name, joint in figure.joints.items()}
    reached = set(figure.ground)
    branches: list[TreeJoint] = []
    used = {
        name
        for name, joint in figure.joints.items()
        if {joint.parent.segment, joint.child.segment} <= figure.ground
    }
    waiting = deque(name for name in figure.segments if name in reached)
    while waiting:
        base = waiting.popleft()
        for name, joint in figure.joints.items():
            ends = (joint.parent.segment, joint.child.segment)
            if name in used or base not in ends:
                continue
            tip = ends[1] if ends[0] == base else ends[0]
            if tip in reached:
                continue
            used.add(name)
            reached.add(tip)
            waiting.append(tip)
            branches.append(TreeJoint(joint, base, tip, parent_is_inboard=ends[0] == base))
    closures = tuple(joint for name, joint in figure.joints.items() if name not in used)
    return Tree(figure, tuple(branches), closures, chains)
