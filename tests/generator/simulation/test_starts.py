"""Runs from several starts: the changes of the start, and the distribution of the falls."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator import read_figure
from generator.contact.box import Box
from generator.contact.record import IMPACT_SPEED, SegmentContact
from generator.contact.scene import Prop, Scene, floor_prop
from generator.diagnostics import ModelError
from generator.drive import Drive
from generator.figure import Figure
from generator.kinematics.links import Coordinate, Link, Links
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.recording import Ending, Outcome, Recording
from generator.rotations import Array
from generator.simulation import starts
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.simulation.run_model import initial_state
from generator.simulation.starts import study_starts, summarize_starts, vary_start
from springs import SpringSet
from springs.contact import DEFAULT_SURFACE
from tests.chains import chain, one_body

PROTOTYPE = read_figure("prototype")
FLOOR = Scene((floor_prop((0.0, 1.0, 0.0)),))
FALL = Plan(stop=0.01, frame=0.005, free_root=True, height=0.0, scene=FLOOR)
UP = np.array([0.0, 1.0, 0.0])


def varied(figure: Figure, plan: Plan, seed: int = 0, spread: float = 0.1) -> Mapping[str, Array]:
    """Changes of the displacements that the figure starts with."""
    start = initial_displacements(build_tree(figure))
    changed = vary_start(figure, plan, spread, np.random.default_rng(seed)).displacements
    return {name: np.asarray(changed.get(name, start[name])) - start[name] for name in start}


# Changes of the start


@given(st.integers(0, 2**32))
@settings(max_examples=20, deadline=None)
def test_the_same_seed_gives_the_same_start_and_another_seed_another(seed: int):
    one, same, other = (varied(PROTOTYPE, FALL, each) for each in (seed, seed, seed + 1))
    assert one.keys() == set(PROTOTYPE.joints)
    for name, change in one.items():
        assert np.array_equal(change, same[name])
        assert np.all(change != other[name])


def test_later_starts_differ_from_the_first():
    generator = np.random.default_rng(0)
    first, second = (vary_start(PROTOTYPE, FALL, 0.1, generator) for _ in range(2))
    assert all(np.all(first.displacements[k] != second.displacements[k]) for k in PROTOTYPE.joints)


def test_only_rotations_change():
    figure = one_body(chain("Rx Ry Tx Tz"), [0.1, 0.2, 0.3, 0.4])
    for seed in range(5):
        change = varied(figure, Plan(), seed)["pin"]
        assert np.array_equal(change != 0.0, [True, True, False, False])


def test_the_changes_have_the_standard_deviation_of_the_spread():
    generator = np.random.default_rng(5)
    angles = np.concatenate(
        [
            vary_start(one_body(chain("Rx Ry Rz")), Plan(), 0.2, generator).displacements["pin"]
            for _ in range(400)
        ]
    )
    assert np.mean(angles) == pytest.approx(0.0, abs=4.0 * 0.2 / 1200**0.5)
    assert np.std(angles) == pytest.approx(0.2, rel=4.0 / 2400**0.5)


def test_the_start_of_the_plan_is_the_mean():
    plan = replace(FALL, displacements={"left_knee": (0.7,), "waist": (0.1, 0.2, 0.3)})
    start = vary_start(PROTOTYPE, plan, 1e-9, np.random.default_rng(0)).displacements
    assert start["left_knee"] == pytest.approx([0.7], abs=1e-7)
    assert start["waist"] == pytest.approx([0.1, 0.2, 0.3], abs=1e-7)


def test_locked_linked_and_driven_joints_stay():
    link = Link(Coordinate("right_knee", 0), Coordinate("left_knee", 0), 1.0)
    drive = Drive((0.0, 1.0), ((0.0,), (0.5,)))
    plan = replace(FALL, locked=("waist",), links=Links((link,)), drives={"left_elbow": drive})
    changes = varied(PROTOTYPE, plan)
    still = {name for name, change in changes.items() if not np.any(change)}
    assert still == {"waist", "right_knee", "left_knee", "left_elbow"}
    free = varied(PROTOTYPE, FALL)
    assert all(np.array_equal(changes[name], free[name]) for name in free.keys() - still)


def test_loops_stay_closed_and_a_locked_joint_of_one_stays():
    fourbar = read_figure("fourbar")
    tree = build_tree(fourbar)
    for locked in ((), ("crank_bearing",)):
        plan = replace(FALL, locked=locked)
        start = vary_start(fourbar, plan, 0.1, np.random.default_rng(1)).displacements
        values = {**initial_displacements(tree), **start}
        closed = close_loops(tree, values, fixed=set(values)).displacements
        assert all(closed[name] == pytest.approx(values[name], abs=1e-8) for name in values)
        moved = {name for name, change in varied(fourbar, plan, 1).items() if np.any(change)}
        assert moved == (set() if locked else set(fourbar.joints))


# Runs


def front(plan: Plan) -> float:
    """Largest z of the contact spheres at the start [m]."""
    state = initial_state(PROTOTYPE, plan)
    return max(
        float((state.placement.poses[name] @ np.append(sphere.centre, 1.0))[2]) + sphere.radius
        for name, some in state.spheres.items()
        for sphere in some
    )


@pytest.fixture(scope="module")
def fall() -> Recording:
    return simulate(PROTOTYPE, FALL)


def made(fall: Recording, impacts: Mapping[str, tuple[float | None, float, float]]) -> Recording:
    """The run with other contacts: first touch, its speed, and the peak force."""
    contacts = {
        name: SegmentContact(time, speed, force, 0.0, (0.0, 0.0, 0.0))
        for name, (time, speed, force) in impacts.items()
    }
    nothing = np.zeros((fall.times.size, 3))
    assert fall.contact is not None
    record = replace(
        fall.contact,
        segments=contacts,
        forces=dict.fromkeys(contacts, nothing),
        depths=dict.fromkeys(contacts, nothing[:, 0]),
        max_force=2.0 * sum(force for _, _, force in impacts.values()),
        weight_carried=0.1 * len(contacts),
    )
    return replace(fall, contact=record)


def test_the_statistics_are_those_of_the_runs(fall: Recording):
    quick, slow = IMPACT_SPEED + 0.1, IMPACT_SPEED - 0.1
    one = made(fall, {"foot": (0.0, slow, 10.0), "hand": (0.3, quick, 30.0)})
    two = made(fall, {"foot": (0.1, quick, 20.0), "hand": (None, 0.0, 0.0)})
    inaccurate = replace(two.outcome, ending=Ending.INACCURATE)
    accuracy = replace(two.accuracy, tolerance_met_until=0.5 * two.times[-1])
    two = replace(two, outcome=inaccurate, accuracy=accuracy)
    three = made(fall, {"foot": (0.0, slow, 5.0), "hand": (None, 0.0, 0.0)})
    study = summarize_starts([one, two, three], UP, 0.02, 7)
    assert (len(study), study.spread, study.seed, study.failures) == (3, 0.02, 7, {})
    assert study.impact_times == pytest.approx([0.3, 0.1, np.nan], nan_ok=True)
    assert study.max_forces.tolist() == [80.0, 40.0, 10.0]
    assert {name: forces.tolist() for name, forces in study.peak_forces.items()} == {
        "foot": [10.0, 20.0, 5.0],
        "hand": [30.0, 0.0, 0.0],
    }
    assert study.weights_carried == pytest.approx([0.2, 0.2, 0.2])
    height = np.trapezoid(fall.centre_of_mass[:, 1], fall.times) / (fall.times[-1] - fall.times[0])
    assert study.rest_heights == pytest.approx([height] * 3)
    assert study.is_accurate is not None
    assert study.is_accurate.tolist() == [True, False, True]


def test_a_failed_start_is_counted_and_has_no_numbers(fall: Recording):
    outcome = Outcome(Ending.TURNED_OVER, "joint waist rotated through 180 deg", fall.times[-1])
    study = summarize_starts(
        [fall, replace(fall, outcome=outcome), ModelError("inside a prop")], UP, 0.02, 0
    )
    assert len(study) == 3
    assert study.failures == {2: "joint waist rotated through 180 deg", 3: "inside a prop"}
    numbers = (study.max_forces, study.rest_heights, study.weights_carried)
    for values in (*numbers, *study.peak_forces.values()):
        assert np.isnan(values).tolist() == [False, True, True]
    assert study.is_accurate is not None
    assert study.is_accurate.tolist() == [True, False, False]


def test_a_fixed_step_has_no_accuracy():
    study = study_starts(PROTOTYPE, replace(FALL, step=0.005), 1, 0.01)
    assert study.is_accurate is None
    assert study.failures == {}


def test_a_study_is_the_runs_of_its_starts():
    """Of the same random numbers, and again the same."""
    seen: list[int] = []
    study, again = (study_starts(PROTOTYPE, FALL, 2, 0.02, 3, seen.append) for _ in range(2))
    assert seen == [1, 2, 1, 2]
    generator = np.random.default_rng(3)
    runs = [simulate(PROTOTYPE, vary_start(PROTOTYPE, FALL, 0.02, generator)) for _ in range(2)]
    expected = summarize_starts(runs, UP, 0.02, 3)
    for name in ("max_forces", "rest_heights", "weights_carried"):
        values = getattr(study, name)
        assert np.array_equal(values, getattr(expected, name))
        assert np.array_equal(values, getattr(again, name))
        assert values[0] != values[1]


def test_a_start_inside_a_prop_fails_alone():
    """The undisturbed figure stands beside a wall, into which about half of the starts lean."""
    wall = Box((0.0, 1.0, front(FALL) + 1e-3 + 0.5), (4.0, 4.0, 1.0))
    plan = replace(FALL, scene=Scene((*FLOOR.props, Prop("wall", wall, DEFAULT_SURFACE))))
    study = study_starts(PROTOTYPE, plan, 8, 0.05)
    assert 0 < len(study.failures) < 8
    assert all("inside wall" in sentence for sentence in study.failures.values())
    failed = [number - 1 for number in study.failures]
    assert np.flatnonzero(np.isnan(study.max_forces)).tolist() == failed


def test_a_plan_that_cannot_be_built_is_refused():
    box = Prop("block", Box((0.0, 0.5, 0.0), (1.0, 1.0, 1.0)), DEFAULT_SURFACE)
    with pytest.raises(ModelError, match="inside block"):
        study_starts(PROTOTYPE, replace(FALL, scene=Scene((box,))), 2, 0.01)
    with pytest.raises(ModelError, match="need a plan whose scene has props"):
        study_starts(PROTOTYPE, Plan(free_root=True), 2, 0.01)


def test_an_interrupted_run_interrupts_the_study(fall: Recording, monkeypatch):
    runs = [fall, replace(fall, outcome=replace(fall.outcome, ending=Ending.INTERRUPTED))]
    monkeypatch.setattr(starts, "simulate", lambda *_: runs.pop(0))
    with pytest.raises(KeyboardInterrupt):
        study_starts(PROTOTYPE, FALL, 5, 0.01)
    assert runs == []


def test_watch_may_end_a_study_with_the_runs_so_far(fall: Recording, monkeypatch):
    monkeypatch.setattr(starts, "simulate", lambda *_: fall)
    study = study_starts(PROTOTYPE, FALL, 5, 0.01, watch=lambda number: number == 2)
    assert study.max_forces == pytest.approx([fall.contact.max_force] * 2)


def test_watch_may_interrupt():
    def watch(number: int) -> None:
        if number == 2:
            raise KeyboardInterrupt

    plan = replace(FALL, springs=SpringSet())
    with pytest.raises(KeyboardInterrupt):
        study_starts(PROTOTYPE, plan, 1000, 0.01, watch=watch)
