"""`mover simulate --replay`: a live simulation of the page, computed again."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from generator.cli.answer import CommandResult, format_table
from generator.cli.inputs import load_figure
from generator.cli.interrupts import defer_interrupt, hold_interrupts
from generator.cli.outputs import (
    LossesByPath,
    check_motion_formats,
    check_writable,
    losses_data,
    losses_text,
    write_motion,
)
from generator.cli.progress import load_compiled_integrator, no_run_monitor, progress_bar
from generator.conversion import find_named_figure
from generator.diagnostics import Diagnostic, UsageError, format_count, warning
from generator.figure import Figure
from generator.input_files.live import LIVE_FILE, LiveLog
from generator.motion_files import MOTION_FORMATS, motion_from_recording
from generator.motion_files.motion import file_sha256
from generator.recording import Recording, energy_kinds
from generator.simulation.import_exudyn import import_exudyn

_OPTION_NAMES = {"displacements": "set", "velocities": "velocity", "locks": "lock"}
"""Options whose parameters have other names."""

_COMPATIBLE = ("name", "replay", "outputs", "show_progress")


def check_only_replay(options: Mapping[str, Any]) -> None:
    """Raise UsageError for options of `mover simulate` that contradict --replay."""
    for name, value in options.items():
        if name not in _COMPATIBLE and value not in (None, False, []):
            option = _OPTION_NAMES.get(name, name.replace("_", "-"))
            raise UsageError(f"--replay takes the whole run from its file: leave out --{option}")


def replay_live(
    path: Path, name: str | None, files: Sequence[Path], *, show_progress: bool
) -> CommandResult:
    """Compute the motion of a live file again, and write it."""
    check_motion_formats(files)
    parsed = LIVE_FILE.parse_file(path)
    log = parsed.require_value()
    figure, warnings = _load_figure_of(log, path, name)
    check_writable(files, (path, figure.path), reader="run")
    log = replace(log, start=replace(log.start, springs=_find_springs(log.start.springs, path)))
    with hold_interrupts():  # Exudyn would report Ctrl-C as a damaged installation
        import_exudyn()
    load_compiled_integrator(show_progress=show_progress)
    from generator.simulation.live import replay  # the import of Exudyn is slow
    from generator.simulation.run import Progress

    stop = max(log.end_frame, 1) * log.start.frame
    monitor = progress_bar if show_progress else no_run_monitor
    with defer_interrupt() as check, monitor(0.0, stop) as update:

        def watch(time: float) -> None:
            update(Progress(1, log.start.frame, time))
            check()

        live = replay(figure, log, watch, path.parent)
        recording = live.recording()
        written = write_motion(motion_from_recording(recording, figure, live.springs), files)
    return CommandResult(
        text=_summary(log, recording, files),
        details=losses_text(written),
        data=_data(log, recording, written),
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


def _summary(log: LiveLog, recording: Recording, files: Sequence[Path]) -> str:
    """Format outcome, springs, energy and files in a few lines."""
    balance = recording.energy_balance
    exchanged = max(float(np.ptp(values)) for values in recording.energy.values())
    imbalance = float(np.max(np.abs(balance - balance[0])))
    rows = [
        ("figure", log.figure),
        ("springs", f"{recording.springs}, {recording.law} law"),
        ("energy", f"balanced to {imbalance:.2g} J, with {exchanged:.4g} J exchanged"),
        ("frames", f"{len(recording.times)}, {format_count(len(log.changes), 'change')}"),
        (
            "method",
            "compiled, without an estimate of the error; accelerations differ from Exudyn's by "
            f"{recording.agreement_with_exudyn:.1e} of the largest",
        ),
        (
            "wrote",
            ", ".join(map(str, files)) or f"nothing; -o FILE writes {' '.join(MOTION_FORMATS)}",
        ),
    ]
    return "\n".join([recording.outcome.message, format_table(rows, left_columns=2)])


def _data(log: LiveLog, recording: Recording, written: LossesByPath) -> dict[str, object]:
    """Return the summary for `--json`."""
    kinds = energy_kinds(recording.energy)
    return {
        "figure": log.figure,
        "outcome": recording.outcome.ending.value,
        "message": recording.outcome.message,
        "simulated_s": float(recording.times[-1] - recording.times[0]),
        "frames": len(recording.times),
        "changes": len(log.changes),
        "agreement_with_exudyn": recording.agreement_with_exudyn,
        "springs": recording.springs,
        "law": recording.law,
        "energy": {
            kind: {
                "first": float(recording.energy[kind][0]),
                "last": float(recording.energy[kind][-1]),
            }
            for kind in kinds
        },
        "files": [str(path) for path in written],
        "losses": losses_data(written),
    }
