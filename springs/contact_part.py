"""The resistance of a part of the body, as a whole, to what is pressed into it.

The depths d_i of a part's spheres in a prop make one compression

    D = (sum of d_i^p)^(1/p),    p = 12,

close to the depth of the deepest one, whichever spheres touch: n of the same depth d make it
n^(1/p) d, and their force together n^(2/p) times that of one. So D is multiplied by c, with which
it is the largest depth in a reference pose of the part. The energy is Psi(c D), and so the normal
force of a sphere

    N_i = F(c D) w_i max(0, 1 + a D'),
    w_i = c dD/dd_i = c (d_i / D)^(p-1),    D' = sum of w_i d_i'.

F = dPsi/dD is piecewise linear but for smooth transitions: from the depth x_j on its slope is k_j.
Each stage adds (k_j - k_(j-1)) q(D - x_j), with q of `springs.contact.Surface`. Where a further
sphere touches, the force has two continuous derivatives.

A region of a part may be firmer than the rest, as the buttocks are within the pelvis. Its spheres
have the law of the part with the others, and beside it what the law of the region adds to that of
the part, by the compression of the region's own spheres. A second spring would double the force.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import NamedTuple

import numpy as np

from springs.backends import NUMPY, Array, Operations, Real
from springs.contact import rising_energy, rising_force, rising_slope
from springs.layer import Layer, Stages, check_stages, series_stages

NORM = 12
"""p of the norm over the spheres of a part."""

FIRST_TRANSITION, LATER_TRANSITION = 5e-3, 2e-3
"""Depth over which the stiffness of the first stage, and of each later one, grows [m]."""

_LATER_BEND = 0.5 * (FIRST_TRANSITION - LATER_TRANSITION)
"""Depth between the beginning of a later stage and the bend of the lines beyond transitions [m].

The lines meet at e/2 into a transition; the first one starts at zero here.
"""


@dataclass(frozen=True)
class PartLaw:
    """Stiffness of a part of the body by its compression, and its damping.

    Attributes:
        stages: Compressions from which on a tangent stiffness holds, with it, in increasing order
            and from 0 on [m, N/m].
        damping: a, zero for an elastic impact [s/m].
        source: Where the numbers are from.
        within: Law of the part of which this is a firmer region. Forces and energy are then what
            the region adds to those of the part.
        cover: Layer over the part, such as a hip protector, which `on` puts in series.
        norm_scale: c, largest depth over the norm of the depths in the reference pose.
    """

    stages: Stages
    damping: float = 1.0
    source: str = field(default="", compare=False)
    within: "PartLaw | None" = None
    cover: Layer | None = None
    norm_scale: float = 1.0

    def __post_init__(self) -> None:
        """Check the numbers. Raises ValueError."""
        check_stages(self.stages, "part")
        if not (isfinite(self.damping) and self.damping >= 0.0):
            raise ValueError(f"the damping must not be negative, and finite, not {self.damping:g}")
        if not 0.0 < self.norm_scale <= 1.0:
            raise ValueError(f"the scale of the norm is from 0 to 1, not {self.norm_scale:g}")

    def is_softer_than(self, other: "PartLaw") -> bool:
        """Return whether the tangent stiffness is below that of another law at some compression."""
        begins = {begin for begin, _ in (*self.stages, *other.stages)}
        return any(self._stiffness(begin) < other._stiffness(begin) for begin in begins)

    def no_softer_than(self, other: "PartLaw") -> "PartLaw":
        """Return the law with at least the stiffness of another one at the depths of its stages."""
        return replace(self, stages=tuple((x, max(k, other._stiffness(x))) for x, k in self.stages))

    def _stiffness(self, depth: float) -> float:
        """Return the tangent stiffness of the stage at a depth, without transitions [N/m]."""
        return [k for begin, k in self.stages if begin <= depth][-1]

    def scaled(self, stiffness: float, damping: float = 1.0) -> "PartLaw":
        """Return the part with factors of its stiffness and its damping."""
        stages = tuple((depth, stiffness * k) for depth, k in self.stages)
        within = self.within and self.within.scaled(stiffness, damping)
        return replace(self, stages=stages, damping=damping * self.damping, within=within)

    def on(self, layer: Layer | None) -> "PartLaw":
        """Return the law of the part in series with its cover and a layer on the floor.

        Beyond its transitions F is piecewise linear, and so is the series of such curves, which
        bends at the forces at which one of them does. The damping acts on the part's own rate,
        that of its last stage with the first ones of the layers.

        Args:
            layer: Layer on the floor; None for a hard floor.
        """
        layers = [each for each in (self.cover, layer) if each is not None]
        if not layers:
            return self
        own = tuple((max(x - _LATER_BEND, 0.25 * x), k) for x, k in self.stages)
        (_, first), *later = series_stages([own, *(each.curve for each in layers)])
        stages = ((0.0, first), *((x + _LATER_BEND, k) for x, k in later))
        others = sum(1.0 / each.stages[0][1] for each in layers)
        share = 1.0 / (1.0 + self.stages[-1][1] * others)
        damping, within = self.damping * share, self.within and self.within.on(layer)
        return replace(self, stages=stages, damping=damping, within=within, cover=None)

    @property
    def increments(self) -> Iterator[tuple[float, float, float]]:
        """Beginning [m], added stiffness [N/m] and transition [m] of each stage."""
        added: dict[tuple[float, float], float] = {}
        for law, sign in ((self, 1.0), (self.within, -1.0)):
            before = 0.0
            for number, (begin, k) in enumerate(law.stages if law else ()):
                place = begin, LATER_TRANSITION if number else FIRST_TRANSITION
                added[place] = added.get(place, 0.0) + sign * (k - before)
                before = k
        for (begin, transition), k in added.items():
            if k != 0.0:
                yield begin, k, transition

    def elastic_force(self, depth: Real, ops: Operations = NUMPY) -> Real:
        """F [N] at a compression [m]."""
        return sum(rising_force(depth - x, k, e, ops) for x, k, e in self.increments)

    def elastic_slope(self, depth: Real, ops: Operations = NUMPY) -> Real:
        """Derivative of F [N/m] at a compression [m]."""
        return sum(rising_slope(depth - x, k, e, ops) for x, k, e in self.increments)

    def energy(self, depth: Real, ops: Operations = NUMPY) -> Real:
        """Psi [J] at a compression [m]."""
        return sum(rising_energy(depth - x, k, e, ops) for x, k, e in self.increments)


class Compressions(NamedTuple):
    """Compressions of a part, of its cover and of a layer on the floor [m]."""

    part: Array
    cover: Array
    floor: Array


@dataclass(frozen=True)
class Series:
    """A part of the body, its cover and a layer on the floor, which carry one force.

    Attributes:
        part: Law of the part, with its cover.
        floor: Layer on the floor; None for a hard floor.
    """

    part: PartLaw
    floor: Layer | None = None

    @property
    def law(self) -> PartLaw:
        """Law of all of it together."""
        return self.part.on(self.floor)

    def split(self, compression: Array) -> Compressions:
        """Return whose compressions add to one, of any shape [m].

        Those of the layers follow from the elastic force, and that of the part is the rest.
        """
        force = np.asarray(self.law.elastic_force(compression))
        cover, floor = (
            np.zeros_like(force) if layer is None else layer.compression(force)
            for layer in (self.part.cover, self.floor)
        )
        return Compressions(compression - cover - floor, cover, floor)


@dataclass(frozen=True)
class PartForces:
    """Forces on the S spheres of a part in n states.

    Attributes:
        compression: c D, shape (n,) [m].
        elastic: Elastic parts of the normal forces, shape (n, S) [N].
        normal: Normal forces, shape (n, S) [N].
        energy: Stored energy, shape (n,) [J].
    """

    compression: Array
    elastic: Array
    normal: Array
    energy: Array


def part_forces(law: PartLaw, depths: Array, rates: Array) -> PartForces:
    """Return the forces of a prop on the spheres of a part.

    Args:
        law: Law of the part.
        depths: Depths of its spheres, negative outside, shape (n, S) [m].
        rates: Rates of these, shape (n, S) [m/s].
    """
    compression, weights = (law.norm_scale * each for each in compression_of(depths))
    force = np.asarray(law.elastic_force(compression))
    impact = np.maximum(0.0, 1.0 + law.damping * np.sum(weights * rates, axis=-1))
    elastic = force[..., None] * weights
    return PartForces(
        compression, elastic, elastic * impact[..., None], np.asarray(law.energy(compression))
    )


def compression_of(depths: Array) -> tuple[Array, Array]:
    """Return D, shape (n,) [m], and the weights w, shape (n, S), of depths of that shape [m]."""
    inside = np.maximum(depths, 0.0)
    largest = np.max(inside, axis=-1, initial=0.0)
    shares = inside / np.where(largest > 0.0, largest, 1.0)[..., None]
    root = np.sum(shares**NORM, axis=-1) ** (1.0 / NORM)
    safe = np.where(root > 0.0, root, 1.0)[..., None]
    return largest * root, (shares / safe) ** (NORM - 1)
