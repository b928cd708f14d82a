"""The wall-time limit while a model is built, while contact is evaluated, over several starts."""

import json
import time
from dataclasses import dataclass, replace

import pytest

from generator import Plan, simulate
from generator.contact.box import Box
from generator.contact.scene import Prop, Scene
from generator.diagnostics import WallLimitError
from generator.model import Model
from generator.recording import Ending
from generator.simulation import compiled_run, plan, run, starts
from generator.simulation.plan import NO_LIMIT, WallLimit
from generator.study.run_case import run_case
from generator.study.study import Design, DesignKind, Study
from springs import SpringSet
from springs.contact import DEFAULT_SURFACE
from tests.command import mover
from tests.contact_figures import FLOOR, ball


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
    study = Study("boxes", Model.of(ball(0.2)), plan, {}, Design(DesignKind.LIST), {})
    result = run_case(study, ())
    assert result.outcome == Ending.TOO_LONG.value
    assert "while the model was built" in result.message


def test_contact_is_evaluated_until_the_limit(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The motion is kept, without contact; of the disturbed start nothing is evaluated."""
    step, evaluate = compiled_run.run_until_agreed, compiled_run.evaluate_contacts
    evaluated: list[int] = []

    def stepped(*arguments, **options):
        found = step(*arguments, **options)
        clock.ahead = 1e6
        return found

    def counted(contacts, figure, positions, *more):
        evaluated.append(len(positions))
        return evaluate(contacts, figure, positions, *more)

    monkeypatch.setattr(compiled_run, "run_until_agreed", stepped)
    monkeypatch.setattr(compiled_run, "evaluate_contacts", counted)
    monkeypatch.setattr(compiled_run, "_STEPS_AT_ONCE", 5)
    found = simulate(ball(0.2), PLAN)
    assert found.outcome.ending is Ending.TOO_LONG
    assert "while contact was evaluated" in found.outcome.message
    assert evaluated == [5, 1]  # then the start alone
    assert found.contact is None
    assert found.times[-1] == pytest.approx(0.3)
    assert found.energy["gravity"][-1] < found.energy["gravity"][0]


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
