"""How far a run is, drawn on a terminal."""

from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TaskID, TextColumn
from rich.progress import Task as Row
from rich.progress import TimeRemainingColumn
from rich.text import Text

if TYPE_CHECKING:
    from generator.engine.simulate import Progress as Reached


class ProgressBar:
    """A bar for the pass that a run is in: simulated time, rate, and time to go."""

    def __init__(self, start: float, stop: float) -> None:
        """The bar of a run from `start` to `stop` [s], on the standard error stream."""
        self._start, self._whole = start, stop - start
        self._pass: int | None = None
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            _Simulated(stop),
            _Rate(),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self._row: TaskID = self._bar.add_task("building", total=self._whole)

    def __enter__(self) -> Self:
        """Begin to draw."""
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Wipe the bar away."""
        self._bar.stop()

    def watch(self, reached: "Reached") -> None:
        """Draw how far the run is; a new pass begins the bar anew."""
        if reached.pass_number != self._pass:
            self._pass = reached.pass_number
            said = f"pass {reached.pass_number}, step {1000.0 * reached.step:.3g} ms"
            self._bar.reset(self._row, total=self._whole, description=said, start_time=self._start)
        self._bar.update(
            self._row, completed=reached.time - self._start, time=reached.time
        )
