"""Bodies of boxes and prisms, as vertices and outward faces that count them from 0."""

from itertools import pairwise, product

import numpy as np

CORNERS = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]

Body = tuple[np.ndarray, list[tuple[int, ...]]]


def box(low=(0, 0, 0), size=(1, 1, 1)) -> Body:
    """A box of six quadrangles."""
    return CORNERS * np.asarray(size, float) + np.asarray(low, float), list(SIDES)


def prism(outline, height: float) -> Body:
    """A polygon in the xy plane, counter-clockwise from above, drawn up to a height."""
    flat = np.asarray(outline, float)
    count = len(flat)
    low, high = (np.column_stack([flat, np.full(count, z)]) for z in (0.0, height))
    sides = [(k, (k + 1) % count, (k + 1) % count + count, k + count) for k in range(count)]
    faces = [tuple(range(count))[::-1], tuple(range(count, 2 * count)), *sides]
    return np.vstack([low, high]), faces


def frame(outer: float, inner: float, height: float) -> Body:
    """A square plate with a square hole through it: its top and bottom are four faces each."""
    squares = [half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2 for half in (outer, inner)]
    points = [np.column_stack([s, np.full(4, z)]) for z in (0.0, height) for s in squares]
    out, hole, top_out, top_hole = (np.arange(4) + 4 * k for k in range(4))
    faces = []
    for k in range(4):
        n = (k + 1) % 4
        faces += [
            (out[k], out[n], top_out[n], top_out[k]),
            (hole[n], hole[k], top_hole[k], top_hole[n]),
            (top_out[k], top_out[n], top_hole[n], top_hole[k]),
            (out[n], out[k], hole[k], hole[n]),
        ]
    return np.vstack(points), [tuple(map(int, face)) for face in faces]


def inside_out(body: Body) -> Body:
    """The same faces, all turned."""
    vertices, faces = body
    return vertices, [face[::-1] for face in faces]


def together(*bodies: Body) -> Body:
    """Several bodies as one set of faces; no vertex is shared."""
    vertices, faces, count = [], [], 0
    for points, sides in bodies:
        vertices.append(points)
        faces += [tuple(count + corner for corner in side) for side in sides]
        count += len(points)
    return np.vstack(vertices), faces


def cells(filled) -> Body:
    """Unit cubes at whole coordinates, without the faces between two of them."""
    filled = set(filled)
    names: dict[tuple[int, ...], int] = {}
    faces = []
    for cell in sorted(filled):
        for side in SIDES:
            corners = CORNERS[list(side)]
            outward = np.rint(2.0 * corners.mean(axis=0) - 1.0).astype(int)
            if tuple(int(c) for c in np.array(cell) + outward) not in filled:
                places = [tuple(int(c) for c in corner) for corner in corners + np.array(cell)]
                faces.append(tuple(names.setdefault(place, len(names)) for place in places))
    return np.array(list(names), float), faces


def lattice(size: int) -> list[tuple[int, int, int]]:
    """The places of a cube of cells."""
    return list(product(range(size), repeat=3))


def triangles(body: Body) -> np.ndarray:
    """The faces of a body, all convex, as triangles of vertices."""
    return np.array([(f[0], b, c) for f in body[1] for b, c in pairwise(f[1:])])
