"""Segments that hit each other in free flight: restitution, momentum, and energy."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from generator import read_figure
from generator.figure import ContactSphere, Figure
from generator.recording import Recording
from generator.run_options import Integrator
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from plots.contact_cases import restitution
from springs import SpringSet
from tests.chains import FREE, Vector, body, figure, ground, joint
from tests.contact_figures import FLOOR
from tests.runs import energy_error, momenta

PROTOTYPE = read_figure("prototype")
WEIGHTLESS = Plan(
    gravity=(0.0, 0.0, 0.0), free_root=True, height=20.0, scene=FLOOR, self_contact=True
)
BALL = (ContactSphere((0.0, 0.0, 0.0), 0.1),)
ROD = (ContactSphere((-0.4, 0.0, 0.0), 0.05), ContactSphere((0.4, 0.0, 0.0), 0.05))


def fly(some: Figure, **fields) -> Recording:
    run = simulate(some, replace(WEIGHTLESS, **fields))
    assert run.outcome.succeeded
    assert run.integrator is Integrator.COMPILED
    assert run.agreement_with_exudyn is not None
    assert run.agreement_with_exudyn < 1e-8
    return run


def two_bodies(spheres, second_place: tuple[float, ...]) -> Figure:
    """Two free bodies of 1 and 3 kg, the first at the origin."""
    inertias: tuple[Vector, Vector] = ((0.004, 0.05, 0.05), (0.012, 0.15, 0.15))
    places = ((0.0,) * 6, second_place)
    bodies = [
        replace(body(name, mass, inertia, (0.0, 0.0, 0.0)), contact_spheres=spheres)
        for name, mass, inertia in zip(("first", "second"), (1.0, 3.0), inertias, strict=True)
    ]
    joints = [
        joint(f"to_{one.name}", "ground.base", f"{one.name}.near", FREE, place)
        for one, place in zip(bodies, places, strict=True)
    ]
    return figure([ground(), *bodies], joints)


def check_momenta(some: Figure, run: Recording, bound: float) -> None:
    pushes, turns = momenta(some, run, (0, -1))
    assert pushes[1] == pytest.approx(pushes[0], abs=bound)
    assert turns[1] == pytest.approx(turns[0], abs=bound)


@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0])
def test_two_balls_bounce_off_each_other(speed: float) -> None:
    """With the restitution of a sphere on a plane, whatever the masses are."""
    balls = two_bodies(BALL, (0.0, 0.0, 0.0, 0.25, 0.0, 0.0))
    run = fly(
        balls,
        stop=0.1 + 0.1 / speed,
        springs=SpringSet(),
        velocities={"first": (0.0, 0.0, 0.0, speed, 0.0, 0.0)},
        tolerance=1e-7,
    )
    ends = [run.velocities[name][-1, 3] for name in ("first", "second")]
    assert ends[1] - ends[0] == pytest.approx(restitution(1.0, speed) * speed, rel=1e-6)
    check_momenta(balls, run, 1e-9)
    assert energy_error(run) < 1e-8


@cache
def crossing_rods() -> tuple[Figure, Recording]:
    """A spinning rod hits one at rest askew."""
    rods = two_bodies(ROD, (0.3, 0.9, 1.2, 0.1, 0.2, 0.15))
    run = fly(
        rods,
        stop=0.5,
        springs=SpringSet(),
        velocities={"first": (1.0, 3.0, -2.0, 0.2, 1.5, 1.2)},
        tolerance=1e-8,
    )
    return rods, run


def test_rods_that_hit_each_other_keep_their_momenta() -> None:
    rods, run = crossing_rods()
    check_momenta(rods, run, 1e-9)
    change = run.velocities["second"][-1] - run.velocities["second"][0]
    assert np.linalg.norm(change[:3]) > 0.1
    assert np.linalg.norm(change[3:]) > 0.1


def test_rods_that_hit_each_other_keep_their_energy_book() -> None:
    _, run = crossing_rods()
    assert energy_error(run) < 1e-8
    for kind in ("contact damping", "friction"):
        assert run.energy[kind][-1] > 1e-3
        assert np.min(np.diff(run.energy[kind])) > -1e-12


def test_a_prototype_that_claps_its_legs_keeps_its_momenta() -> None:
    run = fly(
        PROTOTYPE,
        stop=0.15,
        velocities=dict.fromkeys(("left_hip_joint", "right_hip_joint"), (0.0, -4.0, 0.0)),
        tolerance=1e-7,
    )
    assert run.energy["contact damping"][-1] > 1.0
    check_momenta(PROTOTYPE, run, 1e-7)
    assert energy_error(run) < 1e-6


def test_limbs_overlap_less_with_self_contact() -> None:
    """In a collapse on the floor; the floor carries the weight as before."""
    plan = Plan(
        stop=0.8,
        tolerance=3e-6,
        free_root=True,
        height=0.0,
        scene=FLOOR,
        displacements={"left_knee": (0.35,), "right_knee": (0.35,)},
        velocities={"lower_torso": (0.0, 0.0, 0.0, 0.0, 0.0, 1.5)},
    )
    depths = []
    for self_contact in (False, True):
        run = simulate(PROTOTYPE, replace(plan, self_contact=self_contact))
        assert run.contact is not None
        assert energy_error(run) < 1e-5
        depths.append(0.0 if run.contact.overlap is None else run.contact.overlap.depth)
    assert depths[1] < 0.8 * depths[0]
