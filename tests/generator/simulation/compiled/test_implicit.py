"""The linearly implicit method: its stages, its order, stiff joints and surfaces, falls."""

from dataclasses import replace

import numpy as np
import pytest

from generator import read_figure
from generator.contact.scene import Scene, floor_prop
from generator.diagnostics import ModelError
from generator.recording import Ending, Integrator
from generator.simulation.compiled.implicit import make_tangents, solve_stage
from generator.simulation.compiled.mechanism import CompiledModel
from generator.simulation.compiled.refinement import (
    CompiledRun,
    StiffMotionError,
    joint_differences,
    run_once,
)
from generator.simulation.compiled_run import compile_model
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet
from springs.contact import Surface
from tests.chains import BALL, X, Y, Z, chain, one_body, row
from tests.contact_figures import FLOOR, two_segments
from tests.contact_figures import ball as free_ball
from tests.runs import springs_of

FALL = Plan(
    stop=1.0,
    springs=SpringSet(),
    scene=FLOOR,
    displacements={"root": (0.1, 0.2, -0.3, 0.0, 0.9, 0.0)},
    velocities={"hinge": (2.0,)},
)


def implicit_run(model: CompiledModel, times: np.ndarray, tolerance: float) -> CompiledRun:
    return run_once(model, times, tolerance, is_implicit=True)


def stage(
    model: CompiledModel,
    state: np.ndarray,
    g: float,
    stiffness: float = 0.0,
    damping: float = 0.0,
) -> np.ndarray:
    """Rates of the first stage, with one stiffness and damping of all measured joints."""
    mechanism, tangents = model.mechanism, make_tangents(model.mechanism)
    for table, value in ((tangents.stiffness, stiffness), (tangents.damping, damping)):
        table[:, [0, 3, 5]] = value
    added = np.zeros((len(mechanism.links), 6))
    scratch, rates = model.scratch._replace(added_inertia=added), np.zeros_like(state)
    laws = model.equations.laws
    solve_stage(laws, mechanism, scratch, tangents, 0, 0.0, state, g, False, rates)
    return rates


def explicit_rates(model: CompiledModel, state: np.ndarray) -> np.ndarray:
    """Rates of a state by the evaluation that is compared with Exudyn's."""
    run = run_once(replace(model, initial_state=state), np.array([0.0, 1e-9]), 1e-6)
    return run.rates[0]


def test_a_stage_of_no_length_is_the_evaluation() -> None:
    """In states of a fall, above the floor and on it."""
    model = compile_model(build_model(two_segments(), FALL))
    run = run_once(model, np.linspace(0.0, 1.0, 21), 1e-8)
    touching = 0
    for state, rates in zip(run.states, run.rates, strict=True):
        found = stage(model, state, 1e-12)
        assert found == pytest.approx(rates, rel=1e-7, abs=1e-7 * np.max(np.abs(rates)))
        touching += bool(np.any(model.scratch.contact_forces))
    assert touching >= 3


@pytest.mark.parametrize("g", [1e-3, 1e-1, 10.0])
def test_the_stage_of_a_hinge_has_a_closed_form(g: float) -> None:
    """(I + g d + g^2 k) a = torque - g k v."""
    k, d, x, v = 50.0, 3.0, 0.3, -2.0
    spring = AxisSpring(Z, (Linear(k),), Damping(d))
    plan = Plan(
        springs=springs_of("pin", spring),
        gravity=(0.0, 0.0, 0.0),
        displacements={"pin": (x,)},
        velocities={"pin": (v,)},
    )
    model = compile_model(build_model(one_body(chain("Rz")), plan))
    place = model.rate_places[0]
    inertia = (-k * x - d * v) / explicit_rates(model, model.initial_state)[place]
    rates = stage(model, model.initial_state, g, k, d)
    expected = (-k * x - d * v - g * k * v) / (inertia + g * d + g * g * k)
    assert rates[place] == pytest.approx(expected, rel=1e-12)
    assert rates[0] == pytest.approx(v + g * expected, rel=1e-12)


@pytest.mark.parametrize("made", [row(3, stiff=30.0, damp=0.3), row(2, (BALL, BALL), stiff=5.0)])
def test_the_error_falls_with_the_square_of_the_steps(made) -> None:
    plan = Plan(stop=0.5, velocities={"joint0": tuple(np.ones(len(made.joints["joint0"].chain)))})
    model, times = compile_model(build_model(made, plan)), np.linspace(0.0, 0.5, 6)
    exact = run_once(model, times, 1e-12)
    steps, errors = [], []
    for tolerance in (1e-4, 1e-5, 1e-6, 1e-7):
        run = implicit_run(model, times, tolerance)
        assert run.ending is Ending.DONE
        steps.append(run.steps)
        errors.append(float(np.max(joint_differences(model, run, exact))))
    power = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert -2.6 < power < -1.6
    assert errors[-1] < 1e-4


def test_stiff_joints_need_no_short_steps() -> None:
    """Balls a hundred thousand times stiffer, whose fast motion is damped, move as rigid ones."""
    axes = [AxisSpring(axis, (Linear(1e6),), Damping(1e3)) for axis in (X, Y, Z)]
    springs = SpringSet({f"joint{k}": JointSprings(f"joint{k}", tuple(axes)) for k in (1, 2)})
    straight = {"joint1": (0.0, 0.0, 0.0), "joint2": (0.0, 0.0, 0.0)}
    plan = Plan(stop=0.5, springs=springs, displacements=straight)
    model, times = compile_model(build_model(row(3), plan)), np.linspace(0.0, 0.5, 6)
    run = implicit_run(model, times, 1e-4)
    locked = replace(plan, springs=SpringSet(), locked=("joint1", "joint2"))
    rigid = simulate(row(3), replace(locked, frame=0.1))
    assert run.ending is Ending.DONE
    assert run.steps < 1000
    with pytest.raises(StiffMotionError):
        run_once(model, times, 1e-4)
    stiff = simulate(
        row(3), replace(plan, frame=0.1, tolerance=1e-4, integrator=Integrator.IMPLICIT)
    )
    tip = list(rigid.poses)[-1]
    assert stiff.poses[tip][:, :3, 3] == pytest.approx(rigid.poses[tip][:, :3, 3], abs=2e-3)


@pytest.mark.parametrize("stiffness", [3e4, 2e6])
def test_a_stiff_surface(stiffness: float) -> None:
    """A ball that bounces: its energy is that of the tight run, in fewer steps."""
    surface = Surface(stiffness=stiffness, transition_depth=1e-4, friction_speed=0.005)
    plan = Plan(
        stop=0.5,
        springs=SpringSet(),
        scene=Scene((floor_prop(Y, surface),)),
        velocities={"pin": (0.0, 0.0, 3.0, 1.0, 0.0, 0.0)},
    )
    model, times = compile_model(build_model(free_ball(0.2), plan)), np.linspace(0.0, 0.5, 11)
    tight, run = run_once(model, times, 1e-8), implicit_run(model, times, 1e-4)
    lost, expected = run.states[-1, -5:], tight.states[-1, -5:]
    assert run.steps < tight.steps
    assert lost[3:] == pytest.approx(expected[3:], rel=0.02)


def test_a_fall_is_recorded_as_by_the_tight_method() -> None:
    plan = replace(FALL, tolerance=1e-5)
    tight = simulate(two_segments(), plan)
    fast = simulate(two_segments(), replace(plan, integrator=Integrator.IMPLICIT))
    assert fast.integrator is Integrator.IMPLICIT
    assert fast.outcome.ending is Ending.DONE
    assert fast.accuracy.estimate is fast.accuracy.tolerance is None
    assert fast.agreement_with_exudyn is not None
    assert fast.agreement_with_exudyn < 1e-9
    one, other = fast.contact, tight.contact
    assert one is not None
    assert other is not None
    assert one.max_force == pytest.approx(other.max_force, rel=0.02)
    assert one.dissipated == pytest.approx(other.dissipated, rel=0.02)
    for name, expected in other.segments.items():
        found = one.segments[name]
        assert found.first_time == pytest.approx(expected.first_time, abs=1e-3)
        assert found.impulse == pytest.approx(expected.impulse, abs=0.02 * other.max_force)
    balance = sum(values for values in fast.energy.values())
    exchanged = np.ptp(fast.energy["gravity"])
    assert np.max(np.abs(balance - balance[0])) < 3e-4 * exchanged


def test_large_friction_leaves_the_forces_right() -> None:
    surface = Surface(friction=10.0)
    plan = replace(
        FALL,
        scene=Scene((floor_prop(Y, surface),)),
        displacements={"root": (0.1, 0.2, 1.3, 0.0, 1.9, 0.0)},
    )
    tight = simulate(two_segments(), plan).contact
    fast = simulate(two_segments(), replace(plan, integrator=Integrator.IMPLICIT)).contact
    assert tight is not None
    assert fast is not None
    assert fast.max_force == pytest.approx(tight.max_force, rel=0.02)


def test_a_half_turn_ends_the_run() -> None:
    axes = tuple(AxisSpring(axis, (Linear(0.9),)) for axis in (X, Y, Z))
    plan = Plan(
        springs=springs_of("pin", *axes),
        displacements={"pin": (3.0, 0.0, 0.0)},
        velocities={"pin": (5.0, 0.0, 0.0)},
        gravity=(0.0, 0.0, 0.0),
    )
    model = compile_model(build_model(one_body(BALL), plan))
    run = implicit_run(model, np.linspace(0.0, 1.0, 21), 1e-4)
    assert run.ending is Ending.TURNED_OVER
    assert run.turned_joint == "pin"


def test_closed_loops_are_refused() -> None:
    plan = Plan(stop=0.1, integrator=Integrator.IMPLICIT)
    with pytest.raises(ModelError, match="without closed loops, links and displacements"):
        simulate(read_figure("fourbar"), plan)
