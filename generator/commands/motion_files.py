"""Files of motions that commands write: which can be asked for, and what was lost in each."""

from collections.abc import Mapping, Sequence
from os.path import realpath
from pathlib import Path

from generator.animation import Clip, UnknownFormatError, format_of
from generator.commands.answer import UsageError
from generator.commands.outputs import unwritable
from generator.errors import InputError, MoverError
from generator.exchange.losses import Losses
from generator.whole_file import reason_of

Written = Mapping[Path, Losses]
"""What the files that were written do not hold."""


def insist_on_formats(paths: Sequence[Path]) -> None:
    """Raise UsageError for a suffix that names no format of motions, and for a file given twice."""
    for path in paths:
        try:
            format_of(path)
        except UnknownFormatError as failure:
            raise UsageError(str(failure)) from None
    insist_distinct(paths)


def insist_distinct(paths: Sequence[Path]) -> None:
    """Raise UsageError for one file given twice."""
    targets: set[str] = set()
    for path in paths:
        if realpath(path) in targets:
            raise UsageError(f"{path}: the file was given before")
        targets.add(realpath(path))


def write_motion(clip: Clip, paths: Sequence[Path]) -> Written:
    """Write a motion to files, each in the format of its suffix.

    Raises:
        InputError: a file cannot be written.
        MoverError: a format cannot hold the motion.
    """
    written: dict[Path, Losses] = {}
    for path in paths:
        try:
            written[path] = format_of(path)(clip, path)
        except OSError as failure:
            raise InputError((unwritable(path, reason_of(failure)),)) from None
        except ValueError as failure:
            raise MoverError(f"`{path}` cannot be written: {failure}") from None
    return written


def losses_text(written: Written) -> str:
    """What the files do not hold, for people; empty where nothing is to be said."""
    parts = [
        "\n".join([f"not in {path}:", *(f"  {loss}" for loss in losses.each)])
        for path, losses in written.items()
        if losses.each
    ]
    return "\n".join(parts)


def losses_data(written: Written) -> dict[str, object]:
    """What the files do not hold, for `--json`, by file."""
    return {str(path): losses.as_data() for path, losses in written.items()}
