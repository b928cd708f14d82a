"""Work of damping and loads is summed at every step, whatever the frames."""

from dataclasses import replace

import numpy as np
import pytest

from generator.figure import SiteRef
from generator.loads import LoadKind, constant_load
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.exudyn_model.sensors import SensorLog
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SphericalLaw, SpringSet
from tests.chains import BALL, X, Y, Z, body, chain, one_body, row
from tests.contact_figures import FLOOR, ball, block, two_segments
from tests.runs import springs_of

NONE = SpringSet()


@pytest.mark.parametrize("frame", [1e-3, 0.02, 0.03, 0.25])
def test_sums_do_not_depend_on_the_frames(frame) -> None:
    """Over one reading of the meters and over many."""
    figure = row(2, (BALL, chain("Rz")), stiff=4.0, damp=0.1)
    load = constant_load(SiteRef("bar1", "far"), LoadKind.LOCAL_FORCE, (0.5, 1.0, -0.5), -1.0, 2.0)
    runs = [
        simulate(figure, Plan(stop=0.75, step=1e-3, frame=f, loads=[load])) for f in (0.05, frame)
    ]
    for kind in ("dissipated", "work"):
        one, other = (run.energy[kind][-1] for run in runs)
        assert abs(one) > 1e-3
        assert other == pytest.approx(one, rel=1e-6)


@pytest.mark.parametrize(
    ("damping", "rate_at"),
    [
        (Damping(0.08), lambda t: 10.0 * np.exp(-0.08 / 0.04 * t)),
        (Damping(0.0, 0.2), lambda t: 10.0 - 5.0 * t),
    ],
    ids=["viscous", "Coulomb"],
)
def test_what_damping_takes_from_a_wheel_is_dissipated(damping, rate_at) -> None:
    wheel = body("link", centre=(0.0, 0.0, 0.0), inertia=(0.02, 0.03, 0.04))
    springs = springs_of("pin", AxisSpring(Z, (), damping))
    plan = Plan(stop=1.0, tolerance=1e-6, springs=springs, velocities={"pin": (10.0,)})
    run = simulate(one_body(chain("Rz"), (0.0,), wheel), plan)
    rate = rate_at(run.times)
    assert np.max(np.abs(run.velocities["pin"][:, 0] - rate)) < 1e-6
    assert np.max(np.abs(run.energy["dissipated"] - 0.02 * (100.0 - rate**2))) < 1e-6


def test_the_weighted_law_s_work_is_its_springs_energy() -> None:
    """For a turn about one axis the work against the law is the energy that the axis stores."""
    law = Cubic((0.0, 6.0, 1.0, 8.0))
    axes = tuple(AxisSpring(a, (law if a is Z else Linear(5.0),)) for a in (X, Y, Z))
    springs = SpringSet({"pin": JointSprings("pin", axes)}, SphericalLaw.WEIGHTED)
    link = body("link", centre=(0.0, -0.2, 0.0))
    run = simulate(
        one_body(BALL, (0.0, 0.0, 0.5), link), Plan(stop=0.5, step=2e-4, springs=springs)
    )
    angle = run.displacements["pin"][:, 2]
    stored = law.energy(angle) - law.energy(angle[0])
    assert np.max(np.abs(run.energy["spring"] - stored)) < 1e-5


def test_without_springs_and_loads_nothing_is_summed() -> None:
    run = simulate(row(2), Plan(stop=0.1, step=1e-3, springs=NONE))
    assert np.all(run.energy["dissipated"] == 0.0)
    assert np.all(run.energy["work"] == 0.0)
    assert np.all(run.energy["spring"] == 0.0)


# Contact


def exudyn_fall(made, step: float, frame: float = 0.02, stop: float = 0.3):
    """A fall on the floor by Exudyn's integrator with a fixed step."""
    return simulate(made, Plan(stop=stop, step=step, frame=frame, springs=NONE, scene=FLOOR))


@pytest.mark.parametrize("frame", [0.001, 0.02, 0.25])
def test_integrals_of_contact_do_not_depend_on_the_frames(frame) -> None:
    """Nor do the steps, of which a reading covers one frame or many."""
    made = ball(0.05)
    one, other = (exudyn_fall(made, 1e-3, f, 0.25) for f in (0.05, frame))
    for kind in ("contact damping", "friction"):
        assert other.energy[kind][-1] == pytest.approx(one.energy[kind][-1], rel=1e-6)
    a, b = (run.contact.segments["link"] for run in (one, other))
    assert b.impulse == pytest.approx(a.impulse, rel=1e-6, abs=1e-9)
    assert b.peak_force == pytest.approx(a.peak_force, rel=1e-6)
    assert b.first_time == pytest.approx(a.first_time, abs=1e-6)
    assert one.contact.dissipated > 0.5


def test_the_impulses_are_the_change_of_momentum() -> None:
    """Of each step, and so of all frames, although the forces are those at the ends of steps."""
    made = two_segments()
    plan = Plan(
        stop=0.3,
        step=2e-4,
        springs=NONE,
        scene=FLOOR,
        displacements={"root": (0.1, 0.2, -0.3, 0.0, 0.8, 0.0)},
        velocities={"root": (0.0, 0.0, 0.0, 0.5, -1.0, 0.2)},
    )
    impulse = np.sum(
        [part.impulse for part in simulate(made, plan).contact.segments.values()], axis=0
    )
    # The same steps, with frames on both sides of the end, by which its velocity is found.
    longer = simulate(made, replace(plan, stop=0.301, frame=1e-3)).centre_of_mass
    end, start = (longer[-1] - longer[-3]) / 2e-3, np.array([0.5, -1.0, 0.2])
    gained = made.total_mass * (end - start + np.array([0.0, 9.81 * 0.3, 0.0]))
    assert np.linalg.norm(impulse) > 3.0
    assert impulse == pytest.approx(gained, abs=1e-3 * np.linalg.norm(impulse))


@pytest.mark.parametrize("made", [ball(0.05), block(0.07)], ids=["ball", "block"])
def test_integrals_of_contact_converge_to_those_of_the_compiled_run(made) -> None:
    """With the square of the step, the order of the trapezoidal rule."""
    fields = {"velocities": {"pin": (0.0, 0.0, 0.0, 0.7, 0.0, 0.2)}, "stop": 0.2}
    plan = Plan(springs=NONE, scene=FLOOR, tolerance=1e-8, **fields)
    exact = simulate(made, plan)
    exact_impulse = np.array(exact.contact.segments["link"].impulse)
    errors = []
    for step in (4e-4, 1e-4):
        run = simulate(made, replace(plan, step=step))
        impulse = np.array(run.contact.segments["link"].impulse)
        losses = [
            run.energy[kind][-1] - exact.energy[kind][-1]
            for kind in ("contact damping", "friction")
        ]
        errors.append(max(np.max(np.abs(losses)), np.max(np.abs(impulse - exact_impulse))))
        depths = run.contact.depths["link"] - exact.contact.depths["link"]
        assert np.max(np.abs(depths)) < 1e-4
    assert exact.contact.dissipated > 0.3
    assert np.linalg.norm(exact_impulse) > 1.0
    assert errors[1] < 1e-3
    assert errors[1] < 0.15 * errors[0]


def test_the_path_of_exudyn_s_steps_begins_at_the_start() -> None:
    """With a touch at the first step, and the acceleration of free fall before any."""
    run = exudyn_fall(ball(0.0), 1e-3, stop=0.1)
    assert run.contact.segments["link"].first_time == 0.0
    assert run.contact.max_force > 1.0


def test_without_a_scene_no_contact_is_read() -> None:
    log = SensorLog(build_model(ball(0.1), Plan(springs=NONE)))
    assert log.contact_trace(log.work[None]) is None
    assert log.work.shape == (4,)
    with_floor = SensorLog(build_model(ball(0.1), Plan(springs=NONE, scene=FLOOR)))
    assert with_floor.work.shape == (9,)
    trace = with_floor.contact_trace(with_floor.work[None])
    assert trace.steps.times.tolist() == [0.0]
    assert trace.steps.depths == pytest.approx(np.array([[-0.1]]))
    assert trace.steps.centres == pytest.approx(np.array([[0.0, 0.2, 0.0]]))
