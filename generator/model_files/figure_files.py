"""The files of a figure: its psurfs in a folder, its springs beside it, and the figure itself."""

import re
from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

from generator.figure import Figure
from generator.figure_file.write import write_figure
from generator.geometry.psurf import PSURF_FILE, format_psurf
from generator.geometry.surface import Surface
from generator.identifiers import reserve_name
from generator.losses import Loss
from generator.model_files.model_files import geometry_folder
from generator.springs_file.parse import SPRINGS_FILE


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
