"""Shaded picture of the moments of a motion, side by side, with the boxes of the scene."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, product

import numpy as np
from numpy.typing import NDArray

from generator.figure import Figure
from generator.geometry.read import read_segment_surface
from generator.recording import Recording
from generator.rotations import Array
from generator.scene import Box, Scene

SKIN, PROP, GROUND = (0.97, 0.71, 0.54, 0.0), (0.60, 0.68, 0.78, 0.0), (0.83, 0.83, 0.81, 1.0)
"""Colours of the figure, of boxes and of the floor; the last component is 1 where shadows fall."""

_LIGHT = np.array([-0.40, 0.55, 0.75])
"""Direction to the lamp, along the right, up and towards the viewer."""

_AMBIENT = 0.42
"""Brightness of a surface that faces away from the lamp."""

_SHADOW = 0.72
"""Brightness of what lies below something else, relative to the rest of it."""

_SHADOW_CELL, _SHADOW_GAP = 0.01, 0.03
"""Resolution of the shadows, and the least height of what shades a surface above it [m]."""

_SHADED_SLOPE = 0.5
"""Least vertical component of the normal of a face on which shadows fall."""

_SAMPLES = 2
"""Samples of a pixel along each axis."""

_BATCH = 500_000
"""Samples that are computed at a time, for the memory."""


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
        view: of every moment.
        spacing: between moments, to the right [m].
        left: left edge, from the origin of the first moment [m].
        right: right edge, from the origin of the last moment [m].
        bottom: lower edge, from the origin [m].
        top: upper edge, from the origin [m].
        floor: range of the floor towards the viewer [m]; None for none.
        scale: pixels per metre.
    """

    view: View
    spacing: float
    left: float
    right: float
    bottom: float
    top: float
    floor: tuple[float, float] | None = (-0.8, 0.8)
    scale: float = 150.0

    def width(self, count: int) -> float:
        """Width of a strip of so many moments [m]."""
        return self.right - self.left + self.spacing * (count - 1)


@dataclass(frozen=True)
class _Triangles:
    """Triangles, shape (n, 3, 3), and the colour of each corner, shape (n, 3, 4).

    The last component of a colour is 1 where shadows fall, else 0.
    """

    corners: Array
    colours: Array


def strip_image(
    figure: Figure, recording: Recording, frames: Sequence[int], strip: Strip, scene: Scene
) -> NDArray[np.uint8]:
    """Draw frames of a motion from left to right, shape (height, width, 4), rows from above.

    Planes of the scene are not drawn. The floor, at the height zero, is as wide as the picture.
    What is above the floor or a box casts a shadow straight down.
    """
    view, fine = strip.view, _SAMPLES * strip.scale
    height = round(strip.scale * (strip.top - strip.bottom))
    width = round(strip.scale * strip.width(len(frames)))
    boxes = [prop.shape for prop in scene.props if isinstance(prop.shape, Box)]
    parts: list[_Triangles] = []
    for place, frame in enumerate(frames):
        shift = place * strip.spacing * view.axes[0]
        for part in (
            _figure_triangles(figure, recording, frame, view),
            *(_box_triangles(box, view) for box in boxes),
        ):
            parts.append(_Triangles(part.corners + shift, part.colours))
    solids = np.concatenate([part.corners for part in parts])
    if strip.floor is not None:
        parts.append(_floor_triangles(strip, len(frames)))
    corners = np.concatenate([part.corners for part in parts])
    colours = np.concatenate([part.colours for part in parts])
    shift = np.array([strip.left, strip.bottom, 0.0])
    screen = (corners @ view.axes.T - shift) * np.array([fine, fine, 1.0])
    towards = np.cross(screen[:, 1] - screen[:, 0], screen[:, 2] - screen[:, 0])[:, 2] > 0.0
    shape = (height * _SAMPLES, width * _SAMPLES)
    depth, picture = rasterize(screen[towards], colours[towards], shape)
    row, column = np.nonzero(picture[..., 3])
    world = np.stack([column / fine, row / fine, depth[row, column]], axis=-1) + shift
    picture[row, column, :3] *= _shadows(solids, world @ view.axes)[:, None]
    picture[..., 3] = np.isfinite(depth)
    pixels = picture.reshape(height, _SAMPLES, width, _SAMPLES, 4).mean(axis=(1, 3))
    pixels[..., :3] /= np.maximum(pixels[..., 3:], 1e-9)
    return np.asarray(np.round(255.0 * pixels[::-1]), dtype=np.uint8)


def _lit(normals: Array, colour: tuple[float, ...], view: View) -> Array:
    """Colours of surfaces by their normals, shape (..., 4)."""
    lamp = (_LIGHT / np.linalg.norm(_LIGHT)) @ view.axes
    brightness = _AMBIENT + (1.0 - _AMBIENT) * (0.5 + 0.5 * normals @ lamp) ** 1.3
    return np.concatenate(
        [
            brightness[..., None] * np.array(colour[:3]),
            np.full((*brightness.shape, 1), colour[3]),
        ],
        axis=-1,
    )


def _figure_triangles(figure: Figure, recording: Recording, frame: int, view: View) -> _Triangles:
    """Triangles of all segments that have a surface, at a frame."""
    corners, colours = [np.empty((0, 3, 3))], [np.empty((0, 3, 4))]
    for name, segment in figure.segments.items():
        if segment.psurf is None:
            continue
        surface = read_segment_surface(figure, segment)
        pose = recording.poses[name][frame]
        vertices = surface.vertices @ pose[:3, :3].T + pose[:3, 3]
        fans = ([(f[0], f[k], f[k + 1]) for k in range(1, len(f) - 1)] for f in surface.faces)
        indices = np.array(list(chain.from_iterable(fans)))
        triangles = vertices[indices]
        areas = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normals = np.zeros_like(vertices)
        np.add.at(normals, indices, areas[:, None])
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
        corners.append(triangles)
        colours.append(_lit(normals, SKIN, view)[indices])
    return _Triangles(np.concatenate(corners), np.concatenate(colours))


def _box_triangles(box: Box, view: View) -> _Triangles:
    """Two triangles of each face of a box."""
    corners: list[Array] = []
    colours: list[Array] = []
    for axis, side in product(range(3), (-1.0, 1.0)):
        normal = np.zeros(3)
        normal[axis] = side
        square = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        if (side > 0.0) == (axis == 1):  # counter-clockwise seen from outside
            square = square[::-1]
        local = 0.5 * np.insert(square, axis, side, axis=1) * np.array(box.size)
        placed = local @ box.pose[:3, :3].T + box.pose[:3, 3]
        corners += [placed[[0, 1, 2]], placed[[0, 2, 3]]]
        outward = box.pose[:3, :3] @ normal
        colour = _lit(outward, PROP, view)
        colour[3] = float(outward[1] > _SHADED_SLOPE)
        colours += [np.tile(colour, (3, 1))] * 2
    return _Triangles(np.array(corners), np.array(colours))


def _floor_triangles(strip: Strip, count: int) -> _Triangles:
    """Two triangles from edge to edge of the strip."""
    right, near = strip.view.axes[0], np.cross(strip.view.axes[0], (0.0, 1.0, 0.0))
    start, stop = strip.left, strip.left + strip.width(count)
    back, front = strip.floor or (0.0, 0.0)
    square = ((start, front), (stop, front), (stop, back), (start, back))
    corners = np.array([across * right + along * near for across, along in square])
    return _Triangles(corners[[[0, 1, 2], [0, 2, 3]]], np.tile(np.array(GROUND), (2, 3, 1)))


def rasterize(corners: Array, values: Array, shape: tuple[int, int]) -> tuple[Array, Array]:
    """Depth, shape (rows, columns), -inf without a triangle, and interpolated values, (..., k).

    Args:
        corners: column, row and depth of the corners of n triangles, shape (n, 3, 3); the largest
            depth is in front.
        values: at the corners, shape (n, 3, k).
        shape: rows and columns.
    """
    depth = np.full(shape, -np.inf)
    picture = np.zeros((*shape, values.shape[-1]))
    flat = corners[..., :2]
    first = np.maximum(np.ceil(flat.min(axis=1)), 0.0).astype(int)
    last = np.minimum(np.floor(flat.max(axis=1)) + 1.0, shape[::-1]).astype(int)
    edge, other = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    doubled_area = edge[:, 0] * other[:, 1] - edge[:, 1] * other[:, 0]
    sizes = np.maximum(last - first, 0)
    counts = np.where(doubled_area != 0.0, sizes.prod(axis=1), 0)
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
        weights = np.stack([1.0 - second - third, second, third], axis=-1)
        own = np.sum(weights * corners[k, :, 2], axis=-1)
        front = (weights.min(axis=-1) >= -1e-9) & (own > depth[row, column])
        # Of several values for a pixel the last is kept.
        order = np.flatnonzero(front)[np.argsort(own[front], kind="stable")]
        target = row[order], column[order]
        depth[target] = own[order]
        picture[target] = np.einsum("ij,ijk->ik", weights[order], values[k[order]])
    return depth, picture


def _shadows(solids: Array, points: Array) -> Array:
    """Brightness of points in the world below solids, shape of `points` without its last axis."""
    low = solids.min(axis=(0, 1))
    cells = np.ceil((solids.max(axis=(0, 1)) - low) / _SHADOW_CELL).astype(int) + 1
    above = (solids[..., [0, 2, 1]] - low[[0, 2, 1]]) / np.array([_SHADOW_CELL, _SHADOW_CELL, 1.0])
    heights, _ = rasterize(above, above[..., :0], (cells[2], cells[0]))
    column, row = (((points[:, k] - low[k]) / _SHADOW_CELL).round().astype(int) for k in (0, 2))
    inside = (column >= 0) & (column < cells[0]) & (row >= 0) & (row < cells[2])
    found = np.full(len(points), -np.inf)
    found[inside] = heights[row[inside], column[inside]] + low[1]
    return np.where(found > points[:, 1] + _SHADOW_GAP, _SHADOW, 1.0)
