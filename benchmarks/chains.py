"""Cost against the number of segments: chains of bars on spherical joints with linear springs.

Run with `python -m benchmarks chains`. 0.1 s, in steps of 1 ms or to an accuracy of 1e-3, springs
and damping of each engine's own. Times are the best of several rounds in which all take turns. The
error is the largest angle of any joint at the end, against the compiled method at 1e-12: the
recursion of Pinocchio loses its digits on chains of more than 20 balls.
"""

import time
from collections.abc import Callable, Mapping
from math import nan
from typing import TypeVar

from benchmarks import cases, tables
from benchmarks.cases import Case
from benchmarks.engines import exudyn_engine, mujoco_engine, opensim_engine
from benchmarks.outside import Fall
from benchmarks.rounds import best_of
from benchmarks.work_precision import last_error
from generator.simulation.plan import Plan

COMMAND = "python -m benchmarks chains"

COUNTS = (5, 10, 20, 40, 80, 160)

STOP, STEP, ACCURACY = 0.1, 1e-3, 1e-3

TRUTH_TOLERANCE = 1e-12
"""Of the run against which errors are measured [rad]."""

ROUNDS = 9

Made = TypeVar("Made")


def main() -> None:
    """Print the table and write it."""
    runs: dict[tuple[int, str], Callable[[], Fall]] = {}
    builds: dict[tuple[int, str], float] = {}
    truths: dict[int, Fall] = {}
    for count in COUNTS:
        case = cases.chain(count)
        of_case, of_builds = _runs(case)
        runs.update({(count, name): run for name, run in of_case.items()})
        builds.update({(count, name): seconds for name, seconds in of_builds.items()})
        truths[count] = exact(case)
    made = best_of(runs, ROUNDS)
    rows: list[tables.Row] = []
    for (count, name), run in made.items():
        before = made.get((count // 2, name))
        rows.append(
            {
                "method": name,
                "segments": count,
                "error [rad]": last_error(truths[count], run),
                "wall [s]": run.wall,
                "CPU [s]": run.cpu,
                "over half as many": run.wall / before.wall if before else nan,
                "build [s]": builds[count, name],
            }
        )
    tables.show(rows)
    tables.write("chains", COMMAND, rows)


def plan_of(case: Case, **given: float) -> Plan:
    """Plan of a chain's run by the compiled method; `given` are fields of the plan."""
    springs = exudyn_engine.radial_springs(case.figure, case.radial)
    return exudyn_engine.plan_of(case.displacements, springs, stop=STOP, **given)


def exact(case: Case) -> Fall:
    """The motion against which errors are measured."""
    return exudyn_engine.fall(case.figure, plan_of(case, tolerance=TRUTH_TOLERANCE))[0]


def _runs(case: Case) -> tuple[Mapping[str, Callable[[], Fall]], dict[str, float]]:
    """Return the function that runs the chain by each method, and the time to build it [s]."""
    law, figure, ours = case.radial, case.figure, exudyn_engine.NAME
    builds: dict[str, float] = {}

    def built(name: str, make: Callable[[], Made]) -> Made:
        begun = time.perf_counter()
        made = make()
        builds[name] = time.perf_counter() - begun
        return made

    springs = exudyn_engine.radial_springs(figure, law)
    plan = plan_of(case, tolerance=ACCURACY)
    implicit = exudyn_engine.exudyn_plan_of(case.displacements, springs, stop=STOP, step=STEP)
    runs: dict[str, Callable[[], Fall]] = {
        f"{ours}, {exudyn_engine.COMPILED}": lambda: exudyn_engine.fall(figure, plan)[0],
        f"{ours}, {exudyn_engine.ONE_RUN}": lambda: exudyn_engine.one_run(figure, plan),
        f"{ours}, {exudyn_engine.EXUDYN_STEP}": lambda: exudyn_engine.fall(figure, implicit)[0],
    }
    both = [exudyn_engine.build_time(figure, each).wall for each in (plan, implicit)]
    builds.update(zip(runs, (both[0], *both), strict=True))
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
