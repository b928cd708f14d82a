"""Motions as files: one format a module, whose `write(motion, path)` returns its losses."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from generator.diagnostics import UsageError
from generator.losses import Losses
from generator.motion_files import action, bvh, npz, opensim_table, tables
from generator.motion_files.action import (
    ACTION_FILE,
    ActionFile,
    format_action,
    motion_from_action,
    read_action,
)
from generator.motion_files.motion import FigureMotion, motion_from_recording
from generator.motion_files.npz import read_npz
from generator.motion_files.opensim_table import COORDINATES_FILE, motion_from_coordinates
from generator.recording import Recording

__all__ = [
    "ACTION_FILE",
    "COORDINATES_FILE",
    "MOTION_FORMATS",
    "ActionFile",
    "FigureMotion",
    "MotionWriter",
    "UsageError",
    "format_action",
    "motion_from_action",
    "motion_from_coordinates",
    "motion_from_recording",
    "motion_writer",
    "read_action",
    "read_npz",
    "write_recording",
]

MotionWriter = Callable[[FigureMotion, Path], Losses]
"""Writes a motion to a path, whole or not at all, and returns the losses.

It raises OSError when the path cannot be written, ModelError when the motion is not one of
its figure, MoverError when the format cannot hold it at all.
"""


def _write_glb(motion: FigureMotion, path: Path) -> Losses:
    from generator.motion_files import glb  # imports what reads surfaces

    return glb.write(motion, path)


def _write_page(motion: FigureMotion, path: Path) -> Losses:
    from generator.motion_files import page  # imports what reads surfaces

    return page.write(motion, path)


MOTION_FORMATS: Mapping[str, MotionWriter] = {
    ".action": action.write,
    ".csv": tables.write_csv,
    ".npz": npz.write,
    ".glb": _write_glb,
    ".bvh": bvh.write,
    ".mot": opensim_table.write_mot,
    ".sto": opensim_table.write_sto,
    ".html": _write_page,
}
"""Writers by suffix."""

PICTURE_SUFFIXES = (".png", ".svg", ".pdf", ".mp4", ".gif")
"""Formats in which motions are drawn, which are not formats of motions."""


def motion_writer(path: Path, scale: float | None = None) -> MotionWriter:
    """Return the writer for the suffix of a path.

    Args:
        path: path of the file.
        scale: units of length of a `.bvh` in a metre; None for its default. Others have no scale.

    Raises:
        UsageError: the suffix is unknown.
    """
    suffix = path.suffix.lower()
    try:
        write = MOTION_FORMATS[suffix]
    except KeyError:
        problem = (
            f"`{path.suffix}` is not a known suffix" if path.suffix else "the suffix is missing"
        )
        hint = ""
        if path.suffix.lower() in PICTURE_SUFFIXES:
            hint = f"; `mover picture MOTION -o FILE{path.suffix}` draws a motion"
        message = f"{path}: {problem}; known are {', '.join(MOTION_FORMATS)}{hint}"
        raise UsageError(message) from None
    if scale is not None and suffix == ".bvh":
        return partial(bvh.write, scale=scale)
    return write


def write_recording(recording: Recording, path: Path) -> Losses:
    """Write a recording; see `Recording.write`."""
    return motion_writer(path)(motion_from_recording(recording), path)
