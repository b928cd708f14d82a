"""What segments look like: their psurfs and colours, and sticks where there is no psurf.

The faces of a surface as triangles, for programs that draw nothing else.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from generator.diagnostics import InputError
from generator.figure import Figure, Segment
from generator.geometry.read import read_segment_surface
from generator.geometry.surface import Indices, Surface
from generator.losses import Loss
from generator.rotations import Array, rotation_with_z_axis

Colour = tuple[float, float, float]

GREY: Colour = (0.7, 0.7, 0.7)
"""Of segments whose attributes give no colour."""

_THICKNESS = 0.04
_WIDEST_FRACTION = 0.15
_MIN_SITE_DISTANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Appearance:
    """The look of a segment: a surface in its frame [m], and red, green, blue from 0 to 1."""

    surface: Surface
    colour: Colour


def segment_appearances(figure: Figure) -> tuple[Mapping[str, Appearance], tuple[Loss, ...]]:
    """The looks of the segments that have any, and what is not shown as the figure has it."""
    looks: dict[str, Appearance] = {}
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
            looks[name] = Appearance(surface, segment_colour(figure, segment))
    losses = [
        Loss("psurfs that could not be read", tuple(unread)) if unread else None,
        Loss("segments without a psurf are sticks between their sites", tuple(bare))
        if bare
        else None,
    ]
    return looks, tuple(loss for loss in losses if loss is not None)


def segment_colour(figure: Figure, segment: Segment) -> Colour:
    """The `rgb` of the first of a segment's attributes that has one."""
    for name in segment.attributes:
        attribute = figure.attributes.get(name)
        given = None if attribute is None else attribute.fields.get("rgb")
        if isinstance(given, tuple) and len(given) == 3:
            red, green, blue = (min(max(part, 0.0), 1.0) for part in given)
            return red, green, blue
    return GREY


def linear_colour(colour: Colour) -> Colour:
    """The share of light that a display makes of each part of a colour (IEC 61966-2-1, sRGB)."""
    red, green, blue = (
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in colour
    )
    return red, green, blue


def _stick_surface(figure: Figure, segment: Segment) -> Surface | None:
    """Sticks between sites of a segment; None where there are no two places."""
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
    held = _distinct_positions(segment, used)
    if len(held) == 1 and segment.name not in figure.ground:
        held = _distinct_positions(segment, [*used, *segment.sites])
    yield from ((held[0], other) for other in held[1:])


def _distinct_positions(segment: Segment, sites: Sequence[str]) -> list[Array]:
    """The places of sites in the segment's frame, those that coincide once."""
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


_MIN_RELATIVE_AREA = 1e-12
"""A corner with less area than this, relative to its face's, lies on a line."""


def triangles_with_normals(surface: Surface) -> tuple[Array, Array]:
    """Corners of triangles that cover the faces, and their normals: shapes (3 t, 3) each [m, 1].

    Three rows are a triangle, counter-clockwise from outside. Faces may be concave.
    """
    fans, owners = surface.fan_triangles
    points = surface.vertices[fans]
    areas = np.cross(points[1] - points[0], points[2] - points[0])
    whole = np.zeros((surface.face_count, 3))
    np.add.at(whole, owners, areas)
    lengths = np.linalg.norm(whole, axis=1)
    normals = np.divide(
        whole, lengths[:, None], where=lengths[:, None] > 0.0, out=np.zeros_like(whole)
    )
    normals[lengths == 0.0] = [0.0, 1.0, 0.0]
    against = np.sum(areas * normals[owners], axis=1) < -_MIN_RELATIVE_AREA * lengths[owners]
    concave = np.unique(owners[against])
    kept = ~np.isin(owners, concave)
    corners, faces = fans.T[kept], owners[kept]
    if concave.size:
        clipped = [_clip_ears(surface, int(face), normals[face]) for face in concave]
        corners = np.concatenate([corners, *clipped])
        faces = np.concatenate([faces, np.repeat(concave, [len(part) for part in clipped])])
    return surface.vertices[corners].reshape(-1, 3), np.repeat(normals[faces], 3, axis=0)


def _clip_ears(surface: Surface, face: int, normal: Array) -> Indices:
    """Triangles of a concave face, shape (t, 3): one ear after the other is cut off."""
    left = surface.corners[surface.starts[face] : surface.starts[face + 1]].tolist()
    ears: list[tuple[int, int, int]] = []
    while len(left) > 3:
        place = next((k for k in range(len(left)) if _is_ear(surface, left, k, normal)), 0)
        ears.append((left[place - 1], left[place], left[(place + 1) % len(left)]))
        del left[place]
    ears.append((left[0], left[1], left[2]))
    return np.array(ears, dtype=np.int64)


def _is_ear(surface: Surface, remaining: list[int], index: int, normal: Array) -> bool:
    """Whether the corner at `index` sticks out and no other corner lies within its triangle."""
    names = (remaining[index - 1], remaining[index], remaining[(index + 1) % len(remaining)])
    a, b, c = surface.vertices[list(names)]
    if np.cross(b - a, c - b) @ normal <= 0.0:
        return False
    others = surface.vertices[[corner for corner in remaining if corner not in names]]
    sides = [
        np.cross(head - tail, others - tail) @ normal for tail, head in ((a, b), (b, c), (c, a))
    ]
    return not bool(np.any(np.all(np.array(sides) >= 0.0, axis=0)))
