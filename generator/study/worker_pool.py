"""Runs of a study in processes on this machine, each of which does one run after the other.

The processes are spawned, so a script needs `if __name__ == "__main__":` above the call that starts
a sweep: without it each process would execute the script again.

A process that dies takes one run along, which is repeated once, alone in a new process. Processes
end with the one that started them, whatever ends that, and only that one handles Ctrl-C.
"""

import multiprocessing
import os
import pickle
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TypeAlias

from generator.child_processes import (
    blocked_interrupt,
    cores,
    format_exit,
    redirect_output,
    serve_parent_only,
    single_threaded_libraries,
)
from generator.diagnostics import MoverError
from generator.study.study import DIED, PROGRAM_ERROR, RunResult, Study, failed_run
from generator.text_io import os_error_reason

_DIED_MESSAGE = "The process of this run ended twice before the run did."

_TASKS_PER_WORKER = 2
"""Runs that a process is sent ahead, so that it need not wait while their results are stored."""

_LONGEST_WAIT = 0.2
"""Longest time of waiting for a message [s]: Windows handles Ctrl-C only in between."""

_MAX_FAILED_STARTS = 3
"""Processes in succession that may die before they are ready for a run."""


@dataclass(frozen=True)
class Task:
    """One run that a study needs.

    Attributes:
        index: index of the run in the design, from 0.
        values: values of the parameters, in their order.
        keep: file for the motion; None to keep no motion.
    """

    index: int
    values: tuple[float, ...]
    keep: Path | None = None


@dataclass(frozen=True)
class FinishedRun:
    """Result of a task.

    Attributes:
        index: index of the run in the design, from 0.
        result: result of the run.
        seconds: that the run took.
    """

    index: int
    result: RunResult
    seconds: float


class TaskQueue:
    """Tasks that wait, of which each is made when its turn comes: a million take no memory."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        """Take the tasks in their order."""
        self._tasks, self._next = tasks, 0
        self._returned: deque[Task] = deque()

    def __len__(self) -> int:
        """Return the number of tasks that wait."""
        return len(self._returned) + len(self._tasks) - self._next

    def popleft(self) -> Task:
        """Return the next task, one that was put back before all others."""
        if self._returned:
            return self._returned.popleft()
        self._next += 1
        return self._tasks[self._next - 1]

    def put_back(self, tasks: Iterable[Task]) -> None:
        """Put tasks back, behind others that were put back."""
        self._returned.extend(tasks)


RunFunction: TypeAlias = Callable[[Study, Sequence[float], Path | None, int], RunResult]
"""Function of a module that carries out one run, with the arguments of `run_case`."""


def perform_task(run: RunFunction, study: Study, task: Task, threads: int = 1) -> FinishedRun:
    """Carry out a task. An error of the program becomes the outcome of this run alone.

    Raises OSError when the motion cannot be written.
    """
    start = time.perf_counter()
    try:
        result = run(study, task.values, task.keep, threads)
    except OSError:
        raise
    except Exception as failure:
        message = f"{type(failure).__name__}: {failure}"
        result = failed_run(study, PROGRAM_ERROR, message)
    result = replace(result, message=_one_line(result.message))
    return FinishedRun(task.index, result, time.perf_counter() - start)


def _one_line(message: str) -> str:
    """Return a message on one line and in UTF-8, as a cell of a table needs it.

    The name of a file, for example, may have bytes that cannot be decoded.
    """
    return " ".join(message.split()).encode(errors="backslashreplace").decode()


def died_run(study: Study, task: Task) -> FinishedRun:
    """Return the result of a task whose process ended twice."""
    return FinishedRun(task.index, failed_run(study, DIED, _DIED_MESSAGE), 0.0)


def run_locally(
    study: Study, tasks: Sequence[Task], jobs: int | None = None, run: RunFunction | None = None
) -> Generator[FinishedRun]:
    """Carry out tasks in processes, and yield each result as it arrives, in any order.

    Closing the generator, or an exception such as that of Ctrl-C, ends the processes at once.

    Args:
        study: that the runs belong to.
        tasks: runs to carry out.
        jobs: largest number of processes, at least 1 [default: one per core].
        run: function that carries out a run [default: `run_case`].

    Raises:
        MoverError: processes cannot be started, or end before they are ready for a run.
        OSError: a motion cannot be written.
    """
    if run is None:
        from generator.study.run_case import run_case

        run = run_case
    pool = _Pool(study, tasks, cores() if jobs is None else jobs, run)
    try:
        while pool.has_work:
            yield from pool.advance()
    finally:
        pool.end()


class _Pool:
    """Workers, and the tasks that wait for them."""

    def __init__(self, study: Study, tasks: Sequence[Task], jobs: int, run: RunFunction) -> None:
        self._study, self._run, self._jobs = study, run, jobs
        self._threads = 2 if 2 * jobs <= cores() else 1
        self._pickled = pickle.dumps(study, pickle.HIGHEST_PROTOCOL)
        self._waiting = TaskQueue(tasks)
        self._tasks_to_retry: deque[Task] = deque()
        """Tasks during which a worker died."""
        self._workers: dict[Connection, _Worker] = {}
        self._failed_starts = 0

    @property
    def has_work(self) -> bool:
        """Return whether a task has no result yet."""
        sent = any(worker.tasks for worker in self._workers.values())
        return bool(sent or self._waiting or self._tasks_to_retry)

    def advance(self) -> Iterator[FinishedRun]:
        """Start workers, hand out tasks, and wait for what arrives next."""
        while len(self._workers) < self._needed_workers():
            try:
                worker = _Worker(self._run, self._threads)
            except OSError as failure:
                reason = os_error_reason(failure)
                raise MoverError(
                    f"A process for the runs cannot be started: {reason}; choose fewer with --jobs."
                ) from None
            if self._tasks_to_retry:
                worker.retry = self._tasks_to_retry.popleft()
                worker.tasks.append(worker.retry)
            self._workers[worker.connection] = worker
        for connection in wait(list(self._workers), _LONGEST_WAIT):
            assert isinstance(connection, Connection)
            worker, has_died = self._workers[connection], False
            message: object = None
            try:
                message = connection.recv()
                self._take(worker, message)
                self._hand_out(worker)
            except (EOFError, OSError):
                has_died = True
            if isinstance(message, OSError):
                raise message
            if isinstance(message, FinishedRun):
                yield message
            if has_died:
                yield from self._replace_dead_worker(worker)

    def _take(self, worker: "_Worker", message: object) -> None:
        """Note a message of a worker: its results follow two that say how far its start is."""
        if isinstance(message, FinishedRun):
            worker.tasks.popleft()
            worker.retry = None
        elif not worker.has_study:
            worker.has_study = True
            worker.connection.send_bytes(self._pickled)
        elif not worker.is_ready:
            worker.is_ready, self._failed_starts = True, 0
            if worker.retry is not None:
                worker.connection.send(worker.retry)

    def _needed_workers(self) -> int:
        starting = sum(not worker.is_ready for worker in self._workers.values())
        idle = len(self._waiting) - starting
        wanted = len(self._workers) + len(self._tasks_to_retry) + max(0, idle)
        return min(self._jobs, wanted)

    def _hand_out(self, worker: "_Worker") -> None:
        """Send tasks to a worker; one at a time when few are left, so that all workers get some."""
        if not worker.is_ready or worker.retry is not None:
            return
        while self._waiting and len(worker.tasks) < _TASKS_PER_WORKER:
            if worker.tasks and len(self._waiting) < self._jobs:
                return
            task = self._waiting.popleft()
            worker.tasks.append(task)
            worker.connection.send(task)

    def _replace_dead_worker(self, worker: "_Worker") -> Iterator[FinishedRun]:
        """Remove a worker that has died, and put its tasks back."""
        del self._workers[worker.connection]
        code = worker.end()
        if not worker.is_ready:
            self._failed_starts += 1
            if self._failed_starts == _MAX_FAILED_STARTS:
                raise MoverError(
                    f"A process for the runs ended with {format_exit(code)} before its first run; "
                    'in a script, start the sweep below `if __name__ == "__main__":`.'
                )
            if worker.retry is not None:
                self._tasks_to_retry.append(worker.retry)
            return
        if not worker.tasks:
            return
        suspect = worker.tasks.popleft()
        self._waiting.put_back(worker.tasks)
        if worker.retry is None:
            self._tasks_to_retry.append(suspect)
        else:
            yield died_run(self._study, suspect)

    def end(self) -> None:
        """End the workers at once."""
        for worker in self._workers.values():
            worker.process.kill()
        for worker in self._workers.values():
            worker.end()


class _Worker:
    """A process that carries out tasks in the order in which they are sent.

    Attributes:
        connection: connection to the process.
        tasks: sent, or to be sent when it is ready, and without a result.
        retry: the task during which another worker died; it is alone here.
        has_study: whether the study was sent.
        is_ready: whether the process has read it.
    """

    def __init__(self, run: RunFunction, threads: int) -> None:
        """Start the process."""
        context = multiprocessing.get_context("spawn")
        self.connection, other = context.Pipe()
        self.process = context.Process(
            target=_serve, args=(other, run, threads), name="run", daemon=True
        )
        with single_threaded_libraries(), blocked_interrupt():
            self.process.start()
        other.close()
        self.tasks: deque[Task] = deque()
        self.retry: Task | None = None
        self.has_study = self.is_ready = False

    def end(self) -> int | None:
        """End the process, which may be dead already, and return its exit code."""
        self.connection.close()
        self.process.join(1.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        return self.process.exitcode


def _serve(connection: Connection, run: RunFunction, threads: int) -> None:
    """Receive a study, and carry out tasks until the connection is closed."""
    serve_parent_only()
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        connection.send(None)
        study: Study = pickle.loads(connection.recv_bytes())
        connection.send(None)
        redirect_output(os.devnull)
        while True:
            task: Task = connection.recv()
            try:
                answer = perform_task(run, study, task, threads)
            except OSError as failure:
                answer = failure
            connection.send(answer)
