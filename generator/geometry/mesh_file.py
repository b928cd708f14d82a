"""Surfaces from the mesh formats that trimesh reads."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import cast

import numpy as np
import trimesh

from generator.errors import InputError, error
from generator.geometry.joined_vertices import with_joined_vertices
from generator.geometry.surface import Surface
from generator.whole_file import reason_of

LARGEST = 1_000_000_000
"""Bytes of the largest file that is read."""

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
    try:
        mesh = _load(path, file_type=suffix[1:], force="mesh", process=False)
    except Exception as failure:  # readers of foreign bytes raise whatever they trip over
        said = " ".join(str(failure).split()) or type(failure).__name__
        raise InputError([error(f"`{path}` cannot be read as {suffix[1:]}: {said}")]) from None
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
