"""A surface of polygons: vertices, faces, and how a sentence calls them.

Vertices that lie at the same place, made one.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.diagnostics import Source, Span

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

MIN_FACE_CORNERS = 3
"""Corners of the smallest face."""


@dataclass(frozen=True, eq=False)
class SurfaceText:
    """Where a surface is written, and how its file counts.

    Attributes:
        source: the text.
        face_spans: start and end of each face in it, shape (m, 2).
        block_starts: index of the first vertex of each block; vertices are counted from 1 in each.
    """

    source: Source
    face_spans: Indices
    block_starts: Indices


@dataclass(frozen=True, eq=False)
class Surface:
    """Polygons over shared vertices, counter-clockwise seen from outside.

    All faces lie one behind the other in `corners`, so that a hundred thousand of them are two
    arrays. Whether they enclose a body is for `solid_of` to say.

    Attributes:
        vertices: [m], shape (n, 3); some may be unused.
        corners: indices of the vertices of all faces, from 0, shape (k,).
        starts: where in `corners` each face begins, and the end of the last, shape (m + 1,).
        name: what sentences call the surface: its file.
        text: where it is written; None for what comes from no text.
    """

    vertices: Array
    corners: Indices
    starts: Indices
    name: str = "the surface"
    text: SurfaceText | None = None

    def __post_init__(self) -> None:
        """Refuse vertices that are no points, and faces with too few corners or unknown ones."""
        arrays: tuple[tuple[str, NDArray[np.generic]], ...] = (
            ("vertices", np.array(self.vertices, dtype=np.float64)),
            ("corners", np.array(self.corners, dtype=np.int64)),
            ("starts", np.array(self.starts, dtype=np.int64)),
        )
        for name, array in arrays:
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 3:
            raise ValueError(f"vertices have shape (n, 3), not {self.vertices.shape}")
        if not np.isfinite(self.vertices).all():
            raise ValueError("the coordinates of a vertex are finite")
        if self.starts[0] != 0 or self.starts[-1] != len(self.corners):
            raise ValueError("the faces must cover their corners")
        if (self.corner_counts < MIN_FACE_CORNERS).any():
            raise ValueError("a face has three corners or more")
        if len(self.corners) and not 0 <= self.corners.min() <= self.corners.max() < len(
            self.vertices
        ):
            raise ValueError(f"a corner is none of the {len(self.vertices)} vertices")

    @classmethod
    def from_faces(
        cls,
        vertices: ArrayLike,
        faces: Iterable[Sequence[int]] | Indices,
        name: str = "the surface",
    ) -> "Surface":
        """The surface of `vertices` [m], shape (n, 3), and faces that count them from 0."""
        if isinstance(faces, np.ndarray):
            table: Indices = np.array(faces, dtype=np.int64, ndmin=2)
            corners, starts = table.ravel(), np.arange(len(table) + 1) * table.shape[1]
        else:
            listed = [tuple(face) for face in faces]
            corners = np.array([corner for face in listed for corner in face], dtype=np.int64)
            starts = np.cumsum([0, *map(len, listed)], dtype=np.int64)
        points = np.asarray(vertices, dtype=float)
        return cls(points if points.size else points.reshape(0, 3), corners, starts, name)

    @property
    def face_count(self) -> int:
        """Number of faces."""
        return len(self.starts) - 1

    @cached_property
    def corner_counts(self) -> Indices:
        """Number of corners of each face, shape (m,)."""
        return np.diff(self.starts)

    @cached_property
    def faces(self) -> tuple[tuple[int, ...], ...]:
        """The faces one by one, as indices of vertices from 0."""
        corners, starts = self.corners.tolist(), self.starts.tolist()
        return tuple(tuple(corners[start:end]) for start, end in pairwise(starts))

    @cached_property
    def face_of_corner(self) -> Indices:
        """The face that each corner belongs to, shape (k,)."""
        return np.repeat(np.arange(self.face_count), self.corner_counts)

    @cached_property
    def next_corners(self) -> Indices:
        """The vertex that follows each corner round its face, shape (k,)."""
        following = np.roll(self.corners, -1)
        if self.face_count:
            following[self.starts[1:] - 1] = self.corners[self.starts[:-1]]
        return following

    @cached_property
    def fan_triangles(self) -> tuple[Indices, Indices]:
        """Triangles that make up the faces, and the face of each: shapes (3, t) and (t,).

        A face is a fan about its first corner. In a concave face some of its triangles point
        against it: what is summed over them with their sign is right all the same.
        """
        if self.face_count and (self.corner_counts == MIN_FACE_CORNERS).all():
            triangles = np.ascontiguousarray(self.corners.reshape(-1, 3).T)
            return triangles, np.arange(self.face_count)
        inner = np.ones(len(self.corners), dtype=bool)
        inner[self.starts[:-1]] = False
        inner[self.starts[1:] - 1] = False
        places = np.flatnonzero(inner)
        owner = self.face_of_corner[places]
        hubs = self.corners[self.starts[owner]]
        return np.stack([hubs, self.corners[places], self.corners[places + 1]]), owner

    def with_flipped_faces(self, faces: Mask) -> "Surface":
        """The surface with the vertices of some faces in the other order; `faces`, shape (m,)."""
        if not faces.any():
            return self
        order = np.arange(len(self.corners))
        of_corner = faces[self.face_of_corner]
        first = self.starts[:-1][self.face_of_corner]
        last = self.starts[1:][self.face_of_corner] - 1
        order[of_corner] = (first + last - order)[of_corner]
        return replace(self, corners=self.corners[order])

    def face_name(self, face: int) -> str:
        """How sentences call a face: its number from 1, and its line where it has one."""
        place = self.face_span(face)
        return f"{face + 1}" if place is None else f"{face + 1} (line {place.line})"

    def vertex_name(self, vertex: int) -> str:
        """How sentences call a vertex: its number in its block, or its place [m]."""
        if self.text is None:
            return "({:.6g} {:.6g} {:.6g})".format(*self.vertices[vertex])
        block = int(np.searchsorted(self.text.block_starts, vertex, side="right")) - 1
        number = str(vertex - int(self.text.block_starts[block]) + 1)
        return number if len(self.text.block_starts) == 1 else f"{block + 1}:{number}"

    def face_span(self, face: int) -> Span | None:
        """Where a face is written, for a surface that comes from a text."""
        if self.text is None:
            return None
        start, end = self.text.face_spans[face].tolist()
        return Span(self.text.source, start, end)


def merge_vertices(surface: Surface) -> tuple[Surface, int]:
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
    left = sizes >= MIN_FACE_CORNERS
    kept &= left[surface.face_of_corner]
    text = surface.text and replace(surface.text, face_spans=surface.text.face_spans[left])
    starts = np.concatenate([[0], np.cumsum(sizes[left])])
    joined = replace(surface, corners=corners[kept], starts=starts, text=text)
    return joined, given_up
