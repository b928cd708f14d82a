"""Torques and energy of laws over several joints along a motion."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from generator.joint_chain import Chain
from generator.rotations import Array
from springs import (
    CoupledAxis,
    CoupledSpring,
    JointSprings,
    RotationLaw,
    SpringSet,
    rotation_law,
)


def axis_sign(axis: CoupledAxis, turn_axis: tuple[float, float, float]) -> float:
    """1 if a coordinate grows with rotation about a revolute's axis, else -1."""
    return float(np.sign(np.dot(axis.direction, turn_axis)))


JointRotations = Mapping[str, Array]
"""Rotations by joint: of a revolute the unwrapped angle, shape (n,) [rad]; of others the rotation
vector of the child's site in the parent's, shape (n, 3) [rad]."""


@dataclass(frozen=True)
class CoupledMotion:
    """Rotations of joints that move under laws over several joints.

    Attributes:
        chains: Chain of every joint.
        springs: Springs of the joints, whose rule says what a law's coordinate is.
        rotations: Rotations by joint.
    """

    chains: Mapping[str, Chain]
    springs: SpringSet
    rotations: JointRotations

    def _law(self, joint: str) -> RotationLaw:
        own = self.springs.joints.get(joint, JointSprings(joint))
        return rotation_law(own, self.springs.law, self.chains[joint].rotation_axes)

    def angles(self, spring: CoupledSpring) -> list[Array]:
        """Angles of a law in the order of its coordinates, shape (n,) each [rad]."""
        return [self._angle(axis) for axis in spring.axes]

    def _angle(self, axis: CoupledAxis) -> Array:
        rotation = self.rotations[axis.joint]
        if rotation.ndim == 1:
            return axis_sign(axis, self.chains[axis.joint].rotation_axes[0]) * rotation
        return self._law(axis.joint).angles([axis.direction], rotation)[0]

    def torques(self, spring: CoupledSpring) -> dict[str, Array]:
        """Torque of a law on the child of each of its joints [N m].

        About the axis of a revolute, shape (n,); in the half-way frame of other joints, shape
        (n, 3).
        """
        axis_torques = spring.law.torques(self.angles(spring))
        torques: dict[str, Array] = {}
        for joint in dict.fromkeys(axis.joint for axis in spring.axes):
            rotation = self.rotations[joint]
            own = [
                (axis, np.broadcast_to(torque, rotation.shape[:1]))
                for axis, torque in zip(spring.axes, axis_torques, strict=True)
                if axis.joint == joint
            ]
            if rotation.ndim == 1:
                turn = self.chains[joint].rotation_axes[0]
                torques[joint] = sum((axis_sign(a, turn) * t for a, t in own), np.zeros(1))
            else:
                directions, sizes = [a.direction for a, _ in own], [t for _, t in own]
                torques[joint] = self._law(joint).torque_about(directions, sizes, rotation)
        return torques

    def energy(self, spring: CoupledSpring) -> Array:
        """Stored energy of a conservative law, shape (n,) [J]."""
        return np.asarray(spring.law.energy(self.angles(spring)))
