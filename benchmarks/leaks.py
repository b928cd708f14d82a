"""Growth of the memory of one process over many steps, changes and runs.

    python -m benchmarks.leaks

Each kind of work is repeated once to fill caches, then the growth of the resident memory is
measured. More than `MAX_GROWTH` in all is a failure.
"""

import gc
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import cycle
from pathlib import Path

from benchmarks import tables
from generator import Figure, Plan, Stepper, read_figure, simulate
from generator.run_options import Integrator
from generator.simulation.preconditions import import_exudyn
from springs import AxisSpring, JointSprings, Linear, SpringSet

MAX_GROWTH = 50.0
"""Largest growth of the resident memory over all kinds of work [MB]."""

ADVANCES, REBUILDS, COMPARISONS, RUNS, IMPLICIT_RUNS = 10_000, 300, 100, 10_000, 1_000

_WARM_UP = 20
"""Repetitions before the memory is measured."""


def resident_memory() -> float:
    """Resident memory of this process [MB]."""
    status = Path("/proc/self/status").read_text(encoding="utf-8")
    lines = dict(line.split(":", 1) for line in status.splitlines())
    return float(lines["VmRSS"].split()[0]) / 1e3


def main() -> None:
    """Print the growth over each kind of work, and fail if it is too large."""
    pendulum = read_figure("pendulum")
    springs = SpringSet({name: _stiff(name, pendulum) for name in pendulum.joints})
    plan = Plan(stop=0.02, frame=0.01, springs=springs)
    implicit = replace(plan, integrator=Integrator.EXUDYN)
    prototype = Stepper(read_figure("prototype"))
    start = prototype.snapshot()
    changes = cycle(_changes(prototype))

    def advance() -> None:
        if prototype.time > 1.0:
            prototype.rewind(start)
        prototype.advance(1 / 60)

    works: list[tuple[str, Callable[[], object], int]] = [
        ("advances of the prototype", advance, ADVANCES),
        ("rebuilds of the prototype", lambda: next(changes)(), REBUILDS),
        ("comparisons with Exudyn", prototype.agreement_with_exudyn, COMPARISONS),
        ("runs of a pendulum", lambda: simulate(pendulum, plan), RUNS),
        ("runs by Exudyn's integrator", lambda: simulate(pendulum, implicit), IMPLICIT_RUNS),
    ]
    rows = [_growth(*work) for work in works]
    tables.show(rows)
    total = sum(float(str(row["growth [MB]"])) for row in rows)
    if total > MAX_GROWTH:
        sys.exit(f"the memory grew by {total:.3g} MB, more than {MAX_GROWTH:g} MB")


def _stiff(name: str, figure: Figure) -> JointSprings:
    """A linear spring about each axis of a joint."""
    axes = [axis.axis for axis in figure.joints[name].chain]
    return JointSprings(name, tuple(AxisSpring(axis, (Linear(1.0),)) for axis in axes))


def _changes(stepper: Stepper) -> list[Callable[[], object]]:
    """Changes that need other tables; the first follows the last."""
    springs, start = stepper.springs, stepper.snapshot()
    softer = springs.scaled(0.5, 0.5)
    return [
        partial(stepper.lock, "waist", "left_elbow"),
        partial(stepper.unlock, "waist", "left_elbow"),
        partial(stepper.set_springs, softer),
        partial(stepper.set_springs, springs),
        stepper.free_root,
        stepper.hold_root,
        partial(stepper.rewind, start),
    ]


def _growth(work: str, repeat: Callable[[], object], count: int) -> tables.Row:
    for _ in range(_WARM_UP):
        repeat()
    gc.collect()
    before, begun = resident_memory(), time.process_time()
    for _ in range(count):
        repeat()
    gc.collect()
    return {
        "work": work,
        "count": count,
        "growth [MB]": f"{resident_memory() - before:.2f}",
        "CPU [ms each]": f"{1e3 * (time.process_time() - begun) / count:.2f}",
    }


if __name__ == "__main__":
    import_exudyn()
    main()
