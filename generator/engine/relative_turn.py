"""The turn of a joint as a function of its bodies' Euler parameters, and forces back on these.

An angle x of a joint depends on the Euler parameters p of the child and of the parent. A torque f
per radian of x is the generalized force f dx/dp on them, whatever f depends on. All angles here
are functions of the orientations alone, told by quaternions of any length: then the forces turn the
bodies and do not stretch the parameters.

Written for plain floats: a solver calls this at every evaluation of the forces.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import atan2, pi, sqrt
from typing import Protocol, TypeAlias

from scipy.spatial.transform import Rotation

from generator.figure import Figure, SiteRef
from generator.frames import Array

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
