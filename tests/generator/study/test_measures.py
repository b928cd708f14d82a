"""Measures of motions: titles before a run, numbers after it, faults of unknown columns."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from generator import Integrator, Plan, read_figure, simulate
from generator.contact_file.parts import BodyContact, BodyPart
from generator.diagnostics import ModelError
from generator.figure import Figure
from generator.model import Model
from generator.motion_files.motion import FigureMotion, motion_from_recording
from generator.motion_files.tables import format_csv
from generator.recording import RecordingPart
from generator.study.measures import (
    check_measures,
    measure_motion,
    measure_rest,
    motion_columns,
    parts_of_measures,
)
from generator.study.run_case import run_case
from generator.study.study import Design, DesignKind, Measure, Statistic, Study
from springs import SpringSet
from springs.contact_part import PartLaw
from tests.chains import row
from tests.contact_figures import FLOOR, ball
from tests.motions import clip

BOUNCE = Plan(stop=0.4, scene=FLOOR, springs=SpringSet())


@pytest.fixture(scope="module")
def bounce() -> tuple[Figure, FigureMotion]:
    """A ball that falls from 5 cm and bounces."""
    figure = ball(0.05)
    return figure, motion_from_recording(simulate(figure, BOUNCE), figure)


def table_of(motion: FigureMotion) -> dict[str, list[str]]:
    lines = [line for line in format_csv(motion).splitlines() if not line.startswith("#")]
    titles, *rows = [line.split(",") for line in lines]
    return dict(zip(titles, map(list, zip(*rows, strict=True)), strict=True))


def number(
    motion: FigureMotion, column: str, take: Statistic, plan: Plan | None = None
) -> float | None:
    measures = [Measure("m", column, take)]
    return measure_motion(motion, plan or Plan(), measures)["m"]


def study(figure: Figure, plan: Plan, *measures: Measure) -> Study:
    by_name = {measure.name: measure for measure in measures}
    return Study("figure", Model(figure), plan, {}, Design(DesignKind.LIST), by_name)


@pytest.mark.parametrize("name", ["slides", "flying"])
def test_columns_of_a_start_begin_with_those_of_the_table(name: str) -> None:
    motion = clip(name)
    plan = Plan(free_root=name == "flying", springs=SpringSet())
    titles = list(motion_columns(motion.figure, plan))
    table = list(table_of(motion))
    assert titles[: len(table)] == table


def test_columns_with_contact_are_those_of_the_table(bounce: tuple[Figure, FigureMotion]) -> None:
    figure, motion = bounce
    table = list(table_of(motion))
    assert list(motion_columns(figure, BOUNCE))[: len(table)] == table


def test_every_column_of_a_start_has_a_number(bounce: tuple[Figure, FigureMotion]) -> None:
    figure, motion = bounce
    for title in motion_columns(figure, BOUNCE):
        assert np.isfinite(number(motion, title, Statistic.SMALLEST, BOUNCE) or 0.0), title


def test_the_last_number_is_that_of_the_table() -> None:
    motion = clip("slides")
    for title, cells in table_of(motion).items():
        assert number(motion, title, Statistic.LAST) == float(cells[-1])


def test_numbers_that_the_table_does_not_have() -> None:
    motion = clip("slides")
    run = motion.recording
    assert run is not None
    sideways = Plan(gravity=(-5.0, 0.0, 0.0))
    assert number(motion, "centre_of_mass_height [cm]", Statistic.LAST) == pytest.approx(
        100.0 * run.centre_of_mass[-1, 1]
    )
    assert number(motion, "centre_of_mass_height [cm]", Statistic.LAST, sideways) == pytest.approx(
        100.0 * run.centre_of_mass[-1, 0]
    )
    force, moment = np.split(run.reactions["swing"][-1], 2)
    assert number(motion, "swing.reaction_force [N]", Statistic.LAST) == np.linalg.norm(force)
    assert number(motion, "swing.reaction_moment [N m]", Statistic.LAST) == np.linalg.norm(moment)
    torque = np.linalg.norm(run.passive_torques["rail"][-1])
    assert number(motion, "rail.passive_torque [N m]", Statistic.LAST) == torque


def test_extremes_and_their_times() -> None:
    motion = clip("slides")
    degrees = np.degrees(motion.displacements["swing"][:, 0])
    largest = number(motion, "swing.1 [deg]", Statistic.LARGEST)
    assert largest is not None
    assert degrees.max() <= largest <= degrees.max() + np.ptp(degrees) / 10.0
    smallest = number(motion, "swing.1 [deg]", Statistic.SMALLEST)
    assert smallest is not None
    assert degrees.min() - np.ptp(degrees) / 10.0 <= smallest <= degrees.min()
    for take, frame in (
        (Statistic.TIME_OF_LARGEST, int(np.argmax(degrees))),
        (Statistic.TIME_OF_SMALLEST, int(np.argmin(degrees))),
    ):
        assert number(motion, "swing.1 [deg]", take) == pytest.approx(
            motion.times[frame], abs=motion.times[1] - motion.times[0]
        )


def test_peaks_of_contact_are_over_all_steps(bounce: tuple[Figure, FigureMotion]) -> None:
    """The ball is on the floor for some 10 ms, less than a frame."""
    figure, motion = bounce
    fine = motion_from_recording(simulate(figure, replace(BOUNCE, frame=5e-4)), figure)
    cells = table_of(fine)["ground_force_vy [N]"]
    exact = max(map(float, cells))
    in_frames = max(map(float, table_of(motion)["ground_force_vy [N]"]))
    for title in ("ground_force_vy [N]", "link.contact_force [N]"):
        assert number(motion, title, Statistic.LARGEST) == pytest.approx(exact, rel=1e-2)
        time = number(motion, title, Statistic.TIME_OF_LARGEST)
        assert time == pytest.approx(fine.times[cells.index(repr(exact))], abs=1e-3)
    assert in_frames < 0.9 * exact


def test_an_undefined_number_is_none(bounce: tuple[Figure, FigureMotion]) -> None:
    _, motion = bounce
    in_the_air = table_of(motion)["ground_force_px [cm]"][-1] == ""
    assert in_the_air
    assert number(motion, "ground_force_px [cm]", Statistic.LAST) is None
    assert number(motion, "ground_force_px [cm]", Statistic.LARGEST) is not None


def test_a_column_that_does_not_change_has_extremes_without_a_time() -> None:
    figure = ball(0.5)
    motion = motion_from_recording(simulate(figure, replace(BOUNCE, stop=0.1)), figure)
    force = "link.contact_force [N]"
    assert number(motion, force, Statistic.LARGEST) == 0.0
    assert number(motion, force, Statistic.TIME_OF_LARGEST) is None


def test_displacements_at_rest_are_in_the_unit_of_the_column() -> None:
    chains = clip("slides").chains
    rest = {name: np.linspace(0.1, 0.3, len(chain)) for name, chain in chains.items()}
    measures = [
        Measure("a", "rail.1 [deg]", Statistic.REST),
        Measure("b", "rail.2 [cm]", Statistic.REST),
    ]
    found = measure_rest(chains, rest, measures)
    assert found == {"a": pytest.approx(np.degrees(0.1)), "b": 30.0}
    with pytest.raises(ModelError, match="no column"):
        measure_rest(chains, rest, [Measure("c", "kinetic [J]", Statistic.REST)])


WRONG: Mapping[str, tuple[str, Statistic, str, str]] = {
    "misspelled": ("joint0.1 [dge]", Statistic.LAST, "column", "did you mean `joint0.1 [deg]`?"),
    "without contact": ("ground_force_vy [N]", Statistic.LAST, "column", "known here"),
    "energy at rest": ("kinetic [J]", Statistic.REST, "take", "a displacement of a joint has one"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_measures_are_faults(case: str) -> None:
    column, take, key, hint = WRONG[case]
    wrong = Measure("wrong", column, take)
    right = Measure("right", "joint0.1 [deg]", Statistic.REST)
    (fault,) = check_measures(study(row(1), Plan(springs=SpringSet()), right, wrong))
    assert (fault.measure, fault.key) == ("wrong", key)
    assert column in fault.message
    assert hint in fault.hint


@pytest.mark.parametrize("take", [Statistic.LAST, Statistic.REST])
@pytest.mark.parametrize("has_floor", [False, True])
def test_every_column_that_is_accepted_is_measured(take: Statistic, has_floor: bool) -> None:
    figure = read_figure("leg" if has_floor else "pendulum")
    plan = Plan(stop=0.04)
    if has_floor:
        plan = replace(plan, free_root=True, height=0.0, scene=FLOOR)
    asked = [Measure(title, title, take) for title in motion_columns(figure, plan)]
    wrong = {fault.measure for fault in check_measures(study(figure, plan, *asked))}
    accepted = [one for one in asked if one.name not in wrong]
    assert len(accepted) == (len(asked) if take is Statistic.LAST else 6 if has_floor else 3)
    found = run_case(study(figure, plan, *accepted), ())
    assert (found.outcome, found.message) == ("done", "")
    assert found.measures.keys() == {one.name for one in accepted}


@pytest.mark.parametrize("column", ["injury_criterion [1]", "peak_acceleration [g]"])
def test_numbers_of_the_head_are_of_the_whole_run(column: str) -> None:
    figure = read_figure("male50")
    plan = Plan(scene=FLOOR, free_root=True, height=0.1, springs=SpringSet())
    measures = [
        Measure(take.name, f"head.{column}", take)
        for take in (Statistic.LAST, Statistic.LARGEST, Statistic.TIME_OF_LARGEST)
    ]
    faults = list(check_measures(study(figure, plan, *measures)))
    assert [fault.measure for fault in faults] == ["TIME_OF_LARGEST"]


def test_parts_of_a_body_are_measured() -> None:
    """A ball that falls from 5 cm is one part, and a head."""
    law, figure = PartLaw(((0.0, 3e4),)), ball(0.05)
    parts = (BodyPart("skin", law, (("link", 0),)), BodyPart("far", law, ()))
    model, plan = Model(figure, SpringSet(), BodyContact(parts)), Plan(stop=0.3, scene=FLOOR)
    columns = {
        "touch": "part.skin.first_touch [s]",
        "speed": "part.skin.impact_speed [m/s]",
        "force": "part.skin.peak_force [N]",
        "weights": "part.skin.body_weights [1]",
        "none": "part.far.first_touch [s]",
        "nothing": "part.far.peak_force [N]",
    }
    measures = {name: Measure(name, title, Statistic.LAST) for name, title in columns.items()}
    made = Study("parts", model, plan, {}, Design(DesignKind.LIST), measures)
    assert list(check_measures(made)) == []
    found = run_case(made, ()).measures
    contact = simulate(model, replace(plan, integrator=Integrator.IMPLICIT)).contact
    assert contact is not None
    part = contact.parts["skin"]
    assert (found["touch"], found["speed"]) == (part.first_time, part.impact_speed)
    assert found["weights"] == part.body_weights
    assert found["force"] == part.peak_force == contact.segments["link"].peak_force > 100.0
    assert (found["none"], found["nothing"]) == (None, 0.0)
    wrong = replace(made, measures={"m": Measure("m", columns["force"], Statistic.TIME_OF_LARGEST)})
    assert [fault.key for fault in check_measures(wrong)] == ["take"]
    wrong = replace(made, model=Model(figure, SpringSet()))
    assert {fault.key for fault in check_measures(wrong)} == {"column"}


def test_heads_have_an_acceleration_and_those_of_parts_a_criterion() -> None:
    man, plan = Model.of(read_figure("male50")), Plan(stop=0.05, scene=FLOOR, free_root=True)
    titles = ("head.injury_criterion [1]", "head.peak_acceleration [g]")
    measures = {title: Measure(title, title, Statistic.LAST) for title in titles}
    for model in (man, replace(man, contact=None)):
        made = Study("head", model, plan, {}, Design(DesignKind.LIST), measures)
        injury, acceleration = run_case(made, ()).measures.values()
        assert (injury is None) == (model.contact is None)
        assert acceleration == pytest.approx(1.0, rel=0.2)


def test_the_first_touch_is_that_of_a_free_fall(bounce: tuple[Figure, FigureMotion]) -> None:
    """Of a ball from 5 cm."""
    _, motion = bounce
    duration = (2.0 * 0.05 / 9.81) ** 0.5
    time = number(motion, "link.first_touch [s]", Statistic.LAST, BOUNCE)
    speed = number(motion, "link.impact_speed [m/s]", Statistic.LARGEST, BOUNCE)
    assert time == pytest.approx(duration, rel=1e-4)
    assert speed == pytest.approx(9.81 * duration, rel=1e-4)


def test_without_a_touch_there_is_none() -> None:
    figure = ball(1.0)
    motion = motion_from_recording(simulate(figure, replace(BOUNCE, stop=0.1)), figure)
    for column in ("link.first_touch [s]", "link.impact_speed [m/s]"):
        assert number(motion, column, Statistic.LAST, BOUNCE) is None


PARTS: Sequence[tuple[str, set[RecordingPart]]] = [
    ("joint0.1 [deg]", set()),
    ("time [s]", set()),
    ("centre_of_mass_height [cm]", set()),
    ("kinetic [J]", {RecordingPart.ENERGY}),
    ("friction [J]", {RecordingPart.LOSSES}),
    ("bar0.first_touch [s]", {RecordingPart.CONTACT_STEPS}),
    ("bar0.contact_force [N]", {RecordingPart.CONTACT}),
    ("joint0.passive_torque [N m]", {RecordingPart.PASSIVE_TORQUES}),
    ("joint0.reaction_force [N]", {RecordingPart.REACTIONS}),
    ("no such column", set()),
]


def test_the_largest_contact_force_needs_the_steps_only() -> None:
    for take in (Statistic.LARGEST, Statistic.TIME_OF_LARGEST):
        measures = [Measure("m", "bar0.contact_force [N]", take)]
        assert parts_of_measures(row(1), measures) == {RecordingPart.CONTACT_STEPS}


def test_only_the_head_injury_criterion_needs_its_search() -> None:
    for column, part in (
        ("head.injury_criterion [1]", RecordingPart.HEAD_INJURY),
        ("head.peak_acceleration [g]", RecordingPart.CONTACT_STEPS),
    ):
        measures = [Measure("m", column, Statistic.LAST)]
        assert parts_of_measures(read_figure("male50"), measures) == {part}


@pytest.mark.parametrize(("column", "parts"), PARTS)
def test_measures_need_only_their_parts(column: str, parts: set[RecordingPart]) -> None:
    assert parts_of_measures(row(1), [Measure("m", column, Statistic.LAST)]) == parts


def test_each_load_of_a_free_figure_is_recorded_for_its_measure() -> None:
    figure = row(2)
    titles = motion_columns(figure, Plan(free_root=True, springs=SpringSet()))
    loads = [title for title in titles if ".reaction" in title or ".passive" in title]
    assert loads
    for title in loads:
        assert parts_of_measures(figure, [Measure("m", title, Statistic.LAST)]), title
