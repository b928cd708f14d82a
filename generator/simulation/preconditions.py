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
        joint: whose they are.
        reason: the reason.
        fields: fields of the joint in the figure file that may be changed, the first first.
    """

    joint: Joint
    reason: str
    fields: tuple[str, ...]


def find_unsupported_springs(
    placement: Placement, springs: SpringSet
) -> Iterator[UnsupportedSpring]:
    """What a simulation from this placement would refuse, for each joint the first reason."""
    coupled = {axis.joint for spring in springs.coupled for axis in spring.axes}
    for name, joint in placement.tree.figure.joints.items():
        own = springs.joints.get(name, JointSprings(name))
        refusal = unsupported_spring(placement, joint, own, is_coupled=name in coupled)
        if refusal is not None:
            yield refusal


def unsupported_spring(
    placement: Placement, joint: Joint, springs: JointSprings, *, is_coupled: bool
) -> UnsupportedSpring | None:
    """The first reason why the springs of a joint cannot be simulated, or None.

    Args:
        placement: the figure's start.
        joint: one of the figure's.
        springs: of the joint.
        is_coupled: whether a coupled law depends on the joint's rotation.
    """
    refusal = _unsupported_translations(placement, joint, springs)
    elastic = is_coupled or any(axis.elastic for axis in springs.axes)
    several = len(placement.tree.chains[joint.name].rotations) > 1
    if refusal is None and elastic and several and is_at_half_turn(placement, joint):
        reason = (
            f"joint {joint.name} starts at 180 deg, where the torque of its springs is not defined"
        )
        return UnsupportedSpring(joint, reason, ("displacement",))
    return refusal


def is_at_half_turn(placement: Placement, joint: Joint) -> bool:
    """Whether a joint is rotated by 180 deg, where the sign of its rotation vector is undefined."""
    rotation = rotation_vector_from_matrix(placement.pose_in_parent(joint)[:3, :3])
    return float(np.linalg.norm(rotation)) > np.pi - _HALF_TURN_TOLERANCE


def _unsupported_translations(
    placement: Placement, joint: Joint, springs: JointSprings
) -> UnsupportedSpring | None:
    """Springs along several slides hold only where nothing turns beside them."""
    chain, ground = placement.tree.chains[joint.name], placement.tree.figure.ground
    if not springs.translations or len(chain.translations) < 2:
        return None
    fields = ("stiff", "llimit", "ulimit", "damp")
    if chain.rotations:
        sentence = (
            f"joint {joint.name} both turns and slides along more than one axis: "
            "springs along its slides are not supported"
        )
        return UnsupportedSpring(joint, sentence, fields)
    moves_freely = not {ref.segment for ref in joint.ends} & ground
    if moves_freely and any(_has_damping(slide) for slide in springs.translations):
        # Exudyn gives the difference of two points' velocities, which holds the parent's turning.
        sentence = (
            f"joint {joint.name} slides along more than one axis between two moving segments: "
            "damping along its slides is not supported"
        )
        return UnsupportedSpring(joint, sentence, ("damp",))
    return None


def _has_damping(spring: AxisSpring) -> bool:
    has_friction = any(isinstance(law, Frictional) for law in spring.elastic)
    return has_friction or spring.damping.viscous > 0.0 or spring.damping.coulomb > 0.0
