"""The rates of a joint's angles as components of its angular velocity, read off the orientation.

The angular velocity of a chain of turns is the sum of their rates times axes w of the parent's
site, which depend on the orientation. A rate is then r . omega, where the r are dual to the w.

Of two or three turns the innermost axis turns with the child, the outermost stays with the parent,
and the one between is perpendicular to both: no angle needs to be known. Its sense alone is not
told by the orientation; it is that of the start, and could only change where the outer two axes
fall together and no rate of theirs is defined.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt

import numpy as np

from generator.chain import Chain
from generator.engine.relative_turn import Quaternion
from generator.frames import Array, unit

Vector = tuple[float, float, float]

_NEAR_POLE = 1e-12
"""Squared sine of the angle between the outer axes below which rates are as large as this allows:
a solver then fails instead of dividing by zero."""


@dataclass(frozen=True)
class TurnRates:
    """The turns of one chain.

    Attributes:
        axes_of_chain: unit axes, innermost first.
        sense: 1 or -1, how the middle one of three axes is directed.
    """

    axes_of_chain: tuple[Vector, ...]
    sense: float

    @classmethod
    def of(cls, chain: Chain, displacements: Array) -> "TurnRates":
        """Those of a chain that starts at displacements (n,) [rad or m]."""
        axes: list[Vector] = []
        for axis in chain.turn_axes:
            x, y, z = unit(axis).tolist()
            axes.append((x, y, z))
        sense = 1.0
        if len(axes) == 3:
            inner, middle, outer = chain.twists(displacements)[list(chain.turns), :3]
            sense = 1.0 if float(np.dot(middle, np.cross(outer, inner))) >= 0.0 else -1.0
        return cls(tuple(axes), sense)

    def axes(self, turn: Quaternion) -> Sequence[Vector]:
        """The r of each turn, innermost first, in the parent's axes, at an orientation."""
        if len(self.axes_of_chain) == 1:
            return self.axes_of_chain
        inner, outer = _turned(turn, self.axes_of_chain[0]), self.axes_of_chain[-1]
        if len(self.axes_of_chain) == 2:
            return inner, outer
        cosine = sum(a * b for a, b in zip(inner, outer, strict=True))
        square = max(1.0 - cosine * cosine, _NEAR_POLE)
        middle = _scaled(_cross(outer, inner), self.sense / sqrt(square))
        return (
            _scaled(_difference(inner, _scaled(outer, cosine)), 1.0 / square),
            middle,
            _scaled(_difference(outer, _scaled(inner, cosine)), 1.0 / square),
        )

    def angular_velocity(self, angles: Sequence[float], rates: Sequence[float]) -> Vector:
        """Of the child in the parent's axes [rad/s], at angles and rates, innermost first."""
        total: Vector = (0.0, 0.0, 0.0)
        for axis, angle, rate in zip(self.axes_of_chain, angles, rates, strict=True):
            x, y, z = axis
            sine = sin(0.5 * angle)
            turned = _turned((cos(0.5 * angle), sine * x, sine * y, sine * z), total)
            total = _sum(turned, _scaled(axis, rate))
        return total


def _turned(turn: Quaternion, vector: Vector) -> Vector:
    """The vector turned by a quaternion of any length."""
    w, a, b, c = turn
    axis = (a, b, c)
    t = _scaled(_cross(axis, vector), 2.0 / (w * w + a * a + b * b + c * c))
    u = _cross(axis, t)
    x, y, z = vector
    return x + w * t[0] + u[0], y + w * t[1] + u[1], z + w * t[2] + u[2]


def _cross(one: Vector, other: Vector) -> Vector:
    a, b, c = one
    x, y, z = other
    return b * z - c * y, c * x - a * z, a * y - b * x


def _scaled(vector: Vector, factor: float) -> Vector:
    x, y, z = vector
    return factor * x, factor * y, factor * z


def _sum(one: Vector, other: Vector) -> Vector:
    a, b, c = one
    x, y, z = other
    return a + x, b + y, c + z


def _difference(one: Vector, other: Vector) -> Vector:
    a, b, c = one
    x, y, z = other
    return a - x, b - y, c - z
