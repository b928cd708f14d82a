"""A file that is there whole or not at all, whatever happens to the program that writes it."""

import errno
import os
import secrets
import stat
from contextlib import suppress
from pathlib import Path

_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL

_MODE = 0o666
"""Mode of a file that was not there before, less what the user's mask takes away."""

_MOST_LINKS = 40
"""So many links one behind the other are followed, as the system itself does."""


def write_whole(path: Path, content: str | bytes) -> None:
    """Put `content`, a text in UTF-8, into the file at `path`.

    It goes to a temporary file in the same folder, which takes the place of `path` once the
    disk has it all. Who kills the program before that finds the old file, or none, and at worst the
    temporary one (`.NAME.xxxxxxxx.part`). A link is followed, and the file that it names replaced;
    the new file has the mode of the old one. What is no regular file is not replaced, and neither
    is a file that is read-only, though the system would let a folder's owner do it.

    Raises OSError when the file cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    target = _target(path)
    mode = _mode_of(path)
    part = _part_of(target)
    descriptor = os.open(part, _NEW, _MODE if mode is None else mode)
    try:
        with open(descriptor, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        if mode is not None:
            part.chmod(mode)  # the mask has taken some of it away
        os.replace(part, target)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def why_not_writable(path: Path) -> str | None:
    """The reason why `path` cannot be written, found by trying its folder; None when it can."""
    target = _target(path)
    part = _part_of(target)
    try:
        if not target.parent.is_dir():
            return f"there is no directory `{_named_by(path).parent}`"
        _mode_of(path)
        os.close(os.open(part, _NEW, _MODE))
        part.unlink()
    except OSError as failure:
        return reason_of(failure)
    return None


def reason_of(failure: OSError) -> str:
    """What the system says of a failure, as part of a sentence."""
    return (failure.strerror or "unknown reason").lower()


def _mode_of(path: Path) -> int | None:
    """The mode of the file that is to be replaced, None where there is none yet.

    Raises OSError for what must not be replaced.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a directory")
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is no regular file")
    # The system asks root for no permission; a file that nobody may write is kept all the same.
    if not mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH) or not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, "it is read-only")
    return stat.S_IMODE(mode)


def _target(path: Path) -> Path:
    return Path(os.path.realpath(path))


def _named_by(path: Path) -> Path:
    """The path that links lead to, in the words of the user and of the links."""
    for _ in range(_MOST_LINKS):
        if not path.is_symlink():
            break
        path = path.parent / path.readlink()
    return path


def _part_of(target: Path) -> Path:
    return target.with_name(f".{target.name[:50]}.{secrets.token_hex(4)}.part")
