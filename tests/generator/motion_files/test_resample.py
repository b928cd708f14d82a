"""A motion at another frame rate, against a run recorded at that rate and against formulas."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from generator import Plan, simulate
from generator.diagnostics import UsageError
from generator.joint_chain import build_chain
from generator.motion_files import FigureMotion, motion_from_recording
from generator.motion_files.resample import resample
from generator.rotations import Array
from tests.chains import BALL, body, chain, figure, ground, joint
from tests.motions import any_motion, clip, header_of, shipped, site, slides

FPS = 120.0


@pytest.fixture(scope="module")
def fall() -> tuple[FigureMotion, FigureMotion]:
    """A prototype that falls for a second, in frames of 20 ms and at 120 per second."""
    made = shipped("prototype")
    runs = [simulate(made, Plan(stop=1.0, frame=f, tolerance=1e-6)) for f in (0.02, 1.0 / FPS)]
    coarse, fine = (motion_from_recording(run, made) for run in runs)
    return coarse, fine


def site_errors(found: FigureMotion, expected: FigureMotion) -> Array:
    """Distances of all sites from their places, shape (sites, frames) [m]."""
    errors = [
        np.linalg.norm(site(found, name, each) - site(expected, name, each), axis=1)
        for name, segment in expected.figure.segments.items()
        for each in segment.sites
    ]
    return np.array(errors, dtype=float)


def test_a_run_is_resampled_with_its_velocities(fall: tuple[FigureMotion, FigureMotion]):
    coarse, fine = fall
    found = resample(coarse, FPS)
    assert np.allclose(found.times, fine.times)
    errors = site_errors(found, fine)
    assert np.max(errors) < 1e-4
    assert np.sqrt(np.mean(errors**2)) < 1.2e-5


def test_a_stored_motion_is_resampled_without(fall: tuple[FigureMotion, FigureMotion]):
    """The largest errors are at the stop of a knee, within an interval of frames."""
    coarse, fine = fall
    errors = site_errors(resample(replace(coarse, recording=None), FPS), fine)
    assert 1e-3 < np.max(errors) < 3e-3
    assert np.sqrt(np.mean(errors**2)) < 1.5e-4


def spin(times: Array) -> FigureMotion:
    """A ball that turns about an axis oblique to its chain, through its singular orientations."""
    made = figure([ground(), body("top")], [joint("ball", "ground.base", "top.near", BALL)])
    ball = build_chain(made.joints["ball"].chain)
    matrices = Rotation.from_rotvec(times[:, None] * np.array([2.0, 1.0, -2.0])).as_matrix()
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, :3, :3] = matrices
    values = ball.continuous_displacements(poses)
    chains = {"ball": made.joints["ball"].chain}
    return FigureMotion(made, header_of(times), chains, times, {"ball": values})


def test_a_uniform_rotation_about_one_axis_stays_one():
    motion = spin(np.linspace(0.0, 4.0, 41))
    found = resample(motion, 77.0)
    expected = spin(found.times)
    for name in motion.figure.segments:
        np.testing.assert_allclose(found.poses[name], expected.poses[name], atol=1e-12)


@given(st.floats(1.0, 500.0), st.integers(0, 5))
def test_frames_are_uniform_and_within_the_motion(fps: float, seed: int):
    motion = any_motion(slides(), np.array([0.3, 0.35, 0.41, 0.8]), seed)
    found = resample(motion, fps)
    assert found.times[0] == motion.times[0]
    assert 0.0 <= 0.8 - found.times[-1] < 1.0 / fps
    assert np.allclose(np.diff(found.times), 1.0 / fps, rtol=0.0, atol=1e-6 / fps)
    assert {len(rows) for rows in found.displacements.values()} == {found.times.size}
    assert found.header.stop == found.times[-1]


@pytest.mark.parametrize("name", ["prototype", "fourbar", "slides", "flying"])
def test_the_frames_of_a_motion_are_kept(name: str):
    motion = clip(name)
    found = resample(motion, 100.0)
    assert found.recording is None
    for segment in motion.figure.segments:
        np.testing.assert_allclose(
            found.poses[segment][::2], motion.poses[segment], rtol=0.0, atol=1e-6
        )


def test_slides_follow_a_parabola():
    """Three frames of a fall: the rates of the parabola are those of the fall."""
    times = np.array([0.0, 0.1, 0.3, 0.35])
    made = figure(
        [ground(), body("block")], [joint("rail", "ground.base", "block.near", chain("Ty"))]
    )
    moved = {"rail": -4.905 * times[:, None] ** 2}
    motion = FigureMotion(made, header_of(times), {"rail": made.joints["rail"].chain}, times, moved)
    found = resample(motion, 1000.0)
    np.testing.assert_allclose(
        found.displacements["rail"][:, 0], -4.905 * found.times**2, atol=1e-14
    )


def test_a_single_frame_stays():
    motion = any_motion(slides(), np.array([0.5]))
    assert resample(motion, 25.0) is motion


@pytest.mark.parametrize(
    ("fps", "text"),
    [(0.0, "must be positive"), (-3.0, "positive"), (np.nan, "positive"), (1e12, "1,000,000")],
)
def test_a_wrong_rate_is_refused(fps: float, text: str):
    with pytest.raises(UsageError, match=text):
        resample(any_motion(slides()), fps)
