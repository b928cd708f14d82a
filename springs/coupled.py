"""Passive laws over several joints: exponentials of a sum of their angles.

A muscle that spans two joints is stretched by both. Riener & Edrich 1999 and Silder et al. 2007
write the moments of hip, knee and ankle as exponentials of all three angles.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from math import exp, sqrt
from operator import add
from typing import Protocol

from springs.backends import FLOATS, NUMPY, Operations, Real
from springs.elastic import Range, mirror_range
from springs.exponential import Exponential, ExponentialTerm

_PARALLEL_TOLERANCE = 1e-9


class NotConservativeError(ValueError):
    """The torques are no gradient, so that no energy belongs to them."""


class CoupledLaw(Protocol):
    """A law of the angles of several joints."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the angles ("hip flexion"), in the order of all tuples."""
        ...

    @property
    def valid_ranges(self) -> tuple[Range | None, ...]:
        """For each angle the range in which the law is known to hold [rad], or None."""
        ...

    def torques(self, angles: Sequence[Real], ops: Operations = NUMPY) -> tuple[Real, ...]:
        """Torque on the child about each coordinate [N m] at the angles [rad]."""
        ...

    def energy(self, angles: Sequence[Real], ops: Operations = NUMPY) -> Real:
        """Stored energy [J], where one exists; the torques are minus its gradient."""
        ...


@dataclass(frozen=True)
class CoupledTerm:
    """The torques amplitudes * exp(exponent + rates . angles).

    Attributes:
        amplitudes: one a coordinate [N m].
        rates: one a coordinate [1/rad], not all zero.
        exponent: at zero angles.
    """

    amplitudes: tuple[float, ...]
    rates: tuple[float, ...]
    exponent: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a term that does not depend on any angle."""
        if not any(self.rates):
            raise ValueError("the rates of a coupled exponential are not all zero")

    @property
    def energy_amplitude(self) -> float:
        """E in the energy E exp(exponent + rates . angles) of which the torques are the part."""
        dot = sum(a * r for a, r in zip(self.amplitudes, self.rates, strict=True))
        return -dot / sum(r * r for r in self.rates)

    @property
    def is_gradient(self) -> bool:
        """Whether the amplitudes are along the rates, which makes the term a gradient."""
        energy = self.energy_amplitude
        rest = [a + energy * r for a, r in zip(self.amplitudes, self.rates, strict=True)]
        return _norm(rest) <= _PARALLEL_TOLERANCE * _norm(self.amplitudes)


@dataclass(frozen=True)
class CoupledExponential:
    """Torques on the children = constants + sum of the terms.

    Attributes:
        coordinates: names of the angles, in the order of all tuples.
        terms: exponentials.
        constants: one a coordinate [N m].
        valid_ranges: for each coordinate the range in which the law is known to hold [rad], or None.
    """

    coordinates: tuple[str, ...]
    terms: tuple[CoupledTerm, ...]
    constants: tuple[float, ...]
    valid_ranges: tuple[Range | None, ...]

    def __post_init__(self) -> None:
        """Refuse tuples that do not fit the coordinates."""
        count = len(self.coordinates)
        tuples = [self.constants, self.valid_ranges]
        tuples += [part for term in self.terms for part in (term.amplitudes, term.rates)]
        if any(len(part) != count for part in tuples):
            raise ValueError(f"every tuple of this law has {count} entries, one a coordinate")

    def torques(self, angles: Sequence[Real], ops: Operations = NUMPY) -> tuple[Real, ...]:
        """Torque on the child about each coordinate [N m] at the angles [rad]."""
        factors = [_factor(term, angles, ops) for term in self.terms]
        return tuple(
            reduce(
                add,
                [
                    term.amplitudes[i] * factor
                    for term, factor in zip(self.terms, factors, strict=True)
                    if term.amplitudes[i] != 0.0
                ],
                angles[i] * 0.0 + self.constants[i],
            )
            for i in range(len(self.coordinates))
        )

    def torque_jacobian(self, angles: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        """Slope of each torque (row) by each angle [N m/rad] at single angles [rad]."""
        scaled = [(term, _factor(term, angles, FLOATS)) for term in self.terms]
        places = range(len(self.coordinates))
        return tuple(
            tuple(
                sum(t.amplitudes[i] * t.rates[k] * factor for t, factor in scaled) for k in places
            )
            for i in places
        )

    def energy(self, angles: Sequence[Real], ops: Operations = NUMPY) -> Real:
        """Stored energy [J], without the integration constant.

        Raises:
            NotConservativeError: where the torques are no gradient.
        """
        if not self.is_conservative:
            raise NotConservativeError(
                f"the torques about {', '.join(self.coordinates)} are no gradient: "
                "carried round a closed loop of angles they do work"
            )
        constant = [-c * angle for c, angle in zip(self.constants, angles, strict=True)]
        parts = [t.energy_amplitude * _factor(t, angles, ops) for t in self._merged_terms()]
        return reduce(add, [*constant, *parts])

    @property
    def is_conservative(self) -> bool:
        """Whether the torques are a gradient: whether every exponential is one by itself.

        Exponentials of different rates are independent functions, so none can mend another.
        """
        return all(term.is_gradient for term in self._merged_terms())

    def mirrored(self, *coordinates: str) -> "CoupledExponential":
        """The same law when the angles of these coordinates are counted the other way."""
        places = {self._coordinate_index(name) for name in coordinates}
        signs = [-1.0 if i in places else 1.0 for i in range(len(self.coordinates))]
        return CoupledExponential(
            self.coordinates,
            tuple(
                CoupledTerm(_times(signs, t.amplitudes), _times(signs, t.rates), t.exponent)
                for t in self.terms
            ),
            _times(signs, self.constants),
            tuple(mirror_range(m) if i in places else m for i, m in enumerate(self.valid_ranges)),
        )

    def scaled(
        self, scale: float, offsets: Mapping[str, float] | None = None
    ) -> "CoupledExponential":
        """The torques times `scale`; the law moved towards greater angles by `offsets` [rad]."""
        moved = [0.0] * len(self.coordinates)
        for name, offset in (offsets or {}).items():
            moved[self._coordinate_index(name)] = offset
        factors = [scale] * len(self.coordinates)
        return CoupledExponential(
            self.coordinates,
            tuple(
                CoupledTerm(_times(factors, t.amplitudes), t.rates, t.exponent - _dot(t, moved))
                for t in self.terms
            ),
            _times(factors, self.constants),
            tuple(
                known and (known[0] + by, known[1] + by)
                for known, by in zip(self.valid_ranges, moved, strict=True)
            ),
        )

    def hold_coordinate(self, coordinate: str, angle: float) -> "CoupledExponential":
        """The law of the other coordinates while this one is held at `angle` [rad]."""
        place = self._coordinate_index(coordinate)
        kept = [i for i in range(len(self.coordinates)) if i != place]

        def without(values: Sequence[float]) -> tuple[float, ...]:
            return tuple(values[i] for i in kept)

        terms: list[CoupledTerm] = []
        constants = list(without(self.constants))
        for term in self.terms:
            exponent = term.exponent + term.rates[place] * angle
            amplitudes, rates = without(term.amplitudes), without(term.rates)
            if any(rates) and any(amplitudes):
                terms.append(CoupledTerm(amplitudes, rates, exponent))
            else:
                constants = [
                    c + a * exp(exponent) for c, a in zip(constants, amplitudes, strict=True)
                ]
        return CoupledExponential(
            tuple(self.coordinates[i] for i in kept),
            tuple(terms),
            tuple(constants),
            tuple(self.valid_ranges[i] for i in kept),
        )

    def single_angle_law(self, coordinate: str, held_angles: Mapping[str, float]) -> Exponential:
        """The law of one coordinate while all the others are held at their angles [rad]."""
        law = self
        for name in self.coordinates:
            if name != coordinate:
                law = law.hold_coordinate(name, held_angles[name])
        place = law._coordinate_index(coordinate)
        terms = tuple(
            ExponentialTerm(t.amplitudes[0] * exp(t.exponent), t.rates[0]) for t in law.terms
        )
        return Exponential(terms, law.constants[place], law.valid_ranges[place])

    def _coordinate_index(self, coordinate: str) -> int:
        if coordinate not in self.coordinates:
            raise ValueError(
                f"this law has no coordinate `{coordinate}`; it has {', '.join(self.coordinates)}"
            )
        return self.coordinates.index(coordinate)

    def _merged_terms(self) -> tuple[CoupledTerm, ...]:
        """The terms, those of equal rates added into one."""
        sums: dict[tuple[float, ...], list[float]] = {}
        for term in self.terms:
            parts = sums.setdefault(term.rates, [0.0] * len(self.coordinates))
            for i, amplitude in enumerate(term.amplitudes):
                parts[i] += amplitude * exp(term.exponent)
        return tuple(CoupledTerm(tuple(parts), rates) for rates, parts in sums.items())


def _factor(term: CoupledTerm, angles: Sequence[Real], ops: Operations) -> Real:
    parts = [r * angle for r, angle in zip(term.rates, angles, strict=True) if r != 0.0]
    return ops.exp(reduce(add, parts, term.exponent))


def _times(factors: Sequence[float], values: Sequence[float]) -> tuple[float, ...]:
    return tuple(f * v for f, v in zip(factors, values, strict=True))


def _dot(term: CoupledTerm, angles: Sequence[float]) -> float:
    return sum(_times(term.rates, angles))


def _norm(values: Sequence[float]) -> float:
    return sqrt(sum(v * v for v in values))
