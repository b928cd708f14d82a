"""Limbs of a person as pendulums, and the damping that follows from a damping ratio.

About a joint of a limb the parts below it swing, hanging straight; about a joint of the trunk those
above it, with straight arms, as if they hung too. A limb that turns about its length is bent at a
right angle, since a straight one has nearly no inertia about its length.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from generator.person.body import (
    ARM_SEGMENTS,
    LEG_SEGMENTS,
    TRUNK_SEGMENTS,
    Body,
    BodySegment,
)

STANDARD_GRAVITY = 9.81
"""Acceleration of free fall for the pendulum of a limb [m/s2]."""

_Array = NDArray[np.float64]


@dataclass(frozen=True)
class LimbPendulum:
    """Inertia and weight about an axis of a joint.

    Attributes:
        inertia: inertia about the axis [kg m2].
        weight_moment: weight times the distance of the centre of mass from the axis [N m].
    """

    inertia: float
    weight_moment: float

    def frequency(self, stiffness: float) -> float:
        """Angular frequency of small swings with a spring's stiffness [N m/rad], in rad/s."""
        return sqrt((self.weight_moment + stiffness) / self.inertia)

    def damping(self, ratio: float, stiffness: float) -> float:
        """Viscous damping of a damping ratio [N m s/rad]: 2 ratio frequency inertia."""
        return 2.0 * ratio * self.frequency(stiffness) * self.inertia


LIMBS = {
    "shoulder": ARM_SEGMENTS,
    "elbow": ARM_SEGMENTS[1:],
    "wrist": ARM_SEGMENTS[2:],
    "hip_joint": LEG_SEGMENTS,
    "knee": LEG_SEGMENTS[1:],
    "ankle": LEG_SEGMENTS[2:],
}
"""Segments below the joints of the limbs."""

TRUNK = {
    "waist": TRUNK_SEGMENTS[1:],
    "thorax": TRUNK_SEGMENTS[2:],
    "neck": TRUNK_SEGMENTS[3:],
}
"""Segments above the joints of the trunk; arms hang from the upper torso."""


def limb_pendulum(body: Body, joint: str, axis: str) -> LimbPendulum:
    """Return inertia and weight about an axis of a joint.

    Args:
        body: body of the person.
        joint: name without side.
        axis: "x", "y" or "z" of the joint's frame.
    """
    k = "xyz".index(axis)
    if joint in LIMBS and axis == "z":
        return _turned_limb(body, LIMBS[joint])
    parts = _limb(body, LIMBS[joint]) if joint in LIMBS else _trunk(body, TRUNK[joint])
    mass_moment, inertia = np.zeros(3), 0.0
    for segment, centre in parts:
        mass_moment += segment.mass * centre
        inertia += segment.inertia[k] + segment.mass * _squared_distance(centre, k)
    across = np.delete(mass_moment, k)
    weight = 0.0 if axis == "z" else STANDARD_GRAVITY * hypot(*across)
    return LimbPendulum(float(inertia), float(weight))


def _turned_limb(body: Body, names: tuple[str, ...]) -> LimbPendulum:
    """A limb that turns about its length, the parts below the first one bent at a right angle.

    A hand has no such part: it turns as fast as it swings about the y axis of the wrist.
    """
    first = body.segments[names[0]].inertia[2]
    if len(names) == 1:
        segment = body.segments[names[0]]
        length = segment.centre[2]
        swing = segment.inertia[1] + segment.mass * length**2
        weight = STANDARD_GRAVITY * segment.mass * length
        return LimbPendulum(first, weight * first / swing)
    below = [*_limb(body, names[1:])]
    inertia = first + sum(s.inertia[1] + s.mass * _squared_distance(c, 1) for s, c in below)
    moment = sum((s.mass * c for s, c in below), np.zeros(3))
    return LimbPendulum(float(inertia), float(STANDARD_GRAVITY * hypot(moment[0], moment[2])))


def _squared_distance(centre: _Array, k: int) -> float:
    """Squared distance of a point from axis k through the origin [m2]."""
    return float(centre @ centre - centre[k] ** 2)


def _limb(body: Body, names: Iterable[str]) -> Iterable[tuple[BodySegment, _Array]]:
    """Segments of a straight limb with their centres in the axes of its joint."""
    start = 0.0
    for name in names:
        segment = body.segments[name]
        yield segment, np.add(segment.centre, (0.0, 0.0, start))
        start += segment.length


def _trunk(body: Body, names: Iterable[str]) -> Iterable[tuple[BodySegment, _Array]]:
    """Segments above a joint of the trunk with their centres in its axes, arms straight down."""
    start = 0.0
    for name in names:
        segment = body.segments[name]
        yield segment, np.add(segment.centre, (0.0, 0.0, start))
        if name == "upper_torso":
            for side in (-0.5, 0.5):
                shoulder = (0.0, side * body.shoulder_spacing, start + body.shoulder_height)
                for part, (x, y, z) in _limb(body, LIMBS["shoulder"]):
                    yield part, np.add(shoulder, (x, -y, -z))
        start += segment.length
