"""The prototype with its own springs, 2 s at the default tolerance, without imports.

Run with `python -m benchmarks prototype`. Times are noisy; the ratios of one run are what counts.
The share of the springs is that of Exudyn's integrator, which calls their user functions.
"""

import platform
import time
from collections.abc import Mapping
from importlib.metadata import version
from unittest.mock import patch

import numpy as np

from benchmarks.engines import exudyn_engine
from benchmarks.rounds import best_of
from benchmarks.tree import between
from generator.figure import Figure
from generator.figure_file.read import read_figure
from generator.run_options import Integrator
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.exudyn_model.springs import SpringBuilder
from generator.simulation.exudyn_run import integrate
from generator.simulation.plan import Plan
from generator.simulation.trace import frame_times

STOP = 2.0

ROUNDS = 20

TRUTH_TOLERANCE = 1e-9
"""Of the compiled run against which errors are measured [rad]."""

EXUDYN_TOLERANCE = 1e-5
"""Of the run of Exudyn's integrator with which the motion is compared [rad]."""


def main() -> None:
    """Print the table."""
    figure, plan = read_figure("prototype"), Plan(stop=STOP)
    implicit = Plan(stop=STOP, integrator=Integrator.EXUDYN)
    fine = Plan(stop=STOP, integrator=Integrator.EXUDYN, tolerance=EXUDYN_TOLERANCE)
    print(f"Python {platform.python_version()}, Exudyn {version('exudyn')}, {platform.machine()}")
    made = best_of(
        {
            "compiled": lambda: exudyn_engine.fall(figure, plan)[0],
            "compiled, whole call": lambda: exudyn_engine.whole_call(figure, plan),
            "Exudyn's integrator": lambda: exudyn_engine.fall(figure, implicit)[0],
        },
        ROUNDS,
    )
    truth, _ = exudyn_engine.fall(figure, Plan(stop=STOP, tolerance=TRUTH_TOLERANCE))
    print(f"prototype, {STOP:g} s, tolerance 1e-3 rad:")
    for name, run in made.items():
        error = float(between(truth.rotations, run.rotations).max())
        print(
            f"  {name:<22} wall {1e3 * run.wall:7.1f} ms, {STOP / run.wall:5.1f} x real time; "
            f"CPU {1e3 * run.cpu:5.1f} ms; true error {error:.1e} rad"
        )
    other, _ = exudyn_engine.fall(figure, fine)
    apart = float(between(truth.rotations, other.rotations).max())
    print(f"  Exudyn's integrator at {EXUDYN_TOLERANCE:g} rad is {apart:.1e} rad from the truth")
    for name, seconds in shares(figure).items():
        print(f"  {name:<46} {1e6 * seconds:6.1f} us a step")


def shares(figure: Figure) -> Mapping[str, float]:
    """Time a step of Exudyn's integrator [s] with springs of several kinds.

    They are expression trees, Python functions, and connectors without functions at zero stiffness,
    whose law Exudyn has compiled in. The difference to these is the share of the functions.
    """
    trees = step_time(figure, Plan(stop=0.5))
    python = step_time(figure, Plan(stop=0.5, python_torques=True))
    with patch.object(SpringBuilder, "function", return_value=0):
        empty = step_time(figure, Plan(stop=0.5))
    print(
        f"  share of the expression trees in the stepping time: {1.0 - empty / trees:.0%}; "
        f"of Python functions in their place: {1.0 - empty / python:.0%}"
    )
    return {
        "springs as expression trees": trees,
        "springs as Python functions": python,
        "the same connectors without functions": empty,
    }


def step_time(figure: Figure, plan: Plan) -> float:
    """Best time a step of three runs at 0.5 ms [s]."""
    times = frame_times(plan.start, plan.stop, plan.frame)
    best = np.inf
    for _ in range(3):
        assembly = build_model(figure, plan)
        one = integrate(assembly, times, 5e-4, time.monotonic() + 600.0, lambda _: None)
        best = min(best, one.wall_time / one.steps)
    return float(best)
