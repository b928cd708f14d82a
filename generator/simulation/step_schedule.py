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
from generator.simulation.model import Assembly


@dataclass(frozen=True)
class Passage:
    """A spring's displacement passes a corner of its law.

    Attributes:
        track: which spring, as `Guide.tracks` names it.
        time: when [s].
        speed: rate of the displacement there [rad/s or m/s].
    """

    track: str
    time: float
    speed: float


@dataclass(frozen=True)
class Guide:
    """What a pass tells the next one.

    Attributes:
        passages: in the order of time.
        tracks: displacement of each spring at the frames [rad or m], shape (n,).
    """

    passages: Sequence[Passage] = ()
    tracks: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])

    @cached_property
    def _times(self) -> Array:
        return np.array([passage.time for passage in self.passages])

    def passes(self, here: float, there: float) -> bool:
        """Whether a corner is passed between two times [s]."""
        first, last = np.searchsorted(self._times, [here, there])
        return bool(first < last)

    def cuts(self, frame: int, here: float, there: float, now: Callable[[str], float]) -> Array:
        """Times between two frames at which steps should end [s], sorted.

        Args:
            frame: number of the frame at `here`.
            here: its time [s].
            there: time of the next frame [s].
            now: the displacement of a spring at `here` in the pass that is guided.
        """
        times: list[float] = []
        first, last = np.searchsorted(self._times, [here, there])
        for passage in self.passages[int(first) : int(last)]:
            drift = now(passage.track) - self.tracks[passage.track][frame]
            times.append(passage.time - drift / passage.speed)
        return np.array(sorted(time for time in times if here < time < there))


_SHORTEST = 0.05
"""Cuts nearer to each other than this part of a step are not worth a step of their own."""

_JUMP = 1e-9
"""Half the length of the step that takes in the jump of a load [s]."""

STEPS_A_BITE = 500
"""Largest number of steps that Exudyn takes before it is asked again."""


def count_steps(length: float, step: float) -> int:
    """Number of equal steps, none longer than `step`, in a stretch of time [s]."""
    return max(1, ceil(length / step - 1e-9))


def jumps_of(assembly: Assembly) -> Array:
    """Times just before and just after the jumps of loads [s].

    A load that jumps within a step, or at its very end, would make the step one of first order.
    """
    times = {time for load, *_ in assembly.loads for time in load.jumps}
    return np.array(sorted(time + side for time in times for side in (-_JUMP, _JUMP)))


def end_of_leg(times: Array, first: int, most: int, jumps: Array, guide: Guide) -> int:
    """The frame at which the leg from a frame ends.

    Args:
        times: of the frames [s].
        first: number of the frame at its start.
        most: largest number of frames that it goes over.
        jumps: of loads [s], sorted.
        guide: an earlier pass, which met corners of spring laws.
    """
    last = first + 1
    if _is_plain(times, first, jumps, guide):
        while (
            last - first < most and last + 1 < times.size and _is_plain(times, last, jumps, guide)
        ):
            last += 1
    return last


def _is_plain(times: Array, frame: int, jumps: Array, guide: Guide) -> bool:
    """Whether nothing cuts the interval after a frame, and it is as long as the first one."""
    here, there = float(times[frame]), float(times[frame + 1])
    if abs((there - here) - float(times[1] - times[0])) > 1e-9 * (there - here):
        return False
    return not _within(jumps, here, there) and not guide.passes(here, there)


def stretches(
    here: float, there: float, jumps: Array, corners: Array, step: float
) -> list[tuple[float, float]]:
    """A frame interval cut at jumps, and at the corners that are not too near to another cut."""
    ends = [here, *_within(jumps, here, there), there]
    cuts = [here]
    for end in ends[1:]:
        for corner in _within(corners, cuts[-1], end):
            if corner - cuts[-1] > _SHORTEST * step and end - corner > _SHORTEST * step:
                cuts.append(corner)
        cuts.append(end)
    return list(pairwise(cuts))


def bites(interval: tuple[float, float], count: int) -> Iterator[tuple[tuple[float, float], int]]:
    """An interval of equal steps in parts of so few that the clock and Ctrl-C are heard."""
    start, stop = interval
    here = start
    for place in range(0, count, STEPS_A_BITE):
        some = min(STEPS_A_BITE, count - place)
        there = stop if place + some == count else start + (stop - start) * (place + some) / count
        yield (here, there), some
        here = there


def _within(times: Array, here: float, there: float) -> list[float]:
    """The sorted times that are between two others."""
    return [float(t) for t in times[np.searchsorted(times, here) : np.searchsorted(times, there)]]
