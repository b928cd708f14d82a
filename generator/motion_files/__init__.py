"""Motions as files: one format a module, each with `write(clip, path)`, which tells its losses."""

from generator.motion_files.action import (
    ActionFile,
    action_from_recording,
    format_action,
    motion_from_action,
    parse_action,
    read_action,
)
from generator.motion_files.formats import (
    MOTION_FORMATS,
    UnknownMotionFormatError,
    motion_writer,
    write_recording,
)
from generator.motion_files.motion import FigureMotion, motion_from_recording
from generator.motion_files.npz import read_npz

__all__ = [
    "MOTION_FORMATS",
    "ActionFile",
    "FigureMotion",
    "UnknownMotionFormatError",
    "action_from_recording",
    "format_action",
    "motion_from_action",
    "motion_from_recording",
    "motion_writer",
    "parse_action",
    "read_action",
    "read_npz",
    "write_recording",
]
