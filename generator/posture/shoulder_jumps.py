"""Where the shoulder's angles jump: near such a place a small motion of the arm is a large one.

The places follow from the formulas, the sizes are measured on both sides of them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi, radians

import numpy as np

from generator.frames import Array, wrapped
from generator.posture.shoulder import FIRST, LAST, SEAM, ShoulderAngles, shoulder
from generator.posture.shoulder_rhythm import ShoulderRhythm
from generator.posture.shoulder_turns import angle_between, arm_direction

NEAR = radians(2.0)
"""An arm nearer to a jump than this is near it [rad]."""

SMALLEST = radians(0.005)
"""Jumps below this are the rounding of the printed numbers [rad]."""

_BESIDE = 1e-9
_AROUND = np.linspace(FIRST, LAST, 361)
_NAMES = ("clavicle_elevation", "clavicle_abduction", "twist")


@dataclass(frozen=True)
class Jump:
    """A place near the arm at which one of the angles jumps.

    Attributes:
        angle: which, by its name in `ShoulderAngles`.
        place: where, as part of a sentence.
        size: of the jump; the twist's is that of its attitude, at most half a turn [rad].
        distance: between the directions of the arm and of the place [rad].
    """

    angle: str
    place: str
    size: float
    distance: float


def jumps_near(
    latitude: float, longitude: float, rhythm: ShoulderRhythm, within: float = NEAR
) -> tuple[Jump, ...]:
    """The jumps within an angle [rad] of an arm's direction, nearest first.

    Raises ShoulderError as `shoulder` does.
    """
    shoulder(latitude, longitude, rhythm)
    near = [
        jump
        for jump in _jumps(latitude, longitude, rhythm)
        if jump.distance <= within and jump.size >= SMALLEST
    ]
    return tuple(sorted(near, key=lambda jump: jump.distance))


def _jumps(latitude: float, longitude: float, rhythm: ShoulderRhythm) -> Iterator[Jump]:
    meridians = (
        (SEAM, "longitude 225 deg, the seam behind the back"),
        (LAST, "longitude 270 deg, where the longitude starts again at -90 deg"),
    )
    for meridian, place in meridians:
        distance = _distance((latitude, longitude), (latitude, meridian))
        beside = np.array([meridian - _BESIDE, meridian + _BESIDE])
        yield from _between(shoulder(latitude, beside, rhythm), place, distance)
    for elevation in rhythm.breaks:
        distance = abs(pi - elevation - latitude)
        beside = np.array([pi - elevation - _BESIDE, pi - elevation + _BESIDE])
        place = f"latitude {np.degrees(pi - elevation):.4g} deg, between two lines"
        yield from _between(shoulder(beside, longitude, rhythm), place, distance)
    for pole, name in ((0.0, "overhead"), (pi, "hanging")):
        place = f"the arm {name}, where every longitude has other clavicle angles"
        around = shoulder(pole, _AROUND, rhythm)
        for angle in _NAMES[:2]:
            values: Array = getattr(around, angle)
            yield Jump(angle, place, float(np.ptp(values)), abs(latitude - pole))


def _between(sides: ShoulderAngles, place: str, distance: float) -> Iterator[Jump]:
    for angle in _NAMES:
        first, second = getattr(sides, angle)
        step = wrapped(np.asarray(second - first)) if angle == "twist" else second - first
        yield Jump(angle, place, abs(float(step)), distance)


def _distance(arm: tuple[float, float], place: tuple[float, float]) -> float:
    return float(angle_between(arm_direction(*arm), arm_direction(*place)))
