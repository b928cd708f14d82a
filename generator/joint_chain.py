"""The chain of a joint: its pose at given displacements, and the displacements of a given pose.

The chain of a single joint has at most three rotations and three translations, with all
translations outside all rotations (`R*R*T`: along axes of the parent) or all inside (`T*R*R`:
along axes of the child). A rotation and a translation with one axis commute.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import pairwise
from typing import assert_never

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import ModelError
from generator.figure import AxisKind, JointAxis
from generator.rotations import (
    PERPENDICULAR_TOLERANCE,
    Array,
    RotationSequence,
    cross_matrix,
    inverse_pose,
    matrix_from_axis_angle,
    matrix_from_chain_angles,
    pose_matrix,
    unit_vector,
    wrap_angle,
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
        return tuple(
            k for k, factor in enumerate(self.joint_axes) if factor.kind is AxisKind.ROTATION
        )

    @cached_property
    def translations(self) -> tuple[int, ...]:
        """Indices of the translations among the factors."""
        return tuple(
            k for k, factor in enumerate(self.joint_axes) if factor.kind is AxisKind.TRANSLATION
        )

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

    def pose(self, displacements: ArrayLike) -> Array:
        """Return the child's site in the parent's frame, (..., n) [rad or m] to (..., 4, 4)."""
        values = np.asarray(displacements, dtype=float)
        start = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
        steps = [_axis_pose(f, values[..., k]) for k, f in enumerate(self.joint_axes)]
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
            axis = outer[..., :3, :3] @ unit_vector(self.joint_axes[k].axis)
            kind = self.joint_axes[k].kind
            match kind:
                case AxisKind.ROTATION:
                    rows[..., k, :3] = axis
                    rows[..., k, 3:] = np.cross(outer[..., :3, 3], axis)
                case AxisKind.TRANSLATION:
                    rows[..., k, 3:] = axis
                case _:
                    assert_never(kind)
            outer = outer @ _axis_pose(self.joint_axes[k], values[..., k])
        return rows

    def displacements(self, pose: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Return the displacements (n,) [rad or m] of a pose (4, 4), nearest to `near` if given.

        For a pose that the chain cannot reach: those of its rotation, and the least-squares fit of
        its translation.
        """
        x = np.asarray(pose, dtype=float)
        previous = None if near is None else np.asarray(near, dtype=float)
        result = np.zeros(len(self.joint_axes))
        turns, slides = list(self.rotations), list(self.translations)
        result[turns] = self._angles(x[:3, :3], None if previous is None else previous[turns])
        if slides:
            axes = np.array([unit_vector(self.joint_axes[k].axis) for k in slides]).T
            offset = x[:3, 3]
            if not self.translations_are_outer:
                turned = matrix_from_chain_angles(self.rotation_axes, result[turns])
                offset = turned.T @ offset
            result[slides] = np.linalg.lstsq(axes, offset, rcond=None)[0]
        return result

    def _angles(self, matrix: Array, near: Array | None) -> Array:
        """Return the angles of the rotations, shape (number of rotations,)."""
        axes = self.rotation_axes
        if self.sequence is not None:
            return self.sequence.angles(matrix, near)
        angles: list[float] = []
        if len(axes) == 2:
            inner, outer = unit_vector(axes[0]), unit_vector(axes[1])
            moved = matrix @ inner
            angles.append(float(np.arctan2(outer @ np.cross(inner, moved), inner @ moved)))
            matrix = matrix_from_axis_angle(outer, angles[0]).T @ matrix
        if axes:
            angles.insert(0, _nearest_rotation_angle(unit_vector(axes[0]), matrix))
        base = np.zeros(len(axes)) if near is None else near
        return base + wrap_angle(np.array(angles) - base)

    def pose_residual(self, pose: ArrayLike) -> Array:
        """Return the part of a pose that the chain cannot reach: (angle [rad], offset [m])."""
        reached = self.pose(self.displacements(pose))
        between = inverse_pose(reached) @ np.asarray(pose, dtype=float)
        r = between[:3, :3]
        turn = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        return np.concatenate([turn, between[:3, 3]])


def _commute(rotation: JointAxis, translation: JointAxis) -> bool:
    """Return whether a rotation and a translation commute: their axes are parallel."""
    return bool(
        np.linalg.norm(np.cross(unit_vector(rotation.axis), unit_vector(translation.axis)))
        < PERPENDICULAR_TOLERANCE
    )


def _axis_pose(joint_axis: JointAxis, value: ArrayLike) -> Array:
    """Return the pose matrix of one factor, shape (..., 4, 4)."""
    v = np.asarray(value, dtype=float)
    axis = unit_vector(joint_axis.axis)
    match joint_axis.kind:
        case AxisKind.ROTATION:
            return pose_matrix(matrix_from_axis_angle(axis, v), np.zeros((*v.shape, 3)))
        case AxisKind.TRANSLATION:
            identity = np.broadcast_to(np.eye(3), (*v.shape, 3, 3))
            return pose_matrix(identity, v[..., None] * axis)
        case _:
            assert_never(joint_axis.kind)


def _nearest_rotation_angle(axis: Array, matrix: Array) -> float:
    """Return the angle of the rotation about `axis` that is nearest to `matrix` [rad]."""
    k = cross_matrix(axis)
    sine = -float(np.sum(k.T * matrix))
    cosine = float(np.trace(matrix) - axis @ matrix @ axis)
    return float(np.arctan2(sine, cosine))


def build_chain(joint_axes: Sequence[JointAxis]) -> Chain:
    """Return the chain of factors. Raises ModelError when no single joint can have them."""
    return Chain(tuple(joint_axes))
