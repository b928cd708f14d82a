"""The axes of a segment: those of its principal inertia, as near as can be to a body's own."""

from itertools import permutations

import numpy as np

from generator.frames import Array
from generator.inertia import MassProperties

DIAGONAL = 1e-12
"""Off-diagonal parts of a tensor that count as rounding, relative to its largest part."""


def principal_frame(mass: MassProperties) -> Array:
    """Rotation of the principal axes in the body's frame, shape (3, 3).

    The body's own axes where they are principal. Else each of them has the principal axis that is
    nearest to it, so that a tensor that is nearly diagonal turns the axes by little.
    """
    tensor = mass.inertia
    if np.abs(tensor - np.diag(np.diag(tensor))).max() <= DIAGONAL * np.abs(tensor).max():
        return np.eye(3)
    axes = np.linalg.eigh(tensor)[1]
    best = max(permutations(range(3)), key=lambda order: float(_nearness(axes, order).sum()))
    chosen = axes[:, list(best)]
    chosen = chosen * np.where(np.diag(chosen) < 0.0, -1.0, 1.0)
    if np.linalg.det(chosen) < 0.0:
        chosen[:, int(np.argmin(np.abs(np.diag(chosen))))] *= -1.0
    return chosen


def _nearness(axes: Array, order: tuple[int, ...]) -> Array:
    return np.abs(axes[[0, 1, 2], list(order)])
