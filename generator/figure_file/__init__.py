"""From text to a `Figure`: tokens, syntax, resolve, check."""

from generator.figure_file.check import simulation_diagnostics
from generator.figure_file.read import FIGURE_FILE, read_figure

__all__ = ["FIGURE_FILE", "read_figure", "simulation_diagnostics"]
