"""Coupled laws over a motion: their angles, their torques on the joints and their energy."""

from collections.abc import Mapping

import numpy as np

from generator.chain import Chain
from generator.engine.coupled import sign_about
from generator.frames import Array
from springs import CoupledAxis, CoupledSpring, group_torque

Turned = Mapping[str, Array]
"""By joint n turns: of a hinge the unwrapped angle, shape (n,) [rad]; else the rotation vector of
the child's site in the parent's, shape (n, 3) [rad]."""


def coupled_angles(
    spring: CoupledSpring, chains: Mapping[str, Chain], turned: Turned
) -> list[Array]:
    """The law's angles, in the order of its coordinates, shape (n,) each [rad]."""
    return [_factor(axis, chains) * _component(axis, turned[axis.joint]) for axis in spring.axes]


def coupled_torques(
    spring: CoupledSpring, chains: Mapping[str, Chain], turned: Turned
) -> dict[str, Array]:
    """Torque on the child of each joint concerned [N m].

    Of a hinge about its axis, shape (n,); of a ball in the half-way frame, shape (n, 3).
    """
    sums: dict[str, Array] = {}
    sizes = spring.law.torques(coupled_angles(spring, chains, turned))
    for axis, size in zip(spring.axes, sizes, strict=True):
        turn = turned[axis.joint]
        size = np.broadcast_to(size, turn.shape[:1])
        one = size * _factor(axis, chains) if turn.ndim == 1 else np.outer(size, axis.direction)
        sums[axis.joint] = sums[axis.joint] + one if axis.joint in sums else one
    return {
        name: one if one.ndim == 1 else group_torque(one, turned[name])
        for name, one in sums.items()
    }


def coupled_energy(spring: CoupledSpring, chains: Mapping[str, Chain], turned: Turned) -> Array:
    """Stored energy of a law that has one, shape (n,) [J]."""
    return np.asarray(spring.law.energy(coupled_angles(spring, chains, turned)))


def _component(axis: CoupledAxis, turn: Array) -> Array:
    return turn if turn.ndim == 1 else turn @ np.asarray(axis.direction)


def _factor(axis: CoupledAxis, chains: Mapping[str, Chain]) -> float:
    """The sense in which a hinge's angle is counted; 1 for a ball."""
    axes = chains[axis.joint].turn_axes
    return sign_about(axis, axes[0]) if len(axes) == 1 else 1.0
