"""`mover compare`: motions over one another, and what differs most between them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import degrees, radians
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from generator.cli.answer import HIDDEN, CommandResult, Paragraphs, Table
from generator.cli.inputs import load_motion, placements_of_motion
from generator.cli.outputs import check_distinct_paths, check_writable, write_files
from generator.comparison.comparison import (
    THRESHOLD,
    Comparison,
    Difference,
    Quantity,
    check_suffix,
    compare_motions,
    names_of_files,
)
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
        reference = self.motions[0].name
        first, limit = self.comparison.divergences[name], f"{self.threshold_deg:g} deg"
        if first is None:
            yield f"{name} against {reference}: no joint differs by more than {limit}"
        else:
            angle = f"{first.joint} {first.about}"
            yield (
                f"{name} against {reference}: more than {limit} apart from {first.time:.3g} s on, "
                f"first {angle}"
            )
        titles = reference, name, "differs"
        over = f"{limit} from"
        rows: list[tuple[str, ...]] = []
        tables = (
            (Quantity.ANGLE, ("angle [deg]", *titles, "at [s]", over), _angle_cells),
            (Quantity.POSITION, ("position [cm]", *titles, "at [s]"), _value_cells),
            (Quantity.PEAK_FORCE, ("peak force [N]", *titles, "at [s]"), _value_cells),
            (Quantity.FIRST_TOUCH, ("first touch [s]", *titles), _touch_cells),
            (Quantity.ENERGY, ("energy [J]", *titles, "at [s]"), _value_cells),
        )
        for quantity, head, cells in tables:
            differing = (one for one in self.comparison.of(name, quantity) if one.size != 0.0)
            found = _merge_sides([(one.label, *cells(one)) for one in differing])
            if found:
                some = count if quantity is Quantity.ANGLE else -(-count // 2)
                more = f"and {len(found) - some} more"
                rows += [head, *found[:some], *([(more,)] if len(found) > some else [])]
        if rows:
            yield str(Table(rows))


def _angle_cells(one: Difference) -> tuple[str, ...]:
    """Return the cells of an angle; one within the estimated errors has a mark."""
    cells = list(_value_cells(one))
    if one.size and one.error is not None and abs(one.size) <= one.error:
        cells[2] = f"~{cells[2]}"
    return (*cells, "" if one.divergence is None else f"{one.divergence:.3f}")


def _value_cells(one: Difference) -> tuple[str, ...]:
    """Return the values of both, their difference and its time."""
    numbers = (one.reference, one.value, one.size)
    cells = ("" if each is None else f"{each * one.quantity.scale:.1f}" for each in numbers)
    time = one.reference_time if one.time is None else one.time
    return (*cells, "" if time is None else f"{time:.3f}")


def _touch_cells(one: Difference) -> tuple[str, ...]:
    """Return the times of both and their difference; "never" without a touch."""
    first, other = (
        "never" if each is None else f"{each:.3f}" for each in (one.reference, one.value)
    )
    return first, other, "" if one.size is None else f"{one.size:+.3f}"


def _merge_sides(rows: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """Return the rows of a table in which those of both sides are one where they are equal."""
    merged: list[tuple[str, ...]] = []
    for row in rows:
        last = merged[-1] if merged else ("",)
        plain = row[0].removeprefix("left_").removeprefix("right_")
        sides = {last[0].removesuffix(plain), row[0].removesuffix(plain)}
        if sides == {"left_", "right_"} and last[1:] == row[1:]:
            merged[-1] = (f"left/right_{plain}", *row[1:])
        else:
            merged.append(row)
    return merged


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
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="A page of all motions, .html, or the table, .csv; may be repeated.",
        ),
    ] = None,
    figure: Annotated[
        str | None,
        typer.Option(metavar="FIGURE", help="Figure of the motions, if not the one named in each."),
    ] = None,
    threshold: Annotated[
        float,
        typer.Option(metavar="DEG", help="Difference of an angle that counts as divergence [deg]."),
    ] = round(degrees(THRESHOLD), 9),
    stop: Annotated[
        float | None,
        typer.Option(help="End of the comparison [s]. [default: that of the shortest motion]"),
    ] = None,
    *,
    verbose: bool = False,
) -> CommandResult:
    """Compare motions: bodies and curves over one another, and a table of what differs most."""
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
            name: None
            if first is None
            else {"time_s": first.time, "joint": first.joint, "about": first.about}
            for name, first in found.divergences.items()
        },
        differences=[one.row() for one in found.differences],
        files=files,
        comparison=found,
        lists_all=verbose,
        diagnostics=tuple(warnings),
    )
