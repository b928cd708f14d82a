"""A motion as a hierarchy of bones, for animation formats.

A bone is a segment that moves. Its origin is at the site that its joint moves, and its axes are
those of the world at zero displacements: the figure at rest has no rotations, and an offset is the
position of a joint relative to the joint before.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from generator.figure import Figure, Segment
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import TreeJoint, build_tree
from generator.losses import Loss
from generator.motion_files.motion import FigureMotion
from generator.rotations import Array, pose_matrix, unit_vector


def continuous_quaternions(matrices: Array) -> Array:
    """Unit quaternions (x, y, z, w) of rotation matrices, shape (n, 3, 3) to (n, 4).

    A quaternion and its negative mean one orientation. The first has w >= 0, and each that follows
    has the sign that brings it nearer to the one before, so that what lies between two of them is
    the short way.
    """
    from scipy.spatial.transform import Rotation

    quaternions = np.asarray(Rotation.from_matrix(matrices).as_quat(), dtype=float)
    first = -1.0 if quaternions[0, 3] < 0.0 else 1.0
    products = np.sum(quaternions[1:] * quaternions[:-1], axis=1)
    turned = np.where(products < 0.0, -1.0, 1.0)
    signs = np.cumprod(np.concatenate([[first], turned]))
    return np.multiply(quaternions, signs[:, None], dtype=float)


_MIN_REPORTED_GAP = 1e-12
"""Gaps below this [m] are those of rounding."""

_MIN_LIMB = 1e-3
"""Length of a limb below which its direction is not used [m]."""

_UP, _FRONT = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])

_MAX_FRONT_COSINE = 0.9
"""Cosine of the angle from the front above which a limb counts as pointing there."""


@dataclass(frozen=True, eq=False)
class Bone:
    """A segment that moves, over n frames.

    Attributes:
        joint: the joint that moves it.
        segment: its name.
        parent: the segment that carries it.
        depth: number of bones between it and the ground.
        centre: position of its origin in the world at rest, shape (3,) [m].
        offset: its origin relative to that of the base's bone at rest, shape (3,) [m].
        rotations: its orientation in the base's bone, shape (n, 3, 3); the identity at rest.
        translations: translations of its origin from rest, in the axes of the base's bone, shape
            (n, 3) [m].
    """

    joint: str
    segment: str
    parent: str
    depth: int
    centre: Array
    offset: Array
    rotations: Array
    translations: Array

    @cached_property
    def max_translation(self) -> float:
        """The farthest that its origin moves against the bone before [m]."""
        return float(np.max(np.linalg.norm(self.translations, axis=1)))


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The bones of a motion, each after its parent.

    Attributes:
        bones: depth first.
        rest_poses: poses of all segments in the world with all displacements zero, shape (4, 4).
        closures: the joints that close loops, which a hierarchy cannot say.
    """

    bones: tuple[Bone, ...]
    rest_poses: Mapping[str, Array]
    closures: tuple[str, ...]

    @property
    def roots(self) -> list[Bone]:
        """The bones whose parent is the ground."""
        return [bone for bone in self.bones if bone.depth == 0]

    def points_at_rest(self, segment: Segment, points: Array) -> Array:
        """Return points of a segment's frame in the world at rest, both of shape (k, 3) [m]."""
        pose = self.rest_poses[segment.name]
        return points @ pose[:3, :3].T + pose[:3, 3]

    def end_site(self, bone: Bone, segment: Segment) -> Array:
        """Return the site of a bone's segment that is farthest from its origin, from there [m]."""
        points = [site.pose_in_segment[:3, 3] for site in segment.sites.values()]
        seen = self.points_at_rest(segment, np.array(points).reshape(-1, 3)) - bone.centre
        return max(seen, key=lambda point: float(np.linalg.norm(point)), default=np.zeros(3))

    def limb_axes(self, figure: Figure) -> dict[str, Array]:
        """Return the axes of each bone along its limb at rest, as columns in the world, (3, 3).

        y points to the middle of the next bones' origins, of the last bone to its farthest site,
        and z is as near as can be to +z of the world, of a bone along it to +y. The axes of two
        bones at mirrored places are those of a mirrored skeleton.
        """
        following: dict[str, list[Array]] = {}
        for bone in self.bones:
            following.setdefault(bone.parent, []).append(bone.centre)
        axes: dict[str, Array] = {}
        for bone in self.bones:
            centres = following.get(bone.segment)
            seen = None if centres is None else np.mean(centres, axis=0) - bone.centre
            if seen is None or np.linalg.norm(seen) < _MIN_LIMB:
                seen = self.end_site(bone, figure.segments[bone.segment])
            if np.linalg.norm(seen) < _MIN_LIMB:
                seen = _UP
            axes[bone.segment] = _axes_along(np.asarray(unit_vector(seen)))
        return axes

    def losses(self, min_translation: float) -> Iterator[Loss]:
        """Yield the losses of bones if translations up to `min_translation` [m] are left out."""
        if self.closures:
            message = "joints that close loops; the motion of their segments is unchanged"
            yield Loss(message, self.closures)
        gap = max(
            (b.max_translation for b in self.bones if b.max_translation <= min_translation),
            default=0.0,
        )
        if gap > _MIN_REPORTED_GAP:
            yield Loss(f"gaps of up to {gap:.1e} m between the sites of joints, closed here")


def _axes_along(y: Array) -> Array:
    """Return right-handed axes as columns, (3, 3), of which the second is a unit vector (3,)."""
    front = _FRONT if abs(float(y @ _FRONT)) < _MAX_FRONT_COSINE else _UP
    z = unit_vector(front - (front @ y) * y)
    return np.column_stack([np.cross(y, z), y, z])


def bones_with_block_ends(bones: Sequence[Bone]) -> Iterator[tuple[Bone, int]]:
    """Each bone, and how many blocks end behind it when each stands within its base's."""
    for bone, following in pairwise(bones):
        yield bone, bone.depth - following.depth + 1
    if bones:
        yield bones[-1], bones[-1].depth + 1


def build_skeleton(motion: FigureMotion) -> Skeleton:
    """The bones of a motion. Raises ModelError when it is one of another figure."""
    tree, poses = motion.tree, motion.poses
    # Poses when all displacements of the figure, as it is held, are zero.
    zero = {name: np.zeros(len(joint.chain)) for name, joint in motion.figure.joints.items()}
    rest = forward_kinematics(build_tree(motion.figure), zero).poses
    world = np.broadcast_to(np.eye(4), (motion.times.size, 4, 4))
    frames = dict.fromkeys(tree.figure.ground, world)
    centres = dict.fromkeys(tree.figure.ground, np.zeros(3))
    bones: list[Bone] = []
    for branch, depth in _depth_first(tree.joints, tree.figure.ground):
        joint, base, tip = branch.joint, branch.inboard, branch.outboard
        moved = tree.figure.site(joint.child if branch.parent_is_inboard else joint.parent)
        place_in_segment = moved.pose_in_segment[:3, 3]
        turned, origin = rest[tip][:3, :3], rest[tip][:3, 3]
        centre = turned @ place_in_segment + origin
        pose = poses[tip]
        where = pose[:, :3, :3] @ place_in_segment + pose[:, :3, 3]
        frames[tip] = pose_matrix(pose[:, :3, :3] @ turned.T, where)
        centres[tip] = centre
        back = np.swapaxes(frames[base][:, :3, :3], -1, -2)
        offset = centre - centres[base]
        seen = (back @ (where - frames[base][:, :3, 3])[..., None])[..., 0]
        turns = back @ frames[tip][:, :3, :3]
        bones.append(Bone(joint.name, tip, base, depth, centre, offset, turns, seen - offset))
    return Skeleton(tuple(bones), rest, tuple(joint.name for joint in tree.closures))


def _depth_first(
    branches: Sequence[TreeJoint], ground: frozenset[str]
) -> Iterator[tuple[TreeJoint, int]]:
    """The branches, each behind its base, and how many stand before it."""
    hanging: dict[str, list[TreeJoint]] = {}
    for branch in branches:
        hanging.setdefault(branch.inboard, []).append(branch)
    waiting = [(b, 0) for b in reversed(branches) if b.inboard in ground]
    while waiting:
        branch, depth = waiting.pop()
        yield branch, depth
        waiting += [(b, depth + 1) for b in reversed(hanging.get(branch.outboard, []))]
