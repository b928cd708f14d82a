"""Angles of the bones of the shoulder as functions of the arm's elevation, as published."""

from dataclasses import dataclass
from math import inf, nan
from typing import Protocol, cast

import numpy as np

from springs.backends import Array
from springs.elastic import Range


class BoneAngle(Protocol):
    """An angle of a bone as a function of the arm's elevation and its plane."""

    def angle(self, elevation: Array, plane: float = 0.0) -> Array:
        """Angle of the bone [rad], shape of `elevation` [rad]; nan beyond what is known."""
        ...


@dataclass(frozen=True)
class Regression:
    """constant + plane * plane angle + elevation * elevation + rest_factor * rest.

    constant [rad]; plane, elevation and rest_factor are numbers; rest [rad] is the bone's angle
    while the arm hangs.
    """

    constant: float
    plane: float
    elevation: float
    rest_factor: float
    rest: float

    def angle(self, elevation: Array, plane: float = 0.0) -> Array:
        """Angle of the bone [rad], shape of `elevation` [rad]; `plane` [rad], 0 is frontal."""
        at_rest = self.constant + self.rest_factor * self.rest
        return at_rest + self.plane * plane + self.elevation * np.asarray(elevation)


@dataclass(frozen=True)
class PiecewiseLinear:
    """Straight pieces: at_zero + slope * elevation up to each piece's end.

    Attributes:
        pieces: end [rad], slope, value at zero elevation [rad]; the last end is infinite.
        start: smallest elevation [rad].
    """

    pieces: tuple[tuple[float, float, float], ...]
    start: float = 0.0

    def angle(self, elevation: Array, plane: float = 0.0) -> Array:
        """Angle of the bone [rad], shape of `elevation` [rad], in any plane."""
        del plane
        a = np.asarray(elevation, dtype=float)
        ends = np.array([end for end, _, _ in self.pieces])
        chosen = np.searchsorted(ends, np.where(np.isnan(a), inf, a))
        slopes = np.array([slope for _, slope, _ in self.pieces])
        zeros = np.array([zero for _, _, zero in self.pieces])
        return np.where(a < self.start, nan, zeros[chosen] + slopes[chosen] * a)


@dataclass(frozen=True)
class DigitisedPoints:
    """Points read off a figure, straight lines between them and nothing beyond.

    Attributes:
        points: pairs of arm elevation and angle of the bone [rad], the elevations increasing.
    """

    points: tuple[tuple[float, float], ...]

    @property
    def valid_range(self) -> Range:
        """From the first elevation to the last [rad]."""
        return self.points[0][0], self.points[-1][0]

    def angle(self, elevation: Array, plane: float = 0.0) -> Array:
        """Angle of the bone [rad], shape of `elevation` [rad], in the plane that was measured."""
        del plane
        elevations, angles = np.array(self.points).T
        at = np.asarray(elevation)
        return cast("Array", np.interp(at, elevations, angles, left=nan, right=nan))
