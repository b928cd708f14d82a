"""The journal of a sweep: a line for each finished run, and a lock on its folder.

A line is handed to the operating system as soon as its run is finished, so that every kill of the
program leaves all finished runs. The lock belongs to the open file, and the operating system
removes it with the process: a lock file that a killed program leaves locks nothing. Network file
systems may not offer such locks (NFS before version 4 without its lock daemon, for example); a
folder on one is then refused.

A line is a JSON object, the last key of which is a checksum: the CRC-32 of the bytes before it. The
lines of runs continue the checksum of the first line, so that none of another study is taken. The
line of a run that has one already is marked as its repetition, and takes its place. Two lines of a
run that differ without this mark are damage, and neither counts.
"""

import errno
import json
import os
import sys
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Any, cast
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import InputError, UsageError, error
from generator.study.content_key import Versions
from generator.study.run_results import RunResults
from generator.study.study import OUTCOMES, RunResult
from generator.study.worker_pool import FinishedRun
from generator.text_io import open_regular_file, os_error_reason

JOURNAL_NAME = "runs.jsonl"
LOCK_NAME = ".lock"

_CHECKSUM_KEY = b', "crc32": "'

_LOCK_TAKEN = (errno.EAGAIN, errno.EACCES, errno.EDEADLK)


@dataclass(frozen=True)
class JournalHeader:
    """First line of a journal.

    Attributes:
        study: content key of the study.
        versions: versions of the programs that made the runs.
    """

    study: str
    versions: Versions

    @property
    def checksum(self) -> int:
        """Checksum that the lines of runs continue."""
        return crc32(_format_line(_header_entry(self), 0))


@dataclass(frozen=True, eq=False)
class JournalContent:
    """Content of a journal.

    Attributes:
        header: its first line; None for an empty journal, and where it does not begin as one. That
            of this study, where the line is damaged and others show that they are of this study.
        lines: number of sound lines of runs, of the study of the header.
        results: Results of the runs of this study.
        has_line: whether a run of this study has a sound line, shape (runs,).
        damaged_lines: numbers of lines that cannot be used, from 1.
        size: size of the complete lines [bytes].
    """

    header: JournalHeader | None
    lines: int
    results: RunResults
    has_line: NDArray[np.bool_]
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
        raise unwritable(path, failure, is_under_way=False) from None
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


_LONGEST_BEGINNING = 10_000
"""Bytes in which the first line of a journal ends."""


def read_journal(
    path: Path, expected: JournalHeader, measures: Iterable[str], runs: int
) -> JournalContent:
    """Read a journal, line by line; a file that is not there is empty.

    A last line without its end, which a kill leaves, is not part of the journal.

    Args:
        path: path of the journal.
        expected: header of this study.
        measures: names of its measures, in their order.
        runs: number of its runs.

    Raises:
        InputError: the file cannot be read.
        UsageError: it is another file.
    """
    names, header = tuple(measures), None
    results, has_line = RunResults(names, runs), np.zeros(runs, bool)
    contradicted: dict[int, int] = {}  # line by run
    damaged: list[int] = []
    size = lines = 0
    start = expected.checksum
    _refuse_other_file(path)
    for number, line in enumerate(_complete_lines(path), 1):
        size += len(line)
        try:
            if number == 1:
                header = _parse_header(line)
                start = header.checksum
                continue
            entry = _checked_entry(line, start)
            lines += 1
            if header not in (None, expected):
                continue
            index, result, is_repetition = _parse_run(entry, names, runs)
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
            damaged.append(number)
            continue
        if is_repetition:
            contradicted.pop(index, None)
        elif has_line[index] and (index in contradicted or results[index] != result):
            contradicted[index] = number
            continue
        has_line[index] = True
        results[index] = result
    for index in contradicted:
        results.finished[index] = False
    if header is None and lines:
        header = expected
    damaged = sorted([*damaged, *contradicted.values()])
    return JournalContent(header, lines, results, has_line, tuple(damaged), size)


def _refuse_other_file(path: Path) -> None:
    """Raise UsageError for a file that has no line, and not the beginning of one either.

    A power cut may leave zero bytes.
    """
    if not path.is_file():
        return
    with open_regular_file(path) as file:
        beginning = file.readline(_LONGEST_BEGINNING)
    is_whole = beginning.endswith(b"\n")
    if beginning.strip(b"\0") and not (is_whole or beginning.startswith(b"{")):
        raise UsageError(
            f"`{path}` does not begin as a journal of runs: choose another folder, or delete it."
        )


def _complete_lines(path: Path) -> Iterator[bytes]:
    """Yield the lines of a file that have an end. Raises InputError if it cannot be read."""
    try:
        with open_regular_file(path) as file:
            yield from (line for line in file if line.endswith(b"\n"))
    except FileNotFoundError:
        return
    except OSError as failure:
        reason = os_error_reason(failure)
        raise InputError([error(f"`{path}` cannot be read: {reason}")]) from None


def _format_line(entry: Mapping[str, object], start: int) -> bytes:
    """Return the line of an entry with its checksum, which continues another."""
    body = json.dumps(entry).removesuffix("}").encode()
    return body + _CHECKSUM_KEY + f'{crc32(body, start):08x}"}}\n'.encode()


def _checked_entry(line: bytes, start: int) -> Mapping[str, Any]:
    """Return the entry of a line. Raises ValueError if it has another checksum."""
    body, _, _ = line.rpartition(_CHECKSUM_KEY)
    entry = json.loads(body + b"}")
    if line != body + _CHECKSUM_KEY + f'{crc32(body, start):08x}"}}\n'.encode():
        raise ValueError
    return entry


def _parse_header(line: bytes) -> JournalHeader:
    """Parse the first line. Raises one of several errors for a damaged one."""
    entry = _checked_entry(line, 0)
    versions = Versions(str(entry["exudyn-mover"]), str(entry["exudyn"]))
    return JournalHeader(str(entry["study"]), versions)


def _header_entry(header: JournalHeader) -> dict[str, object]:
    return {
        "study": header.study,
        "exudyn-mover": header.versions.exudyn_mover,
        "exudyn": header.versions.exudyn,
    }


def _parse_run(
    entry: Mapping[str, Any], measures: tuple[str, ...], runs: int
) -> tuple[int, RunResult, bool]:
    """Return index and result of a run, and whether the line is a repetition.

    Raises one of several errors for a damaged one.
    """
    index, outcome, message = entry["run"], entry["outcome"], entry["message"]
    values = cast("Mapping[str, Any]", entry["measures"])
    is_run = type(index) is int and 0 <= index < runs
    is_ending = outcome in OUTCOMES and isinstance(message, str)
    if not is_run or not is_ending or sorted(values) != sorted(measures):
        raise ValueError
    numbers = {name: None if values[name] is None else _number(values[name]) for name in measures}
    return index, RunResult(outcome, message, numbers), entry.get("again") is True


def _number(value: object) -> float:
    """Return a number of a line. Raises ValueError or OverflowError for another value."""
    if type(value) is not float and type(value) is not int:
        raise ValueError
    return float(value)


class Journal:
    """The open journal of a sweep, to which the process that leads the sweep adds lines."""

    def __init__(
        self, path: Path, file: FileIO, header: JournalHeader, has_line: NDArray[np.bool_]
    ) -> None:
        """Take the open file."""
        self._path, self._file = path, file
        self._start, self._has_line = header.checksum, has_line.copy()

    def add(self, run: FinishedRun) -> None:
        """Write the line of a finished run. Raises InputError if it cannot be written."""
        entry: dict[str, object] = {
            "run": run.index,
            "outcome": run.result.outcome,
            "message": run.result.message,
            "measures": dict(run.result.measures),
            "seconds": round(run.seconds, 6),
        }
        if self._has_line[run.index]:
            entry["again"] = True
        self._has_line[run.index] = True
        self.write(_format_line(entry, self._start))

    def write(self, line: bytes) -> None:
        """Write a line. Raises InputError if it cannot be written."""
        data = memoryview(line)
        try:
            while data:
                data = data[self._file.write(data) :]
        except OSError as failure:
            raise unwritable(self._path, failure) from None


@contextmanager
def open_journal(path: Path, content: JournalContent, header: JournalHeader) -> Generator[Journal]:
    """Open a journal to add lines after its complete ones.

    Args:
        path: path of the journal; the file is created where it is missing.
        content: that it has. An empty journal gets its first line.
        header: Header of this study.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        with open(path, "ab", buffering=0) as file:
            file.truncate(content.size)
    except OSError as failure:
        raise unwritable(path, failure, is_under_way=False) from None
    with open(path, "ab", buffering=0) as file:
        journal = Journal(path, file, header, content.has_line)
        if content.size == 0:
            journal.write(_format_line(_header_entry(header), 0))
        yield journal


def unwritable(path: Path, failure: OSError, *, is_under_way: bool = True) -> InputError:
    """Return the error of a file of a sweep, which may have finished runs by now."""
    hint = "the finished runs are kept, and the same command continues" if is_under_way else ""
    reason = os_error_reason(failure)
    return InputError([error(f"`{path}` cannot be written: {reason}", hint=hint)])
