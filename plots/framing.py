"""Framing of pictures: the size of a picture, and the arrangement that shows all moments whole."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite, radians

import numpy as np

from generator.contact.appearance import is_level
from generator.contact.scene import Scene
from generator.diagnostics import MoverError, UsageError
from generator.rotations import Array
from plots.figure_image import Body, Poses, Strip, View

VIEWS: Mapping[str, tuple[float, float]] = {
    "front": (0.0, 0.0),
    "side": (-90.0, 0.0),
    "back": (180.0, 0.0),
    "top": (-90.0, 90.0),
    "three-quarter": (-50.0, 12.0),
}
"""Turn and tilt of the viewer by name [deg], for a figure that faces +z."""

DEFAULT_SIZE = (1600, 600)
"""Largest width and height of a picture whose size is not asked for [pixels]."""

MAX_PIXELS = 20_000_000

SCREEN_DPI, PRINT_DPI = 100.0, 300.0
"""Default resolution of pictures with a width in pixels, and in units of length [dots/inch]."""

_UNITS: Mapping[str, float] = {"cm": 1.0 / 2.54, "mm": 0.1 / 2.54, "in": 1.0}
"""Units of length of a width [inch]."""

_MARGIN, _GAP, _FLOOR_MARGIN = 0.03, 0.08, 0.15
"""Margin of a picture, gap between moments, and margin of the floor, relative to the extent."""

_NO_ARROWS = np.empty((0, 3, 3))

_FLOOR_THICKNESS = 0.012
"""Of the floor, relative to the extent of what stands on it."""


@dataclass(frozen=True)
class Size:
    """Size of a picture.

    Attributes:
        width: [pixels]; None for the largest that fits `DEFAULT_SIZE`.
        scale: [pixels/m]; None for that of the width.
        dpi: [dots/inch].
    """

    width: int | None = None
    scale: float | None = None
    dpi: float = SCREEN_DPI

    def pixels_per_metre(self, width: float, height: float) -> float:
        """Scale of a picture of a width and a height [m]. Raises UsageError if it is too large."""
        scale = self.scale
        if scale is None and self.width is not None:
            scale = self.width / width
        if scale is None:
            scale = min(DEFAULT_SIZE[0] / width, DEFAULT_SIZE[1] / height)
        columns, rows = scale * width, scale * height
        if not (min(columns, rows) >= 0.5 and columns * rows <= MAX_PIXELS):
            raise UsageError(
                f"the picture would have {columns:.0f} x {rows:.0f} pixels; "
                f"it can have 1 to {MAX_PIXELS:,}"
            )
        return scale


_WIDTH = re.compile(r"\s*([0-9]*\.?[0-9]+)\s*([a-z]*)\s*")


def size_from_options(width: str | None, scale: float | None, dpi: float | None) -> Size:
    """Parse the size of a picture. Raises UsageError."""
    if width is not None and scale is not None:
        raise UsageError("--width and --scale exclude each other")
    if scale is not None and not (isfinite(scale) and scale > 0.0):
        raise UsageError(f"--scale {scale:g}: expected pixels per metre, above zero")
    if dpi is not None and not 10.0 <= dpi <= 2400.0:
        raise UsageError(f"--dpi {dpi:g}: expected 10 to 2400 dots per inch")
    if width is None:
        return Size(None, scale, dpi or SCREEN_DPI)
    match = _WIDTH.fullmatch(width)
    if match is None or match[2] not in ("", "px", *_UNITS):
        raise UsageError(f"--width {width}: expected a width such as 640, 8cm, 85mm or 3.3in")
    number = float(match[1])
    if match[2] in _UNITS:
        dpi = dpi or PRINT_DPI
        number *= _UNITS[match[2]] * dpi
    if not 1.0 <= number <= MAX_PIXELS:
        raise UsageError(f"--width {width}: expected 1 pixel or more")
    return Size(round(number), None, dpi or SCREEN_DPI)


def view_from_options(name: str, turn: float | None, tilt: float | None) -> View:
    """View of a name, with another turn or tilt [deg]. Raises UsageError."""
    for option, angle, largest in (("--turn", turn, 360.0), ("--tilt", tilt, 90.0)):
        if angle is not None and not abs(angle) <= largest:
            raise UsageError(f"{option} {angle:g}: expected -{largest:g} to {largest:g} deg")
    own_turn, own_tilt = VIEWS[name]
    return View(
        radians(own_turn if turn is None else turn), radians(own_tilt if tilt is None else tilt)
    )


def floor_height(scene: Scene, floor: bool) -> float | None:
    """Height of the floor [m]: that of a level plane of the scene, or zero; None without one."""
    for prop in scene.props:
        if is_level(prop.shape):
            return float(prop.shape.pose[1, 3])
    return 0.0 if floor else None


def bounds(body: Body, poses: Poses, scene: Scene, view: View, arrows: Array = _NO_ARROWS) -> Array:
    """Least and largest coordinates of a body, of props and of arrows, shape (2, 3) [m].

    Along the right and the upper direction of the view, and level towards the viewer. Raises
    MoverError if there is nothing to draw.
    """
    right, up, _ = view.axes
    points = [body.place(poses)[0].reshape(-1, 3), arrows.reshape(-1, 3)]
    for prop in scene.props:
        if (surface := prop.shape.surface()) is not None:
            pose = prop.shape.pose
            points.append(surface.vertices @ pose[:3, :3].T + pose[:3, 3])
    seen = np.concatenate(points) @ np.stack([right, up, np.cross(right, (0.0, 1.0, 0.0))]).T
    if not len(seen):
        raise MoverError("there is nothing to draw: no segment has a psurf, a mass or two sites")
    return np.stack([seen.min(axis=0), seen.max(axis=0)])


def frame_moments(moments: Sequence[Array], view: View, floor: float | None) -> Strip:
    """Return the arrangement that shows all moments whole, without overlap; its scale is 1.

    Each moment stands at an equal distance from the one before, so that travel is seen.

    Args:
        moments: bounds of each.
        view: view of every moment.
        floor: height of the floor [m]; None for none.
    """
    low, high = np.array([each[0] for each in moments]), np.array([each[1] for each in moments])
    extent = float(max((high - low)[:, :2].max(), 1e-6))
    spacing = 0.0
    if len(moments) > 1:
        spacing = max(float((high[:-1, 0] - low[1:, 0]).max()) + _GAP * extent, 0.0)
    shifts = spacing * np.arange(len(moments))
    margin = _MARGIN * extent
    bottom, top = float(low[:, 1].min()), float(high[:, 1].max())
    ground: tuple[float, float] | None = None
    thickness = _FLOOR_THICKNESS * extent
    if floor is not None:
        room = _FLOOR_MARGIN * extent
        ground = float(low[:, 2].min()) - room, float(high[:, 2].max()) + room
        margin = max(margin, 0.5 * room)
        edges = [floor * np.cos(view.tilt) - along * np.sin(view.tilt) for along in ground]
        bottom = min(bottom, min(edges) - thickness * np.cos(view.tilt))
        top = max(top, *edges)
    return Strip(
        view,
        spacing,
        left=float((low[:, 0] + shifts).min()) - margin,
        right=float((high[:, 0] + shifts).max()) - float(shifts[-1]) + margin,
        bottom=bottom - _MARGIN * extent,
        top=top + _MARGIN * extent,
        floor=ground,
        scale=1.0,
        floor_height=floor or 0.0,
        floor_thickness=thickness,
    )


def scaled(strip: Strip, count: int, size: Size) -> Strip:
    """Return the arrangement of so many moments at the scale of a size. Raises UsageError."""
    scale = size.pixels_per_metre(strip.width(count), strip.top - strip.bottom)
    return replace(strip, scale=scale)
