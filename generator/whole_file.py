"""A file that is there whole or not at all, whatever happens to the program that writes it."""

import os
import secrets
from contextlib import suppress
from pathlib import Path

_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL


def write_whole(path: Path, content: str | bytes) -> None:
    """Put `content`, a text in UTF-8, into the file at `path`.

    It goes to a temporary file in the same folder, which takes the place of `path` once the
    disk has it all. Who kills the program before that finds the old file, or none, and at worst the
    temporary one (`.NAME.xxxxxxxx.part`). A link is followed, and the file that it names replaced.

    Raises OSError when the file cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    target = _target(path)
    part = _part_of(target)
    descriptor = os.open(part, _NEW, 0o666)
    try:
        with open(descriptor, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
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
        if target.is_dir():
            return "it is a directory"
        if not target.parent.is_dir():
            return f"there is no directory `{path.parent}`"
        os.close(os.open(part, _NEW, 0o666))
        part.unlink()
    except OSError as failure:
        return reason_of(failure)
    return None


def reason_of(failure: OSError) -> str:
    """What the system says of a failure, as part of a sentence."""
    return (failure.strerror or "unknown reason").lower()


def _target(path: Path) -> Path:
    return Path(os.path.realpath(path))


def _part_of(target: Path) -> Path:
    return target.with_name(f".{target.name[:50]}.{secrets.token_hex(4)}.part")
