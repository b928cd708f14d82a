"""Comparison of motions at common times: what differs most, and from when on."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from math import degrees, isfinite, radians
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from generator.comparison.difference import Difference, Quantity
from generator.comparison.pair import Pair, are_comparable
from generator.conversion import read_motion
from generator.diagnostics import UsageError, format_count
from generator.figure import Figure
from generator.figure_file.read import read_figure
from generator.joint_chain import build_chain
from generator.kinematics.free_root import FREE_CHAINS
from generator.motion_files import FigureMotion, motion_from_recording
from generator.motion_files.resample import resample_at
from generator.motion_files.tables import Column, columns_of_motion, make_dataframe
from generator.notebook import PageView, html_table
from generator.recording import Recording
from generator.rotations import Array
from generator.text_io import format_csv_rows, write_atomic
from springs.short_repr import short_repr

if TYPE_CHECKING:
    from pandas import DataFrame  # pyright: ignore[reportMissingTypeStubs]

THRESHOLD = radians(5.0)
"""Difference of an angle above which two motions diverge, by default [rad]."""

MAX_MOTIONS = 5
"""Motions that are compared at once; the first is the reference of the others."""

SAME_TIME = 1e-6
"""Interval below which frames of two motions are one [s]."""

TableRow = tuple[tuple[str, ...], Difference]
"""Cells of a row for people, and the difference that it shows, of both sides that of one."""


class Curve(NamedTuple):
    """Column of the tables of motions, at the times of a comparison.

    Attributes:
        column: Column.
        values: Numbers of each motion that has the column, shape (n,) [rad, m or the unit].
    """

    column: Column
    values: Mapping[str, Array]


@short_repr
@dataclass(frozen=True, eq=False)
class Comparison:
    """Motions at common times, and their differences from the first one, the reference.

    Attributes:
        names: Names of the motions, the reference first.
        motions: Motions as they were read.
        times: Common times, shape (n,) [s].
        aligned: Motions at these times; one with other frames is interpolated, without its run.
        threshold: Difference of an angle above which motions diverge [rad].
        differences: Differences of each quantity, the largest first, touches by time.
        notes: Sentences about what was compared and how far it can be trusted.
    """

    names: tuple[str, ...]
    motions: tuple[FigureMotion, ...]
    times: Array
    aligned: tuple[FigureMotion, ...]
    threshold: float
    differences: tuple[Difference, ...]
    notes: tuple[str, ...]

    def of(self, motion: str, quantity: Quantity | str) -> tuple[Difference, ...]:
        """Return the differences of a motion in a quantity, such as `"angle"`, in their order."""
        kind = Quantity(quantity)
        return tuple(
            one for one in self.differences if one.motion == motion and one.quantity is kind
        )

    def table(self, motion: str, quantity: Quantity) -> tuple[tuple[str, ...], list[TableRow]]:
        """Return the headings and the rows of the table of a motion and a quantity, for people.

        Without what does not differ; rows of both sides of the body are one where they are equal.
        """
        head = f"{quantity.value} [{quantity.unit}]", self.names[0], motion, "differs"
        if quantity is not Quantity.FIRST_TOUCH:
            head = *head, "at [s]"
        if quantity is Quantity.ANGLE:
            head = *head, f"{degrees(self.threshold):g} deg from"
        rows: list[TableRow] = []
        for one in self.of(motion, quantity):
            cells = (one.label, *one.cells())
            last = rows[-1][0] if rows else ("",)
            plain = one.label.removeprefix("left_").removeprefix("right_")
            sides = {last[0].removesuffix(plain), one.label.removesuffix(plain)}
            if sides == {"left_", "right_"} and last[1:] == cells[1:]:
                rows[-1] = (f"left/right_{plain}", *cells[1:]), one
            elif one.size != 0.0:
                rows.append((cells, one))
        return head, rows

    def describe_divergence(self, motion: str) -> str:
        """Return from when on a motion differs from the reference, as a sentence.

        Both sides of the body are named where they are equal, as in the table of angles.
        """
        first, limit = self.divergences[motion], f"{degrees(self.threshold):g} deg"
        opening = f"{motion} against {self.names[0]}"
        if first is None:
            return f"{opening}: no joint differs by more than {limit}"
        since = f"more than {limit} apart from {first.divergence:.3g} s on"
        both = f"left/right_{first.label.removeprefix('left_').removeprefix('right_')}"
        listed = {cells[0] for cells, _ in self.table(motion, Quantity.ANGLE)[1]}
        return f"{opening}: {since}, first {both if both in listed else first.label}"

    @property
    def divergences(self) -> Mapping[str, Difference | None]:
        """Return the angle of each motion that diverges first from the reference, None without."""
        found: dict[str, Difference | None] = {}
        for name in self.names[1:]:
            late = [one for one in self.of(name, Quantity.ANGLE) if one.divergence is not None]
            found[name] = min(late, key=lambda one: one.divergence or 0.0, default=None)
        return found

    @cached_property
    def curves(self) -> Mapping[str, Curve]:
        """Return the columns that the motions have, by name, at the common times.

        Displacements are interpolated with their rates, the results of runs linearly.
        """
        found: dict[str, Curve] = {}
        first = self.aligned[0].chains
        for name, motion, aligned in zip(self.names, self.motions, self.aligned, strict=True):
            chains = {
                joint: chain
                for joint, chain in aligned.chains.items()
                if joint not in first or are_comparable(first[joint], chain)
            }
            columns = columns_of_motion(replace(motion, chains=chains))
            for column in columns:
                if column.name == "time":
                    continue
                if column.part is None:
                    values = column.read(aligned)
                else:
                    values = np.interp(self.times, motion.times, column.read(motion))
                curve = found.setdefault(column.name, Curve(column, {}))
                found[column.name] = Curve(curve.column, {**curve.values, name: values})
        return found

    def to_dataframe(self) -> "DataFrame":
        """Return the table of differences: a row each, units in the column `unit`.

        Raises:
            ImportError: pandas is not installed.
        """
        return make_dataframe([one.row() for one in self.differences])

    def write(self, path: str | Path) -> None:
        """Write the comparison, whole or not at all: a page `.html`, or its table `.csv`.

        Raises:
            UsageError: The suffix is another one.
            OSError: The file cannot be written.
            MoverError: A motion cannot be drawn.
        """
        write_atomic(Path(path), self.format(Path(path)))

    def format(self, path: Path) -> str:
        """Return the text of a file, in the format of its suffix; raises as `write`."""
        check_suffix(path)
        if path.suffix.lower() == ".csv":
            rows = [one.row() for one in self.differences]
            return format_csv_rows([rows[0], *(row.values() for row in rows)])
        # By name: the page reads comparisons, so it is above.
        return import_module("generator.comparison.page").format_comparison(self)

    def view(self, height: int = 700) -> PageView:
        """Return the page of the comparison, for the cell of a notebook; see `Recording.view`.

        Args:
            height: Height of the cell [px].
        """
        return PageView(self.format(Path("compare.html")), height)

    def _repr_html_(self) -> str:
        """Table of the differences, for notebooks."""
        rows = [one.row() for one in self.differences]
        cells = (
            [f"{one:.4g}" if isinstance(one, float) else one or "" for one in row.values()]
            for row in rows
        )
        return html_table(" ".join(self.notes), list(rows[0]) if rows else [], cells)


SUFFIXES = (".html", ".csv")
"""Suffixes of files to which a comparison is written."""


def check_suffix(path: Path) -> None:
    """Raise UsageError unless a comparison can be written to a file of this suffix."""
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"{path}: a comparison is written as {' or '.join(SUFFIXES)}")


def compare(
    *motions: str | Path | Recording,
    names: Sequence[str] = (),
    figure: str | Path | Figure | None = None,
    threshold: float = THRESHOLD,
    stop: float | None = None,
) -> Comparison:
    """Compare motions with the first one.

    Args:
        motions: Recordings, or paths of motions (`.action .npz .mot .sto`), two to five.
        names: Names of the motions [default: those of the files; A, B, C ... of recordings].
        figure: Figure of motions from files [default: the one that each file names].
        threshold: Difference of an angle above which motions diverge [rad].
        stop: End of the comparison [s] [default: the end of the shortest motion].

    Raises:
        UsageError: Number, names or times of the motions cannot be compared, or no joint is common.
        InputError: A file cannot be read or is wrong.
        ModelError: A motion is of another figure, or a recording has none.
    """
    if isinstance(figure, str | Path):
        figure = read_figure(str(figure))
    read = [
        motion_from_recording(one, None if one.model is not None else figure)
        if isinstance(one, Recording)
        else read_motion(Path(one), figure)
        for one in motions
    ]
    if not names:
        letters = "ABCDE"
        files = [one for one in motions if not isinstance(one, Recording)]
        of_files = iter(names_of_files([Path(one) for one in files]))
        names = [
            letters[k] if isinstance(one, Recording) else next(of_files)
            for k, one in enumerate(motions[:MAX_MOTIONS])
        ]
    return compare_motions(read, names, threshold, stop)


def names_of_files(paths: Sequence[Path]) -> list[str]:
    """Return names of motions: those of their files, or their paths, or with numbers."""
    stems = [path.stem for path in paths]
    if len(set(stems)) == len(stems):
        return stems
    whole = [str(path) for path in paths]
    if len(set(whole)) == len(whole):
        return whole
    return [f"{name} ({k + 1})" for k, name in enumerate(stems)]


def compare_motions(
    motions: Sequence[FigureMotion],
    names: Sequence[str],
    threshold: float = THRESHOLD,
    stop: float | None = None,
) -> Comparison:
    """Compare motions with the first one; raises as `compare`."""
    if not 2 <= len(motions) <= MAX_MOTIONS:
        count = format_count(len(motions), "motion")
        raise UsageError(f"{count}: 2 to {MAX_MOTIONS} can be compared")
    if len(names) != len(motions) or len(set(names)) != len(names):
        raise UsageError(f"names {', '.join(names)}: each motion needs one of its own")
    if not (isfinite(threshold) and threshold > 0.0):
        raise UsageError(f"a threshold of {degrees(threshold):g} deg: it must be positive")
    times = _common_times(motions, names, stop)
    frames = [
        one if np.array_equal(one.times, times) else resample_at(one, times) for one in motions
    ]
    aligned = tuple(_with_free_chains_of(frames[0], one) for one in frames)
    found: list[Difference] = []
    notes = list(_notes_on_times(motions, names, times))
    for name, motion, moved in zip(names[1:], motions[1:], aligned[1:], strict=True):
        pair = Pair(name, (motions[0], motion), (aligned[0], moved), times, threshold)
        found += pair.differences()
        notes += pair.notes(names[0])
    return Comparison(
        tuple(names),
        tuple(motions),
        times,
        aligned,
        threshold,
        tuple(found),
        tuple(dict.fromkeys(notes)),
    )


def _common_times(
    motions: Sequence[FigureMotion], names: Sequence[str], stop: float | None
) -> Array:
    """Return the times of all frames within the time that the motions have in common."""
    begin = max(float(one.times[0]) for one in motions)
    end = min(float(one.times[-1]) for one in motions)
    if end < begin:
        both = zip(names, motions, strict=True)
        spans = ", ".join(f"{name} {one.times[0]:g} to {one.times[-1]:g} s" for name, one in both)
        raise UsageError(f"the motions have no time in common: {spans}")
    if stop is not None:
        if not stop > begin:
            raise UsageError(f"a stop at {stop:g} s: the motions begin at {begin:g} s")
        end = min(end, stop)
    first = motions[0].times
    if end == first[-1] and all(np.array_equal(one.times, first) for one in motions):
        return first
    every = np.unique(np.concatenate([[end], *(one.times for one in motions)]))
    every = every[(every >= begin) & (every <= end)]
    kept = every[np.concatenate([[True], np.diff(every) > SAME_TIME])]
    return np.unique(np.append(kept[: max(kept.size - 1, 1)], every[-1]))


def _has_frames(own: Array, times: Array) -> bool:
    """Return whether each time is that of a frame, except for rounding."""
    places = np.searchsorted(own, times - SAME_TIME).clip(max=len(own) - 1)
    return bool(np.all(np.abs(own[places] - times) <= SAME_TIME))


def _notes_on_times(
    motions: Sequence[FigureMotion], names: Sequence[str], times: Array
) -> Iterator[str]:
    """Yield the sentences about the times of a comparison."""
    both = tuple(zip(names, motions, strict=True))
    moved = [name for name, one in both if not _has_frames(one.times, times)]
    how = f"; interpolated to the frames of all: {', '.join(moved)}" if moved else ""
    yield f"{times[0]:g} to {times[-1]:g} s, {format_count(times.size, 'frame')}{how}."
    for name, one in both:
        if one.times[0] < times[0] - SAME_TIME or one.times[-1] > times[-1] + SAME_TIME:
            yield f"{name} has {one.times[0]:g} to {one.times[-1]:g} s; the rest is left out."


def _with_free_chains_of(reference: FigureMotion, motion: FigureMotion) -> FigureMotion:
    """Return a motion whose free segments have the rotation sequences of a reference."""
    chains, moved = dict(motion.chains), dict(motion.displacements)
    for name, chain in motion.chains.items():
        wanted = tuple(reference.chains.get(name, ()))
        if wanted != tuple(chain) and wanted in FREE_CHAINS and tuple(chain) in FREE_CHAINS:
            poses = build_chain(chain).pose(moved[name])
            first = reference.displacements[name][0]
            chains[name] = wanted
            moved[name] = build_chain(wanted).continuous_displacements(poses, first)
    return replace(motion, chains=chains, displacements=moved)
