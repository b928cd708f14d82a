"""Many falls: their numbers from the measures of each, and each as a run of its own."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from generator import Falls, Integrator, Model, Plan, fall_plan, read_figure, run_falls, simulate
from generator.diagnostics import ModelError, UnknownNameError
from generator.rotations import Array
from generator.study.falls import HANDS, HEAD, HIP, PELVIS, fall_case, run_fall, summarize
from generator.study.run_results import RunResults
from generator.study.study import (
    WRONG_INPUT,
    Design,
    DesignKind,
    Measure,
    RunResult,
    Statistic,
    Study,
    failed_run,
)
from generator.study.worker_pool import FinishedRun

MAN = read_figure("male50")
NAN = np.nan


def made(columns: Mapping[str, list[float]], start: float = 0.0) -> Falls:
    """Falls with these measures, blank where NaN; the last fall has failed as well."""
    measures = {name: Measure(name, "time [s]", Statistic.LAST) for name in columns}
    plan, design = Plan(start=start, stop=start + 1.0), Design(DesignKind.LIST)
    study = Study("faint", Model(MAN), plan, {}, design, measures)
    count = len(next(iter(columns.values())))
    rows = RunResults(measures, count + 1)
    for k in range(count):
        row = {name: None if np.isnan(column[k]) else column[k] for name, column in columns.items()}
        rows[k] = RunResult("done", "", row)
    rows[count] = failed_run(study, WRONG_INPUT, "inside a box")
    starts = np.column_stack([np.arange(count + 1.0), np.full(count + 1, 90.0)])
    return Falls(study, starts, rows, 800.0)


def same(values: Array, expected: list[float]) -> bool:
    return np.array_equal(values, [*expected, NAN], equal_nan=True)


def test_the_first_of_both_hands_counts():
    touch, speed = ([f"{hand}_{what}" for hand in HANDS] for what in ("touch_s", "speed_m_per_s"))
    falls = made(
        {
            touch[0]: [0.4, 0.5, NAN, 0.3, NAN],
            touch[1]: [0.5, 0.4, 0.6, NAN, NAN],
            speed[0]: [1.0, 2.0, NAN, 5.0, NAN],
            speed[1]: [3.0, 4.0, 6.0, NAN, NAN],
            f"{PELVIS}_touch_s": [0.45, 0.45, 0.5, NAN, 0.4],
        }
    )
    assert same(falls.hand_speed, [1.0, 4.0, 6.0, 5.0, NAN])
    lead = falls.hand_lead
    assert lead[:3] == pytest.approx([0.05, 0.05, -0.1])
    assert np.isnan(lead[3:]).all()


def test_the_descent_is_from_the_start():
    falls = made({f"{PELVIS}_touch_s": [2.5, NAN]}, start=2.0)
    assert same(falls.descent, [0.5, NAN])


def test_the_force_counts_where_the_pelvis_touches_and_the_head_where_it_does():
    falls = made(
        {
            f"{PELVIS}_touch_s": [0.5, NAN, 0.6],
            f"{PELVIS}_force_N": [1600.0, 0.0, 2400.0],
            f"{HEAD}_touch_s": [NAN, 0.9, 0.8],
        }
    )
    assert same(falls.hip_force, [1600.0, NAN, 2400.0])
    summary = falls.summary()
    assert summary["n"] == 3
    assert summary["head_hit_share"] == pytest.approx(2.0 / 3.0)
    assert summary["hip_force_body_weights"] == pytest.approx((2.5, np.sqrt(0.5)))


def test_the_head_s_force_and_acceleration_count_where_it_touches():
    falls = made(
        {
            f"{HEAD}_touch_s": [NAN, 0.9],
            f"{HEAD}_force_N": [0.0, 5e3],
            f"{HEAD}_acceleration_g": [1.5, 80.0],
        }
    )
    assert same(falls.head_force, [NAN, 5e3])
    assert same(falls.head_acceleration, [NAN, 80.0])


def test_a_hand_hits_if_either_does():
    falls = made({f"{HANDS[0]}_touch_s": [0.4, NAN, NAN], f"{HANDS[1]}_touch_s": [0.5, 0.6, NAN]})
    assert falls.hits(*HANDS).tolist() == [True, True, False, False]
    assert falls.hit_share(*HANDS) == pytest.approx(2.0 / 3.0)
    assert np.isnan(falls.hit_share(PELVIS))


@pytest.mark.slow
def test_a_fall_has_the_direction_of_its_speed(four: Falls):
    for direction, seed in zip(four.direction, four.seeds, strict=True):
        x, _, z = fall_plan(MAN, "push", int(seed)).velocities[PELVIS][3:]
        assert np.degrees(np.arctan2(x, z)) == pytest.approx(direction)


def test_the_force_is_that_of_the_part_pelvis_where_there_is_one():
    falls = made(
        {
            f"{PELVIS}_touch_s": [0.5, 0.5, NAN],
            f"{PELVIS}_force_N": [1600.0, 900.0, 0.0],
            f"{HIP}_touch_s": [0.5, NAN, 0.6],
            f"{HIP}_force_N": [2000.0, 0.0, 700.0],
        }
    )
    assert same(falls.hip_force, [2000.0, NAN, 700.0])
    assert same(falls.descent, [0.5, 0.5, NAN])


def test_a_plan_that_does_not_let_go_of_the_figure_is_refused():
    with pytest.raises(ModelError, match="run_falls needs a plan of fall_plan"):
        run_falls(MAN, "faint", 2, plan=Plan(stop=1.0))


def test_a_figure_without_a_head_has_no_share():
    assert np.isnan(made({f"{PELVIS}_touch_s": [0.5]}).head_hit_share)


@pytest.mark.parametrize(
    ("values", "mean", "sd"),
    [([], NAN, NAN), ([NAN, 3.0], 3.0, NAN), ([1.0, NAN, 3.0], 2.0, 2**0.5)],
)
def test_mean_and_deviation_are_of_the_known_numbers(values: list[float], mean: float, sd: float):
    found = summarize(np.array(values))
    assert found == pytest.approx((mean, sd), nan_ok=True)


@pytest.fixture(scope="module")
def four() -> Falls:
    """Four pushes until just after the pelvis has touched."""
    plan = replace(fall_plan(MAN, "push", 5), stop=0.6)
    return run_falls(MAN, "push", 4, seed=5, plan=plan, jobs=2)


@pytest.mark.slow
def test_each_fall_is_a_run_of_its_own_bit_for_bit(four: Falls):
    assert four.seeds.tolist() == [5.0, 6.0, 7.0, 8.0]
    for k, seed in enumerate((5, 6, 7, 8)):
        plan = replace(fall_plan(MAN, "push", seed), stop=0.6, integrator=Integrator.IMPLICIT)
        contact = simulate(MAN, plan).contact
        assert contact is not None
        row = four.rows[k].measures
        hip = contact.parts[HIP]
        assert (row[f"{HIP}_touch_s"], row[f"{HIP}_force_N"]) == (hip.first_time, hip.peak_force)
        for part in (PELVIS, *HANDS):
            one = contact.segments[part]
            assert row[f"{part}_touch_s"] == one.first_time
            assert row[f"{part}_force_N"] == one.peak_force
            if one.first_time is not None:
                assert row[f"{part}_speed_m_per_s"] == one.impact_speed


@pytest.mark.slow
def test_the_falls_have_the_weight_of_the_man(four: Falls):
    mass = sum(body.mass or 0.0 for body in MAN.bodies.values())
    assert four.weight == pytest.approx(9.81 * mass)
    assert four.is_done.all()


def test_parameters_apply_to_the_start_of_each_fall():
    model, plan = Model.of(MAN), fall_plan(MAN, "faint")
    plain, scaled = (
        fall_case(model, "faint", 3, plan, scales)
        for scales in ((), [("floor.friction", 0.1), ("springs.knee.scale", 4.0)])
    )
    assert plain.plan == fall_plan(MAN, "faint", 3)
    assert scaled.plan.scene.props[0].surface.friction == 0.1
    assert scaled.plan.displacements == plain.plan.displacements
    assert scaled.model != plain.model


def test_a_start_that_cannot_be_made_is_a_failed_run():
    model, plan = Model.of(MAN), fall_plan(MAN, "faint")
    measures = {"m": Measure("m", "time [s]", Statistic.LAST)}
    study = Study("faint", model, plan, {}, Design(DesignKind.LIST), measures)
    result = run_fall("faint", [("floor.frixion", 0.1)], study, [0.0])
    assert (result.outcome, result.measures) == (WRONG_INPUT, {"m": None})


def test_an_unknown_kind_is_refused_before_any_process(monkeypatch: pytest.MonkeyPatch):
    def refuse(*_: Any) -> None:
        raise AssertionError("a process was started")

    monkeypatch.setattr("generator.study.falls.run_locally", refuse)
    with pytest.raises(UnknownNameError, match="did you mean `slip`"):
        run_falls(MAN, "slipp", 3)


def test_falls_that_are_given_up_leave_those_that_have_ended(monkeypatch: pytest.MonkeyPatch):
    def arrive(study: Study, *_: Any) -> Iterator[FinishedRun]:
        for index in (2, 0, 1):
            measures = dict.fromkeys(study.measures, float(index))
            yield FinishedRun(index, RunResult("done", "", measures), 0.1)

    monkeypatch.setattr("generator.study.falls.run_locally", arrive)
    falls = run_falls(MAN, "faint", 3, seed=7, watch=lambda run: run.index == 0)
    assert falls.seeds.tolist() == [7.0, 9.0]
    assert falls.measure(f"{HEAD}_touch_s").tolist() == [0.0, 2.0]
    assert falls.is_done.all()
