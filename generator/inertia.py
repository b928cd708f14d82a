"""Mass properties of a rigid body: sum, and transformation to another frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

ROUNDING_TOLERANCE = 1e-9
"""Relative rounding error of a sum of many parts, in symmetry and principal moments."""


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
    """Mass, centre of mass and inertia of a rigid body, all in one frame.

    `+` combines bodies in the same frame.

    Attributes:
        mass: [kg], positive.
        centre: centre of mass [m], shape (3,).
        inertia: tensor about the centre of mass along the frame's axes [kg m2], shape (3, 3); its
            off-diagonals are minus the products of inertia (eq. 5.28).
    """

    mass: float
    centre: Array
    inertia: Array

    def __post_init__(self) -> None:
        """Check shapes, finiteness, symmetry, and the triangle inequality of the moments."""
        centre, inertia = np.array(self.centre, float), np.array(self.inertia, float)
        if centre.shape != (3,) or inertia.shape != (3, 3):
            raise ValueError("a centre of mass has shape (3,), an inertia tensor (3, 3)")
        if not (np.isfinite(centre).all() and np.isfinite(inertia).all()):
            raise ValueError("centre of mass and inertia must be finite")
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise ValueError(f"the mass of a body must be above zero, not {self.mass}")
        slack = ROUNDING_TOLERANCE * float(np.abs(inertia).max())
        if float(np.abs(inertia - inertia.T).max()) > slack:
            raise ValueError("an inertia tensor must be symmetric")
        inertia = (inertia + inertia.T) / 2.0
        moments = np.linalg.eigvalsh(inertia)
        if moments[0] < -slack or moments[2] > moments[0] + moments[1] + slack:
            raise ValueError(f"no body has the principal moments {moments} kg m2")
        for name, array in (("centre", centre), ("inertia", inertia)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __add__(self, other: "MassProperties") -> "MassProperties":
        """Return the two bodies, in the same frame, as one.

        The parallel axis theorem is applied to the distance between the centres, which avoids
        cancellation.
        """
        mass = self.mass + other.mass
        distance = other.centre - self.centre
        centre = self.centre + other.mass / mass * distance
        reduced = self.mass * (other.mass / mass)
        return MassProperties(
            mass, centre, self.inertia + other.inertia + reduced * _unit_point_inertia(distance)
        )

    def inertia_about(self, point: ArrayLike) -> Array:
        """Return the inertia tensor [kg m2] about `point` [m], shape (3, 3) (eq. 5.37, 5.38)."""
        arm = self.centre - np.asarray(point, dtype=float)
        return self.inertia + self.mass * _unit_point_inertia(arm)

    def transform(self, pose_in_frame: ArrayLike) -> "MassProperties":
        """Return the same body in another frame, in which this one has the pose (4, 4)."""
        pose = np.asarray(pose_in_frame, dtype=float)
        rotation, translation = pose[:3, :3], pose[:3, 3]
        return MassProperties(
            self.mass, rotation @ self.centre + translation, rotation @ self.inertia @ rotation.T
        )

    def with_mass(self, mass: float) -> "MassProperties":
        """Return the same body with its density scaled to another mass [kg]."""
        return MassProperties(mass, self.centre, self.inertia * (mass / self.mass))

    @property
    def principal_inertia(self) -> PrincipalInertia:
        """Principal moments and axes.

        The largest component of the first two axes is positive, and the third completes a
        right-handed frame. Where moments are equal the axes are arbitrary.
        """
        moments, axes = np.linalg.eigh(self.inertia)
        largest = np.abs(axes).argmax(axis=0)
        axes = axes * np.where(axes[largest, np.arange(3)] < 0.0, -1.0, 1.0)
        axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
        return PrincipalInertia(moments, axes)


def _unit_point_inertia(arm: Array) -> Array:
    """Return the inertia tensor of a unit point mass at `arm`: |r|^2 - r r^T."""
    return float(arm @ arm) * np.eye(3) - np.outer(arm, arm)
