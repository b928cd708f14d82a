"""A study of a million runs: time to the first row, and memory of the leading process.

    python -m benchmarks.million

`mover sweep` begins a million runs of a pendulum and is interrupted half a minute after the first
row. The journal is then completed with computed lines, and the same command reads it and writes the
table. More than `MAX_MEMORY` is a failure.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks import tables
from generator.study.content_key import content_key, installed_versions
from generator.study.designs import design_points
from generator.study.journal import JOURNAL_NAME, JournalHeader, open_journal, read_journal
from generator.study.study import RunResult
from generator.study.study_file import read_study
from generator.study.sweep import TABLE_NAME
from generator.study.worker_pool import FinishedRun

RUNS = 1_000_000

MAX_MEMORY = 400.0
"""Largest resident memory of the leading process [MB]."""

_WATCHED = 30.0
"""Time after the first row [s]."""

_STUDY = f"""
figure = "pendulum"
stop = 0.3
[design]
kind = "latin-hypercube"
runs = {RUNS}
seed = 7
[parameters]
gravity_scale = {{ path = "gravity", low = 0.8, high = 1.2 }}
start = {{ path = "pose.shoulder.2", low = -10.0, high = 10.0 }}
[measures]
swing = {{ column = "shoulder.2 [deg]", take = "largest" }}
end = {{ column = "kinetic [J]", take = "last" }}
"""


class _Sweep:
    """`mover sweep` in another process, and the time since its start."""

    def __init__(self, study: Path, folder: Path) -> None:
        program = "from generator.cli.app import main; main()"
        words = [sys.executable, "-c", program, "sweep", str(study), "-o", str(folder)]
        self.start, self.peak = time.monotonic(), 0.0
        self.process = subprocess.Popen(words, stdout=subprocess.DEVNULL)

    def row(self, event: str) -> dict[str, object]:
        """Return time, memory and its peak for a table."""
        return {
            "event": event,
            "seconds": round(time.monotonic() - self.start, 1),
            "processor time [s]": round(self._spent_cpu(), 1),
            "memory [MB]": round(self._memory("VmRSS")),
            "peak [MB]": round(self.note_peak()),
        }

    def note_peak(self) -> float:
        """Return the largest resident memory until now [MB]."""
        self.peak = max(self.peak, self._memory("VmHWM"))
        return self.peak

    def _spent_cpu(self) -> float:
        """Return the processor time of the process [s]."""
        status = Path(f"/proc/{self.process.pid}/stat").read_text()
        user, system = status.rpartition(")")[2].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")

    def _memory(self, name: str) -> float:
        """Return a memory of the process [MB]; zero when it has ended."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        lines = dict(line.split(":", 1) for line in status.splitlines())
        return float(lines[name].split()[0]) / 1e3 if name in lines else 0.0


def main() -> None:
    """Print what was measured, and fail beyond the limit."""
    with tempfile.TemporaryDirectory() as name:
        study, folder = Path(name, "million.study.toml"), Path(name, "million")
        study.write_text(_STUDY)
        first = _Sweep(study, folder)
        while _lines(folder) < 2:
            time.sleep(0.05)
        rows = [first.row("first row")]
        time.sleep(_WATCHED)
        rows.append(first.row(f"{_lines(folder) - 1:,} rows"))
        first.process.send_signal(signal.SIGINT)
        first.process.wait()
        _complete(study, folder)
        second = _Sweep(study, folder)
        while second.process.poll() is None and not (folder / TABLE_NAME).exists():
            second.note_peak()
            time.sleep(0.05)
        rows.append(second.row("table of a finished journal"))
        while not os.waitid(os.P_PID, second.process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            second.note_peak()
            time.sleep(0.05)
        rows.append(second.row("report"))
        code = second.process.wait()
        with (folder / TABLE_NAME).open() as file:
            count = sum(1 for _ in file) - 1
    tables.show(rows)
    peak = max(first.peak, second.peak)
    if code or count != RUNS or peak > MAX_MEMORY:
        sys.exit(f"exit code {code}, {count:,} rows, {peak:.0f} MB")


def _lines(folder: Path) -> int:
    path = folder / JOURNAL_NAME
    return path.read_bytes().count(b"\n") if path.exists() else 0


def _complete(path: Path, folder: Path) -> None:
    """Add computed lines for all runs that a journal does not have."""
    study, versions = read_study(path), installed_versions()
    points = design_points(study)
    header = JournalHeader(content_key(study, points, versions), versions)
    journal_path = folder / JOURNAL_NAME
    content = read_journal(journal_path, header, study.measures, RUNS)
    with open_journal(journal_path, content, header) as journal:
        for index in np.flatnonzero(~content.results.finished).tolist():
            gravity, start = points[index].tolist()
            result = RunResult("done", "", {"swing": gravity / 3.0, "end": start * start})
            journal.add(FinishedRun(index, result, 0.01))


if __name__ == "__main__":
    main()
