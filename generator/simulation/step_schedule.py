"""How the time of a pass is cut: into legs over frames, stretches, and bites of equal steps.

Each start of Exudyn's integrator costs as much as several steps, so a leg goes over as many frames
as it can in steps of one length. Where something happens between two frames, these are a leg of
their own, cut there into stretches.

When springs pass corners of their laws, and how one pass guides the next there.

A step across the edge of a dead zone would spoil the order that the extrapolation of passes lives
on. So a pass ends steps where the pass before it met corners, moved by how far the two have drifted
apart at the frame before.
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
    """A spring's displacement passes a corner of its law.

    Attributes:
        spring_label: which spring, as `Guide.tracks` names it.
        time: when [s].
        speed: rate of the displacement there [rad/s or m/s].
    """

    spring_label: str
    time: float
    speed: float


@dataclass(frozen=True)
class StepHints:
    """What a pass tells the next one.

    Attributes:
        crossings: in the order of time.
        tracked_displacements: displacement of each spring at the frames [rad or m], shape (n,).
    """

    crossings: Sequence[BreakpointCrossing] = ()
    tracked_displacements: Mapping[str, Sequence[float]] = field(
        default_factory=dict[str, Sequence[float]]
    )

    @cached_property
    def _times(self) -> Array:
        return np.array([passage.time for passage in self.crossings])

    def has_crossing(self, start: float, stop: float) -> bool:
        """Whether a corner is passed between two times [s]."""
        first, last = np.searchsorted(self._times, [start, stop])
        return bool(first < last)

    def crossing_times(
        self, frame: int, start: float, stop: float, current_displacement: Callable[[str], float]
    ) -> Array:
        """Times between two frames at which steps should end [s], sorted.

        Args:
            frame: number of the frame at `start`.
            start: its time [s].
            stop: time of the next frame [s].
            current_displacement: the displacement of a spring at `start` in the pass that is guided.
        """
        times: list[float] = []
        first, last = np.searchsorted(self._times, [start, stop])
        for passage in self.crossings[int(first) : int(last)]:
            drift = (
                current_displacement(passage.spring_label)
                - self.tracked_displacements[passage.spring_label][frame]
            )
            times.append(passage.time - drift / passage.speed)
        return np.array(sorted(time for time in times if start < time < stop))


_MIN_STEP_FRACTION = 0.05
"""Cuts nearer to each other than this part of a step are not worth a step of their own."""

_DISCONTINUITY_HALF_WIDTH = 1e-9
"""Half the length of the step that takes in the jump of a load [s]."""

MAX_STEPS_PER_CHUNK = 500
"""Largest number of steps that Exudyn takes before it is asked again."""


def count_steps(length: float, step: float) -> int:
    """Number of equal steps, none longer than `step`, in a stretch of time [s]."""
    return max(1, ceil(length / step - 1e-9))


def load_discontinuities(assembly: ExudynModel) -> Array:
    """Times just before and just after the jumps of loads [s].

    A load that jumps within a step, or at its very end, would make the step one of first order.
    """
    times = {time for load, *_ in assembly.loads for time in load.discontinuities}
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
    """The frame at which the leg from a frame ends.

    Args:
        times: of the frames [s].
        first: number of the frame at its start.
        max_frames: largest number of frames that it goes over.
        discontinuities: of loads [s], sorted.
        hints: an earlier pass, which met corners of spring laws.
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
    """Whether nothing cuts the interval after a frame, and it is as long as the first one."""
    here, there = float(times[frame]), float(times[frame + 1])
    if abs((there - here) - float(times[1] - times[0])) > 1e-9 * (there - here):
        return False
    return not _times_between(discontinuities, here, there) and not hints.has_crossing(here, there)


def subintervals(
    start: float, stop: float, discontinuities: Array, crossings: Array, step: float
) -> list[tuple[float, float]]:
    """A frame interval cut at jumps, and at the corners that are not too near to another cut."""
    ends = [start, *_times_between(discontinuities, start, stop), stop]
    cuts = [start]
    for end in ends[1:]:
        for corner in _times_between(crossings, cuts[-1], end):
            if (
                corner - cuts[-1] > _MIN_STEP_FRACTION * step
                and end - corner > _MIN_STEP_FRACTION * step
            ):
                cuts.append(corner)
        cuts.append(end)
    return list(pairwise(cuts))


def step_chunks(
    interval: tuple[float, float], count: int
) -> Iterator[tuple[tuple[float, float], int]]:
    """An interval of equal steps in parts of so few that the clock and Ctrl-C are heard."""
    start, stop = interval
    here = start
    for place in range(0, count, MAX_STEPS_PER_CHUNK):
        some = min(MAX_STEPS_PER_CHUNK, count - place)
        there = stop if place + some == count else start + (stop - start) * (place + some) / count
        yield (here, there), some
        here = there


def _times_between(times: Array, start: float, stop: float) -> list[float]:
    """The sorted times that are between two others."""
    return [float(t) for t in times[np.searchsorted(times, start) : np.searchsorted(times, stop)]]
