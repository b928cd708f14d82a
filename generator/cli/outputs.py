"""Files that commands write: checks before a run, one file or several at once, and their losses."""

from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from os import W_OK, X_OK, access
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING

from generator.cli.interrupts import hold_interrupts, note_written_files
from generator.diagnostics import (
    Diagnostic,
    InputError,
    MoverError,
    UsageError,
    error,
    format_count,
)
from generator.figure import Figure
from generator.figure_file.write import write_pose
from generator.input_files.pose import POSE_FILE
from generator.losses import Losses
from generator.motion_files import MOTION_FORMATS, FigureMotion, motion_writer
from generator.rotations import Array
from generator.text_io import (
    format_csv_comment,
    move_into_place,
    os_error_reason,
    remove_part,
    temporary_path,
    unwritable_reason,
    write_atomic,
)

if TYPE_CHECKING:
    from generator.model_files.model_files import ModelFiles


def check_writable(
    paths: Iterable[Path], inputs: Iterable[str | Path | None], reader: str = "command"
) -> None:
    """Raise InputError for files that cannot be written, or that the command reads as well."""
    read = {realpath(path) for path in inputs if path is not None}
    reasons = [
        (
            path,
            f"the {reader} reads it" if realpath(path) in read else unwritable_reason(path),
        )
        for path in paths
    ]
    errors = [unwritable_file_error(path, reason) for path, reason in reasons if reason is not None]
    if errors:
        raise InputError(errors)


def output_files(output: Path | None, inputs: Iterable[str | Path | None]) -> list[Path]:
    """Return the file of `-o`, if any. Raises InputError unless it can be written."""
    files = [] if output is None else [output]
    check_writable(files, inputs)
    return files


def check_distinct_paths(paths: Sequence[Path]) -> None:
    """Raise UsageError for a file listed twice."""
    targets: set[str] = set()
    for path in paths:
        if realpath(path) in targets:
            raise UsageError(f"{path}: the file is listed twice")
        targets.add(realpath(path))


def check_motion_formats(paths: Sequence[Path]) -> None:
    """Raise UsageError for a suffix without a motion format, or a file listed twice."""
    for path in paths:
        motion_writer(path)
    check_distinct_paths(paths)


def check_suffix(path: Path, suffix: str, file_kind: str) -> None:
    """Raise UsageError unless the file of `-o` has the suffix of its kind (`a pose file`)."""
    if path.suffix.lower() != suffix:
        raise UsageError(f"-o {path}: {suffix_fault(path)}; {file_kind} ends in {suffix}")


def suffix_fault(path: Path) -> str:
    """Return the reason why a suffix is refused, as part of a sentence."""
    return f"`{path.suffix}` is not a known suffix" if path.suffix else "the suffix is missing"


def check_pose_output(path: Path | None) -> None:
    """Raise UsageError unless the file has the suffix of pose files."""
    if path is not None:
        check_suffix(path, POSE_FILE.suffix, "a pose file")


def check_table_output(output: Path | None, along: Path | None) -> None:
    """Raise UsageError unless the output is a table of a motion."""
    if output is None:
        return
    if along is None:
        raise UsageError("-o writes one row per frame of a motion: add --along")
    if output.suffix.lower() != ".csv":
        raise UsageError(f"{output}: the table must be a .csv file")


def unwritable_file_error(path: Path, reason: str) -> Diagnostic:
    """Return the error of a file that cannot be written."""
    return error(f"`{path}` cannot be written: {reason}")


def already_written_errors(files: Iterable[Path]) -> Iterator[Diagnostic]:
    """Yield a message for each file that was written before the failure."""
    yield from (error(f"`{file}` was already written and is complete") for file in files)


@contextmanager
def writing(path: Path, before: Iterable[Path] = ()) -> Generator[None]:
    """Convert errors of writing a file to InputError, and of its format to MoverError.

    `before` are files of the same command that were written already.
    """
    try:
        yield
    except OSError as failure:
        reason = unwritable_file_error(path, os_error_reason(failure))
        raise InputError([reason, *already_written_errors(before)]) from None
    except ValueError as failure:
        raise MoverError(f"`{path}` cannot be written: {failure}") from None


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file whole or not at all. Raises InputError when it cannot be written."""
    write_files({path: content})


def write_frame_table(
    path: Path,
    comments: Iterable[str],
    titles: str,
    times: Array,
    rows: Iterable[Iterable[str]],
) -> None:
    """Write a CSV table with a row per frame at its time [s]. Raises InputError."""
    lines = (
        ",".join([repr(time), *cells]) for time, cells in zip(times.tolist(), rows, strict=True)
    )
    head = "".join(map(format_csv_comment, comments))
    write_file(path, head + "".join(f"{line}\n" for line in (titles, *lines)))


def write_files(contents: Mapping[Path, str | bytes]) -> None:
    """Write files, all of them or none. Raises InputError when one cannot be written."""
    write_all_or_none([(path, _file_writer(content)) for path, content in contents.items()])


def _file_writer(content: str | bytes) -> "OutputWriter":
    def write(part: Path) -> Losses:
        write_atomic(part, content)
        return Losses("")

    return write


def _folder_writer(contents: Mapping[str, str | bytes]) -> "OutputWriter":
    def write(part: Path) -> Losses:
        part.mkdir()
        for name, content in contents.items():
            write_atomic(part / name, content)
        return Losses("")

    return write


def model_writers(models: Sequence["ModelFiles"]) -> "list[tuple[Path, OutputWriter]]":
    """Return the writers of models with their meshes and tables, by file or folder.

    Raises:
        UsageError: two models have different files of one name.
        InputError: this program would refuse to read one of the files.
    """
    for model in models:
        model.check_readable()
    contents: dict[Path, str | bytes] = {}
    for model in models:
        for path, content in model.contents.items():
            if contents.setdefault(path, content) != content:
                raise UsageError(
                    f"{path} would differ between the outputs: write {model.path} with another "
                    "name, or to another folder"
                )
    places = {model.path.parent for model in models}
    writers: dict[Path, OutputWriter] = {}
    folders: dict[Path, dict[str, str | bytes]] = {}
    for path, content in contents.items():
        if path.parent in places:
            writers[path] = _file_writer(content)
        else:
            folders.setdefault(path.parent, {})[path.name] = content
    writers |= {folder: _folder_writer(files) for folder, files in folders.items()}
    return list(writers.items())


def write_models(models: Sequence["ModelFiles"]) -> "LossesByPath":
    """Write models with their meshes and tables, all files or none.

    Raises InputError when one cannot be written.
    """
    write_all_or_none(model_writers(models))
    return {model.path: model.losses for model in models}


def write_pose_file(
    path: Path, figure: Figure, displacements: Mapping[str, Iterable[float]]
) -> None:
    """Write displacements of joints [rad or m] as a pose file. Raises InputError."""
    write_file(path, write_pose(figure, {name: list(row) for name, row in displacements.items()}))


LossesByPath = Mapping[Path, Losses]
"""Losses of each written file."""

OutputWriter = Callable[[Path], Losses]
"""Writes a file, or a folder of files, to a path, and returns what was lost."""


def write_motion(motion: FigureMotion, paths: Sequence[Path]) -> LossesByPath:
    """Write a motion to files, each in the format of its suffix: all of them or none.

    Raises:
        InputError: a file cannot be written.
        MoverError: a format cannot hold the motion.
    """
    return write_all_or_none([(path, partial(motion_writer(path), motion)) for path in paths])


def write_all_or_none(writers: Sequence[tuple[Path, OutputWriter]]) -> LossesByPath:
    """Write files, and folders of files: all of them or none.

    Each is first written beside its target under a hidden name (`temporary_path`). At the end all
    are renamed, and no signal to end acts between the first and the last. SIGKILL, which cannot be
    held, may leave some of them there, each whole; a new folder is renamed as one.

    Raises:
        InputError: a file cannot be written; it lists the files already in place, if the disk fails
            at the end.
        MoverError: a format cannot represent the content.
        KeyboardInterrupt: it came before the files were put in place, or while they were.
    """
    parts: dict[Path, Path] = {}
    try:
        written: dict[Path, Losses] = {}
        for path, write in writers:
            parts[path] = temporary_path(Path(realpath(path)))
            with writing(path):
                written[path] = write(parts[path])
        _check_targets(parts)
        with hold_interrupts():
            for k, (path, part) in enumerate(parts.items()):
                with writing(path, before=list(parts)[:k]):
                    move_into_place(part, path)
            if parts:
                note_written_files()
    finally:
        for part in parts.values():
            remove_part(part)
    return written


def _check_targets(parts: Mapping[Path, Path]) -> None:
    """Raise InputError unless every temporary file or folder can be renamed to its path."""
    folders = [path for path, part in parts.items() if part.is_dir() and path.exists()]
    reasons = {path: "it is not a directory" for path in folders if not path.is_dir()} | {
        path: "permission denied"
        for path in folders
        if path.is_dir() and not access(path, W_OK | X_OK)
    }
    if reasons:
        raise InputError([unwritable_file_error(path, why) for path, why in reasons.items()])
    files = [
        target
        for path, part in parts.items()
        for target in ([path / file.name for file in part.iterdir()] if part.is_dir() else [path])
    ]
    check_writable(sorted(file for file in files if file.parent.exists()), ())


def format_files(outputs: Iterable[Path], files: Iterable[Path]) -> Iterator[str]:
    """Yield the lines on written files: those beside the outputs, and how many in folders."""
    places = {path.parent for path in outputs}
    listed = list(dict.fromkeys((*outputs, *files)))
    yield from (f"wrote {path}" for path in listed if path.parent in places)
    folders = Counter(path.parent for path in listed if path.parent not in places)
    yield from (f"wrote {format_count(n, 'file')} in {path}" for path, n in folders.items())


def losses_text(written: LossesByPath) -> str:
    """List the losses of files as text; empty if there are none."""
    parts = [
        "\n".join([f"not in {path}:", *(f"  {loss}" for loss in losses.entries)])
        for path, losses in written.items()
        if losses.entries
    ]
    return "\n".join(parts)


NO_MOTION_FILES = f"nothing; -o FILE writes {' '.join(MOTION_FORMATS)}"
"""Text of a run that writes no motion file."""
