"""The journal of a sweep: a line for each finished run, and a lock on its folder.

A line is handed to the operating system as soon as its run is finished, so that every kill of the
program leaves all finished runs. The lock belongs to the open file, and the operating system
removes it with the process: a lock file that a killed program leaves locks nothing. Network file
systems may not offer such locks (NFS before version 4 without its lock daemon, for example); a
folder on one is then refused.
"""

import errno
import json
import os
import sys
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Any, cast

from generator.diagnostics import Diagnostic, InputError, UsageError, error
from generator.study.content_key import Versions
from generator.study.study import RunResult
from generator.study.worker_pool import FinishedRun
from generator.text_io import open_regular_file, os_error_reason

JOURNAL_NAME = "runs.jsonl"
LOCK_NAME = ".lock"

_LOCK_TAKEN = (errno.EAGAIN, errno.EACCES, errno.EDEADLK)


@dataclass(frozen=True)
class JournalHeader:
    """First line of a journal.

    Attributes:
        study: content key of the study.
        versions: of the programs that made the runs.
    """

    study: str
    versions: Versions


@dataclass(frozen=True)
class JournalContent:
    """Content of a journal.

    Attributes:
        header: None for an empty journal.
        runs: by index; of several runs of one index the last.
        damaged_lines: numbers of lines that cannot be read, from 1.
        size: of the complete lines [bytes].
    """

    header: JournalHeader | None
    runs: Mapping[int, FinishedRun]
    damaged_lines: tuple[int, ...]
    size: int


@contextmanager
def lock_folder(folder: Path) -> Generator[None]:
    """Lock a folder against other sweeps, until the end of the block or of this process.

    Raises:
        UsageError: another sweep has locked it.
        InputError: it cannot be locked.
    """
    path = folder / LOCK_NAME
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as failure:
        raise InputError([_unwritable(path, failure)]) from None
    try:
        try:
            _lock(descriptor)
        except OSError as failure:
            if failure.errno in _LOCK_TAKEN:
                raise UsageError(
                    f"Another sweep is running in `{folder}`: wait for its end, or stop it."
                ) from None
            reason = os_error_reason(failure)
            hint = "choose a folder on a disk of this machine"
            raise InputError([error(f"`{folder}` cannot be locked: {reason}", hint=hint)]) from None
        yield
    finally:
        os.close(descriptor)


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> None:
        """Lock an open file, or raise OSError at once."""
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(descriptor: int) -> None:
        """Lock an open file, or raise OSError at once."""
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def read_journal(path: Path, measures: Mapping[str, object]) -> JournalContent:
    """Read a journal; a file that is not there is empty.

    A last line without its end, which a kill leaves, is not part of the journal.

    Args:
        path: of the journal.
        measures: names of the measures, in their order.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        with open_regular_file(path) as file:
            data = file.read()
    except FileNotFoundError:
        data = b""
    except OSError as failure:
        reason = os_error_reason(failure)
        raise InputError([error(f"`{path}` cannot be read: {reason}")]) from None
    lines = data.split(b"\n")[:-1]
    size = sum(len(line) + 1 for line in lines)
    header, damaged = None, list[int]()
    runs: dict[int, FinishedRun] = {}
    for number, line in enumerate(lines, 1):
        try:
            entry = cast("dict[str, Any]", json.loads(line))
            if number == 1:
                header = _parse_header(entry)
            else:
                run = _parse_run(entry, measures)
                runs[run.index] = run
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
            damaged.append(number)
    return JournalContent(header, runs, tuple(damaged), size)


def _parse_header(entry: Mapping[str, Any]) -> JournalHeader:
    versions = Versions(str(entry["exudyn-mover"]), str(entry["exudyn"]))
    return JournalHeader(str(entry["study"]), versions)


def _parse_run(entry: Mapping[str, Any], measures: Mapping[str, object]) -> FinishedRun:
    """Parse the line of a run. Raises one of several errors for a damaged one."""
    index, outcome, message = entry["run"], entry["outcome"], entry["message"]
    values = cast("Mapping[str, Any]", entry["measures"])
    texts = isinstance(outcome, str) and isinstance(message, str)
    if type(index) is not int or index < 0 or not texts or values.keys() != measures.keys():
        raise ValueError
    numbers = {name: None if values[name] is None else _number(values[name]) for name in measures}
    return FinishedRun(index, RunResult(outcome, message, numbers), _number(entry["seconds"]))


def _number(value: object) -> float:
    """Return a number of a line. Raises ValueError or OverflowError for another value."""
    if type(value) is not float and type(value) is not int:
        raise ValueError
    return float(value)


class Journal:
    """The open journal of a sweep, to which the process that leads the sweep adds lines."""

    def __init__(self, path: Path, file: FileIO) -> None:
        """Take the open file."""
        self._path, self._file = path, file

    def begin(self, header: JournalHeader) -> None:
        """Write the first line. Raises InputError if it cannot be written."""
        self._write(
            {
                "study": header.study,
                "exudyn-mover": header.versions.exudyn_mover,
                "exudyn": header.versions.exudyn,
            }
        )

    def add(self, run: FinishedRun) -> None:
        """Write the line of a finished run. Raises InputError if it cannot be written."""
        self._write(
            {
                "run": run.index,
                "outcome": run.result.outcome,
                "message": run.result.message,
                "measures": dict(run.result.measures),
                "seconds": round(run.seconds, 6),
            }
        )

    def _write(self, entry: Mapping[str, object]) -> None:
        data = memoryview(f"{json.dumps(entry)}\n".encode())
        try:
            while data:
                data = data[self._file.write(data) :]
        except OSError as failure:
            hint = "the finished runs are kept, and the same command continues"
            raise InputError([_unwritable(self._path, failure, hint)]) from None


@contextmanager
def open_journal(path: Path, size: int) -> Generator[Journal]:
    """Open a journal to add lines after its complete ones.

    Args:
        path: of the journal; the file is created where it is missing.
        size: of the complete lines [bytes]; what follows them is cut.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        with open(path, "ab", buffering=0) as file:
            file.truncate(size)
    except OSError as failure:
        raise InputError([_unwritable(path, failure)]) from None
    with open(path, "ab", buffering=0) as file:
        yield Journal(path, file)


def _unwritable(path: Path, failure: OSError, hint: str = "") -> Diagnostic:
    return error(f"`{path}` cannot be written: {os_error_reason(failure)}", hint=hint)
