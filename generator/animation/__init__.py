"""Motions as files: one format a module, each with `write(clip, path)`, which tells its losses."""

from generator.animation.action import ActionFile, action_of, format_action
from generator.animation.action_reader import parse_action, read_action
from generator.animation.write import FORMATS, UnknownFormatError, format_of, write_recording

__all__ = [
    "FORMATS",
    "ActionFile",
    "UnknownFormatError",
    "action_of",
    "format_action",
    "format_of",
    "parse_action",
    "read_action",
    "write_recording",
]
