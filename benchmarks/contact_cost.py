"""Cost of falls on a floor: `python -m benchmarks contact-cost`.

The prototype falls for two seconds, to 1e-3 rad with its estimate, the run from a disturbed start
and all that a recording holds. Times are the least of interleaved rounds. Exudyn's integrator takes
a minute, so it runs once, beside one more run of the compiled method.
"""

from collections.abc import Callable
from dataclasses import replace
from math import radians

from benchmarks import tables
from benchmarks.engines import exudyn_engine
from benchmarks.outside import Fall
from benchmarks.rounds import best_of
from generator.figure_file.read import read_figure
from generator.input_files.scene import read_scene
from generator.recording import Integrator
from generator.scene import Scene
from generator.simulation.plan import Plan

COMMAND = "python -m benchmarks contact-cost"

STOP = 2.0
ROUNDS = 7

_BENT = {name: (radians(20.0),) for name in ("left_knee", "right_knee")}
_STRIDE = {**_BENT, "left_hip_joint": (radians(9.0), 0.0, 0.0)}
_PUSH = {"lower_torso": (0.0, 0.0, 0.0, 0.0, 0.0, -1.4)}
FLOOR = Scene.floor()
SEAT = Scene((*FLOOR.props, *read_scene("seat").props))


def plan_of(scene: Scene, start: dict[str, tuple[float, ...]]) -> Plan:
    """Return a fall of two seconds."""
    return Plan(stop=STOP, free_root=True, height=0.0, scene=scene, displacements=start)


def main() -> None:
    """Print the table and write it."""
    figure = read_figure("prototype")
    plans = {
        "floor, knees bent 20 deg": plan_of(FLOOR, _BENT),
        "floor, a hip bent 9 deg as well": plan_of(FLOOR, _STRIDE),
        "the same, with self-contact": replace(plan_of(FLOOR, _STRIDE), self_contact=True),
        "easy chair, pushed by 1.4 m/s": replace(plan_of(SEAT, {}), velocities=_PUSH),
    }
    runs: dict[tuple[str, str], Callable[[], Fall]] = {}
    for name, plan in plans.items():
        runs[name, "compiled"] = lambda plan=plan: exudyn_engine.fall(figure, plan)[0]
        runs[name, "compiled, whole call"] = lambda plan=plan: exudyn_engine.whole_call(
            figure, plan
        )
    made = best_of(runs, ROUNDS)
    name, plan = next(iter(plans.items()))
    slow = replace(plan, integrator=Integrator.EXUDYN)
    made[name, "Exudyn's integrator"] = exudyn_engine.whole_call(figure, slow)
    rows = [
        {
            "fall": fall,
            "method": method,
            "steps": run.evaluations,
            "wall [s]": run.wall,
            "CPU [s]": run.cpu,
            "times real time": STOP / run.wall,
            "over compiled": run.wall / made[fall, "compiled, whole call"].wall,
        }
        for (fall, method), run in made.items()
    ]
    tables.show(rows)
    tables.write("contact_cost", COMMAND, rows)
