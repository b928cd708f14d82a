"""Surfaces from the mesh formats that trimesh reads."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import cast

import numpy as np
import trimesh

from generator.errors import Fault, InputError, error
from generator.geometry.joined_vertices import with_joined_vertices
from generator.geometry.surface import Surface
from generator.whole_file import reason_of

LARGEST = 1_000_000_000
"""Bytes of the largest file that is read."""

_STL = ".stl"
_STL_HEAD, _STL_TRIANGLE = 84, 50
"""Bytes of a binary STL file before its triangles, and of each."""

_load = cast("Callable[..., object]", trimesh.load)  # pyright: ignore[reportUnknownMemberType]


def read_mesh(path: str | Path, unit: Fraction) -> Surface:
    """The triangles in a mesh file whose lengths are in `unit` [m].

    Vertices at exactly the same place are one: STL has no shared vertices, and other formats repeat
    them where colours or normals change. Triangles that have no three corners left are dropped.

    Raises InputError when there is no such file, or no triangles in it.
    """
    path = Path(path)
    reason = _why_not_readable(path)
    if reason is not None:
        raise InputError([error(f"`{path}` cannot be read: {reason}")])
    suffix = path.suffix.lower()
    if suffix == _STL and (cut := _how_cut(path)) is not None:
        raise InputError([error(f"`{path}` cannot be read as stl: {cut}")])
    try:
        mesh = _load(path, file_type=suffix[1:], force="mesh", process=False)
    except Exception as failure:  # readers of foreign bytes raise whatever they trip over
        raise InputError([_unreadable(path, failure)]) from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise InputError([error(f"there are no faces in `{path}`")])
    vertices = np.asarray(mesh.vertices, dtype=np.float64) * float(unit)
    if not np.isfinite(vertices).all():
        raise InputError([error(f"a vertex in `{path}` is not finite")])
    try:
        surface = Surface.of(vertices, np.asarray(mesh.faces, dtype=np.int64), str(path))
    except ValueError as failure:
        raise InputError([error(f"`{path}`: {failure}")]) from None
    joined, _ = with_joined_vertices(surface)
    return joined


def _unreadable(path: Path, failure: Exception) -> Fault:
    """The fault of a file that trimesh does not read."""
    message = f"`{path}` cannot be read as {path.suffix.lower()[1:]}"
    damaged = "it is cut short, or holds something else"
    if isinstance(failure, ImportError):  # a guesser of encodings that bytes of no text call for
        return error(f"{message}: {damaged}")
    said = " ".join(str(failure).split()) or type(failure).__name__
    return error(f"{message}: {damaged}", hint=f"its reader says: {said}")


def _how_cut(path: Path) -> str | None:
    """What a binary STL file lacks; None for a whole one, and for one that is a text.

    80 bytes of anything, the number of triangles, and 50 bytes for each. trimesh would take one of
    another length for a text.
    """
    with path.open("rb") as file:
        head, size = file.read(_STL_HEAD), path.stat().st_size
    if b"\0" not in head:
        return None
    if len(head) < _STL_HEAD:
        return f"it is cut short, at {size} bytes, or holds something else"
    whole = _STL_HEAD + _STL_TRIANGLE * int.from_bytes(head[-4:], "little")
    if size >= whole:
        return None
    return f"it is cut short, at {size:,} of {whole:,} bytes, or holds something else"


def _why_not_readable(path: Path) -> str | None:
    try:
        if path.is_dir():
            return "it is a directory"
        if path.exists() and not path.is_file():
            return "it is no ordinary file"
        with path.open("rb"):
            return None if path.stat().st_size <= LARGEST else "it is larger than 1 GB"
    except OSError as failure:
        return reason_of(failure)
