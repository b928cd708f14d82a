"""Sums of exponentials of one angle: the double exponentials of most published passive moments.

`tangent_exp` and its integral continue an exponential along its tangent.
"""

from dataclasses import dataclass, replace
from functools import reduce
from operator import add

from springs.backends import NUMPY, Operations, Real
from springs.elastic import Range, mirror_range


def tangent_exp(exponent: Real, end: float | None, ops: Operations = NUMPY) -> Real:
    """Exponential of an exponent; beyond `end`, if there is one, the tangent there."""
    if end is None:
        return ops.exp(exponent)
    known = ops.smooth_where(exponent < end, exponent, end)
    return ops.exp(known) * (1.0 + (exponent - known))


def tangent_exp_integral(exponent: Real, end: float | None, ops: Operations = NUMPY) -> Real:
    """Integral of `tangent_exp` over the exponent, which is the exponential itself up to `end`."""
    if end is None:
        return ops.exp(exponent)
    known = ops.smooth_where(exponent < end, exponent, end)
    beyond = exponent - known
    return ops.exp(known) * (1.0 + beyond * (1.0 + 0.5 * beyond))


@dataclass(frozen=True)
class ExponentialTerm:
    """amplitude * exp(rate * (angle - centre)).

    amplitude [N m], the torque at the centre; rate [1/rad], not zero; centre [rad]; end, the
    exponent beyond which the exponential continues along its tangent, or None.
    """

    amplitude: float
    rate: float
    centre: float = 0.0
    end: float | None = None

    def __post_init__(self) -> None:
        """Refuse a term that does not depend on the angle."""
        if self.rate == 0.0:
            raise ValueError("the rate of an exponential is not zero: write a constant instead")


@dataclass(frozen=True)
class Exponential:
    """Torque on the child = constant + sum of the terms.

    Attributes:
        terms: two for a double exponential, one for each end of the range.
        constant: [N m].
        valid_range: range in which the curve is known to hold [rad], or None.
    """

    terms: tuple[ExponentialTerm, ...]
    constant: float = 0.0
    valid_range: Range | None = None

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] at `angle` [rad]."""
        parts = [
            t.amplitude * tangent_exp(t.rate * (angle - t.centre), t.end, ops) for t in self.terms
        ]
        return reduce(add, parts, angle * 0.0 + self.constant)

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J], without the integration constant; the torque is minus its slope."""
        parts = [
            -t.amplitude / t.rate * tangent_exp_integral(t.rate * (angle - t.centre), t.end, ops)
            for t in self.terms
        ]
        return reduce(add, parts, -self.constant * angle)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Angles at which a term passes into its tangent."""
        return tuple(t.centre + t.end / t.rate for t in self.terms if t.end is not None)

    def mirrored(self) -> "Exponential":
        """The law of the same joint when its angle is counted the other way."""
        terms = tuple(ExponentialTerm(-t.amplitude, -t.rate, -t.centre, t.end) for t in self.terms)
        return replace(
            self, terms=terms, constant=-self.constant, valid_range=mirror_range(self.valid_range)
        )
