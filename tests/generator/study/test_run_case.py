"""Runs of a study: results, failures, kept motions, and the same bits in any order and process."""

import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from threading import Timer

import pytest
from scipy.optimize import brentq

from generator import Figure, Plan, read_figure, read_npz
from generator.model import Model
from generator.recording import Ending
from generator.run_options import Integrator
from generator.study.parameter_paths import Case
from generator.study.run_case import measure_case, run_case
from generator.study.study import (
    NO_EQUILIBRIUM,
    WRONG_INPUT,
    Design,
    DesignKind,
    Measure,
    Parameter,
    RunResult,
    Statistic,
    Study,
    Uniform,
)
from springs.contact import Surface
from tests.chains import row
from tests.contact_figures import BLOCK_HALF, FLOOR, MASS, block
from tests.processes import ENVIRONMENT

SWING = ("shoulder.2 [deg]", Statistic.LARGEST)
NUMBERS: Mapping[str, tuple[str, Statistic]] = {
    "swing": SWING,
    "when": (SWING[0], Statistic.TIME_OF_LARGEST),
    "end": ("kinetic [J]", Statistic.LAST),
    "force": ("shoulder.reaction_force [N]", Statistic.LARGEST),
    "rest": (SWING[0], Statistic.REST),
}


def study(numbers: Mapping[str, tuple[str, Statistic]] = NUMBERS, **changes: object) -> Study:
    """A pendulum under gravity of another size, with one of its springs scaled."""
    figure = pendulum()
    plan = replace(Plan(stop=0.2), **changes)
    parameters = {
        name: Parameter(name, (path,), Uniform(0.5, 1.5))
        for name, path in (("g", "gravity"), ("k", "springs.shoulder.scale"))
    }
    measures = {name: Measure(name, *entry) for name, entry in numbers.items()}
    return Study("pendulum", Model.of(figure), plan, parameters, Design(DesignKind.LIST), measures)


@cache
def pendulum() -> Figure:
    return read_figure("pendulum")


def test_a_run_has_the_measures_in_their_order() -> None:
    result = run_case(study(), [1.0, 1.0])
    assert (result.outcome, result.message) == ("done", "")
    assert list(result.measures) == list(NUMBERS)
    assert all(isinstance(value, float) for value in result.measures.values())


def test_a_run_beyond_its_tolerance_has_no_measures() -> None:
    result = run_case(study({"swing": SWING}, tolerance=1e-14), [1.0, 1.0])
    assert result.outcome == "tolerance not met"
    assert not result.succeeded
    assert result.message.startswith("the tolerance 1.0e-14 rad is met only until ")
    assert result.measures == {"swing": None}


def test_parameters_change_the_measures() -> None:
    one, other = (run_case(study(), [g, 1.0]).measures for g in (0.8, 1.2))
    assert all(one[name] != other[name] for name in NUMBERS)


def test_measures_are_the_same_with_a_kept_motion(tmp_path: Path) -> None:
    lean = run_case(study(), [0.9, 1.1])
    assert run_case(study(), [0.9, 1.1], tmp_path / "00001.npz") == lean
    assert [path.name for path in tmp_path.iterdir()] == ["00001.npz"]
    _, run = read_npz(tmp_path / "00001.npz")
    assert run.times[-1] == 0.2
    assert lean.measures["end"] == run.energy["kinetic"][-1]


def failed(result: RunResult, outcome: str) -> bool:
    """Return whether a run has this outcome, a message and no measures."""
    blank = all(value is None for value in result.measures.values())
    return result.outcome == outcome and bool(result.message) and blank


def test_values_that_make_no_case_are_wrong_input() -> None:
    result = run_case(study(), [1.0, -1.0])
    assert failed(result, WRONG_INPUT)
    assert "\n" not in result.message


def test_an_unknown_column_is_wrong_input() -> None:
    result = run_case(study({"x": ("shoulder.9 [deg]", Statistic.LAST)}), [1.0, 1.0])
    assert failed(result, WRONG_INPUT)
    assert "no column `shoulder.9 [deg]`" in result.message


def test_a_figure_that_turns_over_has_no_measures() -> None:
    assert failed(run_case(study(stop=2.0), [1.0, 1.0]), Ending.TURNED_OVER.value)


def case_study(case: Case, column: str, take: Statistic) -> Study:
    """A study of one case with one measure."""
    measures = {"m": Measure("m", column, take)}
    return Study("case", case.model, case.plan, {}, Design(DesignKind.LIST), measures)


ENDLESS = Case(Model(row(1)), Plan(stop=1e5, frame=1e3))
"""A pendulum that swings for more than a day."""


def test_a_run_without_wall_time_has_no_measures() -> None:
    case = replace(ENDLESS, plan=replace(ENDLESS.plan, wall_limit=1e-9))
    result = measure_case(case_study(case, "joint0.1 [deg]", Statistic.LAST), case)
    assert failed(result, Ending.TOO_LONG.value)


def test_a_figure_that_does_not_rest_has_no_measures() -> None:
    case = replace(ENDLESS, plan=replace(ENDLESS.plan, wall_limit=1e-9))
    result = measure_case(case_study(case, "joint0.1 [deg]", Statistic.REST), case)
    assert failed(result, NO_EQUILIBRIUM)


def test_an_interrupted_run_is_not_a_result() -> None:
    Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        measure_case(case_study(ENDLESS, "joint0.1 [deg]", Statistic.LAST), ENDLESS)


def test_a_block_rests_on_the_floor() -> None:
    case = Case(Model(block(0.06)), Plan(stop=0.1, scene=FLOOR))
    result = measure_case(case_study(case, "pin.5 [cm]", Statistic.REST), case)
    assert result.outcome == "done"
    depth = brentq(lambda d: Surface().elastic_force(d) - MASS * 9.81 / 4.0, 0.0, 0.1)
    assert result.measures["m"] == pytest.approx(100.0 * (BLOCK_HALF[1] - depth), abs=1e-3)


def test_only_measures_at_rest_are_not_simulated() -> None:
    numbers = {"rest": NUMBERS["rest"]}
    never_ends = study(numbers, stop=1e6, frame=1e3, step=1e-6)
    assert run_case(never_ends, [1.0, 1.0]).measures["rest"] == pytest.approx(
        run_case(study(), [1.0, 1.0]).measures["rest"]
    )


ALONE = """
from tests.generator.study.test_run_case import bounce, swing
print(swing(), bounce())
"""


def swing() -> RunResult:
    return run_case(study(), [0.9, 1.1])


def bounce() -> RunResult:
    case = Case(Model(block(0.06)), Plan(stop=0.3, scene=FLOOR))
    return measure_case(case_study(case, "link.contact_force [N]", Statistic.LARGEST), case)


@pytest.mark.slow
def test_earlier_runs_and_the_process_have_no_effect() -> None:
    run_case(study(integrator=Integrator.EXUDYN), [1.2, 0.8])
    results = bounce(), swing()
    assert [result.outcome for result in results] == ["done", "done"]
    alone = subprocess.run(
        [sys.executable, "-c", ALONE],
        env={**ENVIRONMENT, "PYTHONHASHSEED": "7", "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert alone.stdout == f"{results[1]} {results[0]}\n"
