import os
import subprocess
import sys
from io import FileIO
from math import inf
from pathlib import Path
from zlib import crc32

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.diagnostics import InputError, UsageError
from generator.study.content_key import Versions
from generator.study.journal import (
    LOCK_NAME,
    Journal,
    JournalContent,
    JournalHeader,
    lock_folder,
    open_journal,
    read_journal,
)
from generator.study.study import RunResult
from generator.study.worker_pool import FinishedRun
from tests.processes import ENVIRONMENT

HEADER = JournalHeader("abc", Versions("1", "2"))
MEASURES = ("swing", "end")
RUNS = 6


def finished(index: int, swing: float | None = 0.1, message: str = "") -> FinishedRun:
    return FinishedRun(index, RunResult("done", message, {"swing": swing, "end": 1.0}), 0.25)


def read(path: Path, header: JournalHeader = HEADER) -> JournalContent:
    return read_journal(path, header, MEASURES, RUNS)


def write_journal(path: Path, *runs: FinishedRun, header: JournalHeader = HEADER) -> None:
    with open_journal(path, read(path, header), header) as journal:
        for run in runs:
            journal.add(run)


def results(content: JournalContent) -> dict[int, RunResult]:
    return {index: content.results[index] for index in range(RUNS) if content.has_line[index]}


def with_checksum(body: bytes, header: bytes) -> bytes:
    """The line of an object whose last bracket is missing, as the documentation describes it."""
    return body + b', "crc32": "%08x"}\n' % crc32(body, crc32(header))


def test_a_missing_journal_is_empty(tmp_path: Path) -> None:
    content = read(tmp_path / "missing")
    assert (content.header, content.lines, content.size) == (None, 0, 0)
    assert (results(content), content.damaged_lines) == ({}, ())


numbers = st.none() | st.floats(allow_nan=False) | st.sampled_from([inf, -inf, 0.1, 5e-324])


@settings(max_examples=30)
@given(st.lists(st.tuples(st.integers(0, RUNS - 1), numbers, st.text())))
def test_runs_are_read_as_they_were_written(
    tmp_path_factory: pytest.TempPathFactory, entries: list[tuple[int, float | None, str]]
) -> None:
    path = tmp_path_factory.mktemp("journal") / "runs.jsonl"
    runs = [finished(*entry) for entry in entries]
    write_journal(path, *runs)
    content = read(path)
    assert (content.header, content.lines) == (HEADER, len(runs))
    assert results(content) == {run.index: run.result for run in runs}  # the last of an index
    assert content.damaged_lines == ()
    assert content.size == path.stat().st_size


def test_a_line_is_in_the_file_when_its_run_is_added(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with open_journal(path, read(path), HEADER) as journal:
        journal.add(finished(3))
        assert results(read(path)).keys() == {3}


@settings(max_examples=30)
@given(st.data())
def test_every_cut_leaves_the_complete_lines(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("journal") / "runs.jsonl"
    runs = [finished(index) for index in range(4)]
    write_journal(path, *runs)
    whole = path.read_bytes()
    cut = data.draw(st.integers(0, len(whole)))
    path.write_bytes(whole[:cut])
    content = read(path)
    assert content.damaged_lines == ()
    complete = max(0, whole[:cut].count(b"\n") - 1)
    assert list(results(content)) == list(range(complete))
    write_journal(path, *runs[complete:])
    assert path.read_bytes() == whole


@settings(max_examples=100)
@given(st.data())
def test_a_change_of_a_byte_is_damage_of_its_line(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("journal") / "runs.jsonl"
    runs = [finished(index, swing=0.1 * index) for index in range(4)]
    write_journal(path, *runs)
    whole = path.read_bytes()
    place = data.draw(st.integers(0, len(whole) - 1))
    by = data.draw(st.integers(1, 255))
    path.write_bytes(bytes([*whole[:place], (whole[place] + by) % 256, *whole[place + 1 :]]))
    content = read(path)
    assert content.header == HEADER
    assert content.damaged_lines or content.size < len(whole)
    expected = {run.index: run.result for run in runs}
    assert results(content).items() <= expected.items()
    # A line feed within the header makes two damaged lines of it.
    is_header = content.damaged_lines in ((1,), (1, 2))
    assert is_header or len(results(content)) < len(runs)


LINE = b'{"run": 1, "outcome": "done", "message": "", "measures": {"swing": 1, "end": 2}'


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"\xff\x00",
        b"[]",
        b'"text"',
        b"[" * 100_000,
        b'{"run": 1',
        LINE.replace(b"1", b"-1", 1),
        LINE.replace(b"1", b"6", 1),
        LINE.replace(b"1", b"true", 1),
        LINE.replace(b"done", b"gone"),
        LINE.replace(b'"end"', b'"and"'),
        LINE.replace(b'"swing": 1', b'"swing": "x"'),
        LINE.replace(b'"swing": 1', b'"swing": true'),
        LINE.replace(b'"swing": 1', b'"swing": 1' + b"0" * 400),
    ],
)
def test_a_line_that_no_sweep_writes_is_damaged(tmp_path: Path, body: bytes) -> None:
    """Also where it has the right checksum."""
    path = tmp_path / "runs.jsonl"
    write_journal(path, finished(0), finished(1), finished(2))
    lines = path.read_bytes().splitlines(keepends=True)
    for line in (with_checksum(body, lines[0]), body + b"\n"):
        path.write_bytes(b"".join([*lines[:2], line, *lines[3:]]))
        content = read(path)
        assert results(content) == {0: finished(0).result, 2: finished(2).result}
        assert content.damaged_lines == (3,)
    path.write_bytes(b"".join([*lines[:2], with_checksum(LINE, lines[0]), *lines[3:]]))
    assert read(path).damaged_lines == ()


def test_a_repetition_is_marked_and_takes_the_place_of_the_first_line(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    write_journal(path, finished(0), finished(1))
    write_journal(path, finished(1, swing=0.2))
    assert path.read_bytes().count(b'"again": true') == 1
    assert results(read(path))[1] == finished(1, swing=0.2).result
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([*lines, lines[2]]))  # the first line of run 1 once more
    assert read(path).damaged_lines == (5,)
    assert read(path).results.finished.tolist()[:2] == [True, False]
    path.write_bytes(b"".join([*lines[:3], lines[2]]))
    assert read(path).damaged_lines == ()


def test_lines_of_another_study_are_not_taken(tmp_path: Path) -> None:
    path, other = tmp_path / "runs.jsonl", JournalHeader("def", HEADER.versions)
    write_journal(path, finished(0))
    content = read(path, other)
    assert (content.header, content.lines, results(content)) == (HEADER, 1, {})
    header, line = path.read_bytes().splitlines(keepends=True)
    path.unlink()
    write_journal(path, header=other)
    path.write_bytes(path.read_bytes() + line)
    assert read(path, other).damaged_lines == (2,)
    path.write_bytes(header[1:] + line)
    assert (read(path).header, read(path, other).header) == (HEADER, None)


def test_what_cannot_be_opened_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: it is a directory"):
        read(tmp_path)
    empty = read(tmp_path / "missing")
    with (
        pytest.raises(InputError, match="cannot be written"),
        open_journal(tmp_path, empty, HEADER),
    ):
        pass
    with pytest.raises(InputError, match="cannot be written"), lock_folder(tmp_path / "missing"):
        pass


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is full")
def test_a_full_disk_is_a_sentence() -> None:
    path = Path("/dev/full")
    with FileIO(path, "w") as file, pytest.raises(InputError, match="no space left") as caught:
        Journal(path, file, HEADER, np.zeros(RUNS, bool)).add(finished(0))
    assert "the same command continues" in str(caught.value)


LOCK = """
import sys, time
from pathlib import Path
from generator.study.journal import lock_folder
with lock_folder(Path(sys.argv[1])):
    print("locked", flush=True)
    time.sleep(60)
"""


def test_the_lock_of_a_killed_process_is_stale(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", LOCK, str(tmp_path)], env=ENVIRONMENT, stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    assert process.stdout.readline().split() == [b"locked"]
    with pytest.raises(UsageError, match="Another sweep"), lock_folder(tmp_path):
        pass
    process.kill()
    process.wait()
    process.stdout.close()
    assert os.listdir(tmp_path) == [LOCK_NAME]
    with lock_folder(tmp_path):
        pass
