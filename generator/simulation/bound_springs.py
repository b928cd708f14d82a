"""Springs of joints bound to the displacements that they act on."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from generator.joint_chain import Chain
from springs import (
    AxisSpring,
    JointSprings,
    Operations,
    ReachLaw,
    Real,
    RotationLaw,
    SphericalLaw,
    rotation_law,
    total_torque,
)
from springs.tone.law import AxisTone


class JointKind(Enum):
    """The kind of displacement that a spring acts on."""

    REVOLUTE = "revolute"
    """One angle."""
    SPHERICAL = "spherical"
    """A rotation vector."""
    PRISMATIC = "prismatic"
    """One translation."""


@dataclass(frozen=True)
class BoundSpring:
    """Springs of one displacement, or of the rotations of a joint.

    Attributes:
        springs: its springs; empty if it is only measured, for coupled laws and tone.
        kind: kind of the displacement that it acts on.
        axis_index: axis index of a revolute or prismatic, the index of its axis in the joint's
            chain.
        output_weights: output weights of a revolute or prismatic, weights of the offset in the
            displacement.
        law: law of several rotations; None for a single displacement.
        tone: tones about the axes of the rotations.
    """

    springs: tuple[AxisSpring, ...]
    kind: JointKind
    axis_index: int = 0
    output_weights: tuple[float, ...] = (1.0,)
    law: RotationLaw | None = None
    tone: tuple[AxisTone, ...] = ()

    @property
    def acts(self) -> bool:
        """True if it has a torque or force, False if it is only measured."""
        return bool(self.springs or self.tone) or isinstance(self.law, ReachLaw)


def bind_springs(
    chain: Chain,
    springs: JointSprings,
    law: SphericalLaw,
    tones: Sequence[AxisTone] = (),
    *,
    read_rotation: bool = False,
) -> tuple[BoundSpring, ...]:
    """Return the springs of one joint, which have no obstacles, bound to its displacements.

    Args:
        chain: displacements of the joint.
        springs: springs about its axes and along its translations.
        law: law of spherical joints.
        tones: tones that hold its angles.
        read_rotation: whether to measure the rotation also without springs, for coupled laws.
    """
    bound: list[BoundSpring] = []
    if springs.axes or springs.reach or read_rotation:
        axes = chain.rotation_axes
        if len(axes) == 1:
            own = tuple(spring.oriented_along(axes[0]) for spring in springs.axes[:1])
            oriented = tuple(tone.oriented_along(axes[0]) for tone in tones)
            bound.append(BoundSpring(own, JointKind.REVOLUTE, chain.rotations[0], tone=oriented))
        else:
            made = rotation_law(springs, law, axes)
            own = tuple(made.axes)
            bound.append(BoundSpring(own, JointKind.SPHERICAL, law=made, tone=tuple(tones)))
    indices = [chain.translation_along(spring.direction) for spring in springs.translations]
    weights: list[tuple[float, ...]] = [(1.0,)] * len(indices)
    if indices and len(chain.translations) > 1:
        # Rows of the pseudo-inverse, because the axes may be oblique.
        inverse = np.linalg.pinv(np.array([chain.joint_axes[k].axis for k in chain.translations]).T)
        weights = [tuple(inverse[chain.translations.index(k)].tolist()) for k in indices]
    for spring, k, row in zip(springs.translations, indices, weights, strict=True):
        along = spring.oriented_along(chain.joint_axes[k].axis)
        bound.append(BoundSpring((along,), JointKind.PRISMATIC, k, row))
    return tuple(bound)


def generalized_force(spring: AxisSpring, value: Real, rate: Real, ops: Operations) -> Real:
    """Torque or force of a spring of one displacement on the child."""
    return total_torque(spring.elastic, value, ops) + spring.resistance(value, rate, ops)
