"""Rest poses: no force is left, they are downhill from the start, and simulations stay in them."""

from dataclasses import replace

import numpy as np
import pytest

from generator import read_figure
from generator.contact.scene import Scene
from generator.diagnostics import ModelError
from generator.drive import Drive
from generator.figure import Site
from generator.kinematics.links import Coordinate, Link, Links
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.simulation.statics.equilibrium import NoEquilibriumError, find_equilibrium
from springs import AxisSpring, Cubic, JointSprings, Linear, SphericalLaw, SpringSet
from tests.chains import BALL, X, Y, Z, at, body, chain, figure, ground, joint, one_body, row
from tests.runs import springs_of

NONE = SpringSet()
HANGING = body("link", centre=(0.0, -0.3, 0.0))


def moved(rest, made, plan):
    """Largest change of a displacement in a simulation from the rest pose [rad or m]."""
    start = {name: tuple(row) for name, row in rest.displacements.items()}
    run = simulate(made, replace(plan, displacements=start, stop=0.3, step=5e-3))
    assert run.outcome.succeeded
    return max(np.max(np.abs(rows - rows[0])) for rows in run.displacements.values())


def test_a_pendulum_with_a_spring_rests_where_the_closed_equation_does() -> None:
    """k (a - a0) = -m g l sin(a); and the stiffness is k + m g l cos(a)."""
    springs = springs_of("pin", AxisSpring(Z, (Linear(4.0, 1.2),)))
    plan = Plan(springs=springs)
    rest = find_equilibrium(one_body(chain("Rz"), (0.3,), HANGING), plan)
    angle = float(rest.displacements["pin"][0])
    weight = 2.0 * 9.81 * 0.3
    assert 4.0 * (angle - 1.2) + weight * np.sin(angle) == pytest.approx(0.0, abs=1e-10)
    assert rest.residual < 1e-10
    assert rest.stiffness == pytest.approx(4.0 + weight * np.cos(angle), rel=1e-6)
    about = HANGING.inertia[2] + 2.0 * 0.09
    assert rest.slowest_rate_squared == pytest.approx(rest.stiffness / about, rel=1e-6)
    assert rest.energy == pytest.approx(2.0 * (angle - 1.2) ** 2 - weight * np.cos(angle), rel=1e-9)
    assert rest.start_energy == pytest.approx(2.0 * 0.81 - weight * np.cos(0.3), rel=1e-9)
    assert rest.state.endswith("in a stable pose")


def test_the_settled_prototype_stays_put() -> None:
    """With its own springs, hung by the torso: nothing moves by a ten-millionth."""
    made = read_figure("prototype")
    rest = find_equilibrium(made)
    assert rest.residual < 1e-8
    assert rest.energy < rest.start_energy - 50.0
    # It may turn about the vertical: the joint at the ground has no spring.
    assert rest.state.endswith("some of its motions meet no force")
    assert moved(rest, made, Plan()) < 1e-7


def test_a_row_settles_by_a_law_without_an_energy() -> None:
    """The weighted law is no gradient: its rest is one of forces all the same."""
    made = row(3, (BALL,), bend=0.4, stiff=12.0)
    plan = Plan(locked=("joint0",), law=SphericalLaw.WEIGHTED)
    rest = find_equilibrium(made, plan)
    assert rest.slowest_rate_squared > 1.0
    assert rest.energy is None
    assert np.array_equal(rest.displacements["joint0"], made.joints["joint0"].displacement)
    assert moved(rest, made, plan) < 1e-7


@pytest.mark.parametrize(("rest_angle", "is_reached"), [(1.5, True), (1.6, False)])
def test_a_search_ends_at_the_pole_of_a_law_of_coordinates(rest_angle, is_reached) -> None:
    """The middle spring of a link without much weight pulls it to 86 deg, or past 90 deg."""
    axes = [AxisSpring(a, (Linear(40.0, at),)) for a, at in ((X, 0.2), (Y, rest_angle), (Z, 0.1))]
    springs = SpringSet({"pin": JointSprings("pin", tuple(axes))}, SphericalLaw.COORDINATES)
    made, plan = one_body(BALL, (0.2, 0.3, 0.1), HANGING), Plan(springs=springs)
    if is_reached:
        rest = find_equilibrium(made, plan)
        assert rest.displacements["pin"][1] == pytest.approx(rest_angle, abs=0.02)
        assert moved(rest, made, plan) < 1e-6
        return
    with pytest.raises(NoEquilibriumError, match=r"joint pin reached its pole after \d+ steps"):
        find_equilibrium(made, plan)
    other = replace(plan, law=SphericalLaw.CONSERVATIVE)
    assert moved(find_equilibrium(made, other), made, other) < 1e-6


def test_links_hold_in_the_rest_pose() -> None:
    made = row(3, (chain("Rz"),), bend=0.4)
    links = Links((Link(Coordinate("joint2", 0), Coordinate("joint1", 0), -0.5, 0.8),))
    plan = Plan(springs=NONE, links=links)
    rest = find_equilibrium(made, plan)
    q = {name: float(values[0]) for name, values in rest.displacements.items()}
    assert q["joint2"] == pytest.approx(0.8 - 0.5 * q["joint1"], abs=1e-12)
    assert rest.residual < 1e-9
    assert moved(rest, made, plan) < 1e-6


@pytest.mark.parametrize("joint_with_spring", ["crank_bearing", "rocker_pin"])
def test_a_loop_settles_with_its_sites_together(joint_with_spring) -> None:
    """Also where the joint that closes the loop has the spring."""
    made = read_figure("fourbar")
    axis = made.joints[joint_with_spring].chain[0].axis
    spring = JointSprings(joint_with_spring, (AxisSpring(axis, (Linear(3.0, 0.5),)),))
    plan = Plan(springs=SpringSet({joint_with_spring: spring}))
    rest = find_equilibrium(made, plan)
    assert rest.residual < 1e-8
    assert rest.slowest_rate_squared > 0.0
    assert moved(rest, made, plan) < 1e-6


def test_a_weight_on_a_spring_along_a_slide() -> None:
    """x = m g / k."""
    spring = AxisSpring(Y, (Linear(100.0),))
    made = one_body(chain("Ty"), (0.05,))
    rest = find_equilibrium(
        made, Plan(springs=SpringSet({"pin": JointSprings("pin", translations=(spring,))}))
    )
    assert rest.displacements["pin"][0] == pytest.approx(-2.0 * 9.81 / 100.0, abs=1e-12)
    assert rest.stiffness_unit == "N/m"


LOADS = {
    "global_force": ((3.0, 0.0, 0.0), lambda a: 3.0 * 0.4 * np.cos(a)),
    "local_force": ((3.0, 5.0, 0.0), lambda a: 3.0 * 0.4),
    "global_moment": ((1.0, 2.0, 1.5), lambda a: 1.5),
    "local_moment": ((1.0, 2.0, 1.5), lambda a: 1.5),
}


@pytest.mark.parametrize("field", LOADS)
def test_loads_written_at_sites_balance_the_weight(field) -> None:
    """At a site 0.4 m down a body that hangs: m g l sin(a) is the moment of the load."""
    value, moment = LOADS[field]
    site = Site("tip", at(shift=(0.0, -0.4, 0.0)), **{field: value})
    link = body("link", centre=(0.0, -0.3, 0.0), sites={"tip": site})
    rest = find_equilibrium(one_body(chain("Rz"), (0.1,), link), Plan(springs=NONE))
    angle = float(rest.displacements["pin"][0])
    assert 2.0 * 9.81 * 0.3 * np.sin(angle) == pytest.approx(moment(angle), abs=1e-9)


def test_an_equilibrium_that_the_figure_leaves_is_told() -> None:
    """Upside down nothing pulls, and no way leads down from there."""
    rest = find_equilibrium(one_body(chain("Rz"), (np.pi,), HANGING), Plan(springs=NONE))
    assert rest.displacements["pin"][0] == pytest.approx(np.pi, abs=1e-9)
    assert rest.steps == 0
    assert rest.stiffness == pytest.approx(-2.0 * 9.81 * 0.3, rel=1e-6)
    assert rest.state.endswith("which it leaves if disturbed")


def test_of_two_rest_poses_the_one_downhill_is_found() -> None:
    """An inverted pendulum on a soft spring falls to the side on which it starts."""
    springs = springs_of("pin", AxisSpring(Z, (Linear(1.5, np.pi),)))
    for side in (-0.2, 0.2):
        made = one_body(chain("Rz"), (np.pi + side,), HANGING)
        rest = find_equilibrium(made, Plan(springs=springs))
        assert np.sign(rest.displacements["pin"][0] - np.pi) == np.sign(side)
        assert rest.slowest_rate_squared > 0.0


def test_corners_of_laws_are_come_over() -> None:
    """A dead zone at whose edge the weight and the spring balance."""
    law = Cubic((0.0, 9.0, 1.0, 30.0), dead_zone=(-0.3, 0.2))
    springs = springs_of("pin", AxisSpring(Z, (law,)))
    made = one_body(chain("Rz"), (1.2,))
    rest = find_equilibrium(made, Plan(springs=springs))
    assert rest.residual < 1e-9
    assert moved(rest, made, Plan(springs=springs)) < 1e-6


def test_what_falls_freely_comes_to_no_rest(monkeypatch) -> None:
    monkeypatch.setattr("generator.simulation.statics.equilibrium.MAX_STEPS", 600)
    made = one_body(chain("Ty"), (0.0,))
    with pytest.raises(
        NoEquilibriumError, match=r"after .* 19.6 N still act on pin 1; pin 1 has moved 60 m"
    ):
        find_equilibrium(made, Plan(springs=NONE))


COLUMN_SPRINGS = SpringSet(
    {name: JointSprings(name, (AxisSpring(Z, (Linear(1.0),)),)) for name in ("low", "high")}
)
WEIGHTLESS = Plan(springs=COLUMN_SPRINGS, gravity=(0.0, 0.0, 0.0))
LIGHT, HEAVY = 0.5**2 / 12.0, 0.2


def column(push, inertia, low=0.0, high=0.0):
    """Two links of 0.5 m and 1 kg with springs of 1 N m/rad, pushed along the last (Ziegler)."""
    tip = Site("tip", at(shift=(0.5, 0.0, 0.0)), local_force=(-push, 0.0, 0.0))
    centre, first = (0.25, 0.0, 0.0), (0.01, 0.02, 0.02)
    return figure(
        [
            ground(),
            body("first", 1.0, first, centre, {"far": at(shift=(0.5, 0.0, 0.0))}),
            body("second", 1.0, (0.01, inertia, inertia), centre, {"tip": tip}),
        ],
        [
            joint("low", "ground.base", "first.near", chain("Rz"), (low,)),
            joint("high", "first.far", "second.near", chain("Rz"), (high,)),
        ],
    )


@pytest.mark.parametrize(
    ("push", "inertia", "flutters"),
    [(3.33, HEAVY, True), (2.5, HEAVY, False), (4.5, LIGHT, False), (5.5, LIGHT, True)],
)
def test_a_column_with_a_follower_force_flutters(push, inertia, flutters) -> None:
    """Against the quadratic of its two motions.

    The symmetric part of K says neither: it is positive with 3.33 N, and negative with 4.5 N.
    """
    rest = find_equilibrium(column(push, inertia), WEIGHTLESS)
    near, far = 0.02 + 0.25**2 + 0.5**2, inertia + 0.25**2
    both = 0.5 * 0.25
    m = np.array([[near + 2.0 * both + far, both + far], [both + far, far]])
    k = np.array([[1.0, 0.5 * push], [0.0, 1.0]])
    a, c = np.linalg.det(m), np.linalg.det(k)
    b = -(m[0, 0] * k[1, 1] + m[1, 1] * k[0, 0] - m[1, 0] * k[0, 1] - m[0, 1] * k[1, 0])
    squares = np.roots([a, b, c]).astype(complex)
    assert rest.slowest_rate_squared == pytest.approx(squares.real.min(), rel=1e-6)
    assert rest.growth == pytest.approx(np.abs(np.sqrt(squares).imag).max(), rel=1e-6)
    assert rest.stiffness == pytest.approx(1.0 - 0.25 * push, rel=1e-6)
    assert rest.stiffness_unit == "N m/rad"
    state = "it leaves in growing swings if disturbed" if flutters else "in a stable pose"
    assert rest.state.endswith(state)


@pytest.mark.parametrize(("push", "flutters"), [(3.33, True), (2.5, False)])
def test_what_flutters_leaves_its_rest_in_a_simulation(push, flutters) -> None:
    """A ten-thousandth grows as fast as `growth` says, or stays one."""
    rate = find_equilibrium(column(push, HEAVY), WEIGHTLESS).growth
    plan = replace(WEIGHTLESS, stop=12.0, tolerance=1e-5)
    run = simulate(column(push, HEAVY, 1e-4, 1e-4), plan)
    assert run.outcome.succeeded
    low = np.abs(run.displacements["low"][:, 0])
    early, late = low[run.times < 6.0].max(), low[run.times > 6.0].max()
    if flutters:
        assert late / early == pytest.approx(np.exp(6.0 * rate), rel=0.35)
    else:
        assert rate == 0.0
        assert low.max() < 2e-4


def test_what_goes_round_without_end_is_not_said_to_fall(monkeypatch) -> None:
    """Pushed harder, the column creeps round a circle of poses."""
    monkeypatch.setattr("generator.simulation.statics.equilibrium.MAX_STEPS", 600)
    with pytest.raises(NoEquilibriumError, match="still act on low 1; it stays nearby, so another"):
        find_equilibrium(column(10.0, HEAVY, 0.1, 0.1), WEIGHTLESS)


def test_props_are_refused() -> None:
    with pytest.raises(ModelError, match="find_resting_pose"):
        find_equilibrium(one_body(chain("Rz")), Plan(springs=NONE, scene=Scene.floor()))


def test_a_driven_joint_comes_to_no_rest() -> None:
    drive = Drive((0.0, 1.0), ((0.0,), (1.0,)))
    with pytest.raises(NoEquilibriumError, match="driven"):
        find_equilibrium(one_body(chain("Rz")), Plan(springs=NONE, drives={"pin": drive}))


def test_nothing_free_is_at_rest() -> None:
    rest = find_equilibrium(row(2, (BALL,)), Plan(springs=NONE, locked=("joint0", "joint1")))
    assert rest.residual == 0.0
    assert rest.stiffness is None
    assert rest.steps == 0
