"""Cost against the number of segments: chains of bars on spherical joints with linear springs.

Run with `python -m benchmarks chains`. 0.1 s, in steps of 1 ms or to an accuracy of 1e-3, springs
and damping of each engine's own. Walls are the best of several rounds in which all take turns.
"""

import time
from collections.abc import Callable, Mapping
from math import inf, nan

from benchmarks import cases, tables
from benchmarks.cases import Case
from benchmarks.engines import exudyn_engine, mujoco_engine, opensim_engine
from benchmarks.outside import Fall

COMMAND = "python -m benchmarks chains"

COUNTS = (5, 10, 20, 40, 80, 160)

STOP, STEP, ACCURACY = 0.1, 1e-3, 1e-3

ROUNDS = 9


def main() -> None:
    """Print the table and write it."""
    runs: dict[int, Mapping[str, Callable[[], Fall]]] = {}
    builds: dict[int, dict[str, float]] = {}
    for count in COUNTS:
        runs[count], builds[count] = _runs(cases.chain(count))
    walls = {count: dict.fromkeys(runs[count], inf) for count in COUNTS}
    for _ in range(ROUNDS):
        for count in COUNTS:
            for name, run in runs[count].items():
                walls[count][name] = min(walls[count][name], run().wall)
    rows: list[tables.Row] = []
    for count in COUNTS:
        for name, seconds in walls[count].items():
            before = walls[count // 2][name] if count // 2 in walls else nan
            rows.append(
                {
                    "method": name,
                    "segments": count,
                    "wall [s]": seconds,
                    "over half as many": seconds / before,
                    "build [s]": builds[count][name],
                }
            )
    tables.show(rows)
    tables.write("chains", COMMAND, rows)


def _runs(case: Case) -> tuple[Mapping[str, Callable[[], Fall]], dict[str, float]]:
    """Return the function that runs the chain by each method, and the time to build it [s]."""
    law = case.radial
    builds: dict[str, float] = {}

    def built(name: str, make: Callable[[], object]) -> object:
        begun = time.perf_counter()
        made = make()
        builds[name] = time.perf_counter() - begun
        return made

    springs = exudyn_engine.radial_springs(case.figure, law)
    ours = "Exudyn, fixed step"
    plan = exudyn_engine.plan_of(case.displacements, springs, stop=STOP, step=STEP)
    builds[ours] = exudyn_engine.fall(case.figure, plan)[1].build_time
    runs: dict[str, Callable[[], Fall]] = {ours: lambda: exudyn_engine.fall(case.figure, plan)[0]}
    mujoco = built("MuJoCo, RK4", lambda: mujoco_engine.MuJoCo(case.tree, law))
    builds["MuJoCo, implicitfast"] = builds["MuJoCo, RK4"]
    for integrator in ("RK4", "implicitfast"):
        runs[f"MuJoCo, {integrator}"] = lambda i=integrator: mujoco.fall(STOP, STEP, i, None, None)
    name = "OpenSim, Runge-Kutta-Merson"
    opensim = built(name, lambda: opensim_engine.OpenSim(case.tree, law))
    runs[name] = lambda: opensim.fall(STOP, ACCURACY)
    try:
        from benchmarks.engines import drake_engine
    except ImportError:
        return runs, builds
    name = "Drake, Runge-Kutta 3"
    drake = built(name, lambda: drake_engine.Drake(case.tree, law))
    runs[name] = lambda: drake.fall(STOP, ACCURACY)
    return runs, builds
