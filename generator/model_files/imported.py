"""A model of another program as a figure, and the files that hold it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from generator.figure import Figure
from generator.geometry.surface import Surface
from generator.input_files.coordinates import (
    COORDINATE_NAMES,
    Coordinates,
    are_own_names,
    write_coordinates,
)
from generator.losses import Losses
from generator.model_files.figure_files import figure_files, older_springs_loss, springs_path
from generator.model_files.model_files import ModelFiles
from generator.springs_file.parse import SpringsFile
from generator.springs_file.write import write_springs


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
