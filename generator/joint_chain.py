"""The chain of a joint: the pose it makes of its displacements, and the displacements of a pose.

A chain that one joint can hold turns about at most three axes and slides along at most three, with
all slides outside all turns (`R*R*T`: along axes of the parent) or all inside (`T*R*R`: along axes
of the child). Neighbours that commute, a turn and a slide along one axis, may stand either way.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import MoverError
from generator.figure import Factor
from generator.rotations import (
    PERPENDICULAR,
    Array,
    Sequence3,
    cross_matrix,
    homogeneous,
    inverse_pose,
    matrix_from_axis_angle,
    matrix_from_chain_angles,
    unit,
    wrapped,
)


class ChainError(MoverError, ValueError):
    """One joint cannot hold the chain; the message says why."""


@dataclass(frozen=True)
class Chain:
    """The degrees of freedom of a joint, in the order of its `type` line (innermost first).

    Making one proves that a single joint can hold it. Raises ChainError when none can.
    """

    factors: tuple[Factor, ...]

    def __post_init__(self) -> None:
        """Refuse what no single joint can hold."""
        axes = [unit(self.factors[k].axis) for k in self.turns]
        if len(axes) > 3:
            raise ChainError(f"{len(axes)} rotations: a joint has at most three")
        for first, second in pairwise(axes):
            if abs(float(first @ second)) > PERPENDICULAR:
                raise ChainError(
                    "each rotation axis must be perpendicular to the next: "
                    "oblique or repeated axes cannot reach every orientation"
                )
        slides = [self.factors[k].axis for k in self.slides]
        if slides and np.linalg.matrix_rank(np.array(slides), tol=PERPENDICULAR) < len(slides):
            raise ChainError("the translation axes are not independent")
        if self._slides_outside() is None:
            raise ChainError("a translation stands between rotations that do not commute with it")

    @cached_property
    def turns(self) -> tuple[int, ...]:
        """Places of the rotations among the factors."""
        return tuple(k for k, factor in enumerate(self.factors) if factor.kind == "R")

    @cached_property
    def slides(self) -> tuple[int, ...]:
        """Places of the translations among the factors."""
        return tuple(k for k, factor in enumerate(self.factors) if factor.kind == "T")

    @cached_property
    def slides_are_outside(self) -> bool:
        """Whether the child slides along axes of the parent (else along its own)."""
        return bool(self._slides_outside())

    def _slides_outside(self) -> bool | None:
        """True: all slides can stand outside all turns; False: inside; None: neither."""
        for outside in (True, False):
            crossed = [
                (self.factors[t], self.factors[s])
                for t in self.turns
                for s in self.slides
                if (s < t) == outside
            ]
            if all(_commute(turn, slide) for turn, slide in crossed):
                return outside
        return None

    @cached_property
    def turn_axes(self) -> tuple[tuple[float, float, float], ...]:
        """Axes of the rotations, innermost first."""
        return tuple(self.factors[k].axis for k in self.turns)

    @cached_property
    def sequence(self) -> Sequence3 | None:
        """The three rotations, where there are three."""
        return Sequence3(self.turn_axes) if len(self.turns) == 3 else None

    def pose(self, displacements: ArrayLike) -> Array:
        """Pose of the child's site in the parent's, shape (..., 4, 4), at (..., n) [rad or m]."""
        values = np.asarray(displacements, dtype=float)
        start = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
        steps = [_factor_pose(f, values[..., k]) for k, f in enumerate(self.factors)]
        return reduce(lambda pose, step: step @ pose, steps, start)

    def twists(self, displacements: ArrayLike) -> Array:
        """Motion of the child's site for a unit rate of each displacement, (..., n) to (..., n, 6).

        Rows are (angular, linear) in the parent's site frame; linear is the velocity of the child's
        material point that is at the parent's origin.
        """
        values = np.asarray(displacements, dtype=float)
        rows = np.zeros((*values.shape, 6))
        outer = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
        for k in reversed(range(len(self.factors))):
            axis = outer[..., :3, :3] @ unit(self.factors[k].axis)
            if self.factors[k].kind == "R":
                rows[..., k, :3] = axis
                rows[..., k, 3:] = np.cross(outer[..., :3, 3], axis)
            else:
                rows[..., k, 3:] = axis
            outer = outer @ _factor_pose(self.factors[k], values[..., k])
        return rows

    def displacements(self, pose: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Displacements (n,) [rad or m] of a pose (4, 4), the nearest to `near` when given.

        A pose outside the chain's reach gives the displacements of its turn, and of the part of its
        translation that the slides can make.
        """
        x = np.asarray(pose, dtype=float)
        previous = None if near is None else np.asarray(near, dtype=float)
        result = np.zeros(len(self.factors))
        turns, slides = list(self.turns), list(self.slides)
        result[turns] = self._angles(x[:3, :3], None if previous is None else previous[turns])
        if slides:
            axes = np.array([unit(self.factors[k].axis) for k in slides]).T
            offset = x[:3, 3]
            if not self.slides_are_outside:
                turned = matrix_from_chain_angles(self.turn_axes, result[turns])
                offset = turned.T @ offset
            result[slides] = np.linalg.lstsq(axes, offset, rcond=None)[0]
        return result

    def _angles(self, matrix: Array, near: Array | None) -> Array:
        """Angles of the rotations, shape (number of rotations,)."""
        axes = self.turn_axes
        if self.sequence is not None:
            return self.sequence.angles(matrix, near)
        angles: list[float] = []
        if len(axes) == 2:
            inner, outer = unit(axes[0]), unit(axes[1])
            moved = matrix @ inner
            angles.append(float(np.arctan2(outer @ np.cross(inner, moved), inner @ moved)))
            matrix = matrix_from_axis_angle(outer, angles[0]).T @ matrix
        if axes:
            angles.insert(0, _angle_nearest_axis(unit(axes[0]), matrix))
        base = np.zeros(len(axes)) if near is None else near
        return base + wrapped(np.array(angles) - base)

    def gap(self, pose: ArrayLike) -> Array:
        """How far a pose is outside the chain's reach: (turn [rad], offset [m]), shape (6,)."""
        reached = self.pose(self.displacements(pose))
        between = inverse_pose(reached) @ np.asarray(pose, dtype=float)
        r = between[:3, :3]
        turn = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        return np.concatenate([turn, between[:3, 3]])


def _commute(turn: Factor, slide: Factor) -> bool:
    """Whether a turn and a slide may change places: they share their axis."""
    return bool(np.linalg.norm(np.cross(unit(turn.axis), unit(slide.axis))) < PERPENDICULAR)


def _factor_pose(factor: Factor, value: ArrayLike) -> Array:
    """Pose matrix of one factor, shape (..., 4, 4)."""
    v = np.asarray(value, dtype=float)
    if factor.kind == "R":
        return homogeneous(matrix_from_axis_angle(unit(factor.axis), v), np.zeros((*v.shape, 3)))
    turn = np.broadcast_to(np.eye(3), (*v.shape, 3, 3))
    return homogeneous(turn, v[..., None] * unit(factor.axis))


def _angle_nearest_axis(axis: Array, matrix: Array) -> float:
    """The angle about `axis` of the turn about it that is nearest to `matrix` [rad]."""
    k = cross_matrix(axis)
    sine = -float(np.sum(k.T * matrix))
    cosine = float(np.trace(matrix) - axis @ matrix @ axis)
    return float(np.arctan2(sine, cosine))


def chain_of(factors: Sequence[Factor]) -> Chain:
    """The chain of a joint's factors. Raises ChainError when one joint cannot hold them."""
    return Chain(tuple(factors))
