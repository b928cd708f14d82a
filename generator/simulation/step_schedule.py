"""Division of a pass into batches of frames, subintervals and chunks of equal steps.

Each start of Exudyn's integrator costs as much as several steps, so a batch extends over as many
frames as possible with steps of one length. A frame interval with a load discontinuity or a
breakpoint crossing is a batch of its own, divided there into subintervals.

A step across a breakpoint of a spring law, such as the edge of a dead zone, would reduce the order
on which the extrapolation of passes relies. So a pass ends steps at the crossings of the previous
pass, shifted by the difference of the two passes at the frame before.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import ceil

import numpy as np

from generator.rotations import Array
from generator.simulation.model import ExudynModel


@dataclass(frozen=True)
class BreakpointCrossing:
    """Crossing of a breakpoint of its law by a spring.

    Attributes:
        spring_label: label of the spring in `StepHints.tracked_displacements`.
        time: time of the crossing [s].
        speed: rate of the displacement [rad/s or m/s].
    """

    spring_label: str
    time: float
    speed: float


@dataclass(frozen=True)
class StepHints:
    """Breakpoint crossings of a pass, as hints for the next one.

    Attributes:
        crossings: crossings sorted by time.
        tracked_displacements: displacement of each spring at the frames [rad or m], shape (n,).
    """

    crossings: Sequence[BreakpointCrossing] = ()
    tracked_displacements: Mapping[str, Sequence[float]] = field(
        default_factory=dict[str, Sequence[float]]
    )

    @cached_property
    def _times(self) -> Array:
        return np.array([crossing.time for crossing in self.crossings])

    def has_crossing(self, start: float, stop: float) -> bool:
        """Return whether a breakpoint is crossed between two times [s]."""
        first, last = np.searchsorted(self._times, [start, stop])
        return bool(first < last)

    def crossing_times(
        self, frame: int, start: float, stop: float, current_displacement: Callable[[str], float]
    ) -> Array:
        """Times between two frames at which steps should end [s], sorted.

        Args:
            frame: index of the frame at `start`.
            start: time of the frame [s].
            stop: time of the next frame [s].
            current_displacement: displacement of a spring at `start` in the current pass.
        """
        times: list[float] = []
        first, last = np.searchsorted(self._times, [start, stop])
        for crossing in self.crossings[int(first) : int(last)]:
            drift = (
                current_displacement(crossing.spring_label)
                - self.tracked_displacements[crossing.spring_label][frame]
            )
            times.append(crossing.time - drift / crossing.speed)
        return np.array(sorted(time for time in times if start < time < stop))


_MIN_STEP_FRACTION = 0.05
"""Smallest subinterval, as a fraction of the step."""

_DISCONTINUITY_HALF_WIDTH = 1e-9
"""Half the length of the step across a load discontinuity [s]."""

MAX_STEPS_PER_CHUNK = 500
"""Largest number of steps between checks of the clock and of Ctrl-C."""


def count_steps(length: float, step: float) -> int:
    """Number of equal steps, not longer than `step`, in an interval [s]."""
    return max(1, ceil(length / step - 1e-9))


def load_discontinuities(model: ExudynModel) -> Array:
    """Times just before and just after load discontinuities [s].

    A step with a discontinuity inside it or at its end would be of first order.
    """
    times = {time for load, *_ in model.loads for time in load.discontinuities}
    return np.array(
        sorted(
            time + side
            for time in times
            for side in (-_DISCONTINUITY_HALF_WIDTH, _DISCONTINUITY_HALF_WIDTH)
        )
    )


def last_frame_of_batch(
    times: Array, first: int, max_frames: int, discontinuities: Array, hints: StepHints
) -> int:
    """Index of the frame at which a batch ends.

    Args:
        times: times of the frames [s].
        first: index of the frame at the start of the batch.
        max_frames: largest number of frame intervals in the batch.
        discontinuities: times of load discontinuities [s], sorted.
        hints: breakpoint crossings of an earlier pass.
    """
    last = first + 1
    if _is_regular_interval(times, first, discontinuities, hints):
        while (
            last - first < max_frames
            and last + 1 < times.size
            and _is_regular_interval(times, last, discontinuities, hints)
        ):
            last += 1
    return last


def _is_regular_interval(
    times: Array, frame: int, discontinuities: Array, hints: StepHints
) -> bool:
    """Return whether the interval after a frame is undivided and as long as the first one."""
    start, stop = float(times[frame]), float(times[frame + 1])
    if abs((stop - start) - float(times[1] - times[0])) > 1e-9 * (stop - start):
        return False
    return not _times_between(discontinuities, start, stop) and not hints.has_crossing(start, stop)


def subintervals(
    start: float, stop: float, discontinuities: Array, crossings: Array, step: float
) -> list[tuple[float, float]]:
    """Divide a frame interval at discontinuities, and at crossings not too close to another."""
    ends = [start, *_times_between(discontinuities, start, stop), stop]
    cuts = [start]
    for end in ends[1:]:
        for crossing in _times_between(crossings, cuts[-1], end):
            if (
                crossing - cuts[-1] > _MIN_STEP_FRACTION * step
                and end - crossing > _MIN_STEP_FRACTION * step
            ):
                cuts.append(crossing)
        cuts.append(end)
    return list(pairwise(cuts))


def step_chunks(
    interval: tuple[float, float], count: int
) -> Iterator[tuple[tuple[float, float], int]]:
    """Divide an interval of equal steps into chunks of at most `MAX_STEPS_PER_CHUNK`."""
    start, stop = interval
    chunk_start = start
    for first in range(0, count, MAX_STEPS_PER_CHUNK):
        size = min(MAX_STEPS_PER_CHUNK, count - first)
        chunk_stop = (
            stop if first + size == count else start + (stop - start) * (first + size) / count
        )
        yield (chunk_start, chunk_stop), size
        chunk_start = chunk_stop


def _times_between(times: Array, start: float, stop: float) -> list[float]:
    """Return the sorted times within an interval."""
    return [float(t) for t in times[np.searchsorted(times, start) : np.searchsorted(times, stop)]]
