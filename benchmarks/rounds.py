"""Times of runs that are compared: all take turns, and the least of several rounds counts."""

from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from typing import TypeVar

from benchmarks.outside import Fall

LONG = 0.5
"""Wall time of a run above which fewer rounds are made [s]: long runs are their own average."""

LONG_ROUNDS = 3

Key = TypeVar("Key", bound=Hashable)


def best_of(runs: Mapping[Key, Callable[[], Fall]], rounds: int) -> dict[Key, Fall]:
    """Return each run with its least wall and CPU time; a run that fails is left out."""
    found: dict[Key, Fall] = {}
    failed: set[Key] = set()
    for number in range(rounds):
        for key, run in runs.items():
            before = found.get(key)
            if key in failed or (before and number >= LONG_ROUNDS and before.wall > LONG):
                continue
            try:
                made = run()
            except RuntimeError as failure:
                print(f"{key}: {failure}")
                failed.add(key)
                continue
            if before is not None:
                made = replace(
                    before, wall=min(before.wall, made.wall), cpu=min(before.cpu, made.cpu)
                )
            found[key] = made
    return found
