"""Motions as files: one format a module, each with `write(clip, path)`, which tells its losses."""

from generator.animation.action import ActionFile, action_of, clip_of_action, format_action
from generator.animation.action_reader import parse_action, read_action
from generator.animation.clip import Clip, clip_of_recording
from generator.animation.npz_reader import read_npz
from generator.animation.write import FORMATS, UnknownFormatError, format_of, write_recording

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
