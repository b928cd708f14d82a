"""Studies of the pendulum, and functions that carry out their runs in processes."""

import os
import signal
import time
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

from generator.diagnostics import Parsed
from generator.figure_file.read import read_figure
from generator.model import Model
from generator.simulation.plan import Plan
from generator.study.study import (
    Design,
    DesignKind,
    Measure,
    Parameter,
    RunResult,
    Statistic,
    Study,
)
from generator.study.study_file import STUDY_FILE
from generator.text_io import make_source

POISON, FRAIL, FAULTY, FULL_DISK, SLOW = 666.0, 555.0, 444.0, 333.0, 60.0
"""Values at which a run kills its process, does so the first time only, raises an exception of the
program, cannot write, and takes a minute."""

REAL, BEGIN = 1.0625, "begin"
"""Value at which a deadly run is simulated, and the file beside its motion that it waits for."""


def parse_study_text(text: str, folder: Path) -> Parsed[Study]:
    """The study that a text describes; paths in it are relative to a folder."""
    return STUDY_FILE.parse(make_source(text, path=folder / "text.study.toml"))


@cache
def pendulum_study(rows: tuple[tuple[float, ...], ...] = ((0.9,), (1.0,), (1.1,))) -> Study:
    """A study of the pendulum under so many times gravity."""
    figure = read_figure("pendulum")
    plan = Plan(stop=0.3)
    return Study(
        name="pendulum",
        model=Model.of(figure),
        plan=plan,
        parameters={"g": Parameter("g", ("gravity",), None)},
        design=Design(DesignKind.LIST, rows=rows),
        measures={
            "swing": Measure("swing", "shoulder.2 [deg]", Statistic.LARGEST),
            "end": Measure("end", "kinetic [J]", Statistic.LAST),
        },
        text="# a study\n",
    )


def list_study(*values: float) -> Study:
    """The study with these values of its parameter."""
    return pendulum_study(tuple((value,) for value in values))


def quick_run(
    study: Study, values: Sequence[float], keep: Path | None, threads: int = 1
) -> RunResult:
    """Return a third and a square of the value; write the process into the file of the motion."""
    (value,) = values
    is_first = keep is None or not keep.exists()
    if keep is not None:
        with keep.open("a") as file:
            file.write(f"{os.getpid()}\n")
    if value == POISON or (value == FRAIL and is_first):
        os.kill(os.getpid(), signal.SIGKILL)
    if value == FAULTY:
        raise ZeroDivisionError("a fault\nof the program")
    if value == FULL_DISK:
        raise OSError(28, "No space left on device")
    if value == SLOW:
        time.sleep(SLOW)
    return RunResult("done", "", {"swing": value / 3.0, "end": value * value})


def deadly_run(
    study: Study, values: Sequence[float], keep: Path | None, threads: int = 1
) -> RunResult:
    """Do as quick runs do, but wait for a file before the process is killed, and simulate once."""
    if tuple(values) == (POISON,):
        assert keep is not None
        while not keep.with_name(BEGIN).exists():
            time.sleep(0.005)
    if tuple(values) == (REAL,):
        from generator.study.run_case import run_case  # imports Exudyn

        return run_case(study, values, None, threads)
    return quick_run(study, values, keep)


def meeting_run(
    study: Study, values: Sequence[float], keep: Path | None, threads: int = 1
) -> RunResult:
    """Wait until all runs of the study have begun."""
    assert keep is not None
    keep.touch()
    while len(list(keep.parent.iterdir())) < len(study.design.rows):
        time.sleep(0.005)
    return quick_run(study, values, None)


def processes_of(folder: Path) -> list[int]:
    """Numbers of the processes of quick runs, one for each time that a run was carried out."""
    return [int(line) for file in sorted(folder.iterdir()) for line in file.read_text().split()]


def is_running(process: int) -> bool:
    """Return whether a process runs; one that has ended and waits for its parent does not."""
    with suppress(OSError):
        status = Path(f"/proc/{process}/stat").read_text()
        return status.rpartition(")")[2].split()[0] not in "ZX"
    return False
