"""Forces of hands beside the Arm Force Field."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from generator.hold.statics import GRAVITY, Load, site_point
from generator.kinematics.placement import Placement
from generator.kinematics.placement import site_pose as joint_pose
from generator.rotations import Array
from springs.strength.arm_force_field import (
    MEN_FACTOR,
    ArmWeight,
    HandStrength,
    arm_force_field_spread,
    hand_force,
)
from springs.strength.strengths import Body, StrengthClass

SMALLEST_FORCE = 1e-6
"""Force of a hand that counts as none [N]."""


@dataclass(frozen=True)
class HandDemand:
    """Force of a hand beside its strength.

    Attributes:
        hand: Segment.
        force: Force that the hand exerts [N].
        strength: Strength along this force.
        origin: Class of the strength.
    """

    hand: str
    force: float
    strength: HandStrength
    origin: StrengthClass

    @property
    def percent_capable(self) -> float:
        """Percentage of people who are capable of the force."""
        return self.strength.percent_capable(self.force)


@dataclass(frozen=True)
class HandPlace:
    """A hand in a posture, in the shoulder's axes: forwards, upwards, outwards.

    Attributes:
        hand: Segment.
        axes: Axes in the world as rows, shape (3, 3).
        point: Place of the load from the shoulder, shape (3,) [m].
        assistance: Force at the hand that the arm's weight yields, shape (3,) [N].
        factor: Strength over that of the mean woman.
        origin: Class of the strength.
    """

    hand: str
    axes: Array
    point: Array
    assistance: Array
    factor: float
    origin: StrengthClass

    def demand(self, force: Array) -> HandDemand:
        """Return the demand of a force that the hand exerts, shape (3,) [N], in the world."""
        size = float(np.linalg.norm(force))
        along = self.axes @ (force / size)
        mean = self.factor * hand_force(self.point, along)
        strength = HandStrength(mean, float(self.assistance @ along), arm_force_field_spread())
        return HandDemand(self.hand, size, strength, self.origin)


def hand_demands(
    placement: Placement, loads: Sequence[Load], body: Body | None
) -> Iterator[HandDemand]:
    """Yield the forces of the hands that bear loads."""
    for place in hand_places(placement, loads, body):
        own = [load.total for load in loads if load.segment == place.hand]
        force = -np.sum(own, axis=0)
        if float(np.linalg.norm(force)) >= SMALLEST_FORCE:
            yield place.demand(force)


def hand_places(
    placement: Placement, loads: Sequence[Load], body: Body | None
) -> Iterator[HandPlace]:
    """Yield the hands with loads of a person with arms as `mover person` makes.

    The field is that of the mean woman; men's is 1.66 times as large, an estimate. The weight is
    that of the figure's own arm.
    """
    if body is None:
        return
    figure = placement.tree.figure
    for side, outwards in (("left", -1.0), ("right", 1.0)):
        names = [f"{side}_{part}" for part in ("shoulder", "elbow", "wrist")]
        needed = {*names, "left_shoulder", "right_shoulder", "neck", "waist"}
        own = [load for load in loads if load.segment == f"{side}_hand"]
        if not own or not needed <= figure.joints.keys():
            continue
        axes = _shoulder_axes(placement, outwards)
        shoulder = _place(placement, names[0])
        hand = axes @ (site_point(placement, own[0].segment, own[0].site) - shoulder)
        masses, centres = list[float](), list[Array]()
        for part in ("upper_arm", "lower_arm", "hand"):
            segment = figure.segments[f"{side}_{part}"]
            if segment.mass is not None and segment.centre_of_mass is not None:
                pose = placement.poses[segment.name]
                centre = pose[:3, :3] @ segment.centre_of_mass + pose[:3, 3]
                masses.append(segment.mass)
                centres.append(axes @ (centre - shoulder))
        down = axes @ (np.array(GRAVITY) / np.linalg.norm(GRAVITY))
        assistance = ArmWeight(masses, centres, down).force_at(hand)
        factor = 1.0 if body.is_female else MEN_FACTOR
        origin = StrengthClass.PUBLISHED if body.is_female else StrengthClass.ESTIMATE
        yield HandPlace(f"{side}_hand", axes, hand, assistance, factor, origin)


def _place(placement: Placement, joint: str) -> Array:
    """Return the place of a joint in the world, shape (3,) [m]."""
    return np.array(joint_pose(placement, placement.tree.figure.joints[joint], "parent")[:3, 3])


def _shoulder_axes(placement: Placement, outwards: float) -> Array:
    """Return the axes of the field as rows: forwards, upwards, outwards, shape (3, 3)."""
    to_right = _place(placement, "right_shoulder") - _place(placement, "left_shoulder")
    to_right /= np.linalg.norm(to_right)
    trunk = _place(placement, "neck") - _place(placement, "waist")
    forwards = np.cross(trunk, to_right)
    forwards /= np.linalg.norm(forwards)
    return np.array([forwards, np.cross(to_right, forwards), outwards * to_right])
