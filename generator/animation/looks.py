"""What segments look like: their psurfs and colours, and sticks where there is no psurf."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from generator.errors import InputError
from generator.exchange.losses import Loss
from generator.figure import Figure, Segment
from generator.frames import Array, frame_with_z
from generator.geometry.segment import surface_of
from generator.geometry.surface import Surface

Colour = tuple[float, float, float]

GREY: Colour = (0.7, 0.7, 0.7)
"""Of segments whose attributes give no colour."""

_THICKNESS = 0.04
_SHOULDER = 0.15
_CLOSE = 1e-6


@dataclass(frozen=True, eq=False)
class Look:
    """The look of a segment: a surface in its frame [m], and red, green, blue from 0 to 1."""

    surface: Surface
    colour: Colour


def looks_of(figure: Figure) -> tuple[Mapping[str, Look], tuple[Loss, ...]]:
    """The looks of the segments that have any, and what is not shown as the figure has it."""
    looks: dict[str, Look] = {}
    unread: list[str] = []
    bare: list[str] = []
    for name, segment in figure.segments.items():
        surface = None
        if segment.psurf is not None:
            try:
                surface = surface_of(figure, segment)
            except InputError as failure:
                unread.append(f"{name} ({failure.faults[0].message})")
        if surface is None:
            surface = _sticks(figure, segment)
            bare += [name] if surface is not None else []
        if surface is not None and surface.face_count:
            looks[name] = Look(surface, colour_of(figure, segment))
    losses = [
        Loss("psurfs that could not be read", tuple(unread)) if unread else None,
        Loss("segments without a psurf are sticks between their sites", tuple(bare))
        if bare
        else None,
    ]
    return looks, tuple(loss for loss in losses if loss is not None)


def colour_of(figure: Figure, segment: Segment) -> Colour:
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


def _sticks(figure: Figure, segment: Segment) -> Surface | None:
    """Sticks between sites of a segment; None where there are no two places."""
    pairs = list(_ends(figure, segment))
    return _octahedra(pairs, segment.name) if pairs else None


def _ends(figure: Figure, segment: Segment) -> Iterator[tuple[Array, Array]]:
    """From the first joint's site to those of the others; of a body with one, to all its sites."""
    used = [
        ref.site
        for joint in figure.joints.values()
        if joint.chain
        for ref in joint.ends
        if ref.segment == segment.name
    ]
    held = _places(segment, used)
    if len(held) == 1 and segment.name not in figure.ground:
        held = _places(segment, [*used, *segment.sites])
    yield from ((held[0], other) for other in held[1:])


def _places(segment: Segment, sites: Sequence[str]) -> list[Array]:
    """The places of sites in the segment's frame, those that coincide once."""
    points = [segment.sites[site].pose_in_segment[:3, 3] for site in sites]
    close = {
        later
        for (_, one), (later, other) in combinations(enumerate(points), 2)
        if np.linalg.norm(one - other) < _CLOSE
    }
    return [point for k, point in enumerate(points) if k not in close]


def _octahedra(pairs: Sequence[tuple[Array, Array]], name: str) -> Surface:
    """Thin octahedra, thick near the first of their ends."""
    vertices: list[Array] = []
    faces: list[tuple[int, int, int]] = []
    for tail, head in pairs:
        base, along = len(vertices), head - tail
        length = float(np.linalg.norm(along))
        across = frame_with_z(along)[:, :2].T * (_THICKNESS * length)
        middle = tail + _SHOULDER * along
        ring = [middle + across[0], middle + across[1], middle - across[0], middle - across[1]]
        vertices += [tail, head, *ring]
        for k in range(4):
            here, there = base + 2 + k, base + 2 + (k + 1) % 4
            faces += [(base, there, here), (base + 1, here, there)]
    return Surface.of(np.array(vertices), faces, name)
