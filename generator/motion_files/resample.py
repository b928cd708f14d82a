"""A motion at a uniform frame rate: cubic interpolation between its frames.

Between two frames a displacement is the cubic polynomial with the displacements and the rates of
both (Hermite). The rates are the recorded velocities; a stored motion without them has those of
the parabola through three frames. Three rotations of a joint are interpolated as one: the rotation
vector from the frame before is the cubic polynomial, so that nothing happens where the three angles
are singular.
"""

from dataclasses import replace
from math import floor, isfinite

import numpy as np

from generator.diagnostics import UsageError
from generator.joint_chain import Chain, build_chain
from generator.motion_files.motion import FigureMotion
from generator.rotations import (
    Array,
    matrix_from_chain_angles,
    matrix_from_rotation_vector,
    rotation_vector_from_matrix,
)

MAX_RESAMPLED_FRAMES = 1_000_000
"""Frames of a resampled motion; more is a mistake in the rate."""

_TIME_TOLERANCE = 1e-6
"""A last frame that is later than the last of the motion by this part of an interval is kept."""

_SMALL_ANGLE = 1e-3
"""Rotation below which its series is used [rad]: the next term is below 1e-16."""


def resample(motion: FigureMotion, fps: float) -> FigureMotion:
    """Return a motion at a number of frames per second, from its first frame on.

    The last frame is at the end of the motion, or less than an interval before it. The result has
    no run: its poses are those of its displacements, and results other than the motion are left
    out. A motion of one frame is returned unchanged.

    Args:
        motion: the motion.
        fps: frames per second [1/s].

    Raises:
        UsageError: the rate is not positive, or too high for the length of the motion.
    """
    if not (isfinite(fps) and fps > 0.0):
        raise UsageError(f"a frame rate of {fps:g} per second: it must be positive")
    times = motion.times
    if times.size == 1:
        return motion
    frames = float(times[-1] - times[0]) * fps + _TIME_TOLERANCE
    if frames >= MAX_RESAMPLED_FRAMES:
        raise UsageError(
            f"{fps:g} frames per second over {times[-1] - times[0]:g} s: "
            f"more than {MAX_RESAMPLED_FRAMES:,} frames"
        )
    at = np.minimum(times[0] + np.arange(floor(frames) + 1) / fps, times[-1])
    return resample_at(motion, at, 1.0 / fps if at.size > 1 else None)


def resample_at(motion: FigureMotion, at: Array, interval: float | None = None) -> FigureMotion:
    """Return a motion of several frames at other times within it, as `resample` does.

    Args:
        motion: Motion.
        at: Times, shape (m,) [s].
        interval: Interval of the frames for the header [s]; None where it varies.
    """
    moved = {
        name: _resample_joint(motion, name, build_chain(axes), at)
        for name, axes in motion.chains.items()
    }
    header = replace(motion.header, start=float(at[0]), stop=float(at[-1]), frame_interval=interval)
    return replace(motion, header=header, times=at, displacements=moved, recording=None)


def _resample_joint(motion: FigureMotion, joint: str, chain: Chain, at: Array) -> Array:
    """Return the displacements of a joint at other times (m,), shape (m, n) [rad or m]."""
    times, values = motion.times, motion.displacements[joint]
    recording = motion.recording
    rates = None if recording is None else recording.velocities.get(joint)
    steps = np.diff(values, axis=0)
    ends = _parabola_rates(times, steps) if rates is None else rates
    k, moved = _cubic_step(times, at, steps, ends[:-1], ends[1:])
    result = values[k] + moved
    if chain.sequence is None:
        return result
    turns = list(chain.rotations)
    matrices = matrix_from_chain_angles(chain.rotation_axes, values[:, turns])
    vectors = rotation_vector_from_matrix(matrices[1:] @ np.swapaxes(matrices[:-1], -1, -2))
    if rates is None:
        angular = _parabola_rates(times, vectors)
    else:
        axes = chain.twists(values)[:, turns, :3]
        angular = np.einsum("fki,fk->fi", axes, rates[:, turns])
    vector_rates = _rotation_vector_rates(vectors, angular[1:])
    k, turned = _cubic_step(times, at, vectors, angular[:-1], vector_rates)
    orientations = matrix_from_rotation_vector(turned) @ matrices[k]
    result[:, turns] = chain.sequence.continuous_angles(orientations, values[0, turns])
    return result


def _cubic_step(
    times: Array, at: Array, steps: Array, first_rates: Array, last_rates: Array
) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], Array]:
    """Return the interval of each time (m,), and the values there since its begin, shape (m, k).

    Args:
        times: times of the n frames [s], shape (n,).
        at: times within them [s], shape (m,).
        steps: steps from each frame to the next, shape (n - 1, k).
        first_rates: first rates at the begin of each interval, shape (n - 1, k).
        last_rates: last rates at its end.
    """
    interval = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    length = np.diff(times)[interval][:, None]
    s = (at - times[interval])[:, None] / length
    moved = (
        steps[interval] * (s * s * (3.0 - 2.0 * s))
        + first_rates[interval] * (length * s * (1.0 - s) ** 2)
        + last_rates[interval] * (length * s * s * (s - 1.0))
    )
    return interval, moved


def _parabola_rates(times: Array, steps: Array) -> Array:
    """Rates of the parabola through each frame and its neighbours, (n - 1, k) to (n, k).

    At both ends the parabola is that of the frame beside. Two frames have the rate of a line.
    """
    lengths = np.diff(times)[:, None]
    slopes = steps / lengths
    if len(slopes) == 1:
        return np.concatenate([slopes, slopes])
    before, after = lengths[:-1], lengths[1:]
    inner = (slopes[:-1] * after + slopes[1:] * before) / (before + after)
    return np.concatenate([2.0 * slopes[:1] - inner[:1], inner, 2.0 * slopes[-1:] - inner[-1:]])


def _rotation_vector_rates(vectors: Array, angular: Array) -> Array:
    """Rates of rotation vectors (n, 3) at angular velocities in the axes of the base [rad/s].

    The inverse of the left Jacobian of SO(3) (Bullo and Murray, Proc. European Control Conf. 1995).
    """
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    small = angle < _SMALL_ANGLE
    safe = np.where(small, 1.0, angle)
    factor = np.where(
        small,
        1.0 / 12.0 + angle**2 / 720.0,
        (1.0 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2,
    )
    across = np.cross(vectors, angular)
    return angular - 0.5 * across + factor * np.cross(vectors, across)
