"""`mover sweep`: the runs of a study, their table and the sensitivity of its measures."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from math import inf, nan
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
import typer

from generator.child_processes import cores
from generator.cli import answer
from generator.cli.options import option, output_option
from generator.cli.outputs import check_writable, writing
from generator.cli.progress import (
    load_compiled_integrator,
    load_exudyn,
    no_monitor,
    sweep_progress_bar,
)
from generator.diagnostics import UsageError
from generator.recording import Ending
from generator.rotations import Array
from generator.study.designs import design_points, run_count
from generator.study.method_check import LARGEST_SHIFT, MethodShift, checked_runs
from generator.study.run_results import RunResults
from generator.study.study import DesignKind, RunMethod, Statistic, Study, Uniform
from generator.study.study_file import STUDY_FILE
from generator.study.sweep import (
    MOTIONS_NAME,
    TABLE_NAME,
    Engine,
    Sweep,
    SweepProgress,
    needs_check,
    run_sweep,
)

if TYPE_CHECKING:
    from generator.study.sensitivity import StudyIndices

MAX_ROWS = 20
"""Rows of a table that are printed without `--verbose`."""

MAX_RANKED = 3
"""Measures whose parameters are ranked without `--verbose`."""


MORRIS_NOTE = (
    "Trajectories have four levels of a parameter, at 1/8, 3/8, 5/8 and 7/8 of its range;\n"
    "their effects are those of the whole range, as far as the measure is linear."
)


class Keep(StrEnum):
    """Files of each run that are kept."""

    MOTIONS = "motions"


class Again(StrEnum):
    """Finished runs that are repeated."""

    FAILED = "failed"


def sweep(
    name: Annotated[
        str,
        typer.Argument(
            metavar="STUDY.toml", help="Study file (docs/study-file.md), or a shipped study."
        ),
    ],
    output: Annotated[
        Path | None,
        output_option("DIR", "Folder of the results; a study that stopped there is continued."),
    ] = None,
    jobs: Annotated[int | None, option("N", "Number of processes. [default: one per core]")] = None,
    scheduler: Annotated[
        str | None,
        option("ADDRESS", "Scheduler of a Dask cluster, such as tls://host:8786, or `local`."),
    ] = None,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Accept a plain connection to another machine.")
    ] = False,
    keep: Annotated[Keep | None, typer.Option(help="Keep the motion of each run as .npz.")] = None,
    again: Annotated[Again | None, typer.Option(help="Repeat the runs that failed.")] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="List parameters and measures, and time one run.")
    ] = False,
    table: Annotated[
        Path | None, option("FILE.csv|.parquet", "Write the table of runs here as well.")
    ] = None,
    method: Annotated[
        RunMethod | None,
        typer.Option(
            help="Falls by the fast implicit method, checked by tight runs of 2 %, or all tight. "
            "[default: fast]"
        ),
    ] = None,
    *,
    show_progress: bool = False,
) -> answer.CommandResult:
    """Simulate a figure many times, each with other parameters.

    These may be springs, masses, poses, floors or the size of a person.
    Finished runs are kept: after Ctrl-C, a crash or a power failure the same command continues.
    """
    if jobs is not None and jobs < 1:
        raise UsageError(f"--jobs {jobs}: at least one process is needed")
    if insecure and scheduler is None:
        raise UsageError("--insecure needs --scheduler")
    if scheduler not in (None, "local") and jobs is not None:
        raise UsageError("--jobs is the number of processes on this machine; a cluster has its own")
    if output is None and not dry_run:
        raise UsageError("-o DIR is missing: the folder of the results")
    if table is not None:
        _check_table(table, output, STUDY_FILE.find(name))
    engine, workers = _choose_engine(jobs, scheduler, insecure=insecure)
    load_exudyn()
    parsed = STUDY_FILE.parse_file(name)
    study = replace(parsed.require_value(), method=method or RunMethod.FAST)
    if table is not None:
        check_writable([table], [study.design.file], "study")
    simulates_here = dry_run or output is None
    load_compiled_integrator(show_progress=show_progress, only_to_compile=not simulates_here)
    if dry_run or output is None:
        return _describe(name, study, workers)
    monitor = sweep_progress_bar if show_progress else no_monitor
    noted: list[tuple[float, SweepProgress]] = []
    try:
        with monitor(run_count(study)) as update:

            def note(progress: SweepProgress) -> None:
                noted[1:] = [(time.perf_counter(), progress)]  # the first and the last one stay
                update(progress)

            result = run_sweep(
                study,
                output,
                engine,
                keep_motions=keep is Keep.MOTIONS,
                again_failed=again is Again.FAILED,
                watch=note,
            )
        seconds = noted[-1][0] - noted[0][0] if noted else 0.0
        indices = _estimate_indices(study, result)
        files = _write_results(output, result, indices, table)
    except KeyboardInterrupt:
        if not noted:
            raise
        done, total = noted[-1][1].finished, noted[-1][1].total
        reason = f"the finished runs are kept in {output}, and the same command continues"
        message = f"interrupted; {reason}"
        return InterruptedSweep(message, done, total, failure=message)
    if keep is Keep.MOTIONS:
        files.append(output / MOTIONS_NAME)
    runs, fresh = len(result.rows), len(result.rows) - result.kept
    message = (
        f"{result.failed} of {answer.format_count(runs, 'run')} failed; --again failed repeats them"
    )
    return SweepResult(
        study=name,
        figure=study.name,
        runs=runs,
        finished_before=result.kept,
        failed=result.failed,
        outcomes=result.rows.count_outcomes(),
        wall_s=seconds,
        runs_per_s=fresh / seconds if fresh and seconds > 0.0 else None,
        processes=workers,
        measures={one: MeasureSummary.of(result.rows.numbers(one)) for one in study.measures},
        sensitivity=None if indices is None else indices.to_json()["measures"],
        files=files,
        rows=result.rows,
        indices=indices,
        diagnostics=(*parsed.diagnostics, *result.warnings),
        method=study.method,
        shifts=result.shifts,
        failure=message if result.failed else _refused_measures(result),
    )


def _refused_measures(result: Sweep) -> str | None:
    """Return the sentence about measures that the fast method shifts; None without any."""
    refused = [name for name, one in result.shifts.items() if one.is_refused]
    if not refused:
        return None
    tolerance = result.study.plan.tolerance
    return (
        f"the fast method shifts {', '.join(refused)} by more than {LARGEST_SHIFT:g} standard "
        f"deviations: use `tolerance = {0.1 * tolerance:g}` in the study, or --method tight"
    )


def _check_table(table: Path, output: Path | None, study: Path) -> None:
    """Raise an error for a table that cannot be written, or that is a file of the folder."""
    from generator.study.run_table import check_table_path

    check_table_path(table)
    if output is not None and realpath(table.parent) == realpath(output):
        raise UsageError(f"{table}: the folder of the results has its own table, `{TABLE_NAME}`")
    check_writable([table], [study])


def _choose_engine(
    jobs: int | None, scheduler: str | None, *, insecure: bool
) -> tuple[Engine, int | None]:
    """Return the engine of the runs and its number of processes, None where it is unknown."""
    from generator.study.worker_pool import run_locally

    count = jobs or cores()
    if scheduler is None:
        return partial(run_locally, jobs=count), count
    from generator.study.cluster import LOCAL, run_on_cluster

    engine = run_on_cluster(scheduler, jobs=count, insecure=insecure)
    return engine, count if scheduler == LOCAL else None


def _estimate_indices(study: Study, result: Sweep) -> "StudyIndices | None":
    """Return the sensitivity indices that a study asks for."""
    if study.sensitivity is None:
        return None
    from generator.study.sensitivity import estimate_indices

    return estimate_indices(study, result.rows)


def _write_results(
    folder: Path, result: Sweep, indices: "StudyIndices | None", table: Path | None
) -> list[Path]:
    """Write indices and another table, and return all files."""
    files = [folder / TABLE_NAME]
    if indices is not None:
        from generator.study.sensitivity import INDICES_NAME, write_indices

        path = folder / INDICES_NAME
        with writing(path, before=files):
            write_indices(indices, path)
        files.append(path)
    if table is not None:
        from generator.study.run_table import write_run_table

        with writing(table, before=files):
            write_run_table(table, result.study, result.points, result.rows)
        files.append(table)
    return files


@dataclass(frozen=True)
class InterruptedSweep(answer.CommandResult):
    """Progress of a sweep that Ctrl-C ended."""

    error: str
    finished: int
    runs: int

    def paragraphs(self) -> answer.Paragraphs:
        """Return the number of finished runs."""
        return (f"{self.finished} of {answer.format_count(self.runs, 'run')} are finished",)


class Varied(NamedTuple):
    """A parameter with the range of its values in a design, and the range that is stated."""

    name: str
    smallest: float
    largest: float
    unit: str
    paths: Sequence[str]
    stated: Sequence[float] | None


def _varied_parameters(study: Study, points: Array) -> list[Varied]:
    """Return the parameters of a study and the ranges of their values."""
    from generator.study.parameters import study_paths

    units: dict[int, str] = {}
    for number, path in study_paths(study):
        units.setdefault(number, path.unit)
    return [
        Varied(
            each.name,
            float(column.min()),
            float(column.max()),
            units[number],
            each.paths,
            (each.distribution.low, each.distribution.high)
            if isinstance(each.distribution, Uniform)
            else None,
        )
        for number, (each, column) in enumerate(
            zip(study.parameters.values(), points.T, strict=True)
        )
    ]


class MeasureData(NamedTuple):
    """A measure of a study."""

    name: str
    take: Statistic
    column: str


@dataclass(frozen=True)
class StudyDescription(answer.CommandResult):
    """Parameters and measures of a study, and the time of one run."""

    study: str
    figure: str
    runs: int
    design: DesignKind
    parameters: Sequence[Varied]
    measures: Sequence[MeasureData]
    run_s: float | None
    estimate_s: float | None
    processes: int | None
    outcome: str
    message: str

    def paragraphs(self) -> answer.Paragraphs:
        """Return tables of parameters and measures, and the time."""
        runs = answer.format_count(self.runs, "run")
        yield f"{self.study}: {runs} of {self.figure}, {self.design.value}"
        rows = [["parameter", "path", "unit", "from", "to", "range"]]
        for name, smallest, largest, unit, paths, stated in self.parameters:
            bounds = "" if stated is None else "{:.5g} to {:.5g}".format(*stated)
            rows.append([name, " ".join(paths), unit, f"{smallest:.5g}", f"{largest:.5g}", bounds])
        if not any(row[-1] for row in rows[1:]):
            rows = [row[:-1] for row in rows]
        table = answer.Table(rows, 3)
        yield f"{table}\n{MORRIS_NOTE}" if self.design is DesignKind.MORRIS else table
        measures = ((one.name, one.take.value, one.column) for one in self.measures)
        yield answer.Table([("measure", "number", "column"), *measures], 3)
        if self.run_s is not None and self.estimate_s is not None:
            yield (
                f"One run takes {_format_duration(self.run_s)}, the whole study about "
                f"{_format_duration(self.estimate_s)} {_describe_workers(self.processes)}."
            )


def _describe(name: str, study: Study, workers: int | None) -> StudyDescription:
    """Return the description of a study, with the time of one run."""
    from generator.study.run_case import run_case

    points = design_points(study)
    first = points[0].tolist()

    def time_of(timed: Study) -> float:
        start = time.perf_counter()
        run_case(timed, first, threads=1)
        return time.perf_counter() - start

    result = run_case(study, first, threads=1)  # which may compile its laws
    seconds = total = None
    if result.succeeded:
        seconds = time_of(study)
        total = seconds * len(points)
        if needs_check(study):
            tight = replace(study, method=RunMethod.TIGHT)
            time_of(tight)  # which may compile its laws
            total += time_of(tight) * len(checked_runs(len(points)))
        total /= workers or 1
    failure = f"the first run failed, {result.outcome}: {result.message}"
    return StudyDescription(
        study=name,
        figure=study.name,
        runs=len(points),
        design=study.design.kind,
        parameters=_varied_parameters(study, points),
        measures=[MeasureData(one.name, one.take, one.column) for one in study.measures.values()],
        run_s=seconds,
        estimate_s=total,
        processes=workers,
        outcome=result.outcome,
        message=result.message,
        failure=None if result.succeeded else failure,
    )


def _describe_workers(workers: int | None) -> str:
    if workers is None:
        return "of computing, divided by the workers of the cluster"
    return f"in {workers} process{'' if workers == 1 else 'es'}"


def _format_duration(seconds: float) -> str:
    """Return a time with two or three digits: `0.25 s`, `12 min`, `3.5 h`."""
    for size, unit in ((3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


class MeasureSummary(NamedTuple):
    """Values of a measure in the runs that have it; NaN of none."""

    smallest: float
    median: float
    largest: float
    runs: int

    @classmethod
    def of(cls, values: Array) -> "MeasureSummary":
        """Summarize values."""
        if not len(values):
            return cls(nan, nan, nan, 0)
        low, middle, high = map(float, (values.min(), np.median(values), values.max()))
        return cls(low, middle, high, len(values))


@dataclass(frozen=True)
class SweepResult(answer.CommandResult):
    """Results of a finished sweep."""

    study: str
    figure: str
    runs: int
    finished_before: int
    failed: int
    outcomes: Mapping[str, int]
    wall_s: float
    runs_per_s: float | None
    processes: int | None
    measures: Mapping[str, MeasureSummary]
    sensitivity: Mapping[str, object] | None
    method: RunMethod
    shifts: Mapping[str, MethodShift]
    files: Sequence[Path]
    rows: RunResults = field(metadata=answer.HIDDEN)
    indices: "StudyIndices | None" = field(metadata=answer.HIDDEN)

    def paragraphs(self) -> answer.Paragraphs:
        """Return the outcomes of the runs, the measures and their sensitivity, and the files."""
        counts = ", ".join(f"{count} {outcome}" for outcome, count in self.outcomes.items())
        lines = [
            f"{self.study}: {answer.format_count(self.runs, 'run')} of {self.figure}: {counts}"
        ]
        if self.runs > self.finished_before:
            rate = inf if self.runs_per_s is None else self.runs_per_s
            where = "" if self.processes is None else f" {_describe_workers(self.processes)}"
            lines.append(f"{_format_duration(self.wall_s)}{where}, {rate:.3g} runs/s")
        if self.finished_before:
            lines.append(f"{self.finished_before} of them finished before")
        yield "\n".join(lines)
        yield from _failures(self.rows)
        table, more = self._measures_table(), len(self.measures) - MAX_ROWS
        hidden = f"\nand {answer.format_count(more, 'measure')} more, see {self.files[0]}"
        yield f"{answer.Table(table[: MAX_ROWS + 1])}{hidden if more > 0 else ''}"
        yield from self._rankings()[:MAX_RANKED]
        if self.indices is not None and self.indices.kind is DesignKind.MORRIS:
            yield MORRIS_NOTE
        if self.shifts:
            largest = max(self.shifts, key=lambda name: abs(self.shifts[name].shift))
            one = self.shifts[largest]
            yield (
                f"fast method, beside {answer.format_count(one.runs, 'tight run')}: means differ "
                f"by at most {abs(one.shift):.2g} standard deviations, of {largest}"
            )
        yield answer.format_written(self.files)

    def details(self) -> answer.Paragraphs:
        """Return what the text leaves out."""
        if len(self.measures) > MAX_ROWS:
            yield answer.Table(self._measures_table())
        yield from self._rankings()[MAX_RANKED:]
        if self.shifts:
            rows = [["measure", *MethodShift._fields]]
            rows += [
                [name, str(one.runs), *(f"{number:.2g}" for number in one[1:])]
                for name, one in self.shifts.items()
            ]
            yield answer.Table(rows)

    def _measures_table(self) -> list[list[str]]:
        return [
            ["measure", *MeasureSummary._fields],
            *(
                [name, *(f"{number:.5g}" for number in one[:-1]), str(one.runs)]
                for name, one in self.measures.items()
            ),
        ]

    def _rankings(self) -> list[str]:
        return [] if self.indices is None else list(_rankings(self.indices))


def _failures(rows: RunResults) -> Iterator[str]:
    """Yield a line for each kind of failure, with the first run that has it."""
    first = {outcome: int(rows.have_outcome(outcome).argmax()) for outcome in rows.count_outcomes()}
    first.pop(Ending.DONE.value, None)
    if first:
        yield "\n".join(
            f"{outcome}, first in run {number}: {' '.join(rows[number].message.split())}"
            for outcome, number in first.items()
        )


def _rankings(indices: "StudyIndices") -> Iterator[str]:
    """Yield for each measure its parameters, the one with the largest effect first."""
    for title, rows, note in indices.rankings():
        if rows:
            yield f"{title}\n{answer.Table(rows[: MAX_ROWS + 1])}" + (f"\n{note}" if note else "")
        else:
            yield f"{title}: {note}"
