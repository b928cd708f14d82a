"""Folder of compiled code, named by the hash of the sources from which it is compiled.

numba's own cache checks the file of a function only, not those of the functions that it calls. The
folder is named by the hash of all files of this package, so its code is never stale. The laws that
are generated later are stored in it, each in a file named by its own hash.
"""

import re
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

KEPT_FOLDERS = 4
"""Number of folders that are kept: that of this version, and the newest others."""

_MARK = "complete"
"""File that marks that the integrator is compiled, except what later files hold."""

_LATER_FILES = (
    "closure.py",
    "contact_forces.py",
    "projection.py",
    "row_motion.py",
    "self_contact_forces.py",
)
"""Files that are compiled when a figure first has closed loops, linked rotations, props, or
segments that touch each other."""

_FOLDER = Path(__file__).parent

_CONTACT_MODULES = ("generator.scene", "generator.self_contact", "springs.contact")
"""Modules that define the law of contact, which is compiled into the integrator."""

listeners: list[Callable[[str], None]] = []
"""Called with the name of each function of the integrator before it is compiled or loaded."""


def require_numba() -> None:
    """Import numba, whose libraries may fail to load by other errors than an `ImportError`.

    Raises:
        ImportError: numba is missing or broken.
    """
    try:
        import_module("numba")
    except ImportError:
        raise
    except Exception as failure:
        raise ImportError(f"{type(failure).__name__}: {failure}") from failure


@cache
def _sources() -> tuple[str, ...]:
    others = [Path(str(import_module(name).__file__)) for name in _CONTACT_MODULES]
    paths = [*sorted(_FOLDER.glob("*.py")), *others]
    return tuple(path.read_text(encoding="utf-8") for path in paths)


@cache
def count_functions() -> int:
    """Return the number of functions that are compiled when the integrator is imported."""
    files = _FOLDER.glob("*.py")
    sources = [path.read_text(encoding="utf-8") for path in files if path.name not in _LATER_FILES]
    return sum(len(re.findall(r"^@compiled\(", source, re.MULTILINE)) for source in sources)


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


def forget_function(function: Callable[..., Any]) -> None:
    """Remove the stored code of a function."""
    folder = cache_folder()
    if folder is None:
        return
    name = f"{Path(function.__code__.co_filename).stem}.{function.__name__}-"
    for path in folder.rglob("*.nb[ic]"):
        if path.name.startswith(name):
            with suppress(OSError):
                path.unlink()


def is_compiled() -> bool:
    """Return whether the integrator has been compiled on this machine."""
    folder = cache_folder()
    return folder is not None and (folder / _MARK).exists()


def mark_compiled() -> None:
    """Mark the integrator as compiled, and remove the oldest folders."""
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
        return  # another process may have removed them; the code is compiled nevertheless
