"""Joints hold for a minute: constraints on velocity level drift, but not far."""

import numpy as np
import pytest

from generator import read_figure
from generator.engine.plan import Plan
from generator.engine.simulate import simulate


@pytest.mark.slow
def test_the_prototype_s_joints_hold_for_a_minute() -> None:
    """It swings to rest in the first half of it; what has drifted by then stays."""
    run = simulate(read_figure("prototype"), Plan(stop=60.0, step=2e-3, frame=0.1))
    assert run.outcome.succeeded
    print("DR",run.constraint_drift, run.wall_time,np.max(np.abs(run.energy_balance-run.energy_balance[0])),np.ptp(run.energy["gravity"]), run.energy["kinetic"][[100,200,300,400,-1]],run.energy["dissipated"][-1])
    assert run.constraint_drift < 1e-3
    balance = run.energy_balance
    assert np.max(np.abs(balance - balance[0])) < 1.0
