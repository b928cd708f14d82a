"""Many falls of a kind on the command line: `mover simulate FIGURE --fall KIND --starts N`."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, sqrt
from pathlib import Path

import numpy as np

from generator.cli import answer
from generator.cli.contact import StartsChoice
from generator.cli.interrupts import defer_interrupt
from generator.cli.outputs import check_distinct_paths, writing
from generator.cli.progress import item_progress_bar, load_compiled_integrator, no_monitor
from generator.model import Model
from generator.rotations import Array
from generator.simulation.plan import Plan
from generator.study.falls import Falls, Summary, run_falls, summarize
from generator.study.run_table import check_table_path, write_run_table
from generator.study.study import RunMethod
from generator.study.worker_pool import FinishedRun

_QUANTILE = 1.96
"""Two-sided 95 % quantile of the normal distribution."""

_TITLES = {
    "pelvis_speed_m_per_s": "speed of the pelvis [m/s]",
    "head_speed_m_per_s": "speed of the head [m/s]",
    "hand_speed_m_per_s": "speed of the first hand [m/s]",
    "descent_ms": "start to pelvis [ms]",
    "hand_lead_ms": "hand before pelvis [ms]",
    "hip_force_N": "force on the pelvis [N]",
    "hip_force_body_weights": "force on the pelvis [body weights]",
    "head_force_N": "force on the head [N]",
    "head_acceleration_g": "acceleration of the head [g]",
}


@dataclass(frozen=True)
class FallsResult(answer.CommandResult):
    """Falls of one kind from several starts."""

    figure: str
    fall: str
    seed: int
    starts: int
    outcomes: Mapping[str, int]
    method: RunMethod
    wall_s: float
    files: Sequence[Path]
    tone: str | None = field(metadata=answer.OMITTED_IF_NONE)
    scale: Mapping[str, float] | None = field(metadata=answer.OMITTED_IF_NONE)
    falls: Mapping[str, int | float | Summary]
    result: Falls = field(metadata=answer.HIDDEN)

    def paragraphs(self) -> answer.Paragraphs:
        """Return the outcomes, a row for each measure, and the files."""
        counts = ", ".join(f"{count} {outcome}" for outcome, count in self.outcomes.items())
        seeds = f"seeds {self.seed} to {self.result.seeds[-1]:.0f}"
        count = answer.format_count(self.starts, "fall")
        yield f"{self.figure}: {count} of kind {self.fall}, {seeds}: {counts}"
        rows = [("", "mean (SD)", "95 % of falls", "falls")]
        for name, values in self.result.quantities().items():
            rows.append((_TITLES[name], *_distribution_cells(values)))
        yield answer.Table(rows)
        lines = [f"tone   {self.tone}"] if self.tone else []
        lines += [f"scale  {path} = {value:g}" for path, value in (self.scale or {}).items()]
        lines.append(f"time   {self.wall_s:.3g} s, {self.method.value} method")
        hits, done = self.result.head_hit_share, int(self.result.is_done.sum())
        if isfinite(hits):
            low, high = share_interval(hits, done)
            interval = f"95 % interval {100.0 * low:.0f} to {100.0 * high:.0f} %"
            lines.insert(0, f"head   hits in {100.0 * hits:.0f} % of falls ({interval})")
        files = ", ".join(map(str, self.files))
        lines.append(f"wrote  {files or 'nothing; -o FILE.csv writes all falls'}")
        yield "\n".join(lines)


def check_tables(paths: Sequence[Path]) -> None:
    """Check that the tables of the falls can have these names.

    Raises:
        UsageError: A suffix is not that of a table, or a file is listed twice.
        NotInstalledError: A library is missing.
    """
    for path in paths:
        check_table_path(path)
    check_distinct_paths(paths)


def _distribution_cells(values: Array) -> tuple[str, str, str]:
    """Return mean and standard deviation, the middle 95 %, and the number of known values."""
    known = values[np.isfinite(values)]
    if not known.size:
        return "-", "-", "0"
    mean, sd = summarize(known)
    low, high = np.percentile(known, [2.5, 97.5])
    spread = f" ({_format_number(sd)})" if known.size > 1 else ""
    interval = f"{_format_number(low)} to {_format_number(high)}"
    return f"{_format_number(mean)}{spread}", interval, str(known.size)


def _format_number(number: float) -> str:
    """Format a number with three digits, or as an integer."""
    return f"{number:.0f}" if abs(number) >= 100.0 else f"{number:.3g}"


def share_interval(share: float, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share of a number of falls.

    It is the score interval of Wilson (1927, J. Am. Stat. Assoc. 22:209).
    """
    square = _QUANTILE**2 / count
    middle = (share + 0.5 * square) / (1.0 + square)
    half = sqrt(share * (1.0 - share) * square + 0.25 * square**2) / (1.0 + square)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def simulate_falls(
    name: str,
    model: Model,
    kind: str,
    plan: Plan,
    choice: StartsChoice,
    scales: Mapping[str, float],
    files: Sequence[Path],
    *,
    tone: str | None,
    is_fast: bool,
    show_progress: bool,
) -> FallsResult:
    """Run several falls, and write their tables.

    Args:
        name: Name of the figure.
        model: Model, before `--scale` changes it.
        kind: Kind of the falls.
        plan: Plan of the falls, before `--scale` changes it.
        choice: Number of falls and seed of the first.
        scales: Values of `--scale`, by path.
        files: Tables to write.
        tone: Tone of the falls, as the summary of one states it; None for limp bodies.
        is_fast: Whether falls are integrated by the fast method of studies.
        show_progress: Whether a bar is shown.
    """
    method = RunMethod.FAST if is_fast else RunMethod.TIGHT
    load_compiled_integrator(show_progress=show_progress, only_to_compile=True)
    monitor = item_progress_bar if show_progress else no_monitor
    begin = time.perf_counter()
    with defer_interrupt() as check, monitor(choice.number, "falls") as update:

        def watch(run: FinishedRun) -> bool:
            update(f"seed {choice.seed + run.index}")
            try:
                check()
            except KeyboardInterrupt:
                return True
            return False

        falls = run_falls(
            model,
            kind,
            choice.number,
            choice.seed,
            plan,
            tuple(scales.items()),
            method,
            watch=watch,
        )
    seconds = time.perf_counter() - begin
    for k, path in enumerate(files):
        with writing(path, before=files[:k]):
            write_run_table(path, falls.study, falls.starts, falls.rows)
    failed = [row for row in falls.rows if not row.succeeded]
    sentence = f"{len(failed)} of {answer.format_count(len(falls), 'fall')} failed"
    failure = f"{sentence}, first {failed[0].outcome}: {failed[0].message}" if failed else None
    if len(falls) < choice.number:
        failure = f"interrupted after {len(falls)} of {choice.number} falls"
    return FallsResult(
        figure=name,
        fall=kind,
        seed=choice.seed,
        starts=len(falls),
        outcomes=falls.rows.count_outcomes(),
        method=method,
        wall_s=seconds,
        files=files,
        tone=tone,
        scale=dict(scales) or None,
        falls=falls.summary(),
        result=falls,
        failure=failure,
    )
