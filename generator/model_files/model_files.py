"""The files of an exported model, with the meshes of its segments (`.stl`), and their losses."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from generator.diagnostics import Diagnostic, InputError, Parsed, Severity, error
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE
from generator.geometry.appearance import Colour, segment_appearances
from generator.geometry.intersections import triangulate
from generator.geometry.psurf import PSURF_FILE
from generator.geometry.surface import Surface
from generator.identifiers import plain_names
from generator.input_files.coordinates import COORDINATE_NAMES
from generator.losses import Loss, Losses
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.read import load_springs
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
