"""Several files that a command writes: all of them, or none."""

import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from os.path import realpath
from pathlib import Path

from generator.commands.motion_files import Written
from generator.commands.outputs import insist_writable, unwritable
from generator.errors import Fault, InputError, MoverError, error
from generator.exchange.losses import Losses
from generator.whole_file import reason_of, write_whole

Writer = Callable[[Path], Losses]
"""Writes a file, or a folder of files, to a path, and tells what was lost."""


def write_together(writers: Sequence[tuple[Path, Writer]]) -> Written:
    """Write files, and folders of files, when all of them can be.

    Each is made beside its place under a hidden name (`.NAME.xxxxxxxx.part`), and none takes its
    place before all are made.

    Raises:
        InputError: a file cannot be written; it names those that stand already, which happens only
            where the disk fails at the end.
        MoverError: a format cannot hold what is to be written.
    """
    parts: dict[Path, Path] = {}
    try:
        written: dict[Path, Losses] = {}
        for path, write in writers:
            parts[path] = _part_of(path)
            try:
                written[path] = write(parts[path])
            except OSError as failure:
                raise InputError((unwritable(path, reason_of(failure)),)) from None
            except ValueError as failure:
                raise MoverError(f"`{path}` cannot be written: {failure}") from None
        blocked = [path for path, part in parts.items() if part.is_dir() and _is_file(path)]
        if blocked:
            raise InputError([unwritable(path, "it is no directory") for path in blocked])
        files = [file for path, part in parts.items() for file in _files(path, part)]
        insist_writable([target for target, _ in files if target.parent.exists()], ())
        _put(files)
    finally:
        for part in parts.values():
            _remove(part)
    return written


def _part_of(path: Path) -> Path:
    """Where the output is made: in the folder where it will stand, links followed."""
    target = Path(realpath(path))
    return target.with_name(f".{target.name[:50]}.{secrets.token_hex(4)}.part")


def _is_file(path: Path) -> bool:
    return path.exists() and not path.is_dir()


def _files(path: Path, part: Path) -> Iterator[tuple[Path, Path]]:
    """The files of an output: where each will stand, and where it was made."""
    if part.is_dir():
        yield from ((path / made.name, made) for made in sorted(part.iterdir()))
    else:
        yield path, part


def written_before(files: Iterable[Path]) -> Iterator[Fault]:
    """What is said of files that were written before one that could not be."""
    yield from (error(f"`{file}` was written before and is complete") for file in files)


def _put(files: Sequence[tuple[Path, Path]]) -> None:
    done: list[Path] = []
    for target, made in files:
        try:
            target.parent.mkdir(exist_ok=True)
            write_whole(target, made.read_bytes())
        except OSError as failure:
            raise InputError(
                [unwritable(target, reason_of(failure)), *written_before(done)]
            ) from None
        done.append(target)


def _remove(part: Path) -> None:
    with suppress(OSError):
        if part.is_dir():
            shutil.rmtree(part)
        else:
            part.unlink()
