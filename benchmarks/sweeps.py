"""Ten thousand runs of a study: memory, cost of a second process, and what kills leave.

    python -m benchmarks.sweeps

The study is a pendulum that swings for 0.3 s; the prototype falls through 0.2 s. Three things are
measured, and a figure beyond its limit is a failure:

- the processor time of a run with two processes, over that with one, in rounds side by side;
- the resident memory of the leading process and of each other one during the sweeps;
- the table of the first runs when ten processes and twice the leading one are killed, and the
  journal has a torn line, against the same lines of the undisturbed table.
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from multiprocessing import active_children
from pathlib import Path

from benchmarks import tables
from benchmarks.leaks import MAX_GROWTH
from generator import Plan, read_figure
from generator.simulation.plan import resolve_model
from generator.study.designs import design_points
from generator.study.journal import JOURNAL_NAME
from generator.study.study import (
    Design,
    DesignKind,
    Measure,
    Parameter,
    Statistic,
    Study,
    Uniform,
)
from generator.study.sweep import TABLE_NAME, SweepProgress, run_sweep
from generator.study.worker_pool import run_locally

RUNS, PROTOTYPE_RUNS, ROUND_RUNS, ROUNDS = 10_000, 1_000, 500, 5

DISTURBED_RUNS = 10_000
"""Number of runs that are repeated with kills."""

MAX_CPU_RATIO = 1.15
"""Largest processor time of a run with two processes, over that with one."""

WORKER_KILLS, PARENT_KILLS = 10, 2

_WARM_UP = 0.1
"""Share of the runs after which growth and processor time count."""

_REPORT_INTERVAL = 20
"""Runs between two lines of a sweep in another process."""


def pendulum_study(runs: int) -> Study:
    """A study of the pendulum: gravity and the height of its start vary."""
    return _study("pendulum", Plan(stop=0.3), "pose.shoulder.2", "shoulder.2 [deg]", runs)


def prototype_study(runs: int) -> Study:
    """A study of the prototype: gravity and the angle of its knees vary."""
    plan = Plan(stop=0.2, tolerance=1e-2)
    return _study("prototype", plan, "pose.knee", "left_knee.1 [deg]", runs)


def _study(name: str, plan: Plan, pose: str, column: str, runs: int) -> Study:
    figure = read_figure(name)
    parameters = {
        "gravity_scale": Parameter("gravity_scale", ("gravity",), Uniform(0.8, 1.2)),
        "start": Parameter("start", (pose,), Uniform(-10.0, 10.0)),
    }
    measures = {
        "swing": Measure("swing", column, Statistic.LARGEST),
        "end": Measure("end", "kinetic [J]", Statistic.LAST),
    }
    return Study(
        name,
        *resolve_model(figure, plan),
        parameters,
        Design(DesignKind.LATIN_HYPERCUBE, runs, seed=7),
        measures,
        text=f'figure = "{name}"\n',
    )


def main() -> None:
    """Print what was measured, and fail beyond the limits."""
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        rounds = _cpu_rounds(Path(folder))
        tables.show(rounds)
        one, two = (min(float(str(row[f"{jobs} [ms]"])) for row in rounds) for jobs in (1, 2))
        print(f"\nCPU time of a run with two processes over one: {two / one:.3f}\n")
        if two > MAX_CPU_RATIO * one:
            failures.append("a second process costs too much")
        whole = Path(folder, "whole")
        for name, study in (
            ("pendulum", pendulum_study(RUNS)),
            ("prototype", prototype_study(PROTOTYPE_RUNS)),
        ):
            target = whole if name == "pendulum" else Path(folder, name)
            rows, growth = _memory(study, target)
            print(f"{name}: resident memory [MB]")
            tables.show(rows)
            print(f"\nlargest growth: {growth:.1f} MB\n")
            if growth > MAX_GROWTH:
                failures.append(f"the memory of the {name} grows")
        disturbed = Path(folder, "disturbed")
        print(_disturb(disturbed))
        lines = (disturbed / TABLE_NAME).read_bytes().splitlines()
        undisturbed = (whole / TABLE_NAME).read_bytes().splitlines()[: DISTURBED_RUNS + 1]
        print(f"{len(lines) - 1} rows, {'equal' if lines == undisturbed else 'DIFFERENT'}")
        if lines != undisturbed:
            failures.append("kills change the table")
    if failures:
        sys.exit("; ".join(failures))


def _cpu_rounds(folder: Path) -> list[dict[str, object]]:
    """Processor time of a run with one and two processes, in turn."""
    study, rows = pendulum_study(ROUND_RUNS), list[dict[str, object]]()
    for number in range(1, ROUNDS + 1):
        row: dict[str, object] = {"round": number}
        for jobs in (1, 2):
            row[f"{jobs} [ms]"] = round(
                1e3 * _cpu_time(study, folder / f"{number}_{jobs}", jobs), 3
            )
        rows.append(row)
    return rows


def _cpu_time(study: Study, folder: Path, jobs: int) -> float:
    """Processor time of a run, the leading process included [s]."""
    first = last = (0, 0.0)

    def watch(progress: SweepProgress) -> None:
        nonlocal first, last
        if progress.finished == int(_WARM_UP * progress.total):
            first = progress.finished, _spent_cpu()
        if progress.finished == progress.total - jobs:  # all processes are busy until then
            last = progress.finished, _spent_cpu()

    _sweep(study, folder, jobs, watch)
    return (last[1] - first[1]) / (last[0] - first[0])


def _spent_cpu() -> float:
    """Processor time of this process and of its running children [s]."""
    ticks = os.sysconf("SC_CLK_TCK")
    spent = time.process_time()
    for child in active_children():
        words = Path(f"/proc/{child.pid}/stat").read_text().rpartition(")")[2].split()
        spent += (int(words[11]) + int(words[12])) / ticks
    return spent


def _memory(study: Study, folder: Path) -> tuple[list[dict[str, object]], float]:
    """Resident memory during a sweep by two processes, and the largest growth [MB]."""
    rows: list[dict[str, object]] = []
    growth = 0.0
    first: dict[int, float] = {}
    start = time.monotonic()

    def watch(progress: SweepProgress) -> None:
        nonlocal growth, first
        steps = max(1, progress.total // 10)
        if progress.finished % steps or not progress.finished:
            return
        sizes = {pid: _resident(pid) for pid in (os.getpid(), *children(os.getpid()))}
        first = first or sizes
        growth = max(growth, *(size - first[pid] for pid, size in sizes.items()))
        row: dict[str, object] = {
            "runs": progress.finished,
            "seconds": round(time.monotonic() - start, 1),
        }
        names = ("leading", "first", "second")
        rows.append({**row, **{n: round(s, 1) for n, s in zip(names, sizes.values(), strict=True)}})

    _sweep(study, folder, 2, watch)
    return rows, growth


def _resident(process: int) -> float:
    """Resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def children(process: int) -> list[int]:
    """Processes for runs that a process has started."""
    found: list[int] = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
            command = (path / "cmdline").read_bytes()
        except OSError:  # it has ended
            continue
        if parent == process and b"spawn_main" in command:
            found.append(int(path.name))
    return sorted(found)


def _sweep(
    study: Study, folder: Path, jobs: int, watch: Callable[[SweepProgress], None] | None
) -> None:
    result = run_sweep(study, folder, partial(run_locally, jobs=jobs), watch=watch)
    if result.failed:
        sys.exit(f"{result.failed} runs failed: {result.rows[0].message}")


def _disturb(folder: Path) -> str:
    """Repeat the first runs of the pendulum with kills and a torn line, until all are there."""
    generator = random.Random(1)
    parts = PARENT_KILLS + 1
    parent_moments = [DISTURBED_RUNS * k / parts for k in range(1, parts)]
    moments = [0.9 * DISTURBED_RUNS * (k + 0.5) / WORKER_KILLS for k in range(WORKER_KILLS)]
    moments = sorted(moments + parent_moments)
    killed_workers = killed_parents = starts = 0
    while True:
        starts += 1
        process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.sweeps", str(folder)],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        for line in process.stdout:
            while moments and int(line) >= moments[0]:
                if moments.pop(0) in parent_moments:
                    process.kill()
                    killed_parents += 1
                    break
                os.kill(generator.choice(children(process.pid)), signal.SIGKILL)
                killed_workers += 1
        if process.wait() == 0:
            break
        if process.returncode != -signal.SIGKILL:
            sys.exit(f"the sweep ended with {process.returncode}")
        journal = folder / JOURNAL_NAME
        if killed_parents == 1:
            os.truncate(journal, journal.stat().st_size - 10)
    return (
        f"{killed_workers} processes and {killed_parents} leading ones killed, a torn line; "
        f"{starts} starts"
    )


def lead(folder: Path) -> None:
    """Repeat the first runs of the pendulum, and print the progress."""
    study = pendulum_study(RUNS)
    rows = tuple(map(tuple, design_points(study)[:DISTURBED_RUNS].tolist()))
    study = replace(study, design=Design(DesignKind.LIST, rows=rows))

    def watch(progress: SweepProgress) -> None:
        if progress.finished % _REPORT_INTERVAL == 0:
            print(progress.finished, flush=True)

    _sweep(study, folder, 2, watch)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        lead(Path(sys.argv[1]))
    else:
        main()
