"""The reference figure in one engine and a process of its own: `python -m benchmarks.child ENGINE`.

It prints as JSON how long building took and the peak of memory; `benchmarks.startup` calls it.
"""

import json
import sys
from pathlib import Path

from benchmarks import cases
from benchmarks.cases import Case
from benchmarks.outside import Clock


def this_program(case: Case) -> Clock:
    """Build and run; returns the time of building, as for the others below."""
    from generator.simulation.preconditions import import_exudyn

    import_exudyn()
    from benchmarks.engines import exudyn_engine

    springs = exudyn_engine.radial_springs(case.figure, case.radial)
    plan = exudyn_engine.plan_of(case.displacements, springs)
    spent = exudyn_engine.build_time(case.figure, plan)
    exudyn_engine.fall(case.figure, plan)
    return spent


def mujoco(case: Case) -> Clock:
    from benchmarks.engines.mujoco_engine import MuJoCo

    with Clock() as spent:
        engine = MuJoCo(case.tree, case.radial)
    engine.fall(cases.STOP, 1e-3, frame=None)
    return spent


def opensim(case: Case) -> Clock:
    from benchmarks.engines.opensim_engine import OpenSim

    with Clock() as spent:
        engine = OpenSim(case.tree, case.radial)
    engine.fall(cases.STOP, 1e-3)
    return spent


def pinocchio(case: Case) -> Clock:
    from benchmarks.engines.pinocchio_engine import Pinocchio
    from benchmarks.outside import fall

    with Clock() as spent:
        engine = Pinocchio(case.tree)
    fall(case.tree, case.law, engine, cases.STOP, 1e-4, None)
    return spent


def drake(case: Case) -> Clock:
    from benchmarks.engines.drake_engine import Drake

    with Clock() as spent:
        engine = Drake(case.tree, case.radial)
    engine.fall(cases.STOP, 1e-3)
    return spent


def reader_alone(case: Case) -> Clock:
    spent = Clock()
    spent.wall = spent.cpu = float("nan")
    return spent


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
    "this program": this_program,
    "MuJoCo": mujoco,
    "OpenSim": opensim,
    "Pinocchio": pinocchio,
    "Drake": drake,
}


if __name__ == "__main__":
    spent = ENGINES[sys.argv[1]](cases.reference())
    times = {"build [s]": spent.wall, "build CPU [s]": spent.cpu}
    print(json.dumps({**times, "peak memory [MB]": peak()}))
