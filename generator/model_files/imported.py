"""A model of another program as a figure, and the files that hold it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from generator.figure import Figure
from generator.figure_file.write import write_figure
from generator.losses import Loss, Losses
from generator.springs_file.parse import SPRINGS_SUFFIX, SpringsFile
from generator.springs_file.write import write_springs
from generator.text_io import write_atomic


@dataclass(frozen=True)
class CoordinateMapping:
    """The displacement of the figure that a coordinate of the model became.

    Attributes:
        joint: name of the joint.
        index: of the displacement among the joint's, from 0.
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
        losses: of the conversion.
        coordinates: by their names in the model.
    """

    figure: Figure
    springs: SpringsFile | None
    losses: Losses
    coordinates: Mapping[str, CoordinateMapping]


def springs_path(path: Path) -> Path:
    """Return the path of the springs of the figure file at `path`."""
    return path.with_name(f"{path.stem}{SPRINGS_SUFFIX}")


def format_imported_springs(springs: SpringsFile, path: Path) -> str:
    """Format the springs file beside the figure file at `path`."""
    comment = f"Passive joints of {path.name} that its own fields cannot hold."
    return write_springs(springs, comment)


def imported_files(imported: Imported, path: Path) -> dict[Path, str]:
    """Return the text of the figure file at `path`, and of the springs file beside it, by path.

    The figure is the last: it does not stand without its springs.
    """
    texts: dict[Path, str] = {}
    if imported.springs is not None:
        texts[springs_path(path)] = format_imported_springs(imported.springs, path)
    return {**texts, path: write_figure(imported.figure)}


def import_losses(imported: Imported, path: Path) -> Losses:
    """Return the losses of an import to the figure file at `path`."""
    losses, beside = imported.losses, springs_path(path)
    if imported.springs is not None or not beside.exists():
        return losses
    stale = Loss("an older springs file stands beside the figure and will be used", (str(beside),))
    return Losses.collect(losses.format, (*losses.entries, stale))


def write_imported(imported: Imported, path: Path) -> Losses:
    """Write the figure, and its springs file beside it if it has one.

    Raises:
        OSError: a file cannot be written.
    """
    for file, text in imported_files(imported, path).items():
        write_atomic(file, text)
    return import_losses(imported, path)
