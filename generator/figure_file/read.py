"""Read figures from files, from texts, and by the name of a shipped one."""

from dataclasses import replace
from pathlib import Path

from generator.diagnostics import Diagnostics, Source
from generator.figure import Figure
from generator.figure_file.check import check_figure
from generator.figure_file.parser import parse_figure_block
from generator.figure_file.resolve import resolve_figure
from generator.file_kind import FileKind
from generator.text_io import once_per_source


def read_figure(path_or_name: str | Path) -> Figure:
    """The figure in a file or of a shipped name.

    Raises InputError with all diagnostics on any error. Warnings pass.
    """
    return FIGURE_FILE.read(path_or_name)


_parse_block = once_per_source(parse_figure_block)


def _parse_figure(source: Source, diagnostics: Diagnostics) -> Figure | None:
    tree = _parse_block(source, diagnostics)
    if tree is None:
        return None
    folder = None if source.path is None else source.path.parent
    figure = check_figure(resolve_figure(tree, diagnostics), folder, diagnostics)
    return None if figure is None else replace(figure, path=source.path)


FIGURE_FILE = FileKind("figure", ".fig", _parse_figure, is_shipped=True, prefers_shipped=True)
