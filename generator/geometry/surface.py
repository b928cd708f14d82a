"""Surfaces of polygons: vertices, faces, edges, and the tetrahedra that add up to their volume.

Section 5.3 of the thesis: the apex of all tetrahedra is one point, their bases are the triangles of
the faces. The determinant of the three edges from the apex (six volumes, eq. 5.2) keeps its sign,
negative where the apex sees a face from outside, so concave bodies and bodies with holes come out
right. With a_1, a_2, a_3 as those edges and their sum s, the integrals of eq. 5.23, 5.26, 5.31 and
5.34 (where r = s = t = 1) are

    volume          det / 6
    of x            det / 24  s
    of x x^T        det / 120 (s s^T + a_1 a_1^T + a_2 a_2^T + a_3 a_3^T)
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.diagnostics import Source, Span
from generator.inertia import MassProperties
from springs.short_repr import short_repr

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

MIN_FACE_CORNERS = 3
"""Corners of the smallest face."""


@dataclass(frozen=True, eq=False)
class SurfaceText:
    """Text of a surface, and the numbering of its file.

    Attributes:
        source: the text.
        face_spans: start and end of each face in it, shape (m, 2).
        block_starts: index of the first vertex of each block; vertices are counted from 1 in each.
    """

    source: Source
    face_spans: Indices
    block_starts: Indices


@short_repr
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
        """Refuse vertices that are not points, and faces with too few corners or unknown ones."""
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
        return self.corners[self.next_places]

    @cached_property
    def next_places(self) -> Indices:
        """Place in `corners` of the one that follows each round its face, shape (k,)."""
        following = np.arange(1, len(self.corners) + 1)
        following[self.starts[1:] - 1] = self.starts[:-1]
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

    def transformed(self, pose: Array) -> "Surface":
        """The surface in another frame, in which this one has the affine map `pose`, (4, 4).

        Its faces still look outwards where the map is a mirror image.
        """
        moved = self.vertices @ pose[:3, :3].T + pose[:3, 3]
        surface = replace(self, vertices=moved, text=None)
        if np.linalg.det(pose[:3, :3]) < 0.0:
            return surface.with_flipped_faces(np.ones(self.face_count, dtype=bool))
        return surface

    @property
    def without_unused_vertices(self) -> "Surface":
        """The surface of the vertices that are corners of faces."""
        used, places = np.unique(self.corners, return_inverse=True)
        if len(used) == len(self.vertices):
            return self
        return Surface(
            self.vertices[used], places.reshape(-1).astype(np.int64), self.starts, self.name
        )

    @property
    def with_distinct_corners(self) -> "Surface":
        """The surface without faces that pass a vertex twice, as damaged meshes have them.

        Such a face becomes those triangles of its fan that have three vertices, which cover the
        same area.
        """
        order = np.lexsort((self.corners, self.face_of_corner))
        corners, owner = self.corners[order], self.face_of_corner[order]
        again = (corners[1:] == corners[:-1]) & (owner[1:] == owner[:-1])
        if not again.any():
            return self
        folded = set(owner[1:][again].tolist())
        faces: list[tuple[int, ...]] = []
        for number, face in enumerate(self.faces):
            fan = [(face[0], *pair) for pair in pairwise(face[1:])] if number in folded else [face]
            faces += [each for each in fan if len(set(each)) == len(each)]
        return Surface.from_faces(self.vertices, faces, self.name)

    def face_name(self, face: int) -> str:
        """Return the name of a face: its number from 1, and its line where it has one."""
        place = self.face_span(face)
        return f"{face + 1}" if place is None else f"{face + 1} (line {place.line})"

    def vertex_name(self, vertex: int) -> str:
        """Return the name of a vertex: its number in its block, or its position [m]."""
        if self.text is None:
            return "({:.6g} {:.6g} {:.6g})".format(*self.vertices[vertex])
        block = int(np.searchsorted(self.text.block_starts, vertex, side="right")) - 1
        number = str(vertex - int(self.text.block_starts[block]) + 1)
        return number if len(self.text.block_starts) == 1 else f"{block + 1}:{number}"

    def face_span(self, face: int) -> Span | None:
        """Place of a face in its text, for a surface that comes from a text."""
        if self.text is None:
            return None
        start, end = self.text.face_spans[face].tolist()
        return Span(self.text.source, start, end)


def join_surfaces(surfaces: Sequence[Surface]) -> Surface:
    """Return one surface with the vertices and faces of all, in their order."""
    counts = np.cumsum([0, *(len(one.vertices) for one in surfaces)])
    ends = np.cumsum([0, *(len(one.corners) for one in surfaces)])
    corners = [one.corners + count for one, count in zip(surfaces, counts, strict=False)]
    starts = [one.starts[1:] + end for one, end in zip(surfaces, ends, strict=False)]
    return Surface(
        np.concatenate([np.zeros((0, 3)), *(one.vertices for one in surfaces)]),
        np.concatenate([np.zeros(0, dtype=np.int64), *corners]),
        np.concatenate([np.zeros(1, dtype=np.int64), *starts]),
    )


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


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a surface. A half-edge is one face's side, counted by the corner it starts at.

    Attributes:
        surface: the surface.
        boundary: half-edges that no other face shares, shape (o,).
        nonmanifold: the first half-edge of each edge that more than two faces share, shape (c,).
        nonmanifold_face_counts: how many faces share each of these, shape (c,).
        pairs: the two half-edges of all other edges, shape (2, p).
    """

    surface: Surface
    boundary: Indices
    nonmanifold: Indices
    nonmanifold_face_counts: Indices
    pairs: Indices

    @cached_property
    def neighbours(self) -> Indices:
        """The two faces of each pair, shape (2, p)."""
        return self.surface.face_of_corner[self.pairs]

    @cached_property
    def same_direction(self) -> Mask:
        """True where the faces of a pair share the edge's direction: one is flipped, shape (p,)."""
        start = self.surface.corners[self.pairs]
        return start[0] == start[1]

    @cached_property
    def shells(self) -> Indices:
        """The shell that each face belongs to, numbered in the order of the faces, shape (m,)."""
        return component_labels(self.surface.face_count, self.neighbours)

    @cached_property
    def pinch_vertices(self) -> Indices:
        """Vertices at which a surface of pairs touches itself in a point, shape (v,).

        The corners at a vertex that follow each other over shared edges are one fan.
        """
        one, two = self.pairs[0], self.pairs[1]
        after = self.surface.next_places
        here, there = after[one], after[two]
        at_start = np.stack([one, np.where(self.same_direction, two, there)])
        at_end = np.stack([here, np.where(self.same_direction, there, two)])
        links = np.hstack([at_start, at_end])
        fans = component_labels(len(self.surface.corners), links)
        firsts = np.unique(fans, return_index=True)[1]
        counts = np.bincount(self.surface.corners[firsts], minlength=len(self.surface.vertices))
        return np.flatnonzero(counts > 1)

    def name(self, half_edge: int) -> str:
        """Return the name of an edge: the vertices at its ends."""
        ends = int(self.surface.corners[half_edge]), int(self.surface.next_corners[half_edge])
        return "-".join(map(self.surface.vertex_name, ends))


def build_edges(surface: Surface) -> Edges:
    """The edges of a surface whose faces pass no vertex twice."""
    start, end = surface.corners, surface.next_corners
    keys = np.minimum(start, end) * len(surface.vertices) + np.maximum(start, end)
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    firsts = np.flatnonzero(np.concatenate([[True], ordered[1:] != ordered[:-1]]))
    counts = np.diff(np.append(firsts, len(keys)))
    paired = firsts[counts == 2]
    return Edges(
        surface=surface,
        boundary=np.sort(order[firsts[counts == 1]]),
        nonmanifold=order[firsts[counts > 2]],
        nonmanifold_face_counts=counts[counts > 2],
        pairs=np.stack([order[paired], order[paired + 1]]),
    )


def component_labels(count: int, links: Indices) -> Indices:
    """The connected component of each of `count` nodes, shape (count,); links have shape (2, n)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    marks = np.ones(links.shape[1], dtype=np.int8)
    graph = coo_array((marks, (links[0], links[1])), (count, count))
    _, labels = connected_components(graph, directed=False)
    return np.asarray(labels, dtype=np.int64)


def faces_to_flip(edges: Edges) -> Mask | None:
    """Faces to turn so that neighbours agree on what is outside, shape (m,); None when none do.

    The first face of each shell stays. In the double cover of the surface each face is there as it
    is and turned, and neighbours are linked so that they agree; on a surface of one side, such as a
    Moebius strip's, both copies of a face hang together.
    """
    count = edges.surface.face_count
    if not edges.same_direction.any():
        return np.zeros(count, dtype=bool)
    one, two = edges.neighbours[0], edges.neighbours[1]
    swap = edges.same_direction * count
    links = np.hstack([np.stack([one, two + swap]), np.stack([one + count, two + count - swap])])
    cover = component_labels(2 * count, links)
    if (cover[:count] == cover[count:]).any():
        return None
    first = np.unique(edges.shells, return_index=True)[1]
    return cover[:count] != cover[first][edges.shells]


@dataclass(frozen=True, eq=False)
class Tetrahedra:
    """One signed tetrahedron for each triangle of a surface.

    Attributes:
        apex: their common corner [m], shape (3,).
        edges: edges from the apex to the three corners of each base [m], shape (3 corners, 3, t).
        determinants: six times the signed volumes [m3], shape (t,).
        faces: the face that each base is a part of, shape (t,).
    """

    apex: Array
    edges: tuple[Array, Array, Array]
    determinants: Array
    faces: Indices

    @property
    def volume(self) -> float:
        """Signed volume within the surface [m3]; negative when its faces look inwards."""
        return float(self.determinants.sum()) / 6.0

    def volumes_of_faces(self, count: int) -> Array:
        """Signed volume between the apex and each of `count` faces [m3]."""
        return np.bincount(self.faces, self.determinants, count) / 6.0

    def mass_properties(self, density: float) -> MassProperties:
        """Return the mass properties of a positive volume at `density` [kg/m3]."""
        one, two, three = self.edges
        total = one + two
        total += three
        volume = self.volume
        centre = total @ self.determinants / (24.0 * volume)
        weighted = total * self.determinants
        second = weighted @ total.T
        for edge in self.edges:
            np.multiply(edge, self.determinants, out=weighted)
            second += weighted @ edge.T
        second = second / 120.0 - volume * np.outer(centre, centre)
        with np.errstate(over="ignore"):  # what is not finite is refused as no body's
            inertia = density * (np.trace(second) * np.eye(3) - second)
        return MassProperties(density * volume, self.apex + centre, inertia)


def build_tetrahedra(surface: Surface) -> Tetrahedra:
    """The tetrahedra of a surface, with the apex in the middle of its faces' extent.

    Near the body the edges are as short as they can be: no digits are lost to a far origin.
    """
    triangles, faces = surface.fan_triangles
    points = surface.vertices.T
    used = surface.vertices[triangles[0]]
    apex = (used.min(axis=0) + used.max(axis=0)) / 2.0 if len(used) else np.zeros(3)
    near = np.ascontiguousarray(points - apex[:, None])
    one, two, three = (np.take(near, triangles[k], axis=1) for k in range(3))
    determinants = one[0] * (two[1] * three[2] - two[2] * three[1])
    determinants += one[1] * (two[2] * three[0] - two[0] * three[2])
    determinants += one[2] * (two[0] * three[1] - two[1] * three[0])
    return Tetrahedra(apex, (one, two, three), determinants, faces)


_GROWTH = 1.15
"""Factor of the cells' size from one attempt to the next."""


def simplify(surface: Surface, max_faces: int) -> tuple[Surface, float]:
    """Return a surface of at most `max_faces` triangles, and how far vertices moved at most [m].

    The vertices in each cell of a cubic lattice become one of them, that which is farthest from
    the middle of the surface, so that it keeps its extent (Rossignac & Borrel 1993). Faces without
    three different corners go, and of several with the same corners all but one.
    """
    surface = surface.without_unused_vertices
    triangles = surface.fan_triangles[0].T
    if len(triangles) <= max_faces:
        return Surface.from_faces(surface.vertices, triangles, surface.name), 0.0
    points = surface.vertices
    low, high = points.min(axis=0), points.max(axis=0)
    outermost = np.argsort(-np.linalg.norm(points - (low + high) / 2.0, axis=1), kind="stable")
    corners = points[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = float(np.linalg.norm(across, axis=1).sum()) / 2.0
    # A lattice of this size cuts a plane of this area into so many triangles.
    size = max((2.0 * area / max_faces) ** 0.5, float((high - low).max()) * 1e-6, 1e-12)
    while True:
        cells = np.floor((points - low) / size).astype(np.int64)
        _, first, place = np.unique(
            cells[outermost], axis=0, return_index=True, return_inverse=True
        )
        chosen = np.empty(len(points), dtype=np.int64)
        chosen[outermost] = outermost[first][place.reshape(-1)]
        faces = chosen[triangles]
        one, two, three = faces.T
        faces = faces[(one != two) & (two != three) & (three != one)]
        _, kept = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        faces = faces[np.sort(kept)]
        if len(faces) <= max_faces:
            moved = float(np.linalg.norm(points - points[chosen], axis=1).max())
            return Surface.from_faces(points, faces, surface.name).without_unused_vertices, moved
        size *= _GROWTH
