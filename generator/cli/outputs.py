"""Files that commands write: whether they can be, and what is said when they cannot.

Files of motions that commands write: which can be asked for, and what was lost in each.

Several files that a command writes: all of them, or none.
"""

import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from os.path import realpath
from pathlib import Path

from generator.cli.answer import UsageError
from generator.diagnostics import Fault, InputError, MoverError, error
from generator.losses import Losses
from generator.motion_files import Clip, UnknownFormatError, format_of
from generator.text_io import reason_of, why_not_writable, write_whole


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
