"""Linked joints in a simulation: they stay linked, and links do no work."""

from dataclasses import replace

import numpy as np
import pytest

from generator.drive import Drive
from generator.kinematics.links import Links
from generator.recording import Ending
from generator.run_options import Integrator
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet
from tests.chains import BALL, X, Y, Z, body, chain, figure, ground, joint, link, row
from tests.runs import energy_error, integrate_angle

NONE = SpringSet()


def two_pendulums(factors, one=0.9, other=0.0):
    """Two bodies that hang side by side, on joints `one` and `other`."""
    return figure(
        [
            ground(),
            body("first", 2.0, (0.03, 0.04, 0.05), (0.0, -0.3, 0.0)),
            body("second", 1.0, (0.02, 0.02, 0.03), (0.1, -0.2, 0.05)),
        ],
        [
            joint("one", "ground.base", "first.near", factors, np.atleast_1d(one)),
            joint("other", "ground.base", "second.near", factors, np.atleast_1d(other)),
        ],
    )


def test_three_chained_links_hold_to_1e_8() -> None:
    """Before the frames are put right."""
    made = row(5, (chain("Rz"),), bend=0.4)
    links = Links(
        (
            link("joint1", "joint0", 0.5, 0.1),
            link("joint2", "joint1", -2.0),
            link("joint3", "joint2", 0.7, -0.3),
        )
    )
    run = simulate(made, Plan(stop=0.5, links=links, springs=NONE, tolerance=1e-5))
    assert run.outcome.succeeded
    assert np.ptp(run.displacements["joint0"]) > 0.5
    assert 0.0 < run.prescribed_motion_drift < 1e-8


def test_links_do_no_work() -> None:
    """The book closes to the accuracy of the run, springs and damping included."""
    made = row(4, (BALL, chain("Rz")), bend=0.3)
    springs = SpringSet(
        {"joint2": JointSprings("joint2", tuple(AxisSpring(a, (Linear(2.0),)) for a in (X, Y, Z)))}
        | {"joint1": JointSprings("joint1", (AxisSpring(Z, (), Damping(0.05)),))}
    )
    links = Links(
        (
            link("joint1", "joint0 3", 0.8),
            link("joint2 1", "joint0 2", -0.6, 0.1),
            link("joint3", "joint1", 1.5),
        )
    )
    run = simulate(made, Plan(stop=0.4, links=links, springs=springs, tolerance=1e-5))
    assert run.outcome.succeeded
    assert np.ptp(run.energy["kinetic"]) > 0.5
    assert energy_error(run) < 1e-4 * np.max(run.energy["kinetic"])
    assert np.all(run.energy["work"] == 0.0)


@pytest.mark.parametrize("factor", [-0.5, 2.0])
def test_two_linked_pendulums_are_one(factor) -> None:
    """Against the closed equation of their one angle, and against what the link must pull."""
    made = two_pendulums(chain("Rz"))
    offset = 0.2
    links = Links((link("other", "one", factor, offset),))
    run = simulate(made, Plan(stop=0.8, links=links, springs=NONE, tolerance=1e-7))

    about, torques = [], []
    for name in ("first", "second"):
        segment = made.segments[name]
        x, y, _ = centre = segment.centre_of_mass
        about.append(segment.inertia[2] + segment.mass * (centre[0] ** 2 + centre[1] ** 2))
        torques.append(
            lambda a, m=segment.mass, x=x, y=y: -9.81 * m * (x * np.cos(a) - y * np.sin(a))
        )

    def acceleration(angle):
        pull = torques[0](angle) + factor * torques[1](factor * angle + offset)
        return pull / (about[0] + factor**2 * about[1])

    angle, _ = integrate_angle(lambda a, _: acceleration(a), 0.9, 0.0, run.times)
    assert np.max(np.abs(run.displacements["one"][:, 0] - angle)) < 1e-7
    pulled = factor * about[1] * acceleration(angle) - torques[1](factor * angle + offset)
    assert np.max(np.abs(run.reactions["other"][:, 5] - pulled)) < 1e-4
    assert np.max(np.abs(run.reactions["one"][:, 5] + factor * pulled)) < 1e-4


def test_links_of_what_moves_alike_pull_nothing() -> None:
    """Two equal spherical pendulums, linked whole, move as each would alone."""
    made = two_pendulums(BALL, (0.5, 0.3, 0.2), (0.5, 0.3, 0.2))
    first = made.segments["first"]
    twin = body("second", first.mass, first.inertia, (0.0, -0.3, 0.0))
    made = figure([made.segments["ground"], first, twin], list(made.joints.values()))
    links = Links(tuple(link(f"other {k}", f"one {k}") for k in (1, 2, 3)))
    rates = {"one": (0.5, 0.0, -0.4), "other": (0.5, 0.0, -0.4)}
    plan = Plan(stop=0.4, springs=NONE, tolerance=1e-6, velocities=rates)
    alone, linked = simulate(made, plan), simulate(made, Plan(**{**vars(plan), "links": links}))
    assert np.max(np.abs(alone.displacements["one"] - linked.displacements["one"])) < 2e-6
    assert np.max(np.abs(linked.reactions["other"][:, 3:])) < 1e-4


def test_a_joint_follows_a_driven_one_through_a_link() -> None:
    """And what it needs is the drive's work."""
    made = two_pendulums(chain("Rz"))
    times = np.linspace(0.0, 0.5, 11)
    drive = Drive(times, np.sin(3.0 * times)[:, None])
    links = Links((link("other", "one", -0.5, 0.2),))
    run = simulate(
        made, Plan(stop=0.5, links=links, drives={"one": drive}, springs=NONE, tolerance=1e-6)
    )
    assert 0.0 < run.prescribed_motion_drift < 1e-8
    assert energy_error(run) < 1e-5
    assert np.ptp(run.energy["work"]) > 0.1


@pytest.mark.parametrize("dof", [1, 2])
def test_a_link_of_single_displacements_passes_where_they_have_no_rates(dof) -> None:
    """The second displacement passes 90 deg, where the axes of the first and third are one.

    A motion that only comes near is smooth, though fast; Exudyn's fixed steps end there.
    """
    made = two_pendulums(BALL, (0.5, 0.3, 0.2), (0.5, 0.3, 0.2))
    links = Links((link(f"other {dof}", f"one {dof}", 1.0, 0.1),))
    plan = Plan(springs=NONE, links=links, velocities={"one": (0.0, 6.0, 0.0)})
    run = simulate(made, plan)
    assert run.outcome.ending is Ending.DONE
    assert run.integrator is Integrator.COMPILED
    assert max(np.max(np.abs(run.displacements[n][:, 1])) for n in ("one", "other")) > 1.3
    assert energy_error(run) < 1e-3
    followed = run.displacements["one"][:, dof - 1] + 0.1
    assert run.displacements["other"][:, dof - 1] == pytest.approx(followed, abs=1e-9)
    ended = simulate(made, replace(plan, integrator=Integrator.EXUDYN))
    assert ended.outcome.ending is Ending.SOLVER_FAILED
    assert ended.outcome.joint in ("one", "other")
    assert "two of its axes coincide" in ended.outcome.message
    assert np.max(np.abs(ended.displacements[ended.outcome.joint][-1, 1])) > np.radians(70.0)
