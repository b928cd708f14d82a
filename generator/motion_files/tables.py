"""A motion as a table of comma-separated values, with its header in lines that begin with `#`."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from generator.contact.record import ContactRecord, centre_of_pressure, peak_of
from generator.figure import JointAxis
from generator.kinematics.free_root import FREE_CHAINS
from generator.losses import Loss, Losses
from generator.motion_files.action import ANGLE_UNIT, LENGTH_UNIT, format_chain, format_displacement
from generator.motion_files.motion import (
    CONTACT_DEPTHS,
    CONTACT_SIZES,
    GROUND_REACTION,
    NO_FIGURE,
    FigureMotion,
    lost_props,
    motion_from_recording,
    unrepresented,
)
from generator.motion_files.skeleton import continuous_quaternions
from generator.recording import LOSS_KINDS, Recording, RecordingPart, energy_kinds
from generator.rotations import Array, matrix_from_chain_angles
from generator.text_io import format_csv_comment, format_csv_rows, write_atomic
from generator.units import ROTATION_UNITS, TRANSLATION_UNITS

_SCALES = {units.displacement: units.scale for units in (ROTATION_UNITS, TRANSLATION_UNITS)}


@dataclass(frozen=True)
class Column:
    """A column of the table of a motion.

    Attributes:
        name: name of the quantity, such as `left_knee.1`.
        unit: unit of its numbers in text.
        read: function that returns the numbers of a motion, NaN where they are undefined, shape
            (n,) [rad, m or the unit].
        part: part of the recording that has the quantity; None for what every motion has.
        may_be_undefined: whether NaN is an expected number.
        read_extreme: function that returns time and number of the largest (1) or smallest (-1) over
            all steps of a run; None for a quantity that is known in the frames only.
        is_displacement: whether it is a displacement of a joint, which has a value at rest too.
        is_constant: function that returns whether it is the same in all steps of a run, with
            `read_extreme`.
    """

    name: str
    unit: str
    read: Callable[[FigureMotion], Array]
    part: RecordingPart | None = None
    may_be_undefined: bool = False
    read_extreme: Callable[[FigureMotion, int], tuple[float, float]] | None = None
    is_displacement: bool = False
    is_constant: Callable[[FigureMotion], bool] | None = None

    @property
    def title(self) -> str:
        """Name and unit: `left_knee.1 [deg]`."""
        return f"{self.name} [{self.unit}]"

    @property
    def scale(self) -> float:
        """Number of its units in a radian, a metre or the unit."""
        return _SCALES.get(self.unit, 1.0)

    def extreme(self, motion: FigureMotion, sign: int) -> tuple[float, float] | None:
        """Return time [s] and number of the largest (1) or smallest (-1) number of a motion.

        Between frames or steps it is that of a parabola; see `peak_of`. None where the quantity is
        undefined in all frames.
        """
        if self.read_extreme is not None:
            return self.read_extreme(motion, sign)
        values = self.read(motion)
        known = ~np.isnan(values)
        return _extreme(motion.times[known], values[known], sign) if known.any() else None

    def is_same_throughout(self, motion: FigureMotion, value: float) -> bool:
        """Return whether all numbers of a motion are one value, as without a touch."""
        if self.is_constant is not None:
            return self.is_constant(motion)
        return bool(np.all(self.read(motion) == value))

    def format(self, value: float) -> str:
        """Format a number [rad, m or the unit] in the unit; blank for NaN.

        Raises ValueError for a displacement that is not finite.
        """
        if self.may_be_undefined and not isfinite(value):
            return ""
        if self.unit in (ANGLE_UNIT, LENGTH_UNIT):
            return format_displacement(value, self.unit)
        return repr(float(value))


def _extreme(times: Array, values: Array, sign: int) -> tuple[float, float]:
    time, size = peak_of(times, sign * values)
    return time, sign * size


def columns_of_motion(motion: FigureMotion) -> Iterator[Column]:
    """Yield the columns of the table of a motion."""
    run = motion.recording
    kinds = () if run is None else energy_kinds(run.energy)
    contact = None if run is None else run.contact
    return table_columns(motion.chains, kinds, () if contact is None else contact.forces)


def table_columns(
    chains: Mapping[str, Sequence[JointAxis]],
    energy_kinds: Iterable[str],
    contact_segments: Iterable[str],
) -> Iterator[Column]:
    """Yield the columns of a table: time, displacements, energies, contact.

    Args:
        chains: the factors of each joint.
        energy_kinds: kinds of energy of the run, none without a run.
        contact_segments: segments with contact spheres; none without contact.
    """
    yield Column("time", "s", lambda motion: motion.times)
    for name, chain in chains.items():
        yield from displacement_columns(name, chain)
        if tuple(chain) in FREE_CHAINS:
            for k, part in enumerate(("qw", "qx", "qy", "qz")):
                yield Column(f"{name}.{part}", "1", partial(_quaternion_part, name, k))
    for kind in energy_kinds:
        part = RecordingPart.LOSSES if kind in LOSS_KINDS else RecordingPart.ENERGY
        yield Column(kind, "J", partial(_energy, kind), part)
    yield from _contact_columns(tuple(contact_segments))


def displacement_columns(name: str, chain: Sequence[JointAxis]) -> Iterator[Column]:
    """Yield the columns `JOINT.k` of the displacements of a joint."""
    for k, factor in enumerate(chain):
        read = partial(_displacement, name, k)
        yield Column(f"{name}.{k + 1}", factor.units.displacement, read, is_displacement=True)


def _displacement(name: str, k: int, motion: FigureMotion) -> Array:
    return motion.displacements[name][:, k]


def _quaternion_part(name: str, k: int, motion: FigureMotion) -> Array:
    """Part of the unit quaternion of a free segment, scalar first."""
    axes = [factor.axis for factor in motion.chains[name][:3]]
    turned = matrix_from_chain_angles(axes, motion.displacements[name][:, :3])
    return continuous_quaternions(turned)[:, (3, 0, 1, 2)[k]]


def _energy(kind: str, motion: FigureMotion) -> Array:
    return run_of(motion).energy[kind]


def _contact_columns(segments: Sequence[str]) -> Iterator[Column]:
    """Yield the columns of contact; none without segments that touch."""
    if not segments:
        return

    def column(name: str, unit: str, read: Callable[[ContactRecord], Array]) -> Column:
        return Column(name, unit, lambda motion: read(contact_of(motion)), RecordingPart.CONTACT)

    for k, axis in enumerate("xyz"):
        force = column(f"ground_force_v{axis}", "N", partial(_ground_force, k))
        extreme = partial(_ground_force_extreme, k)
        yield replace(force, read_extreme=extreme, is_constant=partial(_is_level, extreme))
    for k, axis in ((0, "x"), (2, "z")):
        point = column(f"ground_force_p{axis}", LENGTH_UNIT, partial(_pressure_point, k))
        yield replace(point, may_be_undefined=True)
    moment = column(
        "ground_torque_y", "N m", lambda contact: centre_of_pressure(contact.ground_reaction)[1]
    )
    yield replace(moment, may_be_undefined=True)
    for name in segments:
        size = column(f"{name}.contact_force", "N", partial(_force_size, name))
        extreme, untouched = partial(_force_size_extreme, name), partial(_is_untouched, name)
        yield replace(size, read_extreme=extreme, is_constant=untouched)
    for name in segments:
        yield column(f"{name}.contact_depth", LENGTH_UNIT, partial(_depth, name))


def _ground_force(k: int, contact: ContactRecord) -> Array:
    return contact.ground_reaction[:, k]


def _ground_force_extreme(k: int, motion: FigureMotion, sign: int) -> tuple[float, float]:
    contact = contact_of(motion)
    if contact.extreme_forces is None:
        return _extreme(motion.times, contact.ground_reaction[:, k], sign)
    largest, smallest = contact.extreme_forces[k].reshape(2, 2).tolist()
    time, force = largest if sign > 0 else smallest
    return time, force


def _is_level(
    extreme: Callable[[FigureMotion, int], tuple[float, float]], motion: FigureMotion
) -> bool:
    return extreme(motion, 1)[1] == extreme(motion, -1)[1]


def _is_untouched(name: str, motion: FigureMotion) -> bool:
    return contact_of(motion).segments[name].peak_force == 0.0


def _force_size_extreme(name: str, motion: FigureMotion, sign: int) -> tuple[float, float]:
    """Return the peak of the record, or the smallest force of the frames."""
    contact = contact_of(motion)
    if sign > 0:
        return contact.segments[name].peak_time, contact.segments[name].peak_force
    return _extreme(motion.times, _force_size(name, contact), sign)


def _pressure_point(k: int, contact: ContactRecord) -> Array:
    return centre_of_pressure(contact.ground_reaction)[0][:, k]


def _force_size(name: str, contact: ContactRecord) -> Array:
    return np.linalg.norm(contact.forces[name], axis=1)


def _depth(name: str, contact: ContactRecord) -> Array:
    return contact.depths[name]


def run_of(motion: FigureMotion) -> Recording:
    """Return the run of a motion that is from one."""
    assert motion.recording is not None
    return motion.recording


def contact_of(motion: FigureMotion) -> ContactRecord:
    """Return the contact record of a motion that is from a run with props."""
    contact = run_of(motion).contact
    assert contact is not None
    return contact


if TYPE_CHECKING:
    from pandas import DataFrame  # pyright: ignore[reportMissingTypeStubs]

NO_ENERGIES = Loss("energies: the motion is not that of a run, which alone has them")


def write_csv(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion as a table of comma-separated values, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ValueError: a displacement is not finite.
    """
    write_atomic(path, format_csv(motion))
    kept = ("energies", GROUND_REACTION, CONTACT_SIZES, CONTACT_DEPTHS)
    results = unrepresented(motion, *kept) or NO_ENERGIES
    return Losses.collect("table", [NO_FIGURE, lost_props(motion), results])


def format_csv(motion: FigureMotion) -> str:
    """The text of the table: `time [s]`, each displacement `JOINT.k`, the energies of a run.

    A free segment has its orientation as a unit quaternion too, `SEGMENT.qw` to `SEGMENT.qz`, which
    is continuous and has no poles: 1, 0, 0, 0 for the orientation in the figure's file. A run with
    contact has the ground reaction, without a point below `MIN_VERTICAL_FORCE`, and for each
    segment `SEGMENT.contact_force` and `SEGMENT.contact_depth`.

    Raises ValueError for a displacement that is not finite.
    """
    return "".join(_csv_lines(motion))


def make_dataframe(data: object) -> "DataFrame":
    """Return the data frame of rows or columns. Raises ImportError without pandas."""
    try:
        from pandas import DataFrame  # pyright: ignore[reportMissingTypeStubs]
    except ImportError:
        raise ImportError(
            'a data frame needs pandas: in the project\'s folder, `pip install -e ".[notebook]"`'
        ) from None
    return DataFrame(data)


def dataframe_of_recording(recording: Recording) -> "DataFrame":
    """Return the table of a recording; see `Recording.to_dataframe`."""
    motion = motion_from_recording(recording)
    return make_dataframe(
        {
            column.title: [float(column.format(one) or "nan") for one in column.read(motion)]
            for column in columns_of_motion(motion)
        }
    )


def _csv_lines(motion: FigureMotion) -> Iterator[str]:
    yield from map(format_csv_comment, motion.header.lines())
    for name, chain in motion.chains.items():
        yield format_csv_comment(f"joint {name} {format_chain(chain)}")
    columns = list(columns_of_motion(motion))
    cells = [list(map(column.format, column.read(motion).tolist())) for column in columns]
    yield format_csv_rows([[column.title for column in columns]])
    yield from (f"{','.join(row)}\n" for row in zip(*cells, strict=True))
