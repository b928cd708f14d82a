"""What a figure stands on: faces of its psurfs, points of its sites, or all that is low enough."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from generator.errors import InputError, MoverError, error, nearest
from generator.figure import Figure, Segment, SiteRef
from generator.frames import Array, unit
from generator.geometry.segment import surface_of
from generator.posture.centre_of_mass import own_segments
from generator.posture.stability import Y_UP

ROUNDING = 1e-9
"""By how much the rounding of a pose may lift a face over the height it lies at [m]."""

Poses = Mapping[str, Array]
"""Of the segments in the world, shape (4, 4) each."""


class UnknownSupportError(MoverError):
    """A support that names no segment, face or site of the figure."""


@dataclass(frozen=True)
class Points:
    """Points of support in one pose.

    Attributes:
        positions: in the world, shape (n, 3) [m].
        names: what each belongs to, `SEGMENT:FACE` or `SEGMENT.SITE`; of the faces that meet in a
            point the first.
        sources: all faces and sites that support, each once.
    """

    positions: Array
    names: Sequence[str]
    sources: tuple[str, ...]


class Support(Protocol):
    """What carries a figure, prepared for any pose."""

    def at(self, poses: Poses) -> Points:
        """The points of support in a pose."""
        ...


@dataclass(frozen=True)
class Patch:
    """Points on one segment, each of them once.

    Attributes:
        segment: its name.
        points_in_segment: shape (k, 3) [m].
        names: what each point belongs to, shape (k,).
        sources: the faces or the site that they are of.
    """

    segment: str
    points_in_segment: Array
    names: tuple[str, ...]
    sources: tuple[str, ...]


def patch_of_site(figure: Figure, ref: SiteRef) -> Patch:
    """The point of a site. Raises UnknownSupportError when the figure has none such."""
    segment = _segment(figure, ref.segment)
    if ref.site not in segment.sites:
        hint = nearest(ref.site, segment.sites)
        raise UnknownSupportError(f"segment `{ref.segment}` has no site `{ref.site}`; {hint}")
    point = figure.site(ref).pose_in_segment[None, :3, 3]
    return Patch(ref.segment, point, (str(ref),), (str(ref),))


def patch_of_faces(figure: Figure, name: str, numbers: Sequence[int] | None = None) -> Patch:
    """The corners of faces of a segment, by their numbers from 1 in its psurf; else of all.

    Raises:
        UnknownSupportError: the figure has no such segment, or its psurf no such face.
        InputError: the segment has no psurf, or one that cannot be read.
    """
    surface = surface_of(figure, _segment(figure, name))
    count = surface.face_count
    for number in numbers or ():
        if not 0 < number <= count:
            raise UnknownSupportError(
                f"there is no face {number}: the psurf of `{name}` has {count}, counted from 1"
            )
    chosen = range(1, count + 1) if numbers is None else numbers
    corners = [surface.corners[surface.starts[k - 1] : surface.starts[k]] for k in chosen]
    vertices, first = np.unique(np.concatenate(corners), return_index=True)
    names = [f"{name}:{k}" for k, face in zip(chosen, corners, strict=True) for _ in face]
    return Patch(
        name,
        surface.vertices[vertices],
        tuple(names[int(k)] for k in first.tolist()),
        tuple(dict.fromkeys(names)),
    )


class FixedSupport:
    """Chosen points, which carry the figure in every pose."""

    def __init__(self, patches: Iterable[Patch]) -> None:
        """Gather the points of each segment."""
        by_segment: dict[str, list[Patch]] = {}
        for patch in patches:
            by_segment.setdefault(patch.segment, []).append(patch)
        self._points = {
            name: np.concatenate([patch.points_in_segment for patch in group])
            for name, group in by_segment.items()
        }
        self._names = tuple(
            name for group in by_segment.values() for patch in group for name in patch.names
        )
        self._sources = tuple(
            dict.fromkeys(
                source
                for group in by_segment.values()
                for patch in group
                for source in patch.sources
            )
        )

    def at(self, poses: Poses) -> Points:
        """The chosen points in a pose."""
        placed = [_placed(points, poses[name]) for name, points in self._points.items()]
        positions = np.concatenate([np.zeros((0, 3)), *placed])
        return Points(positions, self._names, self._sources)


class LowFaces:
    """All faces of the figure's own segments that lie at or below a height in the pose."""

    def __init__(self, figure: Figure, height: float, up: ArrayLike = Y_UP) -> None:
        """Read the psurfs of the figure's own segments.

        Args:
            figure: whose faces they are.
            height: over the plane through the world's origin, where the root's site is [m].
            up: normal of that plane, of any length but zero.

        Raises:
            InputError: no segment has a psurf, or one cannot be read.
        """
        self._height = height
        self._up = unit(up)
        own = [figure.segments[name] for name in own_segments(figure)]
        self._surfaces = {
            segment.name: surface_of(figure, segment)
            for segment in own
            if segment.psurf is not None
        }
        if not self._surfaces:
            raise InputError([error("no segment of the figure has a psurf, so there are no faces")])
        self._names = {
            name: np.array([f"{name}:{face + 1}" for face in surface.face_of_corner], dtype=object)
            for name, surface in self._surfaces.items()
        }

    def at(self, poses: Poses) -> Points:
        """The corners of the faces that are low enough in a pose."""
        positions, names = [np.zeros((0, 3))], list[str]()
        for name, surface in self._surfaces.items():
            pose = poses[name]
            limit = self._height + ROUNDING - float(self._up @ pose[:3, 3])
            heights = surface.vertices @ (self._up @ pose[:3, :3])
            if heights.min() > limit:
                continue
            highest = np.maximum.reduceat(heights[surface.corners], surface.starts[:-1])
            low = np.repeat(highest <= limit, surface.sizes)
            positions.append(_placed(surface.vertices[surface.corners[low]], pose))
            names.extend(self._names[name][low].tolist())
        return Points(np.concatenate(positions), names, tuple(dict.fromkeys(names)))


def _segment(figure: Figure, name: str) -> Segment:
    if name not in figure.segments:
        hint = nearest(name, figure.segments)
        raise UnknownSupportError(f"the figure has no segment `{name}`; {hint}")
    return figure.segments[name]


def _placed(points: Array, pose: Array) -> Array:
    return points @ pose[:3, :3].T + pose[:3, 3]
