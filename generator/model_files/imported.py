"""A model of another program as a figure, and the files that hold it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from generator.figure import Figure
from generator.geometry.surface import Surface
from generator.losses import Losses
from generator.model_files.figure_files import figure_files, older_springs_loss, springs_path
from generator.model_files.model_files import ModelFiles
from generator.springs_file.parse import SpringsFile
from generator.springs_file.write import write_springs


@dataclass(frozen=True)
class CoordinateMapping:
    """The displacement of the figure that a coordinate of the model became.

    Attributes:
        joint: name of the joint.
        index: index of the displacement among the joint's, from 0.
        offset: the model's value is `scale` times the displacement plus this [rad or m].
        scale: positive.
    """

    joint: str
    index: int
    offset: float = 0.0
    scale: float = 1.0


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
    coordinates: Mapping[str, CoordinateMapping]
    surfaces: Mapping[str, Surface] = field(default_factory=dict[str, Surface])


def format_imported_springs(springs: SpringsFile, path: Path) -> str:
    """Format the springs file beside the figure file at `path`."""
    comment = f"Passive joints of {path.name} that its own fields cannot hold."
    return write_springs(springs, comment)


def imported_files(imported: Imported, path: Path) -> ModelFiles:
    """Return the files of a figure at `path`: its psurfs, its springs file, and the figure."""
    springs: dict[Path, str] = {}
    if imported.springs is not None:
        springs[springs_path(path)] = format_imported_springs(imported.springs, path)
    files = figure_files(imported.figure, path, imported.surfaces, springs)
    stale = older_springs_loss(path) if imported.springs is None else None
    losses = Losses.collect(imported.losses.format, (*imported.losses.entries, stale))
    return ModelFiles(path, files, losses)
