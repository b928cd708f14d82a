"""From text to a `Figure`: tokens, syntax, resolve, check."""

from generator.figure_file.check import faults_for_simulation
from generator.figure_file.read import (
    Reading,
    examine_figure,
    find_figure,
    parse_figure,
    read_figure,
    shipped_figures,
)

__all__ = [
    "Reading",
    "examine_figure",
    "faults_for_simulation",
    "find_figure",
    "parse_figure",
    "read_figure",
    "shipped_figures",
]
