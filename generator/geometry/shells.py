"""The closed shells of a surface: their volumes, which are voids, and which faces are turned.

A volume keeps its sign throughout: a body that is inside out is told and never made positive. A
shell within another is a void, one within that a body again, and so on. A void looks inwards, into
itself, and counts negative. Shells that cut through each other are refused, since what they share
would count twice.

Which of the closed shells of a surface lie within others, and which cut through others.
"""

from dataclasses import dataclass

import numpy as np

from generator.diagnostics import error
from generator.geometry.edges import Edges, faces_to_flip
from generator.geometry.flaws import MAX_NAMES_LISTED, Shell, SurfaceValidation
from generator.geometry.intersections import triangles_intersect, triangulate
from generator.geometry.surface import Array, Indices, Mask, Surface
from generator.geometry.volume import build_tetrahedra

FACE_SAMPLES = 32
"""So many of the largest faces of a shell, and as many others, are asked where they lie."""

RELATIVE_INSET = 1e-6
"""How far below a face the point lies that is asked, relative to the extent of its shell."""

MAX_SOLID_ANGLES_PER_BATCH = 500_000
"""Triangles times points that are looked at together."""


@dataclass(frozen=True, eq=False)
class Nesting:
    """How k closed shells lie to each other.

    Attributes:
        within: whether the shell of the row lies within that of the column, shape (k, k).
        intersecting_pairs: pairs of shells that cut through each other.
    """

    within: Mask
    intersecting_pairs: tuple[tuple[int, int], ...]

    @property
    def depths(self) -> Indices:
        """In how many others each shell lies, shape (k,); an odd number makes it a void."""
        return self.within.sum(axis=1)


def shell_nesting(surface: Surface, shells: Indices, count: int) -> Nesting:
    """How the `count` shells of a surface lie to each other.

    All faces look outwards from their own shell; `shells` tells that of each face, shape (m,).
    Shells that only touch, face on face even, neither cut nor contain each other.
    """
    within = np.zeros((count, count), dtype=bool)
    if count == 1:
        return Nesting(within, ())
    corners, owner = triangulate(surface)
    order = np.argsort(shells[owner], kind="stable")
    parts = np.split(corners[order], np.cumsum(np.bincount(shells[owner], minlength=count))[:-1])
    lows = np.array([part.min(axis=(0, 1)) for part in parts])
    highs = np.array([part.max(axis=(0, 1)) for part in parts])
    cutting: list[tuple[int, int]] = []
    for i, j in _overlapping_shells(lows, highs):
        i_in_j, j_in_i = _fraction_within(parts[i], parts[j]), _fraction_within(parts[j], parts[i])
        clear = (i_in_j == 1.0) != (j_in_i == 1.0) or i_in_j == j_in_i == 0.0
        if not clear or triangles_intersect(parts[i], parts[j]):
            cutting.append((i, j))
        else:
            within[i, j], within[j, i] = i_in_j == 1.0, j_in_i == 1.0
    return Nesting(within, tuple(cutting))


def _overlapping_shells(lows: Array, highs: Array) -> list[tuple[int, int]]:
    """The pairs of shells whose extents overlap."""
    order = np.argsort(lows[:, 0])
    pairs: list[tuple[int, int]] = []
    left, right = lows[order, 0], highs[order, 0]
    for place, here in enumerate(order.tolist()):
        others = order[place + 1 : int(np.searchsorted(left, float(right[place])))]
        overlap = (lows[others] < highs[here]) & (highs[others] > lows[here])
        near: list[int] = others[overlap.all(axis=1)].tolist()
        pairs += [(min(here, other), max(here, other)) for other in near]
    return sorted(pairs)


def _fraction_within(part: Array, other: Array) -> float:
    """The share of a shell's faces whose inner side lies within another shell."""
    points = _points_below_faces(part)
    return float((np.rint(winding_numbers(other, points)) > 0.5).mean())


def _points_below_faces(part: Array) -> Array:
    """Points just within a shell, below the middle of its larger faces, shape (s, 3)."""
    normals = np.cross(part[:, 1] - part[:, 0], part[:, 2] - part[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    by_size = np.argsort(-lengths, kind="stable")[: max(1, int((lengths > 0.0).sum()))]
    evenly = np.linspace(0, len(by_size) - 1, min(FACE_SAMPLES, len(by_size))).astype(int)
    chosen = np.unique(np.concatenate([by_size[:FACE_SAMPLES], by_size[evenly]]))
    extent = float(np.linalg.norm(np.ptp(part, axis=(0, 1))))
    inward = normals[chosen] / lengths[chosen, None]
    return part[chosen].mean(axis=1) - RELATIVE_INSET * extent * inward


def winding_numbers(triangles: Array, points: Array) -> Array:
    """How often a closed surface goes round each point: 1 within it, 0 outside.

    The sum of the solid angles of its triangles (Van Oosterom and Strackee, IEEE Trans. Biomed.
    Eng. 30, 1983). Shapes (t, 3, 3) and (p, 3) to (p,).
    """
    turns = np.empty(len(points))
    step = max(1, MAX_SOLID_ANGLES_PER_BATCH // len(triangles))
    for start in range(0, len(points), step):
        some = points[start : start + step]
        a, b, c = (triangles[None, :, k] - some[:, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(edge, axis=-1) for edge in (a, b, c))
        top = (a * np.cross(b, c)).sum(axis=-1)
        ab, bc, ca = (a * b).sum(axis=-1), (b * c).sum(axis=-1), (c * a).sum(axis=-1)
        bottom = la * lb * lc + ab * lc + bc * la + ca * lb
        turns[start : start + step] = np.arctan2(top, bottom).sum(axis=1) / (2.0 * np.pi)
    return turns


MIN_RELATIVE_VOLUME = 1e-12
"""A shell whose volume is below this, relative to the cube of its extent, encloses nothing."""

FIX_WINDING_HINT = "`--fix-winding` turns such faces"


def validate_shells(found: SurfaceValidation, edges: Edges, fix_winding: bool) -> None:
    """Which faces look to the wrong side, and how the shells lie to each other."""
    surface, shells = found.surface, edges.shells
    turns = faces_to_flip(edges)
    if turns is None:
        found.add_diagnostic(
            error,
            "the surface has one side only: no turning of faces makes neighbours agree",
            int(edges.neighbours[0, edges.same_direction.argmax()]),
        )
        return
    firsts, sizes = np.unique(shells, return_index=True, return_counts=True)[1:]
    tetrahedra = build_tetrahedra(surface)
    of_faces = tetrahedra.volumes_of_faces(surface.face_count) * np.where(turns, -1.0, 1.0)
    volumes = np.bincount(shells, of_faces, len(firsts))
    volumes[np.abs(volumes) <= MIN_RELATIVE_VOLUME * _shell_diagonals(surface, shells) ** 3] = 0.0
    if (volumes == 0.0).any():
        flat = firsts[volumes == 0.0]
        found.add_diagnostic(
            error,
            f"the surface encloses no volume{found.shells_phrase(flat, len(firsts))}",
            int(flat[0]),
        )
        return
    turns = turns ^ (volumes < 0.0)[shells]
    nesting = shell_nesting(surface.with_flipped_faces(turns), shells, len(firsts))
    for one, two in nesting.intersecting_pairs[:MAX_NAMES_LISTED]:
        found.add_diagnostic(
            error,
            f"the bodies of face {surface.face_name(int(firsts[one]))} and of face "
            f"{surface.face_name(int(firsts[two]))} cut through each other",
            int(firsts[two]),
            "what they share would count twice",
        )
    if nesting.intersecting_pairs:
        return
    voids = nesting.depths % 2 == 1
    turns = turns ^ voids[shells]
    if fix_winding and turns.any():
        found.surface, found.flipped = surface.with_flipped_faces(turns), np.flatnonzero(turns)
        tetrahedra = build_tetrahedra(found.surface)
    elif turns.any():
        _validate_winding(found, turns, edges, firsts, voids)
    found.tetrahedra = tetrahedra
    signed = np.where(voids, -np.abs(volumes), np.abs(volumes))
    found.shells = tuple(
        Shell(int(first), int(size), float(volume), int(depth))
        for first, size, volume, depth in zip(firsts, sizes, signed, nesting.depths, strict=True)
    )


def _validate_winding(
    found: SurfaceValidation, flips: Mask, edges: Edges, first_faces: Indices, voids: Mask
) -> None:
    """Shells that look to the wrong side as a whole, and single faces that do."""
    wrong = np.bincount(edges.shells, flips, len(first_faces)) == np.bincount(edges.shells)
    inside_out, solid_voids = first_faces[wrong & ~voids], first_faces[wrong & voids]
    if len(inside_out):
        volume = build_tetrahedra(found.surface).volume if wrong.all() else None
        found.add_diagnostic(
            error,
            f"the surface is inside out{found.shells_phrase(inside_out, int((~voids).sum()))}: its "
            "faces look inwards"
            + ("" if volume is None else f", and its volume is {volume:.6g} m^3"),
            int(inside_out[0]),
            FIX_WINDING_HINT,
        )
    if len(solid_voids) and not wrong.all():
        found.add_diagnostic(
            error,
            f"a shell within a body looks outwards{found.shells_phrase(solid_voids, 0)}: what it "
            "encloses would count twice",
            int(solid_voids[0]),
            f"a void looks inwards, into itself; {FIX_WINDING_HINT}",
        )
    single = np.flatnonzero(flips & ~wrong[edges.shells])
    if len(single):
        found.add_diagnostic(
            error,
            f"{found.faces_phrase(single)} turned: seen from outside the vertices run clockwise",
            int(single[0]),
            FIX_WINDING_HINT,
        )


def _shell_diagonals(surface: Surface, shells: Indices) -> Array:
    """Diagonal of the box about each shell [m], shape (k,)."""
    if not shells.any():
        extent = np.ptp(surface.vertices[surface.corners], axis=0)
        return np.array([float(np.linalg.norm(extent))])
    of_corner = shells[surface.face_of_corner]
    order = np.argsort(of_corner, kind="stable")
    points = surface.vertices[surface.corners[order]]
    firsts = np.flatnonzero(np.diff(of_corner[order], prepend=-1))
    low, high = np.minimum.reduceat(points, firsts), np.maximum.reduceat(points, firsts)
    return np.linalg.norm(high - low, axis=1)
