"""Springs that a figure may have and that no simulation supports."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from generator.figure import Joint
from generator.kinematics.placement import Placement
from generator.rotations import rotation_vector_from_matrix
from springs import AxisSpring, JointSprings, SpringSet
from springs.elastic import Frictional

_HALF_TURN_TOLERANCE = 1e-6
"""A rotation nearer than this to 180 deg has the sign of its vector from its rounding [rad]."""


@dataclass(frozen=True)
class UnsupportedSpring:
    """Why the springs of a joint cannot be simulated.

    Attributes:
        joint: the joint with the springs.
        reason: the reason, as a sentence.
        fields: fields of the joint in the figure file to change, the most likely first.
    """

    joint: Joint
    reason: str
    fields: tuple[str, ...]


def find_unsupported_springs(
    placement: Placement, springs: SpringSet
) -> Iterator[UnsupportedSpring]:
    """Find the springs that a simulation from this placement rejects: a reason for each joint."""
    coupled = {axis.joint for spring in springs.coupled for axis in spring.axes}
    for name, joint in placement.tree.figure.joints.items():
        own = springs.joints.get(name, JointSprings(name))
        refusal = unsupported_spring(placement, joint, own, is_coupled=name in coupled)
        if refusal is not None:
            yield refusal


def unsupported_spring(
    placement: Placement, joint: Joint, springs: JointSprings, *, is_coupled: bool
) -> UnsupportedSpring | None:
    """Return the first reason why the springs of a joint cannot be simulated, or None.

    Args:
        placement: initial placement of the figure.
        joint: a joint of the figure.
        springs: springs of the joint.
        is_coupled: whether a coupled law depends on the joint's rotation.
    """
    refusal = _unsupported_translations(placement, joint, springs)
    elastic = is_coupled or any(axis.elastic for axis in springs.axes)
    has_rotation_vector = len(placement.tree.chains[joint.name].rotations) > 1
    if refusal is None and elastic and has_rotation_vector and is_at_half_turn(placement, joint):
        reason = (
            f"joint {joint.name} starts at 180 deg, where the torque of its springs is not defined"
        )
        return UnsupportedSpring(joint, reason, ("displacement",))
    return refusal


def is_at_half_turn(placement: Placement, joint: Joint) -> bool:
    """Return whether a joint is rotated by 180 deg, where its rotation vector changes sign."""
    rotation = rotation_vector_from_matrix(placement.pose_in_parent(joint)[:3, :3])
    return float(np.linalg.norm(rotation)) > np.pi - _HALF_TURN_TOLERANCE


def _unsupported_translations(
    placement: Placement, joint: Joint, springs: JointSprings
) -> UnsupportedSpring | None:
    """Check springs along several translations, which Exudyn supports without rotations only."""
    chain, ground = placement.tree.chains[joint.name], placement.tree.figure.ground
    if not springs.translations or len(chain.translations) < 2:
        return None
    fields = ("stiff", "llimit", "ulimit", "damp")
    if chain.rotations:
        sentence = (
            f"joint {joint.name} has rotations and more than one translation: "
            "springs along its translations are not supported"
        )
        return UnsupportedSpring(joint, sentence, fields)
    is_between_bodies = not {ref.segment for ref in joint.ends} & ground
    if is_between_bodies and any(_has_damping(spring) for spring in springs.translations):
        # Exudyn returns the difference of two points' velocities, which includes the parent's spin.
        sentence = (
            f"joint {joint.name} has more than one translation between two moving segments: "
            "damping along its translations is not supported"
        )
        return UnsupportedSpring(joint, sentence, ("damp",))
    return None


def _has_damping(spring: AxisSpring) -> bool:
    has_friction = any(isinstance(law, Frictional) for law in spring.elastic)
    return has_friction or spring.damping.viscous > 0.0 or spring.damping.coulomb > 0.0
