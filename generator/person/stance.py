"""Stance of a person: arms and legs as far from trunk and each other as their girths need.

Outlines are those of the surfaces seen from the front, so that what is clear in them is clear in
space. The upper parts of arms and thighs lie against the trunk and each other, as those of people
do, and are left out.

The abductions are displacements of the joints in the figure. The zero of the joints, to which
springs, limits, poses and motions refer, stays the anatomical one with straight arms and legs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, degrees, radians, sin

import numpy as np

from generator.geometry.surface import Array
from generator.person.body import Body
from generator.person.shape import arm_loft, leg_loft, thigh_cap, trunk_loft
from generator.person.sources import Origin, SourcedNumber

FREE_ARM, FREE_LEG = 0.8, 0.5
"""Parts of upper arm and thigh below which arms and legs do not touch; estimates."""

ARM_GAP = 0.02
"""Least distance of the arms from trunk and thighs, seen from the front [m]; an estimate.

With it and `LEAST_LEGS` the moment of inertia about the long axis is that of measured men.
"""

LEAST_LEGS = radians(2.0)
"""Least abduction of the legs [rad]; an estimate."""

MAX_ARMS, MAX_LEGS = radians(60.0), radians(20.0)
"""Largest abductions [rad], for people far beyond those who were measured."""

_POINTS = 120
"""Points of an outline."""

_BISECTIONS = 45


@dataclass(frozen=True)
class Stance:
    """Abduction of the limbs of a standing person.

    Attributes:
        arms: abduction of the shoulders [rad].
        legs: abduction of the hips, and inversion of the ankles, so that the soles are flat [rad].
    """

    arms: float
    legs: float

    def hip_height(self, body: Body) -> float:
        """Height of the hip centres above the soles [m]."""
        return body.ankle_height + cos(self.legs) * (body.hip_height - body.ankle_height)


def standing_stance(body: Body) -> Stance:
    """Return the stance of a person."""
    legs = min(max(LEAST_LEGS, _clear_legs(body)), MAX_LEGS)
    return Stance(_clear_arms(body, legs), legs)


def stance_sources(body: Body) -> tuple[SourcedNumber, ...]:
    """Return the angles of the stance with their rules."""
    stance = standing_stance(body)
    least = f"at least {degrees(LEAST_LEGS):g} deg"
    rows = (
        (
            "shoulder",
            "abduction, standing",
            stance.arms,
            f"arms are {1000 * ARM_GAP:g} mm from trunk and thighs, seen from the front, below "
            f"{FREE_ARM:g} of the upper arm",
        ),
        (
            "hip_joint",
            "abduction, standing",
            stance.legs,
            f"legs are clear of each other below {FREE_LEG:g} of the thigh, and {least} out",
        ),
        ("ankle", "inversion, standing", stance.legs, "the sole is flat"),
    )
    return tuple(
        SourcedNumber(joint, quantity, value, "rad", Origin.ESTIMATE, None, rule)
        for joint, quantity, value, rule in rows
    )


def _clear_legs(body: Body) -> float:
    """Return the least abduction at which the legs do not cross the plane between them [rad]."""
    knee = body.segments["upper_leg"].length
    along = np.linspace(FREE_LEG * knee, knee + body.segments["lower_leg"].length, _POINTS)
    half = 0.5 * leg_loft(body).breadths(along)
    # The inner outline is inward of the limb's axis by the angle atan(half / along), seen from the
    # hip, and may be so by that whose sine is the distance of the plane.
    inward = np.arctan2(half, along)
    allowed = np.arcsin(np.minimum(0.5 * body.hip_spacing / np.hypot(along, half), 1.0))
    return float((inward - allowed).max())


def _clear_arms(body: Body, legs: float) -> float:
    """Return the least abduction at which the arms are clear of trunk and thighs [rad]."""
    segments = body.segments
    loft = arm_loft(body)
    elbow = segments["upper_arm"].length
    wrist = elbow + segments["lower_arm"].length
    along = np.linspace(FREE_ARM * elbow, wrist + body.measures.length("hand_length"), _POINTS)
    half = 0.5 * loft.breadths(along)
    shoulder = segments["lower_torso"].length + segments["middle_torso"].length
    shoulder += body.shoulder_height
    trunk, leg = _trunk_outline(body), _leg_outline(body)

    def gap(arms: float) -> float:
        out = 0.5 * body.shoulder_spacing + along * sin(arms) - half * cos(arms)
        up = shoulder - along * cos(arms) - half * sin(arms)
        # In the axes of the abducted leg: along it, and outward.
        beside = out - 0.5 * body.hip_spacing
        down = beside * sin(legs) - up * cos(legs)
        outward = beside * cos(legs) + up * sin(legs)
        return float(min((out - trunk(up)).min(), (outward - leg(down)).min()))

    if gap(0.0) >= ARM_GAP:
        return 0.0
    low, high = 0.0, MAX_ARMS
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if gap(middle) >= ARM_GAP else (middle, high)
    return 0.5 * (low + high)


def _trunk_outline(body: Body) -> Callable[[Array], Array]:
    """Half breadth of the trunk [m] at heights above the hips [m]; far less beyond its ends."""
    loft = trunk_loft(body)
    return _outline(np.linspace(loft.sections[0].at, loft.sections[-1].at, _POINTS), loft.breadths)


def _leg_outline(body: Body) -> Callable[[Array], Array]:
    """Half breadth of a leg [m] at distances below the hip [m]; far less beyond its ends."""
    loft, cap = leg_loft(body), thigh_cap(body)

    def breadths(along: Array) -> Array:
        beyond = np.clip(-along / cap.height, 0.0, 1.0)
        return loft.breadths(along) * (1.0 - beyond**cap.exponent) ** (1.0 / cap.exponent)

    return _outline(np.linspace(-cap.height, loft.sections[-1].at, 2 * _POINTS), breadths)


def _outline(places: Array, breadths: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """Half breadths interpolated between places."""
    halves = 0.5 * breadths(places)
    return lambda at: np.interp(at, places, halves, left=-1.0, right=-1.0)
