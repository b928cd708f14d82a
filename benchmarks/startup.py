"""Cost before the first step: imports, building the reference figure, memory, first compilation.

Run with `python -m benchmarks startup`. Each engine starts in a process of its own, which runs the
reference figure for a second. Memory is the peak of that process, with Python, numpy, SciPy and
this project's reader in it, which all of them use here ("reader alone" has nothing else); imports
are timed in processes that do nothing else. Best of several rounds in which all take turns.

The last rows are whole processes of the command: a simulation of 2 s of the prototype with a file
of its motion, and the compilation of the integrator in an empty cache folder.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from math import inf, nan
from pathlib import Path

from benchmarks import tables

COMMAND = "python -m benchmarks startup"

ROUNDS = 5

_IMPORT_EXUDYN = (
    "from generator.simulation.preconditions import import_exudyn; "
    "import_exudyn(); import generator.simulation.run"
)

THIS_PROGRAM, OPENSIM = "this program", "OpenSim"

IMPORTS: Mapping[str, str] = {
    THIS_PROGRAM: f"{_IMPORT_EXUDYN}; import generator.simulation.compiled_run",
    "this program, Exudyn's integrator": _IMPORT_EXUDYN,
    "Exudyn alone": "import exudyn",
    "reader alone": "from generator.figure_file import read_figure",
    "MuJoCo": "import mujoco",
    OPENSIM: "import opensim",
    "Pinocchio": "import pinocchio",
    "Drake": "import pydrake.all",
}


@dataclass(frozen=True)
class Aim:
    """A bound on a measured ratio or time, and its values by wall and by CPU time."""

    sentence: str
    at_most: float
    wall: float
    cpu: float
    at_least: float = -inf

    def row(self) -> tables.Row:
        """The aim as a row of the table."""
        reached = [self.at_least <= value <= self.at_most for value in (self.wall, self.cpu)]
        verdict = {(True, True): "yes", (True, False): "by wall", (False, True): "by CPU"}
        is_lower = self.at_most == inf
        return {
            "aim": self.sentence,
            "bound": f"at least {self.at_least:g}" if is_lower else f"at most {self.at_most:g}",
            "wall": self.wall,
            "CPU": self.cpu,
            "reached": verdict.get((reached[0], reached[1]), "no"),
        }


SIMULATION, COMPILATION = "mover simulate", "mover warm-up, empty cache"

ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
"""Environment of the processes. All engines are imported from bytecode, as installed ones are."""


@dataclass(frozen=True)
class Spent:
    """Wall and CPU time of a process [s], and what it printed."""

    wall: float
    cpu: float
    output: str


def main() -> None:
    """Print the table and write it, and print the aims."""
    rows = measured()
    tables.show(rows)
    tables.write("startup", COMMAND, rows)
    print()
    tables.show([aim.row() for aim in aims(rows)])


def aims(rows: Iterable[tables.Row]) -> Iterator[Aim]:
    """Yield the aims of the start, of rows of the table."""
    by_engine = {str(row["engine"]): row for row in rows}

    def value(engine: str, key: str) -> float:
        return float(str(by_engine[engine][key]))

    for what, bound in (("import", 1.0), ("build", 0.35)):
        wall, cpu = (
            value(THIS_PROGRAM, key) / value(OPENSIM, key)
            for key in (f"{what} [s]", f"{what} CPU [s]")
        )
        yield Aim(f"{what} over OpenSim's", bound, wall, cpu)
    for name, text, bound in (
        (SIMULATION, "process of `mover simulate prototype --stop 2 -o`, second [s]", 1.5),
        (COMPILATION, "first compilation, `mover warm-up` [s]", 8.0),
    ):
        yield Aim(text, bound, value(name, "process [s]"), value(name, "process CPU [s]"))


def measured() -> list[tables.Row]:
    """Rows of the table."""
    names = [n for n in IMPORTS if n != "Drake" or find_spec("pydrake") is not None]
    best: dict[str, dict[str, float]] = {name: {} for name in names}

    def keep(name: str, found: Mapping[str, float]) -> None:
        for key, value in found.items():
            best[name][key] = min(best[name].get(key, value), value)

    empty = [run_python(["-c", "pass"]) for _ in range(ROUNDS)]
    wall, cpu = (min(getattr(spent, key) for spent in empty) for key in ("wall", "cpu"))
    for _ in range(ROUNDS):
        for name in names:
            spent = run_python(["-c", IMPORTS[name]])
            keep(name, {"import [s]": spent.wall - wall, "import CPU [s]": spent.cpu - cpu})
            if name not in ("Exudyn alone", "this program, Exudyn's integrator"):
                child = run_python(["-m", "benchmarks.child", name])
                keep(name, json.loads(child.output.splitlines()[-1]))
    for name, spent in ((SIMULATION, simulation()), (COMPILATION, compilation())):
        best[name] = {"process [s]": spent.wall, "process CPU [s]": spent.cpu}
    keys = [f"{what}{cpu} [s]" for what in ("import", "build", "process") for cpu in ("", " CPU")]
    keys.append("peak memory [MB]")
    return [
        {"engine": name, **{key: found.get(key, nan) for key in keys}}
        for name, found in best.items()
    ]


def simulation() -> Spent:
    """`mover simulate prototype --stop 2 -o fall.action`, the best after the first."""
    with tempfile.TemporaryDirectory() as folder:
        target = str(Path(folder) / "fall.action")
        command = ["-m", "generator.cli", "simulate", "prototype", "--stop", "2", "-o", target]
        run_python(command)
        found = []
        for _ in range(ROUNDS):
            Path(target).unlink()
            found.append(run_python(command))
    return Spent(min(one.wall for one in found), min(one.cpu for one in found), found[0].output)


def compilation() -> Spent:
    """`mover warm-up` with an empty folder of compiled code."""
    with tempfile.TemporaryDirectory() as folder:
        return run_python(["-m", "generator.cli", "warm-up"], {"XDG_CACHE_HOME": folder})


def run_python(arguments: list[str], environment: Mapping[str, str] | None = None) -> Spent:
    """Run Python in a process of its own, and wait for it."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    done = subprocess.run(
        [sys.executable, *arguments],
        check=True,
        capture_output=True,
        text=True,
        env={**ENVIRONMENT, **(environment or {})},
    )
    wall = time.perf_counter() - begun
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return Spent(wall, cpu, done.stdout)
