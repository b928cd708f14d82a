"""Rotations: matrices, rotation vectors, and angles about the axes of a joint.

Matrices act on columns: `R_AB @ v_B` is `v_A`. Arrays may have leading dimensions; angles are
in radians. `matrix_from_chain_angles` defines the order of a joint's chain.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import hypot, pi, remainder, sqrt
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_Triple: TypeAlias = tuple[float, float, float]

PERPENDICULAR_TOLERANCE = 1e-9
"""Largest cosine between two axes that count as perpendicular."""

SINGULAR_SINE = 1e-8
"""Sine of the middle angle below which only the sum or difference of the outer two is known."""

_IDENTITY = np.eye(3)

_ANGLE_TOLERANCE, _LENGTH_TOLERANCE = 1e-12, 1e-12 + 1e-5
_ORTHOGONALITY_TOLERANCE = _ANGLE_TOLERANCE + 1e-5 * _IDENTITY
"""Errors of the products of two rows up to which a matrix counts as orthogonal, as in scipy."""

_TURN = 2.0 * pi
"""A whole turn [rad]."""


def unit_vector(vector: ArrayLike) -> Array:
    """Return `vector` scaled to length one, shape (3,). Raises ValueError for the zero vector."""
    array = np.asarray(vector, dtype=float)
    length = float(np.linalg.norm(array))
    if length == 0.0:
        raise ValueError("the zero vector has no direction")
    return array / length


def unit_axis(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return an axis with length one."""
    x, y, z = unit_vector(axis)
    return float(x), float(y), float(z)


def cross_product(one: Array, other: Array) -> Array:
    """Return the cross product of two vectors, shape (3,), faster than `np.cross` for arrays."""
    (a, b, c), (x, y, z) = one.tolist(), other.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def cross_matrix(vector: ArrayLike) -> Array:
    """Return `[v]x`, so that `cross_matrix(v) @ w` is `v x w`; shape (..., 3) to (..., 3, 3)."""
    v = np.asarray(vector, dtype=float)
    matrix = np.zeros((*v.shape, 3))
    matrix[..., 2, 1], matrix[..., 0, 2], matrix[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return matrix - np.swapaxes(matrix, -1, -2)


def matrix_from_rotation_vector(vector: ArrayLike) -> Array:
    """Return exp([r]x) for r = angle times axis [rad]; shape (..., 3) to (..., 3, 3)."""
    v = np.asarray(vector, dtype=float)
    half = 0.5 * np.sqrt(np.sum(v * v, axis=-1))
    # sinc(x) is sin(pi x) / (pi x), and 1 at zero.
    sinc = 0.5 * np.sinc(half / np.pi)
    x, y, z = sinc * v[..., 0], sinc * v[..., 1], sinc * v[..., 2]
    w = np.cos(half)
    xx, yy, zz, ww, xy, zw, xz, yw, yz, xw = (
        *(x * x, y * y, z * z, w * w),
        *(x * y, z * w, x * z, y * w, y * z, x * w),
    )
    matrix = np.empty((*v.shape[:-1], 3, 3))
    matrix[..., 0, 0] = xx - yy - zz + ww
    matrix[..., 1, 1] = yy - xx - zz + ww
    matrix[..., 2, 2] = zz - xx - yy + ww
    matrix[..., 0, 1], matrix[..., 1, 0] = 2.0 * (xy - zw), 2.0 * (xy + zw)
    matrix[..., 0, 2], matrix[..., 2, 0] = 2.0 * (xz + yw), 2.0 * (xz - yw)
    matrix[..., 1, 2], matrix[..., 2, 1] = 2.0 * (yz - xw), 2.0 * (yz + xw)
    return matrix


def rotation_vector_from_matrix(matrix: ArrayLike) -> Array:
    """Return the rotation vector, of length 0 to pi [rad]; shape (..., 3, 3) to (..., 3).

    Of the two of a half turn, the one whose first component that is not zero is positive.
    """
    q = quaternion_from_matrix(matrix)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    leading = np.where(w != 0.0, w, np.where(x != 0.0, x, np.where(y != 0.0, y, z)))
    half = np.arctan2(np.sqrt(x * x + y * y + z * z), np.abs(w))
    return q[..., 1:] * (np.copysign(2.0, leading) / np.sinc(half / np.pi))[..., None]


def quaternion_from_matrix(matrix: ArrayLike) -> Array:
    """Return the unit quaternion, scalar first; shape (..., 3, 3) to (..., 4).

    Of the two, the one whose largest component is positive. A matrix that is not orthogonal is
    replaced by the nearest rotation.

    Raises:
        ValueError: the matrix is a reflection or singular.
    """
    m = np.asarray(matrix, dtype=float)
    if m.shape == (3, 3) and (quaternion := _single_quaternion(m)) is not None:
        return quaternion
    if np.any(np.linalg.det(m) <= 0.0):
        raise ValueError("the determinant of a rotation matrix must be positive")
    products = m @ np.swapaxes(m, -1, -2)
    skewed = np.any(np.abs(products - _IDENTITY) > _ORTHOGONALITY_TOLERANCE, axis=(-2, -1))
    if np.any(skewed):
        left, _, right = np.linalg.svd(m[skewed])
        m = m.copy()
        m[skewed] = left @ right
    # Each row is the quaternion times four times one of its components; the row of the largest
    # component is the most accurate (Shepperd, J. Guidance Control 1, 1978).
    a, b, c = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    (yz, zx, xy), (x, y, z) = (
        [m[..., i, j] + sign * m[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))]
        for sign in (1.0, -1.0)
    )
    rows = np.empty((*m.shape[:-2], 4, 4))
    for i, diagonal in enumerate((a + b + c, a - b - c, b - a - c, c - a - b)):
        rows[..., i, i] = 1.0 + diagonal
    for i, j, product in ((0, 1, x), (0, 2, y), (0, 3, z), (1, 2, xy), (1, 3, zx), (2, 3, yz)):
        rows[..., i, j] = rows[..., j, i] = product
    largest = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(rows, largest[..., None, None], axis=-2)[..., 0, :]
    return q / np.sqrt(np.sum(q * q, axis=-1, keepdims=True))


def _single_quaternion(matrix: Array) -> Array | None:
    """Return the quaternion of one rotation as `quaternion_from_matrix`, bit for bit, but faster.

    None for a matrix that is not orthogonal, or a reflection.
    """
    (a, d, e), (f, b, g), (h, i, c) = matrix.tolist()
    lengths = a * a + d * d + e * e, f * f + b * b + g * g, h * h + i * i + c * c
    angles = a * f + d * b + e * g, f * h + b * i + g * c, h * a + i * d + c * e
    across = h * (d * g - e * b) + i * (e * f - a * g) + c * (a * b - d * f)
    if not (
        max(abs(length - 1.0) for length in lengths) <= _LENGTH_TOLERANCE
        and max(abs(angle) for angle in angles) <= _ANGLE_TOLERANCE
        and across > 0.0
    ):
        return None
    xy, zx, yz, x, y, z = d + f, e + h, g + i, i - g, e - h, f - d
    rows = (
        (1.0 + (a + b + c), x, y, z),
        (x, 1.0 + (a - b - c), xy, zx),
        (y, xy, 1.0 + (b - a - c), yz),
        (z, zx, yz, 1.0 + (c - a - b)),
    )
    largest = max(range(4), key=lambda k: rows[k][k])
    p, q, r, s = rows[largest]
    return np.array(rows[largest]) / sqrt(p * p + q * q + r * r + s * s)


def matrix_from_quaternion(quaternion: Array) -> Array:
    """Return the rotation of a quaternion, scalar first, of any length but zero; (4,) to (3, 3)."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


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
        return self.continuous_angles(np.asarray(matrix, dtype=float)[None], near)[0]

    def continuous_angles(self, matrices: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Return the angles (n, 3) of successive orientations (n, 3, 3) [rad].

        The first triple is that of `angles` with `near`; every other is the nearest to the one
        before it, whole turns included.
        """
        m = np.asarray(matrices, dtype=float)
        offset = self._frame[1]
        turned = self._last_frame_direction(m)
        sine = np.hypot(turned[:, 0], turned[:, 1])
        middle = np.arctan2(sine, turned[:, 2]) - offset
        last = np.arctan2(turned[:, 0], -turned[:, 1])
        outer = matrix_from_chain_angles(self.axes[1:], np.stack([middle, last], axis=-1))
        first = _angle_about(unit_vector(self.axes[0]), np.swapaxes(outer, -1, -2) @ m)
        # The outer two plus pi and the opposite polar angle give the same orientation.
        other = (first + np.pi, -(middle + offset) - offset, last + np.pi)
        pairs = np.stack([first, middle, last, *other], axis=-1).reshape(-1, 2, 3).tolist()
        singular = sine < SINGULAR_SINE
        # At a pole only `last + sign * first` is known.
        sums = iter(self._singular_sums(m[singular], turned[singular, 2] > 0.0))
        previous = None if near is None else _triple(np.asarray(near, dtype=float).tolist())
        triples: list[_Triple] = []
        for is_singular, pair in zip(singular.tolist(), pairs, strict=True):
            if is_singular:
                previous = _singular_triple(*next(sums), previous)
            else:
                previous = _choose_triple(pair, previous)
            triples.append(previous)
        return np.array(triples, dtype=float).reshape(-1, 3)

    def _singular_sums(self, matrices: Array, upper: NDArray[np.bool_]) -> list[_Triple]:
        """Return (sign, middle angle, last + sign * first) of singular orientations (n, 3, 3)."""
        if not len(matrices):
            return []
        frame, offset = self._frame
        sign, middle = np.where(upper, 1.0, -1.0), wrap_angle(np.where(upper, 0.0, np.pi) - offset)
        back = np.swapaxes(matrix_from_axis_angle(frame[0], middle), -1, -2)
        total = _angle_about(frame[2], matrices @ back)
        return list(zip(sign.tolist(), middle.tolist(), total.tolist(), strict=True))

    def is_singular(self, matrix: ArrayLike) -> bool:
        """Return whether only the sum or the difference of the outer angles is known."""
        turned = self._last_frame_direction(np.asarray(matrix, dtype=float))
        return bool(np.hypot(turned[0], turned[1]) < SINGULAR_SINE)

    def _last_frame_direction(self, matrix: Array) -> Array:
        """Rotated first axis in the axes of `_frame`, shape (..., 3)."""
        return np.asarray(self._frame[0] @ matrix @ unit_vector(self.axes[0]))


def _triple(values: Sequence[float]) -> _Triple:
    first, middle, last = values
    return first, middle, last


def _angle_about(axis: Array, matrix: Array) -> Array:
    """Return the angle of rotations (..., 3, 3) about the known `axis`, shape (...) [rad]."""
    x, y, z = axis.tolist()
    sine = 0.5 * (
        x * (matrix[..., 2, 1] - matrix[..., 1, 2])
        + y * (matrix[..., 0, 2] - matrix[..., 2, 0])
        + z * (matrix[..., 1, 0] - matrix[..., 0, 1])
    )
    cosine = 0.5 * (matrix[..., 0, 0] + matrix[..., 1, 1] + matrix[..., 2, 2] - 1.0)
    return np.arctan2(sine, cosine)


def _singular_triple(sign: float, middle: float, total: float, near: _Triple | None) -> _Triple:
    """Return the angles where only `total`, which is `last + sign * first`, is known."""
    if near is None:
        return sign * total / 2.0, middle, total / 2.0
    first, before, last = near
    rest = remainder(total - last - sign * first, _TURN)
    return first + sign * rest / 2.0, before + remainder(middle - before, _TURN), last + rest / 2.0


def _choose_triple(triples: Sequence[Sequence[float]], near: _Triple | None) -> _Triple:
    """Return the conventional triple, or the one nearest to `near` modulo 2 pi."""
    if near is None:
        whole = [_triple([remainder(angle, _TURN) for angle in triple]) for triple in triples]
        return min(whole, key=lambda triple: (round(abs(triple[1]), 9), triple[1] < 0.0))
    x, y, z = near
    (a, b, c), (d, e, f) = triples
    one = remainder(a - x, _TURN), remainder(b - y, _TURN), remainder(c - z, _TURN)
    other = remainder(d - x, _TURN), remainder(e - y, _TURN), remainder(f - z, _TURN)
    p, q, r = other if hypot(*other) < hypot(*one) else one
    return x + p, y + q, z + r
