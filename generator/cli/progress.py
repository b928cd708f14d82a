"""How far a command is, told by the command and shown by whoever runs it.

Ctrl-C as a wish that a run fulfils at its next frame, so that what was simulated is kept.

How far a run is, drawn on a terminal.
"""

import signal
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from types import FrameType
from typing import TYPE_CHECKING, TypeAlias

from rich.console import Console
from rich.progress import BarColumn, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.progress import Progress as ProgressBar
from rich.text import Text

if TYPE_CHECKING:
    from generator.simulation.run import Progress as Reached


@contextmanager
def defer_interrupt() -> Generator[Callable[[], None]]:
    """Hold Ctrl-C back; a second one acts at once.

    Yields what raises KeyboardInterrupt if there was a first: a run calls it where it can stop.
    """
    asked = False
    before = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        del number, frame
        asked = True
        signal.signal(signal.SIGINT, before)

    def check() -> None:
        if asked:
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)


ItemCallback: TypeAlias = Callable[[str], None]
"""Told the name of each piece of work when it is done."""

ItemMonitor: TypeAlias = Callable[[int, str], AbstractContextManager[ItemCallback]]
"""Opens what is told of a number of pieces of work, called by a noun: `progress(17, "plates")`."""


def no_item_monitor(total: int, noun: str) -> AbstractContextManager[ItemCallback]:
    """Shows nothing."""
    del total, noun
    return nullcontext(_ignore)


def _ignore(name: str) -> None:
    del name


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
    bar = ProgressBar(
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
def item_progress_bar(total: int, noun: str) -> Generator[Callable[[str], None]]:
    """A bar on the standard error stream for `total` pieces of work, wiped away at the end.

    It shows how many are done and which was the last. Yields what must be told the name of each.
    """
    bar = ProgressBar(
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
