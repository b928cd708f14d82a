"""Mass properties of a rigid body, and how they add up, move and turn."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

ROUNDING_TOLERANCE = 1e-9
"""Relative error that a sum of many parts may have: asymmetry, moments that no body has."""


@dataclass(frozen=True, eq=False)
class PrincipalInertia:
    """Principal moments of inertia and their axes.

    Attributes:
        moments: [kg m2], from the smallest to the largest, shape (3,).
        axes: the principal axes as columns of a rotation, right-handed, shape (3, 3).
    """

    moments: Array
    axes: Array


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass, centre of mass and inertia of a rigid body, all told in one frame.

    Bodies in the same frame are joined by `+`.

    Attributes:
        mass: [kg], above zero.
        centre: centre of mass [m], shape (3,).
        inertia: tensor about the centre of mass along the frame's axes [kg m2], shape (3, 3); its
            off-diagonals are minus the products of inertia (eq. 5.28).
    """

    mass: float
    centre: Array
    inertia: Array

    def __post_init__(self) -> None:
        """Refuse what no body has: a tensor of another shape, a moment above the others' sum."""
        centre, inertia = np.array(self.centre, float), np.array(self.inertia, float)
        if centre.shape != (3,) or inertia.shape != (3, 3):
            raise ValueError("a centre of mass has shape (3,), an inertia tensor (3, 3)")
        if not (np.isfinite(centre).all() and np.isfinite(inertia).all()):
            raise ValueError("centre of mass and inertia must be finite")
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise ValueError(f"a body's mass is above zero, not {self.mass}")
        slack = ROUNDING_TOLERANCE * float(np.abs(inertia).max())
        if float(np.abs(inertia - inertia.T).max()) > slack:
            raise ValueError("an inertia tensor is symmetric")
        inertia = (inertia + inertia.T) / 2.0
        moments = np.linalg.eigvalsh(inertia)
        if moments[0] < -slack or moments[2] > moments[0] + moments[1] + slack:
            raise ValueError(f"no body has the principal moments {moments} kg m2")
        for name, array in (("centre", centre), ("inertia", inertia)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __add__(self, other: "MassProperties") -> "MassProperties":
        """The two bodies as one; both are told in the same frame.

        The parallel axis theorem in terms of the distance between the centres: two large numbers
        that nearly cancel never appear.
        """
        mass = self.mass + other.mass
        apart = other.centre - self.centre
        centre = self.centre + other.mass / mass * apart
        reduced = self.mass * (other.mass / mass)
        return MassProperties(
            mass, centre, self.inertia + other.inertia + reduced * _unit_point_inertia(apart)
        )

    def inertia_about(self, point: ArrayLike) -> Array:
        """Inertia tensor about `point` [m] of the frame [kg m2], shape (3, 3) (eq. 5.37, 5.38)."""
        arm = self.centre - np.asarray(point, dtype=float)
        return self.inertia + self.mass * _unit_point_inertia(arm)

    def transform(self, pose_in_frame: ArrayLike) -> "MassProperties":
        """The same body told in another frame, in which this one has the pose (4, 4)."""
        pose = np.asarray(pose_in_frame, dtype=float)
        turn, shift = pose[:3, :3], pose[:3, 3]
        return MassProperties(self.mass, turn @ self.centre + shift, turn @ self.inertia @ turn.T)

    def with_mass(self, mass: float) -> "MassProperties":
        """A body of the same shape and another mass [kg]: the density changes everywhere alike."""
        return MassProperties(mass, self.centre, self.inertia * (mass / self.mass))

    @property
    def principal_inertia(self) -> PrincipalInertia:
        """Principal moments and axes.

        The largest component of the first two axes is positive, and the third completes a
        right-handed frame. Where moments are equal the axes are any that suit.
        """
        moments, axes = np.linalg.eigh(self.inertia)
        largest = np.abs(axes).argmax(axis=0)
        axes = axes * np.where(axes[largest, np.arange(3)] < 0.0, -1.0, 1.0)
        axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
        return PrincipalInertia(moments, axes)


def _unit_point_inertia(arm: Array) -> Array:
    """Inertia tensor of the mass one at the end of `arm`: |r|^2 - r r^T."""
    return float(arm @ arm) * np.eye(3) - np.outer(arm, arm)
