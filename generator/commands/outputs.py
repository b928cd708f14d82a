"""Files that commands write: whether they can be, and what is said when they cannot."""

from collections.abc import Iterable
from os.path import realpath
from pathlib import Path

from generator.errors import Fault, InputError, error
from generator.whole_file import reason_of, why_not_writable, write_whole


def insist_writable(
    paths: Iterable[Path], inputs: Iterable[str | Path | None], reader: str = "command"
) -> None:
    """Raise InputError for files that cannot be written, or that the command reads as well."""
    read = {realpath(path) for path in inputs if path is not None}
    reasons = [
        (path, f"the {reader} reads it" if realpath(path) in read else why_not_writable(path))
        for path in paths
    ]
    faults = [unwritable(path, reason) for path, reason in reasons if reason is not None]
    if faults:
        raise InputError(faults)


def write_text(path: Path, text: str) -> None:
    """Write a file whole or not at all. Raises InputError when it cannot be written."""
    try:
        write_whole(path, text)
    except OSError as failure:
        raise InputError((unwritable(path, reason_of(failure)),)) from None


def unwritable(path: Path, reason: str) -> Fault:
    """The fault of a file that cannot be written."""
    return error(f"`{path}` cannot be written: {reason}")
