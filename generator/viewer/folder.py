"""Files that the page reads and writes: inside its folder, and never in place of another file."""

import os
import re
from collections.abc import Collection
from itertools import count
from pathlib import Path

from generator.diagnostics import UsageError, shorten
from generator.text_io import os_error_reason, write_atomic


def path_in_folder(folder: Path, text: str, suffixes: Collection[str]) -> Path:
    """Return the path of a file in a folder, or in one inside it, from a name that was typed.

    Symbolic links are followed before the path is compared with the folder. Raises UsageError for
    text that names no file, has none of the suffixes (lower case), or leads out.
    """
    name = text.strip()
    if not name:
        raise UsageError(f"the file needs a name, such as `name{min(suffixes)}`")
    if not name.isprintable():
        raise UsageError(f"`{_shown(name)}` is not the name of a file")
    path = Path(name)
    if path.suffix.lower() not in suffixes:
        raise UsageError(f"`{_shown(name)}` must end in {' or '.join(sorted(suffixes))}")
    base = os.path.realpath(folder)
    target = Path(os.path.realpath(os.path.join(base, path)))
    if path.is_absolute() or not target.is_relative_to(base):
        raise UsageError(f"`{_shown(name)}` is not in the folder of the page")
    return target


def free_path(path: Path) -> Path:
    """Return this path, or one with a number such as `new-2.pose` if the file already exists."""
    if not os.path.lexists(path):
        return path
    suffix = "".join(path.suffixes[-2:]) if path.suffix.lower() == ".toml" else path.suffix
    stem = path.name.removesuffix(suffix)
    numbered = re.fullmatch(r"(.+)-([1-9]\d{0,5})", stem)
    stem, first = (numbered[1], int(numbered[2]) + 1) if numbered else (stem, 2)
    names = (path.with_name(f"{stem}-{number}{suffix}") for number in count(first))
    return next(name for name in names if not os.path.lexists(name))


def written_text(requested: Path, written: Path) -> str:
    """Return the name of a file that was written, and why it is not the one that was requested."""
    reason = "" if written == requested else f"; {requested.name} exists and was kept"
    return written.name + reason


def save_text(path: Path, text: str) -> None:
    """Write a file, whole or not at all. Raises UsageError if it cannot be written."""
    try:
        write_atomic(path, text)
    except OSError as failure:
        raise UsageError(f"`{path.name}` cannot be saved: {os_error_reason(failure)}") from None


def name_in_folder(folder: Path, path: Path) -> str:
    """Return the name by which the page finds a file of its folder."""
    return path.relative_to(os.path.realpath(folder)).as_posix()


def names_in_folder(folder: Path, suffix: str) -> tuple[str, ...]:
    """Return the sorted names of the files with a suffix that stand directly in a folder."""
    try:
        with os.scandir(folder) as entries:
            names = [entry.name for entry in entries if entry.is_file()]
    except OSError:
        return ()
    return tuple(sorted(n for n in names if Path(n).suffix.lower() == suffix and n.isprintable()))


def _shown(name: str) -> str:
    """Shorten a name for a sentence, without characters that cannot be printed."""
    return shorten("".join(char if char.isprintable() else "?" for char in name))
