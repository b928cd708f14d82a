"""Share of a run outside Exudyn's compiled solver.

Run with `python -m benchmarks python-share`. The solver's one entry, `SolveSystem`, is wrapped by a
clock; springs are expression trees, so it calls nothing of Python's. What remains of the wall of
`simulate` is Python's, with calls of Exudyn that only read or build.
"""

import time
from collections.abc import Mapping
from typing import Any

from benchmarks import cases, tables
from benchmarks.cases import Case
from benchmarks.engines import exudyn_engine
from generator.simulation.exudyn_api import exu
from generator.simulation.plan import Plan
from generator.simulation.run import simulate

COMMAND = "python -m benchmarks python-share"

ROUNDS = 5


def main() -> None:
    """Print the table and write it."""
    rows: list[tables.Row] = []
    reference = cases.reference()
    springs = exudyn_engine.radial_springs(reference.figure, reference.radial)
    own = cases.prototype("striding")
    for name, case, given in (("reference", reference, springs), ("prototype", own, None)):
        for method, settings in (
            ("tolerance 1e-3", {"tolerance": 1e-3}),
            ("tolerance 1e-5", {"tolerance": 1e-5}),
            ("step 1 ms", {"step": 1e-3}),
        ):
            plan = exudyn_engine.plan_of(case.displacements, given, **settings)
            rows.append({"figure": name, "run": method, **_best(case, plan)})
    tables.show(rows)
    tables.write("python_share", COMMAND, rows)


def _best(case: Case, plan: Plan) -> Mapping[str, float]:
    """Of the round with the smallest share."""
    found = [_clocked(case, plan) for _ in range(ROUNDS)]
    return min(found, key=lambda one: one["outside the solver"])


def _clocked(case: Case, plan: Plan) -> Mapping[str, float]:
    solver: Any = exu.MainSolverImplicitSecondOrder
    inner, spent = solver.SolveSystem, [0.0]

    def clocked(*given: Any) -> Any:
        begun = time.perf_counter()
        try:
            return inner(*given)
        finally:
            spent[0] += time.perf_counter() - begun

    solver.SolveSystem = clocked
    try:
        begun = time.perf_counter()
        recording = simulate(case.figure, plan)
        wall = time.perf_counter() - begun
    finally:
        solver.SolveSystem = inner
    if not spent[0]:
        raise RuntimeError("the solver's entry has another name in this Exudyn")
    return {
        "wall [s]": wall,
        "stepping [s]": recording.wall_time,
        "building [s]": recording.build_time,
        "solver [s]": spent[0],
        "outside the solver": 1.0 - spent[0] / wall,
        "of stepping": 1.0 - spent[0] / recording.wall_time,
    }
