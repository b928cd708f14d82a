"""Progress of a command on a terminal.

rich is imported for a bar only, since most runs write no progress to a terminal.
"""

import sys
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from importlib import import_module
from typing import TYPE_CHECKING, TypeAlias

from generator.cli.interrupts import hold_interrupts

if TYPE_CHECKING:
    from rich.progress import Progress as ProgressBar
    from rich.progress import Task, TaskID

    from generator.simulation.run import Progress
    from generator.study.sweep import SweepProgress


ItemCallback: TypeAlias = Callable[[str], None]
"""Takes the name of each piece of work that is done."""

ItemMonitor: TypeAlias = Callable[[int, str], AbstractContextManager[ItemCallback]]
"""Opens a callback for a number of pieces of work, called by a noun: `monitor(17, "plates")`."""

RunCallback: TypeAlias = Callable[["Progress"], None]
"""Takes the progress of a run."""

SweepCallback: TypeAlias = Callable[["SweepProgress"], None]
"""Takes the progress of a sweep."""


def no_monitor(*about: object) -> AbstractContextManager[Callable[[object], None]]:
    """Return a callback that shows no progress."""
    del about
    return nullcontext(_ignore)


def _ignore(value: object) -> None:
    del value


@contextmanager
def _bar(
    total: float | None, *columns: str, description: str = ""
) -> Generator[tuple["ProgressBar", "TaskID"]]:
    """Show a bar of one row on the standard error stream, removed at the end.

    A column is `bar`, a time `elapsed` or `remaining`, `rate` with its unit, or a text.
    """
    from rich import progress
    from rich.console import Console
    from rich.table import Column
    from rich.text import Text

    class RateColumn(progress.ProgressColumn):
        def __init__(self, unit: str) -> None:
            super().__init__(Column(no_wrap=True))
            self.unit = unit

        def render(self, task: "Task") -> "Text":
            return Text("" if task.speed is None else f"{task.speed:.3g} {self.unit}")

    def column(text: str) -> progress.ProgressColumn:
        match text.split(" ", 1):
            case ["bar"]:
                return progress.BarColumn()
            case ["elapsed"]:
                return progress.TimeElapsedColumn()
            case ["remaining"]:
                return progress.TimeRemainingColumn()
            case ["rate", unit]:
                return RateColumn(unit)
            case _:
                return progress.TextColumn(text)

    made = map(column, columns)
    bar = progress.Progress(*made, console=Console(stderr=True), transient=True)
    row = bar.add_task(description, total=total)
    with bar:
        yield bar, row


@contextmanager
def progress_bar(start: float, stop: float) -> Generator[RunCallback]:
    """Show the pass of a run from `start` to `stop` [s], its times and its rate."""
    columns = ("{task.description}", "bar", "{task.completed:.2f} of {task.total:.2f} s")
    rate = ("rate x real time", "remaining")
    pass_number = 0
    with _bar(stop - start, *columns, *rate, description="building") as (bar, row):

        def update(progress: "Progress") -> None:
            nonlocal pass_number
            if progress.pass_number != pass_number:
                pass_number = progress.pass_number
                text = f"pass {pass_number}, step {1000.0 * progress.step:.3g} ms"
                bar.reset(row, description=text)
            bar.update(row, completed=progress.time - start)

        yield update


@contextmanager
def item_progress_bar(total: int, noun: str) -> Generator[ItemCallback]:
    """Show how many of `total` pieces of work are done and which was the last."""
    count = f"{{task.completed}} of {{task.total}} {noun}"
    with _bar(total, "bar", count, "remaining", "{task.description}") as (bar, row):
        yield lambda name: bar.update(row, advance=1, description=name)


@contextmanager
def sweep_progress_bar(total: int) -> Generator[SweepCallback]:
    """Show how many runs of a study have finished and failed, and their rate."""
    columns = ("{task.completed} of {task.total} runs", "rate runs/s", "remaining")
    failed = 0
    with _bar(total, "bar", *columns, "{task.description}") as (bar, row):

        def update(progress: "SweepProgress") -> None:
            nonlocal failed
            if progress.latest is None:
                bar.reset(row, completed=progress.finished)
                return
            failed += not progress.latest.result.succeeded
            note = f"{failed} failed" if failed else ""
            bar.update(row, completed=progress.finished, description=note)

        yield update


@contextmanager
def run_counter(*, show_progress: bool) -> Generator[Callable[[], None]]:
    """Count runs on the standard error stream, where their number is not known ahead."""
    if not show_progress:
        yield lambda: None
        return
    with _bar(None, "run {task.completed}", "elapsed") as (bar, row):
        yield lambda: bar.advance(row)


def load_exudyn() -> None:
    """Import Exudyn with Ctrl-C held, which it would report as a damaged installation."""
    from generator.simulation.preconditions import import_exudyn

    with hold_interrupts():
        import_exudyn()


def load_compiled_integrator(*, show_progress: bool, only_to_compile: bool = False) -> None:
    """Import the compiled integrator, with a bar while it is compiled for the first time.

    It takes 200 MB; with `only_to_compile`, one that is compiled is left to other processes.

    Where numba cannot be loaded, nothing happens: the run says why it uses Exudyn's integrator.
    """
    from generator.simulation.compiled.code_cache import (
        cache_folder,
        count_functions,
        expected_folder,
        is_compiled,
        listeners,
        require_numba,
    )

    with suppress(ImportError), ExitStack() as stack:
        if only_to_compile and is_compiled():
            return
        require_numba()
        if show_progress and not is_compiled():
            how_often = (
                "once on this machine"
                if cache_folder()
                else f"in every run, because {expected_folder()} cannot be used"
            )
            print(f"Compiling the integrator, {how_often}.", file=sys.stderr)
            update = stack.enter_context(item_progress_bar(count_functions(), "functions"))
            listeners.append(update)
            stack.callback(listeners.remove, update)
        import_module("generator.simulation.compiled_run")
