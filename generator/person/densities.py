"""Densities of a person's segments: masses of the body over volumes of the surfaces.

Surfaces of neighbours overlap at their joint, where a round end of each lies within the other.
Volume shared by several segments counts in equal parts for each of them, so that the volumes of all
segments add up to that of the body; but what thigh and trunk share belongs to the thigh, which ends
where the published tables divide them. The arms and legs are spread: beside the trunk they would
share volume with segments that are not their neighbours.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from generator.figure import Figure
from generator.geometry.surface import Array, Indices, Surface
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.person.body import SIDES, side_names
from generator.person.person import Person
from springs.published.reference import Reference, Sureness

COLUMN_SPACING = 0.006
"""Distance of the vertical lines along which volumes are measured [m]."""

_DEMPSTER = Reference(
    "W. T. Dempster, Space Requirements of the Seated Operator, WADC TR 55-159, 1955",
    Sureness.ONE_CODE,
    place="densities as used in models after M. R. Yeadon, J Biomech 23, 1990",
)
_CLAUSER = Reference(
    "C. E. Clauser, J. T. McConville, J. W. Young, Weight, Volume, and Center of Mass of Segments "
    "of the Human Body, AMRL-TR-69-70, 1969",
    Sureness.ONE_CODE,
    place=_DEMPSTER.place,
)
_CHANDLER = Reference(
    "R. F. Chandler et al., Investigation of Inertial Properties of the Human Body, "
    "AMRL-TR-74-137, 1975",
    Sureness.ONE_CODE,
    place=_DEMPSTER.place,
)

PUBLISHED_DENSITIES: Mapping[str, Mapping[str, float]] = {
    "head": {"Chandler": 1056.0, "Dempster": 1110.0, "Clauser": 1070.0},
    "upper_torso": {"Chandler": 853.0, "Dempster": 920.0, "Clauser": 1019.0},
    "middle_torso": {"Chandler": 853.0, "Dempster": 1010.0, "Clauser": 1019.0},
    "lower_torso": {"Chandler": 853.0, "Dempster": 1010.0, "Clauser": 1019.0},
    "upper_arm": {"Chandler": 1005.0, "Dempster": 1070.0, "Clauser": 1056.0},
    "lower_arm": {"Chandler": 1052.0, "Dempster": 1130.0, "Clauser": 1089.0},
    "hand": {"Chandler": 1080.0, "Dempster": 1160.0, "Clauser": 1109.0},
    "upper_leg": {"Chandler": 1020.0, "Dempster": 1050.0, "Clauser": 1044.0},
    "lower_leg": {"Chandler": 1078.0, "Dempster": 1090.0, "Clauser": 1085.0},
    "foot": {"Chandler": 1091.0, "Dempster": 1100.0, "Clauser": 1084.0},
}
"""Densities of cadavers [kg/m3]: of the thorax for the upper torso, of abdomen with pelvis for the
middle and the lower torso."""

DENSITY_REFERENCES: Mapping[str, Reference] = {
    "Chandler": _CHANDLER,
    "Dempster": _DEMPSTER,
    "Clauser": _CLAUSER,
}
"""References of the published densities."""

MAX_EXCESS = 1.0 / 3.0
"""Part of a published density by which one may lie beyond all of them without a fault.

The mean bodies of the survey are within it: surfaces of trunk and foot end elsewhere than the cuts
through cadavers.
"""


@dataclass(frozen=True)
class SegmentDensity:
    """Density of a segment, or of the whole body.

    Attributes:
        name: name of the segment without side, or "body".
        mass: [kg].
        volume: volume with its part of what neighbours share [m3].
        published: densities [kg/m3] by their first authors; empty for the body.
    """

    name: str
    mass: float
    volume: float
    published: Mapping[str, float]

    @property
    def density(self) -> float:
        """Mass over volume [kg/m3]."""
        return self.mass / self.volume

    @property
    def excess(self) -> float:
        """Part by which it lies above the largest published density, negative below the least."""
        if not self.published:
            return 0.0
        low, high = min(self.published.values()), max(self.published.values())
        return max(0.0, self.density / high - 1.0) + min(0.0, self.density / low - 1.0)

    @property
    def fault(self) -> str | None:
        """Sentence on a density too far beyond the published ones; None for another."""
        if abs(self.excess) <= MAX_EXCESS:
            return None
        return (
            f"the {self.name.replace('_', ' ')} has {self.density:.0f} kg/m3, "
            f"{abs(self.excess):.0%} {'above' if self.excess > 0.0 else 'below'} the published "
            "densities: its surface does not fit its mass"
        )


def segment_densities(person: Person) -> tuple[SegmentDensity, ...]:
    """Return the densities of the segments, by names without side, and of the whole body."""
    placed = place_surfaces(person.figure, person.surfaces, SPREAD_ARMS, SPREAD_LEGS)
    # Thighs and the neck's ball end within the trunk.
    ranks = [1 if name == "head" or name.endswith("leg") else 0 for name in placed]
    volumes = dict(zip(placed, shared_volumes(list(placed.values()), ranks), strict=True))
    rows: list[SegmentDensity] = []
    for name, segment in person.body.segments.items():
        sides = [volumes[side] for side in side_names(name)]
        mean = sum(sides) / len(sides)
        rows.append(SegmentDensity(name, segment.mass, mean, PUBLISHED_DENSITIES[name]))
    return (*rows, SegmentDensity("body", person.measures.mass, sum(volumes.values()), {}))


SPREAD_ARMS, SPREAD_LEGS = 0.8, 0.3
"""Abduction of shoulders and hips in which limbs touch neither the trunk nor each other [rad]."""


def place_surfaces(
    figure: Figure,
    surfaces: Mapping[str, Surface],
    arms: float | None = None,
    legs: float | None = None,
) -> dict[str, Surface]:
    """Return the surfaces of a person's figure in the world, by names with side.

    Args:
        figure: that stands upright.
        surfaces: surfaces by names without side.
        arms: abduction of the shoulders [rad]; None for that of the figure.
        legs: abduction of the hips, with straight ankles [rad]; None for the legs of the figure.
    """
    tree = build_tree(figure)
    displacements = initial_displacements(tree)
    for side in SIDES:
        if arms is not None:
            displacements[f"{side}_shoulder"] = np.array([0.0, arms, 0.0])
        if legs is not None:
            displacements[f"{side}_hip_joint"] = np.array([0.0, legs, 0.0])
            displacements[f"{side}_ankle"] = np.zeros(2)
    poses = forward_kinematics(tree, displacements).poses
    return {
        side: surface.transformed(poses[side])
        for name, surface in surfaces.items()
        for side in side_names(name)
    }


def shared_volumes(
    surfaces: Sequence[Surface],
    ranks: Sequence[int] | None = None,
    spacing: float = COLUMN_SPACING,
) -> Array:
    """Volumes of closed surfaces [m3], in which what several share counts in equal parts.

    Volumes are sums over vertical columns of a square cross section.

    Args:
        surfaces: closed, in one frame whose y is up.
        ranks: ranks of the surfaces: what they share belongs to those of the highest rank.
        spacing: spacing of the columns [m].
    """
    crossings = [_crossings(surface, spacing) for surface in surfaces]
    columns = np.concatenate([column for column, _, _ in crossings])
    heights = np.concatenate([height for _, height, _ in crossings])
    signs = np.concatenate([sign for _, _, sign in crossings])
    owners = np.repeat(np.arange(len(surfaces)), [len(column) for column, _, _ in crossings])
    order = np.lexsort((heights, columns))
    columns, heights = columns[order], heights[order]
    # Whether the space above each crossing lies within each surface, shape (surfaces, crossings).
    inside = np.zeros((len(surfaces), len(columns)))
    inside[owners[order], np.arange(len(columns))] = signs[order]
    inside = np.cumsum(inside, axis=1)[:, :-1]
    lengths = np.where(columns[1:] == columns[:-1], np.diff(heights), 0.0)
    if ranks is not None:
        rank = np.array(ranks)[:, None]
        inside = inside * (rank == np.where(inside > 0.5, rank, -1).max(axis=0))
    depth = np.maximum(inside.sum(axis=0), 1.0)
    return spacing**2 * (inside @ (lengths / depth))


def _crossings(surface: Surface, spacing: float) -> tuple[Indices, Array, Array]:
    """Column, height and sign (1 upwards into the surface) of each crossing of its triangles."""
    triangles, _ = surface.fan_triangles
    corners = surface.vertices[triangles.T]
    # Lines do not pass through vertices, which are rounded.
    flat = corners[:, :, [0, 2]] / spacing + 0.5 + np.array([0.001234, 0.004321])
    first = np.ceil(flat.min(axis=1)).astype(np.int64)
    count = np.maximum(np.floor(flat.max(axis=1)).astype(np.int64) - first + 1, 0)
    total = count.prod(axis=1)
    of = np.repeat(np.arange(len(corners)), total)
    within = np.arange(len(of)) - np.repeat(np.cumsum(total) - total, total)
    cells = first[of] + np.stack([within // count[of, 1], within % count[of, 1]], axis=1)
    a, b, c = (flat[of, k] - cells for k in range(3))
    areas = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
    hit = (areas > 0.0).all(axis=1) | (areas < 0.0).all(axis=1)
    of, cells, areas = of[hit], cells[hit], areas[hit]
    twice = areas.sum(axis=1)
    heights = (areas * corners[of, :, 1]).sum(axis=1) / twice
    return cells[:, 0] * 2**20 + cells[:, 1], heights, np.sign(twice)


def _cross(a: Array, b: Array) -> Array:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
