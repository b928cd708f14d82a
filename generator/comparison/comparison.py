"""Comparison of motions at common times: differences of joints, touches, forces and energies.

The difference of a joint that turns about one axis is that of its displacements. That of a joint
of several rotations is the angle of the rotation `R_B R_A^T`, from the orientation of its child in
the reference to that in the other motion: it does not depend on the order of the rotations, has no
poles, and is at most 180 deg. The axis whose displacement differs most names it and gives its sign.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from importlib import import_module
from math import degrees, isfinite, pi, radians, remainder
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from generator.contact.record import ContactRecord, PartContact, SegmentContact
from generator.conversion import read_motion
from generator.diagnostics import UsageError, format_count
from generator.figure import Figure, JointAxis, is_rotation
from generator.figure_file.read import read_figure
from generator.joint_chain import build_chain
from generator.kinematics.free_root import FREE_CHAINS
from generator.losses import Loss
from generator.motion_files import FigureMotion, motion_from_recording
from generator.motion_files.columns import Column, columns_of_motion
from generator.motion_files.page import springs_of_header
from generator.motion_files.resample import resample_at
from generator.notebook import html_table
from generator.passive_curve import axis_springs
from generator.recording import Ending, Recording, energy_kinds
from generator.rotations import Array, rotation_vector_from_matrix, unit_axis
from generator.springs_file.axes import axis_label, parallel_sign
from generator.text_io import format_csv_rows, write_atomic
from springs import JointSprings, SpringSet
from springs.short_repr import short_repr

if TYPE_CHECKING:
    from pandas import DataFrame  # pyright: ignore[reportMissingTypeStubs]

THRESHOLD = radians(5.0)
"""Difference of an angle above which two motions diverge, by default [rad]."""

MAX_MOTIONS = 5
"""Motions that are compared at once; the first is the reference of the others."""

SAME_TIME = 1e-6
"""Interval below which frames of two motions are one [s]."""


Contact = PartContact | SegmentContact


class Quantity(Enum):
    """Quantity in which motions differ."""

    ANGLE = "angle"
    POSITION = "position"
    FIRST_TOUCH = "first touch"
    PEAK_FORCE = "peak force"
    ENERGY = "energy"

    @property
    def unit(self) -> str:
        """Unit of tables."""
        return _UNITS[self][0]

    @property
    def scale(self) -> float:
        """Number of these units in the SI unit."""
        return _UNITS[self][1]


_UNITS = {
    Quantity.ANGLE: ("deg", degrees(1.0)),
    Quantity.POSITION: ("cm", 100.0),
    Quantity.FIRST_TOUCH: ("s", 1.0),
    Quantity.PEAK_FORCE: ("N", 1.0),
    Quantity.ENERGY: ("J", 1.0),
}


@short_repr
@dataclass(frozen=True)
class Difference:
    """Difference of a motion from the reference in one quantity.

    Attributes:
        motion: Name of the motion.
        quantity: Kind of the quantity.
        name: Name of the joint, the part of the body, the segment or the kind of energy.
        about: Motion or axis of the joint in which the difference is largest; "" for others.
        size: Difference [rad, m, s, N or J], positive where the motion has more; of angles,
            positions and energies the largest over time. None where only one of both touches.
        reference: Value of the reference, of a joint about the axis; None without a touch.
        value: Value of the motion, likewise.
        reference_time: Time of the value of the reference [s]; None likewise.
        time: Time of the value of the motion, that of the largest difference [s].
        error: Sum of the estimated errors of both runs at this time, of an angle [rad]; None where
            they are not known.
        divergence: Time from which an angle first differs by more than the threshold [s]; None
            where it does not.
        column: Name of the column of the motion's table to look at; "" without any.
    """

    motion: str
    quantity: Quantity
    name: str
    about: str
    size: float | None
    reference: float | None
    value: float | None
    reference_time: float | None
    time: float | None
    error: float | None = None
    divergence: float | None = None
    column: str = ""

    @property
    def label(self) -> str:
        """Name and axis: `left_knee flexion`."""
        return f"{self.name} {self.about}".strip()

    def row(self) -> dict[str, str | float | None]:
        """Return the row of tables, with angles in deg, lengths in cm and times in s."""

        def shown(number: float | None) -> float | None:
            return None if number is None else self.quantity.scale * number

        return {
            "motion": self.motion,
            "quantity": self.quantity.value,
            "name": self.name,
            "about": self.about,
            "unit": self.quantity.unit,
            "reference": shown(self.reference),
            "value": shown(self.value),
            "difference": shown(self.size),
            "reference_s": self.reference_time,
            "time_s": self.time,
            "error": shown(self.error),
            "divergence_s": self.divergence,
            "column": self.column,
        }


class Divergence(NamedTuple):
    """Time from which a joint of a motion first differs by more than the threshold.

    Attributes:
        time: Time [s].
        joint: Name of the joint.
        about: Motion or axis of its largest difference.
    """

    time: float
    joint: str
    about: str


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

    def of(self, motion: str, quantity: Quantity) -> tuple[Difference, ...]:
        """Return the differences of a motion in a quantity, in their order."""
        return tuple(
            one for one in self.differences if one.motion == motion and one.quantity is quantity
        )

    @property
    def divergences(self) -> Mapping[str, Divergence | None]:
        """Return the first divergence of each motion from the reference, None without any."""
        found: dict[str, Divergence | None] = {}
        for name in self.names[1:]:
            times = [
                Divergence(one.divergence, one.name, one.about)
                for one in self.of(name, Quantity.ANGLE)
                if one.divergence is not None
            ]
            found[name] = min(times, key=lambda each: each.time, default=None)
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
                if joint not in first or _are_comparable(first[joint], chain)
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
        try:
            from pandas import DataFrame  # pyright: ignore[reportMissingTypeStubs]
        except ImportError:
            raise ImportError(
                "a data frame needs pandas: pip install 'exudyn-mover[notebook]'"
            ) from None
        return DataFrame([one.row() for one in self.differences])

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
            return self._csv()
        # By name: the page reads comparisons, so it is above.
        return import_module("generator.comparison.page").format_comparison(self)

    def _csv(self) -> str:
        rows = [one.row() for one in self.differences]
        cells = [["" if cell is None else str(cell) for cell in row.values()] for row in rows]
        return "".join(format_csv_rows([list(rows[0]), *cells])) if rows else ""

    def _repr_html_(self) -> str:
        """Table of the differences, for notebooks."""
        rows = [one.row() for one in self.differences]
        cells = (
            [f"{c:.4g}" if isinstance(c, float) else c or "" for c in r.values()] for r in rows
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
        raise UsageError(f"{count}: two to {MAX_MOTIONS} can be compared")
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
        pair = _Pair(name, (motions[0], motion), (aligned[0], moved), times, threshold)
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
    return np.append(kept[:-1], every[-1])


def _notes_on_times(
    motions: Sequence[FigureMotion], names: Sequence[str], times: Array
) -> Iterator[str]:
    """Yield the sentences about the times of a comparison."""
    both = tuple(zip(names, motions, strict=True))
    moved = [name for name, one in both if not np.all(np.isin(times, one.times))]
    how = f"; interpolated to the frames of all: {', '.join(moved)}" if moved else ""
    yield f"{times[0]:g} to {times[-1]:g} s, {format_count(times.size, 'frame')}{how}."
    for name, one in both:
        if one.times[0] < times[0] or one.times[-1] > times[-1]:
            yield f"{name} has {one.times[0]:g} to {one.times[-1]:g} s; the rest is left out."


@dataclass(frozen=True)
class _Pair:
    """Reference and another motion.

    Attributes:
        name: Name of the other motion.
        motions: Both as they were read.
        aligned: Both at the common times.
        times: Common times, shape (n,) [s].
        threshold: Difference of an angle above which they diverge [rad].
    """

    name: str
    motions: tuple[FigureMotion, FigureMotion]
    aligned: tuple[FigureMotion, FigureMotion]
    times: Array
    threshold: float

    def differences(self) -> Iterator[Difference]:
        """Yield the differences, the largest first in each quantity. Raises UsageError."""
        if not self._common_joints:
            raise UsageError(f"{self.name} has no joint in common with the reference")
        every = [*self._of_joints(), *self._of_contact(), *self._of_energies()]
        for quantity in Quantity:
            yield from sorted((one for one in every if one.quantity is quantity), key=_rank)

    def notes(self, reference: str) -> Iterator[str]:
        """Yield the sentences about what was left out, and the sensitivity of the runs."""
        of_both = tuple(zip((reference, self.name), self.motions, strict=True))
        for name, motion in of_both:
            left = tuple(one for one in motion.chains if one not in self._common_joints)
            if left:
                loss = Loss(f"Left out, joints of {name} that the other has not as such", left)
                yield f"{loss}."
        if self._peaks_outside:
            loss = Loss("Left out, peaks of forces at other times", self._peaks_outside)
            yield f"{loss}."
        for name, motion in of_both:
            contact = None if motion.recording is None else motion.recording.contact
            chaotic = contact.chaotic_from(motion.times) if contact else None
            if chaotic is not None and chaotic < self.times[-1]:
                since = f"Poses of {name} are chaotic from {chaotic:.3g} s"
                yield f"{since}: later differences of angles are partly chance."
            if motion.header.outcome is not Ending.DONE:
                yield f"{name}: {motion.header.message}"

    @cached_property
    def _common_joints(self) -> tuple[str, ...]:
        """Moving joints of both whose displacements can be compared."""
        first, other = (one.chains for one in self.motions)
        common = (name for name, chain in first.items() if chain and name in other)
        return tuple(name for name in common if _are_comparable(first[name], other[name]))

    @cached_property
    def _springs(self) -> SpringSet | None:
        """Springs of the first motion that has some which are known; they name the axes."""
        of_both = (one.springs or springs_of_header(one.header, one.figure) for one in self.motions)
        return next((one for one in of_both if one is not None and one.joints), None)

    def _of_joints(self) -> Iterator[Difference]:
        """Yield the largest difference of each joint in angle, and in position."""
        for joint in self._common_joints:
            chain = build_chain(self.aligned[0].chains[joint])
            first, other = (one.displacements[joint] for one in self.aligned)
            poses = chain.pose(first), chain.pose(other)
            turns, slides = list(chain.rotations), list(chain.translations)
            if turns:
                sizes = np.abs(other[:, turns[0]] - first[:, turns[0]])
                if len(turns) > 1:
                    relative = poses[1][:, :3, :3] @ np.swapaxes(poses[0][:, :3, :3], 1, 2)
                    sizes = np.linalg.norm(rotation_vector_from_matrix(relative), axis=1)
                yield self._largest(Quantity.ANGLE, joint, turns, sizes)
            if slides:
                sizes = np.linalg.norm(poses[1][:, :3, 3] - poses[0][:, :3, 3], axis=1)
                if len(slides) == 1:
                    sizes = np.abs(other[:, slides[0]] - first[:, slides[0]])
                yield self._largest(Quantity.POSITION, joint, slides, sizes)

    def _largest(
        self, quantity: Quantity, joint: str, axes: Sequence[int], sizes: Array
    ) -> Difference:
        """Return the largest of the differences of a joint.

        Args:
            quantity: Angle or position.
            joint: Name of the joint.
            axes: Indices of its rotations or translations, one of which names the difference.
            sizes: Sizes of the differences, shape (n,) [rad or m].
        """
        k = int(np.argmax(sizes))
        first, other = (one.displacements[joint][k] for one in self.aligned)
        steps = [float(other[axis] - first[axis]) for axis in axes]
        if len(axes) > 1 and quantity is Quantity.ANGLE:
            steps = [remainder(step, 2.0 * pi) for step in steps]
        step, axis = max(zip(steps, axes, strict=True), key=lambda pair: abs(pair[0]))
        about, sense = self._axis_name(joint, axis)
        time, is_angle = float(self.times[k]), quantity is Quantity.ANGLE
        return Difference(
            self.name,
            quantity,
            joint,
            about,
            float(np.copysign(sizes[k], sense * step)) if sizes[k] else 0.0,
            sense * float(first[axis]) + 0.0,
            sense * float(other[axis]) + 0.0,
            time,
            time,
            self._error(time) if is_angle else None,
            first_crossing(self.times, sizes, self.threshold) if is_angle else None,
            f"{joint}.{axis + 1}",
        )

    def _axis_name(self, joint: str, axis: int) -> tuple[str, int]:
        """Return the motion of an axis of a joint that springs name, and its sense; or the axis."""
        factor = self.aligned[0].chains[joint][axis]
        direction, springs = unit_axis(factor.axis), self._springs
        if springs is not None:
            own = springs.joints.get(joint, JointSprings(joint))
            turning = (*own.axes, *axis_springs(springs, joint))
            for spring in turning if is_rotation(factor.kind) else own.translations:
                sense = parallel_sign(spring.direction, direction)
                if sense and spring.motion:
                    return spring.motion, sense
        return f"{factor.units.preposition} {axis_label(direction)}", 1

    def _error(self, time: float) -> float | None:
        """Return the sum of the estimated errors of both runs at a time [rad]."""
        total = 0.0
        for motion in self.motions:
            run = motion.recording
            if run is None or run.accuracy.tolerance is None:
                return None
            total += float(np.interp(time, motion.times, run.accuracy.by_frame))
        return total if isfinite(total) else None

    @cached_property
    def _records(self) -> tuple[ContactRecord, ContactRecord] | None:
        """Contact of both runs, None where one has none."""
        first, other = (one.recording.contact if one.recording else None for one in self.motions)
        return None if first is None or other is None else (first, other)

    @cached_property
    def _contacts(self) -> dict[str, tuple[Contact, Contact]]:
        """Contact of both of each part of the body, or of each segment where one has no parts."""
        if self._records is None:
            return {}
        first, other = self._records
        if first.parts and other.parts:
            return {k: (first.parts[k], other.parts[k]) for k in first.parts if k in other.parts}
        common = (name for name in first.segments if name in other.segments)
        return {name: (first.segments[name], other.segments[name]) for name in common}

    @cached_property
    def _peaks_outside(self) -> tuple[str, ...]:
        """Parts or segments with the peak of a force at another time than the common one."""
        return tuple(
            name
            for name, both in self._contacts.items()
            if not all(self._is_inside(one.peak_time) for one in both if one.peak_force)
        )

    def _is_inside(self, time: float) -> bool:
        return bool(self.times[0] <= time <= self.times[-1])

    def _of_contact(self) -> Iterator[Difference]:
        """Yield the differences of first touches, and of peaks of forces over all steps."""
        for name, (first, other) in self._contacts.items():
            column = f"{name}.contact_force"
            column = column if self._records and name in self._records[0].forces else ""
            before, after = (
                time if time is not None and time <= self.times[-1] else None
                for time in (first.first_time, other.first_time)
            )
            if before is not None or after is not None:
                size = None if before is None or after is None else after - before
                yield Difference(
                    self.name, Quantity.FIRST_TOUCH, name, "", size, before, after, before, after,
                    column=column,
                )  # fmt: skip
            if name not in self._peaks_outside and (first.peak_force or other.peak_force):
                yield Difference(
                    self.name,
                    Quantity.PEAK_FORCE,
                    name,
                    "",
                    other.peak_force - first.peak_force,
                    first.peak_force,
                    other.peak_force,
                    first.peak_time if first.peak_force else None,
                    other.peak_time if other.peak_force else None,
                    column=column,
                )

    def _of_energies(self) -> Iterator[Difference]:
        """Yield the largest difference over time of each kind of energy of both runs."""
        runs = [one.recording for one in self.motions]
        if runs[0] is None or runs[1] is None:
            return
        first, other = runs[0].energy, runs[1].energy
        for kind in energy_kinds(first):
            if kind not in other or not (np.any(first[kind]) or np.any(other[kind])):
                continue
            before, after = (
                np.interp(self.times, motion.times, energy[kind])
                for motion, energy in zip(self.motions, (first, other), strict=True)
            )
            k = int(np.argmax(np.abs(after - before)))
            time, values = float(self.times[k]), (float(before[k]), float(after[k]))
            size = values[1] - values[0]
            yield Difference(
                self.name, Quantity.ENERGY, kind, "", size, *values, time, time, column=kind
            )


def _rank(difference: Difference) -> float:
    """Key that sorts differences by size, touches by the time of the earlier one."""
    if difference.quantity is Quantity.FIRST_TOUCH:
        both = (difference.reference, difference.value)
        return min(time for time in both if time is not None)
    return -abs(difference.size or 0.0)


def _are_comparable(chain: Sequence[JointAxis], other: Sequence[JointAxis]) -> bool:
    """Return whether joints have the same axes, or both let a segment free."""
    if len(chain) != len(other):
        return False
    if tuple(chain) in FREE_CHAINS and tuple(other) in FREE_CHAINS:
        return True
    return all(
        one.kind is two.kind and parallel_sign(unit_axis(one.axis), unit_axis(two.axis)) == 1
        for one, two in zip(chain, other, strict=True)
    )


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


def first_crossing(times: Array, sizes: Array, threshold: float) -> float | None:
    """Return the time from which a size first exceeds a threshold; None where it never does.

    Between frames it is interpolated linearly.

    Args:
        times: Times, shape (n,) [s].
        sizes: Sizes, shape (n,).
        threshold: Threshold, in the unit of the sizes.
    """
    above = np.flatnonzero(sizes > threshold)
    if not above.size:
        return None
    k = int(above[0])
    if k == 0:
        return float(times[0])
    share = (threshold - sizes[k - 1]) / (sizes[k] - sizes[k - 1])
    return float(times[k - 1] + share * (times[k] - times[k - 1]))
