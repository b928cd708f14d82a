"""Joint angles converge with the order that the integrator has, and that extrapolation makes."""

from functools import cache
from itertools import pairwise

import numpy as np

from generator.simulation.exudyn_model.model import build_model
from generator.simulation.exudyn_run import (
    IntegrationPass,
    integrate,
    joint_differences,
    richardson_extrapolation,
)
from generator.simulation.plan import Plan
from generator.simulation.trace import frame_times
from tests.chains import BALL, chain, row

FIGURE = row(4, (BALL, chain("Ry")), stiff=5.0, damp=0.05)
"""Its springs have no corners."""

PLAN = Plan(stop=0.3)

LONGEST = 4e-3


@cache
def one_pass(parts: int) -> IntegrationPass:
    """With steps of 4 ms cut into so many."""
    assembly = build_model(FIGURE, PLAN)
    times = frame_times(PLAN.start, PLAN.stop, PLAN.frame)
    return integrate(assembly, times, LONGEST, np.inf, lambda _: None, subdivision=parts)


@cache
def truth():
    return richardson_extrapolation(one_pass(30).trace, one_pass(60).trace)


def order(errors: list[float]) -> list[float]:
    """Of the error in the step, by each halving."""
    return [float(np.log2(coarse / fine)) for coarse, fine in pairwise(errors)]


def test_a_pass_is_of_second_order() -> None:
    errors = [
        float(np.max(joint_differences(FIGURE, truth(), one_pass(n).trace))) for n in (1, 2, 4, 8)
    ]
    assert errors[-1] < 1e-4
    assert all(1.9 < found < 2.1 for found in order(errors)), errors


def test_two_extrapolated_passes_are_of_fourth_order() -> None:
    """The trapezoidal rule's error has even powers of the step only."""
    errors = []
    for n in (1, 2, 4):
        limit = richardson_extrapolation(one_pass(n).trace, one_pass(2 * n).trace)
        errors.append(float(np.max(joint_differences(FIGURE, truth(), limit))))
    assert errors[-1] < 1e-6
    assert all(3.7 < found < 4.3 for found in order(errors)), errors
