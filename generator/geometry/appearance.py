"""Appearance of segments: psurfs and colours, or shapes in place of a psurf; faces as triangles.

Without a psurf a segment is drawn as the capsule of its mass, and without a mass as sticks.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import pi

import numpy as np

from generator.diagnostics import InputError
from generator.figure import Figure, Joint, Segment, SiteRef
from generator.geometry.intersections import triangulate
from generator.geometry.read import read_segment_surface, segment_colour
from generator.geometry.surface import Surface
from generator.joint_chain import Chain
from generator.losses import Effect, Loss
from generator.rotations import Array, inverse_pose, rotation_with_z_axis

Colour = tuple[float, float, float]

_THICKNESS = 0.04
_WIDEST_FRACTION = 0.15
_MIN_SITE_DISTANCE = 1e-6

_SIDES, _RINGS = 20, 5
"""Numbers of corners around a capsule, and of rings of corners in each of its half spheres."""

DENSITY = 1000.0
"""Density of a capsule, that of water [kg/m^3]."""

_MAX_BEND = 1e-6
"""Angle between two lines of a capsule below which they are one line [rad]."""


@dataclass(frozen=True, eq=False)
class Appearance:
    """A surface in the segment's frame [m], and red, green, blue from 0 to 1."""

    surface: Surface
    colour: Colour


@dataclass(frozen=True, eq=False)
class MassCapsule:
    """Shape of a segment without psurf: all points within a radius of some lines.

    Attributes:
        centre: centre of mass, where the lines begin, in the segment frame, shape (3,) [m].
        ends: ends of the lines, shape (k, 3) [m].
        radius: [m].
    """

    centre: Array
    ends: Array
    radius: float


def mass_capsule(figure: Figure, segment: Segment) -> MassCapsule | None:
    """Return the lines from a segment's centre of mass to its joints, and a radius around them.

    A line ends where the joint holds the child at zero, wherever curves of followers have it.
    A segment with one joint extends as far beyond its centre of mass as the joint is before it.
    The radius r is that of a capsule of the segment's mass m with the density of water around a
    line of the total length l from the centre of mass to all others: m / density =
    pi r^2 l + 4/3 pi r^3. None without a mass or centre of mass.
    """
    centre = segment.centre_of_mass
    if not segment.mass or segment.mass <= 0.0 or centre is None:
        return None
    ends = _joint_positions(figure, figure.joints.values(), segment)
    if len(ends) == 1:
        ends.append(2.0 * centre - ends[0])
    length = sum(float(np.linalg.norm(end - centre)) for end in ends)
    roots = np.roots([4.0 / 3.0 * pi, pi * length, 0.0, -segment.mass / DENSITY])
    return MassCapsule(centre, np.array(ends).reshape(-1, 3), float(roots.real.max()))


def _joint_positions(figure: Figure, joints: Iterable[Joint], segment: Segment) -> list[Array]:
    """Return where joints hold a segment, in its frame, once for each site [m].

    It is the segment's site, or where the site of the segment farther from the root is that a
    follower's curve moves away from it while all free displacements are zero.
    """
    found: dict[tuple[str, str], Array] = {}
    for joint in joints:
        if segment.name not in (joint.parent.segment, joint.child.segment):
            continue
        values = [0.0 if one is None else float(one.curve.at(0.0)) for one in joint.followers]
        inboard = _inboard_end(figure, joint) if any(values) else None
        for end in joint.ends:
            if end.segment != segment.name:
                continue
            pose = segment.sites[end.site].pose_in_segment
            if end is inboard:
                moved = Chain(joint.chain).pose(values)
                pose = pose @ (moved if end is joint.parent else inverse_pose(moved))
            found.setdefault((end.site, joint.name if end is inboard else ""), pose[:3, 3])
    return list(found.values())


def _inboard_end(figure: Figure, joint: Joint) -> SiteRef:
    """Return the end of a joint whose segment is fewer joints from the root."""
    reached = {figure.root.segment, *figure.ground}
    while not {end.segment for end in joint.ends} & reached:
        pairs = [{end.segment for end in one.ends} for one in figure.joints.values()]
        further = {name for pair in pairs if pair & reached for name in pair} - reached
        if not further:
            break
        reached |= further
    return joint.child if joint.parent.segment not in reached else joint.parent


def segment_appearances(figure: Figure) -> tuple[Mapping[str, Appearance], tuple[Loss, ...]]:
    """Return the appearances of segments, and the losses."""
    appearances: dict[str, Appearance] = {}
    unread, capsules, sticks = list[str](), list[str](), list[str]()
    for name, segment in figure.segments.items():
        surface = None
        if segment.psurf is not None:
            try:
                surface = read_segment_surface(figure, segment)
            except InputError as failure:
                unread.append(f"{name} ({failure.diagnostics[0].message})")
        if surface is None and (capsule := mass_capsule(figure, segment)) is not None:
            surface = _capsule_surface(capsule, name)
            capsules.append(name)
        elif surface is None and (ends := list(_stick_ends(figure, segment))):
            surface = _octahedra(ends, name)
            sticks.append(name)
        if surface is not None and surface.face_count:
            appearances[name] = Appearance(surface, segment_colour(figure, segment))
    losses = {
        "psurfs that could not be read": unread,
        "segments without a psurf are capsules of their mass": capsules,
        "segments without a psurf and a mass are sticks between their sites": sticks,
    }
    return appearances, tuple(
        Loss(what, tuple(names), effect=Effect.DESCRIPTION)
        for what, names in losses.items()
        if names
    )


def linear_colour(colour: Colour) -> Colour:
    """Convert a colour from sRGB to linear (IEC 61966-2-1)."""
    red, green, blue = (
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in colour
    )
    return red, green, blue


def _capsule_surface(capsule: MassCapsule, name: str) -> Surface:
    """Return a closed surface around each line of a capsule."""
    parts = [_corners_around_line(*ends, capsule.radius) for ends in _capsule_lines(capsule)]
    vertices: list[Array] = []
    faces: list[Sequence[int]] = []
    for points in parts:
        base, last = sum(map(len, vertices)), len(points) - 1
        rings = np.arange(1, last).reshape(-1, _SIDES)
        ahead = np.roll(rings, -1, axis=1)
        bands = np.stack([rings[:-1], ahead[:-1], ahead[1:], rings[1:]], axis=-1).reshape(-1, 4)
        first = np.stack([np.zeros(_SIDES, int), ahead[0], rings[0]], axis=-1)
        final = np.stack([np.full(_SIDES, last), rings[-1], ahead[-1]], axis=-1)
        faces += [face for part in (first, bands, final) for face in (base + part).tolist()]
        vertices.append(points)
    return Surface.from_faces(np.concatenate(vertices), faces, name)


def _capsule_lines(capsule: MassCapsule) -> Sequence[tuple[Array, Array]]:
    """Return the ends of the lines of a capsule; two that continue each other are one line."""
    arms = [end - capsule.centre for end in capsule.ends]
    arms = [arm for arm in arms if np.linalg.norm(arm) >= _MIN_SITE_DISTANCE]
    if not arms:
        return [(capsule.centre, capsule.centre)]
    if len(arms) == 2:
        one, other = (arm / np.linalg.norm(arm) for arm in arms)
        if np.linalg.norm(one + other) < _MAX_BEND:
            return [(capsule.centre + arms[0], capsule.centre + arms[1])]
    return [(capsule.centre, capsule.centre + arm) for arm in arms]


def _corners_around_line(tail: Array, head: Array, radius: float) -> Array:
    """Corners at a distance from a line [m]: the pole at its tail, rings, and the other pole."""
    along = head - tail
    is_line = bool(along.any())
    axes = rotation_with_z_axis(along) if is_line else np.eye(3)
    latitudes = 0.5 * np.pi * np.arange(_RINGS) / _RINGS
    longitudes = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    around = np.stack([np.cos(longitudes), np.sin(longitudes)], axis=1)
    rings = np.empty((_RINGS, _SIDES, 3))
    rings[..., :2] = radius * np.cos(latitudes)[:, None, None] * around
    rings[..., 2] = radius * np.sin(latitudes)[:, None]
    lower = (rings[::-1] * [1.0, 1.0, -1.0]).reshape(-1, 3)
    upper = rings[0 if is_line else 1 :].reshape(-1, 3)  # a sphere has one equator
    pole = np.array([[0.0, 0.0, radius]])
    at_tail, at_head = np.concatenate([-pole, lower]), np.concatenate([upper, pole])
    return np.concatenate([tail + at_tail @ axes.T, head + at_head @ axes.T])


def _stick_ends(figure: Figure, segment: Segment) -> Iterator[tuple[Array, Array]]:
    """From the first joint's site to those of the others; of a body with one, to all its sites."""
    moving = (one for one in figure.joints.values() if one.chain)
    used = _joint_positions(figure, moving, segment)
    points = _distinct_positions(used)
    if len(points) == 1 and segment.name not in figure.ground:
        sites = [site.pose_in_segment[:3, 3] for site in segment.sites.values()]
        points = _distinct_positions([*used, *sites])
    yield from ((points[0], other) for other in points[1:])


def _distinct_positions(points: Sequence[Array]) -> list[Array]:
    """Return the positions without those that are near an earlier one."""
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
