"""Cost before the first step: imports, building the reference figure, and memory.

Run with `python -m benchmarks startup`. Each engine starts in a process of its own, which runs the
reference figure for a second. Memory is the peak of that process, with Python, numpy, SciPy and
this project's reader in it, which all of them use here ("reader alone" has nothing else); imports
are timed in processes that do nothing else. Best of several rounds in which all take turns.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping
from importlib.util import find_spec

from benchmarks import tables

COMMAND = "python -m benchmarks startup"

ROUNDS = 3

IMPORTS: Mapping[str, str] = {
    "this project": "from generator.simulation.import_exudyn import import_exudyn; "
    "import_exudyn(); import generator.simulation.run",
    "Exudyn alone": "import exudyn",
    "reader alone": "from generator.figure_file import read_figure",
    "MuJoCo": "import mujoco",
    "OpenSim": "import opensim",
    "Pinocchio": "import pinocchio",
    "Drake": "import pydrake.all",
}

ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
"""Environment of the processes. All engines are imported from bytecode, as installed ones are."""


def main() -> None:
    """Print the table and write it."""
    names = [n for n in IMPORTS if n != "Drake" or find_spec("pydrake") is not None]
    empty = min(_wall("pass") for _ in range(ROUNDS))
    best: dict[str, dict[str, float]] = {name: {} for name in names}
    for _ in range(ROUNDS):
        for name in names:
            found = {"import [s]": max(0.0, _wall(IMPORTS[name]) - empty)}
            if name != "Exudyn alone":
                found.update(_child(name))
            for key, value in found.items():
                best[name][key] = min(best[name].get(key, value), value)
    keys = ("import [s]", "build [s]", "peak memory [MB]")
    rows = [
        {"engine": name, **{key: best[name].get(key, float("nan")) for key in keys}}
        for name in names
    ]
    tables.show(rows)
    tables.write("startup", COMMAND, rows)


def _wall(code: str) -> float:
    """Of a Python process that does this [s]."""
    begun = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, env=ENVIRONMENT)
    return time.perf_counter() - begun


def _child(name: str) -> dict[str, float]:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.child", name],
        check=True,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
    )
    return json.loads(done.stdout.splitlines()[-1])
