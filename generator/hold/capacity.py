"""Strengths of the joints of a figure, about the axes of their chains."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isnan

import numpy as np

from generator.kinematics.tree import Tree
from generator.simulation.muscle_tone import named_rotations, stated_strengths
from generator.springs_file.axes import axis_label
from generator.tone import Tone
from springs import SpringSet
from springs.published.range_of_motion import opposite_motions
from springs.strength.strengths import Body, Strength, strength

DEFAULT_SPREAD = 0.25
"""Standard deviation between people over the mean of strengths that a user states, an estimate: 14
muscle groups have 0.201 to 0.30 (Benfica et al. 2018, abstract)."""


@dataclass(frozen=True)
class JointAxisStrength:
    """Strength about a rotation of a joint.

    Attributes:
        joint: Name of the joint.
        index: Index of the rotation in the chain of the joint.
        sense: 1 where the motion is the positive displacement, -1 where it is the opposite.
        motion: Name of the motion; "about x" where springs name none.
        strength: Strength in the sense of the motion and against it; None where it is not known.
        is_stated: Whether the user stated it.
    """

    joint: str
    index: int
    sense: float
    motion: str
    strength: Strength | None
    is_stated: bool = False

    def direction(self, is_opposite: bool) -> str:
        """Return the name of the motion, or of the opposite one."""
        if not is_opposite:
            return self.motion
        return next(iter(opposite_motions(self.motion)), f"against {self.motion}")

    def spread(self, is_opposite: bool) -> float:
        """Return the standard deviation between people over the mean, in a direction."""
        own = DEFAULT_SPREAD if self.strength is None else self.strength.spreads[is_opposite]
        return DEFAULT_SPREAD if isnan(own) else own


def axis_strengths(
    tree: Tree, springs: SpringSet, body: Body | None, stated: Tone | None = None
) -> tuple[JointAxisStrength, ...]:
    """Return the strengths about all rotations of a figure.

    Rotations of joints without springs, such as those that place a person in the world, have none
    and are left out.

    Args:
        tree: Tree of the figure.
        springs: Springs, which name the motions.
        body: Person; None where it is not known.
        stated: Strengths of the user, which precede the table.

    Raises:
        ModelError: The user states a strength of an unknown joint or motion.
    """
    own = {} if stated is None else stated_strengths(stated, tree.chains, springs)
    return tuple(_axes(tree, springs, body, own))


def _axes(
    tree: Tree,
    springs: SpringSet,
    body: Body | None,
    stated: Mapping[tuple[str, str], Strength],
) -> Iterator[JointAxisStrength]:
    for name in tree.kinematics.columns:
        chain, joint_springs = tree.chains[name], springs.joints.get(name)
        is_stated = any(joint == name for joint, _ in stated)
        if joint_springs is None and not is_stated:
            continue
        rotations = named_rotations(chain, joint_springs)
        for k, (direction, motion) in zip(chain.rotations, rotations, strict=True):
            sense = float(np.sign(np.dot(direction, chain.joint_axes[k].axis)))
            known = stated.get((name, motion)) or stated.get((name, ""))
            found = known or (strength(name, motion, body) if motion else None)
            label = motion or f"about {axis_label(direction)}"
            yield JointAxisStrength(name, k, sense, label, found, known is not None)
