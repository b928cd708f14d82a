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


def write_imported(imported: Imported, path: Path) -> Losses:
    """Write the figure, and its springs file beside it if it has one.

    Raises:
        OSError: a file cannot be written.
    """
    springs, beside = imported.springs, springs_path(path)
    losses, text = imported.losses, write_figure(imported.figure)
    if springs is not None:
        write_atomic(beside, format_imported_springs(springs, path))
    elif beside.exists():
        stale = Loss(
            "an older springs file stands beside the figure and will be used", (str(beside),)
        )
        losses = Losses.collect(losses.format, (*losses.entries, stale))
    write_atomic(path, text)
    return losses
