"""What a run says of itself when it is over."""

from collections.abc import Sequence
from pathlib import Path

from generator.commands.answer import aligned, finite
from generator.recording import ENERGY_KINDS, Recording


def summary_data(figure: str, recording: Recording, files: Sequence[Path]) -> dict[str, object]:
    """The object that `simulate --json` prints."""
    accuracy, outcome = recording.accuracy, recording.outcome
    return {
        "figure": figure,
        "outcome": outcome.ending.value,
        "message": outcome.message,
        "joint": outcome.joint,
        "simulated_s": _simulated(recording),
        "wall_s": recording.wall_time,
        "build_s": recording.build_time,
        "steps": accuracy.steps,
        "step_s": accuracy.step,
        "tolerance_rad": accuracy.asked,
        "error_estimate_rad": finite(accuracy.estimate),
        "held_until_s": accuracy.held_until,
        "energy": {
            kind: {"first": first, "last": last} for kind, first, last in _energies(recording)
        },
        "constraint_drift_m": recording.constraint_drift,
        "strayed_rad_or_m": recording.strayed,
        "springs": recording.springs,
        "law": recording.law,
        "files": [str(path) for path in files],
    }


def summary_text(recording: Recording, files: Sequence[Path]) -> str:
    """Outcome, error, energies, drift, times and files, for people."""
    energies = [("energy [J]", "first frame", "last frame", "change")]
    energies += [
        (kind, *(f"{value:.6g}" for value in (first, last, last - first)))
        for kind, first, last in _energies(recording)
    ]
    balance = recording.energy_balance
    kept = [float(balance[0]), float(balance[-1]), float(balance[-1] - balance[0])]
    energies.append(("sum less work", *(f"{value:.6g}" for value in kept)))
    lines = [recording.outcome.message, _accuracy(recording), "", aligned(energies), ""]
    lines.append(aligned(_figures(recording, files), left=2))
    return "\n".join(lines)


def failure_text(recording: Recording, files: Sequence[Path]) -> str | None:
    """Why a run failed and what became of its frames; None for a run that is done."""
    if recording.outcome.succeeded:
        return None
    kept = f"the frames up to {recording.times[-1]:.4g} s were"
    return f"{recording.outcome.message}; {kept} {'written' if files else 'simulated'}"


def _figures(recording: Recording, files: Sequence[Path]) -> list[tuple[str, str]]:
    simulated, wall = _simulated(recording), recording.wall_time
    rate = f", {simulated / wall:.3g} x real time" if wall > 0.0 else ""
    accuracy = recording.accuracy
    rows = [
        ("springs", f"{recording.springs}, {recording.law} law"),
        ("drift", f"{recording.constraint_drift:.2g} m between sites that joints hold together"),
        ("steps", f"{accuracy.steps} in all, the shortest {1000.0 * accuracy.step:.4g} ms"),
        ("time", f"{recording.build_time:.2f} s building, {wall:.2f} s stepping{rate}"),
    ]
    if recording.strayed > 0.0:
        strayed = f"{recording.strayed:.2g} rad or m in what is locked, linked or driven"
        rows.insert(2, ("", strayed))
    return rows + [("wrote", str(path)) for path in files]


def _accuracy(recording: Recording) -> str:
    accuracy = recording.accuracy
    if accuracy.asked is None:
        return "error not estimated, since the step was fixed"
    estimate, asked = finite(accuracy.estimate), f"{accuracy.asked:.1e} rad"
    if estimate is None:
        return f"error not estimated, since too few passes ended; {asked} was asked for"
    held = f"held until {accuracy.held_until:g} s"
    return f"estimated error {estimate:.1e} rad; {asked} was asked for and {held}"


def _simulated(recording: Recording) -> float:
    return float(recording.times[-1] - recording.times[0])


def _energies(recording: Recording) -> list[tuple[str, float, float]]:
    rows = ((kind, recording.energy[kind]) for kind in ENERGY_KINDS)
    return [(kind, float(values[0]), float(values[-1])) for kind, values in rows]
