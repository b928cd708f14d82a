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
from generator.diagnostics import Diagnostic, InputError, MoverError, error
from generator.losses import Losses
from generator.motion_files import FigureMotion, UnknownMotionFormatError, motion_writer
from generator.text_io import os_error_reason, unwritable_reason, write_atomic


def check_writable(
    paths: Iterable[Path], inputs: Iterable[str | Path | None], reader: str = "command"
) -> None:
    """Raise InputError for files that cannot be written, or that the command reads as well."""
    read = {realpath(path) for path in inputs if path is not None}
    reasons = [
        (path, f"the {reader} reads it" if realpath(path) in read else unwritable_reason(path))
        for path in paths
    ]
    faults = [unwritable_file_error(path, reason) for path, reason in reasons if reason is not None]
    if faults:
        raise InputError(faults)


def write_text(path: Path, text: str) -> None:
    """Write a file whole or not at all. Raises InputError when it cannot be written."""
    try:
        write_atomic(path, text)
    except OSError as failure:
        raise InputError((unwritable_file_error(path, os_error_reason(failure)),)) from None


def unwritable_file_error(path: Path, reason: str) -> Diagnostic:
    """The fault of a file that cannot be written."""
    return error(f"`{path}` cannot be written: {reason}")


LossesByPath = Mapping[Path, Losses]
"""What the files that were written do not hold."""


def check_motion_formats(paths: Sequence[Path]) -> None:
    """Raise UsageError for a suffix that names no format of motions, and for a file given twice."""
    for path in paths:
        try:
            motion_writer(path)
        except UnknownMotionFormatError as failure:
            raise UsageError(str(failure)) from None
    check_distinct_paths(paths)


def check_distinct_paths(paths: Sequence[Path]) -> None:
    """Raise UsageError for one file given twice."""
    targets: set[str] = set()
    for path in paths:
        if realpath(path) in targets:
            raise UsageError(f"{path}: the file was given before")
        targets.add(realpath(path))


def write_motion(clip: FigureMotion, paths: Sequence[Path]) -> LossesByPath:
    """Write a motion to files, each in the format of its suffix.

    Raises:
        InputError: a file cannot be written.
        MoverError: a format cannot hold the motion.
    """
    written: dict[Path, Losses] = {}
    for path in paths:
        try:
            written[path] = motion_writer(path)(clip, path)
        except OSError as failure:
            raise InputError((unwritable_file_error(path, os_error_reason(failure)),)) from None
        except ValueError as failure:
            raise MoverError(f"`{path}` cannot be written: {failure}") from None
    return written


def losses_text(written: LossesByPath) -> str:
    """What the files do not hold, for people; empty where nothing is to be said."""
    parts = [
        "\n".join([f"not in {path}:", *(f"  {loss}" for loss in losses.entries)])
        for path, losses in written.items()
        if losses.entries
    ]
    return "\n".join(parts)


def losses_data(written: LossesByPath) -> dict[str, object]:
    """What the files do not hold, for `--json`, by file."""
    return {str(path): losses.to_json() for path, losses in written.items()}


OutputWriter = Callable[[Path], Losses]
"""Writes a file, or a folder of files, to a path, and tells what was lost."""


def write_all_or_none(writers: Sequence[tuple[Path, OutputWriter]]) -> LossesByPath:
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
            parts[path] = _temporary_path(path)
            try:
                written[path] = write(parts[path])
            except OSError as failure:
                raise InputError((unwritable_file_error(path, os_error_reason(failure)),)) from None
            except ValueError as failure:
                raise MoverError(f"`{path}` cannot be written: {failure}") from None
        blocked = [path for path, part in parts.items() if part.is_dir() and _is_file(path)]
        if blocked:
            raise InputError(
                [unwritable_file_error(path, "it is no directory") for path in blocked]
            )
        files = [file for path, part in parts.items() for file in _output_files(path, part)]
        check_writable([target for target, _ in files if target.parent.exists()], ())
        _move_into_place(files)
    finally:
        for part in parts.values():
            _remove(part)
    return written


def _temporary_path(path: Path) -> Path:
    """Where the output is made: in the folder where it will stand, links followed."""
    target = Path(realpath(path))
    return target.with_name(f".{target.name[:50]}.{secrets.token_hex(4)}.part")


def _is_file(path: Path) -> bool:
    return path.exists() and not path.is_dir()


def _output_files(path: Path, part: Path) -> Iterator[tuple[Path, Path]]:
    """The files of an output: where each will stand, and where it was made."""
    if part.is_dir():
        yield from ((path / made.name, made) for made in sorted(part.iterdir()))
    else:
        yield path, part


def already_written_errors(files: Iterable[Path]) -> Iterator[Diagnostic]:
    """What is said of files that were written before one that could not be."""
    yield from (error(f"`{file}` was written before and is complete") for file in files)


def _move_into_place(files: Sequence[tuple[Path, Path]]) -> None:
    done: list[Path] = []
    for target, made in files:
        try:
            target.parent.mkdir(exist_ok=True)
            write_atomic(target, made.read_bytes())
        except OSError as failure:
            raise InputError(
                [
                    unwritable_file_error(target, os_error_reason(failure)),
                    *already_written_errors(done),
                ]
            ) from None
        done.append(target)


def _remove(part: Path) -> None:
    with suppress(OSError):
        if part.is_dir():
            shutil.rmtree(part)
        else:
            part.unlink()
