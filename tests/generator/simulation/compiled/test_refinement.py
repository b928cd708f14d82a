"""Estimated errors against true ones; early ends; motions that are too stiff."""

import time
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from generator import read_figure
from generator.figure import Figure, Joint, is_rotation
from generator.recording import Ending
from generator.rotations import Array
from generator.simulation.compiled import refinement
from generator.simulation.compiled.mechanism import CompiledModel
from generator.simulation.compiled.refinement import (
    AgreedRun,
    CompiledRun,
    StiffMotionError,
    joint_differences,
    run_once,
    run_until_agreed,
)
from generator.simulation.compiled_run import compile_model, disturbed_start
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from springs import AxisSpring, Damping, SpringSet
from tests.chains import BALL, Z, chain, one_body, row
from tests.contact_figures import FLOOR, ball, two_segments
from tests.runs import springs_of

PROTOTYPE = read_figure("prototype")


@dataclass(frozen=True)
class Motion:
    """A random start of a figure, and how long it moves [s]."""

    figure: Figure
    plan: Plan
    seed: int
    angle: float = np.radians(15.0)
    speed: float = 1.0

    def model(self) -> CompiledModel:
        rng = np.random.default_rng(self.seed)
        joints = self.figure.joints.values()
        moving = [j for j in joints if j.degrees_of_freedom]
        if self.plan.free_root:
            ground = self.figure.ground
            moving = [j for j in moving if not {ref.segment for ref in j.ends} & ground]
        displacements = {
            j.name: np.asarray(j.displacement)
            + self.angle * rng.uniform(-1.0, 1.0, j.degrees_of_freedom) * sizes(j)
            for j in moving
        }
        velocities = {
            j.name: self.speed * rng.normal(size=j.degrees_of_freedom) * sizes(j) for j in moving
        }
        plan = replace(self.plan, displacements=displacements, velocities=velocities)
        return compile_model(build_model(self.figure, plan))


def sizes(joint: Joint) -> Array:
    """A twentieth along translations, as of an elastic neck, whose stops are at 4 cm."""
    return np.array([1.0 if is_rotation(axis.kind) else 0.05 for axis in joint.chain])


def motion(made: Figure, seed: int, stop: float, **fields) -> Motion:
    return Motion(made, Plan(stop=stop, **fields), seed)


MOTIONS = {
    "prototype 0": motion(PROTOTYPE, 0, 0.3),
    "prototype, second": motion(PROTOTYPE, 3, 1.0),
    "clavicles 6": motion(read_figure("clavicles"), 6, 0.2),
    "free flight 8": motion(PROTOTYPE, 8, 0.5, free_root=True),
    "person 12": motion(read_figure("male50"), 12, 0.3),
    "row 10": motion(row(6, stiff=3.0, damp=0.01), 10, 0.5),
}
TOLERANCES = (1e-2, 1e-4, 1e-6)


@cache
def exact_run(name: str) -> tuple[CompiledModel, CompiledRun]:
    """The model, and its motion at a tolerance a thousand times stricter than the strictest."""
    model = MOTIONS[name].model()
    times = np.linspace(0.0, MOTIONS[name].plan.stop, 11)
    return model, run_once(model, times, 1e-3 * min(TOLERANCES) * 0.1)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("name", MOTIONS)
def test_the_estimate_is_no_smaller_than_the_error(name, tolerance) -> None:
    model, exact = exact_run(name)
    agreed = run_until_agreed(model, exact.times, tolerance)
    count = min(len(agreed.run.times), len(exact.times))
    assert len(exact.times) >= 2
    assert abs(len(agreed.run.times) - len(exact.times)) <= 1  # a half turn may be on either side
    errors = joint_differences(model, agreed.run, exact)[:count]
    estimates = agreed.errors[:count]
    held = estimates <= tolerance
    assert held[-1]
    assert np.all(errors[held] <= tolerance)
    large = errors > 0.1 * tolerance
    assert np.all(estimates[large] >= errors[large])


def start_coarsely(monkeypatch, share: float) -> None:
    """Let the first run have steps of `share` tolerances."""
    monkeypatch.setattr(refinement, "FIRST_SHARE", share)
    monkeypatch.setattr(refinement, "FIRST_SHARE_WITH_BREAKPOINTS", share)


@pytest.mark.parametrize("name", ["prototype 0", "clavicles 6", "free flight 8", "row 10"])
def test_runs_are_repeated_until_two_agree(name, monkeypatch) -> None:
    """From a first run ten thousand times too coarse."""
    start_coarsely(monkeypatch, 1e4)
    model, exact = exact_run(name)
    agreed = run_until_agreed(model, exact.times, 1e-6)
    errors = joint_differences(model, agreed.run, exact)
    assert agreed.runs > 2
    assert np.all(errors <= agreed.errors + 1e-8)
    assert agreed.errors[-1] <= 1e-6


def test_the_estimate_is_the_largest_difference_so_far_of_the_last_two_runs(monkeypatch) -> None:
    model, _ = exact_run("row 10")
    times = np.linspace(0.0, 0.5, 11)
    runs: list[CompiledRun] = []

    def run_and_keep(*arguments, **fields) -> CompiledRun:
        runs.append(run_once(*arguments, **fields))
        return runs[-1]

    monkeypatch.setattr(refinement, "run_once", run_and_keep)
    agreed = run_until_agreed(model, times, 1e-4)
    before, last = sorted(runs, key=lambda run: -run.tolerance)[-2:]
    assert agreed.run.tolerance == last.tolerance < before.tolerance
    assert np.array_equal(agreed.run.states, last.states)
    differences = joint_differences(model, before, last)
    assert differences[-1] > 0.0
    assert np.array_equal(agreed.errors, 2.0 * np.maximum.accumulate(differences))


# Early ends


@pytest.fixture(scope="module")
def simple() -> CompiledModel:
    return motion(row(2, stiff=3.0, damp=0.1), 12, 2.0).model()


TIMES = np.linspace(0.0, 2.0, 101)


@pytest.fixture(autouse=True)
def _frequent_watch(monkeypatch) -> None:
    """Look at the clock every 50 steps of two links."""
    monkeypatch.setattr(refinement, "_LINK_STEPS_PER_CALL", 100)


def assert_first_frames(agreed: AgreedRun, model: CompiledModel) -> None:
    """Some frames of the motion, but not all."""
    run = agreed.run
    assert 1 < len(run.times) == len(run.states) == len(run.links) < len(TIMES)
    assert run.times[-1] <= run.last_time < TIMES[-1]
    assert agreed.errors.shape == run.times.shape
    assert np.max(joint_differences(model, run, run_once(model, TIMES, 1e-12))) < 1e-9


def test_a_deadline_that_has_passed(simple) -> None:
    agreed = run_until_agreed(simple, TIMES, 1e-9, deadline=time.monotonic() - 1.0)
    assert agreed.run.ending is Ending.TOO_LONG
    assert_first_frames(agreed, simple)


def test_an_interrupt_leaves_the_frames_so_far(simple) -> None:
    """Ctrl-C where the watch is called, as anywhere else."""

    def watch(_number: int, _step: float, now: float) -> None:
        assert 0.0 < now < 2.0
        raise KeyboardInterrupt

    agreed = run_until_agreed(simple, TIMES, 1e-9, watch=watch)
    assert agreed.run.ending is Ending.INTERRUPTED
    assert_first_frames(agreed, simple)


def test_an_interrupt_within_a_later_run_leaves_the_run_before(simple, monkeypatch) -> None:
    start_coarsely(monkeypatch, 1e3)

    def watch(number: int, _step: float, now: float) -> None:
        if number == 3 and now > 1.0:
            raise KeyboardInterrupt

    agreed = run_until_agreed(simple, TIMES, 1e-8, watch=watch)
    assert agreed.run.ending is Ending.INTERRUPTED
    assert agreed.runs == 2
    assert np.array_equal(agreed.run.times, TIMES)
    assert agreed.errors.shape == TIMES.shape
    assert agreed.errors[-1] > 1e-8


def test_watch_is_told_the_run_and_its_time(simple, monkeypatch) -> None:
    start_coarsely(monkeypatch, 1e3)
    told: list[tuple[int, float, float]] = []
    agreed = run_until_agreed(simple, TIMES, 1e-8, watch=lambda *news: told.append(news))
    numbers = list(dict.fromkeys(number for number, *_ in told))
    assert numbers == list(range(2, agreed.runs + 1))  # the first goes beside the second
    assert agreed.runs > 2
    for number in numbers:
        reached = [now for n, _, now in told if n == number]
        assert reached == sorted(reached)
        assert reached[-1] == pytest.approx(2.0)
    assert all(1e-6 < step < 0.5 for _, step, _ in told)


def test_a_tolerance_that_rounding_does_not_allow_is_not_claimed() -> None:
    """A wild row amplifies errors by more than any tolerance makes up for."""
    made = row(3)
    plan = Plan(stop=12.0, springs=SpringSet(), velocities={"joint0": (12.0, 10.0, 8.0)})
    model = compile_model(build_model(made, plan))
    agreed = run_until_agreed(model, np.linspace(0.0, 12.0, 241), 1e-9)
    assert agreed.run.ending is Ending.DONE
    assert agreed.errors[0] <= 1e-9 < agreed.errors[-1]
    assert np.all(np.diff(agreed.errors) >= 0.0)


def test_a_tolerance_below_rounding_ends_and_is_not_claimed() -> None:
    model = MOTIONS["prototype 0"].model()
    agreed = run_until_agreed(model, np.linspace(0.0, 0.1, 6), 1e-300)
    assert agreed.run.ending is Ending.DONE
    assert 0.0 < agreed.errors[-1] < 1e-11


@pytest.mark.parametrize("tolerance", [1.0, 1e-2, 1e-3])
def test_two_runs_of_the_same_steps_are_no_estimate(tolerance) -> None:
    """The first steps of a short run satisfy both tolerances."""
    times = np.linspace(0.0, 0.2, 11)
    model = compile_model(build_model(read_figure("fourbar"), Plan(stop=0.2)))
    agreed = run_until_agreed(model, times, tolerance)
    error = joint_differences(model, agreed.run, run_once(model, times, 1e-12))[-1]
    assert 0.0 < error <= agreed.errors[-1] <= tolerance


def test_runs_at_rest_have_no_error() -> None:
    model = compile_model(build_model(row(2), Plan(gravity=(0.0, 0.0, 0.0))))
    agreed = run_until_agreed(model, np.linspace(0.0, 1.0, 11), 1e-3)
    assert np.all(agreed.errors == 0.0)
    assert agreed.runs <= 5


def test_damping_that_no_explicit_step_resolves_is_too_stiff() -> None:
    spring = AxisSpring(Z, (), Damping(1e13))
    plan = Plan(springs=springs_of("pin", spring), velocities={"pin": (1.0,)})
    model = compile_model(build_model(one_body(chain("Rz")), plan))
    with pytest.raises(StiffMotionError, match="too short"):
        run_until_agreed(model, np.linspace(0.0, 1.0, 51), 1e-3)


def test_a_motion_that_is_too_stiff() -> None:
    spring = AxisSpring(Z, (), Damping(0.0, 10.0, 1e-8))
    plan = Plan(springs=springs_of("pin", spring), velocities={"pin": (1.0,)})
    model = compile_model(build_model(one_body(chain("Rz")), plan))
    with pytest.raises(StiffMotionError, match="more than 100,000 steps a second"):
        run_until_agreed(model, np.linspace(0.0, 1.0, 51), 1e-3)


# Differences


def test_the_difference_of_two_runs_is_the_angle_between_their_joints() -> None:
    """Of a ball, the angle of the relative rotation, however the quaternions' signs are; of a
    slide, the distance.
    """
    made = row(2, (BALL, chain("Tx")))

    def run(turn: float, shift: float) -> CompiledRun:
        plan = Plan(
            stop=0.02,
            springs=SpringSet(),
            gravity=(0.0, 0.0, 0.0),
            displacements={"joint0": (0.3, 0.2, 0.4 + turn), "joint1": (shift,)},
        )
        return run_once(compile_model(build_model(made, plan)), np.array([0.0, 0.02]), 1e-9)

    model = compile_model(build_model(made, Plan(springs=SpringSet())))
    one = run(0.0, 0.1)
    assert joint_differences(model, one, run(1e-9, 0.1)) == pytest.approx([1e-9] * 2, abs=1e-14)
    assert joint_differences(model, one, run(0.7, 0.1)) == pytest.approx([0.7] * 2, abs=1e-12)
    assert joint_differences(model, one, run(0.1, 0.4)) == pytest.approx([0.3] * 2, abs=1e-12)
    flipped = replace(one, links=one.links.copy())
    flipped.links[:, :, 9:13] *= -1.0
    assert joint_differences(model, one, flipped) == pytest.approx([0.0] * 2, abs=1e-14)


# Contact


@pytest.fixture(scope="module")
def falling() -> tuple[CompiledModel, np.ndarray]:
    """Two segments that fall on the floor, and a start in which each joint is turned."""
    plan = Plan(
        stop=0.4,
        springs=SpringSet(),
        scene=FLOOR,
        displacements={"root": (0.1, 0.2, -0.3, 0.0, 0.9, 0.0)},
        velocities={"hinge": (2.0,)},
    )
    model = compile_model(build_model(two_segments(), plan))
    return model, disturbed_start(model, 0.0)


FALL_TIMES = np.linspace(0.0, 0.4, 21)

COARSER = refinement.FIRST_SHARE_WITH_CONTACT * 1e-3
"""Tolerance of the first run for one of 1e-3."""


@pytest.fixture
def all_runs(monkeypatch) -> list[CompiledRun]:
    """All runs of an agreement, which are kept as they end."""
    runs: list[CompiledRun] = []

    def run_and_keep(*arguments, **fields) -> CompiledRun:
        runs.append(run_once(*arguments, **fields))
        return runs[-1]

    monkeypatch.setattr(refinement, "run_once", run_and_keep)
    return runs


def test_with_contact_two_runs_tell_until_when_the_tolerance_is_met(falling, all_runs) -> None:
    """However large their difference is: here it exceeds the tolerance."""
    model, _ = falling
    agreed = run_until_agreed(model, FALL_TIMES, 1e-3)
    coarse, fine = sorted(all_runs, key=lambda run: -run.tolerance)
    assert (coarse.tolerance, fine.tolerance) == pytest.approx((COARSER, 0.1 * COARSER))
    assert agreed.runs == 2
    assert np.array_equal(agreed.run.states, fine.states)
    estimate = 2.0 * np.maximum.accumulate(joint_differences(model, coarse, fine))
    assert np.array_equal(agreed.errors, estimate)
    assert 0.0 < estimate[-1] <= 1e-3
    assert agreed.disturbed is None
    all_runs.clear()
    between = float(estimate[-2])
    assert estimate[-2] < estimate[-1]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(refinement, "FIRST_SHARE_WITH_CONTACT", COARSER / between)
        agreed = run_until_agreed(model, FALL_TIMES, between)
    assert agreed.runs == len(all_runs) == 2
    assert agreed.errors[0] <= between < agreed.errors[-1]
    assert agreed.run.ending is Ending.DONE


@pytest.mark.parametrize("share", [1e-2, 1e0, 1e2])
def test_a_certified_fall_is_repeated_until_the_tolerance_is_met(falling, monkeypatch, share):
    """From a first run that is as fine as by default, or much coarser."""
    monkeypatch.setattr(refinement, "FIRST_SHARE_WITH_CONTACT", share)
    model, start = falling
    told = run_until_agreed(model, FALL_TIMES, 1e-5)
    agreed = run_until_agreed(model, FALL_TIMES, 1e-5, certify=True, disturbed_start=start)
    exact = run_once(model, FALL_TIMES, 1e-10)
    errors = joint_differences(model, agreed.run, exact)
    assert agreed.errors[-1] <= 1e-5
    assert np.max(errors) <= 1e-5
    assert (agreed.runs > 2) == (told.errors[-1] > 1e-5)
    if share == 1e2:
        assert agreed.runs > 2
    assert agreed.disturbed is not None
    assert agreed.disturbed.tolerance == pytest.approx(10.0 * share * 1e-5)


def test_a_certificate_that_cannot_be_given_is_not_claimed(falling) -> None:
    model, _ = falling
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(refinement, "MAX_RUNS", 3)
        patch.setattr(refinement, "FIRST_SHARE_WITH_CONTACT", 1e4)
        agreed = run_until_agreed(model, FALL_TIMES, 1e-7, certify=True)
    assert agreed.runs == 3
    assert agreed.run.ending is Ending.DONE
    assert agreed.errors[-1] > 1e-7


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-5])
def test_the_estimate_with_contact_is_no_smaller_than_the_error(falling, tolerance) -> None:
    model, _ = falling
    exact = run_once(model, FALL_TIMES, 1e-10)
    agreed = run_until_agreed(model, FALL_TIMES, tolerance)
    errors = joint_differences(model, agreed.run, exact)
    assert np.max(errors[agreed.errors <= tolerance]) <= tolerance
    assert np.all(errors <= agreed.errors + 1e-8)


def test_two_runs_of_a_flight_with_the_same_steps_are_no_estimate() -> None:
    """The longest step with contact satisfies both tolerances."""
    plan = Plan(
        stop=0.1,
        springs=SpringSet(),
        scene=FLOOR,
        velocities={"pin": (2.0, 1.0, 0.5, 0.0, 0.0, 0.0)},
    )
    model, times = compile_model(build_model(ball(1.0), plan)), np.linspace(0.0, 0.1, 6)
    one, other = (run_once(model, times, tolerance) for tolerance in (1e-4, 1e-5))
    assert np.array_equal(one.states, other.states)
    error = joint_differences(model, one, run_once(model, times, 1e-12))[-1]
    agreed = run_until_agreed(model, times, 1e-2)
    assert agreed.runs > 2
    assert 0.0 < error <= 2.0 * agreed.errors[-1] <= 1e-2


def test_the_disturbed_run_starts_elsewhere(falling, all_runs) -> None:
    """At ten times the larger tolerance; it counts neither as a run nor in the estimate."""
    model, start = falling
    agreed = run_until_agreed(model, FALL_TIMES, 1e-3, disturbed_start=start)
    plain = run_until_agreed(model, FALL_TIMES, 1e-3)
    disturbed = agreed.disturbed
    assert disturbed is not None
    assert np.array_equal(disturbed.states[0], start)
    assert disturbed.tolerance == pytest.approx(10.0 * COARSER)
    assert disturbed.ending is Ending.DONE
    assert agreed.runs == plain.runs == 2
    assert agreed.steps == plain.steps
    assert np.array_equal(agreed.run.states, plain.run.states)
    assert np.array_equal(agreed.errors, plain.errors)
    differences = joint_differences(model, agreed.run, disturbed)
    assert differences[0] == pytest.approx(1e-3, rel=1e-9)
    assert np.max(differences) > 2e-3
    assert np.array_equal(model.initial_state, plain.run.states[0])


@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupt_of_the_disturbed_run_keeps_the_finest(falling, monkeypatch, threads) -> None:
    """Ctrl-C there ends the whole simulation, with all frames of the run before."""
    model, start = falling
    plain = run_until_agreed(model, FALL_TIMES, 1e-3)
    monkeypatch.setattr(refinement, "run_once", ending_of_disturbed(start, Ending.INTERRUPTED))
    agreed = run_until_agreed(model, FALL_TIMES, 1e-3, disturbed_start=start, threads=threads)
    assert agreed.run.ending is Ending.INTERRUPTED
    assert agreed.disturbed is None
    assert np.array_equal(agreed.run.states, plain.run.states)
    assert np.array_equal(agreed.errors, plain.errors)


def ending_of_disturbed(start: np.ndarray, ending: Ending):
    """`run_once` whose run from this start ends early, once all others have gone."""

    def run(own: CompiledModel, *arguments, **fields) -> CompiledRun:
        found = run_once(own, *arguments, **fields)
        if np.array_equal(own.initial_state, start):
            time.sleep(0.5)
            return replace(found, ending=ending)
        return found

    return run


@pytest.mark.parametrize("threads", [1, 2])
def test_a_deadline_within_the_disturbed_run_ends_the_simulation(falling, threads) -> None:
    model, start = falling
    begun: list[float] = []

    def run(own: CompiledModel, *arguments, **fields) -> CompiledRun:
        if np.array_equal(own.initial_state, start):
            time.sleep(0.5)  # until the others have ended
            begun.append(0.0)
        return run_once(own, *arguments, **fields)

    class Clock:
        """A clock that runs when the disturbed run has begun."""

        @staticmethod
        def monotonic() -> float:
            return 100.0 if begun else 0.0

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(refinement, "time", Clock)
        patch.setattr(refinement, "run_once", run)
        agreed = run_until_agreed(
            model, FALL_TIMES, 1e-3, 50.0, disturbed_start=start, threads=threads
        )
    assert agreed.run.ending is Ending.TOO_LONG
    assert agreed.disturbed is None
    assert np.array_equal(agreed.run.times, FALL_TIMES)


def test_a_stiff_disturbed_motion_is_left_out(falling, monkeypatch) -> None:
    model, start = falling

    def run(own: CompiledModel, *arguments, **fields) -> CompiledRun:
        if np.array_equal(own.initial_state, start):
            raise StiffMotionError("the motion needs too many steps")
        return run_once(own, *arguments, **fields)

    monkeypatch.setattr(refinement, "run_once", run)
    agreed = run_until_agreed(model, FALL_TIMES, 1e-3, disturbed_start=start)
    assert agreed.run.ending is Ending.DONE
    assert agreed.disturbed is None
    assert agreed.errors[-1] <= 1e-3


@pytest.mark.parametrize("others_wait", [False, True])
def test_an_interrupt_of_parallel_runs_leaves_the_furthest(
    falling, monkeypatch, others_wait
) -> None:
    """Ctrl-C in the finest run, beside which the others have ended or hardly begun."""
    model, start = falling

    def run(*arguments, **fields) -> CompiledRun:
        stopped = arguments[5]
        if others_wait and stopped is not None:
            stopped.wait(60.0)
        return run_once(*arguments, **fields)

    def watch(number: int, _step: float, now: float) -> None:
        if number == 2 and now > 0.3:
            raise KeyboardInterrupt

    monkeypatch.setattr(refinement, "run_once", run)
    agreed = run_until_agreed(model, FALL_TIMES, 1e-3, watch=watch, disturbed_start=start)
    found = agreed.run
    assert found.ending is Ending.INTERRUPTED
    assert found.times[-1] >= 0.28
    assert len(found.times) == len(found.states) == len(agreed.errors)
    assert agreed.errors[0] == 0.0
    assert np.max(joint_differences(model, found, run_once(model, FALL_TIMES, 1e-10))) < 1e-3
    assert agreed.disturbed is None
