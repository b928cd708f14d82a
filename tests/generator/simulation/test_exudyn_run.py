"""One pass of the integrator: frames, cuts, and every way in which it can end."""

import itertools
import time
from types import SimpleNamespace

import numpy as np
import pytest

from generator.model import Model
from generator.recording import Ending
from generator.run_options import Integrator
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.exudyn_run import integrate
from generator.simulation.plan import Plan
from generator.simulation.run import Progress, simulate
from generator.simulation.trace import frame_times
from springs import AxisSpring, Cubic, JointSprings, Linear, SpringSet, Stop
from tests.chains import BALL, X, Y, Z, body, chain, one_body, row
from tests.runs import energy_error, springs_of

NONE = SpringSet()
GIVENS = [{"step": 1e-3}, {"integrator": Integrator.EXUDYN}]


def nobody(_: float) -> None:
    pass


def run_pass(figure, springs=NONE, times=None, step=1e-3, watch=nobody):
    times = frame_times(0.0, 0.2, 0.02) if times is None else times
    plan = Plan(start=float(times[0]), stop=float(times[-1]))
    assembly = build_model(Model(figure, springs), plan)
    return integrate(assembly, times, step, time.monotonic() + 60.0, watch)


@pytest.mark.parametrize(
    ("start", "stop", "frame", "count"),
    [(0.0, 1.0, 0.02, 51), (0.0, 1.0, 0.03, 35), (-1.0, 0.5, 0.5, 4), (0.0, 0.01, 0.02, 2)],
)
def test_frame_times(start, stop, frame, count) -> None:
    times = frame_times(start, stop, frame)
    assert times.size == count
    assert times[0] == start
    assert times[-1] == stop
    assert np.allclose(np.diff(times)[:-1], frame)
    assert 0.0 < np.diff(times)[-1] <= frame * (1 + 1e-9)


def test_steps_are_equal_parts_of_a_frame() -> None:
    done = run_pass(row(1), step=3e-3)
    assert done.steps == 10 * 7
    assert len(done.trace) == 11
    assert done.outcome.ending is Ending.DONE
    assert done.outcome.last_time == 0.2


@pytest.mark.parametrize("looks", range(1, 30))
def test_the_clock_may_run_out_at_any_frame(looks, monkeypatch) -> None:
    """Whenever it does, what is told are frames that were reached, as in a run that may go on."""
    springs = SpringSet({"joint0": JointSprings("joint0", (AxisSpring(X, (Linear(1.0, 0.0),)),))})
    times = frame_times(0.0, 0.5, 0.02)
    whole = run_pass(row(1), springs, times)
    ticks = itertools.count()
    clock = SimpleNamespace(monotonic=lambda: float(next(ticks)))
    monkeypatch.setattr("generator.simulation.exudyn_run.time", clock)
    assembly = build_model(Model(row(1), springs), Plan(stop=0.5))
    cut = integrate(assembly, times, 1e-3, looks + 0.5, nobody)
    count = len(cut.trace)
    assert cut.outcome.ending is (Ending.TOO_LONG if count < times.size else Ending.DONE)
    assert cut.outcome.last_time == cut.trace.times[-1] == times[count - 1]
    assert np.max(np.abs(cut.trace.positions - whole.trace.positions[:count])) < 1e-9


def test_the_frames_do_not_change_the_motion() -> None:
    """Restarting at each frame loses nothing."""
    one = run_pass(row(2), times=np.array([0.0, 0.2]), step=1e-3)
    many = run_pass(row(2), times=frame_times(0.0, 0.2, 1e-3), step=1e-3)
    assert np.max(np.abs(one.trace.positions[-1] - many.trace.positions[-1])) < 1e-8


def test_the_watch_is_told_after_every_frame() -> None:
    told: list[float] = []
    run_pass(row(1), watch=told.append)
    assert told == pytest.approx(list(frame_times(0.0, 0.2, 0.02)[1:]))


@pytest.mark.parametrize("given", GIVENS)
@pytest.mark.parametrize("frames", [1, 3, 24])
def test_an_interrupt_leaves_the_frames_so_far(given, frames) -> None:
    """Raised from the watch, as Ctrl-C is."""
    told: list[Progress] = []

    def watch(progress: Progress) -> None:
        told.append(progress)
        if len(told) == frames:
            raise KeyboardInterrupt

    run = simulate(row(2, stiff=3.0, damp=0.1), Plan(stop=1.0, **given), watch)
    assert run.outcome.ending is Ending.INTERRUPTED
    assert not run.outcome.succeeded
    assert run.times.size == frames + 1
    assert run.outcome.last_time == run.times[-1] == pytest.approx(0.02 * frames)
    assert all(values.shape[0] == frames + 1 for values in run.displacements.values())
    assert all(values.shape == (frames + 1,) for values in run.energy.values())
    assert energy_error(run) < 1e-2


def test_an_interrupt_in_the_second_pass_leaves_a_motion() -> None:
    def watch(progress: Progress) -> None:
        if progress.pass_number == 2 and progress.time > 0.31:
            raise KeyboardInterrupt

    run = simulate(row(2), Plan(stop=0.5, integrator=Integrator.EXUDYN), watch)
    assert run.outcome.ending is Ending.INTERRUPTED
    assert run.times[-1] >= 0.3
    assert run.outcome.last_time == run.times[-1]
    assert len(run.poses["bar0"]) == len(run.times)
    # The time of the interruption is not that of the last frame, which an earlier pass made.
    assert run.outcome.message.endswith(" of a finer pass")
    assert run.times[-1] == 0.5


@pytest.mark.parametrize("given", GIVENS)
def test_a_solver_failure_is_an_outcome(given) -> None:
    """A spring that pushes away without bound: nothing finite comes after the first frames."""
    law = AxisSpring(Z, (Cubic((0.0, 0.0, 0.0, 4000.0), sense=1),))
    springs = SpringSet({"joint1": JointSprings("joint1", (law,))})
    figure = row(3, (chain("Rz"),))
    run = simulate(figure, Plan(stop=5.0, springs=springs, wall_limit=30.0, **given))
    assert run.outcome.ending is Ending.SOLVER_FAILED
    assert run.outcome.joint in figure.joints
    assert run.outcome.joint in run.outcome.message
    assert run.outcome.last_time == run.times[-1] < 5.0
    assert f"{run.outcome.last_time:.4g} s" in run.outcome.message
    for name in figure.segments:
        assert np.all(np.isfinite(run.poses[name]))


def test_the_wall_limit_ends_a_run_of_one_long_frame() -> None:
    plan = Plan(stop=400.0, frame=400.0, step=1e-3, wall_limit=0.5, springs=NONE)
    run = simulate(row(3), plan)
    assert run.outcome.ending is Ending.TOO_LONG
    assert run.times.tolist() == [0.0]


def test_a_joint_driven_against_a_hard_stop_ends_well() -> None:
    """A stop struck at speed costs steps, not a hang, which the limit of time would end."""
    law = AxisSpring(Z, (Stop(-0.2, 0.2),))
    springs = springs_of("pin", law)
    run = simulate(
        one_body(chain("Rz"), (0.0,)),
        Plan(stop=0.5, springs=springs, velocities={"pin": (15.0,)}, wall_limit=300.0),
    )
    assert run.outcome.succeeded
    assert energy_error(run) < 1e-3 * run.energy["kinetic"][0]


def test_reactions_are_told_at_the_first_frame() -> None:
    done = run_pass(one_body(BALL, (0.3, 0.2, 0.1)))
    first, second = done.trace.multipliers["pin"][:2, 0, :3]
    assert np.linalg.norm(first) > 1.0
    assert np.linalg.norm(first - second) < 0.3 * np.linalg.norm(first)


def test_a_pass_begins_at_the_start_itself() -> None:
    """The step of no account that finds the first reactions leaves no trace."""
    figure = one_body(BALL, (0.3, 0.2, 0.1))
    plan = Plan(velocities={"pin": (1.0, -2.0, 3.0)})
    assembly = build_model(
        Model(figure, SpringSet({"pin": JointSprings("pin", (AxisSpring(X), AxisSpring(Y)))})), plan
    )
    times = np.array([0.0, 0.1])
    done = integrate(assembly, times, 1e-2, time.monotonic() + 60.0, nobody)
    pose = assembly.placement.poses["link"]
    assert np.max(np.abs(done.trace.rotations[0, 0] - pose[:3, :3])) < 1e-15


def test_a_joint_that_turns_over_in_the_first_frame_leaves_that_frame() -> None:
    springs = tuple(AxisSpring(axis, (Linear(0.5),)) for axis in (X, Y, Z))
    plan = Plan(
        stop=0.1,
        springs=springs_of("pin", *springs),
        velocities={"pin": (1500.0, 0.0, 0.0)},
    )
    run = simulate(one_body(BALL, (0.0, 0.0, 0.0), body("link", centre=(0.0, 0.0, 0.0))), plan)
    assert run.outcome.ending is Ending.TURNED_OVER
    assert run.times.tolist() == [0.0]


def test_a_step_too_short_for_any_clock_ends_by_the_clock() -> None:
    run = simulate(row(1), Plan(stop=1.0, step=1e-13, wall_limit=0.3, springs=NONE))
    assert run.outcome.ending is Ending.TOO_LONG
    assert run.times.tolist() == [0.0]
