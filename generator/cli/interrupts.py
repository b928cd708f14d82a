"""Ctrl-C and other signals to end: deferred during a run, held while files are put in place."""

import signal
import threading
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from types import FrameType

INTERRUPTED = "interrupted before anything was written"
INTERRUPTED_AFTER_WRITING = "interrupted; the files were written"

_HELD_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Signals that end a program and can be held."""

_has_written: ContextVar[bool] = ContextVar("_has_written", default=False)


def forget_written_files() -> None:
    """Begin a command: it has written no files."""
    _has_written.set(False)


def note_written_files() -> None:
    """Record that files of the command are in place."""
    _has_written.set(True)


def interruption_message() -> str:
    """Return the sentence for a command that is interrupted now."""
    return INTERRUPTED_AFTER_WRITING if _has_written.get() else INTERRUPTED


@contextmanager
def hold_interrupts() -> Generator[None]:
    """Hold Ctrl-C and signals to end until the end of the block, where the last of them acts.

    In other threads than the main one nothing is held: Python handles signals in the main thread.
    """
    arrived: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        del frame
        arrived.append(number)

    try:
        with ExitStack() as handlers:
            for number in _HELD_SIGNALS:
                _set_handler(handlers, number, note)
            yield
    finally:
        if arrived:
            signal.raise_signal(arrived[-1])


@contextmanager
def defer_interrupt() -> Generator[Callable[[], None]]:
    """Hold Ctrl-C back; a second one acts at once.

    Yields what raises KeyboardInterrupt if there was a first: a run calls it where it can stop. One
    that comes after the last call is raised at the end of the block. In other threads than the main
    one nothing is held.
    """
    requested = raised = False
    before = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal requested
        del frame
        requested = True
        signal.signal(number, before)

    def check() -> None:
        nonlocal raised
        if requested:
            raised = True
            raise KeyboardInterrupt

    with ExitStack() as handlers:
        _set_handler(handlers, signal.SIGINT, note)
        yield check
    if requested and not raised:
        raise KeyboardInterrupt


@contextmanager
def call_on_signals(action: Callable[[], None]) -> Generator[None]:
    """Call an action at Ctrl-C or another signal to end; a second one acts as before.

    In other threads than the main one nothing changes.
    """
    before = {number: signal.getsignal(number) for number in _HELD_SIGNALS}

    def act(number: int, frame: FrameType | None) -> None:
        del frame
        signal.signal(number, before[number])
        action()

    with ExitStack() as handlers:
        for number in _HELD_SIGNALS:
            _set_handler(handlers, number, act)
        yield


def _set_handler(
    stack: ExitStack, number: int, handler: Callable[[int, FrameType | None], None]
) -> None:
    """Set the handler of a signal until a stack is closed.

    A signal that is ignored, or handled by compiled code, is left alone.
    """
    before = signal.getsignal(number)
    if threading.current_thread() is not threading.main_thread():
        return
    if before not in (None, signal.SIG_IGN):
        stack.callback(signal.signal, number, before)
        signal.signal(number, handler)
