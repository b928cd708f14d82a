"""Sweep: all runs of a study, in a folder that keeps what is finished."""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import Diagnostic, InputError, UsageError, error, format_count, warning
from generator.geometry.read import with_surfaces
from generator.motion_files.motion import file_sha256
from generator.notebook import html_table
from generator.recording import Ending
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
    unwritable,
)
from generator.study.method_check import (
    CHECK_NAME,
    MethodShift,
    checked_runs,
    compare_methods,
    read_check,
    write_check,
)
from generator.study.run_results import RunResults
from generator.study.run_table import write_run_table
from generator.study.study import DIED, RunMethod, Study
from generator.study.worker_pool import FinishedRun, Task, run_locally
from generator.text_io import os_error_reason, path_exists, remove_stale_parts, write_atomic
from springs.short_repr import short_repr

STUDY_NAME = "study.toml"
TABLE_NAME = "runs.csv"
MOTIONS_NAME = "motions"

_MIN_RUN_DIGITS = 5

_MAX_WARNINGS = 10
"""Largest number of damaged lines that are listed."""


class _Tasks(Sequence[Task]):
    """Tasks of some runs, each made when it is asked for."""

    def __init__(self, points: Array, indices: NDArray[np.int64], motions: Path | None) -> None:
        self._points, self._indices, self._motions = points, indices, motions

    def __len__(self) -> int:
        return len(self._indices)

    @overload
    def __getitem__(self, index: int) -> Task: ...
    @overload
    def __getitem__(self, index: slice) -> "_Tasks": ...
    def __getitem__(self, index: int | slice) -> "Task | _Tasks":
        if isinstance(index, slice):
            return _Tasks(self._points, self._indices[index], self._motions)
        run = int(self._indices[index])
        folder = self._motions
        keep = None if folder is None else motion_path(folder, run, len(self._points))
        return Task(run, tuple(self._points[run].tolist()), keep)


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
        warnings: warnings about the journal.
        shifts: comparison of each measure with tight runs; empty for a study without fast ones.
    """

    study: Study
    points: Array
    rows: RunResults
    kept: int = 0
    warnings: tuple[Diagnostic, ...] = ()
    shifts: Mapping[str, MethodShift] = field(default_factory=dict[str, MethodShift])

    @property
    def failed(self) -> int:
        """Number of runs that did not reach their stop time."""
        return int((~self.rows.have_outcome(Ending.DONE.value)).sum())

    def _repr_html_(self) -> str:
        """Outcomes of the runs and range of each measure, for notebooks."""
        counts = (f"{count} {outcome}" for outcome, count in self.rows.count_outcomes().items())
        title = f"{format_count(len(self.rows), 'run')} of {self.study.name}: {', '.join(counts)}"
        numbers = {name: self.rows.numbers(name) for name in self.study.measures}
        rows = (
            (name, *(f"{q:.5g}" for q in np.quantile(some, (0.0, 0.5, 1.0))), some.size)
            for name, some in numbers.items()
            if some.size
        )
        return html_table(title, ("measure", "smallest", "median", "largest", "runs"), rows)


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
    next one continues. Surfaces are read once, at the start: a change of their files has no effect
    on a sweep under way. Runs whose process died in an earlier sweep are repeated.

    A script calls this function below `if __name__ == "__main__":`, since the processes that carry
    out the runs import it.

    Args:
        study: study to run.
        folder: folder for the results.
        engine: that carries out the runs, such as `partial(run_locally, jobs=4)`, or that which
            `run_on_executor` makes of an executor [default: a process of this machine for each
            core].
        keep_motions: whether the motions are written; runs without theirs are repeated.
        again_failed: whether runs that failed before are repeated; they are as well where a line
            of the journal is damaged, which may have been that of a repetition.
        watch: called at the start and after each run.

    Raises:
        UsageError: the folder has the runs of another study, or another sweep is running in it.
        InputError: a file cannot be read or written.
        MoverError: the engine cannot start.
    """
    folder, points, versions = Path(folder), design_points(study), installed_versions()
    study = _with_files(study)
    header = JournalHeader(content_key(study, points, versions), versions)
    journal_path = folder / JOURNAL_NAME
    _create_folder(folder)
    with lock_folder(folder):
        content = read_journal(journal_path, header, study.measures, len(points))
        if content.header != header and not (content.lines or content.damaged_lines):
            content = replace(content, header=None, size=0)  # another study without finished runs
        _check_owner(folder, content, header)
        remove_stale_parts(folder)
        results = content.results
        _drop_unusable(
            results,
            again_failed=again_failed or bool(content.damaged_lines),
            motions=folder if keep_motions else None,
        )
        kept = int(results.finished.sum())
        with open_journal(journal_path, content, header) as journal:
            _write(folder / STUDY_NAME, partial(write_atomic, content=study.text))
            if keep_motions:
                _create_folder(folder / MOTIONS_NAME)
                remove_stale_parts(folder / MOTIONS_NAME)
            tasks = _Tasks(
                points, np.flatnonzero(~results.finished), folder if keep_motions else None
            )
            _carry_out(study, tasks, engine, journal, results, watch)
        shifts = _check_method(study, points, results, engine, folder, is_new=len(tasks) > 0)
        _write(
            folder / TABLE_NAME,
            partial(write_run_table, study=study, points=points, rows=results),
        )
    warnings = tuple(_damage_warnings(journal_path, content.damaged_lines))
    return Sweep(study, points, results, kept, warnings, shifts)


def _with_files(study: Study) -> Study:
    """Return a study whose runs read no file: what the key is made of is what all of them use."""
    figure = with_surfaces(study.model.figure)
    digest = None if figure.path is None else file_sha256(figure.path)
    return replace(study, model=replace(study.model, figure=replace(figure, sha256=digest)))


def _damage_warnings(journal: Path, lines: Sequence[int]) -> Iterator[Diagnostic]:
    """Yield a warning for each of the first damaged lines, and one for the others."""
    for number in lines[:_MAX_WARNINGS]:
        yield warning(f"`{journal}`: line {number} is damaged and does not count")
    more = len(lines) - _MAX_WARNINGS
    if more > 0:
        yield warning(f"`{journal}`: {format_count(more, 'more line')} are damaged")


def _carry_out(
    study: Study,
    tasks: Sequence[Task],
    engine: Engine,
    journal: Journal,
    results: RunResults,
    watch: Callable[[SweepProgress], None] | None,
) -> None:
    """Carry out tasks, and add each result to the journal and to the others."""
    finished, total = int(results.finished.sum()), len(results)
    if watch is not None:
        watch(SweepProgress(finished, total))
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
                raise unwritable(motions, failure) from None
            if run is None:
                return
            journal.add(run)
            results[run.index] = run.result
            finished += 1
            if watch is not None:
                watch(SweepProgress(finished, total, run))


def needs_check(study: Study) -> bool:
    """Return whether some runs of a study are repeated by the tight method."""
    is_fast = study.method is RunMethod.FAST
    return is_fast and bool(study.plan.scene.props) and bool(study.measures)


def _check_method(
    study: Study, points: Array, results: RunResults, engine: Engine, folder: Path, *, is_new: bool
) -> dict[str, MethodShift]:
    """Return the comparison of fast falls with tight ones, made after new runs, or read."""
    if not needs_check(study):
        return {}
    known = None if is_new else read_check(folder)
    if known is not None:
        return known
    chosen = np.array(checked_runs(len(points)), dtype=np.int64)
    tight = replace(study, method=RunMethod.TIGHT)
    with closing(engine(tight, _Tasks(points, chosen, None))) as arriving:
        shifts = compare_methods(study, results, {run.index: run for run in arriving})
    _write(folder / CHECK_NAME, lambda path: write_check(path.parent, shifts))
    return shifts


def _drop_unusable(results: RunResults, *, again_failed: bool, motions: Path | None) -> None:
    """Drop the results of the runs that are repeated.

    Args:
        results: Results of all runs.
        again_failed: whether those that failed are repeated.
        motions: folder of the sweep, where motions are kept; runs without theirs are repeated.
    """
    results.finished[results.have_outcome(DIED)] = False
    succeeded = results.have_outcome(Ending.DONE.value)
    if again_failed:
        results.finished[~succeeded] = False
    if motions is not None:
        for index in np.flatnonzero(succeeded).tolist():
            results.finished[index] = path_exists(motion_path(motions, index, len(results)))


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
            f"`{folder}` has {format_count(content.lines, 'run')} of another study, or of this "
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
        raise unwritable(path, failure) from None
