"""Pendulums against an independent integration of their one equation of motion."""

import numpy as np
import pytest

from generator.figure import AxisKind, JointAxis
from generator.rotations import matrix_from_axis_angle, matrix_from_xyz
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Cubic, Damping, SpringSet
from tests.chains import SKEW, X, Z, at, body, chain, figure, ground, joint, negative, one_body
from tests.runs import integrate_angle, springs_of

NONE = SpringSet()
GRAVITY = np.array([0.0, -9.81, 0.0])


def compound(axis, mass, inertia, centre):
    """Inertia about a unit axis through the pin [kg m2], and gravity's torque about it (angle)."""
    centre, axis = np.asarray(centre), np.asarray(axis)
    across = centre - (centre @ axis) * axis
    about = axis**2 @ np.asarray(inertia) + mass * across @ across

    def torque(angle: float) -> float:
        arm = matrix_from_axis_angle(axis, angle) @ centre
        return float(axis @ np.cross(arm, mass * GRAVITY))

    return about, torque


@pytest.mark.parametrize("axis", [Z, X, negative(Z), SKEW, negative(SKEW)])
def test_a_compound_hinge_about_any_axis(axis) -> None:
    """At the tolerance 1e-6 the angle is within 1e-6 of the closed equation's, over 2 s."""
    link = body("link")
    about, torque = compound(axis, link.mass, link.inertia, link.centre_of_mass)
    plan = Plan(stop=2.0, tolerance=1e-6, springs=NONE, velocities={"pin": (1.5,)})
    run = simulate(one_body((JointAxis(AxisKind.ROTATION, axis),), (0.9,), link), plan)
    angle, rate = integrate_angle(lambda a, _: torque(a) / about, 0.9, 1.5, run.times)
    assert np.max(np.abs(run.displacements["pin"][:, 0] - angle)) < 1e-6
    assert np.max(np.abs(run.velocities["pin"][:, 0] - rate)) < 1e-5
    assert run.accuracy.estimate is not None
    assert run.accuracy.estimate <= 1e-6


def test_a_hinge_on_turned_sites() -> None:
    """The sites' own axes and places count: a turned base, a hinge off the segment's origin."""
    turn, place = (0.4, -0.7, 0.3), (0.05, 0.1, -0.02)
    link = body("link", sites={"hinge": at(turn, place)})
    made = figure(
        [ground(bracket=at((0.2, 0.5, -0.3), (1.0, 2.0, 3.0))), link],
        [joint("pin", "ground.bracket", "link.hinge", chain("Ry"), (0.4,))],
    )
    run = simulate(made, Plan(stop=1.0, tolerance=1e-6, springs=NONE))

    base, own = matrix_from_xyz(0.2, 0.5, -0.3), matrix_from_xyz(*turn)
    axis = base[:, 1]
    rotation = base @ matrix_from_axis_angle([0.0, 1.0, 0.0], 0.0) @ own.T
    arm = link.centre_of_mass - np.array(place)
    inertia = np.diag(link.inertia) + link.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    about = axis @ rotation @ inertia @ rotation.T @ axis

    def acceleration(angle, _):
        out = matrix_from_axis_angle(axis, angle) @ rotation @ arm
        return float(axis @ np.cross(out, link.mass * GRAVITY)) / about

    angle, _ = integrate_angle(acceleration, 0.4, 0.0, run.times)
    assert np.max(np.abs(run.displacements["pin"][:, 0] - angle)) < 1e-6


def test_a_hinge_with_a_cubic_and_damping() -> None:
    """The project's own law on the hinge, dead zone and all, to 1e-6 at the tolerance 1e-6."""
    axis = negative(SKEW)
    law = Cubic((0.0, 8.0, 2.0, 20.0), dead_zone=(-0.2, 0.3))
    damping = Damping(0.08, 0.05, 0.05)
    link = body("link")
    about, torque = compound(axis, link.mass, link.inertia, link.centre_of_mass)

    def acceleration(angle, rate):
        passive = float(law.torque(angle)) - 0.08 * rate - 0.05 * np.tanh(rate / 0.05)
        return (torque(angle) + passive) / about

    springs = springs_of("pin", AxisSpring(axis, (law,), damping))
    run = simulate(
        one_body((JointAxis(AxisKind.ROTATION, axis),), (1.1,), link),
        Plan(stop=1.0, tolerance=1e-6, springs=springs),
    )
    angle, rate = integrate_angle(acceleration, 1.1, 0.0, run.times)
    assert np.max(np.abs(run.displacements["pin"][:, 0] - angle)) < 1e-6
    expected = law.torque(angle) - 0.08 * rate - 0.05 * np.tanh(rate / 0.05)
    assert np.allclose(run.passive_torques["pin"], expected[:, None] * np.array(axis), atol=1e-4)


def test_reaction_of_a_swinging_point() -> None:
    """Along the bar: weight's part and the centripetal force (a plane pendulum, slender bar)."""
    link = body("link", mass=2.0, centre=(0.0, -0.5, 0.0), inertia=(0.04, 1e-3, 0.04))
    run = simulate(
        one_body(chain("Rz"), (1.0,), link), Plan(stop=0.5, tolerance=1e-6, springs=NONE)
    )
    angle, rate = run.displacements["pin"][:, 0], run.velocities["pin"][:, 0]
    inward = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    pull = np.sum(run.reactions["pin"][:, :2] * inward, axis=1)
    assert np.allclose(pull, 2.0 * (9.81 * np.cos(angle) + 0.5 * rate**2), atol=1e-4)
