"""The prototype, 2 s simulated at the default tolerance, on one core, without imports.

Run with `python -m benchmarks`. Times are of stepping only and noisy; the ratios of one run are
what counts. `__main__` loads Exudyn as the command does.
"""

import platform
import time
from collections.abc import Mapping
from importlib.metadata import version
from unittest.mock import patch

import numpy as np

from generator.figure import Figure
from generator.figure_file.read import read_figure
from generator.rotations import rotation_vector_from_matrix
from generator.simulation.error_control import richardson_extrapolation
from generator.simulation.integrate import IntegrationPass, frame_times, integrate
from generator.simulation.model import build_model
from generator.simulation.plan import Plan, resolve_springs
from generator.simulation.run import simulate
from generator.simulation.springs import SpringBuilder
from generator.simulation.step_schedule import StepHints

STOP = 2.0


def main() -> None:
    """Print the table."""
    figure = read_figure("prototype")
    print(f"Python {platform.python_version()}, Exudyn {version('exudyn')}, {platform.machine()}")
    wall = min(simulate(figure, Plan(stop=STOP)).wall_time for _ in range(3))
    recording = simulate(figure, Plan(stop=STOP))
    accuracy = recording.accuracy
    print(f"prototype, {STOP:g} s, tolerance 1e-3 rad: {wall:.2f} s of stepping (best of 3 runs)")
    print(
        f"  {STOP / wall:.2f} x real time; {accuracy.steps} steps in all passes, "
        f"finest {1e3 * accuracy.step:.3g} ms; build {1e3 * recording.build_time:.0f} ms"
    )
    print(
        f"  estimated error {accuracy.estimate:.1e} rad, "
        f"true error {true_error(figure):.1e} rad against passes of 1/8 and 1/16 ms"
    )
    for name, seconds in shares(figure).items():
        print(f"  {name:<46} {1e6 * seconds:6.1f} us a step")


def true_error(figure: Figure) -> float:
    """Largest error of a segment's orientation in the default run [rad], against a finer one."""
    plan = Plan(stop=STOP)
    springs = resolve_springs(figure, plan)
    times = frame_times(plan.start, plan.stop, plan.frame)

    def one_pass(parts: int, guide: StepHints | None, newton: float) -> IntegrationPass:
        assembly = build_model(figure, plan, springs)
        deadline = time.monotonic() + 600.0
        return integrate(assembly, times, 2e-3, newton, deadline, lambda _: None, guide, parts)

    scout = one_pass(8, None, 1e-9)
    coarse = one_pass(16, scout.step_hints, 1e-11)
    fine = one_pass(32, coarse.step_hints, 1e-11)
    reference = richardson_extrapolation(coarse.trace, fine.trace, coarse.step / fine.step)
    poses = simulate(figure, plan).poses
    turns = [
        np.swapaxes(poses[name][:, :3, :3], -1, -2) @ reference.rotations[:, k]
        for k, name in enumerate(figure.bodies)
    ]
    return float(np.max(np.linalg.norm(rotation_vector_from_matrix(np.array(turns)), axis=-1)))


def shares(figure: Figure) -> Mapping[str, float]:
    """Time a step [s] with springs as expression trees, as Python functions, and as built-in ones.

    The share of the user functions is the difference to the last: the same connectors without
    functions, at zero stiffness, whose law Exudyn has compiled in.
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
    springs = resolve_springs(figure, plan)
    times = frame_times(plan.start, plan.stop, plan.frame)
    best = np.inf
    for _ in range(3):
        assembly = build_model(figure, plan, springs)
        one = integrate(assembly, times, 5e-4, 1e-6, time.monotonic() + 600.0, lambda _: None)
        best = min(best, one.wall_time / one.steps)
    return float(best)
