"""Files that a command writes, or a sentence that says why it cannot."""

from pathlib import Path

from generator.errors import InputError, error
from generator.whole_file import reason_of, why_not_writable, write_whole


def write(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all. Raises InputError."""
    try:
        write_whole(path, content)
    except OSError as failure:
        raise _refused(path, reason_of(failure)) from None


def insist_on_file(path: Path) -> None:
    """See that a file can be written. Raises InputError."""
    if (reason := why_not_writable(path)) is not None:
        raise _refused(path, reason)


def insist_on_folder(folder: Path) -> None:
    """See that a folder is there, and make it where it is not. Raises InputError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise _refused(folder, "it is there already, and no directory") from None
    except OSError as failure:
        raise _refused(folder, reason_of(failure)) from None


def _refused(path: Path, reason: str) -> InputError:
    return InputError((error(f"`{path}` cannot be written: {reason}"),))
