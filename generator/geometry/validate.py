"""Whether a surface encloses a body: closed, its faces outwards, its shells apart.

Nothing is guessed: each way not to be a body has a sentence of its own. Refused are surfaces that
are open, that touch themselves along an edge (which of four faces belong together cannot be told),
whose faces are no planar polygons, and all that `shells` refuses. A surface that touches itself in
a point passes with a warning: each edge still tells inside from outside, and a point has no volume.

A surface that is known to enclose a body, and the mass properties of that body.
"""

from dataclasses import dataclass

import numpy as np

from generator.diagnostics import Diagnostic, InputError, error, select_errors, warning
from generator.geometry.edges import Edges, build_edges
from generator.geometry.flaws import (
    MAX_NAMES_LISTED,
    MAX_WARP,
    FaceFlaws,
    Shell,
    SurfaceValidation,
    face_flaws,
    join_names,
)
from generator.geometry.shells import validate_shells
from generator.geometry.surface import Indices, Surface, merge_vertices
from generator.geometry.volume import Tetrahedra
from generator.inertia import MassProperties

MAX_COORDINATE = 1e50
"""Coordinates up to this have fifth powers that a number holds [m]."""


def validate_surface(surface: Surface, *, fix_winding: bool = False) -> SurfaceValidation:
    """All that is wrong or odd with a surface; nothing is raised.

    With `fix_winding` faces that look to the wrong side are turned, which is no fault then.
    """
    found = SurfaceValidation(surface)
    if not surface.face_count:
        found.add_diagnostic(error, "the surface has no faces", None)
        return found
    if float(np.abs(surface.vertices).max()) > MAX_COORDINATE:
        found.add_diagnostic(error, f"a vertex lies farther than {MAX_COORDINATE:g} m away", None)
        return found
    flaws = face_flaws(surface)
    if _validate_distinct_vertices(found, flaws):
        _validate_planarity(found, flaws)
        edges = _close_by_merging(found)
        if _validate_closed(found, edges):
            _report_pinch_vertices(found, edges)
            validate_shells(found, edges, fix_winding)
    return found


def _validate_distinct_vertices(found: SurfaceValidation, flaws: FaceFlaws) -> bool:
    for face in flaws.repeated_vertex[:MAX_NAMES_LISTED].tolist():
        found.add_diagnostic(
            error,
            f"face {found.surface.face_name(face)} passes a vertex twice",
            face,
            "cut it into faces that do not",
        )
    return not len(flaws.repeated_vertex)


def _validate_planarity(found: SurfaceValidation, flaws: FaceFlaws) -> None:
    """Faces without area, and faces whose corners lie in no plane."""
    if len(flaws.slivers):
        found.add_diagnostic(
            warning,
            f"{found.faces_phrase(flaws.slivers)} without area",
            int(flaws.slivers[0]),
            "such triangles enclose nothing and do no harm",
        )
    if len(flaws.degenerate_polygons):
        found.add_diagnostic(
            error,
            f"{found.faces_phrase(flaws.degenerate_polygons)} without area: the sides cross, or lie on one line",
            int(flaws.degenerate_polygons[0]),
            "the corners of a face run round it once",
        )
    warped = {face: warp for face, warp in flaws.warps.items() if warp > MAX_WARP}
    bent = {face: warp for face, warp in flaws.warps.items() if warp <= MAX_WARP}
    for make, faces in ((error, warped), (warning, bent)):
        if faces:
            worst = max(faces, key=faces.__getitem__)
            which = (
                "a corner"
                if len(faces) == 1
                else f"the worst is face {found.surface.face_name(worst)}, of which a corner"
            )
            found.add_diagnostic(
                make,
                f"{found.faces_phrase(np.array(list(faces)))} not planar: {which} lies off the plane "
                f"by {faces[worst]:.2g} of the size",
                worst,
                "what such a face encloses depends on how it is cut; cut it into triangles"
                if make is error
                else f"it is cut into triangles from its first corner; {MAX_WARP:g} is the limit",
            )


def _close_by_merging(found: SurfaceValidation) -> Edges:
    """The edges of the surface, with its vertices joined if it is open only without that."""
    edges = build_edges(found.surface)
    if len(edges.boundary):
        surface, joined = merge_vertices(found.surface)
        if joined and not len(face_flaws(surface).repeated_vertex):
            closed = build_edges(surface)
            if not len(closed.boundary) and not len(closed.nonmanifold):
                found.surface, found.merged_vertex_count = surface, joined
                return closed
    return edges


def _validate_closed(found: SurfaceValidation, edges: Edges) -> bool:
    """Whether each edge belongs to two faces; if not, that is noted."""
    unit = "" if found.surface.text else " m"
    if len(edges.boundary):
        names = join_names(
            [edges.name(h) for h in edges.boundary[:MAX_NAMES_LISTED].tolist()], len(edges.boundary)
        )
        belong = (
            "1 edge belongs" if len(edges.boundary) == 1 else f"{len(edges.boundary)} edges belong"
        )
        found.add_diagnostic(
            error,
            f"the surface is open: {belong} to one face only: {names}{unit}",
            int(found.surface.face_of_corner[edges.boundary[0]]),
            "a face is missing beside each of them",
        )
    if len(edges.nonmanifold):
        names = join_names(
            [
                f"{edges.name(h)}{unit} to {count}"
                for h, count in zip(
                    edges.nonmanifold.tolist(), edges.nonmanifold_face_counts.tolist(), strict=True
                )
            ][:MAX_NAMES_LISTED],
            len(edges.nonmanifold),
        )
        found.add_diagnostic(
            error,
            f"the surface touches itself: edges belong to more than two faces: {names}",
            int(found.surface.face_of_corner[edges.nonmanifold[0]]),
            "which of them belong together cannot be told; give each part its own vertices there",
        )
    return not len(edges.boundary) and not len(edges.nonmanifold)


def _report_pinch_vertices(found: SurfaceValidation, edges: Edges) -> None:
    """Parts that meet in a single point: every edge still tells inside from outside."""
    if len(edges.pinch_vertices):
        names = [
            found.surface.vertex_name(v) for v in edges.pinch_vertices[:MAX_NAMES_LISTED].tolist()
        ]
        vertices = "vertex" if len(edges.pinch_vertices) == 1 else "vertices"
        found.add_diagnostic(
            warning,
            f"the surface touches itself in a point: {vertices} "
            f"{join_names(names, len(edges.pinch_vertices))}",
            int(found.surface.face_of_corner[found.surface.corners == edges.pinch_vertices[0]][0]),
            "a point has no volume, so this does no harm",
        )


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed surface whose faces all look outwards; made by `solid_of`.

    Attributes:
        surface: as it was used: with faces turned and vertices joined, if that was needed.
        shells: the closed parts of the surface: bodies, and voids in them.
        flipped: the faces that had to be turned, by index.
        merged_vertex_count: how many vertices lay where others do and were joined to close the surface.
        warnings: what is odd, but does no harm.
        tetrahedra: the signed tetrahedra that add up to the body.
    """

    surface: Surface
    shells: tuple[Shell, ...]
    flipped: Indices
    merged_vertex_count: int
    warnings: tuple[Diagnostic, ...]
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


def build_solid(surface: Surface, *, fix_winding: bool = False) -> Solid:
    """The body within a surface.

    With `fix_winding` faces that look to the wrong side are turned instead of refused.

    Raises InputError, with all faults, for a surface that encloses no body.
    """
    found = validate_surface(surface, fix_winding=fix_winding)
    if found.tetrahedra is None or select_errors(found.diagnostics):
        raise InputError(found.diagnostics)
    return Solid(
        surface=found.surface,
        shells=found.shells,
        flipped=found.flipped,
        merged_vertex_count=found.merged_vertex_count,
        warnings=tuple(found.diagnostics),
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
    return build_solid(surface, fix_winding=fix_winding).mass_properties(density)
