"""Locked joints: they stay, and their reaction is the one of statics and of a rigid body."""

import numpy as np
import pytest

from generator.rotations import matrix_from_axis_angle
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Linear, SpringSet
from tests.chains import BALL, Z, at, body, chain, figure, ground, joint, one_body, row
from tests.runs import energy_error, integrate_angle, springs_of

NONE = SpringSet()

LOCKED = {
    "a hinge": (chain("Rz"), (0.7,)),
    "a hinge about a skew axis": (chain("Rs"), (-1.1,)),
    "a ball": (BALL, (0.5, -0.4, 0.9)),
    "two turns": (chain("Rx Ry"), (0.5, -0.4)),
    "a slide": (chain("Tx"), (0.3,)),
    "slides and a turn": (chain("Rz Tx Ty"), (0.5, 0.2, -0.3)),
    "slides inside a turn": (chain("Tx Ty Rz"), (0.2, -0.3, 0.5)),
}


@pytest.mark.parametrize("name", LOCKED)
def test_a_locked_joint_carries_the_weight(name) -> None:
    """Force and moment on the child at its site, in the parent's axes, as statics has them."""
    factors, start = LOCKED[name]
    link = body("link", sites={"hinge": at((-0.3, 0.9, 0.5), (0.02, 0.04, -0.03))})
    base = at((0.4, -0.7, 0.3), (0.1, 0.5, -0.2))
    made = figure(
        [ground(bracket=base), link],
        [joint("pin", "ground.bracket", "link.hinge", factors, start)],
    )
    run = simulate(made, Plan(stop=0.1, locked=("pin",), springs=NONE))
    assert run.outcome.succeeded
    assert np.max(np.abs(run.displacements["pin"] - start)) < 1e-12
    bracket = made.segments["ground"].sites["bracket"]
    turn = run.poses["ground"][0] @ bracket.pose_in_segment
    weight = turn[:3, :3].T @ np.array([0.0, -9.81 * link.mass, 0.0])
    pose = run.poses["link"][0]
    hinge = (pose @ made.segments["link"].sites["hinge"].pose_in_segment)[:3, 3]
    centre = pose[:3, :3] @ link.centre_of_mass + pose[:3, 3]
    arm = turn[:3, :3].T @ (centre - hinge)
    expected = np.concatenate([-weight, -np.cross(arm, weight)])
    assert np.max(np.abs(run.reactions["pin"] - expected)) < 1e-8


def test_a_locked_joint_carries_its_spring_as_well() -> None:
    """The spring pulls, and the lock holds against it."""
    springs = springs_of("pin", AxisSpring(Z, (Linear(3.0),)))
    plan = Plan(stop=0.1, locked=("pin",), gravity=(0.0, 0.0, 0.0))
    made = one_body(chain("Rz"), (0.8,))
    run = simulate(made, Plan(**{**vars(plan), "springs": springs}))
    assert np.max(np.abs(run.passive_torques["pin"][:, 2] + 2.4)) < 1e-9
    assert np.max(np.abs(run.reactions["pin"][:, 5] - 2.4)) < 1e-9


def test_two_bars_with_a_locked_joint_are_one_compound_pendulum() -> None:
    """Against the closed equation of the one angle that is left."""
    made = row(2, (chain("Rz"),), bend=0.6)
    start, bend = (made.joints[name].displacement[0] for name in ("joint0", "joint1"))
    plan = Plan(stop=1.5, locked=("joint1",), springs=NONE, tolerance=1e-7)
    run = simulate(made, plan)
    first, second = made.bodies.values()
    elbow = matrix_from_axis_angle(np.array(Z), bend)
    centres = [first.centre_of_mass, np.array([0.3, 0.0, 0.0]) + elbow @ second.centre_of_mass]
    about, moments = 0.0, np.zeros(3)
    for segment, centre in zip((first, second), centres, strict=True):
        about += segment.inertia[2] + segment.mass * (centre[0] ** 2 + centre[1] ** 2)
        moments += segment.mass * centre

    def acceleration(angle, _):
        x, _, _ = matrix_from_axis_angle(np.array(Z), angle) @ moments
        return -9.81 * x / about

    angle, _ = integrate_angle(acceleration, start, 0.0, run.times)
    assert np.max(np.abs(run.displacements["joint0"][:, 0] - angle)) < 1e-7
    assert np.max(np.abs(run.displacements["joint1"] - bend)) < 1e-12
    assert energy_error(run) < 1e-6


def test_all_joints_locked_is_a_statue() -> None:
    made = row(3, (BALL, chain("Rz")), bend=0.5)
    run = simulate(made, Plan(stop=0.2, locked=tuple(made.joints), springs=NONE))
    assert run.outcome.succeeded
    for pose in run.poses.values():
        assert np.max(np.abs(pose - pose[0])) < 1e-9
    weight = 9.81 * sum(segment.mass for segment in made.bodies.values())
    assert np.max(np.abs(run.reactions["joint0"][:, 1] - weight)) < 1e-7
