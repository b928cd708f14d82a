import os
import subprocess
import sys
from io import FileIO
from math import inf
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.diagnostics import InputError, UsageError
from generator.study.content_key import Versions
from generator.study.journal import (
    LOCK_NAME,
    Journal,
    JournalHeader,
    lock_folder,
    open_journal,
    read_journal,
)
from generator.study.study import RunResult
from generator.study.worker_pool import FinishedRun
from tests.processes import ENVIRONMENT

HEADER = JournalHeader("abc", Versions("1", "2"))
MEASURES = {"swing": None, "end": None}


def finished(index: int, swing: float | None = 0.1, message: str = "") -> FinishedRun:
    return FinishedRun(index, RunResult("done", message, {"swing": swing, "end": 1.0}), 0.25)


def write_journal(path: Path, *runs: FinishedRun) -> None:
    with open_journal(path, 0) as journal:
        journal.begin(HEADER)
        for run in runs:
            journal.add(run)


def test_a_missing_journal_is_empty(tmp_path: Path) -> None:
    content = read_journal(tmp_path / "missing", MEASURES)
    assert (content.header, content.runs, content.damaged_lines, content.size) == (None, {}, (), 0)


numbers = st.none() | st.floats(allow_nan=False) | st.sampled_from([inf, -inf, 0.1, 5e-324])


@settings(max_examples=30)
@given(st.lists(st.tuples(st.integers(0, 5), numbers, st.text())))
def test_runs_are_read_as_they_were_written(
    tmp_path_factory: pytest.TempPathFactory, entries: list[tuple[int, float | None, str]]
) -> None:
    path = tmp_path_factory.mktemp("journal") / "runs.jsonl"
    runs = [finished(*entry) for entry in entries]
    write_journal(path, *runs)
    content = read_journal(path, MEASURES)
    assert content.header == HEADER
    assert content.runs == {run.index: run for run in runs}  # the last of an index
    assert content.size == path.stat().st_size


def test_a_line_is_in_the_file_when_its_run_is_added(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with open_journal(path, 0) as journal:
        journal.begin(HEADER)
        journal.add(finished(3))
        assert read_journal(path, MEASURES).runs.keys() == {3}


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
    content = read_journal(path, MEASURES)
    assert content.damaged_lines == ()
    assert list(content.runs) == list(range(max(0, whole[:cut].count(b"\n") - 1)))
    with open_journal(path, content.size) as journal:
        if content.header is None:
            journal.begin(HEADER)
        for run in runs[len(content.runs) :]:
            journal.add(run)
    assert path.read_bytes() == whole


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"\xff\x00",
        b"[]",
        b'"text"',
        b"[" * 100_000,
        b'{"run": 1}',
        b'{"run": -1, "outcome": "done", "message": "", "measures": {"swing": 1, "end": 2}, '
        b'"seconds": 1}',
        b'{"run": 1, "outcome": "done", "message": "", "measures": {"swing": 1}, "seconds": 1}',
        b'{"run": 1, "outcome": "done", "message": "", "measures": {"swing": "x", "end": 2}, '
        b'"seconds": 1}',
        b'{"run": 1, "outcome": "done", "message": "", "measures": {"swing": "7", "end": true}, '
        b'"seconds": 1}',
        b'{"run": 1, "outcome": "done", "message": "", "measures": {"swing": 1'
        + b"0" * 400
        + b', "end": 2}, "seconds": 1}',
    ],
)
def test_a_damaged_line_is_ignored(tmp_path: Path, line: bytes) -> None:
    path = tmp_path / "runs.jsonl"
    write_journal(path, finished(0), finished(1), finished(2))
    lines = path.read_bytes().splitlines()
    lines[2] = line
    path.write_bytes(b"\n".join([*lines, b""]))
    content = read_journal(path, MEASURES)
    assert content.runs == {0: finished(0), 2: finished(2)}
    assert content.damaged_lines == (3,)


def test_what_cannot_be_opened_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: it is a directory"):
        read_journal(tmp_path, MEASURES)
    with pytest.raises(InputError, match="cannot be written"), open_journal(tmp_path, 0):
        pass
    with pytest.raises(InputError, match="cannot be written"), lock_folder(tmp_path / "missing"):
        pass


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is full")
def test_a_full_disk_is_a_sentence() -> None:
    path = Path("/dev/full")
    with FileIO(path, "w") as file, pytest.raises(InputError, match="no space left") as caught:
        Journal(path, file).add(finished(0))
    assert "the same command continues" in str(caught.value)


def test_a_folder_is_locked_once(tmp_path: Path) -> None:
    second = lock_folder(tmp_path)
    with lock_folder(tmp_path), pytest.raises(UsageError, match="Another sweep is running"):
        second.__enter__()
    with lock_folder(tmp_path):
        assert (tmp_path / LOCK_NAME).exists()


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
