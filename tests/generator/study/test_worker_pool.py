import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path

import pytest

from generator.diagnostics import MoverError
from generator.study.study import DIED, PROGRAM_ERROR, RunResult, Study
from generator.study.worker_pool import (
    FinishedRun,
    Task,
    TaskQueue,
    perform_task,
    run_locally,
)
from tests.processes import ENVIRONMENT
from tests.study_runs import (
    FAULTY,
    FRAIL,
    FULL_DISK,
    POISON,
    SLOW,
    is_running,
    list_study,
    meeting_run,
    processes_of,
    quick_run,
)


def carry_out(values: list[float], folder: Path, jobs: int) -> list[RunResult]:
    """The results of quick runs, by index."""
    study = list_study(*values)
    with closing(run_locally(study, tasks(values, folder), jobs, quick_run)) as runs:
        results = {run.index: run.result for run in runs}
    return [results[index] for index in range(len(values))]


def tasks(values: list[float], folder: Path) -> list[Task]:
    return [Task(index, (value,), folder / f"{index:03}") for index, value in enumerate(values)]


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait for half a minute at most."""
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def expected(values: list[float]) -> list[RunResult]:
    return [quick_run(list_study(*values), (value,), None) for value in values]


def test_carries_out_each_task_once_in_another_process(tmp_path: Path) -> None:
    values = [0.1 * k for k in range(20)]
    assert carry_out(values, tmp_path, 2) == expected(values)
    processes = processes_of(tmp_path)
    assert len(processes) == len(values)
    assert os.getpid() not in processes
    assert len(set(processes)) <= 2
    assert not any(map(is_running, processes))


def test_last_tasks_go_to_different_processes(tmp_path: Path) -> None:
    values = [1.0, 2.0]
    runs = list(run_locally(list_study(*values), tasks(values, tmp_path), 2, meeting_run))
    assert {run.result.outcome for run in runs} == {"done"}


def test_repeats_a_run_whose_process_died_and_no_other(tmp_path: Path) -> None:
    values = [1.0, 2.0, FRAIL, 4.0, 5.0, 6.0]
    files = [tmp_path / f"{k:03}" for k in range(len(values))]
    assert carry_out(values, tmp_path, 1) == [
        RunResult("done", "", {"swing": value / 3.0, "end": value * value}) for value in values
    ]
    assert len(set(processes_of(tmp_path))) == 2
    counts = [len(file.read_text().split()) for file in files]
    assert counts == [1, 1, 2, 1, 1, 1]


def test_a_run_that_kills_its_process_twice_is_a_row(tmp_path: Path) -> None:
    values = [1.0, POISON, 3.0, 4.0, POISON]
    results = carry_out(values, tmp_path, 2)
    assert [result.outcome for result in results] == ["done", DIED, "done", "done", DIED]
    assert results[1].measures == {"swing": None, "end": None}
    assert results[1].message.endswith(".")
    counts = [len((tmp_path / f"{k:03}").read_text().split()) for k in range(len(values))]
    assert counts == [1, 2, 1, 1, 2]


def test_an_error_of_the_program_is_a_row() -> None:
    run = perform_task(quick_run, list_study(FAULTY), Task(7, (FAULTY,)))
    assert isinstance(run, FinishedRun)
    assert run.index == 7
    measures = {"swing": None, "end": None}
    message = "ZeroDivisionError: a fault of the program"
    assert run.result == RunResult(PROGRAM_ERROR, message, measures)


def test_a_motion_that_cannot_be_written_ends_the_runs(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No space left"):
        carry_out([1.0, FULL_DISK, SLOW], tmp_path, 2)
    assert not any(map(is_running, processes_of(tmp_path)))


def test_closing_ends_the_processes_at_once(tmp_path: Path) -> None:
    values = [1.0, SLOW, SLOW]
    runs = run_locally(list_study(*values), tasks(values, tmp_path), 2, quick_run)
    next(runs)
    wait_until(lambda: len(processes_of(tmp_path)) > 1)
    runs.close()
    assert not any(map(is_running, processes_of(tmp_path)))


SLOW_SWEEP = """
import sys
from pathlib import Path
from generator.study.worker_pool import Task, run_locally
from tests.study_runs import SLOW, list_study, quick_run
tasks = [Task(index, (SLOW,), Path(sys.argv[1], str(index))) for index in range(4)]
try:
    list(run_locally(list_study(*[SLOW] * 4), tasks, int(sys.argv[2]), quick_run))
except KeyboardInterrupt:
    sys.exit(3)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals of a group of processes")
@pytest.mark.parametrize(("number", "code"), [("SIGINT", 3), ("SIGKILL", -9)])
def test_no_process_survives_the_parent(tmp_path: Path, number: str, code: int) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", SLOW_SWEEP, str(tmp_path), "2"],
        env=ENVIRONMENT,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    wait_until(lambda: len(processes_of(tmp_path)) == 2)
    if number == "SIGINT":  # as a terminal sends it, to all of them
        os.killpg(process.pid, signal.SIGINT)
    else:
        process.send_signal(signal.Signals[number])
    _, printed = process.communicate(timeout=30.0)  # the runs take longer
    assert (process.returncode, printed) == (code, b"")
    wait_until(lambda: not any(map(is_running, processes_of(tmp_path))))


def test_a_script_without_a_guard_is_explained(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    (tmp_path / "motions").mkdir()
    script.write_text(SLOW_SWEEP)
    done = subprocess.run(
        [sys.executable, str(script), str(tmp_path / "motions"), "3"],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert 'below `if __name__ == "__main__":`' in done.stderr.splitlines()[-1]


def test_a_message_is_one_line_of_text() -> None:
    def fail(study: Study, values: Sequence[float], keep: Path | None, threads: int) -> RunResult:
        return RunResult("wrong input", "two\nlines,\r\n\udcff", {})

    run = perform_task(fail, list_study(0.1), Task(0, (0.1,)))
    assert run.result.message == "two lines, \\udcff"


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process")
def test_a_process_that_cannot_be_started_is_explained() -> None:
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    first_free = os.dup(0)
    os.close(first_free)
    runs = run_locally(list_study(0.1), [Task(0, (0.1,))], 1, quick_run)
    resource.setrlimit(resource.RLIMIT_NOFILE, (first_free, hard))
    try:
        with pytest.raises(MoverError, match="cannot be started: too many open files"):
            next(runs)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


class Counted(Sequence[Task]):
    """A hundred thousand tasks, of which those that were made are counted."""

    def __init__(self) -> None:
        self.made = 0

    def __len__(self) -> int:
        return 100_000

    def __getitem__(self, index: int) -> Task:  # pyright: ignore[reportIncompatibleMethodOverride]
        self.made += 1
        return Task(index, (float(index),))


def test_tasks_are_made_when_their_turn_comes() -> None:
    tasks = Counted()
    with closing(run_locally(list_study(0.1), tasks, 1, quick_run)) as runs:
        assert next(runs).index == 0
    assert tasks.made < 10


def test_tasks_that_were_put_back_are_next() -> None:
    tasks = [Task(index, ()) for index in range(4)]
    queue = TaskQueue(tasks)
    first, second = queue.popleft(), queue.popleft()
    queue.put_back([first])
    queue.put_back([second])
    assert len(queue) == 4
    assert [queue.popleft() for _ in range(len(queue))] == tasks
    assert not queue
