"""The estimate of a run's own error is honest: the true one is not above three times it."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from generator import read_figure
from generator.contact.states import ContactSteps, ContactTrace
from generator.recording import Ending
from generator.rotations import rotation_vector_from_matrix
from generator.run_options import Integrator
from generator.simulation.exudyn_run import (
    LONGEST_STEP,
    LONGEST_STEP_WITH_CONTACT,
    first_step,
    richardson_extrapolation,
)
from generator.simulation.plan import Plan
from generator.simulation.run import Progress, simulate
from generator.simulation.trace import Trace
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SpringSet
from tests.chains import BALL, X, Y, Z, body, chain, one_body, row
from tests.contact_figures import FLOOR, MASS, ball, two_segments
from tests.runs import springs_of

PROTOTYPE = read_figure("prototype")
NONE = SpringSet()
CORNERED = SpringSet(
    {
        "pin": JointSprings(
            "pin",
            (AxisSpring(Z, (Cubic((0.0, 9.0, 1.0, 30.0), dead_zone=(-0.3, 0.2)),), Damping(0.05)),),
        )
    }
)

RUNS = {
    "pendulum": (one_body(chain("Rz"), (1.0,)), {"stop": 2.0, "springs": NONE}),
    "spherical pendulum": (
        one_body(BALL, (1.0, 0.3, 0.2)),
        {"stop": 2.0, "springs": NONE, "velocities": {"pin": (1.0, 2.0, -1.0)}},
    ),
    "hinge with a dead zone": (
        one_body(chain("Rz"), (1.0,), body("link", centre=(0.0, -0.3, 0.0))),
        {"stop": 2.0, "springs": CORNERED},
    ),
    "chain": (row(3, (BALL, chain("Rz"))), {"stop": 1.0, "springs": NONE}),
    "sprung chain": (row(4, (BALL, chain("Ry")), stiff=5.0, damp=0.05), {"stop": 1.0}),
    "prototype": (PROTOTYPE, {"stop": 0.4}),
    "bent prototype": (
        PROTOTYPE,
        {
            "stop": 0.2,
            "displacements": {
                "left_hip_joint": (0.3, 0.2, 0.5),
                "right_elbow": (1.7,),
                "waist": (0.3, 0.2, 0.1),
            },
        },
    ),
}


@cache
def reference(name: str):
    """The figure of a run, and the run at a tolerance that makes its error small beside others'."""
    figure, plan = RUNS[name]
    return figure, simulate(figure, Plan(tolerance=1e-10 if "pendulum" in name else 1e-8, **plan))


def differences(figure, one, other) -> np.ndarray:
    """Largest angle between the joints' rotations of two runs at each frame [rad]."""
    worst = np.zeros(len(one.times))
    for joint in figure.joints.values():
        rotations = [
            np.swapaxes(run.poses[joint.parent.segment][:, :3, :3], 1, 2)
            @ run.poses[joint.child.segment][:, :3, :3]
            for run in (one, other)
        ]
        off = np.swapaxes(rotations[0], 1, 2) @ rotations[1]
        worst = np.maximum(worst, np.linalg.norm(rotation_vector_from_matrix(off), axis=1))
    return worst


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if "proto" in n else n for n in RUNS]
)
def test_the_estimate_is_honest(name, tolerance) -> None:
    """Against a much finer run; and the tolerance asked for is held."""
    figure, fine = reference(name)
    run = simulate(figure, Plan(tolerance=tolerance, **RUNS[name][1]))
    true = differences(figure, run, fine)
    assert run.outcome.succeeded
    # Passes of its own, or the comparison would show nothing.
    assert fine.accuracy.step < 0.7 * run.accuracy.step
    assert run.accuracy.estimate <= tolerance
    assert np.max(true) <= tolerance
    assert np.max(true) <= 3.0 * run.accuracy.estimate


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if "proto" in n else n for n in RUNS]
)
def test_the_estimate_of_two_passes_is_honest(name) -> None:
    """That of Exudyn's integrator, at breakpoints of laws as well; the default step suffices."""
    figure, fine = reference(name)
    run = simulate(figure, Plan(integrator=Integrator.EXUDYN, **RUNS[name][1]))
    true = differences(figure, run, fine)
    assert run.outcome.succeeded
    assert run.accuracy.estimate <= 1e-3
    assert np.all(true <= run.accuracy.by_frame + 1e-9)


@pytest.mark.parametrize("frame", [0.001, 0.004, 0.005, 0.02, 0.033, 0.5])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-8])
def test_the_first_step_divides_a_frame_evenly(frame, tolerance) -> None:
    step = first_step(frame, tolerance)
    count = frame / step
    assert 0.0 < first_step(frame, tolerance, with_contact=True) <= LONGEST_STEP_WITH_CONTACT
    assert 0.0 < step <= LONGEST_STEP
    assert count == pytest.approx(round(count))
    assert round(count) == 1 or round(count) % 2 == 0


def test_a_tolerance_out_of_reach_says_until_when_it_held() -> None:
    """A wild triple pendulum amplifies errors too fast for the default step."""
    plan = Plan(stop=2.5, tolerance=1e-3, springs=NONE, velocities={"joint0": (12, 10, 8)})
    run = simulate(row(3), replace(plan, integrator=Integrator.EXUDYN))
    assert run.outcome.ending is Ending.INACCURATE
    assert run.outcome.last_time == run.times[-1] == 2.5
    assert run.accuracy.estimate > 1e-3
    assert 0.0 < run.accuracy.tolerance_met_until < 2.5
    assert (
        f"met only until {run.accuracy.tolerance_met_until:.4g} s of 2.5 s" in run.outcome.message
    )
    assert run.outcome.message.endswith(": choose a smaller step or the compiled integrator")
    held = run.times <= run.accuracy.tolerance_met_until
    assert np.all(run.accuracy.by_frame[held] <= 1e-3)
    assert np.all(run.accuracy.by_frame[~held] > 1e-3)


def test_a_run_cut_short_says_that_it_knows_nothing() -> None:
    """Time for one pass only: no estimate, and no claim of one."""
    run = simulate(row(3), Plan(stop=20.0, tolerance=1e-6, springs=NONE, wall_limit=0.5))
    assert run.accuracy.estimate is None or run.accuracy.estimate > 1e-6
    assert run.accuracy.tolerance_met_until < 20.0


@pytest.mark.parametrize("step", [None, 2e-3])
def test_a_short_half_turn_between_two_steps_is_seen(step) -> None:
    """A ball that swings about one axis on a linear spring is beyond 180 deg for 1.6 ms."""
    rate, peak, beyond = 3.0, 0.521, 1.6e-3
    size, phase = np.pi / np.cos(0.5 * rate * beyond), 0.5 * np.pi - rate * peak
    springs = tuple(AxisSpring(axis, (Linear(rate**2),)) for axis in (X, Y, Z))
    ball = body("link", mass=1.0, inertia=(1.0,) * 3, centre=(0.0, 0.0, 0.0))
    made = one_body(BALL, (0.0, 0.0, size * np.sin(phase)), ball)
    plan = Plan(
        stop=0.7,
        springs=springs_of("pin", *springs),
        velocities={"pin": (0.0, 0.0, size * rate * np.cos(phase))},
        integrator=Integrator.EXUDYN,
    )
    run = simulate(made, replace(plan, step=step))
    assert run.outcome.ending is Ending.TURNED_OVER
    assert 0.4 < run.outcome.last_time == run.times[-1] <= 0.52 + 1e-9
    assert len(run.accuracy.by_frame) == len(run.times)
    told = re.search(r"at ([0-9.e+-]+) s", run.outcome.message)
    assert told is not None
    assert float(told[1]) == pytest.approx(peak, abs=2e-3)
    assert 0.0 <= float(told[1]) - run.times[-1] <= 0.02 + 1e-9


# Contact


def pass_trace(steps: int, factor: float, *, with_contact: bool = True) -> Trace:
    """Three frames of a body at rest; its integrals of contact are proportional to a factor."""
    times, count = np.array([0.0, 0.1, 0.2]), 3
    shapes = ((1, 3), (1,), (1,), (3,), (1, 3), (2, 3))
    contact_steps = ContactSteps(
        np.linspace(0.0, 0.2, steps), *(np.full((steps, *shape), factor) for shape in shapes)
    )
    contact = ContactTrace(
        factor * np.arange(6.0).reshape(count, 2),
        factor * np.arange(9.0).reshape(count, 1, 3),
        contact_steps,
    )
    zeros = np.zeros((count, 1, 3))
    return Trace(
        times,
        zeros,
        np.broadcast_to(np.eye(3), (count, 1, 3, 3)),
        zeros,
        zeros,
        {},
        *np.zeros((3, count)),
        contact=contact if with_contact else None,
    )


def test_integrals_of_contact_are_extrapolated_and_the_steps_are_the_finer_ones() -> None:
    """Of errors 4 and 1 in steps of 2 and 1, nothing is left."""
    fine = pass_trace(5, 1.0 + 1.0)
    limit = richardson_extrapolation(pass_trace(3, 1.0 + 4.0), fine).contact
    assert limit is not None
    assert limit.losses == pytest.approx(np.arange(6.0).reshape(3, 2), abs=1e-14)
    assert limit.impulses == pytest.approx(np.arange(9.0).reshape(3, 1, 3), abs=1e-14)
    assert fine.contact is not None
    assert np.array_equal(limit.steps.times, fine.contact.steps.times)
    assert np.array_equal(limit.steps.depths, fine.contact.steps.depths)
    assert np.all(limit.steps.centres == 2.0)
    assert np.all(limit.steps.accelerations == 2.0)
    without = richardson_extrapolation(
        pass_trace(3, 1.0, with_contact=False), pass_trace(5, 2.0, with_contact=False)
    )
    assert without.contact is None


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_the_estimate_of_a_fall_is_honest(tolerance) -> None:
    """By Exudyn's integrator, against the compiled one; the integrals are as accurate."""
    made = two_segments()
    plan = Plan(
        stop=0.35,
        springs=NONE,
        scene=FLOOR,
        displacements={"root": (0.1, 0.2, -0.3, 0.0, 0.8, 0.0)},
    )
    run = simulate(made, replace(plan, tolerance=tolerance, integrator=Integrator.EXUDYN))
    fine = simulate(made, replace(plan, tolerance=1e-7))
    assert fine.integrator is Integrator.COMPILED
    true = differences(made, run, fine)
    assert run.outcome.succeeded
    assert np.max(true) > 1e-12  # of rounding, 1e-15
    assert run.accuracy.estimate <= tolerance
    assert np.max(true) <= 3.0 * run.accuracy.estimate
    found, exact = run.contact, fine.contact
    assert exact.dissipated > 1.0
    assert found.dissipated == pytest.approx(exact.dissipated, abs=30.0 * tolerance)
    for name, segment in exact.segments.items():
        impulse = np.array(found.segments[name].impulse)
        assert np.linalg.norm(impulse - segment.impulse) < 30.0 * tolerance


def test_a_fall_that_is_cut_short_keeps_the_contact_until_then() -> None:
    """Ctrl-C in the first pass: frames, integrals and steps end together."""

    def watch(progress: Progress) -> None:
        if progress.time > 0.3:
            raise KeyboardInterrupt

    plan = Plan(stop=1.0, springs=NONE, scene=FLOOR, tolerance=1e-6, integrator=Integrator.EXUDYN)
    run = simulate(ball(0.05), plan, watch)
    assert run.outcome.ending is Ending.INTERRUPTED
    contact = run.contact
    assert contact is not None
    assert 0.25 < run.times[-1] < 0.5
    assert len(contact.forces["link"]) == len(run.times)
    touch = contact.segments["link"]
    assert touch.first_time == pytest.approx(np.sqrt(0.1 / 9.81), abs=5e-3)
    assert touch.peak_time <= run.times[-1]
    impulse = MASS * (run.velocities["pin"][-1, 4] + 9.81 * run.times[-1])
    assert touch.impulse[1] == pytest.approx(impulse, rel=5e-2)
