"""A motion in the figure's own terms: displacements, rates, and each kind of energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from generator import read_figure
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene, floor_prop
from generator.joint_chain import build_chain
from generator.recording import CONTACT_ENERGY_KINDS, ENERGY_KINDS
from generator.rotations import inverse_pose, rotation_vector_from_matrix
from generator.run_options import Integrator
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, JointSprings, Linear, SphericalLaw, SpringSet
from springs.contact import Surface
from tests.chains import BALL, FREE, X, Y, Z, at, body, chain, figure, ground, joint, one_body, row
from tests.contact_figures import FLOOR, with_spheres
from tests.runs import energy_error

PROTOTYPE = read_figure("prototype")
NONE = SpringSet()


def test_displacements_and_poses_tell_the_same() -> None:
    start = {"left_shoulder": (0.4, -0.8, 0.3), "right_shoulder": (0.5, 0.3, -0.6)}
    run = simulate(PROTOTYPE, Plan(stop=0.3, tolerance=1e-4, displacements=start))
    for name, values in start.items():
        assert run.displacements[name][0] == pytest.approx(values, abs=1e-9)
    for name, each in PROTOTYPE.joints.items():
        parent, child = (
            run.poses[ref.segment] @ PROTOTYPE.site(ref).pose_in_segment for ref in each.ends
        )
        between = inverse_pose(parent) @ child
        turned = build_chain(each.chain).pose(run.displacements[name])[:, :3, :3]
        assert np.max(np.abs(turned - between[:, :3, :3])) < 1e-5
        vectors = rotation_vector_from_matrix(between[:, :3, :3])
        assert np.allclose(run.rotation_vectors[name], vectors, atol=1e-9)


@pytest.mark.parametrize("factors", [BALL, chain("Rx Ry"), chain("R-z"), FREE])
def test_rates_are_the_slopes_of_displacements(factors) -> None:
    size = len(factors)
    rates = np.cos(1.0 + np.arange(size))
    run = simulate(
        one_body(factors, 0.2 * rates),
        Plan(stop=0.1, step=1e-4, frame=1e-3, springs=NONE, velocities={"pin": rates}),
    )
    assert run.velocities["pin"][0] == pytest.approx(rates, abs=1e-9)
    values = run.displacements["pin"]
    slopes = (values[2:] - values[:-2]) / 2e-3
    assert np.max(np.abs(slopes - run.velocities["pin"][1:-1])) < 1e-3


def spinning(first: float, rate: tuple[float, float, float]):
    """A free wheel on a ball joint that starts at the middle angle `first`."""
    wheel = body("link", centre=(0.0, 0.0, 0.0), inertia=(0.03, 0.03, 0.03))
    plan = Plan(stop=1.0, step=1e-3, springs=NONE, velocities={"pin": rate})
    return simulate(one_body(BALL, (0.4, first, -0.3), wheel), plan)


def test_displacements_run_on_through_a_pole() -> None:
    """Turned about the middle axis from 1 to 9 rad: past five poles, without a jump."""
    run = spinning(1.0, (0.0, 8.0, 0.0))
    expected = np.stack([0.4 + 0 * run.times, 1.0 + 8.0 * run.times, -0.3 + 0 * run.times], axis=1)
    assert np.max(np.abs(run.displacements["pin"] - expected)) < 1e-4


@pytest.mark.parametrize("pole", [np.pi / 2, -np.pi / 2])
def test_the_first_frame_at_a_pole_shares_the_turn(pole) -> None:
    """Eq. 3.14 and the corrected 3.15, whatever triple was written; later frames go on from it."""
    run = simulate(one_body(BALL, (0.4, pole, -0.3)), Plan(stop=0.1, step=1e-3, springs=NONE))
    first, middle, last = run.displacements["pin"][0]
    assert middle == pytest.approx(pole)
    assert abs(first) == pytest.approx(abs(last))
    total = last - np.sign(pole) * first
    assert total == pytest.approx(-0.3 - np.sign(pole) * 0.4)
    assert np.max(np.abs(np.diff(run.displacements["pin"], axis=0)[:, 1])) < 0.1


def test_whole_turns_of_the_start_are_kept() -> None:
    start = (0.2 + 2 * np.pi, 0.3, 0.1 - 4 * np.pi)
    run = simulate(row(1), Plan(stop=0.1, step=1e-3, springs=NONE, displacements={"joint0": start}))
    assert run.displacements["joint0"][0] == pytest.approx(start, abs=1e-9)
    assert np.max(np.abs(np.diff(run.displacements["joint0"], axis=0))) < 0.5


def test_the_ground_stands_still() -> None:
    """All its parts, those on joints without freedom included."""
    table = replace(body("table"), mass=-1.0)
    made = figure(
        [ground(top=at((0.3, 0.0, 0.0), (0.0, 1.0, 0.0))), table, body("link")],
        [
            joint("bolt", "ground.top", "table.near", ()),
            joint("pin", "table.near", "link.near", BALL, (0.1, 0.2, 0.3)),
        ],
    )
    run = simulate(made, Plan(stop=0.2, step=1e-3, springs=NONE))
    assert np.all(run.poses["ground"] == np.eye(4))
    assert np.all(run.poses["table"] == run.poses["table"][0])
    assert run.poses["table"][0, 1, 3] == 1.0
    assert run.displacements["bolt"].shape == (len(run.times), 0)
    assert np.allclose(run.reactions["bolt"], 0.0)
    assert np.ptp(run.poses["link"][:, 1, 1]) > 0.01


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
    springs = SpringSet({"pin": JointSprings("pin", axes)}, SphericalLaw.CONSERVATIVE)
    run = simulate(one_body(BALL, (0.3, 0.2, 0.5)), Plan(stop=0.02, step=1e-3, springs=springs))
    r = run.rotation_vectors["pin"][0]
    expected = 0.5 * np.array([4.0, 6.0, 8.0]) @ (r - 0.1) ** 2
    assert run.energy["spring"][0] == pytest.approx(expected)


def test_the_balance_adds_up() -> None:
    run = simulate(row(2, stiff=5.0, damp=0.1), Plan(stop=0.3, step=5e-4))
    total = sum(run.energy[k] for k in ("kinetic", "gravity", "spring", "dissipated"))
    assert np.allclose(run.energy_balance, total - run.energy["work"])
    assert energy_error(run) < 1e-3


# Reactions with contact

UPPER, LOWER = 1.5, 2.0


def column(factors=()):
    """A block that stands on four spheres, and another one on it, which touches nothing."""
    feet = [((x, -0.08, z), 0.02) for x in (-0.2, 0.2) for z in (-0.2, 0.2)]
    lower = with_spheres(
        body("lower", LOWER, centre=(0.0, 0.0, 0.0), sites={"top": at(shift=(0.05, 0.1, 0.0))}),
        *feet,
    )
    upper = with_spheres(body("upper", UPPER, centre=(0.02, 0.15, 0.01)), ((0.0, 0.2, 0.0), 0.05))
    return figure(
        [ground(), lower, upper],
        [
            joint("root", "ground.base", "lower.near", FREE, (0.0, 0.0, 0.0, 0.0, 0.1, 0.0)),
            joint("neck", "lower.top", "upper.near", factors),
        ],
    )


def stand(stop: float = 0.6, **fields):
    """The column starts 1 mm above a floor that damps well, and comes to rest."""
    scene = Scene((floor_prop(Y, Surface(damping=20.0)),))
    start = {"root": (0.0, 0.0, 0.0, 0.0, 0.101, 0.0)}
    plan = Plan(stop=stop, springs=NONE, scene=scene, displacements=start, **fields)
    return simulate(column(), plan)


@pytest.mark.parametrize("integrator", list(Integrator))
def test_a_joint_carries_the_weight_above_it(integrator) -> None:
    """At rest: of the upper block; the floor that of both, and the free root nothing."""
    run = stand(integrator=integrator, tolerance=1e-5)
    assert run.outcome.succeeded
    assert run.integrator is integrator
    to_world = run.poses["lower"][-1, :3, :3]
    force, moment = (to_world @ part for part in np.split(run.reactions["neck"][-1], 2))
    assert force == pytest.approx(np.array([0.0, UPPER * 9.81, 0.0]), abs=2e-3)
    # About the site, the weight at the upper centre of mass needs a moment against its arm.
    arm, weight = to_world @ [0.02, 0.15, 0.01], np.array([0.0, -UPPER * 9.81, 0.0])
    assert moment == pytest.approx(-np.cross(arm, weight), abs=2e-3)
    carried = run.contact.ground_reaction[-1, :3]
    assert carried == pytest.approx(np.array([0.0, (LOWER + UPPER) * 9.81, 0.0]), abs=2e-2)
    assert np.max(np.abs(run.reactions["root"])) < 1e-8
    assert np.all(run.contact.forces["upper"] == 0.0)
    assert run.contact.weight_carried == pytest.approx(1.0, abs=2e-3)


def test_reactions_of_both_integrators_are_alike_in_an_impact() -> None:
    fields = {"stop": 0.04, "frame": 1e-3, "tolerance": 1e-6}
    found, expected = (
        stand(integrator=each, **fields) for each in (Integrator.COMPILED, Integrator.EXUDYN)
    )
    sizes = np.abs(expected.reactions["neck"][:, 1])
    assert np.max(sizes) > 1.1 * UPPER * 9.81
    assert np.min(sizes) < 0.1 * UPPER * 9.81
    for name in ("neck", "root"):
        difference = np.abs(found.reactions[name] - expected.reactions[name])
        assert np.max(difference) < 1e-2 * np.max(sizes)


def test_a_joint_transmits_what_accelerates_the_body_beyond_it() -> None:
    """Newton's law for the upper block on a hinge, in a tumbling fall with several contacts."""
    made = column(chain("Rz"))
    start = {"root": (0.4, 0.2, 2.2, 0.0, 0.6, 0.0), "neck": (0.3,)}
    plan = Plan(
        stop=0.5, frame=1e-3, springs=NONE, scene=FLOOR, displacements=start, tolerance=1e-7
    )
    run = simulate(made, plan)
    assert run.integrator is Integrator.COMPILED
    segment, pose = made.segments["upper"], run.poses["upper"]
    centre = pose[:, :3, 3] + pose[:, :3, :3] @ segment.centre_of_mass
    acceleration = (centre[2:] - 2.0 * centre[1:-1] + centre[:-2]) / 1e-6
    external = run.contact.forces["upper"][1:-1] + UPPER * np.array([0.0, -9.81, 0.0])
    needed = UPPER * acceleration - external
    to_world = run.poses["lower"][1:-1, :3, :3]
    found = (to_world @ run.reactions["neck"][1:-1, :3, None])[..., 0]
    errors = np.linalg.norm(found - needed, axis=1)
    touched = np.linalg.norm(run.contact.forces["upper"], axis=1) > 1.0
    assert 0.02 < np.mean(touched) < 0.98
    assert np.max(np.linalg.norm(needed, axis=1)) > 30.0
    # The differences of positions miss what changes within 1 ms.
    assert np.median(errors) < 1e-2 * UPPER * 9.81
    assert np.mean(errors < 0.05 * np.max(np.linalg.norm(needed, axis=1))) > 0.9
    assert np.max(np.abs(run.reactions["root"])) < 1e-7


def test_a_joint_to_the_ground_carries_what_the_floor_does_not() -> None:
    """A bar on a hinge, at rest on a floor with its far end: half of its weight each."""
    bar = with_spheres(
        body("link", 2.0, (0.02,) * 3, (0.5, 0.0, 0.0)),
        ((1.0, 0.0, 0.0), 0.05),
    )
    made = one_body(chain("Rz"), segment=bar)
    scene = Scene((Prop("floor", Plane((0, -0.052, 0), Y), Surface(damping=20.0, friction=0.0)),))
    run = simulate(made, Plan(stop=1.5, springs=NONE, scene=scene, tolerance=1e-5))
    half = 0.5 * 2.0 * 9.81
    assert run.contact.ground_reaction[-1, 1] == pytest.approx(half, rel=1e-3)
    assert run.reactions["pin"][-1, 1] == pytest.approx(half, rel=1e-3)
    assert run.contact.weight_carried == pytest.approx(0.5, rel=1e-3)


def test_kinds_of_energy_with_contact() -> None:
    """In the order of the kinds, the losses never less than before, the book closed."""
    run = stand(tolerance=1e-7)
    assert tuple(run.energy) == (*ENERGY_KINDS, *CONTACT_ENERGY_KINDS)
    for kind in ("contact damping", "friction"):
        assert np.min(np.diff(run.energy[kind])) >= -1e-12
    assert energy_error(run) < 1e-8
    assert run.energy["contact damping"][-1] > 0.01
    pose, surface = run.poses["lower"][-1], Surface()
    feet = np.array([[x, -0.08, z] for x in (-0.2, 0.2) for z in (-0.2, 0.2)])
    depths = 0.02 - (feet @ pose[:3, :3].T + pose[:3, 3])[:, 1]
    k, e = surface.stiffness, surface.transition_depth
    stored = k * depths**4 * (0.25 / e**2 - 0.1 * depths / e**3)
    assert np.all((depths > 0.0) & (depths < e))
    assert run.energy["contact"][-1] == pytest.approx(np.sum(stored), rel=1e-9)
    assert run.contact.depths["lower"][-1] == pytest.approx(np.max(depths), rel=1e-9)
