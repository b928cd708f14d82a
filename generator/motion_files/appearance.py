"""Appearance of segments: psurfs and colours, or sticks without a psurf; faces as triangles."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from generator.diagnostics import InputError
from generator.figure import Figure, Segment
from generator.geometry.intersections import triangulate
from generator.geometry.read import read_segment_surface, segment_colour
from generator.geometry.surface import Surface
from generator.losses import Loss
from generator.rotations import Array, rotation_with_z_axis

Colour = tuple[float, float, float]

_THICKNESS = 0.04
_WIDEST_FRACTION = 0.15
_MIN_SITE_DISTANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Appearance:
    """A surface in the segment's frame [m], and red, green, blue from 0 to 1."""

    surface: Surface
    colour: Colour


def segment_appearances(figure: Figure) -> tuple[Mapping[str, Appearance], tuple[Loss, ...]]:
    """Return the appearances of segments, and the losses."""
    appearances: dict[str, Appearance] = {}
    unread: list[str] = []
    bare: list[str] = []
    for name, segment in figure.segments.items():
        surface = None
        if segment.psurf is not None:
            try:
                surface = read_segment_surface(figure, segment)
            except InputError as failure:
                unread.append(f"{name} ({failure.diagnostics[0].message})")
        if surface is None:
            surface = _stick_surface(figure, segment)
            bare += [name] if surface is not None else []
        if surface is not None and surface.face_count:
            appearances[name] = Appearance(surface, segment_colour(figure, segment))
    losses = [
        Loss("psurfs that could not be read", tuple(unread)) if unread else None,
        Loss("segments without a psurf are sticks between their sites", tuple(bare))
        if bare
        else None,
    ]
    return appearances, tuple(loss for loss in losses if loss is not None)


def linear_colour(colour: Colour) -> Colour:
    """Convert a colour from sRGB to linear (IEC 61966-2-1)."""
    red, green, blue = (
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in colour
    )
    return red, green, blue


def _stick_surface(figure: Figure, segment: Segment) -> Surface | None:
    """Return sticks between the sites of a segment; None without two distinct positions."""
    pairs = list(_stick_ends(figure, segment))
    return _octahedra(pairs, segment.name) if pairs else None


def _stick_ends(figure: Figure, segment: Segment) -> Iterator[tuple[Array, Array]]:
    """From the first joint's site to those of the others; of a body with one, to all its sites."""
    used = [
        ref.site
        for joint in figure.joints.values()
        if joint.chain
        for ref in joint.ends
        if ref.segment == segment.name
    ]
    points = _distinct_positions(segment, used)
    if len(points) == 1 and segment.name not in figure.ground:
        points = _distinct_positions(segment, [*used, *segment.sites])
    yield from ((points[0], other) for other in points[1:])


def _distinct_positions(segment: Segment, sites: Sequence[str]) -> list[Array]:
    """Return the distinct positions of sites in the segment's frame."""
    points = [segment.sites[site].pose_in_segment[:3, 3] for site in sites]
    close = {
        later
        for (_, one), (later, other) in combinations(enumerate(points), 2)
        if np.linalg.norm(one - other) < _MIN_SITE_DISTANCE
    }
    return [point for k, point in enumerate(points) if k not in close]


def _octahedra(pairs: Sequence[tuple[Array, Array]], name: str) -> Surface:
    """Thin octahedra, thick near the first of their ends."""
    vertices: list[Array] = []
    faces: list[tuple[int, int, int]] = []
    for tail, head in pairs:
        base, along = len(vertices), head - tail
        length = float(np.linalg.norm(along))
        across = rotation_with_z_axis(along)[:, :2].T * (_THICKNESS * length)
        middle = tail + _WIDEST_FRACTION * along
        ring = [middle + across[0], middle + across[1], middle - across[0], middle - across[1]]
        vertices += [tail, head, *ring]
        for k in range(4):
            here, there = base + 2 + k, base + 2 + (k + 1) % 4
            faces += [(base, there, here), (base + 1, here, there)]
    return Surface.from_faces(np.array(vertices), faces, name)


def triangles_with_normals(surface: Surface) -> tuple[Array, Array]:
    """Return the corners [m] and normals of triangles that cover the faces, shapes (3 t, 3) each.

    Three rows are a triangle, counter-clockwise from outside. Faces may be concave.
    """
    fans, fan_owners = surface.fan_triangles
    points = surface.vertices[fans]
    normals = np.zeros((surface.face_count, 3))
    np.add.at(normals, fan_owners, np.cross(points[1] - points[0], points[2] - points[0]))
    lengths = np.linalg.norm(normals, axis=1)[:, None]
    normals = np.divide(normals, lengths, where=lengths > 0.0, out=np.zeros_like(normals))
    normals[lengths[:, 0] == 0.0] = [0.0, 1.0, 0.0]
    corners, faces = triangulate(surface)
    return corners.reshape(-1, 3), np.repeat(normals[faces], 3, axis=0)
