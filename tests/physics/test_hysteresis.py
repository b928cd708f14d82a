"""Joints that resist differently as their angle grows and as it falls, in motion."""

import numpy as np
import pytest

from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Damping, JointSprings, Linear, SphericalLaw, SpringSet
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from tests.chains import BALL, SKEW, X, Y, Z, body, chain, one_body
from tests.runs import energy_error

MEAN = Exponential((ExponentialTerm(0.6, -1.5), ExponentialTerm(-0.6, 1.5)))
LAW = Hysteresis.from_mean_and_width(MEAN, 0.3, slip=0.05)

WHEEL = body("link", centre=(0.0, 0.0, 0.0), inertia=(0.03, 0.03, 0.03))
STILL = (0.0, 0.0, 0.0)


def swing(axes, factors, start, law=SphericalLaw.CONSERVATIVE, slides=(), **plan):
    springs = SpringSet({"pin": JointSprings("pin", axes, slides)}, law)
    plan = {"stop": 3.0, "step": 5e-4, "gravity": STILL, **plan}
    return simulate(one_body(factors, start, WHEEL), Plan(springs=springs, **plan))


def travelled_loss(values) -> float:
    """The loss of the law over the way there and back that the angle took."""
    low, high = np.minimum(values[1:], values[:-1]), np.maximum(values[1:], values[:-1])
    return float(sum(0.5 * LAW.cycle_loss(a, b) for a, b in zip(low, high, strict=True)))


@pytest.mark.parametrize(("direction", "python"), [(Z, True), ((0.0, 0.0, -1.0), False)])
def test_a_hinge_loses_what_lies_between_the_curves(direction, python) -> None:
    law = LAW if direction == Z else LAW.mirrored()
    run = swing((AxisSpring(direction, (law,)),), chain("Rz"), (1.2,), python_torques=python)
    angle = run.displacements["pin"][:, 0]
    lost = run.energy["dissipated"][-1]
    assert np.count_nonzero(np.diff(np.sign(np.diff(angle)))) >= 2
    assert lost == pytest.approx(travelled_loss(angle), rel=0.05)
    assert lost > 0.4
    assert energy_error(run) < 1e-5


@pytest.mark.parametrize("law", list(SphericalLaw))
def test_a_ball_loses_the_same_about_one_of_its_axes(law) -> None:
    axes = tuple(AxisSpring(a, (LAW if a is Y else Linear(3.0),)) for a in (X, Y, Z))
    hinge = swing((AxisSpring(Y, (LAW,)),), chain("Ry"), (1.2,))
    ball = swing(axes, BALL, (0.0, 1.2, 0.0), law)
    assert np.allclose(ball.displacements["pin"][:, 1], hinge.displacements["pin"][:, 0], atol=1e-4)
    for kind in ("dissipated", "spring"):
        change = [run.energy[kind] - run.energy[kind][0] for run in (ball, hinge)]
        assert np.allclose(*change, atol=1e-4)
    assert np.allclose(ball.passive_torques["pin"], hinge.passive_torques["pin"], atol=1e-3)


def test_a_ball_turned_about_all_axes_closes_its_book() -> None:
    axes = tuple(AxisSpring(a, (LAW,), Damping(0.01)) for a in (X, Y, Z))
    run = swing(axes, BALL, (0.5, -0.4, 0.9), velocities={"pin": (2.0, 1.0, -3.0)}, stop=1.0)
    assert run.energy["dissipated"][-1] > 0.1
    assert np.all(np.diff(run.energy["dissipated"]) > 0.0)
    assert energy_error(run) < 1e-4


def test_a_slide_loses_too() -> None:
    law = Hysteresis.from_mean_and_width(Linear(40.0), 2.0, slip=0.05)
    run = swing((), chain("Ts"), (0.3,), slides=(AxisSpring(SKEW, (law,)),), stop=2.0)
    place = run.displacements["pin"][:, 0]
    assert run.energy["dissipated"][-1] == pytest.approx(np.sum(np.abs(np.diff(place))), rel=0.05)
    assert energy_error(run) < 1e-5


def test_a_slow_cycle_loses_the_law_s_loss() -> None:
    """Led round slowly by a strong spring that oscillates: once there and back."""
    law = Hysteresis.from_mean_and_width(Linear(0.5), 0.2, slip=1e-3)
    run = swing(
        (AxisSpring(Z, (law, Linear(5.0))),), chain("Rz"), (1.0,), stop=0.25 * 4.0, step=2.5e-4
    )
    angle = run.displacements["pin"][:, 0]
    turn = int(np.argmin(angle))
    there = run.energy["dissipated"][turn]
    assert there == pytest.approx(0.5 * law.cycle_loss(angle[turn], angle[0]), rel=0.02)
