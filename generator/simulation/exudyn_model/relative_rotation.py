"""Rotation of a joint by its bodies' Euler parameters, with generalized forces and rates.

An angle x of a joint depends on the Euler parameters p of the child and of the parent. A torque f
about x is the generalized force f dx/dp on them. All angles are functions of the orientation, for
quaternions of any length, so the forces rotate the bodies and do not stretch the parameters.

The angular velocity of a chain of rotations is the sum of their rates times axes w in the parent's
site, which depend on the orientation. A rate is r . omega, where the r are dual to the w. Of two or
three rotations, the innermost axis moves with the child, the outermost is fixed in the parent, and
the middle one is perpendicular to both. The sign of the middle axis is that of the start; it could
change only where the outer axes coincide and their rates are undefined.

The code uses plain floats, because the solver calls it at every evaluation of the forces.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import atan2, cos, pi, sin, sqrt
from typing import Protocol, TypeAlias

import numpy as np

from generator.figure import Figure, SiteRef
from generator.joint_chain import Chain
from generator.rotations import (
    Array,
    matrix_from_rotation_vector,
    quaternion_from_matrix,
    unit_vector,
)
from springs import FLOATS, RotationLaw

Quaternion: TypeAlias = tuple[float, float, float, float]
"""Quaternion, scalar first."""

_SINE_OFFSET = 1e-60
"""Offset of the sine of half an angle, which avoids a division by zero."""

_PARAMETER_OFFSET = 3
"""Index of a rigid body's first Euler parameter among its seven coordinates."""


def quaternion(matrix: Array) -> Quaternion:
    """Unit quaternion of a rotation matrix (3, 3)."""
    w, x, y, z = quaternion_from_matrix(matrix).tolist()
    return w, x, y, z


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Quaternion of the rotation by q followed by p."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Quaternion of the inverse rotation."""
    w, x, y, z = q
    return w, -x, -y, -z


@dataclass(frozen=True)
class JointEnd:
    """A joint's site on a moving body or on the ground.

    Attributes:
        first_coordinate: index of the body's first coordinate in the object; None for the ground.
        reference_parameters: Euler parameters to which the coordinates are added; for the ground,
            its Euler parameters.
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
        """Add a gradient with respect to the site's orientation to the forces on the body."""
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
    """Build the end of a joint at a site.

    Args:
        figure: figure with the site.
        poses: poses of the segments, used for the ground's.
        ref: the site.
        first_coordinate: index of its body's first coordinate; None for the ground.
        reference_parameters: Euler parameters to which the body's coordinates are added.
    """
    site = quaternion(figure.site(ref).pose_in_segment[:3, :3])
    if first_coordinate is None:
        return JointEnd(None, quaternion(poses[ref.segment][:3, :3]), site)
    return JointEnd(first_coordinate, reference_parameters, site)


class JointAngles(Protocol):
    """Angles as functions of the orientation of the child's site in the parent's."""

    def values(self, rotation: Quaternion, near: float) -> list[float]:
        """Angles [rad]; an unwrapped angle is the one nearest to `near`."""
        ...

    def gradient(self, rotation: Quaternion, torques: Sequence[float]) -> Quaternion:
        """Sum of the torques [N m] times the gradients of the angles with respect to `rotation`."""
        ...


@dataclass(frozen=True)
class RevoluteAngles:
    """Unwrapped angle about one axis, once for each sign.

    Attributes:
        axis: unit axis in the parent's site frame.
        signs: 1 for a coordinate that grows with rotation about the axis, else -1.
    """

    axis: tuple[float, float, float]
    signs: tuple[float, ...]

    def values(self, rotation: Quaternion, near: float) -> list[float]:
        """Angles [rad], unwrapped to the turn nearest to `near`."""
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
    """Components of the rotation vector, of at most 180 deg.

    Attributes:
        directions: unit axes in the parent's site frame.
    """

    directions: tuple[tuple[float, float, float], ...]

    def values(self, rotation: Quaternion, near: float) -> list[float]:
        """Components of h v/n for the quaternion (w, v), with n = |v| and h = 2 atan2(n, w)."""
        (w, a, b, c), n = _shorter_rotation(rotation)
        size = 2.0 * atan2(n, w) / n
        return [size * (a * x + b * y + c * z) for x, y, z in self.directions]

    def gradient(self, rotation: Quaternion, torques: Sequence[float]) -> Quaternion:
        """Gradient of f . (h v/n), with f the sum of torques times directions.

        With respect to w it is -2 (f.v)/(w^2 + n^2); with respect to v it is f h/n perpendicular to
        v and f 2w/(w^2 + n^2) along v.
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


@dataclass(frozen=True)
class CoordinateAngles:
    """Displacements of a chain of several rotations.

    Attributes:
        directions: unit axes of the chain in the parent's site frame.
        law: the joint's law, which knows its chain.
    """

    directions: tuple[tuple[float, float, float], ...]
    law: RotationLaw

    def values(self, rotation: Quaternion, near: float) -> list[float]:
        """Displacements [rad]."""
        return list(self.law.angles(self.directions, _rotation_vector(rotation), FLOATS))

    def gradient(self, rotation: Quaternion, torques: Sequence[float]) -> Quaternion:
        """2 T p/|p|^2 for the torque T of the generalized forces, in the parent's axes."""
        r = _rotation_vector(rotation)
        half_way = self.law.torque_about(self.directions, torques, r, FLOATS)
        x, y, z = (matrix_from_rotation_vector(0.5 * r) @ half_way).tolist()
        factor = 2.0 / sum(part * part for part in rotation)
        return product((0.0, factor * x, factor * y, factor * z), rotation)


def _rotation_vector(rotation: Quaternion) -> Array:
    """Rotation vector of at most 180 deg (3,) [rad] of a quaternion of any length."""
    (w, a, b, c), n = _shorter_rotation(rotation)
    return 2.0 * atan2(n, w) / n * np.array([a, b, c])


def _shorter_rotation(rotation: Quaternion) -> tuple[Quaternion, float]:
    """Return the quaternion or its negative, of at most 180 deg, and the length of its vector."""
    w, a, b, c = rotation
    if w < 0.0:
        w, a, b, c = -w, -a, -b, -c
    return (w, a, b, c), sqrt(a * a + b * b + c * c) + _SINE_OFFSET


@dataclass(frozen=True)
class RelativeRotation:
    """Rotation of a joint.

    Attributes:
        parent: the parent's end.
        child: the child's end.
    """

    parent: JointEnd
    child: JointEnd

    def orientations(
        self, coordinates: Sequence[float]
    ) -> tuple[Quaternion, Quaternion, Quaternion]:
        """Orientations of the parent's site, of the child's, and of the child's in the parent's."""
        parent = product(self.parent.parameters(coordinates), self.parent.site)
        child = product(self.child.parameters(coordinates), self.child.site)
        return parent, child, product(conjugate(parent), child)

    def add_forces(
        self,
        forces: list[float],
        orientations: tuple[Quaternion, Quaternion, Quaternion],
        gradient: Quaternion,
    ) -> None:
        """Add the generalized forces of a gradient with respect to the rotation."""
        parent, child, _ = orientations
        # The rotation is conj(parent) child, and the adjoint of a multiplication is that by the
        # conjugate.
        self.child.add_forces(forces, product(parent, gradient))
        self.parent.add_forces(forces, product(child, conjugate(gradient)))


Vector = tuple[float, float, float]

_MIN_SQUARED_SINE = 1e-12
"""Lower bound of the squared sine of the angle between the outer axes, which avoids a division by
zero; the solver fails there."""


@dataclass(frozen=True)
class JointRates:
    """Rates of the rotations of a chain.

    Attributes:
        chain_axes: unit axes, innermost first.
        middle_axis_sense: 1 or -1, the sign of the middle one of three axes.
    """

    chain_axes: tuple[Vector, ...]
    middle_axis_sense: float

    @classmethod
    def from_chain(cls, chain: Chain, displacements: Array) -> "JointRates":
        """Set up a chain with initial displacements (n,) [rad or m]."""
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
        """Vectors r of the rotations, innermost first, in the parent's axes."""
        if len(self.chain_axes) < 2:
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
        """Angular velocity of the child, parent's axes [rad/s], from angles and rates."""
        total: Vector = (0.0, 0.0, 0.0)
        for axis, angle, rate in zip(self.chain_axes, angles, rates, strict=True):
            x, y, z = axis
            sine = sin(0.5 * angle)
            rotated = _rotate((cos(0.5 * angle), sine * x, sine * y, sine * z), total)
            total = _sum(rotated, _scale(axis, rate))
        return total

    def angular_acceleration(
        self, angles: Sequence[float], rates: Sequence[float], accelerations: Sequence[float]
    ) -> Vector:
        """Derivative of `angular_velocity` [rad/s^2], from angles and their two derivatives."""
        velocity: Vector = (0.0, 0.0, 0.0)
        total: Vector = (0.0, 0.0, 0.0)
        for axis, angle, rate, acceleration in zip(
            self.chain_axes, angles, rates, accelerations, strict=True
        ):
            x, y, z = axis
            sine = sin(0.5 * angle)
            rotation = (cos(0.5 * angle), sine * x, sine * y, sine * z)
            velocity, total = _rotate(rotation, velocity), _rotate(rotation, total)
            turning = _sum(_cross(_scale(axis, rate), velocity), _scale(axis, acceleration))
            velocity, total = _sum(velocity, _scale(axis, rate)), _sum(total, turning)
        return total


def _rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Rotate a vector by a quaternion of any length."""
    w, a, b, c = rotation
    axis = (a, b, c)
    t = _scale(_cross(axis, vector), 2.0 / (w * w + a * a + b * b + c * c))
    u = _cross(axis, t)
    x, y, z = vector
    return x + w * t[0] + u[0], y + w * t[1] + u[1], z + w * t[2] + u[2]


def _cross(first: Vector, second: Vector) -> Vector:
    a, b, c = first
    x, y, z = second
    return b * z - c * y, c * x - a * z, a * y - b * x


def _scale(vector: Vector, factor: float) -> Vector:
    x, y, z = vector
    return factor * x, factor * y, factor * z


def _sum(first: Vector, second: Vector) -> Vector:
    a, b, c = first
    x, y, z = second
    return a + x, b + y, c + z


def _difference(first: Vector, second: Vector) -> Vector:
    a, b, c = first
    x, y, z = second
    return a - x, b - y, c - z
