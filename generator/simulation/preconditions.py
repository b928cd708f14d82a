"""Springs that a figure may have and that no simulation can hang on it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from generator.figure import Joint
from generator.kinematics.placement import Placement
from generator.rotations import rotation_vector_from_matrix
from springs import JointSprings, SpringSet

_FAR_ROTATION_SLACK = 1e-6
"""A start nearer than this to 180 deg falls to either side by its rounding [rad]."""


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
        refusal = _unsupported_translations(placement, joint, own)
        elastic = name in coupled or any(axis.elastic for axis in own.axes)
        if refusal is None and elastic and len(placement.tree.chains[name].rotations) > 1:
            refusal = _unsupported_half_turn(placement, joint)
        if refusal is not None:
            yield refusal


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
    damped = any(slide.damping.viscous or slide.damping.coulomb for slide in springs.translations)
    if damped and not {ref.segment for ref in joint.ends} & ground:
        sentence = (
            f"joint {joint.name} slides along more than one axis between two moving segments: "
            "damping along its slides is not supported"
        )
        return UnsupportedSpring(joint, sentence, ("damp",))
    return None


def _unsupported_half_turn(placement: Placement, joint: Joint) -> UnsupportedSpring | None:
    """The torque of several turns jumps at 180 deg."""
    turn = rotation_vector_from_matrix(placement.pose_in_parent(joint)[:3, :3])
    if float(np.linalg.norm(turn)) <= np.pi - _FAR_ROTATION_SLACK:
        return None
    sentence = (
        f"joint {joint.name} starts at 180 deg, where the torque of its springs is not defined"
    )
    return UnsupportedSpring(joint, sentence, ("displacement",))
