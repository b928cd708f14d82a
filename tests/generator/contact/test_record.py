"""Contact of a run: first touches, centre of pressure and injury criterion in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from generator.contact.record import (
    HEAD_INJURY_WINDOW,
    MIN_VERTICAL_FORCE,
    STANDARD_ACCELERATION,
    SegmentContact,
    centre_of_pressure,
    head_injury_criterion,
    mean_at_end,
    peak_of,
    search_injury,
    summarize_steps,
)
from generator.diagnostics import UnknownNameError
from generator.rotations import Array, matrix_from_xyz, unit_vector
from tests.contacts import contact_record

STEPS = np.cumsum(np.random.default_rng(3).uniform(5e-5, 2e-4, 4000))
"""Unequal steps up to about half a second."""


def summary(depths: Array, speeds: Array, owners: list[int], times: Array = STEPS):
    names = [f"s{k}" for k in range(max(owners) + 1)]
    forces = np.zeros((times.size, len(names), 3))
    return summarize_steps(names, owners, times, forces, depths, speeds, np.zeros((len(names), 3)))


def test_a_sphere_at_uniform_speed_touches_at_the_exact_moment():
    speeds = np.array([2.0, 3.0, 0.5])
    moments = np.array([0.2003, 0.3001, 0.25])
    depths = speeds * (STEPS[:, None] - moments)
    found = summary(depths, np.broadcast_to(speeds, depths.shape), [0, 0, 1])
    assert [c.first_time for c in found.values()] == pytest.approx([0.2003, 0.25], abs=1e-12)
    assert [c.impact_speed for c in found.values()] == pytest.approx([2.0, 0.5], abs=1e-12)


def test_a_falling_sphere_touches_within_the_error_of_a_chord():
    start, g = STEPS[0], 9.81
    height = 0.5 * g * 0.3**2
    depths = 0.5 * g * (STEPS - start)[:, None] ** 2 - height
    found = summary(depths, g * (STEPS - start)[:, None], [0])["s0"]
    chord_error = g * 2e-4**2 / 8.0 / (g * 0.3)
    assert found.first_time is not None
    assert abs(found.first_time - start - 0.3) <= chord_error
    assert found.impact_speed == pytest.approx(g * 0.3, abs=2.0 * g * chord_error)


def test_of_spheres_in_touch_at_the_start_the_deepest_counts_and_leaving_is_no_impact():
    depths = np.array([[0.01, 0.03, -1.0], [0.01, 0.03, -1.0]])
    speeds = np.array([[0.7, 0.2, 5.0], [0.0, 0.0, 5.0]])
    times = np.array([0.0, 0.1])
    assert summary(depths, speeds, [0, 0, 0], times)["s0"].impact_speed == 0.2
    assert summary(depths, -speeds, [0, 0, 0], times)["s0"].impact_speed == 0.0


def test_segments_without_spheres_or_touch_have_no_first_time():
    depths = np.full((STEPS.size, 1), -1e-9)
    found = summary(depths, np.ones_like(depths), [1])
    untouched = SegmentContact(None, 0.0, 0.0, STEPS[0], (0.0, 0.0, 0.0))
    assert found == {"s0": untouched, "s1": untouched}


def test_the_peak_is_of_the_size_of_the_force_and_the_impulse_is_that_of_the_run():
    forces = np.zeros((4, 2, 3))
    forces[1, 0], forces[2, 0] = (0.0, 5.0, 0.0), (-3.0, 4.0, 12.0)
    forces[3, 1] = (0.0, 0.0, -2.0)
    impulses = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    nothing = np.full((4, 2), -1.0)
    times = np.array([0.0, 1.0, 2.0, 9.0])
    found = summarize_steps(["a", "b"], [0, 1], times, forces, nothing, nothing, impulses)
    assert [(c.peak_force, c.peak_time) for c in found.values()] == [(13.0, 2.0), (2.0, 9.0)]
    assert [c.impulse for c in found.values()] == [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)]


@given(st.floats(-0.4, 0.4), st.floats(0.5, 9.0), st.floats(0.5, 2.5))
def test_a_parabola_has_its_peak_between_the_steps(time, bend, ratio):
    times = np.array([-1.0, 0.0, ratio])
    values = 7.0 - bend * (times - time) ** 2
    if np.argmax(values) == 1:
        assert peak_of(times, values) == pytest.approx((time, 7.0))


@pytest.mark.parametrize("times", [(0.0, 1e-9, 1.0), (0.0, 1.0, 1.0 + 1e-9), (0.0, 0.0, 1.0)])
def test_the_peak_beside_a_short_step_is_that_of_a_step(times):
    assert peak_of(np.array(times), np.array([0.9, 1.0, 0.0])) == (times[1], 1.0)


def test_the_mean_at_the_end_of_a_line_is_its_middle():
    assert mean_at_end(STEPS, 3.0 * STEPS, 0.1) == pytest.approx(3.0 * (STEPS[-1] - 0.05))
    assert mean_at_end(STEPS, 3.0 * STEPS, 9.0) == pytest.approx(1.5 * (STEPS[0] + STEPS[-1]))
    assert mean_at_end(np.array([0.4]), np.array([7.0])) == 7.0


COMPONENT = st.floats(-5.0, 5.0)
PLACE = st.tuples(COMPONENT, COMPONENT, COMPONENT)
ANGLES = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


@given(ANGLES, PLACE, PLACE, st.floats(-20.0, 20.0), st.floats(-2.0, 2.0))
def test_the_wrench_of_a_point_force_and_a_free_moment_returns_them(
    angles: tuple[float, float, float],
    place: tuple[float, float, float],
    pull: tuple[float, float, float],
    free: float,
    height: float,
):
    """On a plane of any direction and height."""
    turn = matrix_from_xyz(*angles)
    up = turn[:, 1]
    point = turn @ (place[0], height, place[2])
    force = turn @ (10.0 * pull[0], 50.0 * abs(pull[1]) + 20.0, 10.0 * pull[2])
    wrench = np.concatenate([force, np.cross(point, force) + free * up])
    points, moments = centre_of_pressure(wrench[None], 3.0 * up, height)
    assert points[0] == pytest.approx(point, abs=1e-9)
    assert moments[0] == pytest.approx(free, abs=1e-8)


def test_two_equal_vertical_forces_have_their_centre_between_them():
    points, load = np.array([[0.1, 0.0, 0.4], [0.3, 0.0, -0.2]]), np.array([0.0, 200.0, 0.0])
    reaction = np.concatenate([2.0 * load, np.cross(points, load).sum(axis=0)])
    centre, moment = centre_of_pressure(reaction[None])
    assert centre[0] == pytest.approx([0.2, 0.0, 0.1])
    assert moment[0] == pytest.approx(0.0, abs=1e-12)


def test_without_a_vertical_force_there_is_no_centre_of_pressure():
    reaction = np.zeros((4, 6))
    reaction[:, 0] = 300.0
    reaction[:, 1] = [0.0, -500.0, 0.99 * MIN_VERTICAL_FORCE, MIN_VERTICAL_FORCE]
    points, moments = centre_of_pressure(reaction)
    assert np.isnan(points).all(axis=1).tolist() == [True, True, True, False]
    assert np.isnan(moments).tolist() == [True, True, True, False]


def pulse(times: Array, sizes: Array, seed: int = 0) -> tuple[Array, Array]:
    """Accelerations of given sizes, in multiples of g, in any direction."""
    direction = unit_vector(np.random.default_rng(seed).normal(size=3))
    return times, STANDARD_ACCELERATION * sizes[:, None] * direction


@pytest.mark.parametrize("rise", [0.5, 0.2, 0.9])
def test_the_criterion_of_a_triangle(rise: float):
    """(1 - x/2)^2.5 x is largest at x = 4/7 of the duration, wherever the peak is."""
    duration = 0.02
    times = np.linspace(0.0, duration, 4001)
    sizes = np.interp(times / duration, [0.0, rise, 1.0], [0.0, 80.0, 0.0])
    expected = 80.0**2.5 * (5.0 / 7.0) ** 2.5 * (4.0 / 7.0) * duration
    assert head_injury_criterion(*pulse(times, sizes)) == pytest.approx(expected, rel=1e-6)


def test_the_criterion_of_half_a_sine():
    """(sin u / u)^2.5 u is largest at tan u = 5u/3, u the half angle of the interval."""
    u = brentq(lambda u: np.tan(u) - 5.0 * u / 3.0, 0.5, 1.5)
    duration = 0.02
    middle = 0.25
    within = np.abs(STEPS - middle) < 0.5 * duration
    sizes = np.where(within, 90.0 * np.cos(np.pi * (STEPS - middle) / duration), 0.0)
    expected = 90.0**2.5 * (np.sin(u) / u) ** 2.5 * u * 2.0 / np.pi * duration
    assert expected == pytest.approx(0.4146 * 90.0**2.5 * duration, rel=1e-3)
    assert head_injury_criterion(*pulse(STEPS, sizes)) == pytest.approx(expected, rel=1e-3)


def test_the_window_limits_a_long_half_sine():
    duration, window = 0.08, HEAD_INJURY_WINDOW
    times = np.linspace(0.0, duration, 1601)
    half = 0.5 * np.pi * window / duration
    expected = (70.0 * np.sin(half) / half) ** 2.5 * window
    sizes = 70.0 * np.sin(np.pi * times / duration)
    assert head_injury_criterion(*pulse(times, sizes)) == pytest.approx(expected, rel=1e-6)
    assert head_injury_criterion(*pulse(times, sizes), window=0.036) > 1.5 * expected


def test_coarse_steps_do_not_shorten_the_window():
    times = np.array([0.0, 0.011, 0.022, 0.033])
    value = head_injury_criterion(*pulse(times, np.full(4, 30.0)))
    assert value == pytest.approx(30.0**2.5 * HEAD_INJURY_WINDOW)


@given(st.lists(st.floats(0.0, 200.0), min_size=2, max_size=25), st.integers(0, 1000))
def test_the_criterion_is_at_least_that_of_every_interval_of_steps(sizes: list[float], seed: int):
    gaps = np.random.default_rng(seed).uniform(1e-4, 8e-3, len(sizes) - 1)
    times = np.concatenate([[0.0], np.cumsum(gaps)])
    found = head_injury_criterion(*pulse(times, np.array(sizes), seed))
    for first in range(len(sizes)):
        for last in range(first + 1, len(sizes)):
            if (span := times[last] - times[first]) <= HEAD_INJURY_WINDOW:
                part = slice(first, last + 1)
                pairs = zip(sizes[part], sizes[part][1:], strict=False)
                areas = [0.5 * (one + other) for one, other in pairs]
                mean = float(np.dot(areas, np.diff(times[part]))) / span
                assert found >= mean**2.5 * span * (1.0 - 1e-9)
    assert found <= max(sizes) ** 2.5 * HEAD_INJURY_WINDOW * (1.0 + 1e-6) + 1e-12


def test_a_single_step_has_no_criterion():
    assert head_injury_criterion(np.array([0.3]), np.full((1, 3), 100.0)) == 0.0


def test_a_record_names_its_segments():
    record = contact_record(["shank", "thigh"], 3)
    with pytest.raises(UnknownNameError, match="no contact of segment `thihg`; did you mean"):
        _ = record.forces["thihg"]
    with pytest.raises(ValueError, match="differ in names"):
        replace(record, depths={"shank": np.zeros(3)})


def injury_by_all_pairs(times: Array, speeds: Array, longest: float) -> float:
    """The largest value of all pairs of points."""
    largest = 0.0
    for k in range(len(times) - 1):
        durations = times[k + 1 :] - times[k]
        gains = np.maximum(speeds[k + 1 :] - speeds[k], 0.0)
        values = (gains / durations) ** 2.5 * durations
        largest = max(largest, float(np.max(values[durations <= longest], initial=0.0)))
    return largest


@st.composite
def speed_curves(draw: st.DrawFn) -> tuple[Array, Array]:
    """Points at uneven times, and an integral that rests, grows, falls, jumps or is rounded."""
    number = draw(st.integers(2, 150))
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    gaps = random.choice([1e-5, 1e-4, 1e-3, 5e-3, 4e-2], number) * random.uniform(0.5, 1.0, number)
    if draw(st.booleans()):
        gaps[:] = draw(st.sampled_from([1e-6, 1e-3]))
    sizes = random.uniform(0.0, 1.0, number) ** draw(st.integers(0, 8))
    sizes *= random.choice([0.0, -1.0, 1.0, 1e3], number)
    kind = draw(st.sampled_from(["any", "constant", "zero", "falling", "an impulse", "ramp"]))
    if kind == "constant":
        sizes[:] = 50.0
    elif kind == "ramp":
        sizes = np.arange(number, dtype=float)
    elif kind == "falling":
        sizes = -np.abs(sizes)
    elif kind != "any":
        sizes[:] = 0.0
        sizes[number // 2] = float(kind == "an impulse")
    start = draw(st.sampled_from([0.0, 1e3]))
    return np.cumsum(gaps), start + np.cumsum(sizes * gaps)


@given(speed_curves(), st.sampled_from([0.015, 0.036, 1e-6, 1e-3, 10.0]))
def test_the_search_finds_the_largest_of_all_pairs(curve: tuple[Array, Array], longest: float):
    expected = injury_by_all_pairs(*curve, longest)
    assert search_injury(*curve, longest).value == pytest.approx(expected, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("window", [0.015, 0.036])
@pytest.mark.parametrize("kind", ["constant", "noise", "an impact", "vibration", "an impulse"])
def test_ten_times_the_points_take_at_most_twenty_times_the_pairs(kind: str, window: float):
    def examined(number: int) -> int:
        times = np.linspace(0.0, 2.0, number)
        sizes = {
            "constant": np.full(number, 50.0),
            "noise": np.random.default_rng(0).uniform(0.0, 100.0, number),
            "an impact": 10.0 + 500.0 * np.exp(-(((times - 1.0) / 0.004) ** 2)),
            "vibration": 300.0 * np.abs(np.sin(200.0 * times)),
            "an impulse": 10.0 + 1e4 * (np.arange(number) == number // 2),
        }[kind]
        return search_injury(times, np.cumsum(sizes) * times[1], window).examined

    few, many = examined(3_000), examined(30_000)
    assert few > 3_000
    assert many <= 20 * few
    assert many < 60 * 30_000


@pytest.mark.parametrize("times", [(0.0, np.nan, 0.1), (0.0, 0.1, 0.05), (0.0, np.inf, np.inf)])
def test_times_that_are_not_times_have_no_criterion(times: tuple[float, ...]):
    with pytest.raises(ValueError, match="must be finite and must not decrease"):
        head_injury_criterion(np.array(times), np.ones((3, 3)))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_an_acceleration_that_is_not_finite_has_no_criterion(value: float):
    assert np.isnan(head_injury_criterion(np.array([0.0, 0.1]), np.array([[1.0] * 3, [value] * 3])))
