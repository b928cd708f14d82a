"""Joints hold for long: constraints on velocity level drift, but not far."""

import numpy as np
import pytest

from generator import read_figure
from generator.simulation.plan import Plan
from generator.simulation.run import simulate


@pytest.mark.slow
def test_the_prototype_s_joints_hold_for_four_seconds() -> None:
    """It falls and swings; without any correction the sites part."""
    run = simulate(read_figure("prototype"), Plan(stop=4.0, step=2e-3, frame=0.1))
    assert run.outcome.succeeded
    assert run.constraint_drift < 3e-4
    assert np.ptp(run.energy_balance) < 2e-3 * np.ptp(run.energy["gravity"])
