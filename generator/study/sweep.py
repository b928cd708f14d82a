"""Sweep: all runs of a study, in a folder that keeps what is finished."""

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

from generator.diagnostics import Diagnostic, InputError, UsageError, error, format_count, warning
from generator.rotations import Array
from generator.study.content_key import content_key, installed_versions
from generator.study.designs import design_points
from generator.study.journal import (
    JOURNAL_NAME,
    Journal,
    JournalContent,
    JournalHeader,
    lock_folder,
    open_journal,
    read_journal,
)
from generator.study.run_table import write_run_table
from generator.study.study import RunResult, Study
from generator.study.worker_pool import FinishedRun, Task, run_locally
from generator.text_io import os_error_reason, path_exists, remove_stale_parts, write_atomic
from springs.short_repr import short_repr

STUDY_NAME = "study.toml"
TABLE_NAME = "runs.csv"
MOTIONS_NAME = "motions"

_MIN_RUN_DIGITS = 5

Engine: TypeAlias = Callable[[Study, Sequence[Task]], Generator[FinishedRun]]
"""Carries out the tasks of a study, and yields each result as it arrives."""


@dataclass(frozen=True)
class SweepProgress:
    """Progress of a sweep.

    Attributes:
        finished: number of runs with a result, also from earlier sweeps of the folder.
        total: number of runs of the study.
        latest: result that has just arrived; None at the start of the sweep.
    """

    finished: int
    total: int
    latest: FinishedRun | None = None


@short_repr
@dataclass(frozen=True)
class Sweep:
    """Result of a sweep.

    Attributes:
        study: that was run.
        points: values of the parameters of each run, shape (runs, parameters).
        rows: results of the runs, in the order of the points.
        kept: number of results that earlier sweeps of the folder had left.
        warnings: about the journal.
    """

    study: Study
    points: Array
    rows: tuple[RunResult, ...]
    kept: int = 0
    warnings: tuple[Diagnostic, ...] = ()

    @property
    def failed(self) -> int:
        """Number of runs that did not reach their stop time."""
        return sum(not row.succeeded for row in self.rows)


def motion_path(folder: Path, index: int, runs: int) -> Path:
    """Return the file for the motion of a run of a sweep's folder.

    The path is absolute, since a process on another machine may run in another folder.
    """
    digits = max(_MIN_RUN_DIGITS, len(str(runs - 1)))
    return folder.absolute() / MOTIONS_NAME / f"{index:0{digits}}.npz"


def run_sweep(
    study: Study,
    folder: str | Path,
    engine: Engine = run_locally,
    *,
    keep_motions: bool = False,
    again_failed: bool = False,
    watch: Callable[[SweepProgress], None] | None = None,
) -> Sweep:
    """Carry out the runs of a study that its folder does not have yet, and write their table.

    The folder is created. Each finished run is a line of its journal; whatever ends the sweep, the
    next one continues. A script calls this function below `if __name__ == "__main__":`, since the
    processes that carry out the runs import it.

    Args:
        study: to run.
        folder: for the results.
        engine: that carries out the runs, such as `partial(run_locally, jobs=4)` [default: a
            process of this machine for each core].
        keep_motions: whether the motions are written; runs without theirs are repeated.
        again_failed: whether runs that failed before are repeated.
        watch: called at the start and after each run.

    Raises:
        UsageError: the folder has the runs of another study, or another sweep is running in it.
        InputError: a file cannot be read or written.
        MoverError: the engine cannot start.
    """
    folder, points, versions = Path(folder), design_points(study), installed_versions()
    header = JournalHeader(content_key(study, points, versions), versions)
    journal_path = folder / JOURNAL_NAME
    _create_folder(folder)
    with lock_folder(folder):
        content = read_journal(journal_path, study.measures)
        if content.header != header and not (content.runs or content.damaged_lines):
            content = JournalContent(None, {}, (), 0)  # another study that has finished no run
        _check_owner(folder, content, header)
        remove_stale_parts(folder)
        results = _usable_runs(folder, content, len(points), keep_motions, again_failed)
        kept = len(results)
        with open_journal(journal_path, content.size) as journal:
            if content.header is None:
                journal.begin(header)
            _write(folder / STUDY_NAME, partial(write_atomic, content=study.text))
            if keep_motions:
                _create_folder(folder / MOTIONS_NAME)
                remove_stale_parts(folder / MOTIONS_NAME)
            tasks = [
                Task(
                    index,
                    tuple(values),
                    motion_path(folder, index, len(points)) if keep_motions else None,
                )
                for index, values in enumerate(points.tolist())
                if index not in results
            ]
            _carry_out(study, tasks, engine, journal, results, len(points), watch)
        rows = tuple(results[index].result for index in range(len(points)))
        _write(
            folder / TABLE_NAME,
            partial(write_run_table, study=study, points=points, rows=rows),
        )
    warnings = tuple(
        warning(f"`{journal_path}`: line {number} is damaged and was ignored")
        for number in content.damaged_lines
    )
    return Sweep(study, points, rows, kept, warnings)


def _carry_out(
    study: Study,
    tasks: Sequence[Task],
    engine: Engine,
    journal: Journal,
    results: dict[int, FinishedRun],
    total: int,
    watch: Callable[[SweepProgress], None] | None,
) -> None:
    """Carry out tasks, and add each result to the journal and to the others."""
    if watch is not None:
        watch(SweepProgress(len(results), total))
    if not tasks:
        return
    motions = None if tasks[0].keep is None else tasks[0].keep.parent
    with closing(engine(study, tasks)) as arriving:
        while True:
            try:
                run = next(arriving, None)
            except OSError as failure:
                if motions is None:
                    raise
                raise _unwritable(motions, failure) from None
            if run is None:
                return
            journal.add(run)
            results[run.index] = run
            if watch is not None:
                watch(SweepProgress(len(results), total, run))


def _usable_runs(
    folder: Path, content: JournalContent, total: int, keep_motions: bool, again_failed: bool
) -> dict[int, FinishedRun]:
    """Select the runs of a journal that need no repetition."""

    def is_usable(index: int, run: FinishedRun) -> bool:
        if not run.result.succeeded:
            return not again_failed
        return not keep_motions or path_exists(motion_path(folder, index, total))

    return {
        index: run for index, run in content.runs.items() if index < total and is_usable(index, run)
    }


def _check_owner(folder: Path, content: JournalContent, header: JournalHeader) -> None:
    """Raise UsageError unless the folder is new, or has runs of this study and these versions."""
    if content.header == header:
        return
    journal = folder / JOURNAL_NAME
    if content.header is not None and content.header.versions != header.versions:
        raise UsageError(
            f"`{folder}` has runs made with {content.header.versions}, and this is "
            f"{header.versions}: choose another folder, or delete this one."
        )
    if content.header is not None:
        raise UsageError(
            f"`{folder}` has {format_count(len(content.runs), 'run')} of another study, or of this "
            "one before it was changed: choose another folder, or delete this one."
        )
    if content.size:
        raise UsageError(
            f"`{journal}` does not begin as a journal of runs: choose another folder, or delete it."
        )
    # A power cut may leave an empty journal beside the study.
    for name in (TABLE_NAME,) if path_exists(journal) else (STUDY_NAME, TABLE_NAME):
        if path_exists(folder / name):
            raise UsageError(
                f"`{folder}` has a file `{name}` and no journal of runs: choose another folder."
            )


def _create_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise InputError(
            [error(f"`{folder}` cannot be created: {os_error_reason(failure)}")]
        ) from None


def _write(path: Path, write: Callable[[Path], None]) -> None:
    try:
        write(path)
    except OSError as failure:
        raise _unwritable(path, failure) from None


def _unwritable(path: Path, failure: OSError) -> InputError:
    hint = "the finished runs are kept, and the same command continues"
    return InputError([error(f"`{path}` cannot be written: {os_error_reason(failure)}", hint=hint)])


def count_outcomes(rows: Sequence[RunResult]) -> Mapping[str, int]:
    """Number of rows of each outcome, in order of appearance."""
    counts: dict[str, int] = {}
    for row in rows:
        counts[row.outcome] = counts.get(row.outcome, 0) + 1
    return counts
