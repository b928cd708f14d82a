"""Three axis laws joined into the law of a spherical joint (eq. 4.4 and its two mendings).

Eq. 4.4 as printed is no function of the orientation: (A, alpha) and (-A, -alpha) are one rotation
with two moments. Both laws here are functions of the rotation vector r = alpha A, and both reduce
to the axis's own law for a turn about an axis. Torques act on the child and are components in the
half-way frame, the parent's frame turned by r/2.

How far a coupled law is from a gradient, and the nearest law of its form that is one.

Torques measured joint by joint and fitted apart need not be the gradient of one energy. Then a
closed loop of angles yields work, and a joint moved round it again and again would be a motor.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product
from math import sqrt
from operator import add
from typing import cast

import numpy as np

from springs.backends import NUMPY, Array, Operations, Real, Vector
from springs.coupled import CoupledExponential, CoupledLaw, CoupledTerm
from springs.elastic import Range, total_energy, total_torque
from springs.joint import AxisSpring, Joining

_GAUSS_NODES = 32
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
        angles, weights = _gauss_nodes(rectangle[place])
        held = np.full_like(angles, other)
        pair = (angles, held) if place == 0 else (held, angles)
        return float(weights @ law.torques(pair)[place])

    there = along(0, second[0]) + along(1, first[1])
    return there - along(0, second[1]) - along(1, first[0])


@dataclass(frozen=True)
class ConservativeFit:
    """The conservative law of another's exponentials nearest to it, and the distance of the two.

    Attributes:
        law: the conservative law.
        rms_difference: root mean square over the box of the difference in each torque [N m].
        max_difference: largest difference in each torque at the nodes of the box [N m].
    """

    law: CoupledExponential
    rms_difference: tuple[float, ...]
    max_difference: tuple[float, ...]


def nearest_conservative_law(law: CoupledExponential, box: Sequence[Range]) -> ConservativeFit:
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
    nodes = [_gauss_nodes(side) for side in box]
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
    return ConservativeFit(
        nearest,
        tuple(sqrt(float(weights @ d**2)) for d in differences),
        tuple(float(np.abs(d).max()) for d in differences),
    )


def _gradient_basis(law: CoupledExponential) -> list[CoupledExponential]:
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
    made = [CoupledExponential(law.coordinates, (term,), none, law.valid_ranges) for term in terms]
    return made + [
        CoupledExponential(law.coordinates, (), unit, law.valid_ranges) for unit in units
    ]


def _stacked_torques(law: CoupledExponential, angles: list[Array], root: Array) -> Array:
    """All torques at all nodes in one column, whose sum of squares is an integral."""
    return np.concatenate([root * torque for torque in law.torques(angles)])


def _gauss_nodes(side: Range) -> tuple[Array, Array]:
    """Nodes [rad] and weights [rad] of Gauss-Legendre integration over a range."""
    x, weights = np.polynomial.legendre.leggauss(_GAUSS_NODES)
    half = 0.5 * (side[1] - side[0])
    return side[0] + half * (x + 1.0), half * weights


_SMALL_ANGLE = 1e-2
"""Angle below which (a/2)/sin(a/2) is taken from its series [rad]."""


def conservative_torque(axes: Sequence[AxisSpring], r: Vector, ops: Operations = NUMPY) -> Vector:
    """Minus the gradient, on the rotation group, of the sum of the axes' energies U_i(a_i . r).

    It is the `group_torque` of f = -dU/dr.

    Args:
        axes: the joint's axis springs.
        r: rotation vector of the child in the parent [rad], shape (..., 3).
        ops: functions of the kind of number in `r`.

    Returns:
        Torque on the child in the half-way frame [N m], shape (..., 3).
    """

    def size(axis: AxisSpring) -> Real:
        return total_torque(axis.elastic, _component(axis, r, ops), ops)

    return group_torque(_sum_along_axes(axes, size, ops), r, ops)


def group_torque(f: Vector, r: Vector, ops: Operations = NUMPY) -> Vector:
    """The torque whose power is f . dr/dt: f per radian of the rotation vector, on the group.

    Args:
        f: what each component of the rotation vector is driven by [N m], shape (..., 3).
        r: rotation vector of the child in the parent [rad], shape (..., 3).
        ops: functions of the kind of number in both.

    Returns:
        Torque on the child in the half-way frame [N m], shape (..., 3): f with its part across r
        scaled by (a/2)/sin(a/2), where a = |r|. There the rate of r and the relative angular
        velocity differ by just that factor across r, and not at all along it. With
        e = ((a/2)/sin(a/2) - 1)/a^2 it reads f + e (a^2 f - (r.f) r).
    """
    a = ops.norm(r)
    small = a < _SMALL_ANGLE
    safe = ops.where(small, 1.0, a)
    series = 1.0 / 24.0 + (7.0 / 5760.0) * a * a
    excess = ops.where(small, series, (0.5 / ops.sin(0.5 * safe) - 1.0 / safe) / safe)
    # f stands in it twice only: expression trees are evaluated without sharing.
    return ops.scaled(1.0 + excess * a * a, f) - ops.scaled(excess * ops.dot(r, f), r)


def conservative_energy(axes: Sequence[AxisSpring], r: Vector, ops: Operations = NUMPY) -> Real:
    """Stored energy U(r) = sum of U_i(a_i . r) [J]; zero without axes."""
    terms = [total_energy(axis.elastic, _component(axis, r, ops), ops) for axis in axes]
    return reduce(add, terms, ops.part(r, 0) * 0.0)


def weighted_torque(axes: Sequence[AxisSpring], r: Vector, ops: Operations = NUMPY) -> Vector:
    """The thesis's directional weighting (eq. 4.4), mended into a function of the orientation.

    Each axis takes t_i(0) + |A_i| (t_i(sgn(A_i) a) - t_i(0)), t_i being its own torque law and
    A = r/a: the law at the full angle, weighted by how far the turn is about that axis. It is no
    gradient: round a closed loop of orientations it does work.

    Arguments and result as `conservative_torque`.
    """
    a = ops.norm(r)
    safe = ops.where(a < 1e-12, 1.0, a)

    def size(axis: AxisSpring) -> Real:
        x = _component(axis, r, ops)
        at_rest = float(total_torque(axis.elastic, 0.0))
        backward = x < 0.0
        at_angle = total_torque(axis.elastic, ops.where(backward, -a, a), ops)
        return at_rest + ops.where(backward, -x, x) / safe * (at_angle - at_rest)

    return _sum_along_axes(axes, size, ops)


def elastic_torque(
    joining: Joining, axes: Sequence[AxisSpring], r: Vector, ops: Operations = NUMPY
) -> Vector:
    """Torque of the chosen law on the child in the half-way frame [N m], shape (..., 3)."""
    law = conservative_torque if joining is Joining.CONSERVATIVE else weighted_torque
    return law(axes, r, ops)


def damping_torque(
    axes: Sequence[AxisSpring], r: Vector, rate: Vector, ops: Operations = NUMPY
) -> Vector:
    """Torque of damping and of the friction of directional laws, against the rate.

    Args:
        axes: the joint's axis springs.
        r: rotation vector of the child in the parent [rad], shape (..., 3).
        rate: angular velocity of the child relative to the parent in the half-way frame [rad/s],
            shape (..., 3).
        ops: functions of the kind of number in both.

    Returns:
        Torque on the child in the half-way frame [N m], shape (..., 3).
    """

    def size(axis: AxisSpring) -> Real:
        return axis.resistance(_component(axis, r, ops), _component(axis, rate, ops), ops)

    return _sum_along_axes(axes, size, ops)


def _coordinate_axis(axis: AxisSpring) -> int | None:
    """Which of x, y, z the axis is, or None when it is none of them."""
    place = [k for k in range(3) if axis.direction[k] == 1.0]
    return place[0] if place and sum(map(abs, axis.direction)) == 1.0 else None


def _with_positive_axis(axis: AxisSpring) -> AxisSpring:
    """The axis told about the positive coordinate axis where it is along a negative one."""
    turned = axis.with_opposite_axis()
    return turned if _coordinate_axis(turned) is not None else axis


def _component(axis: AxisSpring, vector: Vector, ops: Operations) -> Real:
    """Component of a vector along an axis."""
    place = _coordinate_axis(axis)
    if place is not None:
        return ops.part(vector, place)
    return ops.dot(ops.vector(axis.direction), vector)


def _sum_along_axes(
    axes: Sequence[AxisSpring], size: Callable[[AxisSpring], Real], ops: Operations
) -> Vector:
    """The sum of the axes' directions, each times its size; each size stands in it once."""
    sums: list[Real] = [None, None, None]
    skew: list[Vector] = []
    for axis in map(_with_positive_axis, axes):
        value, place = size(axis), _coordinate_axis(axis)
        if place is None:
            skew.append(ops.scaled(value, ops.vector(axis.direction)))
        else:
            sums[place] = value if sums[place] is None else sums[place] + value
    if any(part is not None for part in sums) or not skew:
        skew.append(ops.vector([0.0 if part is None else part for part in sums]))
    return reduce(add, skew)
