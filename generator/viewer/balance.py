"""Balance of a figure in a pose: its centre of mass over the points on which it stands.

The support is the convex hull of all vertices up to a small height above the lowest one, projected
on the horizontal plane through that one. Segments without a psurf have the vertices of the shape
with which they are drawn.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from generator.figure import Figure
from generator.geometry.appearance import Appearance
from generator.kinematics.centre_of_mass import own_segments, segment_masses
from generator.kinematics.stability import Balance, Stability, stability
from generator.rotations import Array

DEFAULT_SUPPORT_HEIGHT = 0.01
"""Height above the lowest vertex up to which vertices support the figure [m]."""

_UP = 1
"""Index of the vertical axis of the world."""


@dataclass(frozen=True, eq=False)
class BalanceState:
    """Balance in one pose.

    Attributes:
        centre: centre of mass in the world, shape (3,) [m].
        height: height of the lowest vertex, and so of the plane of support, in the world [m].
        stability: stability of the centre over the support; its positions are projected on y = 0.
    """

    centre: Array
    height: float
    stability: Stability

    @property
    def is_balanced(self) -> bool:
        """True where the centre of mass is over the support or on its edge."""
        return self.stability.balance in (Balance.INSIDE, Balance.ON_EDGE)

    @property
    def corners(self) -> Array:
        """Corners of the support, anticlockwise seen from above, shape (k, 3) [m]."""
        return self._on_support(self.stability.corners)

    @property
    def foot(self) -> Array:
        """Point of the plane of support below the centre of mass, shape (3,) [m]."""
        return self._on_support(self.stability.centre)

    @property
    def pivot(self) -> Array:
        """Ends of the edge over which the figure tips, or a corner twice, shape (2, 3) [m]."""
        pivot = self.stability.pivot
        return self.corners[[pivot[0], pivot[-1]]]

    def _on_support(self, points: Array) -> Array:
        moved = points.copy()
        moved[..., _UP] = self.height
        return moved


class BalanceModel:
    """Vertices and masses of a figure, by which its balance in a pose is computed quickly.

    Vertices up to the support height above the lowest one [m] support the figure.
    """

    def __init__(self, figure: Figure, appearances: Mapping[str, Appearance]) -> None:
        """Collect the vertices of the figure's own segments; raises as `segment_masses` does."""
        self.masses = segment_masses(figure)
        self.support_height = DEFAULT_SUPPORT_HEIGHT
        own = [name for name in own_segments(figure) if name in appearances]
        surfaces = [appearances[name].surface for name in own]
        used = [surface.vertices[np.unique(surface.corners)] for surface in surfaces]
        self._segments = own
        self._vertices = np.concatenate([np.zeros((0, 3)), *used])
        self._owners = np.repeat(np.arange(len(own)), list(map(len, used)))

    def state(self, poses: Mapping[str, Array]) -> BalanceState:
        """Return the balance in poses of the segments in the world, shape (4, 4)."""
        centre = self.masses.centre(poses)
        if not len(self._vertices):
            return BalanceState(centre, 0.0, stability(centre, self._vertices))
        stack = np.array([poses[name] for name in self._segments])
        rows = stack[self._owners, _UP]
        heights = np.sum(rows[:, :3] * self._vertices, axis=1) + rows[:, 3]
        lowest = float(heights.min())
        low = np.flatnonzero(heights <= lowest + self.support_height)
        placed = stack[self._owners[low]]
        points = (placed[:, :3, :3] @ self._vertices[low, :, None])[..., 0] + placed[:, :3, 3]
        return BalanceState(centre, lowest, stability(centre, points))


def margin_text(state: BalanceState) -> str:
    """Return the margin in cm, negative outside the support; empty without support."""
    margin = state.stability.margin
    return f"{round(100.0 * margin, 1) + 0.0:.1f} cm" if np.isfinite(margin) else ""


def balance_text(state: BalanceState) -> str:
    """Return a sentence on the balance, with the margin in cm."""
    found = state.stability
    distance = f"{abs(found.margin) * 100.0:.1f} cm"
    if found.balance is Balance.UNSUPPORTED:
        return "Not balanced: nothing supports the figure"
    if found.balance is Balance.INSIDE:
        return f"Balanced: {distance} inside the edge of the support"
    if found.balance is Balance.ON_EDGE:
        return "On the edge of the support"
    return f"Not balanced: {distance} outside the support"
