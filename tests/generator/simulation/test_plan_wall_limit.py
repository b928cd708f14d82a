"""The wall-time limit while a model is built, within and after its runs, over several starts."""

import json
import time
from dataclasses import dataclass, replace

import numpy as np
import pytest

from generator import Plan, simulate
from generator.contact.box import Box
from generator.contact.scene import Prop, Scene
from generator.diagnostics import WallLimitError
from generator.model import Model
from generator.recording import Ending
from generator.simulation import compiled_run, plan, run, starts
from generator.simulation.compiled import refinement
from generator.simulation.plan import NO_LIMIT, WallLimit
from generator.study.run_case import run_case
from generator.study.study import Design, DesignKind, RunMethod, Study
from springs import SpringSet
from springs.contact import DEFAULT_SURFACE
from tests.command import mover
from tests.contact_figures import FLOOR, ball
from tests.runs import same_bits


@dataclass
class Clock:
    """A clock that can be put forward [s]."""

    ahead: float = 0.0

    def monotonic(self) -> float:
        return time.monotonic() + self.ahead


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """The clock of wall-time limits."""
    clock = Clock()
    monkeypatch.setattr(plan, "time", clock)
    return clock


def never(*arguments: object, **options: object) -> None:
    raise AssertionError("a later phase was entered")


def test_a_limit_is_reached_after_its_time(clock: Clock) -> None:
    limit = WallLimit.begin(100.0)
    clock.ahead = 99.0
    limit.require_time("here")
    clock.ahead = 101.0
    with pytest.raises(WallLimitError, match="the wall-time limit of 100 s was reached here"):
        limit.require_time("here")
    NO_LIMIT.require_time("here")


PLAN = Plan(stop=0.3, springs=SpringSet(), scene=FLOOR)

BOXES = tuple(
    Prop(f"box {k}", Box((5.0 + 0.5 * k, 0.0, 5.0), (0.1 + 0.01 * k, 0.2, 0.3)), DEFAULT_SURFACE)
    for k in range(150)
)


def test_building_ends_at_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Later props are not built, and nothing is simulated."""
    plan = replace(PLAN, scene=Scene((*FLOOR.props, *BOXES)), wall_limit=1e-9)
    monkeypatch.setattr(run, "_try_compiled", never)
    monkeypatch.setattr(run, "run_exudyn", never)
    with pytest.raises(WallLimitError, match="at prop box 98, while the model was built"):
        simulate(ball(0.2), plan)
    plan = replace(plan, springs=None)
    model, design = Model.of(ball(0.2)), Design(DesignKind.LIST)
    study = Study("boxes", model, plan, {}, design, {}, method=RunMethod.TIGHT)
    result = run_case(study, ())
    assert result.outcome == Ending.TOO_LONG.value
    assert "while the model was built" in result.message


def test_a_limit_reached_after_the_integration_keeps_the_whole_run(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Contact is recorded with the steps, so that nothing of it is left to be evaluated then."""
    step = compiled_run.run_until_agreed

    def stepped(*arguments, **options):
        found = step(*arguments, **options)
        clock.ahead = 1e6
        return found

    plain = simulate(ball(0.2), PLAN)
    monkeypatch.setattr(compiled_run, "run_until_agreed", stepped)
    found = simulate(ball(0.2), PLAN)
    assert found.outcome == plain.outcome
    assert found.outcome.succeeded
    assert found.contact is not None
    assert same_bits(found.contact, plain.contact)


def test_a_limit_within_the_runs_keeps_the_contact_until_then(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plain = simulate(ball(0.2), replace(PLAN, stop=1.0))
    monkeypatch.setattr(refinement, "_LINK_STEPS_PER_CALL", 20)
    calls: list[float] = []

    class Late:
        """A clock that runs once the motion has passed the first touch, at 0.2 s."""

        @staticmethod
        def monotonic() -> float:
            return 1e9 if calls and calls[-1] > 0.3 else time.monotonic()

    monkeypatch.setattr(refinement, "time", Late)
    found = simulate(
        ball(0.2),
        replace(PLAN, stop=1.0, wall_limit=100.0),
        lambda progress: calls.append(progress.time),
    )
    assert found.outcome.ending is Ending.TOO_LONG
    assert 0.28 <= found.times[-1] < 0.9
    one, other = found.contact, plain.contact
    assert one is not None
    assert other is not None
    assert one.segments["link"].first_time == other.segments["link"].first_time
    assert one.forces["link"] == pytest.approx(other.forces["link"][: len(found.times)], abs=1e-12)
    assert np.max(one.forces["link"]) > 1.0


def test_no_start_begins_after_the_limit(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    limit, once = WallLimit.begin(100.0), starts.simulate
    runs: list[float] = []

    def simulated(figure, plan):
        runs.append(plan.wall_limit)
        clock.ahead += 60.0
        return once(figure, plan)

    monkeypatch.setattr(starts, "simulate", simulated)
    study = starts.study_starts(ball(0.2), PLAN, 4, 0.01, limit=limit)
    assert [99.0 < one <= 100.0 for one in runs] == [True, False]
    assert study.failures.keys() == {3, 4}
    assert study.failures[4] == "the wall-time limit of 100 s was reached before start 4"


def test_the_command_says_that_starts_are_missing(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    once = starts.simulate

    def simulated(figure, plan):
        clock.ahead = 1e6
        return once(figure, plan)

    monkeypatch.setattr(starts, "simulate", simulated)
    words = ("simulate", "leg", "--floor", "--height", 0.02, "--stop", 0.1, "--starts", 3)
    done = mover(*words, "--json")
    assert done.exit_code == 3, done.output
    assert "the wall-time limit of 600 s was reached before the last start" in done.stderr
    assert json.loads(done.stdout)["outcome"] == "done"
