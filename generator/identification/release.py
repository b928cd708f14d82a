"""Release of joints in measured angles: when they begin to move, and from which angles."""

from dataclasses import dataclass

import numpy as np

from generator.rotations import Array

_LEFT, _ACROSS = 0.2, 0.9
"""Shares of the largest move that the joint has made when it has left its start, and when it is
nearly across: of a swing 1 - cos(phase), at the phases 53 and 143 deg."""

_FIRST_ANGLES = 3
"""Number of samples whose median is the angle from which moves are measured."""

_FEWEST = 5
"""Smallest number of samples that show a release."""

_CANDIDATES = 400
"""Number of times that are tried."""


@dataclass(frozen=True, eq=False)
class Release:
    """Release of joints.

    Attributes:
        time: counted from the first sample [s]; negative where that came after it.
        angles: Angles from which the joints move, shape (k,) [rad].
    """

    time: float
    angles: Array


def find_release(times: Array, angles: Array) -> Release:
    """Estimate the release: angles that are constant and then begin to swing as 1 - cos(phase).

    The rate of the phase follows from the samples at which the motion is a fifth of the way and
    nearly across. Sizes, constant angles and the time have the least sum of squares over the
    samples until the first of these.

    Args:
        times: shape (n,) [s], increasing.
        angles: shape (n, k) [rad].
    """
    times = times - times[0]  # rounding does not depend on the epoch
    first = np.median(angles[:_FIRST_ANGLES], axis=0)
    moves = np.linalg.norm(angles - first, axis=1)
    far = moves > _LEFT * moves.max()
    far[:-1] &= far[1:]  # one sample alone may be an error of the measurement
    left = int(np.argmax(far))
    across = left + int(np.argmax(moves[left:] > _ACROSS * moves.max()))
    if len(times) < _FEWEST or left == 0 or across == left:
        return Release(0.0, angles[0])
    quarter = float(times[across] - times[left])
    early = int(np.count_nonzero(times < times[left] - 2.0 * quarter))
    used = slice(early, max(left + 1, early + _FEWEST))
    candidates: Array = times[left] - quarter * np.linspace(0.0, 1.2, _CANDIDATES)
    phases = 0.5 * np.pi / quarter * np.maximum(times[used] - candidates[:, None], 0.0)
    shapes: Array = 1.0 - np.cos(phases)
    centred = shapes - shapes.mean(axis=1, keepdims=True)
    power = np.maximum(np.sum(centred**2, axis=1), np.finfo(float).tiny)
    products = centred @ angles[used]
    best = int(np.argmax(np.sum(products**2, axis=1) / power))
    sizes = products[best] / power[best]
    level = angles[used].mean(axis=0) - sizes * shapes[best].mean()
    return Release(float(candidates[best]), level)
