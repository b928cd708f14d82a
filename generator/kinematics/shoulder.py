"""Shoulder angles of an arm whose elbow points to a latitude and longitude (thesis, section 5.4).

Latitude is 0 with the arm overhead, pi/2 level and pi hanging. Longitude is 0 straight ahead and
pi/2 to the arm's own side: the thesis counts it to the left for the left arm, and the right arm is
the mirror image. So one set of angles serves both sides, as one set of spring coefficients does.

The torso's frame has x ahead, y left and z up. Formulas are those of the left side; the right one
is its mirror image. Rotations are relative to the zero pose: the arm hanging with its front ahead,
the clavicle pointing sideways.

A rhythm gives the angles of the clavicle for elevation and plane of the arm. Elevation of the arm
is 0 while it hangs and pi overhead; its plane is 0 in the frontal plane and pi/2 in front.
Elevation of the clavicle is positive upwards and its abduction forwards, both relative to the
clavicle of a figure, which points straight sideways. All angles are in radians.

Some angles are discontinuous: there a small motion of the arm is a large change of an angle.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from math import pi, radians
from typing import Protocol, cast

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import ModelError
from generator.rotations import Array, matrix_from_axis_angle, wrap_angle
from springs.published import tables as published
from springs.published.reference import Reference
from springs.published.shoulder_rhythm import PiecewiseLinear, Regression

ABDUCTION_RATIO = 0.2
"""Clavicle abduction per unit of arm abduction (eq. 5.46): the thesis's estimate."""


class ShoulderRhythm(Protocol):
    """The clavicle's two angles as functions of the arm's elevation and plane."""

    @property
    def name(self) -> str:
        """Name on the command line."""
        ...

    @property
    def references(self) -> tuple[Reference, ...]:
        """Sources of the numbers."""
        ...

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Arm elevations at which one formula ends and the next begins [rad]."""
        ...

    def clavicle(self, elevation: Array, plane: Array) -> tuple[Array, Array]:
        """Return elevation and abduction of the clavicle [rad], of the shape of the arguments."""
        ...


@dataclass(frozen=True)
class OtaniRhythm:
    """The thesis's rhythm: Inman's graph in straight lines, and an estimate (eq. 5.41-5.46)."""

    name: str = "otani"

    @property
    def _frontal(self) -> PiecewiseLinear:
        return _load_lines("otani_1989/clavicle_frontal")

    @property
    def _sagittal(self) -> PiecewiseLinear:
        return _load_lines("otani_1989/clavicle_sagittal")

    @property
    def references(self) -> tuple[Reference, ...]:
        """Sources of the numbers."""
        return (published.rhythm("otani_1989/clavicle_frontal").reference,)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Arm elevations at which one line ends and the next begins [rad]."""
        laws = (self._frontal, self._sagittal)
        return tuple(sorted(end for law in laws for end, _, _ in law.pieces if np.isfinite(end)))

    def clavicle(self, elevation: Array, plane: Array) -> tuple[Array, Array]:
        """Return elevation and abduction of the clavicle [rad]."""
        frontal, sagittal = self._frontal.angle(elevation), self._sagittal.angle(elevation)
        share = np.cos(plane)
        return share * frontal + (1.0 - share) * sagittal, ABDUCTION_RATIO * plane


@dataclass(frozen=True)
class DeGrootBrandRhythm:
    """The regression of de Groot and Brand (2001), less the resting angles of its own table.

    A real clavicle at rest points 29 deg backwards and 12 deg up; that of a figure is drawn to the
    side, and this rhythm moves it from there.
    """

    name: str = "de_groot_brand"

    @property
    def references(self) -> tuple[Reference, ...]:
        """Sources of the numbers."""
        return (published.rhythm("de_groot_brand_2001/clavicle_elevation").reference,)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Empty: it is one formula."""
        return ()

    def clavicle(self, elevation: Array, plane: Array) -> tuple[Array, Array]:
        """Return elevation and abduction of the clavicle [rad]."""
        up, forwards = (
            law.angle(elevation) + law.plane * plane - law.rest
            for law in (
                cast("Regression", published.rhythm(f"de_groot_brand_2001/clavicle_{name}").law)
                for name in ("elevation", "protraction")
            )
        )
        return up, forwards


OTANI = OtaniRhythm()
DE_GROOT_BRAND = DeGrootBrandRhythm()

RHYTHMS: dict[str, ShoulderRhythm] = {one.name: one for one in (OTANI, DE_GROOT_BRAND)}
"""The rhythms by name."""


def _load_lines(key: str) -> PiecewiseLinear:
    return cast("PiecewiseLinear", published.rhythm(key).law)


QUARTER_TURN = np.pi / 2.0
"""Unit of eq. 5.49: its 90, 180, 270 deg are 1, 2, 3."""

TWIST_SEAM_LONGITUDE = 2.5 * QUARTER_TURN
"""Longitude behind the back at which the natural twist jumps, where the latitude is below 90 deg
(225 deg; eq. 5.49)."""

MIN_LONGITUDE, MAX_LONGITUDE = -QUARTER_TURN, 3.0 * QUARTER_TURN
"""Range of longitudes of the formulas; other values are wrapped into it."""


@dataclass(frozen=True)
class ShoulderAngles:
    """The five angles of one shoulder [rad], arrays of one shape.

    Attributes:
        clavicle_elevation: upwards (eq. 5.45).
        clavicle_abduction: forwards (eq. 5.46).
        humerus_elevation: arm less clavicle, as printed (eq. 5.47).
        humerus_abduction: arm less clavicle, as printed (eq. 5.48). Rotations do not subtract so:
            `printed_angle_error` is the error of the elbow's direction.
        twist: natural rotation about the humerus, added after longitude and latitude (eq. 5.49), to
            be taken modulo a turn.
    """

    clavicle_elevation: Array
    clavicle_abduction: Array
    humerus_elevation: Array
    humerus_abduction: Array
    twist: Array


def shoulder_angles(
    latitude: ArrayLike, longitude: ArrayLike, rhythm: ShoulderRhythm = OTANI
) -> ShoulderAngles:
    """Return the angles of a shoulder whose elbow points to `latitude` and `longitude` [rad].

    Args:
        latitude: 0 overhead to pi hanging.
        longitude: 0 ahead, pi/2 to the arm's own side.
        rhythm: how the clavicle follows the arm.

    Raises:
        ModelError: a latitude is not between 0 and pi, or a value is not finite.
    """
    phi, theta = _checked_direction(latitude, longitude)
    elevation = np.pi - phi  # eq. 5.39
    abduction = QUARTER_TURN - theta  # eq. 5.40
    up, forwards = rhythm.clavicle(elevation, abduction)
    return ShoulderAngles(
        clavicle_elevation=up,
        clavicle_abduction=forwards,
        humerus_elevation=elevation - up,
        humerus_abduction=abduction - forwards,
        twist=_twist(phi, theta),
    )


def _twist(latitude: Array, longitude: Array) -> Array:
    """Return the natural twist of the humerus [rad] (eq. 5.49 with its second row corrected).

    Modulo 2 pi it is continuous everywhere but at the seam, and gives one orientation for all
    longitudes at each pole. On the seam itself it is the mean of its two limits, as printed.
    """
    p, t = latitude / QUARTER_TURN, longitude / QUARTER_TURN
    raised, ahead = p <= 1.0, t <= 1.0
    rows = [
        (ahead & raised, 2.0 - t * (1.0 - p)),
        # Printed: -180 (1 - phi / 90), which is not continuous.
        (ahead, -2.0 * (1.0 - t) + (p - 3.0) * t),
        (~raised, (t - 2.0) * (3.0 - p)),
        (t <= 2.0, 2.0 * (t - 2.0) * p - (2.0 + t) * (1.0 - p)),
    ]
    seam = np.sign(TWIST_SEAM_LONGITUDE / QUARTER_TURN - t)
    behind = (2.0 - t) * (1.0 - 3.0 * p) + seam * 4.0 * p
    return QUARTER_TURN * np.select([where for where, _ in rows], [row for _, row in rows], behind)


def _checked_direction(latitude: ArrayLike, longitude: ArrayLike) -> tuple[Array, Array]:
    """Return both broadcast to one shape, the longitude wrapped. Raises ModelError."""
    phi, theta = np.broadcast_arrays(
        np.asarray(latitude, dtype=float), np.asarray(longitude, dtype=float)
    )
    if not (np.all(np.isfinite(phi)) and np.all(np.isfinite(theta))):
        raise ModelError("latitude and longitude must be finite numbers")
    if np.any((phi < 0.0) | (phi > np.pi)):
        raise ModelError("the latitude must be between 0 deg (overhead) and 180 deg (hanging)")
    within = (theta >= MIN_LONGITUDE) & (theta <= MAX_LONGITUDE)
    return phi, np.where(
        within, theta, MIN_LONGITUDE + np.mod(theta - MIN_LONGITUDE, 4.0 * QUARTER_TURN)
    )


_X, _Y, _Z = np.eye(3)
_MIRROR_SIGNS = np.array([1.0, -1.0, 1.0])
_HANGING_ORIENTATION = np.diag([1.0, -1.0, -1.0])


class Side(StrEnum):
    """Side of the body."""

    LEFT = "left"
    RIGHT = "right"


def mirror_rotation(rotation: Array, side: Side) -> Array:
    """Return a rotation (..., 3, 3) of the left side, mirrored in the sagittal plane if right."""
    return rotation if side is Side.LEFT else _MIRROR_SIGNS[:, None] * rotation * _MIRROR_SIGNS


def arm_direction(latitude: ArrayLike, longitude: ArrayLike, side: Side = Side.LEFT) -> Array:
    """Return the unit vector from the shoulder to the elbow in the torso's frame, (..., 3)."""
    phi, theta = np.asarray(latitude, dtype=float), np.asarray(longitude, dtype=float)
    parts = (np.sin(phi) * np.cos(theta), np.sin(phi) * np.sin(theta), np.cos(phi) + 0.0 * theta)
    left = np.stack(parts, axis=-1)
    return left if side is Side.LEFT else _MIRROR_SIGNS * left


def arm_orientation(
    latitude: ArrayLike, longitude: ArrayLike, twist: ArrayLike, side: Side = Side.LEFT
) -> Array:
    """Return the rotation of the humerus from hanging, in the torso's frame, shape (..., 3, 3).

    From overhead with its front ahead the arm rotates by the longitude about the vertical, by the
    latitude about the axis across, and by the twist about itself (thesis, before eq. 5.49). Only
    with the twist about the direction to the elbow do its values at a pole give one orientation.
    """
    orientation = (
        matrix_from_axis_angle(_Z, longitude)
        @ matrix_from_axis_angle(_Y, latitude)
        @ matrix_from_axis_angle(_Z, twist)
    )
    return mirror_rotation(orientation @ _HANGING_ORIENTATION, side)


def clavicle_orientation(
    elevation: ArrayLike, abduction: ArrayLike, side: Side = Side.LEFT
) -> Array:
    """Return the rotation of the clavicle from sideways, in the torso's frame, shape (..., 3, 3).

    It is raised first, then rotated forwards about the vertical.
    """
    swung = matrix_from_axis_angle(-_Z, abduction)
    return mirror_rotation(swung @ matrix_from_axis_angle(_X, elevation), side)


def printed_angle_error(latitude: ArrayLike, longitude: ArrayLike, angles: ShoulderAngles) -> Array:
    """Return the error of the elbow's direction with the printed humerus angles [rad].

    The printed angles are taken as those of the arm on the clavicle: they would be exact on a
    clavicle that does not move.
    """
    clavicle = clavicle_orientation(angles.clavicle_elevation, angles.clavicle_abduction)
    on_clavicle = arm_direction(
        np.pi - angles.humerus_elevation, QUARTER_TURN - angles.humerus_abduction
    )
    reached = (clavicle @ on_clavicle[..., None])[..., 0]
    return angle_between(reached, arm_direction(latitude, longitude))


def angle_between(one: Array, other: Array) -> Array:
    """Return the angle between unit vectors (..., 3) [rad], accurate when it is small."""
    across = np.linalg.norm(np.cross(one, other), axis=-1)
    return np.asarray(np.arctan2(across, np.sum(one * other, axis=-1)))


NEARBY_ANGLE = radians(2.0)
"""Distance within which an arm counts as near a jump [rad]."""

MIN_JUMP = radians(0.005)
"""Size below which a jump is rounding of the printed numbers [rad]."""

_JUMP_OFFSET = 1e-9
_LONGITUDES = np.linspace(MIN_LONGITUDE, MAX_LONGITUDE, 361)
_ANGLE_NAMES = ("clavicle_elevation", "clavicle_abduction", "twist")


@dataclass(frozen=True)
class Jump:
    """A direction near the arm at which one of the angles is discontinuous.

    Attributes:
        angle: its name in `ShoulderAngles`.
        place: the direction, as part of a sentence.
        size: size of the jump; of the twist modulo 2 pi, at most pi [rad].
        distance: angle between that direction and the arm [rad].
    """

    angle: str
    place: str
    size: float
    distance: float


def jumps_near(
    latitude: float, longitude: float, rhythm: ShoulderRhythm, within: float = NEARBY_ANGLE
) -> tuple[Jump, ...]:
    """Return the jumps within an angle [rad] of an arm's direction, nearest first.

    Raises ModelError as `shoulder_angles`.
    """
    shoulder_angles(latitude, longitude, rhythm)
    near = [
        jump
        for jump in _all_jumps(latitude, longitude, rhythm)
        if jump.distance <= within and jump.size >= MIN_JUMP
    ]
    return tuple(sorted(near, key=lambda jump: jump.distance))


def _all_jumps(latitude: float, longitude: float, rhythm: ShoulderRhythm) -> Iterator[Jump]:
    meridians = (
        (TWIST_SEAM_LONGITUDE, "longitude 225 deg, the seam behind the back"),
        (MAX_LONGITUDE, "longitude 270 deg, where the longitude starts again at -90 deg"),
    )
    for meridian, place in meridians:
        arm, seam = (arm_direction(latitude, each) for each in (longitude, meridian))
        distance = float(angle_between(arm, seam))
        beside = np.array([meridian - _JUMP_OFFSET, meridian + _JUMP_OFFSET])
        yield from _jumps_between(shoulder_angles(latitude, beside, rhythm), place, distance)
    for elevation in rhythm.breakpoints:
        distance = abs(pi - elevation - latitude)
        beside = np.array([pi - elevation - _JUMP_OFFSET, pi - elevation + _JUMP_OFFSET])
        place = f"latitude {np.degrees(pi - elevation):.4g} deg, where two lines meet"
        yield from _jumps_between(shoulder_angles(beside, longitude, rhythm), place, distance)
    for pole, name in ((0.0, "overhead"), (pi, "hanging")):
        place = f"the arm {name}, where the clavicle angles depend on the longitude"
        around = shoulder_angles(pole, _LONGITUDES, rhythm)
        for angle in _ANGLE_NAMES[:2]:
            values: Array = getattr(around, angle)
            yield Jump(angle, place, float(np.ptp(values)), abs(latitude - pole))


def _jumps_between(sides: ShoulderAngles, place: str, distance: float) -> Iterator[Jump]:
    for angle in _ANGLE_NAMES:
        first, second = getattr(sides, angle)
        step = wrap_angle(np.asarray(second - first)) if angle == "twist" else second - first
        yield Jump(angle, place, abs(float(step)), distance)
