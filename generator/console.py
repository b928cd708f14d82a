"""How far a run is, drawn on a terminal."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

if TYPE_CHECKING:
    from generator.engine.simulate import Progress as Reached


class RateColumn(ProgressColumn):
    """Simulated seconds in a second."""

    def render(self, task: Task) -> Text:
        """The rate of the running pass."""
        return Text("" if task.speed is None else f"{task.speed:.2f} x real time")


@contextmanager
def progress_bar(start: float, stop: float) -> Generator[Callable[["Reached"], None]]:
    """A bar on the standard error stream for a run from `start` to `stop` [s].

    It shows the pass that the run is in, simulated time, rate and time to go, and is wiped away at
    the end. Yields what must be told how far the run is.
    """
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.2f} of {task.total:.2f} s"),
        RateColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    row = bar.add_task("building", total=stop - start)
    running = 0

    def watch(reached: "Reached") -> None:
        nonlocal running
        if reached.pass_number != running:
            running = reached.pass_number
            said = f"pass {running}, step {1000.0 * reached.step:.3g} ms"
            bar.reset(row, description=said)
        bar.update(row, completed=reached.time - start)

    with bar:
        yield watch


@contextmanager
def counting_bar(total: int, noun: str) -> Generator[Callable[[str], None]]:
    """A bar on the standard error stream for `total` pieces of work, wiped away at the end.

    It shows how many are done and which was the last. Yields what must be told the name of each.
    """
    bar = Progress(
        BarColumn(),
        TextColumn(f"{{task.completed}} of {{task.total}} {noun}"),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
        console=Console(stderr=True),
        transient=True,
    )
    row = bar.add_task("", total=total)

    def done(name: str) -> None:
        bar.update(row, advance=1, description=name)

    with bar:
        yield done
