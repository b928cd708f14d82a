"""A model of another program as a figure, and the files that hold it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path

from generator.figure import Figure
from generator.figure_file.write import write_figure
from generator.geometry.psurf import format_psurf
from generator.geometry.read import PSURF_SUFFIX
from generator.geometry.surface import Surface
from generator.losses import Loss, Losses
from generator.model_files.model_files import ModelFiles, geometry_folder
from generator.names import reserve_name
from generator.springs_file.parse import SPRINGS_SUFFIX, SpringsFile
from generator.springs_file.write import write_springs


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
        surfaces: of segments, in their frames; the figure names no psurfs before it has a path.
    """

    figure: Figure
    springs: SpringsFile | None
    losses: Losses
    coordinates: Mapping[str, CoordinateMapping]
    surfaces: Mapping[str, Surface] = field(default_factory=dict[str, Surface])


def springs_path(path: Path) -> Path:
    """Return the path of the springs of the figure file at `path`."""
    return path.with_name(f"{path.stem}{SPRINGS_SUFFIX}")


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


def format_imported_springs(springs: SpringsFile, path: Path) -> str:
    """Format the springs file beside the figure file at `path`."""
    comment = f"Passive joints of {path.name} that its own fields cannot hold."
    return write_springs(springs, comment)


def imported_files(imported: Imported, path: Path) -> ModelFiles:
    """Return the files of a figure at `path`: its psurfs, its springs file, and the figure."""
    folder = psurf_folder(path)
    files: dict[Path, str | bytes] = {}
    figure = imported.figure
    taken: set[str] = set()
    for name, surface in imported.surfaces.items():
        psurf = folder / f"{reserve_name(name[:_MAX_NAME_PART], taken)}{PSURF_SUFFIX}"
        files[psurf] = format_psurf(surface)
        segment = replace(figure.segments[name], psurf=f"{folder.name}/{psurf.name}")
        figure = figure.with_parts(segment)
    if imported.springs is not None:
        files[springs_path(path)] = format_imported_springs(imported.springs, path)
    files[path] = write_figure(figure)
    return ModelFiles(path, files, import_losses(imported, path))


def import_losses(imported: Imported, path: Path) -> Losses:
    """Return the losses of an import to the figure file at `path`."""
    losses, beside = imported.losses, springs_path(path)
    if imported.springs is not None or not beside.exists():
        return losses
    stale = Loss("an older springs file stands beside the figure and will be used", (str(beside),))
    return Losses.collect(losses.format, (*losses.entries, stale))
