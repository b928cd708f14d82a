"""Surfaces of simple solids about their centres, whose axis is z."""

from collections.abc import Sequence

import numpy as np

from generator.geometry.surface import Array, Surface

SIDES = 24
"""Corners of each circle."""

RINGS_PER_QUARTER = 6
"""Rings of a sphere between its pole and its equator, the equator included."""

_BOX_FACES = (
    (0, 2, 3, 1),
    (4, 5, 7, 6),
    (0, 1, 5, 4),
    (2, 6, 7, 3),
    (0, 4, 6, 2),
    (1, 3, 7, 5),
)
"""Corner k is at x, y, z = -1 or 1 by the bits 1, 2, 4 of k."""


def box(x: float, y: float, z: float) -> Surface:
    """Return a box of these half lengths [m]."""
    corners = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)]) * 2.0 - 1.0
    return Surface.from_faces(corners * [x, y, z], _BOX_FACES)


def ellipsoid(x: float, y: float, z: float) -> Surface:
    """Return an ellipsoid of these half axes [m]; its vertices lie on it."""
    return Surface.from_faces(*_revolved(_arc(0.0, -1.0, 1.0), np.array([x, y, z])))


def sphere(radius: float) -> Surface:
    """Return a sphere [m]."""
    return ellipsoid(radius, radius, radius)


def cylinder(radius: float, half: float) -> Surface:
    """Return a cylinder of a half length [m]."""
    profile = [(0.0, -half), (radius, -half), (radius, half), (0.0, half)]
    return Surface.from_faces(*_revolved(profile, np.ones(3)))


def capsule(radius: float, half: float) -> Surface:
    """Return a cylinder of a half length with a half sphere at either end [m]."""
    profile = [(radius * r, radius * z - half) for r, z in _arc(0.0, -1.0, 0.0)]
    profile += [(radius * r, radius * z + half) for r, z in _arc(0.0, 0.0, 1.0)]
    return Surface.from_faces(*_revolved(profile, np.ones(3)))


def arrow(length: float, shaft_radius: float, head_radius: float, head_length: float) -> Surface:
    """Return an arrow along z from the origin, with its head, a cone, at the end [m]."""
    neck = length - head_length
    profile = [(0.0, 0.0), (shaft_radius, 0.0), (shaft_radius, neck), (head_radius, neck)]
    return Surface.from_faces(*_revolved([*profile, (0.0, length)], np.ones(3)))


def _arc(height: float, first: float, last: float) -> list[tuple[float, float]]:
    """Radii and heights of the unit circle from a pole or the equator to another.

    `first` and `last` are -1, 0 or 1: the lower pole, the equator, the upper pole.
    """
    count = round((last - first) * RINGS_PER_QUARTER)
    turns = np.linspace(first, last, count + 1)
    return [
        (0.0 if abs(turn) == 1.0 else float(np.cos(np.pi / 2.0 * turn)), height + float(at))
        for turn, at in zip(turns, np.sin(np.pi / 2.0 * turns), strict=True)
    ]


def _revolved(
    profile: Sequence[tuple[float, float]], scale: Array
) -> tuple[Array, list[tuple[int, ...]]]:
    """Return vertices and faces of a profile that turns about z, from the lower pole to the upper.

    Its first and last radius are zero.
    """
    rings = np.array(profile[1:-1])
    turns = 2.0 * np.pi * np.arange(SIDES) / SIDES
    circle = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    points = [
        np.concatenate([radius * circle, np.full((SIDES, 1), height)], axis=1)
        for radius, height in rings
    ]
    poles = [[[0.0, 0.0, profile[0][1]]], [[0.0, 0.0, profile[-1][1]]]]
    top = 1 + len(rings) * SIDES
    faces: list[tuple[int, ...]] = []
    for k in range(SIDES):
        after = (k + 1) % SIDES
        faces.append((0, 1 + after, 1 + k))
        for ring in range(len(rings) - 1):
            low, high = 1 + ring * SIDES, 1 + (ring + 1) * SIDES
            faces.append((low + k, low + after, high + after, high + k))
        last = top - SIDES
        faces.append((top, last + k, last + after))
    return np.concatenate([poles[0], *points, poles[1]]) * scale, faces
