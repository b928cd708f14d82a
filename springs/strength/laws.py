"""Laws of the largest voluntary torque in one direction, as functions of angle and rate.

Angles are in the sense of the motion of a row ("knee flexion") [rad], rates in the direction of the
torque: positive where the muscles shorten [rad/s]. Torques are sizes, not below zero [N m].
"""

from dataclasses import dataclass
from math import inf, pi
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from springs.backends import Array


class StrengthLaw(Protocol):
    """Largest torque in one direction."""

    @property
    def largest(self) -> float:
        """Torque at the best angle, held still [N m]."""
        ...

    @property
    def angles(self) -> tuple[float, float]:
        """Angles between which the law has a torque [rad]."""
        ...

    def torque(self, angle: ArrayLike, rate: ArrayLike = 0.0) -> Array:
        """Return the largest torque [N m], shape (...), at angles [rad] and rates [rad/s]."""
        ...


@dataclass(frozen=True)
class PointLaw:
    """One number at all angles and rates.

    Attributes:
        largest: Torque [N m].
    """

    largest: float

    @property
    def angles(self) -> tuple[float, float]:
        """All angles."""
        return -inf, inf

    def torque(self, angle: ArrayLike, rate: ArrayLike = 0.0) -> Array:
        """Return the number."""
        return np.full(np.broadcast_shapes(np.shape(angle), np.shape(rate)), self.largest)


@dataclass(frozen=True)
class GaussianLaw:
    """A Gaussian of the angle, the same at all rates.

    Attributes:
        largest: Torque at the best angle [N m].
        best_angle: Angle of the largest torque [rad].
        deviation: Standard deviation of the Gaussian [rad].
    """

    largest: float
    best_angle: float
    deviation: float

    @property
    def angles(self) -> tuple[float, float]:
        """All angles."""
        return -inf, inf

    def torque(self, angle: ArrayLike, rate: ArrayLike = 0.0) -> Array:
        """Return the torque at the angle."""
        x = (np.asarray(angle, dtype=float) - self.best_angle) / self.deviation
        return np.asarray(self.largest * np.exp(-0.5 * x * x) + 0.0 * np.asarray(rate))


@dataclass(frozen=True)
class CosineLaw:
    """Cosine of the angle times a hyperbola of the rate (Anderson, Madigan & Nussbaum 2007).

    Both factors are bounded by zero: the formula as printed turns negative beyond the angles where
    the cosine vanishes, and at fast rates. The hyperbola of plantarflexion never reaches zero (C5
    is above 3 C4), so that fast plantarflexion is too strong. The factor of lengthening muscles is
    from memory.

    Attributes:
        size: Unit of C1, mass times 9.81 m/s2 times stature [N m].
        coefficients: C1 to C6.
    """

    size: float
    coefficients: tuple[float, float, float, float, float, float]

    @property
    def largest(self) -> float:
        """Torque at the best angle, held still."""
        return self.size * self.coefficients[0]

    @property
    def angles(self) -> tuple[float, float]:
        """Angles at which the cosine vanishes [rad]."""
        _, c2, c3, *_ = self.coefficients
        return c3 - 0.5 * pi / c2, c3 + 0.5 * pi / c2

    def torque(self, angle: ArrayLike, rate: ArrayLike = 0.0) -> Array:
        """Return the torque at angles and rates."""
        _, c2, c3, c4, c5, c6 = self.coefficients
        phase = c2 * (np.asarray(angle, dtype=float) - c3)
        cosine = np.where(np.abs(phase) < 0.5 * pi, np.cos(phase), 0.0)
        w = np.asarray(rate, dtype=float)
        speed = np.abs(w)
        hyperbola = (2 * c4 * c5 + speed * (c5 - 3 * c4)) / (
            2 * c4 * c5 + speed * (2 * c5 - 4 * c4)
        )
        factor = np.maximum(hyperbola * (1.0 + c6 * np.maximum(-w, 0.0)), 0.0)
        return np.asarray(self.largest * cosine * factor)
