"""Orientations as quaternions that do not jump: scalar last, as glTF has them."""

import numpy as np
from scipy.spatial.transform import Rotation

from generator.frames import Array


def continuous_quaternions(matrices: Array) -> Array:
    """Unit quaternions (x, y, z, w) of rotation matrices, shape (n, 3, 3) to (n, 4).

    A quaternion and its negative mean one orientation. The first has w >= 0, and each that follows
    has the sign that brings it nearer to the one before, so that what lies between two of them is
    the short way.
    """
    quaternions = np.asarray(Rotation.from_matrix(matrices).as_quat(), dtype=float)
    first = -1.0 if quaternions[0, 3] < 0.0 else 1.0
    products = np.sum(quaternions[1:] * quaternions[:-1], axis=1)
    turned = np.where(products < 0.0, -1.0, 1.0)
    signs = np.cumprod(np.concatenate([[first], turned]))
    return np.multiply(quaternions, signs[:, None], dtype=float)


def axis_angles(matrices: Array) -> Array:
    """Unit axis and angle [rad] of rotation matrices, shape (n, 3, 3) to (n, 4).

    Angles are from 0 to pi; where there is no turn, the axis is y.
    """
    vectors = np.asarray(Rotation.from_matrix(matrices).as_rotvec(), dtype=float)
    angles = np.linalg.norm(vectors, axis=1)
    still = angles == 0.0
    axes = np.divide(vectors, angles[:, None], where=~still[:, None], out=np.zeros_like(vectors))
    axes[still] = [0.0, 1.0, 0.0]
    return np.column_stack([axes, angles])
