"""Soft layers between a part of the body and what is hard: a mat on the floor, a hip protector.

A layer and a part carry one force, and their compressions add. Of piecewise linear forces that sum
is piecewise linear too: it bends at the forces at which one of them does, and its compliance there
is the sum of theirs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf, isfinite

import numpy as np
from numpy.typing import ArrayLike

from springs.backends import Array

Stages = tuple[tuple[float, float], ...]
"""Compressions from which on a tangent stiffness holds, with it, from 0 on [m, N/m]."""


@dataclass(frozen=True)
class Layer:
    """A soft layer that is compressed.

    Attributes:
        stages: Compressions from which on a tangent stiffness holds, with it, in increasing order
            and from 0 on [m, N/m].
        thickness: Compression at which it is pressed through, and only what is hard remains; by
            default never [m].
        source: Where the numbers are from.
    """

    stages: Stages
    thickness: float = inf
    source: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        """Check the numbers. Raises ValueError."""
        check_stages(self.stages, "layer")
        if not self.thickness > self.stages[-1][0]:
            raise ValueError(
                f"the thickness must be above the beginning of the last stage, "
                f"{self.stages[-1][0]:g} m, not {self.thickness:g}"
            )

    @property
    def curve(self) -> Stages:
        """Stages, the last one of infinite stiffness where the layer has a thickness."""
        return self.stages if self.thickness == inf else (*self.stages, (self.thickness, inf))

    @property
    def limit(self) -> float:
        """Force at which the layer is pressed through, infinite without a thickness [N]."""
        if self.thickness == inf:
            return inf
        begin, stiffness = self.stages[-1]
        return _stage_forces(self.stages)[-1] + stiffness * (self.thickness - begin)

    def compression(self, force: ArrayLike) -> Array:
        """Return the compression [m] under a force [N] of any shape."""
        return compression_under(self.curve, np.asarray(force, dtype=float))


def check_stages(stages: Stages, noun: str) -> None:
    """Raise ValueError for stages that do not begin at 0, or are without a stiffness."""
    depths, stiffnesses = zip(*stages, strict=True) if stages else ((), ())
    if not depths or depths[0] != 0.0 or sorted(set(depths)) != list(depths):
        raise ValueError(f"the stages of a {noun} begin at 0 and follow each other")
    if not all(isfinite(k) and k > 0.0 for k in stiffnesses) or not isfinite(depths[-1]):
        raise ValueError("the stiffness of a stage must be positive and finite")


def compression_under(curve: Stages, force: Array) -> Array:
    """Return the compression [m] of a piecewise linear curve under a force of any shape [N]."""
    forces = _stage_forces(curve)
    depths, stiffnesses = np.array(curve).T
    place = np.maximum(np.searchsorted(forces, force, side="right") - 1, 0)
    return depths[place] + np.maximum(force - np.array(forces)[place], 0.0) / stiffnesses[place]


_ROUNDING = 1e-9
"""Relative difference of the forces of two bends that is rounding."""


def series_stages(curves: Sequence[Stages]) -> Stages:
    """Return the stages of several curves in series."""
    bends: list[float] = []
    for force in sorted(force for curve in curves for force in _stage_forces(curve)):
        if bends and force - bends[-1] <= _ROUNDING * force:
            bends[-1] = force  # one bend, of which rounding makes two
        else:
            bends.append(force)
    stages: list[tuple[float, float]] = []
    for force in bends:
        depth, compliance = 0.0, 0.0
        for curve in curves:
            at = np.searchsorted(_stage_forces(curve), force, side="right") - 1
            depth += float(compression_under(curve, np.array(force)))
            compliance += 1.0 / curve[int(at)][1]
        stages.append((depth, 1.0 / compliance))
    return tuple(stages)


def _stage_forces(curve: Stages) -> list[float]:
    """Return the force at the beginning of each stage [N]."""
    forces, force = [0.0], 0.0
    for (begin, stiffness), (end, _) in pairwise(curve):
        force += stiffness * (end - begin)
        forces.append(force)
    return forces
