"""Measured displacements as smooth functions of time: a low-pass filter, then quintic splines."""

from collections.abc import Mapping

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

from generator.diagnostics import InputError, error
from generator.figure import JointAxis
from generator.inverse.dynamics import Motion
from generator.kinematics.tree import Tree
from generator.motion_files import FigureMotion
from generator.rotations import Array

FILTER_ORDER = 3
"""Order of the Butterworth filter, which runs forwards and backwards, as OpenSim's does."""

MIN_FRAMES = 12
"""Least number of frames of a motion that has accelerations."""

MAX_GAP = 3.0
"""Largest interval between frames, relative to the median one."""

MAX_JITTER = 0.02
"""Deviation of times from uniform ones that a filter does not mind, relative to the interval."""

UNSURE_TIME = 0.5
"""Time after the first and before the last frame in which accelerations are unsure [s]."""


def input_error(message: str, hint: str = "") -> InputError:
    """Return the error that a motion or its forces cannot be used."""
    return InputError([error(message, hint=hint)])


def low_pass(samples: Array, interval: float, cutoff: float) -> Array:
    """Filter uniform samples without delay: a Butterworth filter, forwards and backwards.

    The record is continued at both ends by its half, turned about the end point.

    Args:
        samples: Samples, shape (n, m).
        interval: Time between two of them [s].
        cutoff: Frequency whose amplitude is halved by both passes [Hz].

    Raises:
        InputError: The frequency is above half the rate of the samples, or its period longer
            than the record.
    """
    rate = 1.0 / interval
    least = rate / len(samples)
    if not least < cutoff < 0.5 * rate:
        raise input_error(
            f"a cutoff of {cutoff:g} Hz is not between {least:.3g} Hz, a period over the whole "
            f"motion, and {0.5 * rate:g} Hz, half the {rate:.4g} frames a second"
        )
    sections = butter(FILTER_ORDER, cutoff, fs=rate, output="sos")
    return sosfiltfilt(sections, samples, axis=0, padtype="odd", padlen=len(samples) // 2)


def check_frames(motion: FigureMotion) -> None:
    """Raise InputError for a motion with a gap, or too short for accelerations."""
    times = motion.times
    if len(times) < MIN_FRAMES:
        raise input_error(
            f"the motion has {len(times)} frames; accelerations need at least {MIN_FRAMES}"
        )
    steps = np.diff(times)
    median = float(np.median(steps))
    k = int(np.argmax(steps))
    if steps[k] > MAX_GAP * median:
        raise input_error(
            f"the motion has no frame between {times[k]:g} and {times[k + 1]:g} s, "
            f"where others are {median:.4g} s apart: fill the gap, or cut the motion there"
        )


def displacement_matrix(tree: Tree, motion: FigureMotion) -> Array:
    """Return the displacements of a tree's joints, shape (n, m), without jumps of whole turns."""
    kinematics = tree.kinematics
    values = kinematics.displacement_vector(motion.displacements).copy()
    chains: Mapping[str, tuple[JointAxis, ...]] = motion.chains
    for joint, columns in kinematics.columns.items():
        for k, factor in enumerate(chains[joint], columns.start):
            if factor.units.is_angle:
                values[:, k] = np.unwrap(values[:, k])
    return values


def smooth_motion(
    tree: Tree, motion: FigureMotion, cutoff: float | None, times: Array | None = None
) -> Motion:
    """Return displacements, rates and accelerations of a motion.

    Displacements pass the filter, and are interpolated by splines of degree 5.

    Args:
        tree: Tree that moves.
        motion: Motion with at least `MIN_FRAMES` frames.
        cutoff: Frequency of `low_pass` [Hz]; None for none.
        times: Times within those of the motion; None for its frames [s].

    Raises:
        InputError: The motion has a gap or too few frames, or the frequency is too high for it.
    """
    check_frames(motion)
    values, at = displacement_matrix(tree, motion), motion.times
    if cutoff is not None:
        interval = float(np.median(np.diff(at)))
        count = round(float(at[-1] - at[0]) / interval) + 1
        uniform: Array = np.linspace(float(at[0]), float(at[-1]), count)
        if count != len(at) or np.abs(uniform - at).max() > MAX_JITTER * interval:
            values, at = make_interp_spline(at, values, k=5)(uniform), uniform
        values = low_pass(values, interval, cutoff)
    spline = make_interp_spline(at, values, k=5)
    chosen = motion.times if times is None else times
    return Motion(chosen, spline(chosen), spline(chosen, 1), spline(chosen, 2))
