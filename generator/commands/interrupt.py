"""Ctrl-C as a wish that a run fulfils at its next frame, so that what was simulated is kept."""

import signal
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def interrupted_at_a_frame() -> Generator[Callable[[], None]]:
    """Hold Ctrl-C back; a second one acts at once.

    Yields what raises KeyboardInterrupt if there was a first: a run calls it where it can stop.
    """
    asked = False
    before = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        del number, frame
        asked = True
        signal.signal(signal.SIGINT, before)

    def check() -> None:
        if asked:
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
