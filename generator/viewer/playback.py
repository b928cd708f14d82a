"""Playback of a motion: the clock that says which frame is shown, the frames, and their curves.

The nearest recorded frame is shown, without interpolation, so that every picture on the page is a
state that the motion has. The clock reads no time itself: `now` is passed to it.
"""

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import format_count
from generator.figure import JointAxis
from generator.joint_chain import build_chain
from generator.kinematics.placement import forward_kinematics
from generator.motion_files.motion import NONE, FigureMotion
from generator.passive_curve import (
    initial_angles,
    joint_label,
    passive_torque,
    rotation_vector,
)
from generator.recording import energy_kinds
from generator.rotations import Array, matrix_from_rotation_vector
from generator.springs_file.axes import axis_label
from generator.units import ROTATION_UNITS, TRANSLATION_UNITS
from springs import SpringSet

Frames = NDArray[np.int_]
"""Indices of frames."""

MIN_SPEED, MAX_SPEED = 0.05, 4.0
"""Speeds of playback as multiples of real time."""

FRAMES_PER_BATCH = 64
"""Frames whose poses are computed at once."""

MAX_BATCHES = 16
"""Batches of poses that are kept."""


class Playback:
    """Clock of a motion whose frames are at increasing times [s], shape (n,)."""

    def __init__(self, times: Array) -> None:
        """Begin at the first frame, paused, at real time, without a loop."""
        self.times = times
        self._speed, self._loops, self._plays = 1.0, False, False
        self._time, self._since = float(times[0]), 0.0

    @property
    def start(self) -> float:
        """Time of the first frame [s]."""
        return float(self.times[0])

    @property
    def stop(self) -> float:
        """Time of the last frame [s]."""
        return float(self.times[-1])

    @property
    def speed(self) -> float:
        """Speed as a multiple of real time."""
        return self._speed

    @property
    def loops(self) -> bool:
        """Return whether the motion starts again at its end."""
        return self._loops

    def time(self, now: float) -> float:
        """Return the time in the motion [s] at a time of the clock on the wall [s]."""
        if not self._plays:
            return self._time
        elapsed = self._speed * max(now - self._since, 0.0)
        ahead = self._time + elapsed - self.start
        duration = self.stop - self.start
        if self._loops and duration > 0.0:
            ahead %= duration
        return self._clip(self.start + ahead)

    def frame(self, now: float) -> int:
        """Return the index of the frame nearest to the time in the motion."""
        return nearest_frame(self.times, self.time(now))

    def is_playing(self, now: float) -> bool:
        """Return whether the time in the motion passes; not at the end without a loop."""
        if not self._plays or self.start == self.stop:
            return False
        return self._loops or self.time(now) < self.stop

    def play(self, now: float) -> None:
        """Play, from the start if the end was reached."""
        time = self.time(now)
        self._set(self.start if time >= self.stop else time, now)
        self._plays = True

    def pause(self, now: float) -> None:
        """Keep the present time."""
        self._set(self.time(now), now)
        self._plays = False

    def seek(self, time: float, now: float) -> None:
        """Go to a time in the motion [s]; outside it to its nearest end."""
        self._set(self._clip(time), now)

    def step(self, frames: int, now: float) -> None:
        """Pause at a frame that many frames after the present one."""
        frame = min(max(self.frame(now) + frames, 0), len(self.times) - 1)
        self._plays = False
        self._set(float(self.times[frame]), now)

    def set_speed(self, speed: float, now: float) -> None:
        """Play at another multiple of real time, at most `MAX_SPEED`."""
        self._set(self.time(now), now)
        self._speed = min(max(speed, MIN_SPEED), MAX_SPEED)

    def set_loop(self, loops: bool, now: float) -> None:
        """Start again at the end, or stop there."""
        self._set(self.time(now), now)
        self._loops = loops

    def _set(self, time: float, now: float) -> None:
        self._time, self._since = time, now

    def _clip(self, time: float) -> float:
        return min(max(time, self.start), self.stop)


def nearest_frame(times: Array, time: float) -> int:
    """Return the index of the nearest of times that increase; of two the earlier one."""
    after = int(np.searchsorted(times, time))
    if after == 0:
        return 0
    if after == len(times):
        return after - 1
    return after if times[after] - time < time - times[after - 1] else after - 1


def sample_frames(count: int, max_count: int) -> Frames:
    """Return the indices of at most `max_count` frames of `count`, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, max_count)).round().astype(int))


class MotionFrames:
    """Frames of a motion; poses that are not recorded are computed when they are needed."""

    def __init__(self, motion: FigureMotion) -> None:
        """Raise ModelError when the motion is of another figure."""
        self.motion = motion
        self._tree = motion.tree
        self._batches: OrderedDict[int, Mapping[str, Array]] = OrderedDict()

    @property
    def count(self) -> int:
        """Number of frames."""
        return len(self.motion.times)

    def displacements(self, frame: int) -> Mapping[str, Array]:
        """Displacements of the joints of the motion, shape (degrees of freedom,) [rad or m]."""
        return {name: rows[frame] for name, rows in self.motion.displacements.items()}

    def poses(self, frame: int) -> Mapping[str, Array]:
        """Poses of the segments in the world, shape (4, 4)."""
        if self.motion.recording is not None:
            return {name: poses[frame] for name, poses in self.motion.recording.poses.items()}
        number, place = divmod(frame, FRAMES_PER_BATCH)
        batch = self._batches.get(number)
        if batch is None:
            first = number * FRAMES_PER_BATCH
            batch = self._compute_poses(np.arange(first, min(first + FRAMES_PER_BATCH, self.count)))
            self._batches[number] = batch
            if len(self._batches) > MAX_BATCHES:
                self._batches.popitem(last=False)
        self._batches.move_to_end(number)
        return {name: poses[place] for name, poses in batch.items()}

    def site_path(self, segment: str, site: str, frames: Frames) -> Array:
        """Positions of a site in the world at some frames, shape (n, 3) [m]."""
        local = self.motion.figure.segments[segment].sites[site].pose_in_segment[:3, 3]
        if self.motion.recording is not None:
            poses = self.motion.recording.poses[segment][frames]
        else:
            poses = self._compute_poses(frames)[segment]
        return poses[:, :3, :3] @ local + poses[:, :3, 3]

    def _compute_poses(self, frames: Frames) -> Mapping[str, Array]:
        """Poses of the segments at some frames, shape (n, 4, 4)."""
        rows = {name: rows[frames] for name, rows in self.motion.displacements.items()}
        return forward_kinematics(self._tree, rows).poses


@dataclass(frozen=True, eq=False)
class Chart:
    """Curves over the time of a motion.

    Attributes:
        title: quantity and unit.
        frames: their indices in the motion, shape (n,).
        times: [s], shape (n,).
        curves: label and values, shape (n,).
    """

    title: str
    frames: Frames
    times: Array
    curves: tuple[tuple[str, Array], ...]

    @property
    def limits(self) -> tuple[float, float]:
        """Lower and upper limit of the values, with a margin."""
        values = np.array([row for _, row in self.curves])
        finite = values[np.isfinite(values)]
        low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
        margin = 0.08 * (high - low) or max(0.1 * abs(high), MIN_MARGIN)
        return low - margin, high + margin


MIN_MARGIN = 1e-3
"""Margin of a curve that is zero everywhere."""

CHART_POINTS = 300
"""Largest number of points of a curve: a panel has about as many pixels."""


def liveliest_joint(motion: FigureMotion) -> str | None:
    """Return the joint between segments that turns the farthest in a motion; None without any."""
    turns: dict[str, float] = {}
    for name, joint in motion.figure.joints.items():
        if name in motion.chains and joint.parent.segment not in motion.figure.ground:
            columns = list(build_chain(motion.chains[name]).rotations)
            ranges = np.ptp(motion.displacements[name][:, columns], axis=0)
            turns[name] = float(ranges.max(initial=0.0))
    return max(turns, key=turns.__getitem__, default=None)


def displacement_charts(motion: FigureMotion, joint: str) -> list[Chart]:
    """Return the angles and the translations of a joint of a motion, without empty charts."""
    charts: list[Chart] = []
    frames = sample_frames(len(motion.times), CHART_POINTS)
    for units, quantity in ((ROTATION_UNITS, "angle"), (TRANSLATION_UNITS, "translation")):
        curves = [
            (_axis_label(axis, k), units.scale * motion.displacements[joint][frames, k])
            for k, axis in enumerate(motion.chains[joint])
            if axis.units is units
        ]
        title = f"{joint_label(joint)} {quantity} [{units.displacement}]"
        charts += _chart(motion, title, frames, curves)
    return charts


def moment_chart(motion: FigureMotion, joint: str) -> list[Chart]:
    """Return the passive moment of a joint on its child as the run recorded it; or nothing."""
    run = motion.recording
    if run is None or joint not in motion.figure.joints:
        return []
    frames = sample_frames(len(motion.times), CHART_POINTS)
    title = f"{joint_label(joint)} passive moment [N m]"
    return _moments(motion, joint, title, frames, run.passive_torques[joint][frames])


def elastic_moment_chart(motion: FigureMotion, joint: str, springs: SpringSet) -> list[Chart]:
    """Return the elastic moment of a joint on its child with some springs; or nothing.

    It takes some 0.1 s: the laws are evaluated at each frame of the chart.
    """
    if joint not in motion.figure.joints:
        return []
    frames = sample_frames(len(motion.times), ELASTIC_CHART_POINTS)
    chain = build_chain(motion.chains[joint])
    is_hinge = len(chain.rotations) == 1
    torques = np.zeros((len(frames), 3))
    start = initial_angles(motion.figure)
    for row, frame in zip(torques, frames, strict=True):
        pose = start | {name: rows[frame] for name, rows in motion.displacements.items()}
        half = 0.5 * rotation_vector(chain, pose[joint])
        torque = passive_torque(motion.figure, springs, joint, pose)
        row[:] = torque if is_hinge else matrix_from_rotation_vector(half) @ torque
    title = f"{joint_label(joint)} elastic moment [N m]"
    return _moments(motion, joint, title, frames, torques)


ELASTIC_CHART_POINTS = 100
"""Largest number of points of a curve whose values are computed."""


def _moments(
    motion: FigureMotion, joint: str, title: str, frames: Frames, torques: Array
) -> list[Chart]:
    """Return the chart of torques in the parent's site axes, shape (n, 3) [N m]."""
    chain = build_chain(motion.chains[joint])
    rotations = [chain.joint_axes[k] for k in chain.rotations]
    if len(rotations) == 1:
        curves = [(_axis_label(rotations[0], 0), torques @ rotations[0].twist.angular)]
    else:
        curves = [(f"about {name}", torques[:, k]) for k, name in enumerate("xyz")]
    return _chart(motion, title, frames, curves if rotations else [])


def energy_chart(motion: FigureMotion) -> list[Chart]:
    """Return the energies of a run; or nothing for a motion without one."""
    if motion.recording is None:
        return []
    frames = sample_frames(len(motion.times), CHART_POINTS)
    energy = motion.recording.energy
    curves = [(kind, energy[kind][frames]) for kind in energy_kinds(energy)]
    return _chart(motion, "Energy [J]", frames, [one for one in curves if np.any(one[1])])


def contact_forces(motion: FigureMotion, frame: int) -> tuple[Array, Array] | None:
    """Return the contact forces [N] and their points [m] in a frame, both of shape (k, 3).

    None for a motion without them.
    """
    contact = None if motion.recording is None else motion.recording.contact
    if contact is None or not contact.part_forces:
        return None
    forces = [each[frame] for each in contact.part_forces.values()]
    return np.array(forces), np.array([each[frame] for each in contact.force_points.values()])


def ground_reaction_chart(motion: FigureMotion) -> list[Chart]:
    """Return the force of all props on the figure; or nothing for a run without contact."""
    run = motion.recording
    if run is None or run.contact is None:
        return []
    frames = sample_frames(len(motion.times), CHART_POINTS)
    force = run.contact.ground_reaction[frames]
    curves = [("x", force[:, 0]), ("y (up)", force[:, 1]), ("z", force[:, 2])]
    return _chart(motion, "Ground reaction [N]", frames, curves)


def _chart(
    motion: FigureMotion, title: str, frames: Frames, curves: Sequence[tuple[str, Array]]
) -> list[Chart]:
    return [Chart(title, frames, motion.times[frames], tuple(curves))] if curves else []


def _axis_label(axis: JointAxis, k: int) -> str:
    """Return a factor of a chain in words: `1: about z`, `4: along x`."""
    return f"{k + 1}: {axis.units.preposition} {axis_label(axis.axis)}"


def summary_lines(motion: FigureMotion) -> list[str]:
    """Return the origin, the outcome and the accuracy of a motion as sentences."""
    header = motion.header
    lines = [f"{format_count(len(motion.times), 'frame')} of {header.figure}", header.message]
    if header.springs != NONE:
        lines.append(f"Springs: {header.springs}")
    run = motion.recording
    if run is not None:
        text, steps = run.accuracy_text, f"{format_count(run.accuracy.steps, 'step')} in all passes"
        is_said = "Estimated joint-angle error" in header.message
        lines.append(steps if is_said else f"{text[:1].upper()}{text[1:]}; {steps}")
    return [line for line in lines if line and line != NONE]
