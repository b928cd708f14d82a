"""Reading a figure: a path or the name of a shipped figure in, a `Figure` out."""

from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path

from generator.diagnostics import (
    Diagnostic,
    Diagnostics,
    InputError,
    Source,
    TooManyErrors,
    error,
    spelling_hint,
)
from generator.figure import Figure
from generator.figure_file.check import check_figure
from generator.figure_file.parser import parse_figure_block
from generator.figure_file.resolve import resolve_figure
from generator.text_io import load_text, normalise_newlines

FIGURE_SUFFIX = ".fig"


@dataclass(frozen=True)
class Reading:
    """What came of reading a figure.

    `figure` is None when `faults` holds an error. `path` is the directory in which the figure's
    neighbours (geometry, springs) lie, None for a figure that is in no file.
    """

    figure: Figure | None
    faults: tuple[Diagnostic, ...]
    source: Source
    path: Path | None


def shipped_figures() -> dict[str, Path]:
    """The figures that come with this program, by name."""
    folder = Path(str(files("figures")))
    return {path.stem: path for path in sorted(folder.glob(f"*{FIGURE_SUFFIX}"))}


def find_figure(path_or_name: str | Path) -> Path:
    """The file that is meant: an existing path, else a shipped name, else the path as given."""
    path = Path(path_or_name)
    return path if _is_file(path) else shipped_figures().get(str(path_or_name), path)


def read_figure(path_or_name: str | Path) -> Figure:
    """The figure in a file or of a shipped name.

    Raises InputError, which holds all faults, when anything is wrong. Warnings pass.
    """
    reading = parse_figure_file(path_or_name)
    if reading.figure is None:
        raise InputError(reading.faults)
    return reading.figure


def parse_figure_file(path_or_name: str | Path) -> Reading:
    """The figure in a file or of a shipped name, with all faults; bad input raises nothing."""
    name, path = str(path_or_name), find_figure(path_or_name)
    if not _exists(path):
        hint = spelling_hint(name, shipped_figures())
        missing = error(f"there is no file `{name}` and no shipped figure of that name", hint=hint)
        return Reading(None, (missing,), Source(name, ""), None)
    source, fault = load_text(path, name)
    if fault is not None:
        return Reading(None, (fault,), source, path.parent)
    reading = _parse_source(source, path.parent)
    if reading.figure is None:
        return reading
    return replace(reading, figure=replace(reading.figure, path=path))


def parse_figure(text: str, name: str = "<text>") -> Reading:
    """The figure that `text` describes, with all faults; `name` is what they call the text."""
    return _parse_source(Source(name, normalise_newlines(text)), None)


def _parse_source(source: Source, directory: Path | None) -> Reading:
    findings, figure = Diagnostics(), None
    with suppress(TooManyErrors):
        tree = parse_figure_block(source, findings)
        if tree is not None:
            figure = check_figure(resolve_figure(tree, findings), directory, findings)
    return Reading(figure, findings.sorted_by_position(), source, directory)


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # a name longer than any file's
        return False


def _is_file(path: Path) -> bool:
    return _exists(path) and path.is_file()
