"""Contact forces as arrows: their scale, where they begin and end, and forces between frames."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, log10

import numpy as np

from generator.contact.record import STANDARD_ACCELERATION, ContactRecord
from generator.figure import Figure
from generator.rotations import Array

MIN_ARROW_FORCE = 1.0
"""Force from which there is an arrow [N]."""

LONGEST_ARROW = 5.0
"""Length at which arrows are cut, over that of the scale."""

_SHARE_OF_SIZE = 0.15
"""Length of the scale over the size of the figure, before it is rounded."""


@dataclass(frozen=True)
class ArrowScale:
    """Scale of arrows of forces. It is that of a figure, so that arrows of its runs compare.

    Attributes:
        length: Length of an arrow [m].
        force: Its force [N].
    """

    length: float
    force: float

    @classmethod
    def of_figure(
        cls, figure: Figure, poses: Mapping[str, Array], share: float = _SHARE_OF_SIZE
    ) -> "ArrowScale":
        """Return the scale of a figure by its weight and its size in a pose, shape (4, 4) each.

        `share` is the length of the scale over that size.
        """
        mass = sum(body.mass or 0.0 for body in figure.bodies.values())
        places = np.array([poses[name][:3, 3] for name in figure.bodies])
        size = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
        length = share * size or 0.1
        return cls(_round_down(length), _round_down(mass * STANDARD_ACCELERATION or 1.0))

    @property
    def text(self) -> str:
        """The scale in words."""
        force = f"{self.force:g} N" if self.force < 1000.0 else f"{self.force / 1000.0:g} kN"
        return f"Arrow of {100.0 * self.length:g} cm: {force}; cut at {self.longest:g} m"

    @property
    def longest(self) -> float:
        """Length at which arrows are cut [m]."""
        return LONGEST_ARROW * self.length

    @property
    def shaft_radius(self) -> float:
        """Radius of the shaft of each arrow [m]."""
        return 0.05 * self.length

    @property
    def head_radius(self) -> float:
        """Radius of the head of each arrow [m]."""
        return 0.13 * self.length

    @property
    def head_length(self) -> float:
        """Length of the head of each arrow that is not shorter [m]."""
        return 0.3 * self.length

    def arrows(self, forces: Array, points: Array) -> Array:
        """Return the tails and tips of arrows that end at points, shape (k, 2, 3) [m].

        Args:
            forces: Forces [N], shape (n, 3), of which those below `MIN_ARROW_FORCE` have no arrow.
            points: Points [m], shape (n, 3).
        """
        sizes = np.linalg.norm(forces, axis=1)
        kept = sizes >= MIN_ARROW_FORCE
        sizes, tips = sizes[kept], points[kept]
        lengths = np.minimum(sizes * self.length / self.force, self.longest)
        return np.stack([tips - (lengths / sizes)[:, None] * forces[kept], tips], axis=1)


def part_forces_at(
    contact: ContactRecord, times: Array, at: Array
) -> Mapping[str, tuple[Array, Array]]:
    """Return forces on parts [N] and their points [m] at times, shape (m, 3) each.

    Between two frames forces are linear, and so are points where both frames have a force; else
    the point is that of the frame that has one.

    Args:
        contact: Contact with n frames.
        times: Times of the frames, shape (n,) [s].
        at: Times within those of the frames, shape (m,) [s].
    """
    low = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 1)
    high = np.minimum(low + 1, len(times) - 1)
    gap = np.where(high > low, times[high] - times[low], 1.0)
    share = np.clip((at - times[low]) / gap, 0.0, 1.0)[:, None]
    found: dict[str, tuple[Array, Array]] = {}
    for name, forces in contact.part_forces.items():
        points, acting = contact.force_points[name], np.any(forces, axis=1)
        begin, end = (
            points[np.where(acting[k], k, other)] for k, other in ((low, high), (high, low))
        )
        found[name] = (
            forces[low] + share * (forces[high] - forces[low]),
            begin + share * (end - begin),
        )
    return found


def _round_down(number: float) -> float:
    """Return the largest of 1, 2, 5, 10 ... that is at most a positive number."""
    power = 10.0 ** floor(log10(number))
    return float(f"{next(k for k in (5, 2, 1) if k * power <= number * (1.0 + 1e-9)) * power:g}")
