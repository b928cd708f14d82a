"""Damage to the journal of a sweep: is each change seen, or without effect on the table?

    python -m benchmarks.journal [COUNT]

A journal has the lines of runs that succeeded, of one that failed, and of one that failed and was
repeated. In each try one bit or byte of it is changed, or a byte removed or added, and the sweep
continues with the same study. It must refuse the folder, or write the same table.
"""

import random
import sys
import tempfile
from collections import Counter
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path

from benchmarks import tables
from benchmarks.sweeps import pendulum_study
from generator.diagnostics import UsageError
from generator.study.journal import JOURNAL_NAME
from generator.study.study import PROGRAM_ERROR, RunResult, Study, failed_run
from generator.study.sweep import TABLE_NAME, run_sweep
from generator.study.worker_pool import FinishedRun, Task

RUNS, CHANGES = 12, 3000

CONSEQUENCES = REFUSED, WARNED, REPEATED, WRONG = (
    "the folder is refused",
    "a warning, the same table",
    "no warning, the same table",
    "another table",
)


class _Serial:
    """An engine that computes rows without a simulation.

    Attributes:
        failing: runs that fail.
    """

    def __init__(self, *failing: int) -> None:
        self.failing = failing

    def __call__(self, study: Study, tasks: Sequence[Task]) -> Generator[FinishedRun]:
        for task in tasks:
            gravity, start = task.values
            result = RunResult("done", "", {"swing": gravity / 3.0, "end": start * start})
            if task.index in self.failing:
                result = failed_run(study, PROGRAM_ERROR, "A fault.")
            yield FinishedRun(task.index, result, 0.01)


def damage_journals(folder: Path, count: int, seed: int = 1) -> Iterator[tuple[str, str]]:
    """Yield each change of a journal and what follows from it."""
    study, folder = pendulum_study(RUNS), folder / "study"
    run_sweep(study, folder, _Serial(3, 5))
    run_sweep(study, folder, _Serial(5), again_failed=True)
    journal, table = ((folder / name).read_bytes() for name in (JOURNAL_NAME, TABLE_NAME))
    moments = random.Random(seed)
    for _ in range(count):
        change, damaged = _change(journal, moments)
        (folder / JOURNAL_NAME).write_bytes(damaged)
        yield change, _continue(study, folder, table)


def _change(data: bytes, moments: random.Random) -> tuple[str, bytes]:
    """Return the kind of a change, and the changed bytes."""
    place = moments.randrange(len(data))
    before, byte, after = data[:place], data[place], data[place + 1 :]
    other = (byte + moments.randrange(1, 256)) % 256
    return moments.choice(
        [
            ("bit", bytes([*before, byte ^ (1 << moments.randrange(8)), *after])),
            ("byte", bytes([*before, other, *after])),
            ("byte removed", before + after),
            ("byte added", bytes([*before, other, byte, *after])),
        ]
    )


def _continue(study: Study, folder: Path, table: bytes) -> str:
    """Continue a sweep, and return what follows from its journal."""
    try:
        result = run_sweep(study, folder, _Serial(5))
    except UsageError:
        return REFUSED
    if (folder / TABLE_NAME).read_bytes() != table:
        return WRONG
    return WARNED if result.warnings else REPEATED


def main() -> None:
    """Print how often each consequence was seen; fail if a table is wrong."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else CHANGES
    with tempfile.TemporaryDirectory() as folder:
        found = Counter(damage_journals(Path(folder), count))
    changes = sorted({change for change, _ in found})
    tables.show(
        [
            {"change": change, **{each: found[change, each] for each in CONSEQUENCES}}
            for change in changes
        ]
    )
    sys.exit(any(consequence == WRONG for _, consequence in found))


if __name__ == "__main__":
    main()
