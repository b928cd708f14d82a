"""Folder of compiled code, named by the hash of the sources from which it is compiled.

numba's own cache looks at the file of a function only, not at those that it calls. In a folder that
the hash of all files of this package names, compiled code is never stale. The laws that are
generated later are stored beside it, each in a file named by its own hash.
"""

import re
import shutil
import tempfile
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path

from platformdirs import user_cache_path

KEPT_FOLDERS = 4
"""Number of folders, of this and of other versions, that are kept."""

_MARK = "complete"
"""File that says that the whole integrator is compiled."""

listeners: list[Callable[[str], None]] = []
"""Called with the name of each function of the integrator before it is compiled or loaded."""


_FOLDER = Path(__file__).parent

_LATER = ("closure", "projection", "row_motion")
"""Modules that are compiled when a figure first has a loop or a link."""


@cache
def _sources() -> tuple[str, ...]:
    return tuple(path.read_text(encoding="utf-8") for path in sorted(_FOLDER.glob("*.py")))


@cache
def count_functions() -> int:
    """Return the number of functions that are compiled for every figure."""
    texts = (
        path.read_text(encoding="utf-8") for path in _FOLDER.glob("*.py") if path.stem not in _LATER
    )
    return sum(len(re.findall(r"^@compiled\(", text, re.MULTILINE)) for text in texts)


@cache
def cache_folder() -> Path | None:
    """Return the folder of compiled code, created if necessary; None if it cannot be written."""
    folder = expected_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return None


def expected_folder() -> Path:
    """Return the folder in which compiled code belongs, whether or not it can be written."""
    digest = sha256("".join(_sources()).encode()).hexdigest()[:16]
    return user_cache_path("exudyn-mover", appauthor=False) / f"compiled-{digest}"


def is_compiled() -> bool:
    """Return whether the integrator has been compiled on this machine."""
    folder = cache_folder()
    return folder is not None and (folder / _MARK).exists()


def mark_compiled() -> None:
    """Note that the whole integrator is compiled, and remove the oldest folders."""
    folder = cache_folder()
    if folder is None or is_compiled():
        return
    try:
        (folder / _MARK).touch()
        others = [path for path in folder.parent.glob("compiled-*") if path != folder]
        others.sort(key=lambda path: path.stat().st_mtime)
        for path in others[: max(0, len(others) - KEPT_FOLDERS + 1)]:
            shutil.rmtree(path, ignore_errors=True)
    except OSError:
        return  # another process may have removed them; the code is compiled all the same
