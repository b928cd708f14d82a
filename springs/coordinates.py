"""Laws of the displacements of a chain of two or three rotations.

R = R3(q3) R2(q2) R1(q1) with axes n1 (innermost, fixed in the child), n2, n3 (outermost, fixed in
the parent), each perpendicular to the next, and n1 perpendicular to n3. H is the turn by r/2. In
the half-way frame, the parent's turned by H, the angular velocity is q1' e1 + q2' e2 + q3' e3 with
e1 = H n1, e3 = H^T n3 and e2 along e3 x e1. A torque with the generalized forces t_i along the
displacements is the sum of the t_i times the vectors that are dual to the e_i.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from math import cos, pi, radians, sin
from operator import add

import numpy as np
from numpy.typing import NDArray

from springs.axis import AxisSpring, Direction
from springs.backends import NUMPY, Operations, Real, Vector
from springs.elastic import total_energy, total_torque
from springs.joint import Singularity
from springs.parts import Parts, combined, cross, dot, half_quaternion, minus, plus, times

POLE_COSINE = 1e-3
"""Least cosine of the middle angle: within 0.06 deg of the pole the dual vectors are bounded, in
torques and rates alike, so that damping dissipates there as well."""

LARGEST_SINE = cos(radians(1.0))
"""Sine of the middle one of three angles, in size, at which a run ends: 1 deg from the pole."""

_PERPENDICULAR = 1e-9

_SURE = 0.99
"""Share of half a turn, and of a quarter, within which an angle is surely the one that is read."""


@dataclass(frozen=True)
class CoordinatesAt:
    """Displacements of a chain at an orientation, and the axes of their rates.

    Attributes:
        angles: Displacements, innermost first [rad].
        vectors: Axes e of the rates in the half-way frame, innermost first.
        sine: Scalar product of the outer axes, minus or plus the sine of the middle angle.
        inverse_square: 1 over the squared cosine of the middle angle, 1 for two rotations.
    """

    angles: tuple[Real, ...]
    vectors: tuple[Parts, ...]
    sine: Real
    inverse_square: Real

    def torque(self, torques: Sequence[Real | None], ops: Operations) -> Vector:
        """Return the torque of generalized forces [N m]; None stands for a force of zero."""
        forces = [0.0 if t is None else t for t in torques]
        if len(forces) == 3:
            inner, middle, outer = forces
            k, s = self.inverse_square, self.sine
            forces = [
                times(k, minus(inner, times(s, outer))),
                middle,
                times(k, minus(outer, times(s, inner))),
            ]
        return ops.vector(combined(*zip(forces, self.vectors, strict=True)))

    def rates(self, rate: Vector, ops: Operations) -> tuple[Real, ...]:
        """Return the rates of the displacements [rad/s] of an angular velocity."""
        parts = (ops.part(rate, 0), ops.part(rate, 1), ops.part(rate, 2))
        along = [dot(parts, axis) for axis in self.vectors]
        if len(along) == 2:
            return tuple(along)
        inner, middle, outer = along
        k, s = self.inverse_square, self.sine
        return k * (inner - s * outer), middle, k * (outer - s * inner)


@dataclass(frozen=True)
class ChainCoordinates:
    """A chain of rotations whose displacements are functions of the orientation.

    Attributes:
        axes: Unit axes, two or three, innermost first.
        middles: Middles of the ranges of the displacements [rad]: an angle is within half a turn of
            its own. That of the middle one of three is within a quarter of a turn of zero.

    Raises:
        ValueError: The outer axes of three are not perpendicular.
    """

    axes: tuple[Direction, ...]
    middles: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the axes."""
        if len(self.axes) == 3 and abs(abs(self._handedness) - 1.0) > _PERPENDICULAR:
            raise ValueError(
                "a law of coordinates needs a chain of three perpendicular axes: with others the "
                "pole is near the start"
            )

    @cached_property
    def _handedness(self) -> float:
        """1 for n1, n2, n3 as x, y, z, else -1."""
        first, second, third = self.axes
        return float(dot(first, cross(second, third)))

    def place(self, direction: Direction) -> tuple[int, float]:
        """Return the index of the rotation about an axis, and 1 or -1 for the opposite axis.

        Raises ValueError where no rotation is about it.
        """
        for index, axis in enumerate(self.axes):
            along = float(dot(axis, direction))
            if abs(abs(along) - 1.0) < _PERPENDICULAR:
                return index, 1.0 if along > 0.0 else -1.0
        raise ValueError("a law of coordinates needs springs about axes of the joint's chain")

    def at(self, r: Vector, ops: Operations) -> CoordinatesAt:
        """Return the displacements at a rotation vector [rad], shape (..., 3)."""
        w, v = half_quaternion(r, ops)
        inner, outer = self.axes[0], self.axes[-1]
        inner_half, inner_in_parent = _turned(inner, w, v, 1.0)
        outer_half, outer_in_child = _turned(outer, w, v, -1.0)
        if len(self.axes) == 2:
            normal = cross(outer, inner)
            angles = (
                self._angle(0, dot(normal, outer_in_child), dot(outer, outer_in_child), ops),
                self._angle(1, dot(normal, inner_in_parent), dot(inner, inner_in_parent), ops),
            )
            return CoordinatesAt(angles, (inner_half, outer_half), 0.0, 1.0)
        sense, middle = round(self._handedness), self.axes[1]
        sine = dot(inner_half, outer_half)
        across = cross(outer_half, inner_half)
        cosine = ops.sqrt(dot(across, across))
        cosine = ops.smooth_where(cosine < POLE_COSINE, POLE_COSINE, cosine)
        angles = (
            self._angle(0, sense * dot(middle, outer_in_child), dot(outer, outer_in_child), ops),
            ops.atan2(-sense * sine, cosine),
            self._angle(2, sense * dot(middle, inner_in_parent), dot(inner, inner_in_parent), ops),
        )
        x, y, z = (sense * part / cosine for part in across)
        return CoordinatesAt(
            angles, (inner_half, (x, y, z), outer_half), sine, 1.0 / (cosine * cosine)
        )

    def reads(self, displacements: NDArray[np.float64]) -> bool:
        """Return whether orientations at displacements surely have these, shape (k, n) [rad].

        They have where an outer angle is within half a turn of its middle, and the middle one of
        three is off the pole.
        """
        centres, bounds = np.array(self.middles), np.full(len(self.middles), pi)
        if len(centres) == 3:
            centres[1], bounds[1] = 0.0, 0.5 * pi
        return bool(np.all(np.abs(displacements.T - centres) < _SURE * bounds))

    def _angle(self, index: int, y: Real, x: Real, ops: Operations) -> Real:
        """Return the angle of a point within half a turn of the middle of the range."""
        middle = self.middles[index]
        if middle == 0.0:
            return ops.atan2(y, x)
        c, s = cos(middle), sin(middle)
        return middle + ops.atan2(c * y - s * x, c * x + s * y)


@dataclass(frozen=True)
class CoordinateLaw:
    """Laws of the displacements of the joint's own chain: each a generalized force along its own.

    Attributes:
        axes: Springs about axes of the chain, in their order; None for an axis without one.
        coordinates: The chain.
    """

    springs: tuple[AxisSpring | None, ...]
    coordinates: ChainCoordinates

    @property
    def axes(self) -> Sequence[AxisSpring]:
        """Springs of the axes."""
        return [spring for spring in self.springs if spring is not None]

    @property
    def is_conservative(self) -> bool:
        """True: the energy is the sum of those of the axes."""
        return True

    @property
    def singularity(self) -> Singularity:
        """The pole of three rotations; two have none."""
        return Singularity.POLE if len(self.springs) == 3 else Singularity.NONE

    def torque(self, r: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the sum of the axes' torques along the dual axes."""
        at = self.coordinates.at(r, ops)
        torques = [
            None if spring is None or not spring.elastic else total_torque(spring.elastic, q, ops)
            for spring, q in zip(self.springs, at.angles, strict=True)
        ]
        return at.torque(torques, ops)

    def energy(self, r: Vector, ops: Operations = NUMPY) -> Real:
        """Return the sum of the axes' energies."""
        at = self.coordinates.at(r, ops)
        terms = [
            total_energy(spring.elastic, q, ops)
            for spring, q in zip(self.springs, at.angles, strict=True)
            if spring is not None and spring.elastic
        ]
        return reduce(add, terms, ops.part(r, 0) * 0.0)

    def damping(self, r: Vector, rate: Vector, ops: Operations = NUMPY) -> Vector:
        """Return the torque of damping of the chain's rates."""
        at = self.coordinates.at(r, ops)
        torques = [
            None if spring is None else spring.resistance(q, v, ops)
            for spring, q, v in zip(self.springs, at.angles, at.rates(rate, ops), strict=True)
        ]
        return at.torque(torques, ops)

    def angles(
        self, directions: Sequence[Direction], r: Vector, ops: Operations = NUMPY
    ) -> Sequence[Real]:
        """Return the displacements about axes of the chain."""
        found = self.coordinates.at(r, ops).angles
        places = map(self.coordinates.place, directions)
        return [sense * found[index] for index, sense in places]

    def torque_about(
        self,
        directions: Sequence[Direction],
        torques: Sequence[Real],
        r: Vector,
        ops: Operations = NUMPY,
    ) -> Vector:
        """Return the torque of generalized forces along the displacements."""
        sums: list[Real | None] = [None] * len(self.springs)
        for direction, torque in zip(directions, torques, strict=True):
            index, sense = self.coordinates.place(direction)
            own = sense * torque
            sums[index] = own if sums[index] is None else sums[index] + own
        return self.coordinates.at(r, ops).torque(sums, ops)


def _turned(axis: Direction, w: Real, v: Parts, sense: float) -> tuple[Parts, Parts]:
    """Return an axis turned by half of a rotation or of its inverse, and by the whole.

    Args:
        axis: Components in the frame in which it is fixed.
        w: Cosine of half the angle of the rotation.
        v: Sine of half the angle, times the axis of the rotation.
        sense: 1 for the rotation, -1 for its inverse.
    """
    once = cross(v, axis)
    twice = cross(v, once)
    g = 1.0 / (1.0 + w)
    half = tuple(
        plus(plus(n, times(sense, c)), times(g, cc))
        for n, c, cc in zip(axis, once, twice, strict=True)
    )
    whole = tuple(
        plus(n, 2.0 * (plus(times(sense, times(w, c)), cc)))
        for n, c, cc in zip(axis, once, twice, strict=True)
    )
    return (half[0], half[1], half[2]), (whole[0], whole[1], whole[2])
