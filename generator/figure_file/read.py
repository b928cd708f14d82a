"""Read figures from files, from texts, and by the name of a shipped one."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import figures
from generator.diagnostics import (
    Diagnostics,
    Parsed,
    Source,
    error,
    spelling_hint,
)
from generator.figure import Figure
from generator.figure_file.check import check_figure
from generator.figure_file.parser import parse_figure_block
from generator.figure_file.resolve import resolve_figure
from generator.text_io import is_file, parse_file, parse_text, path_exists

FIGURE_SUFFIX = ".fig"


def shipped_figures() -> dict[str, Path]:
    """The figures that come with this program, by name."""
    folder = Path(figures.__path__[0])
    return {path.stem: path for path in sorted(folder.glob(f"*{FIGURE_SUFFIX}"))}


def find_figure(path_or_name: str | Path) -> Path:
    """Return an existing path, else that of a shipped figure, else the path unchanged."""
    path = Path(path_or_name)
    return path if is_file(path) else shipped_figures().get(str(path_or_name), path)


def read_figure(path_or_name: str | Path) -> Figure:
    """The figure in a file or of a shipped name.

    Raises InputError with all diagnostics on any error. Warnings pass.
    """
    return parse_figure_file(path_or_name).require_value()


def parse_figure_file(path_or_name: str | Path) -> Parsed[Figure]:
    """The figure in a file or of a shipped name, with all diagnostics; bad input raises nothing."""
    name, path = str(path_or_name), find_figure(path_or_name)
    if not path_exists(path):
        hint = spelling_hint(name, shipped_figures())
        missing = error(f"there is no file `{name}` and no shipped figure of that name", hint=hint)
        return Parsed(None, (missing,))
    return parse_file(path, partial(_parse_figure, path=path), name)


def parse_figure(text: str, name: str = "<text>") -> Parsed[Figure]:
    """The figure that `text` describes, with all diagnostics, which call the text `name`."""
    return parse_text(text, partial(_parse_figure, path=None), name)


def _parse_figure(source: Source, diagnostics: Diagnostics, path: Path | None) -> Figure | None:
    tree = parse_figure_block(source, diagnostics)
    if tree is None:
        return None
    directory = None if path is None else path.parent
    figure = check_figure(resolve_figure(tree, diagnostics), directory, diagnostics)
    return None if figure is None else replace(figure, path=path)
