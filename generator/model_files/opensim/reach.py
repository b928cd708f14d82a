"""The reach of a limb as lengths of paths, functions of the angles of its joint.

With the limb's direction d, the centre c of the reach, the side n of the azimuth 0 and m = c x n,

    C = d.c = cos(theta),  A = d.n = sin(theta) cos(phi),  B = d.m = sin(theta) sin(phi)

are sums of products of cosines and sines of the joint's angles, and so are w and u, of half the
angles: the scalar and the part along c of the rotation from the limb at the centre, of which the
turn is 2 atan2(u, w). The lengths are the angles beyond the ends: theta - r(phi), turn - upper and
lower - turn.

OpenSim evaluates no part of an expression once for all, and differentiates each function when it
reads the file. Therefore harmonics are written by amplitude and phase, and moment arms by the
slopes of A, B and C. The turn's slope by a rotation about an axis a is a.(c + d)/(1 + C).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan2, cos, hypot, pi, sin

import numpy as np

from generator.model_files.opensim.expression import ZERO, Expression, sum_of_products
from generator.model_files.opensim.rotation import RotationExpressions
from generator.rotations import Array, cross_matrix, unit_vector
from springs import Reach
from springs.elastic import Elastic
from springs.reach import Quadratic

_LEAST_SINE = 1e-6
"""Sine of the angle from the centre below which the azimuth has no slope."""

_NO_DIVISION_BY_ZERO = 1e-30
"""Added to a number that may be zero, and else is far larger."""


@dataclass(frozen=True)
class ReachLength:
    """An angle beyond an end of a reach, as the length of a path.

    Attributes:
        label: Label of the end, for the name of its force.
        law: Elastic laws of the angle.
        length: The angle [rad].
        arms: Minus its slopes by the angles of the joint.
    """

    label: str
    law: tuple[Elastic, ...]
    length: Expression
    arms: tuple[Expression, ...]


@dataclass(frozen=True)
class ReachExpressions:
    """Functions of the angles of a joint with a reach, as expressions.

    Attributes:
        reach: The reach.
        rotation: The rotation of the joint.
    """

    reach: Reach
    rotation: RotationExpressions

    def lengths(self) -> Iterator[ReachLength]:
        """Yield the angles beyond the ends that have laws."""
        fit, turn = self.reach.fit, self.reach.turn.elastic
        count = range(len(self.rotation.angles))
        if self.reach.beyond.elastic:
            (constant, _), *terms = fit.boundary
            boundary, slope = _harmonics(constant, terms)
            arms = [slope * self._slope(_PHI, k) - self._slope(_THETA, k) for k in count]
            yield ReachLength("reach", self.reach.beyond.elastic, _THETA - boundary, tuple(arms))
        if self.reach.turns and turn:
            ends = (("turn_upper", fit.upper, 1.0), ("turn_lower", fit.lower, -1.0))
            for label, quadratic, sign in ends:
                end, by_theta, by_phi = _end(quadratic)
                slopes = [
                    by_theta * self._slope(_THETA, k)
                    + by_phi * self._slope(_PHI, k)
                    - self._slope(_TURN, k)
                    for k in count
                ]
                arms = tuple(sign * slope for slope in slopes)
                yield ReachLength(label, turn, sign * (_TURN - end), arms)

    def _slope(self, of: Expression, index: int) -> Expression:
        """Return the slope of theta, phi or the turn by an angle, 0 where it has none."""
        return _name_of_slope(of, index) if self._slopes[of, index] != ZERO else ZERO

    @cached_property
    def definitions(self) -> Mapping[str, Expression]:
        """Definitions of the names in the expressions, each before those that it needs."""
        fit = self.reach.fit
        middle = 0.25 * (fit.lower[0] + fit.upper[0])
        local = 0.5 * (_end(fit.lower)[0] + _end(fit.upper)[0])
        c, s = cos(middle), sin(middle)
        w0, v0 = fit.start[0], np.array(fit.start[1])
        along, across = float(v0 @ fit.centre), w0 * np.array(fit.centre) + np.cross(v0, fit.centre)
        # Quaternions whose products with that of the joint are c u - s w and c w + s u.
        over, under = (
            (c * along - s * w0, c * across + s * v0),
            (c * w0 + s * along, s * across - c * v0),
        )
        return {
            # The turn within half of one from the middle of its range in this direction.
            _TURN.text: _ANY_TURN
            + 2.0 * pi * _step(local - _ANY_TURN - pi)
            - 2.0 * pi * _step(_ANY_TURN - local - pi),
            _ANY_TURN.text: 2.0 * middle
            + 2.0
            * _atan(self.rotation.quaternion_part(*over) / self.rotation.quaternion_part(*under)),
            **{
                _name_of_slope(of, index).text: slope for (of, index), slope in self._slopes.items()
            },
            _PHI.text: _atan(_B / (_A + _NO_DIVISION_BY_ZERO)) + pi * (1.0 - _step(_A)),
            _THETA.text: 2.0 * _atan(_S / (1.0 + _C)),
            _S.text: Expression(f"sqrt(max({(_A * _A + _B * _B).text},{_LEAST_SINE**2!r}))"),
            **{name.text: self._text(part) for name, part in self._parts.items()},
            **{
                f"{letter}{angle}": Expression(f"{function}({angle})")
                for angle in self.rotation.angles
                for letter, function in _FUNCTIONS
            },
            **self.rotation.half_angles,
        }

    @cached_property
    def _slopes(self) -> Mapping[tuple[Expression, int], Expression]:
        """Slopes of the turn, phi and theta by each angle."""
        found: dict[tuple[Expression, int], Expression] = {}
        centre = np.array(self.reach.fit.centre)
        for k, axis in enumerate(self._axes):
            da, db, dc = (self._text(_slope(self._parts[one], k)) for one in (_A, _B, _C))
            found[_THETA, k] = ZERO if dc == ZERO else -1.0 * dc / _S
            around = _A * db - _B * da
            found[_PHI, k] = ZERO if around == ZERO else around / (_S * _S)
            about = np.tensordot(centre, axis, axes=1) + self._direction_along(k)
            found[_TURN, k] = self._text(about) / (1.0 + _C)
        return found

    @cached_property
    def _parts(self) -> Mapping[Expression, Array]:
        """Coefficients of the parts of the limb's direction along the centre and across it."""
        fit = self.reach.fit
        axes = {_A: fit.zero, _B: fit.second, _C: fit.centre}
        turned = self._turned(range(len(self.rotation.axes)), np.array(self.reach.long_axis))
        return {name: np.tensordot(axis, turned, axes=1) for name, axis in axes.items()}

    @property
    def _axes(self) -> Iterator[Array]:
        """Axes of the rotations in the parent, coefficients of shape (3, 3, ...)."""
        count = len(self.rotation.axes)
        for k, axis in enumerate(self.rotation.axes):
            yield self._turned(range(k + 1, count), unit_vector(axis))

    def _direction_along(self, index: int) -> Array:
        """Coefficients of the limb's direction along the axis of a rotation."""
        turned = self._turned(range(index), np.array(self.reach.long_axis))
        return np.tensordot(unit_vector(self.rotation.axes[index]), turned, axes=1)

    def _turned(self, indices: Sequence[int], vector: Array) -> Array:
        """Coefficients of a vector that some of the rotations turn, shape (3, 3, ...).

        The places of an angle are 1, its cosine and its sine.
        """
        found: Array = vector
        for k, axis in enumerate(self.rotation.axes):
            across = cross_matrix(unit_vector(axis))
            square = across @ across
            matrices = [np.eye(3) + square, -square, across]
            if k not in indices:
                matrices = [np.eye(3), np.zeros((3, 3)), np.zeros((3, 3))]
            found = np.stack([np.tensordot(one, found, axes=1) for one in matrices], axis=-1)
        return found

    def _text(self, coefficients: Array) -> Expression:
        """Return a sum of products of a cosine or a sine of each angle."""
        return sum_of_products(coefficients, [("", f"C{q}", f"S{q}") for q in self.rotation.angles])


_FUNCTIONS = (("C", "cos"), ("S", "sin"))
_A, _B, _C, _S = map(Expression, ("dn", "dm", "dc", "across"))
_THETA, _PHI, _TURN, _ANY_TURN = map(Expression, ("theta", "phi", "turn", "any_turn"))


def _name_of_slope(of: Expression, index: int) -> Expression:
    return Expression(f"{of.text}_{index + 1}")


def _slope(coefficients: Array, index: int) -> Array:
    """Coefficients of the slope by an angle."""
    _, cosine, sine = np.moveaxis(coefficients, index, 0)
    return np.stack([np.zeros_like(sine), sine, -cosine], axis=index)


def _harmonics(
    constant: float, terms: Sequence[tuple[float, float]]
) -> tuple[Expression, Expression]:
    """Return a sum of harmonics of the azimuth, and its slope."""
    value, slope = ZERO + constant, ZERO
    for number, (a, b) in enumerate(terms, 1):
        phase = f"({number}*{_PHI.text}-({atan2(b, a)!r}))"
        value = value + hypot(a, b) * Expression(f"cos{phase}")
        slope = slope - number * hypot(a, b) * Expression(f"sin{phase}")
    return value, slope


def _end(quadratic: Quadratic) -> tuple[Expression, Expression, Expression]:
    """Return an end of the turn, and its slopes by theta and by the azimuth."""
    k0, k1, k2, k11, k12, k22 = quadratic
    one, one_slope = _harmonics(0.0, [(k1, k2)])
    two, two_slope = _harmonics(0.5 * (k11 + k22), [(0.0, 0.0), (0.5 * (k11 - k22), 0.5 * k12)])
    value = k0 + _THETA * (one + _THETA * two)
    by_theta = one + 2.0 * (_THETA * two)
    by_phi = _THETA * (one_slope + _THETA * two_slope)
    return value, by_theta, by_phi


def _step(value: Expression) -> Expression:
    """Return 1 where a value is positive, else 0."""
    return Expression(f"step({value.text})")


def _atan(value: Expression) -> Expression:
    return Expression(f"atan({value.text})")
