"""Processes of the command, where the process itself is tested: signals, streams, terminals."""

import os
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.paths import ROOT

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


@contextmanager
def on_terminal(
    line: Sequence[str], cwd: Path, variables: Mapping[str, str] | None = None
) -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """A process whose error stream is a terminal, and the descriptor to read that from."""
    pty = pytest.importorskip("pty")
    terminal, inner = pty.openpty()
    process = subprocess.Popen(
        line,
        cwd=cwd,
        env={**ENVIRONMENT, "TERM": "xterm", **(variables or {})},
        stdout=subprocess.PIPE,
        stderr=inner,
    )
    os.close(inner)
    yield process, terminal
    os.close(terminal)


def read_to_end(terminal: int) -> bytes:
    """Return what a process still prints on a terminal."""
    seen = b""
    with suppress(OSError):  # how a terminal says that the other end is closed
        while chunk := os.read(terminal, 1000):
            seen += chunk
    return seen


def child_processes(parent: int) -> list[int]:
    """Return the processes that a process has started and that have not ended; needs /proc."""
    found: list[int] = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, its_parent = status.read_text().rpartition(")")[2].split()[:2]
            if int(its_parent) == parent and state != "Z":
                found.append(int(status.parent.name))
    return found


def has_ended(process: int) -> bool:
    """Return whether a process has ended; needs /proc."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True
