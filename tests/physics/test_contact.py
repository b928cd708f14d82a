"""Bodies in contact move as closed forms say; docs/contact-validation.md has the numbers."""

from dataclasses import replace
from functools import cache
from itertools import product
from math import hypot, radians

import numpy as np
import pytest
from scipy.integrate import trapezoid

from generator import read_figure
from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene, floor_prop
from generator.contact.shape import Shape
from generator.figure import Figure
from generator.recording import Recording
from generator.rotations import Array
from generator.run_options import Integrator
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from plots.contact_cases import (
    BALL,
    BALL_INERTIA,
    BALL_RADIUS,
    BLOCK,
    BLOCK_HALF_SIZE,
    BLOCK_INERTIA,
    BODY,
    FIRM,
    GRAVITY,
    HORIZONTAL,
    MASS,
    ContactCase,
    ball_begins_to_roll,
    ball_on_incline,
    body_velocity,
    creep_speed,
    creeping_block,
    downhill_velocity,
    elastic_peak,
    exchanged_energy,
    free_body,
    rebound,
    resting_block,
    restitution,
    rolling_speed,
    simulate_contact,
    simulate_impact,
    slipping_block,
    slope_normal,
    stopping_block,
    tipping_rod,
    tumbling_block,
)
from springs import SpringSet
from springs.contact import Surface
from tests.chains import FREE, body, figure, ground, joint
from tests.contact_figures import SOFT, two_segments
from tests.runs import energy_error, momenta

PROTOTYPE = read_figure("prototype")
BENT = {"left_hip_joint": (0.1, 0.2, 0.15), "left_knee": (0.35,), "right_knee": (0.35,)}
FLOOR = Scene((floor_prop((0.0, 1.0, 0.0)),))
THROWN = {"first": (1.0, 2.0, -3.0, 0.5, 0.0, 0.2), "second": (-2.0, 0.5, 4.0, -0.3, 0.0, 0.1)}


def check_run(run: Recording) -> None:
    """Compiled to the end, and with the accelerations of the Exudyn model."""
    assert run.outcome.succeeded
    assert run.integrator is Integrator.COMPILED
    assert run.agreement_with_exudyn is not None
    assert run.agreement_with_exudyn < 1e-8


def check_case(case: ContactCase, bound: float) -> None:
    check_run(case.run)
    assert energy_error(case.run) < 1e-8
    assert case.relative_error < bound


@pytest.mark.parametrize(
    ("damping", "speed", "stiffness"), list(product((0.5, 2.0), (0.1, 3.0), (3e4, 1e6)))
)
def test_restitution(damping: float, speed: float, stiffness: float) -> None:
    check_case(rebound(damping, speed, stiffness), 1e-8)


@pytest.mark.parametrize("speed", [0.1, 1.0, 3.0])
def test_peak_force_of_an_elastic_impact(speed: float) -> None:
    """A parabola through three steps has the peak between them."""
    check_case(elastic_peak(speed), 3e-4)


@pytest.mark.parametrize("slope", [5.0, 20.0, 30.0])
def test_a_block_creeps_below_the_friction_angle(slope: float) -> None:
    check_case(creeping_block(radians(slope)), 1e-4)


@pytest.mark.parametrize("slope", [35.0, 45.0])
def test_a_block_slips_above_the_friction_angle(slope: float) -> None:
    check_case(slipping_block(radians(slope)), 3e-3)


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_a_sliding_block_stops(speed: float) -> None:
    check_case(stopping_block(speed), 2e-3)


def test_a_block_at_rest_is_carried() -> None:
    case = resting_block()
    check_case(case, 1e-6)
    assert case.run.contact is not None
    assert case.run.contact.creep < 1e-6


@pytest.mark.parametrize(
    ("slope", "bound"), [(10.0, 1e-6), (30.0, 1e-6), (60.0, 1e-6), (70.0, 1e-4)]
)
def test_a_ball_rolls_and_slips_on_a_tilted_plane_and_in_tilted_gravity(
    slope: float, bound: float
) -> None:
    tilted, turned = (
        ball_on_incline(radians(slope), turned_gravity=is_turned) for is_turned in (False, True)
    )
    check_case(tilted, bound)
    check_case(turned, bound)
    assert tilted.measured == pytest.approx(turned.measured, rel=1e-6)


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_a_sliding_ball_begins_to_roll(speed: float) -> None:
    check_case(ball_begins_to_roll(speed), 1e-8)


def test_a_rod_tips_over_its_foot() -> None:
    for case in tipping_rod(0.1, (0.3, 0.5, 0.81)):
        check_case(case, 1e-3)


def test_a_tumbling_block_keeps_its_energy() -> None:
    """With what damping and friction take away."""
    run = tumbling_block()
    check_run(run)
    assert run.contact is not None
    assert run.contact.max_force > 5.0 * MASS * GRAVITY
    assert run.energy["friction"][-1] > 1.0
    assert run.energy["contact damping"][-1] > 1.0
    for kind in ("contact damping", "friction"):
        assert np.min(np.diff(run.energy[kind])) > -1e-12
    assert energy_error(run) < 1e-9 * exchanged_energy(run)


def throw_ball(shape: Shape) -> Recording:
    """A spinning ball bounces, slides and rolls."""
    return simulate_contact(
        free_body(BALL, (BALL_INERTIA,) * 3, (-0.2, 0.3, 0.0)),
        shape,
        Surface(),
        1.0,
        velocity=(0.7, 0.0, 0.3),
        spin=(3.0, -2.0, -4.0),
    )


def test_the_face_of_a_box_acts_as_a_plane() -> None:
    """A turned box beside a plane of another direction: only the face in contact counts."""
    turn = 0.4
    box = Box((0.0, -0.25, 0.0), (4.0, 0.5, 4.0), (0.0, turn, 0.0))
    runs = [throw_ball(shape) for shape in (HORIZONTAL, box)]
    for run in runs:
        check_run(run)
        assert np.min(run.centre_of_mass[:, 1]) < BALL_RADIUS
    plane, box_run = runs
    assert np.max(np.abs(plane.centre_of_mass - box_run.centre_of_mass)) < 1e-8
    for kind, values in plane.energy.items():
        assert box_run.energy[kind] == pytest.approx(values, abs=1e-7)


@pytest.mark.parametrize(
    ("thickness", "height", "stiffness", "tolerance"),
    [(1.0, 0.5, 3e4, 1e-3), (1.0, 2.0, 1e6, 1e-6), (0.02, 2.0, 3e3, 1e-3), (0.02, 2.0, 3e4, 1e-6)],
)
def test_a_ball_bounces_on_a_box_as_on_a_plane(
    thickness: float, height: float, stiffness: float, tolerance: float
) -> None:
    """The step of a long flight suits neither the impact nor a thin box."""
    surface = Surface(stiffness=stiffness)
    box = Box((0.0, -0.5 * thickness, 0.0), (1.0, thickness, 1.0))
    ball = free_body(BALL, (BALL_INERTIA,) * 3, (0.0, BALL_RADIUS + height, 0.0))
    plane_run, run = (
        simulate_contact(ball, shape, surface, 1.0, tolerance=tolerance)
        for shape in (HORIZONTAL, box)
    )
    for each in (plane_run, run):
        check_run(each)
        assert energy_error(each) < 1e-2 * tolerance**0.5 * exchanged_energy(each)
    assert run.centre_of_mass == pytest.approx(plane_run.centre_of_mass, abs=2.0 * tolerance)


@pytest.mark.parametrize(("friction", "damping"), [(0.0, 0.0), (0.6, 0.0), (0.6, 1.0)])
def test_a_ball_rolls_over_the_edge_of_a_box(friction: float, damping: float) -> None:
    speed, height = 0.4, 0.7
    run = simulate_contact(
        free_body(BALL, (BALL_INERTIA,) * 3, (-0.2, height + BALL_RADIUS, 0.0)),
        Box((-0.5, 0.5 * height, 0.0), (1.0, height, 1.0)),
        Surface(damping=damping, friction=friction),
        0.9,
        velocity=(speed, 0.0, 0.0),
        spin=(0.0, 0.0, -speed / BALL_RADIUS),
        tolerance=1e-9,
    )
    check_run(run)
    x, y, _ = run.centre_of_mass[-1]
    assert x > BALL_RADIUS
    assert y < 0.5 * height
    assert energy_error(run) < 1e-9
    if friction == damping == 0.0:
        kept = run.energy["kinetic"] + run.energy["gravity"] + run.energy["contact"]
        assert np.ptp(kept) < 1e-9
        assert run.energy["friction"][-1] == run.energy["contact damping"][-1] == 0.0
        assert run.velocities[BODY][-1, 0] == pytest.approx(-speed / BALL_RADIUS, abs=1e-9)
    else:
        assert run.energy["friction"][-1] + run.energy["contact damping"][-1] > 1e-3


def weight_impulse(mass: float, run: Recording) -> Array:
    """Impulse of the weight [N s]."""
    return np.array([0.0, -mass * GRAVITY * (run.times[-1] - run.times[0]), 0.0])


def frame_impulse(run: Recording, segment: str) -> Array:
    """Integral of the force in the frames by the trapezoidal rule [N s]."""
    assert run.contact is not None
    return trapezoid(run.contact.forces[segment], run.times, axis=0)


def two_blocks() -> Figure:
    """Two blocks that no joint connects, of different masses."""
    some = [
        replace(
            body(name, mass, BLOCK_INERTIA, (0.0, 0.0, 0.0)),
            contact_spheres=BLOCK,
        )
        for name, mass in (("first", 1.0), ("second", 3.0))
    ]
    joints = [
        joint(f"to_{name}", "ground.base", f"{name}.near", FREE, (0.2, 0.1, 0.3, x, 0.0, 0.0))
        for name, x in (("first", -0.5), ("second", 0.5))
    ]
    return figure([ground(), *some], joints)


def test_each_of_two_bodies_has_its_own_impulse() -> None:
    plan = Plan(
        stop=0.5,
        frame=2e-4,
        tolerance=1e-7,
        springs=SpringSet(),
        free_root=True,
        height=0.05,
        scene=FLOOR,
        velocities=THROWN,
    )
    run = simulate(two_blocks(), plan)
    check_run(run)
    assert run.contact is not None
    for name, mass in (("first", 1.0), ("second", 3.0)):
        change = mass * np.subtract(run.velocities[name][-1, 3:], run.velocities[name][0, 3:])
        contact = run.contact.segments[name]
        impulse = np.array(contact.impulse)
        assert contact.first_time is not None
        assert np.linalg.norm(impulse) > 1.0
        assert change - weight_impulse(mass, run) == pytest.approx(impulse, abs=1e-9)
        assert frame_impulse(run, name) == pytest.approx(impulse, abs=1e-4)
    forces = sum(run.contact.forces.values())
    assert run.contact.ground_reaction[:, :3] == pytest.approx(forces, abs=1e-9)


def check_momentum(figure: Figure, run: Recording, bound: float) -> None:
    """The momentum changes by the impulses of the props and of the weight."""
    assert run.contact is not None
    impulses = np.sum([contact.impulse for contact in run.contact.segments.values()], axis=0)
    start, end = momenta(figure, run, (0, -1))[0]
    gap = end - start - impulses - weight_impulse(figure.total_mass, run)
    assert np.linalg.norm(gap) < bound * np.linalg.norm(impulses)


@cache
def prototype_fall() -> Recording:
    """The prototype falls from 0.1 m and collapses."""
    plan = Plan(
        stop=0.7,
        tolerance=3e-7,
        frame=2e-4,
        free_root=True,
        height=0.1,
        scene=FLOOR,
        displacements=BENT,
    )
    return simulate(PROTOTYPE, plan)


def test_the_momentum_of_a_fallen_prototype_is_that_of_its_impulses() -> None:
    run = prototype_fall()
    check_run(run)
    check_momentum(PROTOTYPE, run, 1e-9)
    assert run.contact is not None
    for name, contact in run.contact.segments.items():
        assert frame_impulse(run, name) == pytest.approx(np.array(contact.impulse), abs=0.02)


def test_a_fallen_prototype_keeps_its_energy_book() -> None:
    run = prototype_fall()
    assert run.energy["contact damping"][-1] > 10.0
    assert energy_error(run) < 1e-6


def test_closed_forms_by_the_integrator_of_exudyn() -> None:
    """Impact, creep and rolling: the connectors in Exudyn have the same law."""
    slow, slope, tolerance = Integrator.EXUDYN, radians(20.0), 1e-5
    impact = simulate_impact(Surface(), 1.0, tolerance, slow)
    normal = slope_normal(slope)
    creep = simulate_contact(
        free_body(BLOCK, BLOCK_INERTIA, [BLOCK_HALF_SIZE[1] * n for n in normal], -slope),
        Plane((0.0, 0.0, 0.0), normal),
        FIRM,
        0.3,
        tolerance=tolerance,
        integrator=slow,
    )
    rolling = simulate_contact(
        free_body(BALL, (BALL_INERTIA,) * 3, (0.0, BALL_RADIUS, 0.0)),
        HORIZONTAL,
        FIRM,
        0.3,
        velocity=(2.0, 0.0, 0.0),
        tolerance=tolerance,
        integrator=slow,
    )
    assert all(run.outcome.succeeded for run in (impact, creep, rolling))
    assert all(run.integrator is slow for run in (impact, creep, rolling))
    assert body_velocity(impact)[-1, 1] == pytest.approx(restitution(1.0, 1.0), rel=1e-5)
    assert downhill_velocity(creep, slope)[-1] == pytest.approx(creep_speed(slope, FIRM), rel=1e-5)
    assert body_velocity(rolling)[-1, 0] == pytest.approx(rolling_speed(2.0), rel=1e-5)


def test_the_energy_of_a_surface_that_recovers_too_slowly_is_lost() -> None:
    """Without a force on a sphere that leaves faster, no acceleration bounds the steps."""
    plan = Plan(
        stop=0.4,
        tolerance=1e-5,
        springs=SpringSet(),
        gravity=(0.0, 0.0, 0.0),
        displacements={"root": (0.3, 0.2, 0.1, 0.0, 1.0, 0.0)},
        velocities={"root": (1.0, 2.0, -3.0, 0.5, -4.0, 0.2)},
        scene=Scene((floor_prop((0.0, 1.0, 0.0), replace(SOFT, friction_speed=0.05)),)),
    )
    run = simulate(two_segments(), plan)
    check_run(run)
    assert run.energy["contact damping"][-1] > 30.0
    assert np.min(np.diff(run.energy["contact damping"])) > -1e-5
    assert energy_error(run) < 1e-5


@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_sliding_along_a_wall_and_a_floor_at_once(friction: float) -> None:
    """The ball presses on both props: two forces, one motion, the energy book closed."""
    props = tuple(
        Prop(name, Plane(point, normal), Surface(friction=friction, damping=20.0))
        for name, point, normal in (
            ("floor", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
            ("wall", (0.0, 0.0, -BALL_RADIUS), (0.0, 0.0, 1.0)),
        )
    )
    ball = free_body(BALL, (BALL_INERTIA,) * 3, (0.0, BALL_RADIUS, 0.0))
    plan = Plan(
        stop=0.4,
        tolerance=1e-7,
        springs=SpringSet(),
        gravity=(0.0, -GRAVITY, -0.5 * GRAVITY),
        free_root=True,
        scene=Scene(props),
        velocities={BODY: (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)},
    )
    run = simulate(ball, plan)
    check_run(run)
    assert run.contact is not None
    weight = MASS * GRAVITY
    reaction = run.contact.ground_reaction[-1, :3]
    if friction == 0.0:
        assert reaction == pytest.approx([0.0, weight, 0.5 * weight], abs=1e-6)
        assert run.velocities[BODY][-1, 3] == pytest.approx(1.0, abs=1e-12)
    else:
        assert hypot(*reaction[1:]) == pytest.approx(weight * hypot(1.0, 0.5), rel=0.5)
        assert run.velocities[BODY][-1, 3] < 0.9
    assert energy_error(run) < 1e-9


@pytest.mark.slow
def test_exudyn_s_integrator_refines_its_steps_until_an_impact_succeeds() -> None:
    """A forearm hits the floor at 0.5 s; its friction needs steps of 0.2 ms."""
    bent = {name: (radians(20.0),) for name in ("left_knee", "right_knee")}
    plan = Plan(
        stop=0.54, free_root=True, height=0.0, scene=FLOOR, displacements=bent, tolerance=0.05
    )
    referee = simulate(PROTOTYPE, replace(plan, integrator=Integrator.EXUDYN))
    assert referee.outcome.reached_stop
    run = simulate(PROTOTYPE, plan)
    assert run.contact is not None
    assert referee.contact is not None
    arm, other = (each.contact.segments["right_lower_arm"] for each in (run, referee))
    assert other.first_time == pytest.approx(arm.first_time, abs=1e-3)
    assert other.peak_force == pytest.approx(arm.peak_force, rel=0.05)
