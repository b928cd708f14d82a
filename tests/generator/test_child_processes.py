import os
import signal
import subprocess
import sys
from multiprocessing import get_context
from multiprocessing.connection import Connection

import pytest

from generator.child_processes import (
    blocked_interrupt,
    cores,
    format_exit,
    serve_parent_only,
    single_threaded_libraries,
)
from tests.processes import ENVIRONMENT

THREADS = "OMP_NUM_THREADS"


def serve(connection: Connection) -> None:
    """Answer each message with the number of threads, until the parent ends this process."""
    serve_parent_only()
    while True:
        connection.send(os.environ[THREADS])
        connection.recv()


def start() -> int:
    """Start a process, send it SIGINT at once, and return its number when it answers twice."""
    context = get_context("spawn")
    connection, other = context.Pipe()
    process = context.Process(target=serve, args=(other,), daemon=True)
    with single_threaded_libraries(), blocked_interrupt():
        process.start()
    assert process.pid is not None
    if os.name == "posix":
        os.kill(process.pid, signal.SIGINT)
    for _ in range(2):
        assert connection.recv() == "1"
        connection.send(None)
    return process.pid


def test_at_least_one_core() -> None:
    assert 1 <= cores() <= (os.cpu_count() or 1)


def test_the_environment_is_restored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(THREADS, "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with single_threaded_libraries():
        assert os.environ[THREADS] == os.environ["MKL_NUM_THREADS"] == "1"
    assert os.environ[THREADS] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


@pytest.mark.skipif(os.name != "posix", reason="signals that are blocked")
def test_an_interrupt_comes_after_the_block(sigint_handler: None) -> None:
    arrived: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: arrived.append(number))
    with blocked_interrupt():
        signal.raise_signal(signal.SIGINT)
        assert arrived == []
    assert arrived == [signal.SIGINT]


def test_a_process_ignores_an_interrupt_and_ends_with_its_parent() -> None:
    script = (
        "import os; from tests.generator.test_child_processes import start;"
        "print(start(), flush=True); os._exit(0)"
    )
    started = subprocess.Popen(
        [sys.executable, "-c", script], env=ENVIRONMENT, stdout=subprocess.PIPE, text=True
    )
    # The process inherits the stream, which is at its end when both have ended.
    number, _ = started.communicate(timeout=60.0)
    assert int(number) > 0
    assert started.returncode == 0


def test_an_exit_code_or_a_signal_is_named() -> None:
    assert format_exit(3) == "exit code 3"
    assert format_exit(-signal.SIGTERM) == "SIGTERM"
