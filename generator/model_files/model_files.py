"""The files of an exported model, with the meshes of its segments (`.stl`), and their losses."""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from generator.diagnostics import Diagnostic, InputError, Parsed, Severity, error
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE
from generator.figure_file.write import write_figure
from generator.geometry.appearance import Colour, segment_appearances
from generator.geometry.intersections import triangulate
from generator.geometry.psurf import PSURF_FILE, format_psurf
from generator.geometry.surface import Surface
from generator.identifiers import plain_names, reserve_name
from generator.input_files.coordinates import (
    COORDINATE_NAMES,
    Coordinates,
    are_own_names,
    write_coordinates,
)
from generator.losses import Loss, Losses
from generator.springs_file.parse import SPRINGS_FILE, SpringsFile
from generator.springs_file.read import load_springs
from generator.springs_file.write import write_springs
from generator.text_io import write_atomic


@dataclass(frozen=True)
class ModelFiles:
    """The files of a model: the model itself, and meshes or tables that belong to it.

    Attributes:
        path: path of the model, a file or a folder.
        contents: text or bytes by path, the model last: it is not whole without the others. A path
            is in the folder of the model, or in a folder there.
        losses: the parts of the figure and its springs that the files do not hold.
    """

    path: Path
    contents: Mapping[Path, str | bytes]
    losses: Losses

    def check_readable(self) -> None:
        """Check that this program reads its own kinds of files again: figure, springs, psurfs.

        Raises InputError for a file that it would refuse.
        """
        figure: Figure | None = None
        faults: list[Diagnostic] = []
        for path, content in reversed(list(self.contents.items())):  # the figure is the last
            if isinstance(content, bytes):
                continue
            has_figure = path in (
                SPRINGS_FILE.beside(self.path),
                COORDINATE_NAMES.beside(self.path),
            )
            parsed = _parse_again(path, content, figure if has_figure else None)
            if parsed is None:
                continue
            if isinstance(parsed.value, Figure):
                figure = parsed.value
            if parsed.value is None:
                faults.append(unreadable_file_error(path, parsed.diagnostics))
        if faults:
            raise InputError(faults)

    def write(self) -> Losses:
        """Write the files, each whole or not at all, and return the losses.

        Raises:
            InputError: this program would refuse to read one of the files; none is written.
            OSError: a file cannot be written.
        """
        self.check_readable()
        for path, content in self.contents.items():
            if path.parent != self.path.parent:
                path.parent.mkdir(exist_ok=True)
            write_atomic(path, content)
        return self.losses


def _parse_again(path: Path, text: str, figure: Figure | None) -> Parsed[Any] | None:
    """Parse the text of a file of this program; None for a file of another one.

    Args:
        path: path of the file.
        text: text of the file.
        figure: figure to which springs or coordinates are bound; None for springs that only
            extend others.
    """
    if path.suffix.lower() == FIGURE_FILE.suffix:
        return FIGURE_FILE.parse_text(text)
    if path.suffix == PSURF_FILE.suffix:
        return PSURF_FILE.parse_text(text)
    if path.name.endswith(COORDINATE_NAMES.suffix) and figure is not None:
        return COORDINATE_NAMES.parse_text(text, figure)
    if path.name.endswith(SPRINGS_FILE.suffix):
        if figure is None:
            return SPRINGS_FILE.parse_text(text)
        return load_springs(figure, choice=path, text=text)
    return None


def unreadable_file_error(path: Path, diagnostics: Iterable[Diagnostic]) -> Diagnostic:
    """Return the error of a file that would be refused by its reader."""
    first = next(each for each in diagnostics if each.severity is Severity.ERROR)
    place = "" if first.span is None else f", in line {first.span.line}"
    message = f"`{path}` is not written, because it could not be read again{place}: {first.message}"
    return error(message, hint=first.hint)


def geometry_folder(path: Path) -> Path:
    """Return the folder of the meshes of the model at `path`: `arm_geometry` of `arm.osim`."""
    return path.with_name(f"{path.stem}_geometry")


_HEADER = b"Binary STL, metres".ljust(80)
"""First bytes of a binary file; readers take one that begins with `solid` for text."""

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass(frozen=True)
class MeshFile:
    """The mesh of a segment.

    Attributes:
        path: path of its file.
        reference: the path from the folder of the model, with `/`.
        content: content of the file.
        colour: red, green and blue from 0 to 1.
    """

    path: Path
    reference: str
    content: bytes
    colour: Colour


def format_with_meshes(
    figure: Figure,
    path: Path,
    format_text: Callable[[Mapping[str, MeshFile]], tuple[str, Losses]],
    folder: Path | None = None,
) -> ModelFiles:
    """Format a model at `path` that refers to mesh files of its segments.

    Args:
        figure: the figure.
        path: path of the model.
        format_text: returns the text of the model with these meshes, by segment, and its losses.
        folder: folder of the meshes; None for `geometry_folder`.
    """
    meshes, mesh_losses = segment_meshes(figure, folder or geometry_folder(path))
    text, losses = format_text(meshes)
    for loss in mesh_losses:
        losses.add_loss(loss)
    contents = {mesh.path: mesh.content for mesh in meshes.values()}
    return ModelFiles(path, {**contents, path: text}, losses)


def segment_meshes(figure: Figure, folder: Path) -> tuple[dict[str, MeshFile], tuple[Loss, ...]]:
    """Return the meshes of a figure's segments in the segments' frames, and the losses.

    Args:
        figure: the figure.
        folder: folder of their files, which are named after the segments.
    """
    appearances, losses = segment_appearances(figure)
    names = plain_names(figure.segments)
    meshes: dict[str, MeshFile] = {}
    for name, one in appearances.items():
        file = folder / f"{names[name]}.stl"
        reference = f"{folder.name}/{file.name}"
        meshes[name] = MeshFile(file, reference, format_stl(one.surface), one.colour)
    return meshes, losses


def format_stl(surface: Surface) -> bytes:
    """Return a surface as a binary STL file: triangles with single-precision corners [m]."""
    corners, _ = triangulate(surface)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)[:, None]
    triangles = np.zeros(len(corners), dtype=_TRIANGLE)
    triangles["corners"] = corners
    triangles["normal"] = np.divide(
        normals, lengths, where=lengths > 0.0, out=np.zeros_like(normals)
    )
    return _HEADER + len(corners).to_bytes(4, "little") + triangles.tobytes()


def springs_path(path: Path, name: str | None = None) -> Path:
    """Return the path of the springs of the figure file at `path`; with a name, of others."""
    middle = "" if name is None else f".{name}"
    return path.with_name(f"{path.stem}{middle}{SPRINGS_FILE.suffix}")


_UNQUOTABLE = re.compile(r"[^ !#-\[\]-~]")
"""Characters that a string of the figure language may not have, or that differ by system."""


_MAX_NAME_PART = 80
"""Characters of a file's or a segment's name in the path of a psurf, whose length is limited."""


def psurf_folder(path: Path) -> Path:
    """Return the folder of the psurfs of the figure file at `path`."""
    stem = _UNQUOTABLE.sub("_", path.stem[:_MAX_NAME_PART])
    if stem != path.stem:  # the changed names of two figures may be the same
        stem += f"_{sha256(path.name.encode(errors='surrogateescape')).hexdigest()[:8]}"
    return geometry_folder(path.with_stem(stem))


def figure_files(
    figure: Figure,
    path: Path,
    surfaces: Mapping[str, Surface],
    beside: Mapping[Path, str],
    *,
    surface_names: Mapping[str, str] | None = None,
    comment: str = "",
) -> dict[Path, str | bytes]:
    """Return the files of a figure at `path`, the figure last: it is not whole without the others.

    Args:
        figure: names no psurfs.
        path: path of the figure file.
        surfaces: surfaces by their names, in the frames of their segments.
        beside: texts of other files beside the figure, such as its springs.
        surface_names: the surface of each segment that has one; None where each surface has the
            name of its segment.
        comment: one or more lines above the figure.
    """
    folder = psurf_folder(path)
    files: dict[Path, str | bytes] = {}
    psurfs: dict[str, str] = {}
    taken: set[str] = set()
    for name, surface in surfaces.items():
        psurf = folder / f"{reserve_name(name[:_MAX_NAME_PART], taken)}{PSURF_FILE.suffix}"
        files[psurf] = format_psurf(surface)
        psurfs[name] = f"{folder.name}/{psurf.name}"
    for segment, name in (surface_names or {name: name for name in surfaces}).items():
        figure = figure.with_parts(replace(figure.segments[segment], psurf=psurfs[name]))
    head = "".join(f"# {line}\n" for line in comment.splitlines())
    return {**files, **beside, path: f"{head}\n" * bool(head) + write_figure(figure)}


def older_springs_loss(path: Path) -> Loss | None:
    """Return the loss that springs beside the figure file at `path` are not of this figure."""
    beside = springs_path(path)
    if not beside.exists():
        return None
    return Loss("an older springs file stands beside the figure and will be used", (str(beside),))


@dataclass(frozen=True)
class Imported:
    """A model of another program as a figure.

    Attributes:
        figure: y up, with all displacements zero in the pose in which the model is drawn.
        springs: passive laws that the figure's own fields cannot hold; None without any.
        losses: losses of the conversion.
        coordinates: coordinates by their names in the model.
        surfaces: surfaces of segments, in their frames; the figure names no psurfs before it has a
            path.
    """

    figure: Figure
    springs: SpringsFile | None
    losses: Losses
    coordinates: Coordinates
    surfaces: Mapping[str, Surface] = field(default_factory=dict[str, Surface])


def format_imported_springs(springs: SpringsFile, path: Path) -> str:
    """Format the springs file beside the figure file at `path`."""
    comment = f"Passive joints of {path.name} that its own fields cannot hold."
    return write_springs(springs, comment)


def imported_files(imported: Imported, path: Path) -> ModelFiles:
    """Return the files of a figure at `path`: its psurfs, springs and coordinates, and itself."""
    beside: dict[Path, str] = {}
    if imported.springs is not None:
        beside[springs_path(path)] = format_imported_springs(imported.springs, path)
    figure, coordinates = imported.figure, imported.coordinates
    if not are_own_names(coordinates, figure) or COORDINATE_NAMES.beside(path).exists():
        comment = f"Coordinates of the model that {path.name} is from, in its .mot and .sto files."
        beside[COORDINATE_NAMES.beside(path)] = write_coordinates(coordinates, figure, comment)
    files = figure_files(figure, path, imported.surfaces, beside)
    stale = older_springs_loss(path) if imported.springs is None else None
    losses = Losses.collect(imported.losses.format, (*imported.losses.entries, stale))
    return ModelFiles(path, files, losses)
