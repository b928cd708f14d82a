"""Shaded picture of the moments of a motion, side by side, with boxes and contact forces."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from generator.contact.appearance import FLOOR_COLOUR, FORCE_COLOUR, PROP_COLOUR
from generator.contact.arrows import ArrowScale
from generator.contact.box import Box
from generator.contact.scene import Scene
from generator.contact.shape import Shape
from generator.figure import Figure
from generator.geometry.appearance import Colour, segment_appearances, triangles_with_normals
from generator.geometry.intersections import triangulate
from generator.geometry.primitives import arrow
from generator.geometry.surface import Surface, build_edges, build_tetrahedra
from generator.losses import Loss
from generator.rotations import Array

PROP, GROUND, FORCE = (*PROP_COLOUR, 0.0), (*FLOOR_COLOUR, 1.0), (*FORCE_COLOUR, 0.0)
"""Colours of boxes, of the floor and of arrows; the last component is 1 where shadows fall."""

_BEFORE_ALL = 1e4
"""Distance towards the viewer by which arrows are moved, so that they are over all else [m]."""

_LIGHT = np.array([-0.40, 0.55, 0.75])
"""Direction to the lamp, along the right, up and towards the viewer."""

_AMBIENT = 0.42
"""Brightness of a surface that faces away from the lamp."""

_SHADOW = 0.72
"""Brightness of what lies below something else, relative to the rest of it."""

_SHADOW_CELL, _SHADOW_GAP = 0.01, 0.03
"""Resolution of the shadows, and the least height of what shades a surface above it [m]."""

_MAX_SHADOW_CELLS = 2000
"""Largest number of cells of the shadows along an axis."""

_SHADED_SLOPE = 0.5
"""Least vertical component of the normal of a face on which shadows fall."""

_SAMPLES = 2
"""Samples of a pixel along each axis."""

_BATCH = 500_000
"""Samples that are computed at a time, for the memory."""

_LARGE_TRIANGLE = 20_000
"""Samples from which on a triangle is computed by itself, which is faster."""

_MAX_BAND_PIXELS = 1_000_000
"""Pixels that are drawn at a time, for the memory."""

_CREASE = 50.0
"""Angle between two faces from which on their edge is drawn sharp [deg]."""

_MAX_NEIGHBOURS = 20_000_000
"""Pairs of corners at one vertex in a surface whose edges may be sharp."""


@dataclass(frozen=True)
class View:
    """Parallel projection.

    Attributes:
        turn: angle of the viewer about the world's y from +z towards +x [rad].
        tilt: angle by which the viewer looks down [rad].
    """

    turn: float
    tilt: float

    @cached_property
    def axes(self) -> Array:
        """Directions to the right, up and towards the viewer, in rows, shape (3, 3)."""
        sine, cosine = np.sin(self.turn), np.cos(self.turn)
        down, level = np.sin(self.tilt), np.cos(self.tilt)
        return np.array(
            [
                [cosine, 0.0, -sine],
                [-down * sine, level, -down * cosine],
                [level * sine, down, level * cosine],
            ]
        )


@dataclass(frozen=True)
class Strip:
    """Arrangement of moments side by side.

    Attributes:
        view: view of every moment.
        spacing: spacing between moments, to the right [m].
        left: left edge, from the origin of the first moment [m].
        right: right edge, from the origin of the last moment [m].
        bottom: lower edge, from the origin [m].
        top: upper edge, from the origin [m].
        floor: range of the floor towards the viewer [m]; None for none.
        scale: pixels per metre.
        floor_height: height of the floor [m].
        floor_thickness: seen where the view is level [m].
    """

    view: View
    spacing: float
    left: float
    right: float
    bottom: float
    top: float
    floor: tuple[float, float] | None = (-0.8, 0.8)
    scale: float = 150.0
    floor_height: float = 0.0
    floor_thickness: float = 0.02

    def width(self, count: int) -> float:
        """Width of a strip of so many moments [m]."""
        return self.right - self.left + self.spacing * (count - 1)

    def extent(self, count: int) -> tuple[float, float, float, float]:
        """Edges of a strip of so many moments: left, right, bottom, top [m]."""
        return self.left, self.left + self.width(count), self.bottom, self.top

    def shape(self, count: int) -> tuple[int, int]:
        """Rows and columns of the picture of so many moments."""
        rows, columns = self.scale * (self.top - self.bottom), self.scale * self.width(count)
        return max(1, round(rows)), max(1, round(columns))


Poses = Mapping[str, Array]
"""Pose of each segment in the world at a moment, shape (4, 4)."""


@dataclass(frozen=True, eq=False)
class Body:
    """Triangles of a figure, in the axes of their segments.

    Attributes:
        segments: that have a surface.
        owners: index of the segment of each triangle, shape (n,).
        corners: corners of the triangles, counter-clockwise from outside [m], shape (n, 3, 3).
        normals: normals at the corners, shape (n, 3, 3).
        colours: colours of the triangles, red, green and blue from 0 to 1, shape (n, 3).
        losses: segments that are not drawn as their files say.
    """

    segments: tuple[str, ...]
    owners: NDArray[np.int64]
    corners: Array
    normals: Array
    colours: Array
    losses: tuple[Loss, ...]

    @classmethod
    def of_figure(cls, figure: Figure) -> "Body":
        """Return the body of a figure, in the colours of its segments."""
        appearances, losses = segment_appearances(figure)
        surfaces = {name: each.surface for name, each in appearances.items()}
        colours = [each.colour for each in appearances.values()]
        return cls.of_surfaces(surfaces, colours, losses)

    @classmethod
    def of_surfaces(
        cls,
        surfaces: Mapping[str, Surface],
        colours: Sequence[Colour],
        losses: tuple[Loss, ...] = (),
    ) -> "Body":
        """Return the body of surfaces by segment, a colour each."""
        corners = [_outward_triangles(surface) for surface in surfaces.values()]
        counts = [len(each) for each in corners]
        return cls(
            segments=tuple(surfaces),
            owners=np.repeat(np.arange(len(counts)), counts),
            corners=np.concatenate([np.empty((0, 3, 3)), *corners]),
            normals=np.concatenate([np.empty((0, 3, 3)), *map(_corner_normals, corners)]),
            colours=np.repeat(np.array(colours).reshape(-1, 3), counts, axis=0),
            losses=losses,
        )

    def place(self, poses: Poses) -> tuple[Array, Array]:
        """Return the corners and the normals in the world, shape (n, 3, 3) each."""
        if not self.segments:
            return self.corners, self.normals
        each = np.array([poses[name] for name in self.segments])[self.owners]
        turns = np.swapaxes(each[:, :3, :3], 1, 2)
        return self.corners @ turns + each[:, None, :3, 3], self.normals @ turns


def _outward_triangles(surface: Surface) -> Array:
    """Triangles of the faces, counter-clockwise from outside; of an open surface on both sides."""
    corners, _ = triangulate(surface)
    flipped = corners[:, ::-1]
    edges = build_edges(surface)
    if len(edges.boundary) or edges.same_direction.any():
        return np.concatenate([corners, flipped])
    return flipped if build_tetrahedra(surface).volume < 0.0 else corners


def _corner_normals(triangles: Array) -> Array:
    """Unit normals at the corners of triangles, shape (n, 3, 3), equal across smooth edges."""
    areas = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    units = areas / np.maximum(np.linalg.norm(areas, axis=1), 1e-300)[:, None]
    owner = np.repeat(np.arange(len(triangles)), 3)
    _, vertex = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    order = np.argsort(vertex, kind="stable")
    counts = np.bincount(vertex)
    if int(counts @ counts) > _MAX_NEIGHBOURS:
        return np.repeat(units[:, None], 3, axis=1)
    # Each corner with all corners at its vertex.
    firsts, sizes = (np.cumsum(counts) - counts)[vertex], counts[vertex]
    one = np.repeat(np.arange(len(vertex)), sizes)
    place = np.arange(len(one)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    other = owner[order[firsts[one] + place]]
    smooth = np.sum(units[owner[one]] * units[other], axis=1) > np.cos(np.radians(_CREASE))
    one, other = one[smooth], other[smooth]
    normals = np.stack(
        [np.bincount(one, areas[other, axis], len(vertex)) for axis in range(3)], axis=-1
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    return normals.reshape(-1, 3, 3)


@dataclass(frozen=True)
class _Triangles:
    """Triangles, shape (n, 3, 3), and the colour of each corner, shape (n, 3, 4).

    The last component of a colour is 1 where shadows fall, else 0.
    """

    corners: Array
    colours: Array


def poses_at(poses: Mapping[str, Array], frames: Sequence[int]) -> list[Poses]:
    """Return the poses of segments at frames of a motion, from those of all, shape (n, 4, 4)."""
    return [{name: each[frame] for name, each in poses.items()} for frame in frames]


def arrow_triangles(ends: Array, scale: ArrowScale) -> Array:
    """Return the triangles of arrows, counter-clockwise from outside, shape (n, 3, 3) [m].

    Args:
        ends: Tails and tips of k arrows, shape (k, 2, 3) [m].
        scale: Scale of the arrows.
    """
    made: list[Array] = [np.empty((0, 3, 3))]
    corners = _outward_triangles(arrow(3.0, scale.shaft_radius, scale.head_radius, 1.0))
    for tail, tip in ends:
        along = (tip - tail) / (length := float(np.linalg.norm(tip - tail)))
        head = min(scale.head_length, 0.6 * length)
        neck, placed = length - head, corners * (head / scale.head_length)  # short ones are slim
        placed[..., 2] = np.interp(corners[..., 2], [0.0, 2.0, 3.0], [0.0, neck, length])
        right = np.cross(np.eye(3)[np.argmin(np.abs(along))], along)
        right /= np.linalg.norm(right)
        made.append(placed @ np.stack([right, np.cross(along, right), along]) + tail)
    return np.concatenate(made)


def draw_moments(
    body: Body,
    moments: Sequence[Poses],
    strip: Strip,
    scene: Scene,
    arrows: Sequence[Array] = (),
) -> NDArray[np.uint8]:
    """Draw moments from left to right, shape (height, width, 4), rows from above.

    Planes of the scene are not drawn. The floor is as wide as the picture. What is above the floor
    or a prop casts a shadow straight down. `arrows` are triangles of each moment, or none; they are
    drawn over all else.
    """
    view, fine = strip.view, _SAMPLES * strip.scale
    height, width = strip.shape(len(moments))
    shapes = [prop.shape for prop in scene.props]
    parts: list[_Triangles] = []
    for place, poses in enumerate(moments):
        shift = place * strip.spacing * view.axes[0]
        corners, normals = body.place(poses)
        own = _Triangles(corners, _lit(normals, body.colours[:, None], np.zeros(1), view))
        for part in (own, *(_shape_triangles(shape, PROP, view) for shape in shapes)):
            parts.append(_Triangles(part.corners + shift, part.colours))
    shades = _Shades.below(np.concatenate([part.corners for part in parts]))
    if strip.floor is not None:
        parts.append(_floor_triangles(strip, len(moments)))
    for place, triangles in enumerate(arrows):
        shift = place * strip.spacing * view.axes[0] + _BEFORE_ALL * view.axes[2]
        colours = np.broadcast_to(FORCE, (*triangles.shape[:2], 4))
        parts.append(_Triangles(triangles + shift, colours))
    corners = np.concatenate([part.corners for part in parts])
    colours = np.concatenate([part.colours for part in parts])
    shift = np.array([strip.left, strip.bottom, 0.0])
    screen = (corners @ view.axes.T - shift) * np.array([fine, fine, 1.0])
    towards = np.cross(screen[:, 1] - screen[:, 0], screen[:, 2] - screen[:, 0])[:, 2] > 0.0
    screen, colours = screen[towards], colours[towards].astype(np.float32)
    rows = max(1, _MAX_BAND_PIXELS // width)
    bands: list[NDArray[np.uint8]] = []
    for low in range(0, height, rows):
        count = min(rows, height - low)
        start = np.array([0.5, _SAMPLES * low + 0.5, 0.0])  # samples stand in the middle
        depth, picture = rasterize(screen - start, colours, (count * _SAMPLES, width * _SAMPLES))
        row, column = np.nonzero(picture[..., 3])
        x, y = (column + start[0]) / fine, (row + start[1]) / fine
        world = np.stack([x, y, depth[row, column]], axis=-1) + shift
        shaded = shades.cover(world @ view.axes)
        picture[row[shaded], column[shaded]] *= _SHADOW
        picture[..., 3] = depth > -np.inf
        pixels = np.zeros((count, width, 4))
        for i, j in product(range(_SAMPLES), repeat=2):
            pixels += picture[i::_SAMPLES, j::_SAMPLES]
        pixels[..., :3] *= 255.0 / np.maximum(pixels[..., 3:], 1.0)
        pixels[..., 3] *= 255.0 / _SAMPLES**2
        bands.append(np.round(pixels).astype(np.uint8))
    return np.concatenate(bands)[::-1]


def _lit(normals: Array, colours: Array, shaded: Array, view: View) -> Array:
    """Colours of surfaces by their normals, shape (..., 4); shadows fall where `shaded` is 1."""
    lamp = (_LIGHT / np.linalg.norm(_LIGHT)) @ view.axes
    brightness = _AMBIENT + (1.0 - _AMBIENT) * (0.5 + 0.5 * normals @ lamp) ** 1.3
    marks = np.broadcast_to(shaded, (*brightness.shape, 1))
    return np.concatenate([brightness[..., None] * colours, marks], axis=-1)


def _shape_triangles(shape: Shape, colour: tuple[float, ...], view: View) -> _Triangles:
    """Triangles of the faces of a shape; none of one without an end."""
    surface = shape.surface()
    if surface is None:
        return _Triangles(np.zeros((0, 3, 3)), np.zeros((0, 3, 4)))
    corners, normals = triangles_with_normals(surface)
    outward = normals @ shape.pose[:3, :3].T
    shaded = (outward[:, 1:2] > _SHADED_SLOPE).astype(float)
    placed = corners @ shape.pose[:3, :3].T + shape.pose[:3, 3]
    colours = _lit(outward, np.array(colour[:3]), shaded, view)
    return _Triangles(placed.reshape(-1, 3, 3), colours.reshape(-1, 3, 4))


def _floor_triangles(strip: Strip, count: int) -> _Triangles:
    """Top and sides of a slab from edge to edge of the strip."""
    view, width = strip.view, strip.width(count)
    back, front = strip.floor or (0.0, 0.0)
    right, near = view.axes[0], np.cross(view.axes[0], (0.0, 1.0, 0.0))
    centre = (strip.left + 0.5 * width) * right + 0.5 * (back + front) * near
    x, _, z = centre.tolist()
    middle = (x, strip.floor_height - 0.5 * strip.floor_thickness, z)
    size = (width, strip.floor_thickness, front - back)
    slab = _shape_triangles(Box(middle, size, (0.0, view.turn, 0.0)), GROUND, view)
    top = slab.colours[..., 3] == 1.0
    slab.colours[top] = GROUND
    return slab


def rasterize(
    corners: Array, values: NDArray[np.floating], shape: tuple[int, int]
) -> tuple[Array, NDArray[np.floating]]:
    """Depth, shape (rows, columns), -inf without a triangle, and interpolated values, (..., k).

    Args:
        corners: column, row and depth of the corners of n triangles, shape (n, 3, 3); the largest
            depth is in front.
        values: values at the corners, shape (n, 3, k).
        shape: rows and columns.
    """
    depth = np.full(shape, -np.inf)
    picture = np.zeros((*shape, values.shape[-1]), dtype=values.dtype)
    flat = corners[..., :2]
    first = np.maximum(np.ceil(flat.min(axis=1)), 0.0).astype(int)
    last = np.minimum(np.floor(flat.max(axis=1)) + 1.0, shape[::-1]).astype(int)
    edge, other = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    doubled_area = edge[:, 0] * other[:, 1] - edge[:, 1] * other[:, 0]
    sizes = np.maximum(last - first, 0)
    counts = np.where(doubled_area != 0.0, sizes.prod(axis=1), 0)
    heights, rises = corners[:, 0, 2], corners[:, 1:, 2] - corners[:, :1, 2]
    slopes = values[:, 1:] - values[:, :1]
    for k in np.flatnonzero(counts > _LARGE_TRIANGLE).tolist():
        (left, low), (right, high) = first[k].tolist(), last[k].tolist()
        area = (slice(low, high), slice(left, right))
        x = np.arange(left, right, dtype=np.float64) - flat[k, 0, 0]
        y = np.arange(low, high, dtype=np.float64)[:, None] - flat[k, 0, 1]
        second = (x * other[k, 1] - y * other[k, 0]) / doubled_area[k]
        third = (y * edge[k, 0] - x * edge[k, 1]) / doubled_area[k]
        own = heights[k] + second * rises[k, 0] + third * rises[k, 1]
        front = (second >= -1e-9) & (third >= -1e-9) & (second + third <= 1.0 + 1e-9)
        front &= own > depth[area]
        depth[area][front] = own[front]
        second, third = second[front][:, None], third[front][:, None]
        picture[area][front] = values[k, 0] + second * slopes[k, 0] + third * slopes[k, 1]
    counts[counts > _LARGE_TRIANGLE] = 0
    batches = np.cumsum(counts) // _BATCH
    for batch in np.unique(batches[counts > 0]):
        which = np.flatnonzero((batches == batch) & (counts > 0))
        k = np.repeat(which, counts[which])
        index = np.arange(len(k)) - np.repeat(
            np.cumsum(counts[which]) - counts[which], counts[which]
        )
        column = first[k, 0] + index % sizes[k, 0]
        row = first[k, 1] + index // sizes[k, 0]
        x, y = column - flat[k, 0, 0], row - flat[k, 0, 1]
        second = (x * other[k, 1] - y * other[k, 0]) / doubled_area[k]
        third = (y * edge[k, 0] - x * edge[k, 1]) / doubled_area[k]
        inside = (second >= -1e-9) & (third >= -1e-9) & (second + third <= 1.0 + 1e-9)
        k, row, column = k[inside], row[inside], column[inside]
        second, third = second[inside], third[inside]
        own = heights[k] + second * rises[k, 0] + third * rises[k, 1]
        front = np.flatnonzero(own > depth[row, column])
        # Of several values for a pixel the last is kept.
        order = front[np.argsort(own[front], kind="stable")]
        target = row[order], column[order]
        depth[target] = own[order]
        k, second, third = k[order], second[order, None], third[order, None]
        picture[target] = values[k, 0] + second * slopes[k, 0] + third * slopes[k, 1]
    return depth, picture


@dataclass(frozen=True, eq=False)
class _Shades:
    """Height of the uppermost solid over each cell of a level grid.

    Attributes:
        low: x, y and z at the lowest corner of all solids [m].
        cell: edge of a cell [m].
        heights: heights above `low` [m], -inf without a solid, rows along z, columns along x.
    """

    low: Array
    cell: float
    heights: Array

    @classmethod
    def below(cls, solids: Array) -> "_Shades":
        """Return the shades of triangles, shape (n, 3, 3)."""
        if not len(solids):
            return cls(np.zeros(3), _SHADOW_CELL, np.full((1, 1), -np.inf))
        low, size = solids.min(axis=(0, 1)), np.ptp(solids, axis=(0, 1))
        cell = max(_SHADOW_CELL, float(size.max()) / _MAX_SHADOW_CELLS)
        cells = np.ceil(size / cell).astype(int) + 1
        above = (solids[..., [0, 2, 1]] - low[[0, 2, 1]]) / np.array([cell, cell, 1.0])
        heights, _ = rasterize(above, above[..., :0], (int(cells[2]), int(cells[0])))
        return cls(low, cell, heights)

    def cover(self, points: Array) -> NDArray[np.bool_]:
        """Return whether points in the world, shape (n, 3), are in the shade."""
        rows, columns = self.heights.shape
        column, row = (
            ((points[:, k] - self.low[k]) / self.cell).round().astype(int) for k in (0, 2)
        )
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        found = np.full(len(points), -np.inf)
        found[inside] = self.heights[row[inside], column[inside]] + self.low[1]
        return found > points[:, 1] + _SHADOW_GAP
