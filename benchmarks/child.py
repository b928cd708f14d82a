"""The reference figure in one engine and a process of its own: `python -m benchmarks.child ENGINE`.

It prints as JSON how long building took and the peak of memory; `benchmarks.startup` calls it.
"""

import json
import sys
import time
from pathlib import Path

from benchmarks import cases
from benchmarks.cases import Case


def this_project(case: Case) -> float:
    """Build and run; returns the time of building [s], as for the others below."""
    from generator.simulation.import_exudyn import import_exudyn

    import_exudyn()
    from benchmarks.engines import exudyn_engine
    from generator.simulation.model import ExudynModel

    springs = exudyn_engine.radial_springs(case.figure, case.radial)
    plan = exudyn_engine.plan_of(case.displacements, springs)
    begun = time.perf_counter()
    ExudynModel.of(case.figure, plan)
    spent = time.perf_counter() - begun
    exudyn_engine.fall(case.figure, plan)
    return spent


def mujoco(case: Case) -> float:
    from benchmarks.engines.mujoco_engine import MuJoCo

    begun = time.perf_counter()
    engine = MuJoCo(case.tree, case.radial)
    spent = time.perf_counter() - begun
    engine.fall(cases.STOP, 1e-3, frame=None)
    return spent


def opensim(case: Case) -> float:
    from benchmarks.engines.opensim_engine import OpenSim

    begun = time.perf_counter()
    engine = OpenSim(case.tree, case.radial)
    spent = time.perf_counter() - begun
    engine.fall(cases.STOP, 1e-3)
    return spent


def pinocchio(case: Case) -> float:
    from benchmarks.engines.pinocchio_engine import Pinocchio
    from benchmarks.outside import fall

    begun = time.perf_counter()
    engine = Pinocchio(case.tree)
    spent = time.perf_counter() - begun
    fall(case.tree, case.law, engine, cases.STOP, 1e-4, None)
    return spent


def drake(case: Case) -> float:
    from benchmarks.engines.drake_engine import Drake

    begun = time.perf_counter()
    engine = Drake(case.tree, case.radial)
    spent = time.perf_counter() - begun
    engine.fall(cases.STOP, 1e-3)
    return spent


def reader_alone(case: Case) -> float:
    return float("nan")


def peak() -> float:
    """Peak memory of this process [MB]; nan where the system does not report it.

    `ru_maxrss` is not used, because it starts at the peak of the parent.
    """
    status = Path("/proc/self/status")
    if not status.exists():
        return float("nan")
    lines = dict(line.split(":", 1) for line in status.read_text(encoding="utf-8").splitlines())
    return float(lines["VmHWM"].split()[0]) / 1e3


ENGINES = {
    "reader alone": reader_alone,
    "this project": this_project,
    "MuJoCo": mujoco,
    "OpenSim": opensim,
    "Pinocchio": pinocchio,
    "Drake": drake,
}


if __name__ == "__main__":
    seconds = ENGINES[sys.argv[1]](cases.reference())
    print(json.dumps({"build [s]": seconds, "peak memory [MB]": peak()}))
