"""How far a coupled law is from a gradient, and the nearest law of its form that is one.

Torques measured joint by joint and fitted apart need not be the gradient of one energy. Then a
closed loop of angles yields work, and a joint moved round it again and again would be a motor.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import sqrt
from typing import cast

import numpy as np

from springs.coupled import CoupledExponential, CoupledLaw, CoupledTerm
from springs.measured import Range
from springs.operations import Array

_NODES = 32
"""Gauss-Legendre nodes for an angle: with them the integrals of the published laws are exact."""


def loop_work(law: CoupledLaw, rectangle: tuple[Range, Range]) -> float:
    """Work of a law of two angles carried once round a rectangle of them [J].

    The loop runs from the lower ends along the first angle, then along the second, and back the
    same way; the other way round the work has the other sign. A gradient does none.

    Args:
        law: of two coordinates.
        rectangle: lower and upper end of each angle [rad].
    """
    first, second = rectangle

    def along(place: int, other: float) -> float:
        angles, weights = _nodes(rectangle[place])
        held = np.full_like(angles, other)
        pair = (angles, held) if place == 0 else (held, angles)
        return float(weights @ law.torques(pair)[place])

    there = along(0, second[0]) + along(1, first[1])
    return there - along(0, second[1]) - along(1, first[0])


@dataclass(frozen=True)
class Nearest:
    """The conservative law of another's exponentials nearest to it, and the distance of the two.

    Attributes:
        law: the conservative law.
        rms: root mean square over the box of the difference in each torque [N m].
        largest: largest difference in each torque at the nodes of the box [N m].
    """

    law: CoupledExponential
    rms: tuple[float, ...]
    largest: tuple[float, ...]


def nearest_conservative(law: CoupledExponential, box: Sequence[Range]) -> Nearest:
    """The energy, among a law's own exponentials, whose gradient is nearest to its torques.

    Nearest is meant in least squares over a box.

    Wanted is U that makes the integral over the box of |T + grad U|^2 least, T being the torques.
    Over all functions U the answer is the gradient part of T (Helmholtz): what is left of T has no
    divergence, and nothing of it crosses the faces. Here U is sought among

        sum of e_r exp(r . angles) - sum of c_i angle_i

    r running over the rates of the law itself and over their parts along single coordinates. That
    keeps the nearest law of the published form: where the law is a gradient already the answer is
    the law, and where only some terms are, those stay as they are. grad U is linear in e and c, so
    they come from one linear least-squares problem on Gauss-Legendre nodes, whose weights make sums
    of squares integrals. Each column is scaled to length one first. Another energy may come nearer:
    for Riener & Edrich's hip and knee the least over all U is smaller by 11 % (the tests find it).

    Outside the box nothing is fitted: extrapolation is as uncertain as that of the law.

    Args:
        law: of any number of coordinates.
        box: for each coordinate the range to fit over [rad].
    """
    nodes = [_nodes(side) for side in box]
    angles = [grid.ravel() for grid in np.meshgrid(*(n for n, _ in nodes), indexing="ij")]
    weights = np.ones(1)
    for _, one in nodes:
        weights = np.multiply.outer(weights, one / one.sum()).ravel()
    root: Array = np.sqrt(weights)
    basis = _basis(law)
    columns = np.array([_weighted(one, angles, root) for one in basis]).T
    lengths = np.sqrt(np.sum(columns**2, axis=0))
    target = _weighted(law, angles, root)
    solution = cast("Array", np.linalg.lstsq(columns / lengths, target)[0])
    factors: list[float] = (solution / lengths).tolist()
    parts = [one.scaled(factor) for one, factor in zip(basis, factors, strict=True)]
    nearest = CoupledExponential(
        law.coordinates,
        tuple(term for part in parts for term in part.terms),
        tuple(map(sum, zip(*(part.constants for part in parts), strict=True))),
        law.measured,
    )
    pairs = zip(nearest.torques(angles), law.torques(angles), strict=True)
    differences: list[Array] = [one - other for one, other in pairs]
    return Nearest(
        nearest,
        tuple(sqrt(float(weights @ d**2)) for d in differences),
        tuple(float(np.abs(d).max()) for d in differences),
    )


def _basis(law: CoupledExponential) -> list[CoupledExponential]:
    """The gradients to choose from: exponentials of energy one, and constant torques of one."""
    count = len(law.coordinates)
    rates = [term.rates for term in law.terms]
    rates += [
        tuple(rate if j == i else 0.0 for j, rate in enumerate(term.rates))
        for term, i in product(law.terms, range(count))
    ]
    none = (0.0,) * count
    terms = [CoupledTerm(tuple(-r for r in one), one) for one in dict.fromkeys(rates) if any(one)]
    units = [tuple(1.0 if j == i else 0.0 for j in range(count)) for i in range(count)]
    made = [CoupledExponential(law.coordinates, (term,), none, law.measured) for term in terms]
    return made + [CoupledExponential(law.coordinates, (), unit, law.measured) for unit in units]


def _weighted(law: CoupledExponential, angles: list[Array], root: Array) -> Array:
    """All torques at all nodes in one column, whose sum of squares is an integral."""
    return np.concatenate([root * torque for torque in law.torques(angles)])


def _nodes(side: Range) -> tuple[Array, Array]:
    """Nodes [rad] and weights [rad] of Gauss-Legendre integration over a range."""
    x, weights = np.polynomial.legendre.leggauss(_NODES)
    half = 0.5 * (side[1] - side[0])
    return side[0] + half * (x + 1.0), half * weights
