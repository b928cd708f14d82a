"""Passive laws over several joints: exponentials of a sum of their angles.

A muscle that spans two joints is stretched by both. Riener & Edrich 1999 and Silder et al. 2007
write the moments of hip, knee and ankle as exponentials of all three angles.

Torques measured joint by joint and fitted separately need not be the gradient of one energy: a
closed loop of angles may then yield work. `loop_work` measures it, and `nearest_conservative_law`
returns the nearest law of the same form that has an energy.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import product
from math import exp, sqrt
from operator import add
from typing import Protocol, cast

import numpy as np

from springs.backends import FLOATS, NUMPY, Array, Operations, Real
from springs.elastic import Range, mirror_range
from springs.exponential import (
    Exponential,
    ExponentialTerm,
    tangent_exp,
    tangent_exp_integral,
)

_PARALLEL_TOLERANCE = 1e-9


class NotConservativeError(ValueError):
    """The torques are not a gradient and have no energy."""


@dataclass(frozen=True)
class CoupledTerm:
    """The torques amplitudes * exp(exponent + rates . angles).

    Attributes:
        amplitudes: one a coordinate [N m].
        rates: one a coordinate [1/rad], not all zero.
        exponent: exponent at zero angles.
        end: greatest exponent + rates . angles of the exponential, which continues along its
            tangent; None without one. A gradient stays one.
    """

    amplitudes: tuple[float, ...]
    rates: tuple[float, ...]
    exponent: float = 0.0
    end: float | None = None

    def __post_init__(self) -> None:
        """Refuse a term that does not depend on any angle."""
        if not any(self.rates):
            raise ValueError("the rates of a coupled exponential are not all zero")

    @property
    def energy_amplitude(self) -> float:
        """E in the energy E exp(exponent + rates . angles) of which the torques are the part."""
        dot = sum(a * r for a, r in zip(self.amplitudes, self.rates, strict=True))
        return -dot / sum(r * r for r in self.rates)

    def value(self, angles: Sequence[Real], ops: Operations = NUMPY) -> Real:
        """Factor of the amplitudes at the angles [rad]."""
        return tangent_exp(self._exponent_at(angles), self.end, ops)

    def slope(self, angles: Sequence[float]) -> float:
        """Slope of the factor by its exponent at single angles [rad]."""
        exponent = self._exponent_at(angles)
        return FLOATS.exp(exponent if self.end is None else min(exponent, self.end))

    def integral(self, angles: Sequence[Real], ops: Operations = NUMPY) -> Real:
        """Integral of the factor over its exponent at the angles [rad]."""
        return tangent_exp_integral(self._exponent_at(angles), self.end, ops)

    def _exponent_at(self, angles: Sequence[Real]) -> Real:
        parts = [r * angle for r, angle in zip(self.rates, angles, strict=True) if r != 0.0]
        return reduce(add, parts, self.exponent)

    @property
    def is_gradient(self) -> bool:
        """True where the amplitudes are parallel to the rates, so that the term is a gradient."""
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
        valid_ranges: valid ranges for each coordinate the range in which the law is valid [rad], or
            None.
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
        factors = [term.value(angles, ops) for term in self.terms]
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
        scaled = [(term, term.slope(angles)) for term in self.terms]
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
            NotConservativeError: where the torques are not a gradient.
        """
        if not self.is_conservative:
            raise NotConservativeError(
                f"the torques about {', '.join(self.coordinates)} are not a gradient: "
                "round a closed loop of angles they do work"
            )
        constant = [-c * angle for c, angle in zip(self.constants, angles, strict=True)]
        parts = [t.energy_amplitude * t.integral(angles, ops) for t in self._merged_terms()]
        return reduce(add, [*constant, *parts])

    @property
    def is_conservative(self) -> bool:
        """True where the torques are a gradient, which every exponential must then be by itself.

        Exponentials of different rates are independent functions and cannot compensate.
        """
        return all(term.is_gradient for term in self._merged_terms())

    def mirrored(self, *coordinates: str) -> "CoupledExponential":
        """The same law when the angles of these coordinates are counted the other way."""
        places = {self._coordinate_index(name) for name in coordinates}
        signs = [-1.0 if i in places else 1.0 for i in range(len(self.coordinates))]
        return CoupledExponential(
            self.coordinates,
            tuple(
                replace(t, amplitudes=_times(signs, t.amplitudes), rates=_times(signs, t.rates))
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
                replace(
                    t,
                    amplitudes=_times(factors, t.amplitudes),
                    exponent=t.exponent - _dot(t, moved),
                )
                for t in self.terms
            ),
            _times(factors, self.constants),
            tuple(
                known and (known[0] + by, known[1] + by)
                for known, by in zip(self.valid_ranges, moved, strict=True)
            ),
        )

    def scaled_at(self, coordinates: Collection[str], scale: float) -> "CoupledExponential":
        """Every exponential that depends on one of the coordinates, and their constants, scaled.

        All torques of such an exponential are scaled, so that a gradient stays one.
        """
        changed = {self._coordinate_index(name) for name in coordinates}
        return replace(
            self,
            terms=tuple(
                replace(t, amplitudes=tuple(scale * a for a in t.amplitudes))
                if any(t.rates[i] for i in changed)
                else t
                for t in self.terms
            ),
            constants=tuple(scale * c if i in changed else c for i, c in enumerate(self.constants)),
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
                terms.append(CoupledTerm(amplitudes, rates, exponent, term.end))
            else:
                factor = tangent_exp(exponent, term.end, FLOATS)
                constants = [c + a * factor for c, a in zip(constants, amplitudes, strict=True)]
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
            ExponentialTerm(
                t.amplitudes[0] * exp(t.exponent),
                t.rates[0],
                end=None if t.end is None else t.end - t.exponent,
            )
            for t in law.terms
        )
        return Exponential(terms, law.constants[place], law.valid_ranges[place])

    def _coordinate_index(self, coordinate: str) -> int:
        if coordinate not in self.coordinates:
            raise ValueError(
                f"this law has no coordinate `{coordinate}`; it has {', '.join(self.coordinates)}"
            )
        return self.coordinates.index(coordinate)

    def _merged_terms(self) -> tuple[CoupledTerm, ...]:
        """The terms, those of equal rates and ends added into one."""
        sums: dict[tuple[tuple[float, ...], float | None], list[float]] = {}
        for term in self.terms:
            end = None if term.end is None else term.end - term.exponent
            parts = sums.setdefault((term.rates, end), [0.0] * len(self.coordinates))
            for i, amplitude in enumerate(term.amplitudes):
                parts[i] += amplitude * exp(term.exponent)
        return tuple(
            CoupledTerm(tuple(parts), rates, 0.0, end) for (rates, end), parts in sums.items()
        )


def _times(factors: Sequence[float], values: Sequence[float]) -> tuple[float, ...]:
    return tuple(f * v for f, v in zip(factors, values, strict=True))


def _dot(term: CoupledTerm, angles: Sequence[float]) -> float:
    return sum(_times(term.rates, angles))


def _norm(values: Sequence[float]) -> float:
    return sqrt(sum(v * v for v in values))


_GAUSS_NODES = 32
"""Gauss-Legendre nodes for an angle: with them the integrals of the published laws are exact."""


class HasTorques(Protocol):
    """A source of torques about several angles: a law, or a model that has one."""

    def torques(self, angles: Sequence[Real], /) -> tuple[Real, ...]:
        """Torque on the child about each coordinate [N m] at the angles [rad]."""
        ...


def loop_work(law: HasTorques, rectangle: tuple[Range, Range]) -> float:
    """Work of a law of two angles along a rectangle of them, once round [J].

    The loop runs from the lower ends along the first angle, then along the second, and back the
    same way; the other way round the work has the other sign. A gradient does none.

    Args:
        law: law of two coordinates.
        rectangle: lower and upper end of each angle [rad].
    """
    first, second = rectangle

    def along(place: int, other: float) -> float:
        angles, weights = gauss_nodes(rectangle[place])
        fixed = np.full_like(angles, other)
        pair = (angles, fixed) if place == 0 else (fixed, angles)
        return float(weights @ law.torques(pair)[place])

    there = along(0, second[0]) + along(1, first[1])
    return there - along(0, second[1]) - along(1, first[0])


@dataclass(frozen=True)
class ConservativeFit:
    """The conservative law of the same exponentials nearest to a law, and their differences.

    Attributes:
        law: the conservative law.
        rms_difference: root mean square over the box of the difference in each torque [N m].
        max_difference: largest difference in each torque at the nodes of the box [N m].
    """

    law: CoupledExponential
    rms_difference: tuple[float, ...]
    max_difference: tuple[float, ...]


def nearest_conservative_law(law: CoupledExponential, box: Sequence[Range]) -> ConservativeFit:
    """Find the energy, among a law's own exponentials, whose gradient is nearest to its torques.

    U minimises the integral over the box of |T + grad U|^2, where T are the torques. Over all
    functions U the minimum is the gradient part of T (Helmholtz): the remainder has no divergence
    and no flux through the faces. U is sought among

        sum of e_r exp(r . angles) - sum of c_i angle_i

    where r are the rates of the law and their parts along single coordinates. So the nearest law
    keeps the published form: a law that is a gradient is returned unchanged, and so are terms that
    are gradients. grad U is linear in e and c, so
    they solve one linear least-squares problem on Gauss-Legendre nodes, whose weights make sums
    of squares integrals. Each column is scaled to length one first. Another energy may come nearer:
    for Riener & Edrich's hip and knee the least over all U is smaller by 11 % (the tests find it).

    Args:
        law: law of any number of coordinates.
        box: box for each coordinate the range to fit over [rad].
    """
    nodes = [gauss_nodes(side) for side in box]
    angles = [grid.ravel() for grid in np.meshgrid(*(n for n, _ in nodes), indexing="ij")]
    weights = np.ones(1)
    for _, one in nodes:
        weights = np.multiply.outer(weights, one / one.sum()).ravel()
    root: Array = np.sqrt(weights)
    basis = _gradient_basis(law)
    columns = np.array([_stacked_torques(one, angles, root) for one in basis]).T
    lengths = np.sqrt(np.sum(columns**2, axis=0))
    target = _stacked_torques(law, angles, root)
    solution = cast("Array", np.linalg.lstsq(columns / lengths, target)[0])
    factors: list[float] = (solution / lengths).tolist()
    parts = [one.scaled(factor) for one, factor in zip(basis, factors, strict=True)]
    nearest = CoupledExponential(
        law.coordinates,
        tuple(term for part in parts for term in part.terms),
        tuple(map(sum, zip(*(part.constants for part in parts), strict=True))),
        law.valid_ranges,
    )
    pairs = zip(nearest.torques(angles), law.torques(angles), strict=True)
    differences: list[Array] = [one - other for one, other in pairs]
    with np.errstate(over="ignore"):  # then it is infinite
        rms = tuple(sqrt(float(weights @ d**2)) for d in differences)
    return ConservativeFit(nearest, rms, tuple(float(np.abs(d).max()) for d in differences))


def _gradient_basis(law: CoupledExponential) -> list[CoupledExponential]:
    """Basis of gradients: exponentials of unit energy and unit constant torques."""
    count = len(law.coordinates)
    rates = [term.rates for term in law.terms]
    rates += [
        tuple(rate if j == i else 0.0 for j, rate in enumerate(term.rates))
        for term, i in product(law.terms, range(count))
    ]
    none = (0.0,) * count
    terms = [CoupledTerm(tuple(-r for r in one), one) for one in dict.fromkeys(rates) if any(one)]
    units = [tuple(1.0 if j == i else 0.0 for j in range(count)) for i in range(count)]
    made = [CoupledExponential(law.coordinates, (term,), none, law.valid_ranges) for term in terms]
    return made + [
        CoupledExponential(law.coordinates, (), unit, law.valid_ranges) for unit in units
    ]


def _stacked_torques(law: CoupledExponential, angles: list[Array], root: Array) -> Array:
    """All weighted torques at all nodes in one column; its sum of squares is an integral."""
    return np.concatenate([root * torque for torque in law.torques(angles)])


def gauss_nodes(side: Range, count: int = _GAUSS_NODES) -> tuple[Array, Array]:
    """Nodes and weights of Gauss-Legendre integration over a range, in its unit."""
    x, weights = np.polynomial.legendre.leggauss(count)
    half = 0.5 * (side[1] - side[0])
    return side[0] + half * (x + 1.0), half * weights
