"""Appearance of props: muted colours, and a sheet in place of what has no end."""

from typing import TYPE_CHECKING

import numpy as np

from generator.contact.shape import Shape
from generator.rotations import Array

if TYPE_CHECKING:
    from generator.geometry.surface import Surface

PROP_COLOUR, FLOOR_COLOUR = (0.60, 0.68, 0.78), (0.83, 0.83, 0.81)
"""Colours of props with an end and of those without, red, green and blue from 0 to 1."""

FORCE_COLOUR = (123 / 255, 44 / 255, 191 / 255)
"""Colour of arrows of contact forces, red, green and blue from 0 to 1."""

SHEET_MARGIN = 1.0
"""Distance by which a sheet extends beyond the points of a motion [m]."""


def prop_colour(shape: Shape) -> tuple[float, float, float]:
    """Return the colour of a prop, red, green and blue from 0 to 1."""
    return FLOOR_COLOUR if shape.is_endless else PROP_COLOUR


def prop_surface(shape: Shape, points: Array) -> "Surface":
    """Return the surface of a prop in its axes; of a plane a square sheet.

    Args:
        shape: Shape of the prop.
        points: Points of a motion in the world that a sheet extends beyond, shape (n, 3) [m].
    """
    from generator.geometry.surface import Surface  # slow

    surface = shape.surface()
    if surface is not None:
        return surface
    local = (points - shape.pose[:3, 3]) @ shape.pose[:3, :3]
    low, high = local.min(axis=0), local.max(axis=0)
    x, _, z = 0.5 * (low + high)
    half = 0.5 * float(max(high[0] - low[0], high[2] - low[2])) + SHEET_MARGIN
    corners = np.array([[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]])
    return Surface.from_faces(half * corners + [x, 0.0, z], [(0, 1, 2, 3)])


def is_level(shape: Shape) -> bool:
    """Return whether a shape is a floor: without an end, and with y of its axes up."""
    return shape.is_endless and bool(shape.pose[1, 1] > 1.0 - 1e-9)
