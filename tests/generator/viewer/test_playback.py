"""The clock of a motion, its frames, and their curves."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import Plan, simulate
from generator.diagnostics import ModelError
from generator.motion_files import FigureMotion, motion_from_recording
from generator.recording import ENERGY_KINDS
from generator.springs_file.read import read_springs
from generator.viewer import playback
from tests.motions import any_motion, clip, shipped, site

TIMES = st.lists(st.floats(1e-3, 10.0), min_size=0, max_size=20).map(
    lambda gaps: 0.5 + np.concatenate([[0.0], np.cumsum(gaps)])
)
SPEEDS = st.floats(playback.MIN_SPEED, playback.MAX_SPEED)
WAITS = st.floats(0.0, 1000.0)
ACTIONS = st.sampled_from(["play", "pause", "seek", "step", "speed", "loop"])


def act(clock: playback.Playback, action: str, number: float, now: float) -> None:
    match action:
        case "play":
            clock.play(now)
        case "pause":
            clock.pause(now)
        case "seek":
            clock.seek(number - 20.0, now)
        case "step":
            clock.step(int(number) - 20, now)
        case "speed":
            clock.set_speed(number, now)
        case _:
            clock.set_loop(number > 20.0, now)


@given(TIMES, st.lists(st.tuples(ACTIONS, st.floats(0.0, 60.0), WAITS), max_size=12))
def test_the_time_never_leaves_the_motion(times, actions):
    clock, now = playback.Playback(times), 100.0
    for action, number, wait in actions:
        act(clock, action, number, now)
        now += wait
        assert times[0] <= clock.time(now) <= times[-1]
        assert 0 <= clock.frame(now) < len(times)
        assert playback.MIN_SPEED <= clock.speed <= playback.MAX_SPEED


@given(TIMES, st.lists(st.tuples(ACTIONS, st.floats(0.0, 60.0), WAITS), max_size=12))
def test_only_seeking_stepping_and_starting_again_jump(times, actions):
    clock, now = playback.Playback(times), 0.0
    for action, number, wait in actions:
        before = clock.time(now)
        act(clock, action, number, now)
        starts_again = action == "play" and before >= times[-1]
        if action not in ("seek", "step") and not starts_again:
            assert clock.time(now) == pytest.approx(before, abs=1e-9) or (
                clock.loops and before == times[-1]
            )
        now += wait


@given(TIMES, SPEEDS, WAITS)
def test_the_time_passes_with_the_speed_up_to_the_end(times, speed, wait):
    clock = playback.Playback(times)
    clock.set_speed(speed, 0.0)
    clock.play(7.0)
    expected = min(times[0] + speed * wait, times[-1])
    assert clock.time(7.0 + wait) == pytest.approx(expected, abs=1e-9)
    assert clock.is_playing(7.0 + wait) == (clock.time(7.0 + wait) < times[-1])


@given(TIMES.filter(lambda times: len(times) > 1), SPEEDS, WAITS, st.integers(0, 5))
def test_a_loop_repeats_the_motion(times, speed, wait, rounds):
    clock = playback.Playback(times)
    clock.set_speed(speed, 0.0)
    clock.set_loop(True, 0.0)
    clock.play(0.0)
    duration = (times[-1] - times[0]) / speed
    here, later = clock.time(wait), clock.time(wait + rounds * duration)
    apart = abs(here - later)
    assert min(apart, times[-1] - times[0] - apart) < 1e-6
    assert clock.is_playing(wait)


@given(TIMES, SPEEDS, WAITS, WAITS)
def test_a_pause_keeps_the_time(times, speed, wait, pause):
    clock = playback.Playback(times)
    clock.set_speed(speed, 0.0)
    clock.play(0.0)
    clock.pause(wait)
    here = clock.time(wait)
    assert clock.time(wait + pause) == here
    assert not clock.is_playing(wait + pause)
    clock.play(wait + pause)
    assert clock.time(wait + pause) == (times[0] if here == times[-1] else here)


@given(TIMES, st.integers(0, 30), st.integers(-30, 30))
def test_steps_go_from_frame_to_frame(times, first, steps):
    clock, last = playback.Playback(times), len(times) - 1
    clock.step(first, 0.0)
    clock.step(steps, 0.0)
    expected = min(max(min(first, last) + steps, 0), last)
    assert clock.frame(0.0) == expected
    assert clock.time(0.0) == times[expected]


@given(TIMES, st.floats(-5.0, 250.0))
def test_no_frame_is_nearer_than_the_nearest(times, time):
    assert abs(times[playback.nearest_frame(times, time)] - time) == np.abs(times - time).min()


@given(st.integers(1, 5000), st.integers(2, 400))
def test_sampled_frames_increase_from_the_first_to_the_last(count, max_count):
    frames = playback.sample_frames(count, max_count)
    assert (frames[0], frames[-1]) == (0, count - 1)
    assert np.all(np.diff(frames) > 0)
    assert len(frames) == min(count, max_count)


@pytest.mark.parametrize("is_free", [False, True])
def test_computed_poses_are_those_of_the_motion(is_free):
    count = (playback.MAX_BATCHES + 2) * playback.FRAMES_PER_BATCH + 3
    motion = any_motion(shipped("prototype"), np.arange(count) * 0.01, is_free=is_free)
    frames = playback.MotionFrames(motion)
    for frame in (0, count - 1, *range(5, count, 50), 0, playback.FRAMES_PER_BATCH):
        for segment, pose in frames.poses(frame).items():
            assert np.abs(pose - motion.poses[segment][frame]).max() < 1e-12


@pytest.mark.parametrize("name", ["prototype", "flying", "fourbar"])
def test_recorded_poses_are_those_of_the_run(name):
    motion = clip(name)
    frames = playback.MotionFrames(motion)
    last = frames.count - 1
    assert frames.poses(last).keys() == motion.poses.keys()
    for segment, pose in frames.poses(last).items():
        assert np.array_equal(pose, motion.poses[segment][last])
    for joint, row in frames.displacements(last).items():
        assert np.array_equal(row, motion.displacements[joint][last])


def test_the_path_of_a_site_is_the_same_with_and_without_a_run():
    motion = clip("prototype")
    segment = next(one for one in motion.figure.bodies.values() if one.sites)
    name = next(iter(segment.sites))
    places = np.array([0, 3, len(motion.times) - 1])
    expected = site(motion, segment.name, name)[places]
    for each in (motion, replace(motion, recording=None)):
        assert (
            np.abs(
                playback.MotionFrames(each).site_path(segment.name, name, places) - expected
            ).max()
            < 1e-6
        )


def test_a_motion_of_another_figure_is_refused():
    with pytest.raises(ModelError, match="shoulder"):
        playback.MotionFrames(replace(any_motion(shipped("pendulum")), figure=shipped("prototype")))


def test_curves_are_the_recorded_values():
    motion = clip("prototype")
    (angles,) = playback.displacement_charts(motion, "left_knee")
    assert angles.title == "Left knee angle [deg]"
    ((_, values),) = angles.curves
    assert np.allclose(np.radians(values), motion.displacements["left_knee"][angles.frames, 0])
    (moments,) = playback.moment_chart(motion, "left_hip_joint")
    torques = np.array([row for _, row in moments.curves])
    assert np.array_equal(torques.T, motion.recording.passive_torques["left_hip_joint"])
    (energies,) = playback.energy_chart(motion)
    assert {name for name, _ in energies.curves} <= set(ENERGY_KINDS)
    assert not playback.ground_reaction_chart(motion)
    for chart in (angles, moments, energies):
        low, high = chart.limits
        assert all(low < row.min() <= row.max() < high for _, row in chart.curves)


@pytest.fixture(scope="module")
def undamped() -> FigureMotion:
    figure = shipped("prototype")
    springs = read_springs(None, figure).scaled(1.0, 0.0)
    recording = simulate(figure, Plan(stop=0.3, tolerance=1e-4, springs=springs))
    return motion_from_recording(recording)


@pytest.mark.parametrize("joint", ["left_knee", "left_hip_joint", "waist"])
def test_elastic_moments_are_those_of_a_run_without_damping(undamped, joint):
    (elastic,) = playback.elastic_moment_chart(undamped, joint, undamped.springs)
    (recorded,) = playback.moment_chart(undamped, joint)
    assert np.array_equal(elastic.frames, recorded.frames)
    for (_, one), (_, other) in zip(elastic.curves, recorded.curves, strict=True):
        assert one == pytest.approx(other, rel=1e-6, abs=1e-6)


def test_a_free_segment_has_angles_translations_and_no_moment():
    motion = clip("flying")
    free = next(name for name in motion.chains if name not in motion.figure.joints)
    titles = [chart.title for chart in playback.displacement_charts(motion, free)]
    assert [title.rpartition(" ")[2] for title in titles] == ["[deg]", "[cm]"]
    assert not playback.moment_chart(motion, free)
    assert not playback.elastic_moment_chart(motion, free, read_springs(None, motion.figure))


def test_limits_of_a_constant_have_a_width():
    chart = playback.Chart("Zero", np.arange(2), np.arange(2.0), (("zero", np.zeros(2)),))
    assert chart.limits[0] < 0.0 < chart.limits[1]


def test_the_summary_says_how_the_run_ended():
    motion = clip("prototype")
    lines = playback.summary_lines(motion)
    assert lines[0] == f"{len(motion.times)} frames of prototype.fig"
    assert motion.header.message in lines
    assert any("steps" in line for line in lines)
    assert not any(
        "steps" in line for line in playback.summary_lines(replace(motion, recording=None))
    )
