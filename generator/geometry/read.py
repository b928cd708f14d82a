"""One door for all surfaces: the suffix of a path chooses the format.

Surfaces from the mesh formats that trimesh reads.

The surface of a figure's segment: its psurf, which lies beside the figure's file.
"""

from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import cast

import numpy as np
import trimesh

from generator.diagnostics import Diagnostic, InputError, MoverError, error, spelling_hint
from generator.figure import Figure, Segment
from generator.figure_file.resolve import origin_span
from generator.geometry.psurf import CENTIMETRE, read_psurf
from generator.geometry.surface import Surface, merge_vertices
from generator.text_io import os_error_reason

MAX_FILE_BYTES = 1_000_000_000
"""Bytes of the largest file that is read."""

_STL_SUFFIX = ".stl"
_STL_HEADER_BYTES, _STL_TRIANGLE_BYTES = 84, 50
"""Bytes of a binary STL file before its triangles, and of each."""

_load = cast("Callable[..., object]", trimesh.load)  # pyright: ignore[reportUnknownMemberType]

GREY = (0.7, 0.7, 0.7)
"""Colour of a segment whose attributes give none."""


def read_mesh(path: str | Path, unit: Fraction) -> Surface:
    """The triangles in a mesh file whose lengths are in `unit` [m].

    Vertices at exactly the same place are one: STL has no shared vertices, and other formats repeat
    them where colours or normals change. Triangles that have no three corners left are dropped.

    Raises InputError when there is no such file, or no triangles in it.
    """
    path = Path(path)
    reason = _unreadable_reason(path)
    if reason is not None:
        raise InputError([error(f"`{path}` cannot be read: {reason}")])
    suffix = path.suffix.lower()
    if suffix == _STL_SUFFIX and (cut := _truncation_reason(path)) is not None:
        raise InputError([error(f"`{path}` cannot be read as stl: {cut}")])
    try:
        mesh = _load(path, file_type=suffix[1:], force="mesh", process=False)
    except Exception as failure:  # readers of foreign bytes raise whatever they trip over
        raise InputError([_unreadable_file_error(path, failure)]) from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise InputError([error(f"there are no faces in `{path}`")])
    vertices = np.asarray(mesh.vertices, dtype=np.float64) * float(unit)
    if not np.isfinite(vertices).all():
        raise InputError([error(f"a vertex in `{path}` is not finite")])
    try:
        surface = Surface.from_faces(vertices, np.asarray(mesh.faces, dtype=np.int64), str(path))
    except ValueError as failure:
        raise InputError([error(f"`{path}`: {failure}")]) from None
    joined, _ = merge_vertices(surface)
    return joined


def _unreadable_file_error(path: Path, failure: Exception) -> Diagnostic:
    """The fault of a file that trimesh does not read."""
    message = f"`{path}` cannot be read as {path.suffix.lower()[1:]}"
    damaged = "it is cut short, or holds something else"
    if isinstance(failure, ImportError):  # a guesser of encodings that bytes of no text call for
        return error(f"{message}: {damaged}")
    said = " ".join(str(failure).split()) or type(failure).__name__
    return error(f"{message}: {damaged}", hint=f"its reader says: {said}")


def _truncation_reason(path: Path) -> str | None:
    """What a binary STL file lacks; None for a whole one, and for one that is a text.

    80 bytes of anything, the number of triangles, and 50 bytes for each. trimesh would take one of
    another length for a text.
    """
    with path.open("rb") as file:
        head, size = file.read(_STL_HEADER_BYTES), path.stat().st_size
    if b"\0" not in head:
        return None
    if len(head) < _STL_HEADER_BYTES:
        return f"it is cut short, at {size} bytes, or holds something else"
    whole = _STL_HEADER_BYTES + _STL_TRIANGLE_BYTES * int.from_bytes(head[-4:], "little")
    if size >= whole:
        return None
    return f"it is cut short, at {size:,} of {whole:,} bytes, or holds something else"


def _unreadable_reason(path: Path) -> str | None:
    try:
        if path.is_dir():
            return "it is a directory"
        if path.exists() and not path.is_file():
            return "it is no ordinary file"
        with path.open("rb"):
            return None if path.stat().st_size <= MAX_FILE_BYTES else "it is larger than 1 GB"
    except OSError as failure:
        return os_error_reason(failure)


PSURF_SUFFIX = ".pss"

FORMAT_UNITS: Mapping[str, Fraction | None] = {
    PSURF_SUFFIX: CENTIMETRE,
    ".stl": None,
    ".obj": None,
    ".ply": None,
    ".glb": Fraction(1),
    ".gltf": Fraction(1),
}
"""The formats, and the length that 1 means in each [m]; None where the format does not say."""


class UnknownSurfaceError(MoverError):
    """A path whose suffix names no format, or one of which nobody knows the unit."""


def surface_unit(path: str | Path, unit: Fraction | None = None) -> Fraction:
    """The length [m] that 1 means in a file: `unit` if it is given, else that of its format.

    Raises UnknownSurfaceError for an unknown suffix, and for a format without a unit when none is
    given.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMAT_UNITS:
        said = f"`{suffix}` is no known suffix" if suffix else "the suffix is missing"
        hint = spelling_hint(suffix, FORMAT_UNITS)
        raise UnknownSurfaceError(f"{path}: {said} of a surface; {hint}")
    known = unit or FORMAT_UNITS[suffix]
    if known is None:
        raise UnknownSurfaceError(
            f"{path}: {suffix} files do not say what their lengths mean; "
            "give the unit, such as `--unit mm`"
        )
    return known


def read_surface(path: str | Path, unit: Fraction | None = None) -> Surface:
    """The surface in a psurf or mesh file; `unit` [m] overrides what 1 means in its format.

    Raises:
        UnknownSurfaceError: the format or its unit is not known.
        InputError: the file cannot be read.
    """
    meant = surface_unit(path, unit)
    if Path(path).suffix.lower() == PSURF_SUFFIX:
        return read_psurf(path, meant)
    # trimesh takes as long to import as everything else that a psurf needs.
    pass

    return read_mesh(path, meant)


def read_segment_surface(figure: Figure, segment: Segment, unit: Fraction | None = None) -> Surface:
    """The surface of a segment, told in the segment's frame.

    Any format of `read_surface` will do; `unit` [m] overrides what 1 means in it.

    Raises InputError when the segment has no psurf, or one that cannot be read.
    """
    place = origin_span(segment.origins, "psurf")
    if segment.psurf is None:
        message = f"segment `{segment.name}` has no psurf, so it has no shape"
        raise InputError([error(message, place, 'add `psurf = "FILE.pss";`')])
    if figure.path is None:
        message = f"the psurf of `{segment.name}` cannot be found: the figure is in no file"
        raise InputError([error(message, place)])
    try:
        return read_surface(figure.path.parent / segment.psurf, unit)
    except UnknownSurfaceError as failure:
        raise InputError([error(str(failure), place)]) from None


def segment_colour(figure: Figure, segment: Segment) -> tuple[float, float, float]:
    """Return the `rgb` of the first of a segment's attributes that has one; grey without any."""
    for name in segment.attributes:
        attribute = figure.attributes.get(name)
        rgb = None if attribute is None else attribute.fields.get("rgb")
        if isinstance(rgb, tuple) and len(rgb) == 3:
            red, green, blue = (min(max(part, 0.0), 1.0) for part in rgb)
            return red, green, blue
    return GREY
