"""Processes that make plates, as many at a time as there are cores.

A process that makes plates: `python -m plots.workers`, started by `plots.workers`.

It reads pairs of a plate's name and of where it is made from its standard input, and writes a
`DrawnPlate` or a `Failed` for each to its standard output, both pickled. When the input ends,
whoever wanted the plates is gone, and it ends in the middle of one.
"""

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from importlib import import_module
from queue import SimpleQueue
from threading import Lock, Thread
from types import ModuleType
from typing import IO

from plots.plate import DrawnPlate, FailedPlate


def make(name: str, target: str) -> DrawnPlate | FailedPlate:
    """Make and draw the plate of a name by a function `module:function`."""
    module = None
    try:
        # What it imports may refuse the user's settings, which is a reason as any other.
        from plots.plate import draw_plate

        path, _, function = target.partition(":")
        module = import_module(path)
        plate = getattr(module, function)()
        if plate.name != name:
            return FailedPlate(name, f"it calls itself `{plate.name}`")
        return draw_plate(plate)
    except (Exception, SystemExit) as failure:
        return FailedPlate(name, _reason(failure, module))


def _reason(failure: BaseException, module: ModuleType | None) -> str:
    """What was raised, on one line, and the last line of the plate's module that led there."""
    reason = type(failure).__name__
    if said := " ".join(str(failure).split()):
        reason += f": {said}"
    for frame in reversed(traceback.extract_tb(failure.__traceback__)):
        if module is not None and frame.filename == module.__file__:
            return f"{reason} ({os.path.basename(frame.filename)}, line {frame.lineno})"
    return reason


def main() -> None:
    """Serve until the standard input ends."""
    # Libraries print, some of them past Python: the stream of the answers is kept from them.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    wanted: SimpleQueue[tuple[str, str]] = SimpleQueue()
    Thread(target=_listen, args=(wanted,), daemon=True).start()
    while True:
        name, target = wanted.get()
        pickle.dump(make(name, target), answers)
        answers.flush()


def _listen(wanted: "SimpleQueue[tuple[str, str]]") -> None:
    """Pass on what is asked for; end the process with the input, whatever it is doing."""
    while True:
        try:
            wanted.put(pickle.load(sys.stdin.buffer))
        except EOFError:
            os._exit(0)


if __name__ == "__main__":
    main()


_ENDS_WITHIN = 5.0
"""How long a process that closed its pipes may take to end [s]."""

_LISTEN = 0.1
"""How often the caller's check is asked while nothing arrives [s]."""


def cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def make_plates(
    targets: Mapping[str, str], jobs: int, check: Callable[[], None] = lambda: None
) -> Generator[DrawnPlate | FailedPlate]:
    """Make plates, each in one of several processes, and yield them as they are done.

    A process that dies takes only its plate along. Closing the generator ends the processes.

    Args:
        targets: where each plate is made, `module:function`, by its name.
        jobs: number of processes, at least 1.
        check: asked several times a second; what it raises ends all.
    """
    workers = _Workers()
    pool = ThreadPoolExecutor(max_workers=jobs)
    try:
        pending: set[Future[DrawnPlate | FailedPlate]] = {
            pool.submit(workers.make, name, target) for name, target in targets.items()
        }
        while pending:
            check()
            done, pending = wait(pending, timeout=_LISTEN, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        workers.kill()
        pool.shutdown()  # the threads have read the end of the processes
        workers.close()


class _Workers:
    """The running processes; several threads ask them at once, each for one plate."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._all: list[subprocess.Popen[bytes]] = []
        self._idle: list[subprocess.Popen[bytes]] = []
        self._said: dict[int, IO[bytes]] = {}
        self._ended = False

    def make(self, name: str, target: str) -> DrawnPlate | FailedPlate:
        """The plate of a name, made by an idle process or by a new one."""
        with self._lock:
            if self._ended:
                return FailedPlate(name, "the processes were ended")
            worker = self._idle.pop() if self._idle else self._start()
        assert worker.stdin is not None
        assert worker.stdout is not None
        try:
            pickle.dump((name, target), worker.stdin)
            worker.stdin.flush()
            made = pickle.load(worker.stdout)
        except (OSError, EOFError, pickle.UnpicklingError):
            return FailedPlate(name, f"its process ended with {self._end_of(worker)}")
        with self._lock:
            self._idle.append(worker)
        return made

    def kill(self) -> None:
        """End all processes at once, and start no more."""
        with self._lock:
            self._ended = True
            for worker in self._all:
                worker.kill()

    def close(self) -> None:
        """Wait for the processes to be gone and close what led to them."""
        for worker in self._all:
            with suppress(OSError), self._said[worker.pid], worker:
                pass

    def _end_of(self, worker: subprocess.Popen[bytes]) -> str:
        """How a process ended that answers no more, and the last that it said."""
        try:
            ending = _ending(worker.wait(_ENDS_WITHIN))
        except subprocess.TimeoutExpired:
            worker.kill()
            worker.wait()
            ending = "closed pipes"
        said = self._said[worker.pid]
        said.seek(0)
        lines = said.read().decode(errors="replace").split("\n")
        last = next((line.strip() for line in reversed(lines) if line.strip()), "")
        return f"{ending}: {last}" if last else ending

    def _start(self) -> subprocess.Popen[bytes]:
        said = tempfile.TemporaryFile()  # noqa: SIM115 - `close` closes it
        worker: subprocess.Popen[bytes] = subprocess.Popen(
            # Without -P a folder `plots` where the command is given would be taken for this one.
            [sys.executable, "-P", "-m", "plots.workers"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=said,
            env=_environment(),
            # Ctrl-C is for the parent alone.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
        self._all.append(worker)
        self._said[worker.pid] = said
        return worker


def _environment() -> dict[str, str]:
    """That of a process: it finds what this one finds, and computes in one thread.

    There is a process for each core already, and one thread sums in one order.
    """
    threads = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    places = os.pathsep.join(os.path.abspath(place) for place in sys.path)
    return os.environ | dict.fromkeys(threads, "1") | {"PYTHONPATH": places}


def _ending(code: int) -> str:
    """How a process ended, in words."""
    if code < 0:
        with suppress(ValueError):
            return signal.Signals(-code).name
    return f"exit code {code}"
