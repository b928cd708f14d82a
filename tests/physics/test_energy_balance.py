"""Energy over a fall of the prototype.

What is exchanged is the range of the potential energy (gravity and springs) over the run plus what
damping took.
"""

import numpy as np
import pytest

from generator import read_figure
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import SphericalLaw
from tests.chains import BALL, chain, row
from tests.runs import energy_error

PROTOTYPE = read_figure("prototype")


def exchanged(run) -> float:
    return float(
        np.ptp(run.energy["gravity"] + run.energy["spring"]) + run.energy["dissipated"][-1]
    )


def test_half_a_second_of_the_prototype() -> None:
    """Constant to 1e-4 of what is exchanged, with a fixed step of 0.5 ms."""
    plan = Plan(stop=0.5, step=5e-4, law=SphericalLaw.CONSERVATIVE)
    run = simulate(PROTOTYPE, plan)
    assert run.outcome.succeeded
    assert exchanged(run) > 20.0
    assert energy_error(run) < 1e-4 * exchanged(run)
    assert np.all(np.diff(run.energy["dissipated"]) > -1e-9)


@pytest.mark.parametrize("chains", [(BALL,), (chain("Rz"),), (BALL, chain("Rs Ra"))])
def test_a_row_with_springs_and_damping(chains) -> None:
    figure = row(3, chains, stiff=12.0, damp=0.02)
    run = simulate(figure, Plan(stop=0.4, step=5e-4))
    assert run.energy["dissipated"][-1] > 0.0
    assert np.ptp(run.energy["spring"]) > 0.0
    assert energy_error(run) < 1e-4 * exchanged(run)
