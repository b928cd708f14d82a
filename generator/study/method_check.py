"""Comparison of a study's fast runs with tight ones: what the fast ones may be read for.

A fall is chaotic: a fast run and a tight one of the same values part, but their measures have the
same distribution. So each measure is judged by the mean of its differences, in standard deviations
of the measure over the study.
"""

from collections.abc import Mapping
from math import ceil, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np

from generator.recording import Ending
from generator.study.run_results import RunResults
from generator.study.study import Study
from generator.study.worker_pool import FinishedRun
from generator.text_io import write_atomic

CHECK_NAME = "method.csv"
"""File of the comparison in the folder of a study."""

CHECKED_SHARE = 0.02
"""Share of the runs that are repeated by the tight method."""

MIN_CHECKED = 20
"""Smallest number of these, but for a study of fewer runs."""

LARGEST_SHIFT = 0.1
"""Mean difference, in standard deviations of a measure, above which the measure is refused."""

_CERTAINTY = 2.0
"""Standard errors by which the mean difference must exceed `LARGEST_SHIFT`."""


class MethodShift(NamedTuple):
    """Difference of a measure between fast and tight runs.

    Attributes:
        runs: number of runs that have the measure by both methods.
        shift: mean difference over the standard deviation of the measure over the study.
        standard_error: standard error of the shift.
        median: median size of the differences, in the unit of the measure.
    """

    runs: int
    shift: float
    standard_error: float
    median: float

    @property
    def is_refused(self) -> bool:
        """True if the measure is certainly shifted by more than `LARGEST_SHIFT`."""
        return abs(self.shift) - _CERTAINTY * self.standard_error > LARGEST_SHIFT


def checked_runs(runs: int) -> list[int]:
    """Return the runs of a study that are repeated, a random sample that its size decides."""
    count = min(runs, max(MIN_CHECKED, ceil(CHECKED_SHARE * runs)))
    return np.sort(np.random.default_rng(runs).choice(runs, count, replace=False)).tolist()


def compare_methods(
    study: Study, fast: RunResults, tight: Mapping[int, FinishedRun]
) -> dict[str, MethodShift]:
    """Return the difference of each measure that two fast and tight runs or more have.

    Args:
        study: study of the fast runs.
        fast: results of all runs.
        tight: results of some of them by the tight method.
    """
    found: dict[str, MethodShift] = {}
    for name in study.measures:
        pairs = [
            (fast[index].measures[name], run.result.measures[name])
            for index, run in tight.items()
            if fast[index].outcome == run.result.outcome == Ending.DONE.value
        ]
        differences = np.array([a - b for a, b in pairs if a is not None and b is not None])
        if differences.size < 2:
            continue
        spread = float(np.std(fast.numbers(name))) or 1.0
        found[name] = MethodShift(
            differences.size,
            float(np.mean(differences)) / spread,
            float(np.std(differences, ddof=1)) / (spread * sqrt(differences.size)),
            float(np.median(np.abs(differences))),
        )
    return found


def write_check(folder: Path, shifts: Mapping[str, MethodShift]) -> None:
    """Write the comparison into the folder of a study."""
    lines = ["measure,runs,shift_sd,standard_error_sd,median_difference"]
    lines += [
        f"{name},{one.runs},{one.shift!r},{one.standard_error!r},{one.median!r}"
        for name, one in shifts.items()
    ]
    write_atomic(folder / CHECK_NAME, "\n".join([*lines, ""]))


def read_check(folder: Path) -> dict[str, MethodShift] | None:
    """Return the comparison of an earlier sweep; None if there is none that can be read."""
    try:
        lines = (folder / CHECK_NAME).read_text(encoding="utf-8").splitlines()[1:]
        rows = [line.rsplit(",", 4) for line in lines]
        return {
            name: MethodShift(int(runs), float(shift), float(error), float(median))
            for name, runs, shift, error, median in rows
        }
    except (OSError, ValueError):
        return None
