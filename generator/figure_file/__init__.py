"""From text to a `Figure`: tokens, syntax, resolve, check."""

from generator.figure_file.check import simulation_diagnostics
from generator.figure_file.read import (
    find_figure,
    parse_figure,
    parse_figure_file,
    read_figure,
    shipped_figures,
)

__all__ = [
    "find_figure",
    "parse_figure",
    "parse_figure_file",
    "read_figure",
    "shipped_figures",
    "simulation_diagnostics",
]
