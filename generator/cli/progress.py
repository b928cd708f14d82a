"""Progress of a command on a terminal.

rich is imported for a bar only, since most runs write no progress to a terminal.
"""

import sys
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from importlib import import_module
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from rich.progress import Progress as ProgressBar
    from rich.progress import ProgressColumn, Task
    from rich.text import Text

    from generator.simulation.run import Progress
    from generator.study.sweep import SweepProgress


ItemCallback: TypeAlias = Callable[[str], None]
"""Takes the name of each piece of work that is done."""

ItemMonitor: TypeAlias = Callable[[int, str], AbstractContextManager[ItemCallback]]
"""Opens a callback for a number of pieces of work, called by a noun: `monitor(17, "plates")`."""

RunCallback: TypeAlias = Callable[["Progress"], None]
"""Takes the progress of a run."""

RunMonitor: TypeAlias = Callable[[float, float], AbstractContextManager[RunCallback]]
"""Opens a callback for a run from a start to a stop [s]."""

SweepCallback: TypeAlias = Callable[["SweepProgress"], None]
"""Takes the progress of a sweep."""


def no_monitor(*about: object) -> AbstractContextManager[Callable[[object], None]]:
    """Return a callback that shows no progress."""
    del about
    return nullcontext(_ignore)


def _ignore(value: object) -> None:
    del value


def _rate_column(unit: str) -> "ProgressColumn":
    """Return a column with the progress in a second, called by its unit."""
    from rich.progress import ProgressColumn
    from rich.table import Column
    from rich.text import Text

    class RateColumn(ProgressColumn):
        def render(self, task: "Task") -> "Text":
            return Text("" if task.speed is None else f"{task.speed:.3g} {unit}")

    return RateColumn(Column(no_wrap=True))


def _new_bar(*columns: "ProgressColumn") -> "ProgressBar":
    """Return a bar on the standard error stream, removed at the end."""
    from rich.console import Console
    from rich.progress import Progress as ProgressBar

    return ProgressBar(*columns, console=Console(stderr=True), transient=True)


@contextmanager
def progress_bar(start: float, stop: float) -> Generator[RunCallback]:
    """Show a bar on the standard error stream for a run from `start` to `stop` [s].

    It shows the pass of the run, the simulated and the remaining time and the rate, and is removed
    at the end.
    """
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn

    bar = _new_bar(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.2f} of {task.total:.2f} s"),
        _rate_column("x real time"),
        TimeRemainingColumn(),
    )
    row = bar.add_task("building", total=stop - start)
    pass_number = 0

    def update(progress: "Progress") -> None:
        nonlocal pass_number
        if progress.pass_number != pass_number:
            pass_number = progress.pass_number
            bar.reset(row, description=f"pass {pass_number}, step {1000.0 * progress.step:.3g} ms")
        bar.update(row, completed=progress.time - start)

    with bar:
        yield update


@contextmanager
def item_progress_bar(total: int, noun: str) -> Generator[ItemCallback]:
    """Show a bar on the standard error stream for `total` pieces of work, removed at the end.

    It shows how many are done and which was the last.
    """
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn

    bar = _new_bar(
        BarColumn(),
        TextColumn(f"{{task.completed}} of {{task.total}} {noun}"),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    row = bar.add_task("", total=total)

    def update(name: str) -> None:
        bar.update(row, advance=1, description=name)

    with bar:
        yield update


@contextmanager
def sweep_progress_bar(total: int) -> Generator[SweepCallback]:
    """Show a bar on the standard error stream for the runs of a study, removed at the end.

    It shows how many have finished and failed, the rate and the remaining time.
    """
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn

    bar = _new_bar(
        BarColumn(),
        TextColumn("{task.completed} of {task.total} runs"),
        _rate_column("runs/s"),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    row = bar.add_task("", total=total)
    failed = 0

    def update(progress: "SweepProgress") -> None:
        nonlocal failed
        if progress.latest is None:
            bar.reset(row, completed=progress.finished)
            return
        failed += not progress.latest.result.succeeded
        note = f"{failed} failed" if failed else ""
        bar.update(row, completed=progress.finished, description=note)

    with bar:
        yield update


@contextmanager
def run_counter(*, show_progress: bool) -> Generator[Callable[[], None]]:
    """Count runs on the standard error stream, where their number is not known ahead."""
    if not show_progress:
        yield lambda: None
        return
    from rich.progress import TextColumn, TimeElapsedColumn

    bar = _new_bar(TextColumn("run {task.completed}"), TimeElapsedColumn())
    row = bar.add_task("", total=None)
    with bar:
        yield lambda: bar.advance(row)


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
