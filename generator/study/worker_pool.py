"""Runs of a study in processes of their own."""

from dataclasses import dataclass
from pathlib import Path

from generator.study.study import RunResult


@dataclass(frozen=True)
class Task:
    """One run that a study needs.

    Attributes:
        index: of the run in the design, from 0.
        values: of the parameters, in their order.
        keep: file for the motion; None to keep no motion.
    """

    index: int
    values: tuple[float, ...]
    keep: Path | None = None


@dataclass(frozen=True)
class FinishedRun:
    """Result of a task.

    Attributes:
        index: of the run in the design, from 0.
        result: of the run.
        seconds: that the run took.
    """

    index: int
    result: RunResult
    seconds: float
