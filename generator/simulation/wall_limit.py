"""The wall-time limit of a run, in whatever phase the time passes."""

import time
from dataclasses import dataclass
from math import inf

from generator.diagnostics import WallLimitError


@dataclass(frozen=True)
class WallLimit:
    """Wall-time limit of a run that has begun.

    Attributes:
        seconds: the limit [s].
        deadline: `time.monotonic()` at which it is reached.
    """

    seconds: float
    deadline: float

    @classmethod
    def begin(cls, seconds: float) -> "WallLimit":
        """Return the limit of a run that begins now."""
        return cls(seconds, time.monotonic() + seconds)

    @property
    def remaining(self) -> float:
        """Return the time until the limit, negative after it [s]."""
        return self.deadline - time.monotonic()

    @property
    def is_reached(self) -> bool:
        """Return whether the limit is reached."""
        return self.remaining < 0.0

    def require_time(self, phase: str) -> None:
        """Raise WallLimitError if the limit is reached.

        Args:
            phase: Phase of the run, as a clause ("the model was built").
        """
        if self.is_reached:
            raise WallLimitError(f"the wall-time limit of {self.seconds:g} s was reached {phase}")


NO_LIMIT = WallLimit(inf, inf)
"""Limit that is never reached."""
