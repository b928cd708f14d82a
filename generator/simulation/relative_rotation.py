"""The turn of a joint as a function of its bodies' Euler parameters, and forces back on these.

An angle x of a joint depends on the Euler parameters p of the child and of the parent. A torque f
per radian of x is the generalized force f dx/dp on them, whatever f depends on. All angles here
are functions of the orientations alone, told by quaternions of any length: then the forces turn the
bodies and do not stretch the parameters.

Written for plain floats: a solver calls this at every evaluation of the forces.

The rates of a joint's angles as components of its angular velocity, read off the orientation.

The angular velocity of a chain of turns is the sum of their rates times axes w of the parent's
site, which depend on the orientation. A rate is then r . omega, where the r are dual to the w.

Of two or three turns the innermost axis turns with the child, the outermost stays with the parent,
and the one between is perpendicular to both: no angle needs to be known. Its sense alone is not
told by the orientation; it is that of the start, and could only change where the outer two axes
fall together and no rate of theirs is defined.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import atan2, cos, pi, sin, sqrt
from typing import Protocol, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from generator.figure import Figure, SiteRef
from generator.joint_chain import Chain
from generator.rotations import Array, unit

Quaternion: TypeAlias = tuple[float, float, float, float]
"""Scalar first."""

_TINY = 1e-60
"""Added to the sine of half an angle, where that may be zero: nothing else changes."""

_PARAMETERS = 3
"""Where a rigid body's Euler parameters begin among its seven coordinates."""


def quaternion(matrix: Array) -> Quaternion:
    """Unit quaternion of a rotation matrix (3, 3)."""
    x, y, z, w = Rotation.from_matrix(matrix).as_quat().tolist()
    return w, x, y, z


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Quaternion of the turn by q followed by p."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Quaternion of the turn back."""
    w, x, y, z = q
    return w, -x, -y, -z


@dataclass(frozen=True)
class End:
    """A joint's site on a body that moves, or on the ground.

    Attributes:
        place: where the body's coordinates begin among those of the object; None for the ground.
        rest: Euler parameters to which the coordinates are added; of the ground, all there is.
        site: orientation of the site in the segment.
    """

    place: int | None
    rest: Quaternion
    site: Quaternion

    def parameters(self, coordinates: Sequence[float]) -> Quaternion:
        """Euler parameters of the body."""
        w, x, y, z = self.rest
        if self.place is None:
            return self.rest
        at = self.place + _PARAMETERS
        a, b, c, d = coordinates[at : at + 4]
        return w + a, x + b, y + c, z + d

    def add(self, forces: list[float], gradient: Quaternion) -> None:
        """Add the gradient by the site's orientation to the forces on the body's parameters."""
        if self.place is not None:
            at = self.place + _PARAMETERS
            w, x, y, z = product(gradient, conjugate(self.site))
            forces[at] += w
            forces[at + 1] += x
            forces[at + 2] += y
            forces[at + 3] += z


def end_of(
    figure: Figure,
    poses: Mapping[str, Array],
    ref: SiteRef,
    place: int | None,
    rest: Quaternion,
) -> End:
    """The end of a joint at a site.

    Args:
        figure: whose site it is.
        poses: of the segments, of which those of the ground are looked at.
        ref: the site.
        place: where the coordinates of its body begin; None for the ground.
        rest: Euler parameters to which the body's coordinates are added.
    """
    site = quaternion(figure.site(ref).pose_in_segment[:3, :3])
    if place is None:
        return End(None, quaternion(poses[ref.segment][:3, :3]), site)
    return End(place, rest, site)


class Angles(Protocol):
    """Angles that are read off the orientation of the child's site in the parent's."""

    def values(self, turn: Quaternion, near: float) -> list[float]:
        """The angles [rad]; of those that may go round, the ones next to `near`."""
        ...

    def gradient(self, turn: Quaternion, torques: Sequence[float]) -> Quaternion:
        """Sum of the torques [N m], each times the gradient of its angle by `turn`."""
        ...


@dataclass(frozen=True)
class HingeAngles:
    """The angle about one axis, told as often as there are signs.

    Attributes:
        axis: unit axis in the parent's site frame.
        signs: 1 for a coordinate that grows with turns about the axis, -1 for the opposite.
    """

    axis: tuple[float, float, float]
    signs: tuple[float, ...]

    def values(self, turn: Quaternion, near: float) -> list[float]:
        """The angles [rad], of all that differ by whole turns the one next to `near`."""
        sine, cosine = self._half(turn)
        angle = 2.0 * atan2(sine, cosine)
        angle += 2.0 * pi * round((near - angle) / (2.0 * pi))
        return [sign * angle for sign in self.signs]

    def gradient(self, turn: Quaternion, torques: Sequence[float]) -> Quaternion:
        """2 (c ds - s dc) / (s^2 + c^2) for the angle 2 atan2(s, c)."""
        sine, cosine = self._half(turn)
        total = sum(sign * torque for sign, torque in zip(self.signs, torques, strict=True))
        size = 2.0 * total / (sine * sine + cosine * cosine)
        x, y, z = self.axis
        along = size * cosine
        return -size * sine, along * x, along * y, along * z

    def _half(self, turn: Quaternion) -> tuple[float, float]:
        w, a, b, c = turn
        x, y, z = self.axis
        return a * x + b * y + c * z, w


@dataclass(frozen=True)
class BallAngles:
    """Components of the rotation vector, which is the one of at most 180 deg.

    Attributes:
        directions: unit axes in the parent's site frame.
    """

    directions: tuple[tuple[float, float, float], ...]

    def values(self, turn: Quaternion, near: float) -> list[float]:
        """Components of h v/n for the quaternion (w, v), where n = |v| and h = 2 atan2(n, w)."""
        (w, a, b, c), n = _short(turn)
        size = 2.0 * atan2(n, w) / n
        return [size * (a * x + b * y + c * z) for x, y, z in self.directions]

    def gradient(self, turn: Quaternion, torques: Sequence[float]) -> Quaternion:
        """Gradient of f . (h v/n), f being the sum of torques times directions.

        By w it is -2 (f.v)/(w^2 + n^2); by v it is f h/n across v and f 2w/(w^2 + n^2) along v.
        """
        (w, a, b, c), n = _short(turn)
        f = g = h = 0.0
        for torque, (x, y, z) in zip(torques, self.directions, strict=True):
            f, g, h = f + torque * x, g + torque * y, h + torque * z
        along = f * a + g * b + h * c
        size = 2.0 * atan2(n, w) / n
        twice = 2.0 / (w * w + n * n)
        more = (twice * w - size) * (along / n) / n
        result = (-twice * along, size * f + more * a, size * g + more * b, size * h + more * c)
        return result if turn[0] >= 0.0 else (-result[0], -result[1], -result[2], -result[3])


def _short(turn: Quaternion) -> tuple[Quaternion, float]:
    """The one of a quaternion and its opposite that turns by at most 180 deg; length of its v."""
    w, a, b, c = turn
    if w < 0.0:
        w, a, b, c = -w, -a, -b, -c
    return (w, a, b, c), sqrt(a * a + b * b + c * c) + _TINY


@dataclass(frozen=True)
class RelativeTurn:
    """The turn of one joint.

    Attributes:
        parent: the end that the turn is told from.
        child: the end that turns.
    """

    parent: End
    child: End

    def ends(self, coordinates: Sequence[float]) -> tuple[Quaternion, Quaternion, Quaternion]:
        """Orientations of the parent's and the child's site, and of the second in the first."""
        parent = product(self.parent.parameters(coordinates), self.parent.site)
        child = product(self.child.parameters(coordinates), self.child.site)
        return parent, child, product(conjugate(parent), child)

    def spread(
        self,
        forces: list[float],
        ends: tuple[Quaternion, Quaternion, Quaternion],
        gradient: Quaternion,
    ) -> None:
        """Add what a gradient by the turn is to the bodies' Euler parameters."""
        parent, child, _ = ends
        # The turn is conj(parent) child, and the adjoint of a product by a factor is one by its
        # conjugate.
        self.child.add(forces, product(parent, gradient))
        self.parent.add(forces, product(child, conjugate(gradient)))


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
