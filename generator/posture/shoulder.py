"""Shoulder angles of an arm whose elbow points to a latitude and longitude (thesis, section 5.4).

Latitude is 0 with the arm overhead, pi/2 level and pi hanging. Longitude is 0 straight ahead and
pi/2 to the arm's own side: the thesis counts it to the left for the left arm, and the right arm is
the mirror image. So one set of angles serves both sides, as one set of spring coefficients does.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generator.errors import MoverError
from generator.frames import Array
from generator.posture.shoulder_rhythm import OTANI, ShoulderRhythm

QUARTER = np.pi / 2.0
"""A quarter turn, in which eq. 5.49 is written here: its 90, 180, 270 deg are 1, 2, 3."""

SEAM = 2.5 * QUARTER
"""Longitude behind the back at which the natural twist jumps, where the latitude is below 90 deg
(225 deg; eq. 5.49)."""

FIRST, LAST = -QUARTER, 3.0 * QUARTER
"""Longitudes between which the formulas hold; other values are brought there by whole turns."""


class ShoulderError(MoverError, ValueError):
    """There is no such arm; the message says why."""


@dataclass(frozen=True)
class ShoulderAngles:
    """The five angles of one shoulder [rad], arrays of one shape.

    Attributes:
        clavicle_elevation: upwards (eq. 5.45).
        clavicle_abduction: forwards (eq. 5.46).
        humerus_elevation: arm less clavicle, as printed (eq. 5.47).
        humerus_abduction: arm less clavicle, as printed (eq. 5.48). Rotations do not subtract so:
            `printed_miss` in `generator.posture.shoulder_turns` says by how much the elbow misses.
        twist: natural rotation about the humerus, added after longitude and latitude (eq. 5.49), to
            be taken modulo a turn.
    """

    clavicle_elevation: Array
    clavicle_abduction: Array
    humerus_elevation: Array
    humerus_abduction: Array
    twist: Array


def shoulder(
    latitude: ArrayLike, longitude: ArrayLike, rhythm: ShoulderRhythm = OTANI
) -> ShoulderAngles:
    """The angles of a shoulder whose elbow points to `latitude` and `longitude` [rad].

    Args:
        latitude: 0 overhead to pi hanging.
        longitude: 0 ahead, pi/2 to the arm's own side.
        rhythm: how the clavicle follows the arm.

    Raises:
        ShoulderError: a latitude is not between 0 and pi, or a value is not finite.
    """
    phi, theta = _sphere(latitude, longitude)
    elevation = np.pi - phi  # eq. 5.39
    abduction = QUARTER - theta  # eq. 5.40
    up, forwards = rhythm.clavicle(elevation, abduction)
    return ShoulderAngles(
        clavicle_elevation=up,
        clavicle_abduction=forwards,
        humerus_elevation=elevation - up,
        humerus_abduction=abduction - forwards,
        twist=_twist(phi, theta),
    )


def natural_twist(latitude: ArrayLike, longitude: ArrayLike) -> Array:
    """The natural twist of the humerus [rad] (eq. 5.49 with its second row corrected).

    Modulo a turn it is continuous everywhere but at the seam, and makes one orientation of all
    longitudes at each pole. On the seam itself it is the middle of its two limits, as printed.
    Raises ShoulderError as `shoulder` does.
    """
    return _twist(*_sphere(latitude, longitude))


def _twist(latitude: Array, longitude: Array) -> Array:
    p, t = latitude / QUARTER, longitude / QUARTER
    raised, ahead = p <= 1.0, t <= 1.0
    rows = [
        (ahead & raised, 2.0 - t * (1.0 - p)),
        # Printed: -180 (1 - phi / 90), which is not continuous.
        (ahead, -2.0 * (1.0 - t) + (p - 3.0) * t),
        (~raised, (t - 2.0) * (3.0 - p)),
        (t <= 2.0, 2.0 * (t - 2.0) * p - (2.0 + t) * (1.0 - p)),
    ]
    seam = np.sign(SEAM / QUARTER - t)
    behind = (2.0 - t) * (1.0 - 3.0 * p) + seam * 4.0 * p
    return QUARTER * np.select([where for where, _ in rows], [row for _, row in rows], behind)


def _sphere(latitude: ArrayLike, longitude: ArrayLike) -> tuple[Array, Array]:
    """Latitude and longitude of one shape, the longitude within a turn. Raises ShoulderError."""
    given = np.asarray(latitude, dtype=float), np.asarray(longitude, dtype=float)
    phi, theta = np.broadcast_arrays(*given)
    if not (np.all(np.isfinite(phi)) and np.all(np.isfinite(theta))):
        raise ShoulderError("latitude and longitude are finite numbers")
    if np.any((phi < 0.0) | (phi > np.pi)):
        raise ShoulderError("the latitude is between 0 deg, overhead, and 180 deg, hanging")
    within = (theta >= FIRST) & (theta <= LAST)
    return phi, np.where(within, theta, FIRST + np.mod(theta - FIRST, 4.0 * QUARTER))
