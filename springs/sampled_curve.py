"""A curve sampled over a range: where its torque is positive, zero and negative."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import radians

import numpy as np
from scipy.optimize import brentq

from springs.elastic import Elastic, total_torque
from springs.operations import FLOATS, Array

_INTERVAL = radians(0.1)
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Run:
    """A stretch of angles [rad] in which the torque has one sign: -1, 0 or +1."""

    sign: int
    start: float
    end: float


@dataclass(frozen=True)
class SampledCurve:
    """The sum of an axis's elastic laws, sampled over a range [rad] and at its corners."""

    laws: tuple[Elastic, ...]
    low: float
    high: float

    @cached_property
    def corners(self) -> tuple[float, ...]:
        """Corners of the laws within the range [rad], in order."""
        found = {corner for law in self.laws for corner in law.corners}
        return tuple(sorted(c for c in found if self.low < c < self.high))

    @cached_property
    def angles(self) -> Array:
        """Where it is sampled [rad]."""
        count = int((self.high - self.low) / _INTERVAL) + 2
        return np.unique([*np.linspace(self.low, self.high, count), *self.corners])

    @cached_property
    def torques(self) -> Array:
        """Torque on the child at the angles [N m]."""
        return np.asarray(total_torque(self.laws, self.angles))

    @property
    def size(self) -> float:
        """Greatest torque in the range [N m]."""
        return float(np.abs(self.torques).max())

    @property
    def rounding(self) -> float:
        """Torque that is nothing but rounding [N m]."""
        return _ROUNDING * self.size

    def at(self, angle: float) -> float:
        """Torque on the child at one angle [N m]."""
        return float(total_torque(self.laws, angle, FLOATS))

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """The stretches of one sign, in order; where the sign changes between samples, at zero."""
        signs = np.sign(np.where(np.abs(self.torques) > self.rounding, self.torques, 0.0))
        cuts = np.flatnonzero(np.diff(signs)).tolist()
        edges = [(self.low, self.low)]
        for cut in cuts:
            before, after = float(self.angles[cut]), float(self.angles[cut + 1])
            if signs[cut] and signs[cut + 1]:
                before = after = float(brentq(self.at, before, after))
            elif signs[cut]:
                before = after
            else:
                after = before
            edges.append((before, after))
        edges.append((self.high, self.high))
        firsts = [0, *(cut + 1 for cut in cuts)]
        return tuple(
            Run(int(signs[first]), start[1], end[0])
            for first, (start, end) in zip(firsts, pairwise(edges), strict=True)
        )

    def greatest(self, run: Run) -> float:
        """Greatest size of the torque in a stretch [N m]."""
        inside = (self.angles >= run.start) & (self.angles <= run.end)
        return float(np.abs(self.torques[inside]).max(initial=0.0))
