"""The record of contact after each step: complete, in order, and equal to the law at its states."""

from dataclasses import replace

import numpy as np
import pytest

from generator.contact.states import evaluate_contacts
from generator.recording import Ending
from generator.simulation import compiled_run
from generator.simulation.compiled import refinement
from generator.simulation.compiled.marching import march
from generator.simulation.compiled.mechanism import CompiledModel
from generator.simulation.compiled.refinement import run_once
from generator.simulation.compiled_run import build_trace, compile_model
from generator.simulation.exudyn_model.model import ExudynModel, build_model
from generator.simulation.plan import Plan
from generator.simulation.trace import mean_position
from springs import SpringSet
from tests.contact_figures import CRATE, FLOOR, SLOPE_AND_CRATE, two_segments

FALL_TIMES = np.linspace(0.0, 0.4, 21)

PLAN = Plan(
    stop=0.4,
    springs=SpringSet(),
    scene=FLOOR,
    displacements={"root": (0.1, 0.2, -0.3, 0.0, 0.9, 0.0)},
    velocities={"hinge": (2.0,)},
)

NEAR = 0.1
"""Distance from the props beyond which the depth of a sphere is not recorded exactly [m]."""


@pytest.fixture(scope="module")
def falling() -> CompiledModel:
    """Two segments that fall on the floor."""
    return compile_model(build_model(two_segments(), PLAN))


@pytest.fixture
def _few_steps_a_call(monkeypatch) -> None:
    monkeypatch.setattr(refinement, "_LINK_STEPS_PER_CALL", 20)


@pytest.mark.parametrize("steps_per_call", [20, 1000])
def test_every_step_is_recorded(falling, monkeypatch, steps_per_call) -> None:
    """Whatever the number of steps in a call."""
    monkeypatch.setattr(refinement, "_LINK_STEPS_PER_CALL", steps_per_call)
    run = run_once(falling, FALL_TIMES, 1e-6, records_steps=True)
    times = run.path_times
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(0.4, abs=1e-12)
    assert np.all(np.diff(times) > 0.0)
    assert 0.5 * run.steps < times.size - 1 <= run.steps
    assert run.path_rows.shape == (times.size, falling.step_record)


@pytest.mark.parametrize("scene", [FLOOR, SLOPE_AND_CRATE, replace(FLOOR, props=(CRATE,))])
@pytest.mark.parametrize("self_contact", [False, True])
def test_the_record_is_the_law_at_the_states_of_the_steps(scene, self_contact) -> None:
    """The states are those of a run whose frames are the ends of the steps."""
    height = {FLOOR: 0.9, SLOPE_AND_CRATE: 1.2}.get(scene, 1.2)
    plan = replace(
        PLAN,
        scene=scene,
        self_contact=self_contact,
        displacements={"root": (0.1, 0.2, -0.3, 0.2, height, -0.1)},
    )
    model = build_model(two_segments(), plan)
    compiled = compile_model(model)
    run = run_once(compiled, FALL_TIMES, 1e-6, records_steps=True)
    frames = np.union1d(run.path_times, [plan.stop])
    again = run_once(compiled, frames, 1e-6, records_steps=True)
    assert again.path_times == pytest.approx(run.path_times, abs=1e-12)
    steps = compiled_run._contact_steps(model, compiled, run)
    trace = build_trace(model, compiled, again.times, again.states, again.links)
    assert_recorded(model, steps, trace)


def assert_recorded(model: ExudynModel, steps, trace) -> None:
    """The steps have forces, depths, rates, centres and accelerations of the trace."""
    assert model.contacts is not None
    expected = evaluate_contacts(
        model.contacts,
        model.figure,
        trace.positions,
        trace.rotations,
        trace.velocities,
        trace.angular_velocities,
    )
    count = len(steps.times)
    largest = np.max(np.abs(expected.forces))
    assert largest > 10.0
    assert steps.forces == pytest.approx(expected.forces[:count], abs=1e-9 * largest)
    near = expected.depths[:count] > -NEAR
    assert 0.1 * near.size < np.count_nonzero(near)
    assert steps.depths[near] == pytest.approx(expected.depths[:count][near], abs=1e-9)
    assert steps.rates[near] == pytest.approx(expected.rates[:count][near], abs=1e-9)
    assert np.all(steps.depths[~near] <= -NEAR)
    centres = mean_position(model.figure, trace.positions)
    assert steps.centres == pytest.approx(centres[:count], abs=1e-9)
    accelerations = trace.accelerations[:count, :, 3:]
    size = np.max(np.abs(accelerations))
    assert steps.accelerations == pytest.approx(accelerations, abs=1e-9 * size)


def test_an_interrupt_keeps_the_record_of_the_frames(falling, monkeypatch) -> None:
    """Ctrl-C arrives when compiled code returns, before its result is stored."""
    monkeypatch.setattr(refinement, "_LINK_STEPS_PER_CALL", 100)
    calls: list[int] = []

    def march_until_interrupted(*arguments):
        status = march(*arguments)
        calls.append(status)
        if len(calls) == 5:
            raise KeyboardInterrupt
        return status

    monkeypatch.setattr(refinement, "march", march_until_interrupted)
    run = run_once(falling, FALL_TIMES, 1e-9, records_steps=True)
    assert run.ending is Ending.INTERRUPTED
    assert len(run.times) >= 2
    assert run.path_times[-1] == run.last_time >= run.times[-1]
    assert np.all(np.diff(run.path_times) > 0.0)


@pytest.mark.usefixtures("_few_steps_a_call")
def test_of_a_long_run_some_steps_are_kept(falling, monkeypatch) -> None:
    """All of the beginning, a tenth of what follows, and the last two calls."""
    every = run_once(falling, FALL_TIMES, 1e-7, records_steps=True)
    kept = 40
    monkeypatch.setattr(refinement, "MAX_PATH_STEPS", kept)
    some = run_once(falling, FALL_TIMES, 1e-7, records_steps=True)
    assert np.all(np.isin(some.path_times, every.path_times))
    assert np.array_equal(some.path_times[:kept], every.path_times[:kept])
    assert np.array_equal(some.path_times[-20:], every.path_times[-20:])
    middle = every.path_times[kept + 20 : -40]
    assert middle.size > 40
    assert 2 <= np.count_nonzero(np.isin(middle, some.path_times)) < 0.25 * middle.size
    places = np.searchsorted(every.path_times, some.path_times)
    assert np.array_equal(some.path_rows, every.path_rows[places])


def test_without_being_asked_for_no_step_is_recorded(falling) -> None:
    run = run_once(falling, FALL_TIMES, 1e-4)
    assert run.path_times.size == run.path_rows.size == 0
