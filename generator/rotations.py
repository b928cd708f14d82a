"""Rotations: matrices, rotation vectors, and angles about the axes of a joint.

Matrices act on columns: `R_AB @ v_B` is `v_A`. Arrays may have leading dimensions; angles are
in radians. `matrix_from_chain_angles` defines the order of a joint's chain.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

PERPENDICULAR_TOLERANCE = 1e-9
"""Largest cosine between two axes that count as perpendicular."""

SINGULAR_SINE = 1e-8
"""Sine of the middle angle below which only the sum or difference of the outer two is known."""


def unit_vector(vector: ArrayLike) -> Array:
    """Return `vector` scaled to length one, shape (3,). Raises ValueError for the zero vector."""
    array = np.asarray(vector, dtype=float)
    length = float(np.linalg.norm(array))
    if length == 0.0:
        raise ValueError("the zero vector has no direction")
    return array / length


def cross_matrix(vector: ArrayLike) -> Array:
    """Return `[v]x`, so that `cross_matrix(v) @ w` is `v x w`; shape (..., 3) to (..., 3, 3)."""
    v = np.asarray(vector, dtype=float)
    zero = np.zeros_like(v[..., 0])
    rows = [
        [zero, -v[..., 2], v[..., 1]],
        [v[..., 2], zero, -v[..., 0]],
        [-v[..., 1], v[..., 0], zero],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def matrix_from_rotation_vector(vector: ArrayLike) -> Array:
    """Return exp([r]x) for r = angle times axis [rad]; shape (..., 3) to (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    v = np.asarray(vector, dtype=float)
    flat = Rotation.from_rotvec(v.reshape(-1, 3)).as_matrix()
    return flat.reshape(*v.shape[:-1], 3, 3)


def rotation_vector_from_matrix(matrix: ArrayLike) -> Array:
    """Return the rotation vector, of length 0 to pi [rad]; shape (..., 3, 3) to (..., 3)."""
    from scipy.spatial.transform import Rotation

    m = np.asarray(matrix, dtype=float)
    flat = Rotation.from_matrix(m.reshape(-1, 3, 3)).as_rotvec()
    return flat.reshape(*m.shape[:-2], 3)


def quaternion_from_matrix(matrix: Array) -> Array:
    """Unit quaternion (4,), scalar first, of a rotation matrix (3, 3)."""
    m = matrix
    squares = np.array(
        [
            1.0 + m[0, 0] + m[1, 1] + m[2, 2],
            1.0 + m[0, 0] - m[1, 1] - m[2, 2],
            1.0 - m[0, 0] + m[1, 1] - m[2, 2],
            1.0 - m[0, 0] - m[1, 1] + m[2, 2],
        ]
    )
    w = [squares[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]
    x = [w[1], squares[1], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]]
    y = [w[2], x[2], squares[2], m[1, 2] + m[2, 1]]
    z = [w[3], x[3], y[3], squares[3]]
    row = np.array([w, x, y, z][int(np.argmax(squares))])
    return row / np.linalg.norm(row)


def matrix_from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Return the rotation by `angle` [rad] about a unit `axis`; shape of `angle` plus (3, 3)."""
    angles = np.asarray(angle, dtype=float)
    k = cross_matrix(np.asarray(axis, dtype=float))
    sine, cosine = np.sin(angles)[..., None, None], np.cos(angles)[..., None, None]
    return np.eye(3) + sine * k + (1.0 - cosine) * (k @ k)


def matrix_from_xyz(a: float, b: float, c: float) -> Array:
    """Return Peabody's `xyz(a, b, c)`: intrinsic X-Y-Z, the column matrix `Rx(a) Ry(b) Rz(c)`."""
    x, y, z = np.eye(3)
    return (
        matrix_from_axis_angle(x, a) @ matrix_from_axis_angle(y, b) @ matrix_from_axis_angle(z, c)
    )


def pose_matrix(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """Return the pose (..., 4, 4) of a rotation (..., 3, 3) and a translation (..., 3) [m]."""
    r, t = np.asarray(rotation, dtype=float), np.asarray(translation, dtype=float)
    pose = np.zeros((*r.shape[:-2], 4, 4))
    pose[..., :3, :3] = r
    pose[..., :3, 3] = t
    pose[..., 3, 3] = 1.0
    return pose


def inverse_pose(pose: ArrayLike) -> Array:
    """Return the inverse of a rigid pose (..., 4, 4): `X_BA` from `X_AB`."""
    x = np.asarray(pose, dtype=float)
    turned = np.swapaxes(x[..., :3, :3], -1, -2)
    return pose_matrix(turned, -(turned @ x[..., :3, 3:])[..., 0])


def rotation_with_z_axis(axis: ArrayLike) -> Array:
    """Return a rotation whose third column is the unit `axis` (`zifyjoint`, figure 3.5).

    It is the shortest rotation of z onto the axis; where the axis points down, a half turn about x
    comes first.
    """
    target = unit_vector(axis)
    half_turn = np.diag([1.0, -1.0, -1.0])
    if target[2] < 0.0:
        return half_turn @ rotation_with_z_axis(half_turn @ target)
    k = cross_matrix(np.cross([0.0, 0.0, 1.0], target))
    return np.eye(3) + k + k @ k / (1.0 + float(target[2]))


def wrap_angle(angle: Array) -> Array:
    """Return `angle` modulo 2 pi, in [-pi, pi]."""
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))


def matrix_from_chain_angles(axes: Sequence[ArrayLike], angles: ArrayLike) -> Array:
    """Return the orientation of the child's site frame in the parent's, shape (..., 3, 3).

    `R(a1)*R(a2)*R(a3)` with angles (d1, d2, d3) is the column matrix `R(a3,d3) R(a2,d2) R(a1,d1)`:
    the first factor is innermost, next to the child (Peabody's row-vector order).
    """
    values = np.asarray(angles, dtype=float)
    matrix = np.broadcast_to(np.eye(3), (*values.shape[:-1], 3, 3))
    for index, axis in enumerate(axes):
        matrix = matrix_from_axis_angle(axis, values[..., index]) @ matrix
    return matrix


@dataclass(frozen=True)
class RotationSequence:
    """Three rotation axes, each perpendicular to the next: angles for any orientation.

    Contains the thesis's twelve sequences, with signs, in any frame. The axes are those
    of the chain, so the first is innermost. Eq. 3.1-3.15, written for any such axes (Davenport's
    angles; Shuster and Markley, J. Astronaut. Sci. 51, 2003): with the first axis carried into the
    third by a rotation `offset` about the second, the middle angle plus the offset is the angle
    between the third axis and the rotated first one.
    """

    axes: tuple[tuple[float, float, float], ...]

    def __post_init__(self) -> None:
        """Check that the axes reach every orientation."""
        first, middle, last = (unit_vector(axis) for axis in self.axes)
        if max(abs(float(first @ middle)), abs(float(middle @ last))) > PERPENDICULAR_TOLERANCE:
            raise ValueError("each axis must be perpendicular to the next")

    @cached_property
    def _frame(self) -> tuple[Array, float]:
        """Rows e1 (middle axis), e2, e3 (last axis), and the offset that turns e3 into a1."""
        first, middle, last = (unit_vector(axis) for axis in self.axes)
        side = np.cross(last, middle)
        offset = float(np.arctan2(-(first @ side), first @ last))
        return np.stack([middle, side, last]), offset

    def matrix(self, angles: ArrayLike) -> Array:
        """Return the orientation at `angles` (..., 3) [rad]."""
        return matrix_from_chain_angles(self.axes, angles)

    def angles(self, matrix: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Return the angles (3,) of one orientation (3, 3) [rad].

        Without `near`: of the two middle angles the smaller (cos theta >= 0 in eq. 3.8), of two
        that differ in sign the positive one, and at a pole the outer two angles are equal in size
        (eq. 3.14 and the corrected 3.15). With `near`: of all triples that give the orientation,
        whole turns included, the nearest to it.
        """
        m = np.asarray(matrix, dtype=float)
        frame, offset = self._frame
        turned = frame @ m @ unit_vector(self.axes[0])
        sine = float(np.hypot(turned[0], turned[1]))
        polar = float(np.arctan2(sine, turned[2]))
        if sine < SINGULAR_SINE:
            return self._singular_angles(m, frame, offset, 0.0 if turned[2] > 0 else np.pi, near)
        last = float(np.arctan2(turned[0], -turned[1]))
        first = self._inner_angle(m, polar - offset, last)
        triple = np.array([first, polar - offset, last])
        # The outer two plus pi and the opposite polar angle give the same orientation.
        other = np.array([first + np.pi, -polar - offset, last + np.pi])
        return _choose_triple([triple, other], near)

    def is_singular(self, matrix: ArrayLike) -> bool:
        """Return whether only the sum or the difference of the outer angles is known."""
        frame, _ = self._frame
        turned = frame @ np.asarray(matrix, dtype=float) @ unit_vector(self.axes[0])
        return bool(np.hypot(turned[0], turned[1]) < SINGULAR_SINE)

    def _inner_angle(self, matrix: Array, middle: float, last: float) -> float:
        """Return the innermost angle once the other two are known."""
        outer = matrix_from_chain_angles(self.axes[1:], [middle, last])
        return _angle_about(unit_vector(self.axes[0]), outer.T @ matrix)

    def _singular_angles(
        self, matrix: Array, frame: Array, offset: float, polar: float, near: ArrayLike | None
    ) -> Array:
        """Return the angles where only `last + sign * first` is known."""
        sign = 1.0 if polar == 0.0 else -1.0
        middle = float(wrap_angle(np.asarray(polar - offset)))
        total = _angle_about(frame[2], matrix @ matrix_from_axis_angle(frame[0], middle).T)
        if near is None:
            return np.array([sign * total / 2.0, middle, total / 2.0])
        previous = np.asarray(near, dtype=float)
        rest = float(wrap_angle(np.asarray(total - previous[2] - sign * previous[0])))
        middle = middle + 2.0 * np.pi * round((previous[1] - middle) / (2.0 * np.pi))
        return np.array([previous[0] + sign * rest / 2.0, middle, previous[2] + rest / 2.0])


def _angle_about(axis: Array, matrix: Array) -> float:
    """Return the angle of a rotation about the known `axis` [rad]."""
    sine = 0.5 * float(
        axis
        @ np.array(
            [
                matrix[2, 1] - matrix[1, 2],
                matrix[0, 2] - matrix[2, 0],
                matrix[1, 0] - matrix[0, 1],
            ]
        )
    )
    cosine = 0.5 * (float(np.trace(matrix)) - 1.0)
    return float(np.arctan2(sine, cosine))


def _choose_triple(triples: list[Array], near: ArrayLike | None) -> Array:
    """Return the conventional triple, or the one nearest to `near` modulo 2 pi."""
    if near is None:
        whole = [wrap_angle(triple) for triple in triples]
        return min(whole, key=lambda triple: (round(abs(float(triple[1])), 9), triple[1] < 0.0))
    previous = np.asarray(near, dtype=float)
    moved = [previous + wrap_angle(triple - previous) for triple in triples]
    return min(moved, key=lambda triple: float(np.linalg.norm(triple - previous)))
