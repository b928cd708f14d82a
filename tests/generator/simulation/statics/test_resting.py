"""Poses at rest on props, against closed forms, and the prototype on a floor."""

from dataclasses import replace
from itertools import product
from math import atan, cos, pi, sin, sqrt, tan

import numpy as np
import pytest
from scipy.optimize import brentq

from generator import (
    Ending,
    Figure,
    ModelError,
    Plan,
    Stepper,
    forward_kinematics,
    read_figure,
    simulate,
)
from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene, floor_prop
from generator.drive import Drive
from generator.figure import ContactSphere
from generator.kinematics.links import Coordinate, Link, Links
from generator.kinematics.tree import build_tree
from generator.simulation.statics import resting
from generator.simulation.statics.equilibrium import NoEquilibriumError
from generator.simulation.statics.resting import attach_pose, find_resting_pose
from springs import AxisSpring, JointSprings, Linear, SphericalLaw, SpringSet
from springs.contact import Surface
from tests.chains import BALL, FREE, Y, Z, at, body, chain, figure, ground, joint, one_body
from tests.runs import springs_of

G = 9.81
RADIUS = 0.02
EDGES = (0.4, 0.2, 0.3)
MU = 0.6


def brick(mass: float = 4.0, **sites) -> Figure:
    """A box with a sphere at each corner, free from the start."""
    inertia = tuple(mass / 12.0 * (sum(e**2 for e in EDGES) - own**2) for own in EDGES)
    made = body("link", mass, inertia, (0.0, 0.0, 0.0), sites)
    corners = product(*((-0.5 * edge + RADIUS, 0.5 * edge - RADIUS) for edge in EDGES))
    return replace(made, contact_spheres=tuple(ContactSphere(at, RADIUS) for at in corners))


def lying_brick() -> Figure:
    return one_body(FREE, segment=brick())


def slope(angle: float, surface: Surface | None = None) -> Scene:
    """A plane that falls towards x, turned about z."""
    return Scene((Prop("slope", Plane((0.0, 0.0, 0.0), (sin(angle), cos(angle), 0.0)),
                       surface or Surface(friction=MU)),))  # fmt: skip


def on_slope(angle: float) -> Plan:
    """A plan of the brick just above the slope, parallel to it."""
    height = 0.5 * EDGES[1] + 0.01
    place = (height * sin(angle), height * cos(angle))
    return Plan(scene=slope(angle), displacements={"pin": (0.0, 0.0, -angle, *place, 0.0)})


@pytest.mark.parametrize("degrees", [0.0, 15.0, 28.0])
def test_a_box_rests_on_a_slope_below_the_friction_angle(degrees):
    angle = np.radians(degrees)
    rest = find_resting_pose(lying_brick(), on_slope(angle))
    ratio = tan(angle) / MU
    assert rest.is_stable
    assert rest.growth < 1e-3
    assert rest.creep == pytest.approx(0.02 * ratio / sqrt(1.0 - ratio**2), rel=1e-3, abs=1e-6)
    assert rest.weight == pytest.approx(4.0 * G)
    assert rest.shares == {"link": pytest.approx(1.0, abs=1e-4)}
    assert rest.weight_carried == rest.shares["link"]
    assert rest.forces["link"] == pytest.approx((0.0, 4.0 * G, 0.0), abs=5e-3)
    assert rest.acceleration < 1e-2
    # Forces along the slope act a height above the ground, so the lower spheres carry more.
    surface, span = Surface(), EDGES[0] - 2.0 * RADIUS
    share = 0.25 * 4.0 * G * cos(angle) + 0.5 * 4.0 * G * sin(angle) * 0.5 * EDGES[1] / span
    depth = brentq(lambda d: surface.elastic_force(d) - share, 0.0, 0.1, xtol=1e-15)
    assert rest.depths["link"] == pytest.approx(depth, rel=0.02)
    tilt = rest.poses["link"][:3, :3] @ (0.0, 1.0, 0.0)
    assert tilt == pytest.approx((sin(angle), cos(angle), 0.0), abs=0.02)


def test_a_box_slides_beyond_the_friction_angle(monkeypatch):
    monkeypatch.setattr(resting, "MAX_TESTS", 10)
    with pytest.raises(NoEquilibriumError, match=r"link still moves at .* m/s, and its largest"):
        find_resting_pose(lying_brick(), on_slope(atan(MU) + 0.03))


def test_the_energy_of_a_box_on_a_floor():
    rest = find_resting_pose(lying_brick(), Plan(scene=slope(0.0), free_root=True, height=0.3))
    surface = Surface()
    depth = brentq(lambda d: surface.elastic_force(d) - G, 0.0, 0.1, xtol=1e-15)
    height = 0.5 * EDGES[1] - depth
    assert rest.height == pytest.approx(height, abs=1e-6)
    assert rest.centre_of_mass[1] == rest.height
    energy = 4.0 * G * height + 4.0 * float(surface.energy(depth))
    assert rest.energy == pytest.approx(energy, abs=1e-5)
    assert rest.start_energy == pytest.approx(4.0 * G * (0.3 + 0.5 * EDGES[1]), abs=1e-9)


def pendulum_on_a_box(centre: float = -0.2) -> Figure:
    """A heavy box with a bar on a hinge above it, free in the air."""
    base = brick(40.0, top=at(shift=(0.0, 0.5, 0.0)))
    bar = body("bar", 1.0, (0.01, 0.01, 0.01), (0.0, centre, 0.0))
    bar = replace(bar, contact_spheres=(ContactSphere((0.0, 0.0, 0.0), RADIUS),))
    return figure(
        [ground(), base, bar],
        [
            joint("pin", "ground.base", "link.near", FREE, (0, 0, 0, 0, 0.1, 0)),
            joint("hinge", "link.top", "bar.near", chain("Rz"), (0.0,)),
        ],
    )


def test_a_pendulum_without_damping_hangs_straight_down():
    plan = Plan(scene=slope(0.0), height=0.0, free_root=True, displacements={"hinge": (2.5,)})
    rest = find_resting_pose(pendulum_on_a_box(), plan)
    assert rest.is_stable
    assert rest.displacements["hinge"] == pytest.approx([0.0], abs=0.01)
    assert rest.time < 1.0  # stopped at the bottom of its swing, not after many of them
    assert rest.shares == {"link": pytest.approx(1.0, abs=1e-2), "bar": 0.0}
    assert rest.acceleration <= resting.MAX_REST_ACCELERATION


def test_a_pendulum_that_stands_is_unstable():
    """It grows with sqrt(m g l / (I + m l^2)), because the box is heavy and sticks."""
    plan = Plan(scene=slope(0.0), height=0.0, free_root=True, displacements={"hinge": (pi,)})
    rest = find_resting_pose(pendulum_on_a_box(), plan)
    assert not rest.is_stable
    assert rest.growth == pytest.approx(sqrt(G * 0.2 / (0.01 + 0.04)), rel=0.02)
    assert abs(rest.displacements["hinge"][0]) == pytest.approx(pi, abs=1e-3)
    moved = {"hinge": (pi - 1e-3,)}
    leaves = find_resting_pose(pendulum_on_a_box(), replace(plan, displacements=moved))
    assert leaves.is_stable
    assert leaves.displacements["hinge"] == pytest.approx([0.0], abs=0.01)


def test_a_bar_that_hangs_on_a_wall_rests_on_it():
    """A held figure leans on a prop: the moment of the wall's force is that of the weight."""
    bar = replace(body("link", 2.0, centre=(0.0, 0.0, 0.2)),
                  contact_spheres=(ContactSphere((0.0, 0.0, 0.4), RADIUS),))  # fmt: skip
    wall = Prop("wall", Plane((0.0, 0.0, 0.2), (0.0, 0.0, 1.0)), Surface(friction=0.0))
    hinge = one_body(chain("Rx"), (0.5,), bar)
    rest = find_resting_pose(hinge, Plan(scene=Scene((wall,))))
    angle = rest.displacements["pin"][0]
    lever = 0.4 * sin(angle)
    assert rest.is_stable
    assert rest.forces["link"] == pytest.approx(
        (0.0, 0.0, 2.0 * G * 0.2 * cos(angle) / lever), abs=0.05
    )
    assert rest.shares == {"link": 0.0}


def test_what_misses_the_props_falls(monkeypatch):
    monkeypatch.setattr(resting, "MAX_TESTS", 4)
    seat = Prop("seat", Box((5.0, 0.0, 0.0), (1.0, 1.0, 1.0)), Surface())
    seen = []
    message = r"within 3 s: link still moves at .* m/s and nothing touches a prop; the centre of "
    with pytest.raises(NoEquilibriumError, match=message + "mass has fallen 9"):
        find_resting_pose(
            lying_brick(), Plan(scene=Scene((seat,))), lambda now, left: seen.append((now, left))
        )
    assert [now for now, _ in seen] == pytest.approx([0.75, 1.5, 2.25, 3.0])
    assert [left for _, left in seen] == pytest.approx([G] * 4)


def test_wall_limits_drives_and_links_end_the_search():
    plan = on_slope(0.0)
    with pytest.raises(NoEquilibriumError, match="the wall-time limit of 1e-09 s was reached at 0"):
        find_resting_pose(lying_brick(), replace(plan, wall_limit=1e-9))
    drives = {"hinge": Drive(np.array([0.0, 1.0]), np.zeros((2, 1)))}
    with pytest.raises(NoEquilibriumError, match="a driven joint does not come to rest"):
        find_resting_pose(pendulum_on_a_box(), Plan(scene=plan.scene, drives=drives))
    with pytest.raises(ModelError, match="the plan has none"):
        find_resting_pose(lying_brick(), Plan())
    link = Link(Coordinate("pin", 2), Coordinate("hinge", 0), 0.5)
    with pytest.raises(ModelError, match="rotations are linked"):
        find_resting_pose(pendulum_on_a_box(), Plan(scene=plan.scene, links=Links((link,))))


def test_a_half_turn_ends_the_search():
    axes = tuple(AxisSpring(axis, (Linear(1e-3),)) for axis in ((1.0, 0.0, 0.0), Y, Z))
    ball = pendulum_on_a_box(centre=0.2)
    top = replace(ball.joints["hinge"], chain=BALL, displacement=(0.0, 0.0, 2.0))
    plan = Plan(scene=slope(0.0), height=0.0, free_root=True, springs=springs_of("hinge", *axes))
    with pytest.raises(NoEquilibriumError, match="hinge rotated through 180 deg"):
        find_resting_pose(ball.with_parts(top), plan)


def test_laws_without_an_energy_have_none():
    axes = tuple(AxisSpring(axis, (Linear(5.0),)) for axis in ((1.0, 0.0, 0.0), Y, Z))
    ball = pendulum_on_a_box()
    top = replace(ball.joints["hinge"], chain=BALL, displacement=(0.1, 0.2, 0.3))
    springs = SpringSet({"hinge": JointSprings("hinge", axes)}, law=SphericalLaw.WEIGHTED)
    plan = Plan(scene=slope(0.0), height=0.0, free_root=True, springs=springs)
    rest = find_resting_pose(ball.with_parts(top), plan)
    assert rest.energy is rest.start_energy is None
    assert np.linalg.norm(rest.displacements["hinge"]) < 0.01


def test_without_gravity_nothing_is_carried():
    plan = Plan(scene=slope(0.0), height=0.1, free_root=True, gravity=(0.0, 0.0, 0.0))
    rest = find_resting_pose(lying_brick(), plan)
    assert rest.shares == {}
    assert rest.weight_carried is None
    assert not rest.forces["link"].any()


FLOOR = Scene((floor_prop((0.0, 1.0, 0.0)),))
ON_FLOOR = Plan(scene=FLOOR, free_root=True, height=0.0, stop=1.0, frame=0.1)
LYING = {"root_torso": (pi / 2.0, 0.0, 0.0)}
BENT = {"left_knee": (0.35,), "right_knee": (0.35,), "left_hip_joint": (0.15, 0.0, 0.0)}


@pytest.mark.parametrize(("start", "highest"), [(LYING, 0.12), (BENT, 0.3)])
def test_the_prototype_lies_on_the_floor(start, highest):
    """It stays in its pose in a simulation, except for the creep."""
    prototype = read_figure("prototype")
    rest = find_resting_pose(prototype, replace(ON_FLOOR, displacements=start))
    assert rest.is_stable
    assert 0.05 < rest.height < highest
    assert rest.weight_carried == pytest.approx(1.0, abs=0.005)
    assert sum(share > 0.02 for share in rest.shares.values()) >= 3
    assert rest.energy < rest.start_energy - 50.0
    assert 0.0 < rest.creep < 0.02
    attached = attach_pose(prototype, rest)
    assert attached.turned == ()
    assert set(attached.moved) == set(prototype.bodies)
    plan = replace(ON_FLOOR, displacements=attached.displacements)
    run = simulate(prototype, plan)
    assert run.outcome.ending is Ending.DONE
    for name, rows in run.displacements.items():
        if name in attached.displacements:
            turned = rows[-1] - attached.displacements[name]
            assert np.max(np.abs(turned)) < 0.1, name
    assert run.centre_of_mass[-1, 1] == pytest.approx(rest.height, abs=2e-3)


def test_another_start_leads_to_another_pose():
    prototype = read_figure("prototype")
    prone = {"root_torso": (0.0, pi / 2.0, 0.0)}
    rests = [
        find_resting_pose(prototype, replace(ON_FLOOR, displacements=start))
        for start in (LYING, prone)
    ]
    assert abs(rests[0].height - rests[1].height) > 1e-3


@pytest.mark.parametrize(
    ("factors", "turned", "moved"),
    [(FREE, False, False), (BALL, False, True), (chain("Rz"), True, True)],
)
def test_an_attached_figure_holds_what_its_joints_can(factors, turned, moved):
    held = one_body(factors, segment=brick())
    tilted = Scene((Prop("slope", Plane((0.0, 0.0, 0.0), (0.1, 1.0, 0.15)), Surface()),))
    plan = Plan(scene=tilted, free_root=True, height=0.1)
    rest = find_resting_pose(held, plan)
    attached = attach_pose(held, rest)
    poses = forward_kinematics(build_tree(held), attached.displacements).poses
    difference = np.abs(poses["link"] - rest.poses["link"])
    assert bool(attached.turned) is turned
    assert bool(attached.moved) is moved
    assert (float(np.max(difference[:3, :3])) < 1e-9) is not turned
    assert (float(np.max(difference[:3, 3])) < 1e-9) is not moved


@pytest.mark.slow
def test_a_light_bar_that_rolls_takes_many_steps():
    """Its friction is too stiff for the steps that a stepper allows in one advance."""
    pendulum = read_figure("pendulum")
    plan = replace(ON_FLOOR, gravity=(0.0, -9.81, 0.0))
    outcome = Stepper(pendulum, plan).advance(0.5)
    assert outcome.ending is Ending.TOO_LONG
    rest = find_resting_pose(pendulum, plan)
    assert rest.is_stable
    assert rest.weight_carried == pytest.approx(1.0, abs=0.01)
