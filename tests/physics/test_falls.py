"""Falls on a floor beside other engines: what is read off them, and that the engines are right."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import falls
from benchmarks.falls import COLLAPSE, HIPS, MANNERS, Manner, Start, largest_mean, outcome
from benchmarks.outside import Landing
from benchmarks.tree import GRAVITY, between
from generator.figure_file import read_figure
from springs.contact import DEFAULT_SURFACE

PROTOTYPE = read_figure("prototype")
WEIGHT = PROTOTYPE.total_mass * GRAVITY

FLIGHT = Start(MANNERS[COLLAPSE].start(PROTOTYPE, 3).displacements, (0.0, 6.0, 0.0))
"""Thrown upwards from the floor, so that nothing touches it after the first instant."""


def landing(heights, forces) -> Landing:
    """A fall along z with a force on the left thigh."""
    times = np.linspace(0.0, 1.0, 1001)
    centre = np.stack([0.0 * times, heights(times), 0.3 * times], axis=1)
    nothing = np.zeros_like(times)
    by_segment = {name: nothing for hip in HIPS for name in hip}
    return Landing(times, centre, {**by_segment, "left_upper_leg": forces(times)}, {})


def test_what_is_read_off_a_fall() -> None:
    made = landing(
        lambda t: np.maximum(1.0 - t, 0.2), lambda t: 100.0 + 1000.0 * np.isclose(t, 0.4)
    )
    read = outcome(made, 50.0)
    assert read.falling == pytest.approx(0.4)
    assert read.down == pytest.approx(0.75)
    assert read.rest_height == pytest.approx(0.2)
    assert read.drift == pytest.approx(0.27)
    assert read.largest_force == read.hip_force == 1100.0
    # A single step of 1 ms in a window of 10 ms.
    assert read.largest_mean_force == pytest.approx(200.0)
    assert read.carried == pytest.approx(2.0)


def test_a_figure_that_stays_up_does_not_fall() -> None:
    read = outcome(landing(np.ones_like, np.zeros_like), 1.0)
    assert np.isnan(read.falling)
    assert np.isnan(read.down)


def test_the_force_on_a_hip_is_that_of_one_thigh() -> None:
    made = landing(np.ones_like, lambda t: 100.0 + 0.0 * t)
    forces = {**made.forces, "right_upper_leg": 70.0 + 0.0 * made.times}
    forces["lower_torso"] = 20.0 + 0.0 * made.times
    assert outcome(replace(made, forces=forces), 1.0).hip_force == 120.0


def test_the_mean_over_a_window_with_unequal_steps() -> None:
    times = np.concatenate([np.linspace(0.0, 0.5, 7), np.linspace(0.5, 1.0, 400)[1:]])
    assert largest_mean(times, 3.0 + 2.0 * times, 0.1) == pytest.approx(4.9)


def test_starts_differ_and_are_the_same_again() -> None:
    manner = Manner({"left_knee": (0.35,)})
    one, again, other = (manner.start(PROTOTYPE, seed) for seed in (1, 1, 2))
    assert one == again
    assert one.displacements["root_torso"] == (0.0, 0.0, 0.0)
    for name in PROTOTYPE.joints:
        if name != "root_torso":
            assert one.displacements[name] != other.displacements[name]
    changes = [
        value - 0.35 * (name == "left_knee")
        for seed in range(50)
        for name, values in manner.start(PROTOTYPE, seed).displacements.items()
        for value in values
        if name != "root_torso"
    ]
    assert np.std(changes) == pytest.approx(falls.SPREAD, rel=0.1)


@pytest.mark.verify
@pytest.mark.parametrize("engine", ["MuJoCo", "Drake"])
def test_in_flight_an_engine_moves_as_this_program(engine: str) -> None:
    """Its tree, its free root and its springs are right; what differs below is contact."""
    ours = falls.own(PROTOTYPE, DEFAULT_SURFACE, stop=0.5)(FLIGHT)
    if engine == "MuJoCo":
        engine = pytest.importorskip("benchmarks.engines.mujoco_engine")
        floor = engine.Floor(falls.spheres(PROTOTYPE))
        made = falls.mujoco(PROTOTYPE, floor, 1e-4, stop=0.5)(FLIGHT)
    else:
        pytest.importorskip("pydrake")
        made = falls.drake(PROTOTYPE, DEFAULT_SURFACE, 1e-4, stop=0.5)(FLIGHT)
    # Their methods are of first order: 1e-3 rad at this step, 1e-2 at ten times as much.
    assert between(made.rotations, ours.rotations) < 2e-3
    assert np.interp(0.4, made.times, made.centre[:, 1]) == pytest.approx(
        np.interp(0.4, ours.times, ours.centre[:, 1]), abs=1e-3
    )


@pytest.mark.verify
@pytest.mark.parametrize("shape", ["hulls", "spheres"])
def test_mujoco_s_floor_carries_the_figure(shape: str) -> None:
    engine = pytest.importorskip("benchmarks.engines.mujoco_engine")
    floor = engine.Floor(getattr(falls, shape)(PROTOTYPE))
    made = falls.mujoco(PROTOTYPE, floor, 1e-3)(MANNERS[COLLAPSE].start(PROTOTYPE, 0))
    read = outcome(made, WEIGHT)
    assert read.carried == pytest.approx(1.0, abs=0.02)
    assert 0.35 < read.falling < 0.45
    assert 0.05 < read.rest_height < 0.15


@pytest.mark.verify
def test_drake_s_floor_carries_the_figure() -> None:
    pytest.importorskip("pydrake")
    land = falls.drake(PROTOTYPE, DEFAULT_SURFACE, 2e-3)
    read = outcome(land(MANNERS[COLLAPSE].start(PROTOTYPE, 0)), WEIGHT)
    assert read.carried == pytest.approx(1.0, abs=0.03)
    assert 0.35 < read.falling < 0.45
