"""Which of the closed shells of a surface lie within others, and which cut through others."""

from dataclasses import dataclass

import numpy as np

from generator.geometry.crossings import crosses
from generator.geometry.surface import Array, Indices, Mask, Surface
from generator.geometry.triangulation import triangles_of

SAMPLES = 32
"""So many of the largest faces of a shell, and as many others, are asked where they lie."""

INSET = 1e-6
"""How far below a face the point lies that is asked, relative to the extent of its shell."""

AT_ONCE = 500_000
"""Triangles times points that are looked at together."""


@dataclass(frozen=True, eq=False)
class Nesting:
    """How k closed shells lie to each other.

    Attributes:
        within: whether the shell of the row lies within that of the column, shape (k, k).
        cutting: pairs of shells that cut through each other.
    """

    within: Mask
    cutting: tuple[tuple[int, int], ...]

    @property
    def depths(self) -> Indices:
        """In how many others each shell lies, shape (k,); an odd number makes it a void."""
        return self.within.sum(axis=1)


def nesting_of(surface: Surface, shells: Indices, count: int) -> Nesting:
    """How the `count` shells of a surface lie to each other.

    All faces look outwards from their own shell; `shells` tells that of each face, shape (m,).
    Shells that only touch, face on face even, neither cut nor contain each other.
    """
    within = np.zeros((count, count), dtype=bool)
    if count == 1:
        return Nesting(within, ())
    corners, owner = triangles_of(surface)
    order = np.argsort(shells[owner], kind="stable")
    parts = np.split(corners[order], np.cumsum(np.bincount(shells[owner], minlength=count))[:-1])
    lows = np.array([part.min(axis=(0, 1)) for part in parts])
    highs = np.array([part.max(axis=(0, 1)) for part in parts])
    cutting: list[tuple[int, int]] = []
    for i, j in _near(lows, highs):
        i_in_j, j_in_i = _share_within(parts[i], parts[j]), _share_within(parts[j], parts[i])
        clear = (i_in_j == 1.0) != (j_in_i == 1.0) or i_in_j == j_in_i == 0.0
        if not clear or crosses(parts[i], parts[j]):
            cutting.append((i, j))
        else:
            within[i, j], within[j, i] = i_in_j == 1.0, j_in_i == 1.0
    return Nesting(within, tuple(cutting))


def _near(lows: Array, highs: Array) -> list[tuple[int, int]]:
    """The pairs of shells whose extents overlap."""
    order = np.argsort(lows[:, 0])
    pairs: list[tuple[int, int]] = []
    left, right = lows[order, 0], highs[order, 0]
    for place, here in enumerate(order.tolist()):
        others = order[place + 1 : int(np.searchsorted(left, float(right[place])))]
        overlap = (lows[others] < highs[here]) & (highs[others] > lows[here])
        near: list[int] = others[overlap.all(axis=1)].tolist()
        pairs += [(min(here, other), max(here, other)) for other in near]
    return sorted(pairs)


def _share_within(part: Array, other: Array) -> float:
    """The share of a shell's faces whose inner side lies within another shell."""
    points = _below_faces(part)
    return float((np.rint(winding_numbers(other, points)) > 0.5).mean())


def _below_faces(part: Array) -> Array:
    """Points just within a shell, below the middle of its larger faces, shape (s, 3)."""
    normals = np.cross(part[:, 1] - part[:, 0], part[:, 2] - part[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    by_size = np.argsort(-lengths, kind="stable")[: max(1, int((lengths > 0.0).sum()))]
    evenly = np.linspace(0, len(by_size) - 1, min(SAMPLES, len(by_size))).astype(int)
    chosen = np.unique(np.concatenate([by_size[:SAMPLES], by_size[evenly]]))
    extent = float(np.linalg.norm(np.ptp(part, axis=(0, 1))))
    inward = normals[chosen] / lengths[chosen, None]
    return part[chosen].mean(axis=1) - INSET * extent * inward


def winding_numbers(triangles: Array, points: Array) -> Array:
    """How often a closed surface goes round each point: 1 within it, 0 outside.

    The sum of the solid angles of its triangles (Van Oosterom and Strackee, IEEE Trans. Biomed.
    Eng. 30, 1983). Shapes (t, 3, 3) and (p, 3) to (p,).
    """
    turns = np.empty(len(points))
    step = max(1, AT_ONCE // len(triangles))
    for start in range(0, len(points), step):
        some = points[start : start + step]
        a, b, c = (triangles[None, :, k] - some[:, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(edge, axis=-1) for edge in (a, b, c))
        top = (a * np.cross(b, c)).sum(axis=-1)
        ab, bc, ca = (a * b).sum(axis=-1), (b * c).sum(axis=-1), (c * a).sum(axis=-1)
        bottom = la * lb * lc + ab * lc + bc * la + ca * lb
        turns[start : start + step] = np.arctan2(top, bottom).sum(axis=1) / (2.0 * np.pi)
    return turns
