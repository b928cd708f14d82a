"""When springs pass corners of their laws, and how one pass guides the next there.

A step across the edge of a dead zone would spoil the order that the extrapolation of passes lives
on. So a pass ends steps where the pass before it met corners, moved by how far the two have drifted
apart at the frame before.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from generator.frames import Array


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
