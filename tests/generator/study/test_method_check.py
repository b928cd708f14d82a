"""Fast runs of a study beside tight ones."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from generator.model import Model
from generator.recording import Ending
from generator.simulation.plan import Plan
from generator.study.method_check import (
    CHECK_NAME,
    LARGEST_SHIFT,
    MIN_CHECKED,
    checked_runs,
    compare_methods,
    read_check,
    write_check,
)
from generator.study.run_case import run_case
from generator.study.run_results import RunResults
from generator.study.study import (
    Design,
    DesignKind,
    Measure,
    Parameter,
    RunMethod,
    RunResult,
    Statistic,
    Study,
)
from generator.study.sweep import run_sweep
from generator.study.worker_pool import FinishedRun, run_locally
from springs import SpringSet
from tests.contact_figures import FLOOR, two_segments


def falling_study(count: int) -> Study:
    """Falls of two segments under so many accelerations of gravity."""
    made = two_segments()
    start = {"root": (0.1, 0.2, -0.3, 0.0, 0.9, 0.0)}
    plan = Plan(stop=0.6, scene=FLOOR, displacements=start, velocities={"hinge": (2.0,)})
    rows = tuple((value,) for value in np.linspace(0.7, 1.3, count))
    return Study(
        name="two segments",
        model=Model(made, SpringSet()),
        plan=plan,
        parameters={"g": Parameter("g", ("gravity",), None)},
        design=Design(DesignKind.LIST, rows=rows),
        measures={"force": Measure("force", "second.contact_force [N]", Statistic.LARGEST)},
        text="# falls\n",
    )


def results(study: Study, values: list[float]) -> RunResults:
    rows = RunResults(study.measures, len(values))
    for index, value in enumerate(values):
        rows[index] = RunResult(Ending.DONE.value, "", {"force": value})
    return rows


def finished(values: list[float]) -> dict[int, FinishedRun]:
    return {
        index: FinishedRun(index, RunResult(Ending.DONE.value, "", {"force": value}), 0.0)
        for index, value in enumerate(values)
    }


def test_the_sample_is_two_per_cent_and_at_least_twenty() -> None:
    assert checked_runs(5) == list(range(5))
    assert len(checked_runs(640)) == MIN_CHECKED
    assert len(checked_runs(10_000)) == len(set(checked_runs(10_000))) == 200
    assert checked_runs(10_000) == checked_runs(10_000)


def test_a_shift_counts_in_standard_deviations_of_the_measure() -> None:
    study, rng = falling_study(2), np.random.default_rng(0)
    fast = rng.normal(100.0, 10.0, 400).tolist()
    rows = results(study, fast)
    noise = rng.normal(0.0, 1.0, 400)
    shift = compare_methods(study, rows, finished((np.array(fast) - 3.0 - noise).tolist()))["force"]
    assert shift.runs == 400
    assert shift.shift == pytest.approx(0.3, abs=0.02)
    assert shift.standard_error == pytest.approx(0.1 / 20.0, rel=0.1)
    assert shift.median == pytest.approx(3.0, abs=0.3)
    assert shift.is_refused
    small = compare_methods(study, rows, finished((np.array(fast) - 0.5 - noise).tolist()))["force"]
    assert abs(small.shift) < LARGEST_SHIFT
    assert not small.is_refused


def test_a_shift_that_chance_explains_is_not_refused() -> None:
    study, rng = falling_study(2), np.random.default_rng(1)
    fast = rng.normal(100.0, 10.0, 20)
    others = fast - rng.normal(0.0, 15.0, 20)
    shift = compare_methods(study, results(study, fast.tolist()), finished(others.tolist()))[
        "force"
    ]
    assert shift.standard_error > 0.2
    assert not shift.is_refused


def test_the_comparison_is_read_as_it_was_written(tmp_path: Path) -> None:
    study = falling_study(2)
    shifts = compare_methods(study, results(study, [1.0, 2.0, 4.0]), finished([1.1, 2.2, 3.0]))
    write_check(tmp_path, shifts)
    assert read_check(tmp_path) == shifts
    (tmp_path / CHECK_NAME).write_text("measure\nforce")
    assert read_check(tmp_path) is None
    assert read_check(tmp_path / "none") is None


def test_fast_falls_agree_with_tight_ones() -> None:
    """Of one fall: nearly the same force, and not the same number."""
    study = falling_study(1)
    fast = run_case(study, (1.0,)).measures["force"]
    tight = run_case(replace(study, method=RunMethod.TIGHT), (1.0,)).measures["force"]
    assert fast is not None
    assert fast == pytest.approx(tight, rel=0.02)
    assert fast != tight


@pytest.mark.slow
def test_a_sweep_checks_its_fast_falls(tmp_path: Path) -> None:
    engine = partial(run_locally, jobs=1)
    study = falling_study(4)
    made = run_sweep(study, tmp_path / "fast", engine)
    assert made.shifts["force"].runs == 4
    assert read_check(tmp_path / "fast") == made.shifts
    again = run_sweep(study, tmp_path / "fast", engine)
    assert again.shifts == made.shifts
    tight = run_sweep(replace(study, method=RunMethod.TIGHT), tmp_path / "tight", engine)
    assert tight.shifts == {}
    assert not (tmp_path / "tight" / CHECK_NAME).exists()
    differences = made.rows.numbers("force") - tight.rows.numbers("force")
    assert np.median(np.abs(differences)) == pytest.approx(made.shifts["force"].median)
