"""Flaws of single faces of a surface, and the state of its validation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from generator.diagnostics import Diagnostic, Span
from generator.geometry.surface import MIN_FACE_CORNERS, Array, Indices, Surface, Tetrahedra

MAX_NAMES_LISTED = 10
"""Number of faces, edges or vertices that a message names."""


@dataclass(frozen=True)
class Shell:
    """A closed part of a surface, connected over its edges.

    Attributes:
        first_face: index of its first face.
        face_count: number of its faces.
        volume: [m3], negative for a void.
        depth: number of shells that contain it.
    """

    first_face: int
    face_count: int
    volume: float
    depth: int

    @property
    def is_void(self) -> bool:
        """True for the inner wall of a body."""
        return self.depth % 2 == 1


@dataclass
class SurfaceValidation:
    """State of the validation of a surface.

    Attributes:
        surface: surface with vertices merged and faces flipped where necessary.
        diagnostics: errors and warnings.
        shells: its closed parts; empty after errors.
        flipped: indices of flipped faces.
        merged_vertex_count: number of vertices merged with others at the same position.
        tetrahedra: tetrahedra of that surface.
    """

    surface: Surface
    diagnostics: list[Diagnostic] = field(default_factory=list[Diagnostic])
    shells: tuple[Shell, ...] = ()
    flipped: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    merged_vertex_count: int = 0
    tetrahedra: Tetrahedra | None = None

    def add_diagnostic(
        self,
        make_diagnostic: Callable[[str, Span | None, str], Diagnostic],
        message: str,
        face: int | None,
        hint: str = "",
    ) -> None:
        """Add a diagnostic at a face; its text names the surface where there is no span."""
        place = None if face is None else self.surface.face_span(face)
        text = message if place else f"{self.surface.name}: {message}"
        self.diagnostics.append(make_diagnostic(text, place, hint))

    def faces_phrase(self, faces: Indices) -> str:
        """Return `face 3 is` or `faces 3, 5 are`."""
        names = join_names(
            [self.surface.face_name(f) for f in faces[:MAX_NAMES_LISTED].tolist()], len(faces)
        )
        return f"face {names} is" if len(faces) == 1 else f"faces {names} are"

    def shells_phrase(self, first_faces: Indices, shell_count: int) -> str:
        """Return a phrase that names shells by their first faces; empty for all shells."""
        if len(first_faces) == shell_count:
            return ""
        names = [self.surface.face_name(face) for face in first_faces[:MAX_NAMES_LISTED].tolist()]
        return f" in the part of face {join_names(names, len(first_faces))}"


def join_names(names: Sequence[str], count: int) -> str:
    """Return the names, and the number of those left out."""
    more = count - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")


PLANARITY_TOLERANCE = 1e-6
"""Deviation, relative to its size, up to which a face counts as planar."""

MAX_WARP = 0.01
"""Deviation, relative to its size, above which a face is an error and not a warning."""

MIN_RELATIVE_AREA = 1e-12
"""Area relative to the square of its size below which a face has none."""


@dataclass(frozen=True, eq=False)
class FaceFlaws:
    """Flaws of single faces.

    Attributes:
        repeated_vertex: faces with a vertex twice.
        slivers: triangles without area; they enclose nothing and are harmless.
        degenerate_polygons: polygons without area: their sides cross, or are collinear.
        warps: warps by face that is not planar, distance of the farthest corner from its plane,
            relative to its size.
    """

    repeated_vertex: Indices
    slivers: Indices
    degenerate_polygons: Indices
    warps: dict[int, float]


def face_flaws(surface: Surface) -> FaceFlaws:
    """Return the flaws of single faces of a surface."""
    repeating = _faces_with_repeated_vertex(surface)
    areas = _area_vectors(surface)
    lengths, sizes = np.sqrt((areas**2).sum(axis=0)), _face_diagonals(surface)
    flat = lengths <= MIN_RELATIVE_AREA * sizes**2
    polygons = surface.corner_counts > MIN_FACE_CORNERS
    return FaceFlaws(
        repeating,
        slivers=np.flatnonzero(flat & ~polygons),
        degenerate_polygons=np.flatnonzero(flat & polygons),
        warps=_warps(surface, areas, sizes, np.flatnonzero(polygons & ~flat)),
    )


def _faces_with_repeated_vertex(surface: Surface) -> Indices:
    if (surface.corner_counts == MIN_FACE_CORNERS).all():
        a, b, c = surface.corners.reshape(-1, 3).T
        return np.flatnonzero((a == b) | (b == c) | (c == a))
    keys = np.sort(surface.face_of_corner * len(surface.vertices) + surface.corners)
    twice = keys[1:][keys[1:] == keys[:-1]]
    return np.unique(twice // len(surface.vertices))


def _area_vectors(surface: Surface) -> Array:
    """Return the area of each face along its normal [m2], shape (3, m)."""
    triangles, owner = surface.fan_triangles
    points = np.ascontiguousarray(surface.vertices.T)
    hub = np.take(points, triangles[0], axis=1)
    one, two = (np.take(points, triangles[k], axis=1) - hub for k in (1, 2))
    crosses = np.empty_like(one)
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        crosses[x] = (one[y] * two[z] - one[z] * two[y]) / 2.0
    if len(owner) == surface.face_count:
        return crosses
    sums = [np.bincount(owner, cross, surface.face_count) for cross in crosses]
    return np.stack(sums, dtype=np.float64)


def _face_diagonals(surface: Surface) -> Array:
    """Return the diagonal of the bounding box of each face [m], shape (m,)."""
    points = np.ascontiguousarray(surface.vertices.T)
    if (surface.corner_counts == MIN_FACE_CORNERS).all():
        one, two, three = (np.take(points, surface.corners[k::3], axis=1) for k in range(3))
        low = np.minimum(np.minimum(one, two), three)
        high = np.maximum(np.maximum(one, two), three)
    else:
        corners = np.take(points, surface.corners, axis=1)
        low = np.minimum.reduceat(corners, surface.starts[:-1], axis=1)
        high = np.maximum.reduceat(corners, surface.starts[:-1], axis=1)
    return np.sqrt(((high - low) ** 2).sum(axis=0))


def _warps(surface: Surface, areas: Array, diagonals: Array, faces: Indices) -> dict[int, float]:
    """Return the relative deviation from a plane of each of `faces`, where above rounding."""
    if not len(faces):
        return {}
    firsts = surface.starts[:-1]
    hubs = surface.vertices[surface.corners[firsts]]
    arms = surface.vertices[surface.corners] - hubs[surface.face_of_corner]
    with np.errstate(divide="ignore", invalid="ignore"):  # for faces other than `faces`
        normals = (areas / np.sqrt((areas**2).sum(axis=0))).T
    heights = (arms * normals[surface.face_of_corner]).sum(axis=1)
    middles = np.add.reduceat(heights, firsts) / surface.corner_counts
    away = np.maximum.reduceat(np.abs(heights - middles[surface.face_of_corner]), firsts)
    warps = away[faces] / diagonals[faces]
    return {int(f): float(w) for f, w in zip(faces, warps, strict=True) if w > PLANARITY_TOLERANCE}
