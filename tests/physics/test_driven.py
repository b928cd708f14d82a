"""Driven joints: they follow their table, and their torque does the work that the book shows."""

from dataclasses import replace

import numpy as np
import pytest

from generator import read_figure
from generator.drive import Drive
from generator.figure import AxisKind, JointAxis
from generator.joint_chain import build_chain
from generator.recording import Ending
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet
from tests.chains import BALL, FREE, SKEW, X, Y, Z, body, chain, negative, one_body, row, two_bodies
from tests.runs import energy_error

NONE = SpringSet()


def integral(run, values):
    """Over the frames, by the spline through them."""
    return Drive(run.times, values[:, None])._splines[0].antiderivative()(run.times)[:, 0]


@pytest.mark.parametrize("axis", [Z, negative(SKEW)])
def test_a_driven_pendulum_needs_the_torque_of_its_motion(axis) -> None:
    """Inertia times acceleration, less gravity's torque; from the first frame on."""
    made = one_body((JointAxis(AxisKind.ROTATION, axis),), (0.0,))
    link = made.segments["link"]
    times = np.linspace(0.0, 1.0, 41)
    drive = Drive(times, (0.3 + 0.5 * np.sin(4.0 * times))[:, None])
    run = simulate(made, Plan(drives={"pin": drive}, springs=NONE, tolerance=1e-6, frame=0.025))
    unit, centre = np.asarray(axis), link.centre_of_mass
    across = centre - (centre @ unit) * unit
    about = unit**2 @ np.asarray(link.inertia) + link.mass * across @ across
    weight = np.array([0.0, -9.81 * link.mass, 0.0])
    arms = run.poses["link"][:, :3, :3] @ centre
    # The acceleration of the spline at the frames, which are its rows.
    acceleration = drive._splines[1].derivative()(run.times)[:, 0]
    needed = about * acceleration - np.cross(arms, weight) @ unit
    assert run.outcome.succeeded
    # The frames are put where the table has them; the integrator itself was no farther off.
    assert 0.0 < run.prescribed_motion_drift < 1e-8
    assert np.max(np.abs(run.drive_torques["pin"][:, 0] - needed)) < 1e-4 * np.max(np.abs(needed))
    assert np.max(np.abs(run.reactions["pin"][:, 3:] @ unit - needed)) < 1e-4 * np.max(
        np.abs(needed)
    )


def smooth(times, size, count):
    """Displacements that begin and end somewhere on their way."""
    return size * np.sin(np.outer(3.0 * times + 0.2, 1.0 + 0.3 * np.arange(count)))


DRIVEN = {
    "a hinge in a row": ("joint1", None),
    "a whole ball": ("joint0", None),
    "two of a ball's displacements": ("joint2", (2, 0)),
}


@pytest.mark.parametrize("name", DRIVEN)
def test_torque_times_rate_is_the_work_in_the_book(name) -> None:
    """Everything else falls freely, with springs and damping; the book closes."""
    joint, freedoms = DRIVEN[name]
    made = row(4, (BALL, chain("Rz"), BALL), bend=0.2)
    springs = SpringSet(
        {"joint2": JointSprings("joint2", tuple(AxisSpring(a, (Linear(2.0),)) for a in (X, Y, Z)))}
        | {"joint1": JointSprings("joint1", (AxisSpring(Z, (Linear(1.0),), Damping(0.05)),))}
    )
    times = np.linspace(0.0, 0.4, 9)
    count = len(made.joints[joint].chain) if freedoms is None else len(freedoms)
    drive = Drive(times, smooth(times, 0.6, count), freedoms)
    plan = Plan(stop=0.4, frame=0.0025, drives={joint: drive}, springs=springs, tolerance=1e-6)
    run = simulate(made, plan)
    assert run.outcome.succeeded
    assert 0.0 < run.prescribed_motion_drift < 1e-6
    size = np.ptp(run.energy["work"])
    assert size > 0.1
    assert energy_error(run) < 1e-4 * size
    power = np.sum(run.drive_torques[joint] * run.velocities[joint], axis=1)
    assert np.max(np.abs(integral(run, power) - run.energy["work"])) < 1e-4 * size


def test_a_motion_that_is_driven_again_is_the_same_and_needs_no_torque() -> None:
    """Of a free fall, which no drive has to help.

    The acceleration of a spline is off by the square of the distance of its rows, and so is the
    torque: with half the distance a quarter is left.
    """
    made = row(3, (BALL, chain("Rz")), bend=0.4)
    largest = []
    for frame in (0.01, 0.005):
        plan = Plan(stop=0.24, frame=frame, springs=NONE, tolerance=1e-6)
        free = simulate(made, plan)
        drives = {name: Drive(free.times, rows) for name, rows in free.displacements.items()}
        again = simulate(made, replace(plan, drives=drives))
        for name, pose in free.poses.items():
            assert np.max(np.abs(again.poses[name] - pose)) < 1e-9
        torques = np.concatenate(list(again.drive_torques.values()), axis=1)
        largest.append(np.max(np.abs(torques)[np.abs(free.times - 0.12) < 0.05]))
    weights = 9.81 * 0.3 * sum(body.mass for body in made.bodies.values())
    assert largest[1] < 0.01 * weights
    assert largest[0] / largest[1] == pytest.approx(4.0, rel=0.2)


def test_sites_that_are_turned_and_connections_the_other_way_round() -> None:
    """The drive is of the figure's own displacements in any case."""
    times = np.linspace(0.0, 0.3, 7)
    for reverse in (False, True):
        made = two_bodies(BALL, (0.3, -0.2, 0.4), reverse=reverse)
        drive = Drive(times, np.array([0.3, -0.2, 0.4]) + smooth(times, 0.3, 3))
        run = simulate(made, Plan(stop=0.3, drives={"tested": drive}, springs=NONE, tolerance=1e-6))
        assert run.outcome.succeeded
        assert 0.0 < run.prescribed_motion_drift < 1e-8
        balance = run.energy_balance
        assert np.max(np.abs(balance - balance[0])) < 1e-4


def test_a_drive_through_a_pole_of_its_angles() -> None:
    """A ball whose displacements are all driven has an angular velocity there as anywhere."""
    times = np.linspace(0.0, 0.5, 26)
    angles = np.stack([0.2 + 0 * times, 1.2 + 1.5 * times, 0.1 + 0.2 * times], axis=1)
    made = one_body(BALL, (0.2, 1.2, 0.1), body("link"))
    drive = Drive(times, angles)
    run = simulate(made, Plan(stop=0.5, drives={"pin": drive}, springs=NONE, tolerance=1e-6))
    expected = np.array(
        [build_chain(BALL).pose(angle)[:3, :3] for angle in drive.displacements(run.times)]
    )
    assert angles[-1, 1] > 0.5 * np.pi
    assert run.outcome.succeeded
    assert 0.0 < run.prescribed_motion_drift < 1e-8
    assert np.max(np.abs(run.poses["link"][:, :3, :3] - expected)) < 1e-9


def test_what_drives_from_within_moves_no_centre_of_mass() -> None:
    """A flying row that bends itself: its centre of mass keeps the velocity it has."""
    made = row(3, (FREE, BALL, chain("Rz")), bend=0.3)
    times = np.linspace(0.0, 0.4, 9)
    drives = {"joint1": Drive(times, smooth(times, 0.7, 3)), "joint2": Drive(times, times[:, None])}
    plan = Plan(stop=0.4, drives=drives, springs=NONE, gravity=(0.0, 0.0, 0.0), tolerance=1e-6)
    run = simulate(made, plan)
    assert run.outcome.succeeded
    line = np.polynomial.polynomial.polyfit(run.times, run.centre_of_mass, 1)
    off = run.centre_of_mass - np.polynomial.polynomial.polyval(run.times, line).T
    assert np.max(np.abs(off)) < 1e-8
    assert np.ptp(run.displacements["joint0"][:, :3]) > 0.1


def test_a_table_that_is_driven_strays_by_less_than_a_millionth() -> None:
    """At the default tolerance: two of the prototype's joints, the rest falls."""
    made = read_figure("prototype")
    times = np.array([0.0, 0.1, 0.2, 0.3])
    drives = {
        "left_knee": Drive(times, np.radians([[0.0], [20.0], [40.0], [60.0]])),
        "right_shoulder": Drive(times, np.radians([[0.0], [10.0], [5.0], [0.0]]), (2,)),
    }
    run = simulate(made, Plan(stop=0.3, drives=drives))
    assert run.outcome.succeeded
    assert 0.0 < run.prescribed_motion_drift < 1e-6


@pytest.mark.parametrize("rate", [-1.5, 1.5])
def test_a_loop_driven_to_its_dead_point_is_named_with_its_drive(rate) -> None:
    """A rocker cannot turn all the way round: it ends where crank and coupler are in one line."""
    made = read_figure("fourbar")
    times = np.array([0.0, 1.0])
    start = made.joints["rocker_bearing"].displacement[0]
    drive = Drive(times, (start + rate * times)[:, None])
    run = simulate(made, Plan(drives={"rocker_bearing": drive}, frame=0.005))
    assert run.outcome.ending is Ending.SOLVER_FAILED
    assert "the loop closed by rocker_pin reached a dead point after" in run.outcome.message
    assert "beyond which it cannot follow the drive of rocker_bearing" in (run.outcome.message)
    assert run.outcome.joint == "rocker_bearing"
    assert abs(np.sin(run.displacements["crank_pin"][-1, 0])) < 0.25
