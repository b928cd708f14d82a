"""Cost of falls on a floor: `python -m benchmarks contact-cost`.

The prototype falls for two seconds, to 1e-3 rad with its estimate, the run from a disturbed start
and all that a recording holds. Times are the least of interleaved rounds. Exudyn's integrator takes
a minute, so it runs once, beside one more run of the compiled method. A second table is the CPU
time for which a person among many boxes is built.
"""

from collections.abc import Callable
from dataclasses import replace
from math import radians
from time import process_time

from benchmarks import tables
from benchmarks.engines import exudyn_engine
from benchmarks.outside import Fall
from benchmarks.rounds import best_of
from generator.contact.box import Box
from generator.contact.scene import Prop, Scene
from generator.figure_file.read import read_figure
from generator.input_files.scene import read_scene
from generator.run_options import Integrator
from generator.simulation.compiled_run import compile_model
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from springs.contact import DEFAULT_SURFACE

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


PROP_COUNTS = (10, 100, 1000)


def boxes(count: int) -> Scene:
    """Return small boxes in rows, away from the figure, on a floor."""
    size = (0.1, 0.1, 0.1)
    shapes = (Box((2.0 + 0.5 * (k % 30), 0.1, 0.5 * (k // 30)), size) for k in range(count))
    props = (Prop(f"box {k}", shape, DEFAULT_SURFACE) for k, shape in enumerate(shapes))
    return Scene((*FLOOR.props, *props))


def building_times() -> list[dict[str, object]]:
    """Return the CPU time for which `male50` among boxes is built, for Exudyn and compiled."""
    figure = read_figure("male50")
    compile_model(build_model(figure, plan_of(boxes(1), {})))  # fits spheres, loads libraries
    rows: list[dict[str, object]] = []
    for count in PROP_COUNTS:
        began = process_time()
        model = build_model(figure, plan_of(boxes(count), {}))
        built = process_time()
        compile_model(model)
        compiled = process_time()
        rows.append({"boxes": count, "Exudyn [s]": built - began, "compiled [s]": compiled - built})
    return rows


def main() -> None:
    """Print the tables and write the first."""
    tables.show(building_times())
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
