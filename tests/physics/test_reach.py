"""Runs with a reach: both integrators, energy, throws through 180 deg, disturbed persons."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from generator import read_figure
from generator.model import Model
from generator.simulation.plan import Integrator, Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Damping, JointSprings, SpringSet
from tests.chains import BALL, X, body, one_body
from tests.springs.test_reach import ARM

SPRINGS = SpringSet({"pin": JointSprings("pin", (AxisSpring(X, (), Damping(0.02)),), reach=ARM)})
LIMP = SpringSet({"pin": JointSprings("pin", reach=ARM)})
LINK = body("link", centre=(0.02, 0.01, 0.2))


def test_both_integrators_agree():
    figure = one_body(BALL, (0.3, 0.4, -0.2), LINK)
    plan = Plan(stop=0.2, tolerance=1e-5, velocities={"pin": (2.0, -3.0, 4.0)})
    compiled = simulate(Model(figure, SPRINGS), plan)
    stepped = simulate(
        Model(figure, SPRINGS), replace(plan, step=2e-3, integrator=Integrator.EXUDYN)
    )
    assert compiled.agreement_with_exudyn is not None
    assert compiled.agreement_with_exudyn < 1e-10
    assert compiled.displacements["pin"] == pytest.approx(stepped.displacements["pin"], abs=1e-4)


def test_a_tumbling_limb_keeps_its_energy():
    figure = one_body(BALL, (0.3, 0.4, -0.2), LINK)
    plan = Plan(stop=1.0, tolerance=1e-10, velocities={"pin": (8.0, -3.0, 4.0)})
    run = simulate(Model(figure, LIMP), plan)
    assert np.max(run.energy["spring"]) > 1.0
    assert np.ptp(run.energy_balance) < 1e-8


@pytest.mark.parametrize(
    ("side", "rates"),
    [("left", (0.0, 9.0, 9.0)), ("right", (2.0, 14.0, 0.0)), ("left", (-4.0, 3.0, 14.0))],
)
def test_arms_are_thrown_through_180_deg(side, rates):
    """No run ends where the rotation of a shoulder passes half a turn, or its chain a pole."""
    figure = read_figure("male50")
    plan = Plan(
        stop=0.6,
        velocities={f"{side}_shoulder": rates},
        displacements={f"{side}_elbow": (0.0, radians(20.0))},
    )
    run = simulate(figure, plan)
    assert run.outcome.succeeded
    moved = np.linalg.norm(run.rotation_vectors[f"{side}_shoulder"], axis=-1)
    assert moved.max() > radians(100.0)
