"""How the faces of a surface meet: which lie at each edge, and in which direction they run it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from generator.geometry.surface import Indices, Mask, Surface


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
        """Whether the faces of a pair run the edge in the same direction: one is turned, (p,)."""
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
        after = _next_corner_in_face(self.surface)
        here, there = after[one], after[two]
        at_start = np.stack([one, np.where(self.same_direction, two, there)])
        at_end = np.stack([here, np.where(self.same_direction, there, two)])
        links = np.hstack([at_start, at_end])
        fans = component_labels(len(self.surface.corners), links)
        firsts = np.unique(fans, return_index=True)[1]
        counts = np.bincount(self.surface.corners[firsts], minlength=len(self.surface.vertices))
        return np.flatnonzero(counts > 1)

    def name(self, half_edge: int) -> str:
        """How sentences call an edge: the vertices at its ends."""
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


def _next_corner_in_face(surface: Surface) -> Indices:
    """The corner that follows each corner round its face, shape (k,)."""
    following = np.arange(1, len(surface.corners) + 1)
    following[surface.starts[1:] - 1] = surface.starts[:-1]
    return following
