"""The figure language itself (`.fig`): a figure in this program's own order and units."""

from pathlib import Path

from generator.figure import Figure
from generator.figure_file.write import write_figure
from generator.losses import Loss, Losses
from generator.springs_file.read import FIGURE_ORIGIN
from generator.text_io import write_atomic
from springs import SpringSet


def write(figure: Figure, springs: SpringSet, path: Path) -> Losses:
    """Write a figure file, whole or not at all; reading it gives an equal figure.

    Raises:
        OSError: the file cannot be written.
        ValueError: the language cannot say a name or a string of the figure.
    """
    write_atomic(path, write_figure(figure))
    said = [Loss("the comments of the figure's file, and the units it was written in")]
    psurfs = tuple(seg.psurf for seg in figure.segments.values() if seg.psurf is not None)
    if psurfs and (figure.path is None or figure.path.parent.resolve() != path.resolve().parent):
        said.append(
            Loss("the psurfs, which stay where they are", tuple(dict.fromkeys(map(str, psurfs))))
        )
    if springs.origin != FIGURE_ORIGIN and (springs.joints or springs.coupled):
        said.append(Loss(f"the springs of {springs.origin}", tuple(springs.joints)))
    return Losses("figure file", tuple(said))
