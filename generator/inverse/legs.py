"""Coordinates of hip, knee and ankle that are the angles of published laws of the leg.

Which coordinate flexes a joint, and in which sense, follows from the figure with all displacements
zero: hip flexion moves the knee ahead, knee flexion the ankle back, dorsiflexion raises the toes.
Ahead is where the foot's centre of mass is from the ankle.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from generator.input_files.coordinates import Coordinates
from generator.kinematics.placement import forward_kinematics, with_followers
from generator.kinematics.tree import Tree, TreeJoint
from generator.rotations import Array

MOTIONS = {"hip": "hip flexion", "knee": "knee flexion", "ankle": "ankle dorsiflexion"}
"""Angles of published laws by the joint."""

SIDES = {"right": ("right", "r"), "left": ("left", "l")}
"""Words of a name that say its side."""

MIN_LATERAL = 0.7
"""Least cosine between the axis of a flexion and the side."""

_UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class LegAngle:
    """A coordinate that is an angle of published laws.

    Attributes:
        coordinate: Name of the coordinate.
        sign: Sense of the coordinate's positive value in that of the angle.
    """

    coordinate: str
    sign: float


Leg = Mapping[str, LegAngle]
"""Angles of a leg by the names of `MOTIONS`."""


def find_legs(tree: Tree, coordinates: Coordinates) -> dict[str, Leg]:
    """Return the legs of a figure by side; none where it has no such joints.

    Args:
        tree: Tree of the figure.
        coordinates: Displacements of its joints by the names of their columns.
    """
    legs = {side: _find_leg(tree, coordinates, words) for side, words in SIDES.items()}
    return {side: leg for side, leg in legs.items() if leg}


def _find_leg(tree: Tree, coordinates: Coordinates, side: tuple[str, ...]) -> Leg:
    """Return the angles of one leg; empty where a joint of it is missing."""
    joints = {word: _joints_called(tree, word, side) for word in MOTIONS}
    if not all(joints.values()):
        return {}
    joints_at_zero = {name: np.zeros(len(one.chain)) for name, one in tree.figure.joints.items()}
    zeros = with_followers(tree.figure, joints_at_zero)
    poses = forward_kinematics(tree, zeros).poses
    hip, knee, ankle = (_position(tree, poses, found[-1]) for found in joints.values())
    foot = tree.figure.segments[joints["ankle"][-1].outboard]
    if foot.centre_of_mass is None:
        return {}
    toes = (poses[foot.name] @ np.append(foot.centre_of_mass, 1.0))[:3]
    ahead = (toes - ankle) * (1.0 - _UP)
    if not np.linalg.norm(ahead) > 0.0:
        return {}
    ahead /= np.linalg.norm(ahead)
    arms = {"hip": (hip, knee, ahead), "knee": (knee, ankle, -ahead), "ankle": (ankle, toes, _UP)}
    flat = np.concatenate([zeros[name] for name in tree.kinematics.columns])
    axes = tree.kinematics.twists(flat)[:, :3]
    found: dict[str, LegAngle] = {}
    for word, motion in MOTIONS.items():
        start, end, towards = arms[word]
        names = {one.joint.name for one in joints[word]}
        best = _best_axis(tree, coordinates, names, axes, np.cross(_UP, ahead))
        if best is None:
            return {}
        name, axis = best
        sign = float(np.sign(np.cross(axis, end - start) @ towards))
        if sign == 0.0:
            return {}
        found[motion] = LegAngle(name, sign)
    return found


def _best_axis(
    tree: Tree, coordinates: Coordinates, joints: set[str], axes: Array, lateral: Array
) -> tuple[str, Array] | None:
    """Return the coordinate of some joints whose axis points most to the side, with the axis."""
    best, largest = None, MIN_LATERAL
    for name, at in coordinates.items():
        if at.joint in joints:
            axis = axes[tree.kinematics.columns[at.joint].start + at.index]
            if abs(axis @ lateral) > largest:
                best, largest = (name, axis), abs(float(axis @ lateral))
    return best


def _joints_called(tree: Tree, word: str, side: tuple[str, ...]) -> list[TreeJoint]:
    """Return the joints whose names have a word and a side, from the root outwards."""

    def words(name: str) -> set[str]:
        return set(re.split(r"[_\W]+", name.lower()))

    return [
        one for one in tree.joints if {word} & (own := words(one.joint.name)) and own & set(side)
    ]


def _position(tree: Tree, poses: Mapping[str, Array], joint: TreeJoint) -> Array:
    """Return the position of a joint's outer site in the world, shape (3,) [m]."""
    ref = joint.joint.child if joint.parent_is_inboard else joint.joint.parent
    return (poses[ref.segment] @ tree.figure.site(ref).pose_in_segment)[:3, 3]
