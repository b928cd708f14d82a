"""CPU time of runs that record only what a study measures, beside whole recordings.

    python -m benchmarks.lean

The variants take turns, and of each the least CPU time of several rounds counts. The last columns
are the parts of the comparison with Exudyn, which a lean recording keeps. The second table is the
growth of the resident memory over many lean runs.
"""

import gc
import time
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any
from unittest.mock import patch

from benchmarks import tables
from benchmarks.leaks import resident_memory
from benchmarks.outside import Clock
from generator import Figure, Plan, read_figure, simulate
from generator.contact.scene import Scene
from generator.recording import WHOLE_RECORDING, RecordingPart
from generator.simulation import compiled_run
from generator.simulation import run as run_module
from generator.simulation.preconditions import import_exudyn
from generator.springs_file.read import read_springs

VARIANTS: dict[str, tuple[Collection[RecordingPart], int]] = {
    "whole": (WHOLE_RECORDING, 1),
    "whole, 2 threads": (WHOLE_RECORDING, 2),
    "energy": ({RecordingPart.ENERGY}, 1),
    "contact": ({RecordingPart.CONTACT}, 1),
    "motion only": (frozenset(), 1),
    "motion only, 2 threads": (frozenset(), 2),
}
"""Parts and threads by variant."""

_WARM_UP = 20
"""Runs before the memory is measured."""


def main() -> None:
    """Print the tables."""
    pendulum, prototype, male = map(read_figure, ("pendulum", "prototype", "male50"))
    floor = Plan(stop=1.5, free_root=True, scene=Scene.floor(), height=0.02)
    runs = [
        ("pendulum 0.3 s", *_with_springs(pendulum, Plan(stop=0.3)), 15, 20, 2000),
        ("prototype 0.2 s", *_with_springs(prototype, Plan(stop=0.2)), 15, 10, 100),
        ("male50 on the floor 1.5 s", *_with_springs(male, floor), 3, 1, 0),
    ]
    times: list[tables.Row] = []
    memory: list[tables.Row] = []
    for name, figure, plan, rounds, repeats, long in runs:
        times.append({"run": name, **_cpu_times(figure, plan, rounds, repeats)})
        if long:
            memory.append({"run": name, "count": long, **_growth(figure, plan, long)})
    tables.show(times)
    tables.show(memory)


def _with_springs(figure: Figure, plan: Plan) -> tuple[Figure, Plan]:
    return figure, replace(plan, springs=read_springs(None, figure))


def _cpu_times(figure: Figure, plan: Plan, rounds: int, repeats: int) -> tables.Row:
    """Least CPU time of a run of each variant [ms], and parts of the leanest [%]."""
    works: dict[str, Callable[[], object]] = {
        name: _work(figure, plan, parts, threads) for name, (parts, threads) in VARIANTS.items()
    }
    best = dict.fromkeys(works, float("inf"))
    parts = float("inf"), 0.0, 0.0
    works["motion only"]()
    for _ in range(rounds):
        for name, work in works.items():
            best[name] = min(best[name], _cpu(work, repeats))
        parts = min(parts, _parts(works["motion only"], repeats))
    row: tables.Row = {f"{name} [ms]": f"{1e3 * value:.1f}" for name, value in best.items()}
    row["lean over whole"] = f"{best['motion only'] / best['whole']:.2f}"
    row["build of Exudyn's model [% of lean]"] = f"{100.0 * parts[1] / parts[0]:.0f}"
    row["comparison [% of lean]"] = f"{100.0 * parts[2] / parts[0]:.0f}"
    return row


def _work(
    figure: Figure, plan: Plan, parts: Collection[RecordingPart], threads: int
) -> Callable[[], object]:
    return lambda: simulate(figure, plan, record=parts, threads=threads)


def _cpu(work: Callable[[], object], repeats: int) -> float:
    """CPU time of a call [s]."""
    begun = time.process_time()
    for _ in range(repeats):
        work()
    return (time.process_time() - begun) / repeats


def _parts(work: Callable[[], object], repeats: int) -> tuple[float, float, float]:
    """CPU time of a call, of the build of Exudyn's model in it, and of the comparison [s]."""
    build, comparison = Clock(), Clock()
    with (
        patch.object(run_module, "build_exudyn", _with_clock(run_module.build_exudyn, build)),
        patch.object(
            compiled_run,
            "agreement_with_exudyn",
            _with_clock(compiled_run.agreement_with_exudyn, comparison),
        ),
    ):
        whole = _cpu(work, repeats)
    return whole, build.cpu / repeats, comparison.cpu / repeats


def _with_clock(function: Callable[..., Any], clock: Clock) -> Callable[..., Any]:
    def clocked(*values: Any, **named: Any) -> Any:
        with clock:
            return function(*values, **named)

    return clocked


def _growth(figure: Figure, plan: Plan, count: int) -> tables.Row:
    """Growth of the resident memory over lean runs [MB]."""
    work: Any = _work(figure, plan, frozenset(), 1)
    for _ in range(_WARM_UP):
        work()
    gc.collect()
    before = resident_memory()
    for _ in range(count):
        work()
    gc.collect()
    return {"growth [MB]": f"{resident_memory() - before:.2f}"}


if __name__ == "__main__":
    import_exudyn()
    main()
