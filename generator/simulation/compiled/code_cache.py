"""Folder of compiled code, named by the hash of the sources from which it is compiled.

numba's own cache checks the file of a function only, not those of the functions that it calls. The
folder is named by the hash of all files of this package, so its code is never stale. The laws that
are generated later are stored in it, each in a file named by its own hash.

A stored file is a pickle, which runs programs when it is loaded. A folder into which other users of
the machine could have put one is not used; on Windows this is not checked.
"""

import os
import re
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
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
    "implicit.py",
    "projection.py",
    "row_motion.py",
    "self_contact_forces.py",
)
"""Files that are compiled when a figure first has closed loops, linked rotations, props, or
segments that touch each other, and with the implicit method."""

_FOLDER = Path(__file__).parent

_CONTACT_FOLDER = _FOLDER.parents[1] / "contact"
"""Folder that defines the forces of contact, which are compiled into the integrator."""

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
    surface = Path(str(import_module("springs.contact").__file__))
    paths = [*sorted(_FOLDER.glob("*.py")), *sorted(_CONTACT_FOLDER.glob("*.py")), surface]
    return tuple(path.read_text(encoding="utf-8") for path in paths)


@cache
def count_functions() -> int:
    """Return the number of functions that are compiled when the integrator is imported."""
    files = _FOLDER.glob("*.py")
    sources = [path.read_text(encoding="utf-8") for path in files if path.name not in _LATER_FILES]
    return sum(len(re.findall(r"^@compiled\(", source, re.MULTILINE)) for source in sources)


@cache
def cache_folder() -> Path | None:
    """Return the folder of compiled code, created if necessary; None if it cannot be used.

    That is so if it cannot be written, or if other users could have put code there.
    """
    folder = expected_folder()
    if planting_risk(folder) is not None:
        return None
    try:
        make_private_folder(folder)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return None


@cache
def cache_warning() -> str | None:
    """Return that stored code is not used, why, and what to do; None if no one could plant any."""
    risk = planting_risk(expected_folder())
    if risk is None:
        return None
    return (
        f"every run compiles anew, because other users could put programs into its cache "
        f"`{expected_folder()}`: {risk}"
    )


def make_private_folder(folder: Path) -> None:
    """Make a folder, and its parents, that the user alone may enter. Raises OSError."""
    for path in (*reversed(folder.parents), folder):
        if not path.exists():
            path.mkdir(mode=0o700, exist_ok=True)


def planting_risk(folder: Path) -> str | None:
    """Return how other users could put files into a folder, and what to do; None if they cannot.

    Everything in it must be the user's own, and each folder on the way to it the user's or that of
    the machine's owner. Others may write to one with the sticky bit, such as /tmp.
    """
    if sys.platform == "win32":
        return None
    user = os.geteuid()
    machine = Path("/").stat().st_uid  # the superuser, or who stands for it in a container
    for path in _way_to(folder):
        with suppress(FileNotFoundError, NotADirectoryError):
            status = path.lstat()
            if status.st_uid not in (user, machine):
                return f"`{path}` is another user's; let XDG_CACHE_HOME name a folder of your own"
            if _may_others_write(status) and not status.st_mode & stat.S_ISVTX:
                return f"others may write to `{path}`; run `chmod go-w {path}`"
    for path in _entries(folder):
        with suppress(FileNotFoundError, NotADirectoryError):
            status = path.lstat()
            if status.st_uid != user:
                return f"`{path}` is another user's; remove `{folder}`"
            if _may_others_write(status):
                return f"others may write to `{path}`; remove `{folder}`"
    return None


def _way_to(folder: Path) -> Iterator[Path]:
    """Yield the parents of a folder, as it is written and as links lead to it."""
    ways = (Path(os.path.abspath(folder)), folder.resolve())
    return (path for way in dict.fromkeys(ways) for path in reversed(way.parents))


def _entries(folder: Path) -> Iterator[Path]:
    """Yield a folder and everything in it."""
    yield folder
    for parent, folders, files in os.walk(folder):
        yield from (Path(parent, name) for name in (*folders, *files))


def _may_others_write(status: os.stat_result) -> bool:
    """Return whether the group or others may write a file; the user's own group does not count."""
    if stat.S_ISLNK(status.st_mode):
        return False  # a link has the rights of its folder
    if status.st_mode & stat.S_IWOTH:
        return True
    return bool(status.st_mode & stat.S_IWGRP) and not _is_group_of_user(status.st_gid)


def _is_group_of_user(group: int) -> bool:
    """Return whether a group has the name of the user and no other members."""
    if sys.platform == "win32":
        return False
    import grp
    import pwd

    try:
        user, found = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
    except KeyError:
        return False
    is_primary = group == user.pw_gid and found.gr_name == user.pw_name
    return is_primary and set(found.gr_mem) <= {user.pw_name}


def expected_folder() -> Path:
    """Return the folder in which compiled code belongs, whether or not it can be written."""
    digest = sha256("".join(_sources()).encode()).hexdigest()[:16]
    return user_cache_path("exudyn-mover", appauthor=False) / f"compiled-{digest}"


def _stem(function: Callable[..., Any]) -> str:
    """Return how the names of the stored files of a function begin."""
    return f"{Path(function.__code__.co_filename).stem}.{function.__name__}"


def forget_function(function: Callable[..., Any]) -> None:
    """Remove the stored code of a function."""
    folder = cache_folder()
    if folder is None:
        return
    for path in folder.rglob("*.nb[ic]"):
        if path.name.startswith(f"{_stem(function)}-"):
            with suppress(OSError):
                path.unlink()


@cache
def _stored_at_first(folder: Path) -> frozenset[str]:
    """Return the stems of the functions that were stored when this process first looked."""
    return frozenset(path.name.rsplit("-", 1)[0] for path in folder.rglob("*.nbc"))


@contextmanager
def compiling_alone(function: Callable[..., Any], folder: Path) -> Generator[None]:
    """Let one process compile a function that is not stored; others wait, and then load its code.

    The order in which numba links functions differs between processes, and with it the rounding of
    sums: two processes that compiled the same function would not agree to the last bit.
    """
    if _stem(function) in _stored_at_first(folder):
        yield
        return
    from filelock import FileLock

    with FileLock(folder / f"{_stem(function)}.lock", mode=0o600):
        yield


def load_without_registries(function: Any) -> None:
    """Let a function with a cache load its stored code without what only compilation needs.

    numba imports its implementations of Python and numpy before it looks into the cache, which
    takes a quarter of the time in which a command starts, and again before it compiles.
    """
    import_module("numba.experimental.function_type")  # for arguments that are functions
    cached, runtime = function._cache, import_module("numba.core.runtime").rtsys
    if not hasattr(cached, "_load_overload"):
        return  # another version of numba

    def load(signature: Any, context: Any) -> Any:
        runtime.initialize(context)
        return cached._load_overload(signature, context)

    cached.load_overload = load


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
