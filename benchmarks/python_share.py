"""Parts of the call of `simulate`, and the share of it outside the compiled runs.

Run with `python -m benchmarks python-share`. The parts are CPU times of the round in which the
call was the cheapest; the compiled runs are two at a time, in two threads.
"""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Any
from unittest.mock import patch

from benchmarks import cases, tables
from benchmarks.cases import Case
from benchmarks.engines import exudyn_engine
from benchmarks.outside import Clock
from generator.simulation import compiled_run
from generator.simulation import run as run_module
from generator.simulation.plan import Plan

COMMAND = "python -m benchmarks python-share"

ROUNDS = 15

PARTS = {
    "Exudyn's model": (run_module, "build_exudyn"),
    "equations": (compiled_run, "compile_model"),
    "compiled runs": (compiled_run, "run_until_agreed"),
    "recording": (run_module, "_build_recording"),
    "comparison with Exudyn": (compiled_run, "agreement_with_exudyn"),
}
"""Functions whose time is a part of the call."""


def main() -> None:
    """Print the table and write it."""
    rows: list[tables.Row] = []
    reference = cases.reference()
    springs = exudyn_engine.radial_springs(reference.figure, reference.radial)
    standing = cases.prototype("standing")
    for name, case, given, stop in (
        ("reference", reference, springs, cases.STOP),
        ("prototype", standing, None, 2.0),
    ):
        for tolerance in (1e-3, 1e-5):
            plan = exudyn_engine.plan_of(case.displacements, given, tolerance=tolerance, stop=stop)
            row = {"figure": name, "time [s]": stop, "tolerance [rad]": tolerance}
            rows.append({**row, **_best(case, plan)})
    tables.show(rows)
    tables.write("python_share", COMMAND, rows)


def _best(case: Case, plan: Plan) -> Mapping[str, float]:
    """Of the round with the smallest time."""
    return min((_clocked(case, plan) for _ in range(ROUNDS)), key=lambda row: row["CPU [ms]"])


def _clocked(case: Case, plan: Plan) -> Mapping[str, float]:
    clocks = {name: Clock() for name in PARTS}
    with ExitStack() as stack:
        for name, (module, function) in PARTS.items():
            clocked = _with_clock(getattr(module, function), clocks[name])
            stack.enter_context(patch.object(module, function, clocked))
        made = exudyn_engine.whole_call(case.figure, plan)
    if not all(clock.cpu for clock in clocks.values()):
        raise RuntimeError("a part of the call has another name now")
    parts = {f"{name} [ms]": 1e3 * clock.cpu for name, clock in clocks.items()}
    return {
        "wall [ms]": 1e3 * made.wall,
        "CPU [ms]": 1e3 * made.cpu,
        **parts,
        "outside the compiled runs": 1.0 - clocks["compiled runs"].cpu / made.cpu,
    }


def _with_clock(function: Callable[..., Any], clock: Clock) -> Callable[..., Any]:
    def clocked(*given: Any, **named: Any) -> Any:
        with clock:
            return function(*given, **named)

    return clocked
