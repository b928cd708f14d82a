"""The rotation of a joint as expressions of its angles, for laws of the rotation vector.

With the quaternion (w, v) of the child in the parent, a polynomial of cosines and sines of half the
angles, the rotation vector is r = 2 atan(|v|/w)/|v| v, and a rate of an angle turns the child at
2 (s v' - w' v/(1 + |w|)) in the half-way frame: primes are slopes by the angle, s is the sign of w.
Both are the same for (-w, -v), so that they belong to the shortest rotation.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from generator.figure import Vector
from generator.model_files.opensim.expression import ZERO, Expression, sum_of_products
from generator.rotations import Array, unit_axis, unit_vector
from generator.springs_file.axes import parallel_sign
from springs.axis import Direction

_MIN_SQUARED_SINE = 1e-12
"""Of half the angle of rotation: below it, 2 atan(S/w)/S differs from 2 by less than 1e-12."""


@dataclass(frozen=True)
class RotationExpressions:
    """Functions of the angles of a joint, as expressions.

    Attributes:
        axes: axes of the rotations, innermost first; in the frames of the joint.
        angles: names of the angles.
        suffix: suffix of the names that are defined, to distinguish joints in one expression.
        has_coordinates: True for laws that read the angles themselves, not the rotation vector.
    """

    axes: tuple[Vector, ...]
    angles: tuple[str, ...]
    suffix: str = ""
    has_coordinates: bool = False

    @cached_property
    def definitions(self) -> Mapping[str, Expression]:
        """Definitions of the names in the expressions, each before those that it needs."""
        if self.has_coordinates:
            return {}
        w, sine = self._name("w"), self._name("S")
        return {
            self._name("f").text: Expression(f"2*atan({sine.text}/{w.text})/{sine.text}"),
            sine.text: Expression(f"sqrt(max(1-{w.text}*{w.text},{_MIN_SQUARED_SINE!r}))"),
            self._name("sign").text: Expression(f"(2*step({w.text})-1)"),
            w.text: self._polynomial(self._quaternion[0]),
            **self.half_angles,
        }

    @property
    def half_angles(self) -> Mapping[str, Expression]:
        """Definitions of cosine and sine of half of each angle."""
        return {
            f"{letter}_{angle}": Expression(f"{function}(0.5*{angle})")
            for angle in self.angles
            for letter, function in (("c", "cos"), ("s", "sin"))
        }

    def component(self, direction: Direction) -> Expression:
        """Angle about a direction [rad]: the component of the rotation vector, or of a hinge."""
        if len(self.axes) == 1 or self.has_coordinates:
            senses = map(self._sense, [direction] * len(self.axes), range(len(self.axes)))
            index, sense = next((k, sense) for k, sense in enumerate(senses) if sense)
            return sense * Expression(self.angles[index])
        return self._name("f") * self._vector_part(direction)

    def component_slope(self, direction: Direction, index: int) -> Expression:
        """Slope of the angle about a direction by an angle of the joint."""
        if len(self.axes) == 1 or self.has_coordinates:
            return ZERO + self._sense(direction, index)
        f, sine, w = self._name("f"), self._name("S"), self._name("w")
        growth = (w * f - 2.0) / (sine * sine)
        across = self._vector_part(direction) * self._polynomial(self._slope(index)[0])
        return f * self._vector_slope(direction, index) + growth * across

    def turn_rate(self, direction: Direction, index: int) -> Expression:
        """Angular velocity about a direction in the half-way frame for a unit rate of an angle."""
        w, sign = self._name("w"), self._name("sign")
        across = self._vector_part(direction) * self._polynomial(self._slope(index)[0])
        slope = self._vector_slope(direction, index)
        return 2.0 * (sign * slope - across / (1.0 + Expression(f"abs({w.text})")))

    def quaternion_part(self, w: float, v: ArrayLike) -> Expression:
        """Scalar product of the quaternion of the rotation and another one."""
        return self._polynomial(np.tensordot([w, *np.asarray(v)], self._quaternion, axes=1))

    def signed_angle(self, direction: Direction) -> Expression:
        """Angle of the rotation [rad], negative for one against a direction."""
        w, sine, along = self._name("w"), self._name("S"), self._vector_part(direction)
        sense = Expression(f"(2*step({(w * along).text})-1)")
        return sense * Expression(f"2*atan({sine.text}/abs({w.text}))")

    def alignment(self, direction: Direction) -> Expression:
        """Size of the cosine of the angle between the axis of the rotation and a direction."""
        return Expression(f"abs({self._vector_part(direction).text})") / self._name("S")

    def _sense(self, direction: Direction, index: int) -> float:
        """1 for a direction along an axis, -1 against it, else 0."""
        return float(parallel_sign(direction, unit_axis(self.axes[index])))

    def _name(self, word: str) -> Expression:
        return Expression(f"{word}{self.suffix}")

    def _vector_part(self, direction: Direction) -> Expression:
        return self._polynomial(np.tensordot(direction, self._quaternion[1:], axes=1))

    def _vector_slope(self, direction: Direction, index: int) -> Expression:
        return self._polynomial(np.tensordot(direction, self._slope(index)[1:], axes=1))

    @cached_property
    def _quaternion(self) -> Array:
        """Coefficients of w and v, shape (4, 2 ...): 0 cosine, 1 sine of an angle."""
        whole: Array = np.array([1.0, 0.0, 0.0, 0.0])
        for axis in self.axes:
            whole = np.stack([whole, _turned_about(unit_vector(axis), whole)], axis=-1)
        return whole

    def _slope(self, index: int) -> Array:
        """Coefficients of the slopes of w and v by an angle."""
        place = 1 + index
        cosine, sine = np.moveaxis(self._quaternion, place, 0)
        return np.stack([0.5 * sine, -0.5 * cosine], axis=place)

    def _polynomial(self, coefficients: Array) -> Expression:
        """Sum of products of a cosine or a sine of each angle."""
        return sum_of_products(coefficients, [(f"c_{q}", f"s_{q}") for q in self.angles])


def _turned_about(axis: Array, quaternion: Array) -> Array:
    """Product of the quaternion (0, axis) and another, shape (4, ...)."""
    w, v = quaternion[0], quaternion[1:]
    scalar = -np.tensordot(axis, v, axes=1)
    across: Array = np.cross(axis, v, axisb=0, axisc=0)
    return np.concatenate([[scalar], np.multiply.outer(axis, w) + across])
