"""Reading surfaces by the suffix of their file: psurfs, and the mesh formats that trimesh reads."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import cast

import numpy as np

from generator.diagnostics import (
    Diagnostic,
    InputError,
    MoverError,
    Parsed,
    error,
    spelling_hint,
)
from generator.figure import Figure, Segment
from generator.figure_file.resolve import origin_span
from generator.geometry.psurf import CENTIMETRE, PSURF_FILE
from generator.geometry.surface import Surface, merge_vertices
from generator.text_io import open_regular_file, os_error_reason

MAX_FILE_BYTES = 1_000_000_000
"""Bytes of the largest file that is read."""

MIN_ARRAY_BYTES = 32_000_000
"""Bytes of arrays that are read of any glTF file; of a larger one, twice its own."""

_STL_SUFFIX = ".stl"
_STL_HEADER_BYTES, _STL_TRIANGLE_BYTES = 84, 50
"""Bytes of a binary STL file before its triangles, and of each."""

GREY = (0.7, 0.7, 0.7)
"""Colour of a segment whose attributes give none."""


_DAMAGED = "it is cut short, or holds something else"


def read_mesh(path: str | Path, unit: Fraction) -> Surface:
    """Read the triangles in a mesh file with lengths in `unit` [m].

    Vertices at exactly the same position are merged: STL has no shared vertices, and other formats
    repeat them where colours or normals change. Triangles with fewer than three corners left are
    dropped.

    Raises InputError when the file cannot be read or has no triangles.
    """
    import trimesh  # it takes longer to import than everything that a psurf needs

    load = cast("Callable[..., object]", trimesh.load)  # pyright: ignore[reportUnknownMemberType]
    path = Path(path)
    reason = _unreadable_reason(path)
    if reason is not None:
        raise InputError([error(f"`{path}` cannot be read: {reason}")])
    suffix = path.suffix.lower()
    if suffix == _STL_SUFFIX and (cut := _truncation_reason(path)) is not None:
        raise InputError([error(f"`{path}` cannot be read as stl: {cut}")])
    if (excess := _declared_excess(path)) is not None:
        raise InputError([error(f"`{path}` cannot be read: {excess}")])
    settings = {} if suffix == _STL_SUFFIX else {"skip_materials": True}  # pictures may be large
    try:
        with np.errstate(all="ignore"):  # the vertices are checked below
            mesh = load(path, file_type=suffix[1:], force="mesh", process=False, **settings)
    except Exception as failure:  # trimesh raises many types for invalid files
        raise InputError([_unreadable_file_error(path, failure)]) from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        message = f"there are no faces in `{path}`: {_DAMAGED}"
        raise InputError([error(message)])
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
    """Return the error of a file that trimesh does not read."""
    message = f"`{path}` cannot be read as {path.suffix.lower()[1:]}"
    if isinstance(
        failure, ImportError
    ):  # trimesh imports an encoding detector for bytes that are not text
        return error(f"{message}: {_DAMAGED}")
    reason = " ".join(str(failure).split()) or type(failure).__name__
    return error(f"{message}: {_DAMAGED}", hint=f"its reader says: {reason}")


def _truncation_reason(path: Path) -> str | None:
    """Return the reason why a binary STL file is incomplete; None for complete and text files.

    The file is 80 bytes, the number of triangles, and 50 bytes for each. trimesh takes one of
    another length for text.
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


_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}

_GLB_HEADER_BYTES = 20
"""Bytes of a .glb file before its JSON: the last eight are the length of that, and its kind."""


def _declared_excess(path: Path) -> str | None:
    """Return the reason why arrays that a glTF file declares are too large; None if they are not.

    An array without a view in the file is as long as it says, and many may share one view.
    """
    suffix = path.suffix.lower()
    if suffix not in (".glb", ".gltf"):
        return None
    with open_regular_file(path) as file:
        head = file.read(_GLB_HEADER_BYTES) if suffix == ".glb" else b""
        size = int.from_bytes(head[12:16], "little")
        text = file.read(min(size, MAX_FILE_BYTES)) if head else file.read()
    try:
        content = json.loads(text)
        declared = sum(
            max(0, each["count"])
            * _COMPONENT_BYTES[each["componentType"]]
            * _COMPONENTS[each["type"]]
            for each in content.get("accessors", ())
        )
        external = sum(each["byteLength"] for each in content.get("buffers", ()) if "uri" in each)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None  # its reader says what is wrong
    most = max(MIN_ARRAY_BYTES, 2 * (path.stat().st_size + external))
    if declared <= most:
        return None
    return f"its arrays take {declared / 1e6:,.0f} MB, and at most {most / 1e6:,.0f} MB are read"


def _unreadable_reason(path: Path) -> str | None:
    try:
        if path.is_dir():
            return "it is a directory"
        if path.exists() and not path.is_file():
            return "it is not a regular file"
        with path.open("rb"):
            return None if path.stat().st_size <= MAX_FILE_BYTES else "it is larger than 1 GB"
    except OSError as failure:
        return os_error_reason(failure)


FORMAT_UNITS: Mapping[str, Fraction | None] = {
    PSURF_FILE.suffix: CENTIMETRE,
    ".stl": None,
    ".obj": None,
    ".ply": None,
    ".glb": Fraction(1),
    ".gltf": Fraction(1),
}
"""Unit of length of each format [m]; None where the format has none."""


class UnknownSurfaceError(MoverError):
    """The suffix of a path is not a known format, or the unit of its format is unknown."""


def surface_unit(path: str | Path, unit: Fraction | None = None) -> Fraction:
    """Return the unit of length of a file [m] [default: that of its format].

    Raises UnknownSurfaceError for an unknown suffix, and for a format without a unit.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMAT_UNITS:
        problem = f"`{suffix}` is not a known suffix" if suffix else "the suffix is missing"
        hint = spelling_hint(suffix, FORMAT_UNITS)
        raise UnknownSurfaceError(f"{path}: {problem} of a surface; {hint}")
    known = unit or FORMAT_UNITS[suffix]
    if known is None:
        raise UnknownSurfaceError(
            f"{path}: {suffix} files have no unit of length; give the unit, such as `--unit mm`"
        )
    return known


def read_surface(path: str | Path, unit: Fraction | None = None) -> Surface:
    """Read the surface in a psurf or mesh file; `unit` [m] overrides that of its format.

    Raises:
        UnknownSurfaceError: the format or its unit is not known.
        InputError: the file cannot be read.
    """
    meant = surface_unit(path, unit)
    if Path(path).suffix.lower() == PSURF_FILE.suffix:
        return PSURF_FILE.read(path, meant)
    return read_mesh(path, meant)


def read_segment_surface(figure: Figure, segment: Segment, unit: Fraction | None = None) -> Surface:
    """Read the surface of a segment, in the segment's frame, from any format of `read_surface`.

    `unit` [m] overrides that of the format.

    Raises InputError when the segment has no psurf, or one that cannot be read.
    """
    place = origin_span(segment.origins, "psurf")
    if segment.psurf is None:
        message = f"segment `{segment.name}` has no psurf, so it has no shape"
        raise InputError([error(message, place, 'add `psurf = "FILE.pss";`')])
    if segment.psurf in figure.surfaces and unit is None:
        return figure.surfaces[segment.psurf].require_value()
    if figure.path is None:
        message = f"the psurf of `{segment.name}` cannot be found: the figure has no file"
        raise InputError([error(message, place)])
    try:
        return read_surface(figure.path.parent / segment.psurf, unit)
    except UnknownSurfaceError as failure:
        raise InputError([error(str(failure), place)]) from None


def with_surfaces(figure: Figure) -> Figure:
    """Return the figure with the surfaces of its psurfs, or with the errors of reading them.

    A later change of the files has no effect on it, nor on its copies in other processes.
    """
    surfaces = dict(figure.surfaces)
    for segment in figure.segments.values():
        if segment.psurf is not None and segment.psurf not in surfaces:
            try:
                surfaces[segment.psurf] = Parsed(read_segment_surface(figure, segment), ())
            except InputError as failure:
                surfaces[segment.psurf] = Parsed(None, failure.diagnostics)
    return replace(figure, surfaces=surfaces)


def segment_colour(figure: Figure, segment: Segment) -> tuple[float, float, float]:
    """Return the `rgb` of the first of a segment's attributes that has one; grey without any."""
    for name in segment.attributes:
        attribute = figure.attributes.get(name)
        rgb = None if attribute is None else attribute.fields.get("rgb")
        if isinstance(rgb, tuple) and len(rgb) == 3:
            red, green, blue = (min(max(part, 0.0), 1.0) for part in rgb)
            return red, green, blue
    return GREY
