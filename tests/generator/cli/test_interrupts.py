"""Signals that call an action; `test_outputs.py` has those that are held."""

import signal
import threading

import pytest

from generator.cli.interrupts import call_on_signals


@pytest.fixture(autouse=True)
def _default_handler():
    """Ctrl-C raises KeyboardInterrupt, also where the tests run in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_the_first_signal_calls_the_action_and_the_second_acts():
    calls: list[str] = []
    with call_on_signals(lambda: calls.append("called")):
        signal.raise_signal(signal.SIGINT)
        assert calls == ["called"]
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert calls == ["called"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_handlers_are_back_after_the_block():
    numbers = [signal.SIGINT, signal.SIGTERM]
    before = list(map(signal.getsignal, numbers))
    with call_on_signals(lambda: None):
        assert list(map(signal.getsignal, numbers)) != before
    assert list(map(signal.getsignal, numbers)) == before


def test_other_threads_change_no_handler():
    seen: list[object] = []

    def read() -> None:
        with call_on_signals(lambda: None):
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=read)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]
