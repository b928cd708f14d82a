"""Directions and orientations of arm and clavicle in the torso's frame: x ahead, y left, z up.

The left side is written down; `mirrored` makes the right one of it. Turns are counted from the zero
pose: an arm that hangs with its front ahead, a clavicle that points to the side.
"""

from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from generator.frames import Array, matrix_from_axis_angle
from generator.posture.shoulder import QUARTER, ShoulderAngles

_X, _Y, _Z = np.eye(3)
_MIRROR = np.array([1.0, -1.0, 1.0])
_HANGING = np.diag([1.0, -1.0, -1.0])


class Side(StrEnum):
    """Which shoulder."""

    LEFT = "left"
    RIGHT = "right"


def mirrored(turn: Array, side: Side) -> Array:
    """A turn of the left side (..., 3, 3), or its mirror image in the sagittal plane."""
    return turn if side is Side.LEFT else _MIRROR[:, None] * turn * _MIRROR


def arm_direction(latitude: ArrayLike, longitude: ArrayLike, side: Side = Side.LEFT) -> Array:
    """Unit vector from the shoulder to the elbow in the torso's frame, shape (..., 3)."""
    phi, theta = np.asarray(latitude, dtype=float), np.asarray(longitude, dtype=float)
    parts = (np.sin(phi) * np.cos(theta), np.sin(phi) * np.sin(theta), np.cos(phi) + 0.0 * theta)
    left = np.stack(parts, axis=-1)
    return left if side is Side.LEFT else _MIRROR * left


def arm_turn(
    latitude: ArrayLike, longitude: ArrayLike, twist: ArrayLike, side: Side = Side.LEFT
) -> Array:
    """Turn of the humerus from hanging, in the torso's frame, shape (..., 3, 3).

    From overhead with its front ahead the arm turns by the longitude about the vertical, by the
    latitude about the axis across, and by the twist about itself (thesis, before eq. 5.49). Only
    with the twist taken about the direction to the elbow are its values at the poles one attitude.
    """
    orientation = (
        matrix_from_axis_angle(_Z, longitude)
        @ matrix_from_axis_angle(_Y, latitude)
        @ matrix_from_axis_angle(_Z, twist)
    )
    return mirrored(orientation @ _HANGING, side)


def clavicle_turn(elevation: ArrayLike, abduction: ArrayLike, side: Side = Side.LEFT) -> Array:
    """Turn of the clavicle from the side, in the torso's frame, shape (..., 3, 3).

    It is raised first, then swung forwards about the vertical.
    """
    swung = matrix_from_axis_angle(-_Z, abduction)
    return mirrored(swung @ matrix_from_axis_angle(_X, elevation), side)


def printed_miss(latitude: ArrayLike, longitude: ArrayLike, angles: ShoulderAngles) -> Array:
    """Angle by which the elbow misses with the humerus angles as printed [rad].

    The printed angles are taken as those of the arm on a clavicle: they would be exact on one that
    does not move.
    """
    clavicle = clavicle_turn(angles.clavicle_elevation, angles.clavicle_abduction)
    on_clavicle = arm_direction(
        np.pi - angles.humerus_elevation, QUARTER - angles.humerus_abduction
    )
    reached = (clavicle @ on_clavicle[..., None])[..., 0]
    return angle_between(reached, arm_direction(latitude, longitude))


def angle_between(one: Array, other: Array) -> Array:
    """Angle between unit vectors (..., 3) [rad], accurate when it is small."""
    across = np.linalg.norm(np.cross(one, other), axis=-1)
    return np.asarray(np.arctan2(across, np.sum(one * other, axis=-1)))
