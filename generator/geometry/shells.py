"""The closed shells of a surface: their volumes, which are voids, and which faces are turned.

A volume keeps its sign throughout: a body that is inside out is told and never made positive. A
shell within another is a void, one within that a body again, and so on. A void looks inwards, into
itself, and counts negative. Shells that cut through each other are refused, since what they share
would count twice.
"""

import numpy as np

from generator.errors import error
from generator.geometry.edges import Edges, consistent_turns
from generator.geometry.examination import NAMED, Examination, Shell
from generator.geometry.nesting import nesting_of
from generator.geometry.surface import Array, Indices, Mask, Surface
from generator.geometry.tetrahedra import tetrahedra_of

NO_VOLUME = 1e-12
"""A shell whose volume is below this, relative to the cube of its extent, encloses nothing."""

TURN = "`--fix-winding` turns such faces"


def look_at_shells(found: Examination, edges: Edges, fix_winding: bool) -> None:
    """Which faces look to the wrong side, and how the shells lie to each other."""
    surface, shells = found.surface, edges.shells
    turns = consistent_turns(edges)
    if turns is None:
        found.note(
            error,
            "the surface has one side only: no turning of faces makes neighbours agree",
            int(edges.neighbours[0, edges.against.argmax()]),
        )
        return
    firsts, sizes = np.unique(shells, return_index=True, return_counts=True)[1:]
    tetrahedra = tetrahedra_of(surface)
    of_faces = tetrahedra.volumes_of_faces(surface.face_count) * np.where(turns, -1.0, 1.0)
    volumes = np.bincount(shells, of_faces, len(firsts))
    volumes[np.abs(volumes) <= NO_VOLUME * _extents(surface, shells) ** 3] = 0.0
    if (volumes == 0.0).any():
        flat = firsts[volumes == 0.0]
        found.note(
            error,
            f"the surface encloses no volume{found.in_parts(flat, len(firsts))}",
            int(flat[0]),
        )
        return
    turns = turns ^ (volumes < 0.0)[shells]
    nesting = nesting_of(surface.with_turned(turns), shells, len(firsts))
    for one, two in nesting.cutting[:NAMED]:
        found.note(
            error,
            f"the bodies of face {surface.face_name(int(firsts[one]))} and of face "
            f"{surface.face_name(int(firsts[two]))} cut through each other",
            int(firsts[two]),
            "what they share would count twice",
        )
    if nesting.cutting:
        return
    voids = nesting.depths % 2 == 1
    turns = turns ^ voids[shells]
    if fix_winding and turns.any():
        found.surface, found.turned = surface.with_turned(turns), np.flatnonzero(turns)
        tetrahedra = tetrahedra_of(found.surface)
    elif turns.any():
        _look_at_winding(found, turns, edges, firsts, voids)
    found.tetrahedra = tetrahedra
    signed = np.where(voids, -np.abs(volumes), np.abs(volumes))
    found.shells = tuple(
        Shell(int(first), int(size), float(volume), int(depth))
        for first, size, volume, depth in zip(firsts, sizes, signed, nesting.depths, strict=True)
    )


def _look_at_winding(
    found: Examination, turns: Mask, edges: Edges, firsts: Indices, voids: Mask
) -> None:
    """Shells that look to the wrong side as a whole, and single faces that do."""
    wrong = np.bincount(edges.shells, turns, len(firsts)) == np.bincount(edges.shells)
    inside_out, solid_voids = firsts[wrong & ~voids], firsts[wrong & voids]
    if len(inside_out):
        volume = tetrahedra_of(found.surface).volume if wrong.all() else None
        found.note(
            error,
            f"the surface is inside out{found.in_parts(inside_out, int((~voids).sum()))}: its "
            "faces look inwards"
            + ("" if volume is None else f", and its volume is {volume:.6g} m^3"),
            int(inside_out[0]),
            TURN,
        )
    if len(solid_voids) and not wrong.all():
        found.note(
            error,
            f"a shell within a body looks outwards{found.in_parts(solid_voids, 0)}: what it "
            "encloses would count twice",
            int(solid_voids[0]),
            f"a void looks inwards, into itself; {TURN}",
        )
    single = np.flatnonzero(turns & ~wrong[edges.shells])
    if len(single):
        found.note(
            error,
            f"{found.faces_are(single)} turned: seen from outside the vertices run clockwise",
            int(single[0]),
            TURN,
        )


def _extents(surface: Surface, shells: Indices) -> Array:
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
