"""Settings of all tests: how hypothesis draws its examples."""

import inspect
import os
import signal
import sys
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from functools import wraps
from itertools import count
from typing import Any

import pytest
from hypothesis import settings

from tests.paths import TESTS

# No deadline: the time of an example tells of the machine, and nothing here measures speed. In CI
# the examples are the same each time, so that a red run is red for everybody, and a quarter of
# them: new ones are drawn where tests are run by hand.
settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True, max_examples=25)
settings.load_profile("ci" if os.environ.get("CI") else "here")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option of `tests/test_faults.py`."""
    parser.addoption(
        "--update-expected",
        action="store_true",
        help="rewrite the expected diagnostics of the files in tests/faults",
    )


UNCOUNTED = tuple(
    TESTS / name
    for name in (
        *("docs", "physics", "properties", "generator/simulation/compiled"),
        *("test_architecture.py", "test_language.py", "test_faults.py"),
        *("generator/cli/test_app_refusals.py", "plots/test_run_gallery.py"),
        "generator/study/test_cluster.py",
    )
)
"""Tests whose lines are not counted as covered: those that pass through many modules or through
another program, and those that read modules as text."""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Measure coverage by the other tests only, those that mirror the packages.

    Whole runs execute nearly all lines and assert little of each; counting lines makes them, and
    the compilation of code, three times as slow.
    """
    plugin = item.config.pluginmanager.getplugin("_cov")
    counter = getattr(plugin, "cov_controller", None)
    if counter is None:
        return (yield)
    if not any(item.path.is_relative_to(folder) for folder in UNCOUNTED):
        with _first_examples_counted(item, counter):
            return (yield)
    counter.pause()
    try:
        return (yield)
    finally:
        counter.resume()


COUNTED_EXAMPLES = 25
"""Examples of hypothesis in which lines are counted: those that follow pass through the same."""


@contextmanager
def _first_examples_counted(item: pytest.Item, counter: Any) -> Generator[None]:
    """Measure coverage by the first examples of a test of hypothesis; by other tests as a whole."""
    handle = getattr(getattr(item, "obj", None), "hypothesis", None)
    if handle is None:
        yield
        return
    test, numbers = handle.inner_test, count()

    @wraps(test)
    def example(*args: object, **drawn: object) -> object:
        if next(numbers) == COUNTED_EXAMPLES:
            counter.pause()
        return test(*args, **drawn)

    handle.inner_test = example
    try:
        yield
    finally:
        handle.inner_test = test
        if next(numbers) > COUNTED_EXAMPLES:
            counter.resume()


@pytest.fixture(scope="session", autouse=True)
def _heeded_sigint() -> None:
    """Handle SIGINT also where the tests are a background job, whose shell ignores it.

    Processes that tests start inherit it.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        with suppress(ValueError):  # handlers are set in the main thread only
            signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def sigint_handler() -> Iterator[None]:
    """Let SIGINT raise KeyboardInterrupt, as in a program in the foreground."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def shallow_stack() -> Iterator[int]:
    """Leave few frames for recursion; return a number of bodies in a row that need more."""
    limit = sys.getrecursionlimit()
    depth = len(inspect.stack())
    sys.setrecursionlimit(depth + 150)
    yield 250
    sys.setrecursionlimit(limit)
