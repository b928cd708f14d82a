"""Processes that this one starts: on one thread each, without Ctrl-C, and ending with it."""

import multiprocessing
import os
import signal
from collections.abc import Generator
from contextlib import contextmanager, suppress
from threading import Thread

_THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)


def cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def single_threaded_libraries() -> Generator[None]:
    """Start processes whose libraries use one thread.

    There is a process for each core already, and one thread sums in a fixed order.
    """
    before = {name: os.environ.get(name) for name in _THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def blocked_interrupt() -> Generator[None]:
    """Hold Ctrl-C back in this thread, and in processes that are started meanwhile.

    These inherit the block. Windows has none.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # starting it would lift the block
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def redirect_output(path: str) -> None:
    """Write what this process and its libraries print, also from compiled code, into a file."""
    stream = os.open(path, os.O_WRONLY | os.O_CREAT)
    os.dup2(stream, 1)
    os.dup2(stream, 2)


def format_exit(code: int | None) -> str:
    """Format the exit code of a process, or the name of the signal that ended it."""
    if code is not None and code < 0:
        with suppress(ValueError):
            return signal.Signals(-code).name
    return f"exit code {code}"


def serve_parent_only() -> None:
    """Make this process ignore Ctrl-C, and end when the process ends that started it.

    It ends at once, also while it waits or computes; without such a process it does not.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    parent = multiprocessing.parent_process()
    if parent is not None:

        def exit_after_parent() -> None:
            parent.join()
            os._exit(1)

        Thread(target=exit_after_parent, daemon=True).start()
