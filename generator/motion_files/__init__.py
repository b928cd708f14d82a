"""Motions as files: one format a module, each with `write(clip, path)`, which tells its losses."""

from generator.motion_files.action import (
    ActionFile,
    action_of,
    clip_of_action,
    format_action,
    parse_action,
    read_action,
)
from generator.motion_files.formats import FORMATS, UnknownFormatError, format_of, write_recording
from generator.motion_files.motion import Clip, clip_of_recording
from generator.motion_files.npz import read_npz

__all__ = [
    "FORMATS",
    "ActionFile",
    "Clip",
    "UnknownFormatError",
    "action_of",
    "clip_of_action",
    "clip_of_recording",
    "format_action",
    "format_of",
    "parse_action",
    "read_action",
    "read_npz",
    "write_recording",
]
