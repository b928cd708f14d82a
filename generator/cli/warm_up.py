"""`mover warm-up`: compile ahead what a first simulation would compile."""

import time

from generator.cli.answer import CommandResult, format_table
from generator.cli.interrupts import hold_interrupts
from generator.cli.progress import load_compiled_integrator
from generator.diagnostics import NotInstalledError
from generator.figure_file.read import read_figure
from generator.scene import Scene
from generator.simulation.compiled.code_cache import (
    cache_folder,
    expected_folder,
    is_compiled,
    require_numba,
)
from generator.simulation.import_exudyn import import_exudyn
from generator.simulation.plan import Plan

FIGURE = "prototype"
"""The figure whose laws are compiled."""


def warm_up(*, show_progress: bool = False) -> CommandResult:
    """Compile the integrator ahead of the first simulation.

    The laws of the prototype and contact are compiled as well. Laws of other forms, and the code
    for closed loops, links and self-contact, are compiled when a figure first has them.
    """
    was_compiled, start = is_compiled(), time.monotonic()
    with hold_interrupts():
        import_exudyn()
    load_compiled_integrator(show_progress=show_progress)
    try:
        require_numba()
        from generator.simulation.compiled_run import compile_model
    except ImportError as failure:
        raise NotInstalledError(f"numba cannot be loaded: {failure}") from None
    from generator.simulation.model import ExudynModel

    floor = Scene.floor()
    compile_model(
        ExudynModel.of(read_figure(FIGURE), Plan(free_root=True, height=0.0, scene=floor))
    )
    seconds, folder = time.monotonic() - start, cache_folder()
    place = (
        f"nowhere, because {expected_folder()} cannot be used: every run compiles anew"
        if folder is None
        else str(folder)
    )
    if was_compiled:
        headline = "The integrator was compiled already"
        headline += f"; the laws and contact took {seconds:.1f} s."
    else:
        headline = f"Compiled the integrator in {seconds:.1f} s."
    return CommandResult(
        text="\n".join([headline, format_table([("stored", place)], left_columns=2)]),
        data={
            "compiled_before": was_compiled,
            "folder": None if folder is None else str(folder),
            "wall_s": seconds,
        },
    )
