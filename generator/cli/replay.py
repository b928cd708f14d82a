"""`mover simulate --replay`: a live simulation of the page, computed again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from generator.cli import outputs
from generator.cli.answer import HIDDEN, CommandResult, Paragraphs, Table
from generator.cli.inputs import load_figure
from generator.cli.interrupts import defer_interrupt
from generator.cli.progress import load_compiled_integrator, load_exudyn, no_monitor, progress_bar
from generator.conversion import find_named_figure
from generator.diagnostics import Diagnostic, UsageError, format_count, warning
from generator.figure import Figure
from generator.input_files.live import LIVE_FILE, LiveLog
from generator.motion_files import motion_from_recording
from generator.motion_files.motion import file_sha256
from generator.recording import Ending, EnergyChange


@dataclass(frozen=True)
class ReplayResult(CommandResult):
    """Motion of a live simulation, computed again."""

    figure: str
    outcome: Ending
    message: str
    simulated_s: float
    frames: int
    changes: int
    agreement_with_exudyn: float | None
    springs: str
    law: str
    energy: Mapping[str, EnergyChange]
    files: Sequence[Path]
    losses: outputs.LossesByPath
    energy_text: str = field(metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return outcome, springs, energy and files in a few lines."""
        rows = [
            ("figure", self.figure),
            ("springs", f"{self.springs}, {self.law} law"),
            ("energy", self.energy_text),
            ("frames", f"{self.frames}, {format_count(self.changes, 'change')}"),
            (
                "method",
                "compiled, without an estimate of the error; accelerations differ from Exudyn's by "
                f"{self.agreement_with_exudyn:.1e} of the largest",
            ),
            ("wrote", ", ".join(map(str, self.files)) or outputs.NO_MOTION_FILES),
        ]
        yield f"{self.message}\n{Table(rows, 2)}"

    def details(self) -> Paragraphs:
        """Return the losses of files."""
        return (outputs.losses_text(self.losses),)


def replay_live(
    path: Path, name: str | None, files: Sequence[Path], *, show_progress: bool
) -> CommandResult:
    """Compute the motion of a live file again, and write it."""
    outputs.check_motion_formats(files)
    parsed = LIVE_FILE.parse_file(path)
    log = parsed.require_value()
    figure, warnings = _load_figure_of(log, path, name)
    outputs.check_writable(files, (path, figure.path), reader="run")
    log = replace(log, start=replace(log.start, springs=_find_springs(log.start.springs, path)))
    load_exudyn()
    load_compiled_integrator(show_progress=show_progress)
    from generator.simulation.live.live_run import replay  # the import of Exudyn is slow
    from generator.simulation.run import Progress

    stop = max(log.end_frame, 1) * log.start.frame
    monitor = progress_bar if show_progress else no_monitor
    with defer_interrupt() as check, monitor(0.0, stop) as update:

        def watch(time: float) -> None:
            update(Progress(1, log.start.frame, time))
            check()

        live = replay(figure, log, watch, path.parent)
        recording = live.recording()
        written = outputs.write_motion(motion_from_recording(recording), files)
    return ReplayResult(
        figure=log.figure,
        outcome=recording.outcome.ending,
        message=recording.outcome.message,
        simulated_s=float(recording.times[-1] - recording.times[0]),
        frames=len(recording.times),
        changes=len(log.changes),
        agreement_with_exudyn=recording.agreement_with_exudyn,
        springs=recording.springs,
        law=recording.law,
        energy=recording.energy_changes,
        files=files,
        losses=written,
        energy_text=recording.energy_text,
        diagnostics=(*parsed.diagnostics, *warnings),
    )


def _load_figure_of(
    log: LiveLog, path: Path, name: str | None
) -> tuple[Figure, tuple[Diagnostic, ...]]:
    """Load the figure that a live file names, or that the user does, with warnings.

    Raises:
        InputError: it is not found or wrong.
        UsageError: the user names a figure in another file.
    """
    found = str(find_named_figure(log.figure, log.sha256, path)) if name is None else name
    figure, warnings = load_figure(found)
    own = None if figure.path is None else figure.path.name
    if own != log.figure:
        raise UsageError(f"`{path}` is a live simulation of `{log.figure}`, not of `{own}`")
    if figure.path is not None and log.sha256 not in (None, file_sha256(figure.path)):
        changed = warning(
            f"`{path}` is a live simulation of another version of {log.figure}",
            hint="the motion is that of the present figure",
        )
        warnings = (*warnings, changed)
    return figure, warnings


def _find_springs(springs: str | None, path: Path) -> str | None:
    """Return a choice of springs; the path of a file may be relative to the live file."""
    if springs is None or not Path(springs).suffix or Path(springs).exists():
        return springs
    beside = path.parent / springs
    return str(beside) if beside.exists() else springs
