"""Whether a surface encloses a body: closed, its faces outwards, its shells apart.

Nothing is guessed: each way not to be a body has a sentence of its own. Refused are surfaces that
are open, that touch themselves along an edge (which of four faces belong together cannot be told),
whose faces are no planar polygons, and all that `shells` refuses. A surface that touches itself in
a point passes with a warning: each edge still tells inside from outside, and a point has no volume.

A surface that is known to enclose a body, and the mass properties of that body.
"""

from dataclasses import dataclass

import numpy as np

from generator.diagnostics import Fault, InputError, error, errors_among, warning
from generator.geometry.edges import Edges, edges_of
from generator.geometry.flaws import NAMED, WARPED, Examination, FaceFlaws, Shell, flaws_of, listed
from generator.geometry.shells import look_at_shells
from generator.geometry.surface import Indices, Surface, with_joined_vertices
from generator.geometry.volume import Tetrahedra
from generator.inertia import MassProperties

LARGEST = 1e50
"""Coordinates up to this have fifth powers that a number holds [m]."""


def examine_surface(surface: Surface, *, fix_winding: bool = False) -> Examination:
    """All that is wrong or odd with a surface; nothing is raised.

    With `fix_winding` faces that look to the wrong side are turned, which is no fault then.
    """
    found = Examination(surface)
    if not surface.face_count:
        found.note(error, "the surface has no faces", None)
        return found
    if float(np.abs(surface.vertices).max()) > LARGEST:
        found.note(error, f"a vertex lies farther than {LARGEST:g} m away", None)
        return found
    flaws = flaws_of(surface)
    if _has_faces_of_distinct_vertices(found, flaws):
        _look_at_planes(found, flaws)
        edges = _closed_if_possible(found)
        if _is_closed(found, edges):
            _look_at_points(found, edges)
            look_at_shells(found, edges, fix_winding)
    return found


def _has_faces_of_distinct_vertices(found: Examination, flaws: FaceFlaws) -> bool:
    for face in flaws.repeating[:NAMED].tolist():
        found.note(
            error,
            f"face {found.surface.face_name(face)} passes a vertex twice",
            face,
            "cut it into faces that do not",
        )
    return not len(flaws.repeating)


def _look_at_planes(found: Examination, flaws: FaceFlaws) -> None:
    """Faces without area, and faces whose corners lie in no plane."""
    if len(flaws.slivers):
        found.note(
            warning,
            f"{found.faces_are(flaws.slivers)} without area",
            int(flaws.slivers[0]),
            "such triangles enclose nothing and do no harm",
        )
    if len(flaws.crossed):
        found.note(
            error,
            f"{found.faces_are(flaws.crossed)} without area: the sides cross, or lie on one line",
            int(flaws.crossed[0]),
            "the corners of a face run round it once",
        )
    warped = {face: warp for face, warp in flaws.warps.items() if warp > WARPED}
    bent = {face: warp for face, warp in flaws.warps.items() if warp <= WARPED}
    for make, faces in ((error, warped), (warning, bent)):
        if faces:
            worst = max(faces, key=faces.__getitem__)
            which = (
                "a corner"
                if len(faces) == 1
                else f"the worst is face {found.surface.face_name(worst)}, of which a corner"
            )
            found.note(
                make,
                f"{found.faces_are(np.array(list(faces)))} not planar: {which} lies off the plane "
                f"by {faces[worst]:.2g} of the size",
                worst,
                "what such a face encloses depends on how it is cut; cut it into triangles"
                if make is error
                else f"it is cut into triangles from its first corner; {WARPED:g} is the limit",
            )


def _closed_if_possible(found: Examination) -> Edges:
    """The edges of the surface, with its vertices joined if it is open only without that."""
    edges = edges_of(found.surface)
    if len(edges.open):
        surface, joined = with_joined_vertices(found.surface)
        if joined and not len(flaws_of(surface).repeating):
            closed = edges_of(surface)
            if not len(closed.open) and not len(closed.crowded):
                found.surface, found.joined = surface, joined
                return closed
    return edges


def _is_closed(found: Examination, edges: Edges) -> bool:
    """Whether each edge belongs to two faces; if not, that is noted."""
    unit = "" if found.surface.text else " m"
    if len(edges.open):
        names = listed([edges.name(h) for h in edges.open[:NAMED].tolist()], len(edges.open))
        belong = "1 edge belongs" if len(edges.open) == 1 else f"{len(edges.open)} edges belong"
        found.note(
            error,
            f"the surface is open: {belong} to one face only: {names}{unit}",
            int(found.surface.face_of_corner[edges.open[0]]),
            "a face is missing beside each of them",
        )
    if len(edges.crowded):
        names = listed(
            [
                f"{edges.name(h)}{unit} to {count}"
                for h, count in zip(edges.crowded.tolist(), edges.crowds.tolist(), strict=True)
            ][:NAMED],
            len(edges.crowded),
        )
        found.note(
            error,
            f"the surface touches itself: edges belong to more than two faces: {names}",
            int(found.surface.face_of_corner[edges.crowded[0]]),
            "which of them belong together cannot be told; give each part its own vertices there",
        )
    return not len(edges.open) and not len(edges.crowded)


def _look_at_points(found: Examination, edges: Edges) -> None:
    """Parts that meet in a single point: every edge still tells inside from outside."""
    if len(edges.pinched):
        names = [found.surface.vertex_name(v) for v in edges.pinched[:NAMED].tolist()]
        vertices = "vertex" if len(edges.pinched) == 1 else "vertices"
        found.note(
            warning,
            f"the surface touches itself in a point: {vertices} "
            f"{listed(names, len(edges.pinched))}",
            int(found.surface.face_of_corner[found.surface.corners == edges.pinched[0]][0]),
            "a point has no volume, so this does no harm",
        )


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed surface whose faces all look outwards; made by `solid_of`.

    Attributes:
        surface: as it was used: with faces turned and vertices joined, if that was needed.
        shells: the closed parts of the surface: bodies, and voids in them.
        turned: the faces that had to be turned, by index.
        joined: how many vertices lay where others do and were joined to close the surface.
        warnings: what is odd, but does no harm.
        tetrahedra: the signed tetrahedra that add up to the body.
    """

    surface: Surface
    shells: tuple[Shell, ...]
    turned: Indices
    joined: int
    warnings: tuple[Fault, ...]
    tetrahedra: Tetrahedra

    @property
    def volume(self) -> float:
        """Volume of the body [m3]."""
        return self.tetrahedra.volume

    def mass_properties(self, density: float) -> MassProperties:
        """The body, filled with `density` [kg/m3]. Raises ValueError unless it is above zero."""
        if not density > 0.0:
            raise ValueError(f"a density is above zero, not {density}")
        return self.tetrahedra.mass_properties(density)


def solid_of(surface: Surface, *, fix_winding: bool = False) -> Solid:
    """The body within a surface.

    With `fix_winding` faces that look to the wrong side are turned instead of refused.

    Raises InputError, with all faults, for a surface that encloses no body.
    """
    found = examine_surface(surface, fix_winding=fix_winding)
    if found.tetrahedra is None or errors_among(found.faults):
        raise InputError(found.faults)
    return Solid(
        surface=found.surface,
        shells=found.shells,
        turned=found.turned,
        joined=found.joined,
        warnings=tuple(found.faults),
        tetrahedra=found.tetrahedra,
    )


def mass_properties(
    surface: Surface, density: float, *, fix_winding: bool = False
) -> MassProperties:
    """Mass, centre of mass and inertia of the body within a surface.

    Args:
        surface: closed, with faces that look outwards; see `solid_of`.
        density: [kg/m3], the same everywhere.
        fix_winding: whether to turn faces that look to the wrong side.

    Raises:
        InputError: the surface encloses no body.
        ValueError: the density is not above zero.
    """
    return solid_of(surface, fix_winding=fix_winding).mass_properties(density)
