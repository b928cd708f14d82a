"""`mover compare`: motions over one another, and what differs most between them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import degrees, radians
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from generator.cli.answer import HIDDEN, CommandResult, Paragraphs, Table
from generator.cli.inputs import load_motion, placements_of_motion
from generator.cli.options import option, output_option
from generator.cli.outputs import check_distinct_paths, check_writable, write_files
from generator.comparison.comparison import (
    THRESHOLD,
    Comparison,
    check_suffix,
    compare_motions,
    names_of_files,
)
from generator.comparison.difference import Quantity
from generator.diagnostics import Diagnostic
from generator.motion_files import FigureMotion

MAX_ROWS = 5
"""Rows of a table without `--verbose`, shared by the motions that are compared."""


class MotionSource(NamedTuple):
    """Origin of a motion that is compared."""

    name: str
    file: Path
    figure: str
    springs: str
    start_s: float
    stop_s: float
    frames: int
    message: str


@dataclass(frozen=True, kw_only=True)
class ComparisonResult(CommandResult):
    """Differences of motions from the first one."""

    motions: Sequence[MotionSource]
    start_s: float
    stop_s: float
    frames: int
    threshold_deg: float
    notes: Sequence[str]
    divergence: Mapping[str, Mapping[str, object] | None]
    differences: Sequence[Mapping[str, object]]
    files: Sequence[Path]
    comparison: Comparison = field(metadata=HIDDEN)
    lists_all: bool = field(metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return the notes, and for each motion the largest differences."""
        yield "\n".join(self.notes)
        brief = max(2, MAX_ROWS // len(self.divergence))
        count = len(self.differences) if self.lists_all else brief
        for name in self.divergence:
            yield "\n".join(self._lines(name, count))
        wrote = ", ".join(map(str, self.files)) or "nothing; -o FILE.html draws them, .csv has all"
        yield f"wrote  {wrote}"

    def _lines(self, name: str, count: int) -> Iterator[str]:
        """Yield the lines on a motion: its divergence, and a table of each quantity."""
        yield self.comparison.describe_divergence(name)
        rows: list[tuple[str, ...]] = []
        for quantity in Quantity:
            head, found = self.comparison.table(name, quantity)
            if found:
                some = count if quantity is Quantity.ANGLE else -(-count // 2)
                more = f"and {len(found) - some} more"
                rows += [head, *(cells for cells, _ in found[:some])]
                rows += [(more,)] if len(found) > some else []
        if rows:
            yield str(Table(rows))


def compare(
    motions: Annotated[
        list[Path],
        typer.Argument(
            metavar="MOTION MOTION...",
            help="Two to five motions, .npz .action .mot .sto; the first is the reference.",
        ),
    ],
    outputs: Annotated[
        list[Path] | None,
        output_option("FILE", "A page of all motions, .html, or the table, .csv; may be repeated."),
    ] = None,
    figure: Annotated[
        str | None, option("FIGURE", "Figure of the motions, if not the one named in each.")
    ] = None,
    threshold: Annotated[
        float, option("DEG", "Difference of an angle that counts as divergence [deg].")
    ] = round(degrees(THRESHOLD), 9),
    stop: Annotated[
        float | None,
        typer.Option(help="End of the comparison [s]. [default: that of the shortest motion]"),
    ] = None,
    *,
    verbose: bool = False,
) -> CommandResult:
    """Compare motions: bodies, curves, and what differs most.

    Bodies and curves are over one another in a page; each motion is compared with the first one.
    """
    files = list(outputs or ())
    check_distinct_paths(files)
    for path in files:
        check_suffix(path)
    read: list[FigureMotion] = []
    warnings: dict[Diagnostic, None] = {}
    for path in motions:
        motion, more = load_motion(path, figure)
        for _ in placements_of_motion(motion):
            pass  # which raises an error for segments that are too far away
        read.append(motion)
        warnings |= dict.fromkeys(more)
    check_writable(files, [*motions, *(one.figure.path for one in read)])
    names = names_of_files(motions)
    found = compare_motions(read, names, radians(threshold), stop)
    write_files({path: found.format(path) for path in files})
    return ComparisonResult(
        motions=[
            MotionSource(
                name,
                path,
                str(one.figure.path or one.header.figure),
                one.header.springs,
                float(one.times[0]),
                float(one.times[-1]),
                one.times.size,
                one.header.message,
            )
            for name, path, one in zip(names, motions, read, strict=True)
        ],
        start_s=float(found.times[0]),
        stop_s=float(found.times[-1]),
        frames=found.times.size,
        threshold_deg=threshold,
        notes=found.notes,
        divergence={
            name: first and {"time_s": first.divergence, "joint": first.name, "about": first.about}
            for name, first in found.divergences.items()
        },
        differences=[one.row() for one in found.differences],
        files=files,
        comparison=found,
        lists_all=verbose,
        diagnostics=tuple(warnings),
    )
