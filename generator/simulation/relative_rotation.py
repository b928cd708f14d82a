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
from generator.rotations import Array, unit_vector

Quaternion: TypeAlias = tuple[float, float, float, float]
"""Scalar first."""

_SINE_OFFSET = 1e-60
"""Added to the sine of half an angle, where that may be zero: nothing else changes."""

_PARAMETER_OFFSET = 3
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
class JointEnd:
    """A joint's site on a body that moves, or on the ground.

    Attributes:
        first_coordinate: where the body's coordinates begin among those of the object; None for the ground.
        reference_parameters: Euler parameters to which the coordinates are added; of the ground, all there is.
        site: orientation of the site in the segment.
    """

    first_coordinate: int | None
    reference_parameters: Quaternion
    site: Quaternion

    def parameters(self, coordinates: Sequence[float]) -> Quaternion:
        """Euler parameters of the body."""
        w, x, y, z = self.reference_parameters
        if self.first_coordinate is None:
            return self.reference_parameters
        at = self.first_coordinate + _PARAMETER_OFFSET
        a, b, c, d = coordinates[at : at + 4]
        return w + a, x + b, y + c, z + d

    def add_forces(self, forces: list[float], gradient: Quaternion) -> None:
        """Add the gradient by the site's orientation to the forces on the body's parameters."""
        if self.first_coordinate is not None:
            at = self.first_coordinate + _PARAMETER_OFFSET
            w, x, y, z = product(gradient, conjugate(self.site))
            forces[at] += w
            forces[at + 1] += x
            forces[at + 2] += y
            forces[at + 3] += z


def build_joint_end(
    figure: Figure,
    poses: Mapping[str, Array],
    ref: SiteRef,
    first_coordinate: int | None,
    reference_parameters: Quaternion,
) -> JointEnd:
    """The end of a joint at a site.

    Args:
        figure: whose site it is.
        poses: of the segments, of which those of the ground are looked at.
        ref: the site.
        first_coordinate: where the coordinates of its body begin; None for the ground.
        reference_parameters: Euler parameters to which the body's coordinates are added.
    """
    site = quaternion(figure.site(ref).pose_in_segment[:3, :3])
    if first_coordinate is None:
        return JointEnd(None, quaternion(poses[ref.segment][:3, :3]), site)
    return JointEnd(first_coordinate, reference_parameters, site)


class JointAngles(Protocol):
    """Angles that are read off the orientation of the child's site in the parent's."""

    def values(self, rotation: Quaternion, near: float) -> list[float]:
        """The angles [rad]; of those that may go round, the ones next to `near`."""
        ...

    def gradient(self, rotation: Quaternion, torques: Sequence[float]) -> Quaternion:
        """Sum of the torques [N m], each times the gradient of its angle by `rotation`."""
        ...


@dataclass(frozen=True)
class RevoluteAngles:
    """The angle about one axis, told as often as there are signs.

    Attributes:
        axis: unit axis in the parent's site frame.
        signs: 1 for a coordinate that grows with turns about the axis, -1 for the opposite.
    """

    axis: tuple[float, float, float]
    signs: tuple[float, ...]

    def values(self, rotation: Quaternion, near: float) -> list[float]:
        """The angles [rad], of all that differ by whole turns the one next to `near`."""
        sine, cosine = self._half_angle_sine_cosine(rotation)
        angle = 2.0 * atan2(sine, cosine)
        angle += 2.0 * pi * round((near - angle) / (2.0 * pi))
        return [sign * angle for sign in self.signs]

    def gradient(self, rotation: Quaternion, torques: Sequence[float]) -> Quaternion:
        """2 (c ds - s dc) / (s^2 + c^2) for the angle 2 atan2(s, c)."""
        sine, cosine = self._half_angle_sine_cosine(rotation)
        total = sum(sign * torque for sign, torque in zip(self.signs, torques, strict=True))
        size = 2.0 * total / (sine * sine + cosine * cosine)
        x, y, z = self.axis
        along = size * cosine
        return -size * sine, along * x, along * y, along * z

    def _half_angle_sine_cosine(self, rotation: Quaternion) -> tuple[float, float]:
        w, a, b, c = rotation
        x, y, z = self.axis
        return a * x + b * y + c * z, w


@dataclass(frozen=True)
class SphericalAngles:
    """Components of the rotation vector, which is the one of at most 180 deg.

    Attributes:
        directions: unit axes in the parent's site frame.
    """

    directions: tuple[tuple[float, float, float], ...]

    def values(self, rotation: Quaternion, near: float) -> list[float]:
        """Components of h v/n for the quaternion (w, v), where n = |v| and h = 2 atan2(n, w)."""
        (w, a, b, c), n = _shorter_rotation(rotation)
        size = 2.0 * atan2(n, w) / n
        return [size * (a * x + b * y + c * z) for x, y, z in self.directions]

    def gradient(self, rotation: Quaternion, torques: Sequence[float]) -> Quaternion:
        """Gradient of f . (h v/n), f being the sum of torques times directions.

        By w it is -2 (f.v)/(w^2 + n^2); by v it is f h/n across v and f 2w/(w^2 + n^2) along v.
        """
        (w, a, b, c), n = _shorter_rotation(rotation)
        f = g = h = 0.0
        for torque, (x, y, z) in zip(torques, self.directions, strict=True):
            f, g, h = f + torque * x, g + torque * y, h + torque * z
        along = f * a + g * b + h * c
        size = 2.0 * atan2(n, w) / n
        twice = 2.0 / (w * w + n * n)
        more = (twice * w - size) * (along / n) / n
        result = (-twice * along, size * f + more * a, size * g + more * b, size * h + more * c)
        return result if rotation[0] >= 0.0 else (-result[0], -result[1], -result[2], -result[3])


def _shorter_rotation(rotation: Quaternion) -> tuple[Quaternion, float]:
    """The one of a quaternion and its opposite that turns by at most 180 deg; length of its v."""
    w, a, b, c = rotation
    if w < 0.0:
        w, a, b, c = -w, -a, -b, -c
    return (w, a, b, c), sqrt(a * a + b * b + c * c) + _SINE_OFFSET


@dataclass(frozen=True)
class RelativeRotation:
    """The turn of one joint.

    Attributes:
        parent: the end that the turn is told from.
        child: the end that turns.
    """

    parent: JointEnd
    child: JointEnd

    def orientations(
        self, coordinates: Sequence[float]
    ) -> tuple[Quaternion, Quaternion, Quaternion]:
        """Orientations of the parent's and the child's site, and of the second in the first."""
        parent = product(self.parent.parameters(coordinates), self.parent.site)
        child = product(self.child.parameters(coordinates), self.child.site)
        return parent, child, product(conjugate(parent), child)

    def add_forces(
        self,
        forces: list[float],
        orientations: tuple[Quaternion, Quaternion, Quaternion],
        gradient: Quaternion,
    ) -> None:
        """Add what a gradient by the turn is to the bodies' Euler parameters."""
        parent, child, _ = orientations
        # The turn is conj(parent) child, and the adjoint of a product by a factor is one by its
        # conjugate.
        self.child.add_forces(forces, product(parent, gradient))
        self.parent.add_forces(forces, product(child, conjugate(gradient)))


Vector = tuple[float, float, float]

_MIN_SQUARED_SINE = 1e-12
"""Squared sine of the angle between the outer axes below which rates are as large as this allows:
a solver then fails instead of dividing by zero."""


@dataclass(frozen=True)
class JointRates:
    """The turns of one chain.

    Attributes:
        chain_axes: unit axes, innermost first.
        middle_axis_sense: 1 or -1, how the middle one of three axes is directed.
    """

    chain_axes: tuple[Vector, ...]
    middle_axis_sense: float

    @classmethod
    def from_chain(cls, chain: Chain, displacements: Array) -> "JointRates":
        """Those of a chain that starts at displacements (n,) [rad or m]."""
        axes: list[Vector] = []
        for axis in chain.rotation_axes:
            x, y, z = unit_vector(axis).tolist()
            axes.append((x, y, z))
        sense = 1.0
        if len(axes) == 3:
            inner, middle, outer = chain.twists(displacements)[list(chain.rotations), :3]
            sense = 1.0 if float(np.dot(middle, np.cross(outer, inner))) >= 0.0 else -1.0
        return cls(tuple(axes), sense)

    def rate_axes(self, rotation: Quaternion) -> Sequence[Vector]:
        """The r of each turn, innermost first, in the parent's axes, at an orientation."""
        if len(self.chain_axes) == 1:
            return self.chain_axes
        inner, outer = _rotate(rotation, self.chain_axes[0]), self.chain_axes[-1]
        if len(self.chain_axes) == 2:
            return inner, outer
        cosine = sum(a * b for a, b in zip(inner, outer, strict=True))
        square = max(1.0 - cosine * cosine, _MIN_SQUARED_SINE)
        middle = _scale(_cross(outer, inner), self.middle_axis_sense / sqrt(square))
        return (
            _scale(_difference(inner, _scale(outer, cosine)), 1.0 / square),
            middle,
            _scale(_difference(outer, _scale(inner, cosine)), 1.0 / square),
        )

    def angular_velocity(self, angles: Sequence[float], rates: Sequence[float]) -> Vector:
        """Of the child in the parent's axes [rad/s], at angles and rates, innermost first."""
        total: Vector = (0.0, 0.0, 0.0)
        for axis, angle, rate in zip(self.chain_axes, angles, rates, strict=True):
            x, y, z = axis
            sine = sin(0.5 * angle)
            turned = _rotate((cos(0.5 * angle), sine * x, sine * y, sine * z), total)
            total = _sum(turned, _scale(axis, rate))
        return total


def _rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """The vector turned by a quaternion of any length."""
    w, a, b, c = rotation
    axis = (a, b, c)
    t = _scale(_cross(axis, vector), 2.0 / (w * w + a * a + b * b + c * c))
    u = _cross(axis, t)
    x, y, z = vector
    return x + w * t[0] + u[0], y + w * t[1] + u[1], z + w * t[2] + u[2]


def _cross(one: Vector, other: Vector) -> Vector:
    a, b, c = one
    x, y, z = other
    return b * z - c * y, c * x - a * z, a * y - b * x


def _scale(vector: Vector, factor: float) -> Vector:
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
