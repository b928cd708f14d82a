"""Vertices that lie at the same place, made one."""

from dataclasses import replace

import numpy as np

from generator.geometry.surface import LEAST, Surface


def with_joined_vertices(surface: Surface) -> tuple[Surface, int]:
    """The surface with one vertex at each place, and how many vertices were given up.

    Only exactly equal coordinates count. The vertex that stays is the first. A corner that follows
    itself goes, and so does a face of which fewer than three corners are left.
    """
    # A row of three floats, seen as one value, sorts several times faster than by columns.
    rows = np.ascontiguousarray(surface.vertices + 0.0).view(np.dtype((np.void, 24))).ravel()
    _, first, place = np.unique(rows, return_index=True, return_inverse=True)
    given_up = len(rows) - len(first)
    if given_up == 0:
        return surface, 0
    corners = first[place][surface.corners]
    following = first[place][surface.next_corners]
    kept = corners != following
    sizes = np.bincount(surface.face_of_corner[kept], minlength=surface.face_count)
    left = sizes >= LEAST
    kept &= left[surface.face_of_corner]
    text = surface.text and replace(surface.text, face_places=surface.text.face_places[left])
    starts = np.concatenate([[0], np.cumsum(sizes[left])])
    joined = replace(surface, corners=corners[kept], starts=starts, text=text)
    return joined, given_up
