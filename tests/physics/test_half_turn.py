"""A joint driven through 180 deg, where its rotation vector flips: an outcome, never a hang."""

import numpy as np
import pytest

from generator.recording import Ending
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, JointSprings, Linear, SphericalLaw, SpringSet
from tests.chains import BALL, X, Y, Z, body, chain, one_body
from tests.runs import springs_of

SOFT = tuple(AxisSpring(axis, (Linear(0.5),)) for axis in (X, Y, Z))
STIFF = tuple(AxisSpring(axis, (Linear(60.0),)) for axis in (X, Y, Z))


@pytest.mark.parametrize(
    ("given", "law", "axes"),
    [
        ({"step": 1e-3}, SphericalLaw.CONSERVATIVE, STIFF),
        ({"step": 5e-3}, SphericalLaw.WEIGHTED, SOFT),
        ({}, SphericalLaw.CONSERVATIVE, SOFT),
        ({}, SphericalLaw.WEIGHTED, STIFF),
    ],
)
def test_a_ball_driven_through_half_a_turn(given, law, axes) -> None:
    link = body("link", centre=(0.0, -0.05, 0.0), inertia=(0.03, 0.03, 0.03))
    springs = SpringSet({"pin": JointSprings("pin", axes)}, law)
    speed = 20.0 if axes is SOFT else 200.0
    plan = Plan(
        stop=2.0,
        springs=springs,
        velocities={"pin": (speed, 0.1 * speed, 0.0)},
        wall_limit=300.0,  # a hang ends as TOO_LONG
        **given,
    )
    run = simulate(one_body(BALL, (0.1, 0.0, 0.0), link), plan)
    assert run.outcome.ending is Ending.TURNED_OVER
    assert run.outcome.joint == "pin"
    assert "pin" in run.outcome.message
    assert "180 deg" in run.outcome.message
    # The frames before are good: none is beyond the flip.
    angles = np.linalg.norm(run.rotation_vectors["pin"], axis=1)
    assert run.outcome.last_time == run.times[-1]
    assert run.outcome.last_time < 1.3 * np.pi / speed + 0.05
    assert np.all(np.diff(angles) > -0.5)


def test_a_ball_without_springs_may_turn_over() -> None:
    link = body("link", centre=(0.0, 0.0, 0.0), inertia=(0.03, 0.03, 0.03))
    velocities = {"pin": (20.0, 0.0, 0.0)}
    plan = Plan(stop=1.0, springs=SpringSet(), velocities=velocities, tolerance=1e-5)
    run = simulate(one_body(BALL, (0.1, 0.0, 0.0), link), plan)
    assert run.outcome.succeeded
    assert run.displacements["pin"][-1, 0] == pytest.approx(20.1, abs=1e-4)


def test_a_hinge_with_a_spring_may_go_round() -> None:
    """Revolute springs use the unwrapped angle."""
    link = body("link", centre=(0.0, 0.0, 0.0), inertia=(0.03, 0.03, 0.03))
    springs = springs_of("pin", AxisSpring(Z, (Linear(0.01),)))
    plan = Plan(stop=1.0, springs=springs, velocities={"pin": (20.0,)}, tolerance=1e-6)
    run = simulate(one_body(chain("Rz"), (0.0,), link), plan)
    assert run.outcome.succeeded
    frequency = np.sqrt(0.01 / 0.03)
    expected = 20.0 / frequency * np.sin(frequency * run.times)
    assert np.max(np.abs(run.displacements["pin"][:, 0] - expected)) < 1e-6
