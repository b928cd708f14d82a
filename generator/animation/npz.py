"""All arrays of a run in one `.npz`, bit for bit: `numpy.load` reads it, and so does this program.

An array is named after its place in the recording: `times`, `poses/SEGMENT`, `displacements/JOINT`,
`energy/KIND` ...; `about` is a text in JSON with all that is no array.
"""

import json
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from generator.animation.clip import Clip
from generator.exchange.losses import Loss, Losses
from generator.frames import Array
from generator.recording import Recording
from generator.whole_file import write_whole

VERSION = 1
ABOUT = "about"

BY_JOINT = ("displacements", "velocities", "rotation_vectors", "reactions", "passive_torques")
BY_DRIVEN_JOINT = "drive_torques"
BY_SEGMENT = "poses"
BY_FRAME = "error_by_frame"
ENERGY = "energy"


def write(clip: Clip, path: Path) -> Losses:
    """Write a motion with all that is known of it, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        OtherMotionError: the motion is of another figure.
    """
    arrays: dict[str, Array] = {"times": clip.times}
    arrays |= _named(BY_SEGMENT, clip.poses)
    run = clip.recording
    if run is None:
        arrays |= _named("displacements", clip.displacements)
    else:
        for field in BY_JOINT:
            arrays |= _named(field, getattr(run, field))
        arrays |= _named(BY_DRIVEN_JOINT, run.drive_torques)
        arrays |= {"centre_of_mass": run.centre_of_mass, BY_FRAME: run.accuracy.by_frame}
        arrays |= _named(ENERGY, run.energy)
    stream = BytesIO()
    np.savez_compressed(
        stream, allow_pickle=False, **arrays, **{ABOUT: np.array(json.dumps(_about(clip)))}
    )
    write_whole(path, stream.getvalue())
    return Losses(
        "npz", (Loss("the figure: its segments, masses and shapes; the names are there"),)
    )


def _named(field: str, arrays: Mapping[str, Array]) -> dict[str, Array]:
    return {f"{field}/{name}": array for name, array in arrays.items()}


def _about(clip: Clip) -> dict[str, Any]:
    """All that is no array; numbers that JSON does not have are words."""
    header, run = clip.header, clip.recording
    about: dict[str, Any] = {
        "npz": VERSION,
        "figure": header.figure,
        "sha256": header.sha256,
        "springs": header.springs,
        "law": header.law,
        "outcome": header.outcome.value,
        "message": header.message,
        "chains": {name: [[f.kind, *f.axis] for f in chain] for name, chain in clip.chains.items()},
    }
    if run is not None:
        about["run"] = _about_run(run)
    return about


def _about_run(run: Recording) -> dict[str, Any]:
    accuracy, outcome = run.accuracy, run.outcome
    return {
        "springs": run.springs,
        "law": run.law,
        "ending": outcome.ending.value,
        "message": outcome.message,
        "last_time": outcome.last_time,
        "joint": outcome.joint,
        "estimate": _word(accuracy.estimate),
        "asked": _word(accuracy.asked),
        "held_until": _word(accuracy.held_until),
        "step": accuracy.step,
        "steps": accuracy.steps,
        "constraint_drift": _word(run.constraint_drift),
        "strayed": _word(run.strayed),
        "wall_time": run.wall_time,
        "build_time": run.build_time,
    }


def _word(number: float | None) -> float | str | None:
    return number if number is None or np.isfinite(number) else repr(float(number))
