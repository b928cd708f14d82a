"""Validation of surfaces as boundaries of solids, and the mass properties of the solids.

A surface is rejected where it is open, touches itself along an edge (which of four faces belong
together is ambiguous), has faces that are not planar polygons, faces inwards, or has shells that
intersect each other. A surface that touches itself at a point gets a warning only: each edge still
separates inside from outside, and a point has no volume.

Volumes keep their sign throughout: a surface that is inside out is reported, never made positive.
A shell within another is a void, one within that a body again, and so on. The shell of a void faces
inwards, into the void, and counts negative.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from generator.diagnostics import Diagnostic, InputError, Severity, error, select_errors
from generator.geometry.intersections import triangles_intersect, triangulate
from generator.geometry.surface import (
    MIN_FACE_CORNERS,
    Array,
    Edges,
    Indices,
    Mask,
    Surface,
    Tetrahedra,
    build_edges,
    build_tetrahedra,
    faces_to_flip,
    merge_vertices,
)
from generator.inertia import MassProperties

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

    def error(self, message: str, face: int | None, hint: str = "") -> None:
        """Add an error at a face; without a span, the message names the surface."""
        place = None if face is None else self.surface.face_span(face)
        text = message if place else f"{self.surface.name}: {message}"
        self.diagnostics.append(error(text, place, hint))

    def warning(self, message: str, face: int, hint: str = "") -> None:
        """Add a warning, as `error`."""
        self.error(message, face, hint)
        self.diagnostics[-1] = replace(self.diagnostics[-1], severity=Severity.WARNING)

    def faces_phrase(self, faces: Indices) -> str:
        """Return `face 3 is` or `faces 3, 5 are`."""
        names = join_names(self.surface.face_name, faces)
        return f"face {names} is" if len(faces) == 1 else f"faces {names} are"

    def shells_phrase(self, first_faces: Indices, shell_count: int) -> str:
        """Return a phrase that names shells by their first faces; empty for all shells."""
        if len(first_faces) == shell_count:
            return ""
        return f" in the part of face {join_names(self.surface.face_name, first_faces)}"


def join_names(name: Callable[[int], str], numbers: Indices) -> str:
    """Return the names of the first numbers, and how many are left out."""
    more = len(numbers) - MAX_NAMES_LISTED
    listed = ", ".join(map(name, numbers[:MAX_NAMES_LISTED].tolist()))
    return listed + (f" and {more} more" if more > 0 else "")


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


FACE_SAMPLES = 32
"""Number of the largest faces of a shell, and of others, whose position is tested."""

RELATIVE_INSET = 1e-6
"""Depth of the tested point below a face, relative to the extent of its shell."""

MAX_SOLID_ANGLES_PER_BATCH = 500_000
"""Triangles times points in a batch of solid angles."""


def shell_nesting(
    surface: Surface, shells: Indices, count: int
) -> tuple[Indices, list[tuple[int, int]]]:
    """Return the number of shells that contain each, shape (k,), and pairs that intersect.

    All faces must face outwards from their own shell; `shells` is the shell of each face, (m,).
    Shells that only touch, even face on face, neither intersect nor contain each other. Voids are
    within an odd number.
    """
    within = np.zeros((count, count), dtype=bool)
    if count == 1:
        return within.sum(axis=1), []
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
    return within.sum(axis=1), cutting


def _overlapping_shells(lows: Array, highs: Array) -> list[tuple[int, int]]:
    """Return the pairs of shells whose bounding boxes overlap."""
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
    """Return the fraction of a shell's faces whose inner side is within another shell."""
    points = _points_below_faces(part)
    return float((np.rint(winding_numbers(other, points)) > 0.5).mean())


def _points_below_faces(part: Array) -> Array:
    """Return points just within a shell, below the centres of its larger faces, shape (s, 3)."""
    normals = np.cross(part[:, 1] - part[:, 0], part[:, 2] - part[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    by_size = np.argsort(-lengths, kind="stable")[: max(1, int((lengths > 0.0).sum()))]
    evenly = np.linspace(0, len(by_size) - 1, min(FACE_SAMPLES, len(by_size))).astype(int)
    chosen = np.unique(np.concatenate([by_size[:FACE_SAMPLES], by_size[evenly]]))
    extent = float(np.linalg.norm(np.ptp(part, axis=(0, 1))))
    inward = normals[chosen] / lengths[chosen, None]
    return part[chosen].mean(axis=1) - RELATIVE_INSET * extent * inward


def winding_numbers(triangles: Array, points: Array) -> Array:
    """Return the winding number of a closed surface about each point: 1 within it, 0 outside.

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
"""Volume relative to the cube of its extent below which a shell encloses nothing."""

FIX_WINDING_HINT = "`--fix-winding` flips such faces"


def validate_shells(found: SurfaceValidation, edges: Edges, fix_winding: bool) -> None:
    """Check the winding of the faces and the relative position of the shells."""
    surface, shells = found.surface, edges.shells
    turns = faces_to_flip(edges)
    if turns is None:
        found.error(
            "the surface is one-sided: its faces cannot be oriented consistently",
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
        found.error(
            f"the surface encloses no volume{found.shells_phrase(flat, len(firsts))}", int(flat[0])
        )
        return
    turns = turns ^ (volumes < 0.0)[shells]
    outward = surface.with_flipped_faces(turns)
    depths, cutting = shell_nesting(outward, shells, len(firsts))
    for one, two in cutting[:MAX_NAMES_LISTED]:
        found.error(
            f"the bodies of face {surface.face_name(int(firsts[one]))} and of face "
            f"{surface.face_name(int(firsts[two]))} intersect each other",
            int(firsts[two]),
            "their common volume would count twice",
        )
    if cutting:
        return
    voids = depths % 2 == 1
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
        for first, size, volume, depth in zip(firsts, sizes, signed, depths, strict=True)
    )


def _validate_winding(
    found: SurfaceValidation, flips: Mask, edges: Edges, first_faces: Indices, voids: Mask
) -> None:
    """Report shells and single faces that face the wrong way."""
    wrong = np.bincount(edges.shells, flips, len(first_faces)) == np.bincount(edges.shells)
    inside_out, solid_voids = first_faces[wrong & ~voids], first_faces[wrong & voids]
    if len(inside_out):
        volume = build_tetrahedra(found.surface).volume if wrong.all() else None
        found.error(
            f"the surface is inside out{found.shells_phrase(inside_out, int((~voids).sum()))}: its "
            "faces point inwards"
            + ("" if volume is None else f", and its volume is {volume:.6g} m^3"),
            int(inside_out[0]),
            FIX_WINDING_HINT,
        )
    if len(solid_voids) and not wrong.all():
        found.error(
            f"a shell within a body faces outwards{found.shells_phrase(solid_voids, 0)}: its "
            "volume would count twice",
            int(solid_voids[0]),
            f"the shell of a void faces inwards, into the void; {FIX_WINDING_HINT}",
        )
    single = np.flatnonzero(flips & ~wrong[edges.shells])
    if len(single):
        found.error(
            f"{found.faces_phrase(single)} flipped: seen from outside the vertices run clockwise",
            int(single[0]),
            FIX_WINDING_HINT,
        )


def _shell_diagonals(surface: Surface, shells: Indices) -> Array:
    """Return the diagonal of the bounding box of each shell [m], shape (k,)."""
    if not shells.any():
        extent = np.ptp(surface.vertices[surface.corners], axis=0)
        return np.array([float(np.linalg.norm(extent))])
    of_corner = shells[surface.face_of_corner]
    order = np.argsort(of_corner, kind="stable")
    points = surface.vertices[surface.corners[order]]
    firsts = np.flatnonzero(np.diff(of_corner[order], prepend=-1))
    low, high = np.minimum.reduceat(points, firsts), np.maximum.reduceat(points, firsts)
    return np.linalg.norm(high - low, axis=1)


MAX_COORDINATE = 1e50
"""Largest coordinate; its fifth power is finite [m]."""


def validate_surface(surface: Surface, *, fix_winding: bool = False) -> SurfaceValidation:
    """Return the diagnostics and the shells of a surface; nothing is raised.

    With `fix_winding` faces that point the wrong way are flipped without an error.
    """
    found = SurfaceValidation(surface)
    if not surface.face_count:
        found.error("the surface has no faces", None)
        return found
    if float(np.abs(surface.vertices).max()) > MAX_COORDINATE:
        found.error(f"a vertex is more than {MAX_COORDINATE:g} m from the origin", None)
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
        found.error(
            f"face {found.surface.face_name(face)} has a vertex twice",
            face,
            "split it into faces that do not",
        )
    return not len(flaws.repeated_vertex)


def _validate_planarity(found: SurfaceValidation, flaws: FaceFlaws) -> None:
    """Report faces without area, and faces that are not planar."""
    if len(flaws.slivers):
        found.warning(
            f"{found.faces_phrase(flaws.slivers)} without area",
            int(flaws.slivers[0]),
            "such triangles enclose nothing and are harmless",
        )
    if len(flaws.degenerate_polygons):
        found.error(
            f"{found.faces_phrase(flaws.degenerate_polygons)} without area: the sides cross, "
            "or lie on one line",
            int(flaws.degenerate_polygons[0]),
            "list the corners of a face once, in order around it",
        )
    warped = {face: warp for face, warp in flaws.warps.items() if warp > MAX_WARP}
    bent = {face: warp for face, warp in flaws.warps.items() if warp <= MAX_WARP}
    for report, faces in ((found.error, warped), (found.warning, bent)):
        if faces:
            worst = max(faces, key=faces.__getitem__)
            which = (
                "a corner"
                if len(faces) == 1
                else f"the worst is face {found.surface.face_name(worst)}, of which a corner"
            )
            report(
                f"{found.faces_phrase(np.array(list(faces)))} not planar: {which} "
                f"lies off the plane by {faces[worst]:.2g} of the size",
                worst,
                "the enclosed volume depends on how such a face is split; split it into triangles"
                if faces is warped
                else f"it is split into triangles from its first corner; the limit is {MAX_WARP:g}",
            )


def _close_by_merging(found: SurfaceValidation) -> Edges:
    """Return the edges of the surface, after merging vertices where that closes it."""
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
    """Return whether each edge belongs to two faces, after reporting those that do not."""
    unit = "" if found.surface.text else " m"
    count = len(edges.boundary)
    if count:
        belong = "1 edge belongs" if count == 1 else f"{count} edges belong"
        names = join_names(edges.name, edges.boundary)
        found.error(
            f"the surface is open: {belong} to one face only: {names}{unit}",
            int(found.surface.face_of_corner[edges.boundary[0]]),
            "a face is missing at each of them",
        )
    if len(edges.nonmanifold):
        shared = dict(zip(edges.nonmanifold.tolist(), edges.nonmanifold_face_counts, strict=True))
        names = join_names(lambda h: f"{edges.name(h)}{unit} to {shared[h]}", edges.nonmanifold)
        found.error(
            f"the surface touches itself: edges belong to more than two faces: {names}",
            int(found.surface.face_of_corner[edges.nonmanifold[0]]),
            "which faces belong together is ambiguous; give each part its own vertices there",
        )
    return not count and not len(edges.nonmanifold)


def _report_pinch_vertices(found: SurfaceValidation, edges: Edges) -> None:
    """Report parts that meet in a single point: every edge still separates inside from outside."""
    if len(edges.pinch_vertices):
        vertices = "vertex" if len(edges.pinch_vertices) == 1 else "vertices"
        names = join_names(found.surface.vertex_name, edges.pinch_vertices)
        found.warning(
            f"the surface touches itself at a point: {vertices} {names}",
            int(found.surface.face_of_corner[found.surface.corners == edges.pinch_vertices[0]][0]),
            "a point has no volume, so this is harmless",
        )


@dataclass(frozen=True, eq=False)
class Solid:
    """A solid bounded by a closed surface whose faces point outwards; made by `build_solid`.

    Attributes:
        surface: surface with faces flipped and vertices merged where necessary.
        shells: the closed parts of the surface: bodies, and voids in them.
        flipped: indices of the flipped faces.
        merged_vertex_count: number of vertices merged with others to close the surface.
        warnings: warnings about harmless irregularities.
        tetrahedra: the signed tetrahedra whose sum is the solid.
    """

    surface: Surface
    shells: tuple[Shell, ...]
    flipped: Indices
    merged_vertex_count: int
    warnings: tuple[Diagnostic, ...]
    tetrahedra: Tetrahedra

    @property
    def volume(self) -> float:
        """Volume [m3]."""
        return self.tetrahedra.volume

    def mass_properties(self, density: float) -> MassProperties:
        """Return the mass properties at `density` [kg/m3]. Raises ValueError unless positive."""
        if not density > 0.0:
            raise ValueError(f"a density must be above zero, not {density}")
        return self.tetrahedra.mass_properties(density)


def build_solid(surface: Surface, *, fix_winding: bool = False) -> Solid:
    """Return the solid within a surface.

    With `fix_winding` faces that point the wrong way are flipped instead of rejected.

    Raises InputError, with all errors, for a surface that does not bound a solid.
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
    """Return mass, centre of mass and inertia of the solid within a surface.

    Args:
        surface: closed, with faces that point outwards; see `build_solid`.
        density: [kg/m3], uniform.
        fix_winding: whether to flip faces that point the wrong way.

    Raises:
        InputError: the surface does not bound a solid.
        ValueError: the density is not above zero.
    """
    return build_solid(surface, fix_winding=fix_winding).mass_properties(density)
