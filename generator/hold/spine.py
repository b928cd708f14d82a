"""Compression of the disc L5/S1 by a single equivalent muscle."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from generator.hold.statics import GRAVITY, Wrench, site_point
from generator.kinematics.placement import Placement
from generator.kinematics.placement import site_pose as joint_pose
from generator.rotations import Array, cross_product

LIMITS = (3400.0, 6400.0)
"""Limits of the compression of NIOSH 1981 [N]: the action limit and the maximum permissible one."""

BACK_ARMS = (0.071, 0.060, 0.050)
"""Moment arms of the back's muscles at L5/S1 [m]: Nemeth & Ohlsen 1986 as cited in rbdl/rbdl, the
middle, and that of textbooks."""

ABDOMEN_ARM = 0.109
"""Moment arm of rectus abdominis at L5/S1 [m]: Nemeth & Ohlsen 1986 as cited in rbdl/rbdl."""

DISC_SHARE = 0.7
"""Place of L5/S1 between the lower and the upper end of the lower torso, an estimate."""

_WAIST = ("waist", "lumbar")


@dataclass(frozen=True)
class SpineLoad:
    """Load of L5/S1.

    Attributes:
        moment: Moment that muscles supply, positive where they extend the back [N m].
        lateral: Moment of bending to the side that they supply, positive where they bend the trunk
            to the right, against a load on the left [N m].
        compression: Compression with the middle arm [N].
        low: Compression with the longest arm [N].
        high: Compression with the shortest arm [N].
        disc: Place of the disc in the world, shape (3,) [m].
    """

    moment: float
    lateral: float
    compression: float
    low: float
    high: float
    disc: Array

    @classmethod
    def of(cls, extension: float, lateral: float, along: float, disc: Array) -> "SpineLoad":
        """Return the load that one muscle yields: see `Spine.components`."""

        def compression(arm: float) -> float:
            sagittal = extension / arm if extension >= 0.0 else -extension / ABDOMEN_ARM
            return along + float(np.hypot(sagittal, lateral / arm))

        low, middle, high = map(compression, BACK_ARMS)
        return cls(extension, -lateral, middle, low, high, disc)


@dataclass(frozen=True)
class Spine:
    """Segments above the disc L5/S1 of a person.

    Attributes:
        pelvis: Segment of which the part above the disc belongs to the trunk.
        joint: Joint above the pelvis.
        next_joint: Joint above that one: the spine runs from the disc to it.
        above: Segments above that joint.
    """

    pelvis: str
    joint: str
    next_joint: str
    above: frozenset[str]

    def load(self, placement: Placement, wrenches: Sequence[Wrench]) -> SpineLoad:
        """Return the load of the disc in a posture.

        The moment of all wrenches above the disc is carried by one muscle at a fixed arm, behind
        the disc where the trunk would bend forwards or sideways, else before it. Passive tissue
        counts as muscle; the pressure in the abdomen is left out.

        Args:
            placement: Posture.
            wrenches: Weights, loads and supports of all segments.
        """
        extension, lateral, along = map(float, self.components(placement, wrenches))
        return SpineLoad.of(extension, lateral, along, self._ends(placement)[0])

    def _ends(self, placement: Placement) -> tuple[Array, Array]:
        """Return the disc and the upper end of the pelvis's segment, shape (3,) [m]."""
        joint = placement.tree.figure.joints[self.joint]
        top = joint.parent if joint.parent.segment == self.pelvis else joint.child
        end = site_point(placement, self.pelvis, top.site)
        start = site_point(placement, self.pelvis, "proximal")
        return start + DISC_SHARE * (end - start), end

    def components(self, placement: Placement, wrenches: Sequence[Wrench]) -> Array:
        """Return what wrenches yield at the disc, shape (3,): it is linear in them.

        Moment that muscles of the back supply and its lateral part [N m], and force along the
        spine, positive where it compresses [N].
        """
        figure, pose = placement.tree.figure, placement.poses[self.pelvis]
        disc, end = self._ends(placement)
        force, moment = np.zeros(3), np.zeros(3)
        for one in wrenches:
            if one.segment in self.above:
                force += one.force
                moment += one.moment - cross_product(disc, one.force)
            elif one.segment == self.pelvis and _is_weight(one, placement):
                # The part of the pelvis's segment that is above the disc, at its middle.
                share = 1.0 - DISC_SHARE
                force += share * one.force
                moment += share * cross_product(0.5 * (end - disc), one.force)
        chord = joint_pose(placement, figure.joints[self.next_joint], "parent")[:3, 3] - disc
        axis = chord / np.linalg.norm(chord)
        # Of the trunk: y to the left, about which muscles of the back turn backwards with -y.
        left = pose[:3, 1] - (pose[:3, 1] @ axis) * axis
        left /= np.linalg.norm(left)
        return np.array([moment @ left, moment @ cross_product(left, axis), -force @ axis])


def _is_weight(one: Wrench, placement: Placement) -> bool:
    """Return whether a wrench is the weight of its segment, not a load or a seat."""
    body = placement.tree.figure.segments[one.segment]
    centre = body.centre_of_mass
    if centre is None or body.mass is None:
        return False
    pose = placement.poses[one.segment]
    place, weight = pose[:3, :3] @ centre + pose[:3, 3], body.mass * np.array(GRAVITY)
    return np.array_equal(one.point, place) and np.array_equal(one.force, weight)


def spine_of(placement: Placement) -> Spine | None:
    """Return the spine of a figure with a joint `waist` or `lumbar`; None without one."""
    tree = placement.tree
    for each in tree.joints:
        if set(each.joint.name.lower().split("_")) & set(_WAIST):
            if "proximal" not in tree.figure.segments[each.inboard].sites:
                return None
            first = tree.kinematics.columns[each.joint.name].start
            above = frozenset(
                name for name, moves in tree.kinematics.motion_masks.items() if moves[first]
            )
            following = (one.joint.name for one in tree.joints if one.inboard == each.outboard)
            return Spine(each.inboard, each.joint.name, next(following, each.joint.name), above)
    return None
