"""The chain of a joint: its pose at given displacements, and the displacements of a given pose.

The chain of a single joint has at most three rotations and three translations, with all
translations outside all rotations (`R*R*T`: along axes of the parent) or all inside (`T*R*R`:
along axes of the child). A rotation and a translation with one axis commute.

A chain's rotations and translations leave some axes free; the others are locked, along the axes of
a joint frame. A revolute's frame has its axis along z (the thesis's `zifyjoint`). If rotations and
translations need different frames, the joint has two locks.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, reduce
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import ModelError
from generator.figure import JointAxis, Twist, is_rotation
from generator.rotations import (
    PERPENDICULAR_TOLERANCE,
    Array,
    RotationSequence,
    cross_matrix,
    inverse_pose,
    matrix_from_axis_angle,
    matrix_from_chain_angles,
    pose_matrix,
    rotation_with_z_axis,
    unit_vector,
)


@dataclass(frozen=True)
class Chain:
    """The degrees of freedom of a joint, in the order of its `type` line (innermost first).

    Raises ModelError when no single joint can have the chain.
    """

    joint_axes: tuple[JointAxis, ...]

    def __post_init__(self) -> None:
        """Check that a single joint can have the chain."""
        axes = [unit_vector(self.joint_axes[k].axis) for k in self.rotations]
        if len(axes) > 3:
            raise ModelError(f"{len(axes)} rotations: a joint has at most three")
        for first, second in pairwise(axes):
            if abs(float(first @ second)) > PERPENDICULAR_TOLERANCE:
                raise ModelError(
                    "each rotation axis must be perpendicular to the next: "
                    "oblique or repeated axes cannot reach every orientation"
                )
        slides = [self.joint_axes[k].axis for k in self.translations]
        if slides and np.linalg.matrix_rank(np.array(slides), tol=PERPENDICULAR_TOLERANCE) < len(
            slides
        ):
            raise ModelError("the translation axes are not independent")
        if self._translation_order() is None:
            raise ModelError("a translation is between rotations that do not commute with it")

    @cached_property
    def rotations(self) -> tuple[int, ...]:
        """Indices of the rotations among the factors."""
        return tuple(k for k, axis in enumerate(self.joint_axes) if any(axis.twist.angular))

    @cached_property
    def translations(self) -> tuple[int, ...]:
        """Indices of the translations among the factors."""
        return tuple(k for k, axis in enumerate(self.joint_axes) if any(axis.twist.linear))

    @cached_property
    def translations_are_outer(self) -> bool:
        """True where translations are along axes of the parent, not of the child."""
        return bool(self._translation_order())

    def _translation_order(self) -> bool | None:
        """Return True where translations can be outside all rotations, False inside, else None."""
        for outside in (True, False):
            crossed = [
                (self.joint_axes[t], self.joint_axes[s])
                for t in self.rotations
                for s in self.translations
                if (s < t) == outside
            ]
            if all(_commute(turn, slide) for turn, slide in crossed):
                return outside
        return None

    @cached_property
    def rotation_axes(self) -> tuple[tuple[float, float, float], ...]:
        """Axes of the rotations, innermost first."""
        return tuple(self.joint_axes[k].axis for k in self.rotations)

    @cached_property
    def sequence(self) -> RotationSequence | None:
        """Rotation sequence of a chain with three rotations; else None."""
        return RotationSequence(self.rotation_axes) if len(self.rotations) == 3 else None

    def translation_along(self, direction: Sequence[float]) -> int:
        """Return the index of the translation whose axis is nearest to a direction."""

        def deviation(k: int) -> float:
            return float(np.linalg.norm(np.cross(unit_vector(self.joint_axes[k].axis), direction)))

        return min(self.translations, key=deviation)

    def translation_gradient(self, index: int) -> Array:
        """Gradient of a translation by the child's offset, (3,); axes may be oblique."""
        axes = np.array([unit_vector(self.joint_axes[k].axis) for k in self.translations])
        return np.asarray(np.linalg.pinv(axes.T)[self.translations.index(index)])

    def pose(self, displacements: ArrayLike) -> Array:
        """Return the child's site in the parent's frame, (..., n) [rad or m] to (..., 4, 4)."""
        values = np.asarray(displacements, dtype=float)
        start = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
        steps = [_axis_pose(axis.twist, values[..., k]) for k, axis in enumerate(self.joint_axes)]
        return reduce(lambda pose, step: step @ pose, steps, start)

    def twists(self, displacements: ArrayLike) -> Array:
        """Return twists of the child's site for unit rates, (..., n) [rad or m] to (..., n, 6).

        Rows are (angular, linear) in the parent's site frame; linear is the velocity of the child's
        material point that is at the parent's origin.
        """
        values = np.asarray(displacements, dtype=float)
        rows = np.zeros((*values.shape, 6))
        outer = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
        for k in reversed(range(len(self.joint_axes))):
            twist = self.joint_axes[k].twist
            angular, linear = (outer[..., :3, :3] @ np.array(part) for part in twist)
            rows[..., k, :3] = angular
            rows[..., k, 3:] = np.cross(outer[..., :3, 3], angular) + linear
            outer = outer @ _axis_pose(twist, values[..., k])
        return rows

    def displacements(self, pose: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Return the displacements (n,) [rad or m] of a pose (4, 4), nearest to `near` if given.

        For a pose that the chain cannot reach: those of its rotation, and the least-squares fit of
        its translation.
        """
        return self.continuous_displacements(np.asarray(pose, dtype=float)[None], near)[0]

    def continuous_displacements(self, poses: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Return the displacements (m, n) [rad or m] of successive poses (m, 4, 4).

        Those of the first pose are `displacements` with `near`; every other row is the nearest to
        the one before it, whole turns included.
        """
        x = np.asarray(poses, dtype=float)
        result = np.zeros((len(x), len(self.joint_axes)))
        turns: list[int] = []
        slides: list[int] = []
        for k, axis in enumerate(self.joint_axes):
            (turns if is_rotation(axis.kind) else slides).append(k)
        first = None if near is None else np.asarray(near, dtype=float)[turns]
        result[:, turns] = self._continuous_angles(x[:, :3, :3], first)
        if slides:
            axes = np.array([unit_vector(self.joint_axes[k].axis) for k in slides]).T
            offsets = x[:, :3, 3]
            if not self.translations_are_outer:
                turned = matrix_from_chain_angles(self.rotation_axes, result[:, turns])
                offsets = (offsets[:, None] @ turned)[:, 0]
            result[:, slides] = np.linalg.lstsq(axes, offsets.T, rcond=None)[0].T
        return result

    def _continuous_angles(self, matrices: Array, near: Array | None) -> Array:
        """Return the angles of the rotations, shape (m, number of rotations)."""
        axes = [unit_vector(axis) for axis in self.rotation_axes]
        if self.sequence is not None:
            return self.sequence.continuous_angles(matrices, near)
        columns: list[Array] = []
        if len(axes) == 2:
            inner, outer = axes
            moved = matrices @ inner
            columns.append(np.arctan2(np.cross(inner, moved) @ outer, moved @ inner))
            back = np.swapaxes(matrix_from_axis_angle(outer, columns[0]), -1, -2)
            matrices = back @ matrices
        if axes:
            # The rotation about the axis that is nearest to the matrix.
            sine = np.sum(cross_matrix(axes[0]) * matrices, axis=(-2, -1))
            cosine = np.trace(matrices, axis1=-2, axis2=-1) - (matrices @ axes[0]) @ axes[0]
            columns.insert(0, np.arctan2(sine, cosine))
        angles = np.array(columns).reshape(len(axes), len(matrices)).T
        start = np.zeros(len(axes)) if near is None else near
        steps = np.diff(angles, axis=0, prepend=start[None])
        return angles - 2.0 * np.pi * np.cumsum(np.round(steps / (2.0 * np.pi)), axis=0)

    def pose_residual(self, pose: ArrayLike) -> Array:
        """Return the part of poses that the chain cannot reach, (..., 4, 4) to (..., 6).

        It is the sine of an angle about an axis, times the axis, and an offset [m].
        """
        x = np.asarray(pose, dtype=float)
        reached = self.pose(self.continuous_displacements(x.reshape(-1, 4, 4)))
        between = inverse_pose(reached.reshape(x.shape)) @ x
        r = between[..., :3, :3]
        turn = 0.5 * np.stack(
            [r[..., i, j] - r[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=-1
        )
        return np.concatenate([turn, between[..., :3, 3]], axis=-1)


def _commute(rotation: JointAxis, translation: JointAxis) -> bool:
    """Return whether a rotation and a translation commute: their axes are parallel."""
    return bool(
        np.linalg.norm(np.cross(unit_vector(rotation.axis), unit_vector(translation.axis)))
        < PERPENDICULAR_TOLERANCE
    )


def _axis_pose(twist: Twist, value: ArrayLike) -> Array:
    """Return the pose matrix of one factor, shape (..., 4, 4): it moves along its own axis only."""
    v = np.asarray(value, dtype=float)
    return pose_matrix(matrix_from_axis_angle(twist.angular, v), v[..., None] * twist.linear)


def build_chain(joint_axes: Sequence[JointAxis]) -> Chain:
    """Return the chain of factors. Raises ModelError when no single joint can have them."""
    return _build_once(tuple(joint_axes))


@lru_cache(maxsize=256)
def _build_once(joint_axes: tuple[JointAxis, ...]) -> Chain:
    """Return a chain, which joints alike and the runs of a study have in common."""
    return Chain(joint_axes)


AxisFlags = tuple[int, int, int]

FREE: AxisFlags = (0, 0, 0)
LOCKED: AxisFlags = (1, 1, 1)


@dataclass(frozen=True)
class LockedAxes:
    """Axes locked by one constraint, in a frame common to both sites at zero displacement.

    Attributes:
        frame: axes of the joint frame in the site's axes, shape (3, 3).
        translations: locked along x, y, z of the frame of the first site.
        rotations: locked about x, y, z.
        from_child: whether the first site is the child's and translations are along its axes.
        zero_pose: pose (4, 4) of the child's site in the parent's at which the constraint is zero.
    """

    frame: Array
    translations: AxisFlags
    rotations: AxisFlags
    from_child: bool = False
    zero_pose: Array = field(default_factory=lambda: np.eye(4))


def lock_all_axes(pose_in_parent: Array) -> LockedAxes:
    """Lock a joint in a pose (4, 4) of the child's site in the parent's."""
    return LockedAxes(np.eye(3), LOCKED, LOCKED, zero_pose=pose_in_parent)


def locked_axes_from_chain(chain: Chain) -> tuple[LockedAxes, ...]:
    """Return the locks that leave exactly the chain's degrees of freedom."""
    turns, slides = (
        [unit_vector(one.axis) for one in chain.joint_axes if is_rotation(one.kind) is turns]
        for turns in (True, False)
    )
    rotation_frame, rotations = _lock(turns)
    translation_frame, translations = _lock(slides)
    if len(turns) == 2:
        # The third rotation lock keeps the first site's x perpendicular to the second's y.
        inner, outer = turns
        rotation_frame = np.stack([outer, inner, np.cross(outer, inner)], axis=1)
    inside = not chain.translations_are_outer
    if translations in (FREE, LOCKED):
        lock = LockedAxes(rotation_frame, translations, rotations)
        return () if lock.translations == lock.rotations == FREE else (lock,)
    if rotations in (FREE, LOCKED):
        return (LockedAxes(translation_frame, translations, rotations, inside),)
    return (
        LockedAxes(translation_frame, translations, FREE, inside),
        LockedAxes(rotation_frame, FREE, rotations),
    )


def _lock(axes: list[Array]) -> tuple[Array, AxisFlags]:
    """Return a frame and the locks that leave free axes at right angles."""
    if len(axes) == 0:
        return np.eye(3), LOCKED
    if len(axes) == 1:
        return rotation_with_z_axis(axes[0]), (1, 1, 0)
    if len(axes) == 2:
        return rotation_with_z_axis(np.cross(axes[0], axes[1])), (0, 0, 1)
    return np.eye(3), FREE
