"""The energy book: each kind by its definition."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from generator.recording import ENERGY_KINDS
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Joining, JointSprings, Linear, SpringSet
from tests.chains import BALL, SKEW, X, Y, Z, chain, one_body, row


def test_kinds() -> None:
    run = simulate(row(2), Plan(stop=0.1, step=1e-3))
    assert tuple(run.energy) == ENERGY_KINDS
    assert all(values.shape == run.times.shape for values in run.energy.values())


def test_kinetic_and_gravity_from_the_poses() -> None:
    """m v^2 / 2 + w I w / 2 and -m g . x, with slopes of the recorded poses."""
    figure = row(3, (BALL, chain("Rz")))
    gravity = (1.0, -8.0, 2.0)
    run = simulate(figure, Plan(stop=0.3, step=2.5e-4, frame=5e-3, gravity=gravity))
    kinetic, potential = np.zeros(run.times.size), np.zeros(run.times.size)
    for name, segment in figure.bodies.items():
        rotation = run.poses[name][:, :3, :3]
        centre = run.poses[name][:, :3, 3] + rotation @ segment.centre_of_mass
        velocity = make_interp_spline(run.times, centre, k=7).derivative(1)(run.times)
        rate = make_interp_spline(run.times, rotation.reshape(-1, 9), k=7).derivative(1)
        own = np.swapaxes(rotation, 1, 2) @ rate(run.times).reshape(-1, 3, 3)
        spin = np.stack([own[:, 2, 1], own[:, 0, 2], own[:, 1, 0]], axis=1)
        kinetic += 0.5 * segment.mass * np.sum(velocity**2, axis=1)
        kinetic += 0.5 * np.sum(np.array(segment.inertia) * spin**2, axis=1)
        potential -= segment.mass * centre @ np.array(gravity)
    assert np.max(np.abs(run.energy["kinetic"] - kinetic)[6:-6]) < 1e-4
    assert np.allclose(run.energy["gravity"], potential, atol=1e-9)


def test_the_springs_energy_at_the_start() -> None:
    axes = tuple(AxisSpring(a, (Linear(k, 0.1),)) for a, k in ((X, 4.0), (Y, 6.0), (Z, 8.0)))
    springs = SpringSet({"pin": JointSprings("pin", axes)}, Joining.CONSERVATIVE)
    run = simulate(one_body(BALL, (0.3, 0.2, 0.5)), Plan(stop=0.02, step=1e-3, springs=springs))
    r = run.rotation_vectors["pin"][0]
    expected = 0.5 * np.array([4.0, 6.0, 8.0]) @ (r - 0.1) ** 2
    assert run.energy["spring"][0] == pytest.approx(expected)


def test_a_hinge_s_energy_is_of_its_unwrapped_angle() -> None:
    springs = SpringSet({"pin": JointSprings("pin", (AxisSpring(SKEW, (Linear(3.0),)),))})
    run = simulate(one_body(chain("Rs"), (7.0,)), Plan(stop=0.02, step=1e-3, springs=springs))
    assert run.energy["spring"][0] == pytest.approx(1.5 * 49.0)


def test_the_balance_adds_up() -> None:
    run = simulate(row(2, stiff=5.0, damp=0.1), Plan(stop=0.3, step=5e-4))
    total = sum(run.energy[k] for k in ("kinetic", "gravity", "spring", "dissipated"))
    assert np.allclose(run.energy_balance, total - run.energy["work"])
    assert np.max(np.abs(run.energy_balance - run.energy_balance[0])) < 1e-3
