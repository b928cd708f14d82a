"""`mover warm-up`: compile ahead what a first simulation would compile."""

import time
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from generator.cli.answer import CommandResult, Paragraphs, Table
from generator.cli.progress import load_compiled_integrator, load_exudyn
from generator.contact.scene import Scene
from generator.diagnostics import NotInstalledError
from generator.figure_file.read import read_figure
from generator.simulation.compiled.code_cache import (
    cache_folder,
    expected_folder,
    is_compiled,
    require_numba,
)
from generator.simulation.plan import Plan

FIGURE = "prototype"
"""The figure whose laws are compiled."""


@dataclass(frozen=True)
class WarmUp(CommandResult):
    """Compilation of the integrator, and the folder of its code, if any."""

    compiled_before: bool
    folder: Path | None
    wall_s: float

    def paragraphs(self) -> Paragraphs:
        """Return the time and the folder."""
        headline = f"Compiled the integrator in {self.wall_s:.1f} s."
        if self.compiled_before:
            headline = "The integrator was compiled already; the laws and contact took "
            headline += f"{self.wall_s:.1f} s."
        place = (
            f"nowhere, because {expected_folder()} cannot be used: every run compiles anew"
            if self.folder is None
            else str(self.folder)
        )
        yield f"{headline}\n{Table([('stored', place)], 2)}"


def warm_up(*, show_progress: bool = False) -> CommandResult:
    """Compile the integrator ahead of the first simulation.

    The laws of the prototype, contact and the implicit method are compiled as well. Laws of other
    forms, and the code for closed loops, links and self-contact, are compiled when a figure first
    has them.
    """
    was_compiled, start = is_compiled(), time.monotonic()
    load_exudyn()
    load_compiled_integrator(show_progress=show_progress)
    try:
        require_numba()
        from generator.simulation.compiled_run import compile_model
    except ImportError as failure:
        raise NotInstalledError(f"numba cannot be loaded: {failure}") from None
    from generator.simulation.run_model import prepare_run

    floor = Scene.floor()
    compile_model(prepare_run(read_figure(FIGURE), Plan(free_root=True, height=0.0, scene=floor)))
    import_module("generator.simulation.compiled.implicit")
    return WarmUp(was_compiled, cache_folder(), time.monotonic() - start)
