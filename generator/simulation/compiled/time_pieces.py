"""Loads and drives as polynomials in intervals of time."""

from collections.abc import Sequence

import numpy as np

from generator.drive import Drive
from generator.loads import TimedLoad
from generator.rotations import Array

_SAMPLED_SHARES = np.array([0.25, 0.75])
"""Places within an interval at which a load is read, away from jumps at its ends."""


def smooth_intervals(
    loads: Sequence[TimedLoad], drives: Sequence[Drive], times: tuple[float, float]
) -> Array:
    """Start, and the times until the stop at which a load or a drive is not smooth, (k,) [s]."""
    start, stop = times
    ends = [float(t) for load in loads for t in load.times]
    ends += [float(t) for drive in drives for t in drive.times]
    return np.array([start, *sorted({t for t in ends if start < t < stop})])


def load_pieces(loads: Sequence[TimedLoad], knots: Array, stop: float) -> Array:
    """Value at the start of each interval and slope of each load, shape (k, l, 6)."""
    lengths = np.diff(np.append(knots, stop))
    inner = knots[:, None] + _SAMPLED_SHARES * lengths[:, None]
    pieces = np.zeros((len(knots), len(loads), 6))
    for k, load in enumerate(loads):
        values = load.components(inner)
        slopes = (values[:, 1] - values[:, 0]) / (0.5 * lengths[:, None])
        pieces[:, k, 3:] = slopes
        pieces[:, k, :3] = values[:, 0] - slopes * (0.25 * lengths[:, None])
    return pieces


def drive_pieces(drives: Sequence[tuple[Drive, int]], knots: Array, stop: float) -> Array:
    """Coefficients of each drive's cubic in the time since each interval's start, (k, drives, 4).

    Args:
        drives: each with one of its columns.
        knots: starts of the intervals, shape (k,) [s].
        stop: end of the last interval [s].
    """
    middles = 0.5 * (knots + np.append(knots[1:], stop))
    pieces = np.zeros((len(knots), len(drives), 4))
    for k, (drive, column) in enumerate(drives):
        for order, factor in enumerate((1.0, 1.0, 0.5)):
            pieces[:, k, order] = factor * drive.derivatives(knots, order)[:, column]
        pieces[:, k, 3] = drive.derivatives(middles, 3)[:, column] / 6.0
    return pieces
