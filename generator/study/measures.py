"""Measures of a run: one number each from a column of its motion.

A column is one of the table of the motion, or one of a few more:

    centre_of_mass_height [cm]      against gravity, from the world's origin
    JOINT.passive_torque [N m]      magnitude of the torque of the joint's springs and damping
    JOINT.reaction_force [N]        magnitude of the force that the joint transmits
    JOINT.reaction_moment [N m]     magnitude of the moment that the joint transmits
    SEGMENT.first_touch [s]         time at which the segment first touches a prop
    SEGMENT.impact_speed [m/s]      normal speed of that touch
    SEGMENT.injury_criterion [1]    head injury criterion of the whole run, of a body with parts
    SEGMENT.peak_acceleration [g]   largest acceleration of the centre of mass, for heads
    part.PART.first_touch [s]       time at which the part of the body first touches a prop
    part.PART.impact_speed [m/s]    normal speed of that touch
    part.PART.peak_force [N]        largest size of the force on the part
    hold.use [1]                    of the posture at the start, held at rest: take = "start"

The largest and the smallest number are those of a parabola through the frame and its neighbours.
Those of ground forces, and the largest contact force of a segment, are over all steps of the run,
since a peak of contact is shorter than a frame; contact depths are from the frames. The columns
from first_touch on are one number of the whole run, and without a touch there is none. The head
injury criterion depends on the assumed stiffness: compare runs of one model only.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from math import nan
from typing import TypeVar, assert_never

import numpy as np

from generator.contact.record import head_segments
from generator.contact_file.parts import BodyContact
from generator.diagnostics import ModelError, shorten, spelling_hint
from generator.figure import Figure, JointAxis, Vector
from generator.motion_files.action import LENGTH_UNIT
from generator.motion_files.motion import FigureMotion
from generator.motion_files.tables import (
    Column,
    contact_of,
    displacement_columns,
    run_of,
    table_columns,
)
from generator.recording import CONTACT_ENERGY_KINDS, ENERGY_KINDS, RecordingPart
from generator.rotations import Array
from generator.simulation.muscle_tone import body_of
from generator.simulation.plan import Plan
from generator.study.held_posture import HELD_COLUMNS
from generator.study.study import Measure, Statistic, Study

Measured = dict[str, float | None]
"""Numbers by measure, in the unit of the column; None where the run has no such number."""

T = TypeVar("T")

_TOUCH, _SPEED, _FORCE = ".first_touch", ".impact_speed", ".peak_force"
_WEIGHTS = ".body_weights"
_INJURY, _ACCELERATION = ".injury_criterion", ".peak_acceleration"
_SINGLE = (_TOUCH, _SPEED, _FORCE, _WEIGHTS, _INJURY, _ACCELERATION)
"""Ends of the names of columns that are one number of the whole run."""

NOT_MOVING = (Statistic.REST, Statistic.START)
"""Numbers for which nothing is simulated."""

_PART = "part."
"""Beginning of the names of columns of a part of the body."""


@dataclass(frozen=True)
class MeasureFault:
    """A measure that no run has.

    Attributes:
        measure: its name.
        key: of the entry that is wrong, "column" or "take".
        message: the error.
        hint: the correction.
    """

    measure: str
    key: str
    message: str
    hint: str


def check_measures(study: Study) -> Iterator[MeasureFault]:
    """Yield the faults of the measures of a study.

    Raises MoverError for a figure and a plan that cannot start.
    """
    columns = motion_columns(study.model.figure, study.plan, study.model.contact)
    is_person = body_of(study.model.figure) is not None
    for measure in study.measures.values():
        if measure.column in HELD_COLUMNS or measure.take is Statistic.START:
            fault = _held_fault(measure, is_person=is_person)
            if fault is not None:
                yield fault
            continue
        column = columns.get(measure.column)
        if column is None:
            message = f"the motion has no column `{shorten(measure.column)}`"
            hint = spelling_hint(measure.column, [*columns, *HELD_COLUMNS])
            yield MeasureFault(measure.name, "column", message, hint)
        elif (fault := _take_fault(column, measure)) is not None:
            yield fault


def _held_fault(measure: Measure, *, is_person: bool) -> MeasureFault | None:
    """Return the fault of a measure of the posture at the start; None without one."""
    if measure.column not in HELD_COLUMNS:
        message = f"`{shorten(measure.column)}` is not a demand of the posture at the start"
        return MeasureFault(measure.name, "take", message, f"these are {', '.join(HELD_COLUMNS)}")
    if measure.take is not Statistic.START:
        message = f"`{measure.column}` is a number of the posture at the start"
        return MeasureFault(measure.name, "take", message, f'take = "{Statistic.START}"')
    if not is_person:
        message = f"`{measure.column}` needs a figure with sex and stature"
        return MeasureFault(measure.name, "column", message, "`mover person` makes one")
    return None


def _take_fault(column: Column, measure: Measure) -> MeasureFault | None:
    """Return the fault of a number that a column does not have; None for others."""
    if measure.take is Statistic.REST and not column.is_displacement:
        message = f"`{column.title}` has no value at rest"
        return MeasureFault(measure.name, "take", message, "a displacement of a joint has one")
    if column.name.endswith(_SINGLE) and measure.take not in (Statistic.LAST, Statistic.LARGEST):
        message = f"`{column.title}` is one number of the whole run"
        return MeasureFault(measure.name, "take", message, f'take = "{Statistic.LAST}"')
    return None


def parts_of_measures(
    figure: Figure, measures: Iterable[Measure], body: BodyContact | None = None
) -> frozenset[RecordingPart]:
    """Return the parts of a recording that measures of a figure, and of its parts, need."""
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    columns = _columns_by_title(chains, figure.bodies, parts=_part_names(body))
    parts = (_part(columns[each.column], each.take) for each in measures if each.column in columns)
    return frozenset(part for part in parts if part is not None)


def _part(column: Column, take: Statistic) -> RecordingPart | None:
    """Return the part of a recording that a number of a column needs; None for the motion."""
    is_largest = take in (Statistic.LARGEST, Statistic.TIME_OF_LARGEST)
    return RecordingPart.CONTACT_STEPS if column.read_extreme and is_largest else column.part


def _part_names(body: BodyContact | None) -> tuple[str, ...]:
    return () if body is None else tuple(part.name for part in body.parts)


def motion_columns(
    figure: Figure, plan: Plan, body: BodyContact | None = None
) -> dict[str, Column]:
    """Return the columns that measures of a run may have by title, without simulating.

    Args:
        figure: Figure of the run.
        plan: Plan of the run.
        body: Parts of the body; None without any.

    Raises MoverError for a run that cannot start.
    """
    from generator.simulation.run_model import initial_state  # takes long

    start = initial_state(figure, plan, body)
    joints = start.placement.tree.figure.joints
    chains = {name: joint.chain for name, joint in joints.items()}
    parts = _part_names(body) if start.spheres else ()
    columns = {**_columns_by_title(chains, start.spheres, plan.up, parts)}
    for name in joints.keys() - figure.joints.keys():  # of free segments, which transmit nothing
        for column in _load_columns(name, chains[name]):
            del columns[column.title]
    return columns


def _columns_by_title(
    chains: Mapping[str, Sequence[JointAxis]],
    contact_segments: Iterable[str],
    up: Vector = (0.0, 1.0, 0.0),
    parts: Iterable[str] = (),
) -> Mapping[str, Column]:
    by_joint = tuple((name, tuple(chain)) for name, chain in chains.items())
    return _made_columns(by_joint, tuple(contact_segments), up, tuple(parts))


@lru_cache(maxsize=8)
def _made_columns(
    by_joint: tuple[tuple[str, tuple[JointAxis, ...]], ...],
    segments: tuple[str, ...],
    up: Vector,
    parts: tuple[str, ...],
) -> Mapping[str, Column]:
    """Return the columns by title; all runs of a study have the same."""
    chains = dict(by_joint)
    kinds = (*ENERGY_KINDS, *(CONTACT_ENERGY_KINDS if segments else ()))
    columns = [
        *table_columns(chains, kinds, segments),
        *_more_columns(chains, segments, up),
        *_part_columns(parts),
    ]
    return {column.title: column for column in columns}


def _more_columns(
    chains: Mapping[str, Sequence[JointAxis]], contact_segments: Sequence[str], up: Vector
) -> Iterator[Column]:
    """Yield the columns that the table of a motion does not have."""
    yield Column("centre_of_mass_height", LENGTH_UNIT, partial(_height, up))
    for name, chain in chains.items():
        yield from _load_columns(name, chain)
    for name in contact_segments:
        for end, unit in ((_TOUCH, "s"), (_SPEED, "m/s")):
            read = partial(_of_touch, name, end)
            single = Column(f"{name}{end}", unit, read, RecordingPart.CONTACT_STEPS)
            yield replace(single, may_be_undefined=True)
    for name in head_segments(contact_segments):
        read = partial(_injury, name)
        injury = Column(f"{name}{_INJURY}", "1", read, RecordingPart.HEAD_INJURY)
        yield replace(injury, may_be_undefined=True)
        read = partial(_acceleration, name)
        peak = Column(f"{name}{_ACCELERATION}", "g", read, RecordingPart.CONTACT_STEPS)
        yield replace(peak, may_be_undefined=True)


def _part_columns(names: Iterable[str]) -> Iterator[Column]:
    """Yield the columns of parts of the body."""
    for name in names:
        for end, unit in ((_TOUCH, "s"), (_SPEED, "m/s"), (_FORCE, "N"), (_WEIGHTS, "1")):
            read = partial(_of_touch, f"{_PART}{name}", end)
            single = Column(f"{_PART}{name}{end}", unit, read, RecordingPart.CONTACT_STEPS)
            yield replace(single, may_be_undefined=end != _FORCE)


def _load_columns(name: str, chain: Sequence[JointAxis]) -> Iterator[Column]:
    """Yield the columns of the torque, force and moment at a joint."""
    if chain:
        read = partial(_passive_torque, name)
        yield Column(f"{name}.passive_torque", "N m", read, RecordingPart.PASSIVE_TORQUES)
    for k, (kind, unit) in enumerate((("force", "N"), ("moment", "N m"))):
        read = partial(_reaction, name, slice(3 * k, 3 * k + 3))
        yield Column(f"{name}.reaction_{kind}", unit, read, RecordingPart.REACTIONS)


def _height(up: Vector, motion: FigureMotion) -> Array:
    return run_of(motion).centre_of_mass @ np.array(up)


def _passive_torque(joint: str, motion: FigureMotion) -> Array:
    return np.linalg.norm(run_of(motion).passive_torques[joint], axis=1)


def _reaction(joint: str, part: slice, motion: FigureMotion) -> Array:
    return np.linalg.norm(run_of(motion).reactions[joint][:, part], axis=1)


def _of_touch(name: str, end: str, motion: FigureMotion) -> Array:
    """Return a number of a segment, or of `part.NAME`, for each frame."""
    record = contact_of(motion)
    part = record.parts.get(name.removeprefix(_PART)) if name.startswith(_PART) else None
    touch = part or record.segments[name]
    numbers = {
        _TOUCH: touch.first_time,
        _SPEED: None if touch.first_time is None else touch.impact_speed,
        _FORCE: touch.peak_force,
        _WEIGHTS: part and part.body_weights,
    }
    number = numbers[end]
    return np.full(len(motion.times), nan if number is None else number)


def _injury(segment: str, motion: FigureMotion) -> Array:
    return np.full(len(motion.times), contact_of(motion).head_injury.get(segment, nan))


def _acceleration(segment: str, motion: FigureMotion) -> Array:
    head = contact_of(motion).heads.get(segment)  # without it in files of older versions
    return np.full(len(motion.times), nan if head is None else head.peak_acceleration)


def measure_motion(motion: FigureMotion, plan: Plan, measures: Iterable[Measure]) -> Measured:
    """Return the measures of a run, except those at rest; None for an undefined number.

    Args:
        motion: motion of the run, with the parts of `parts_of_measures`.
        plan: plan of the run.
        measures: measures to compute.

    Raises ModelError for an unknown column.
    """
    contact = run_of(motion).contact
    segments = () if contact is None else tuple(contact.segments)
    parts = () if contact is None else contact.parts
    columns = _columns_by_title(motion.chains, segments, plan.up, parts)
    return {
        each.name: _number(_column(columns, each), motion, each.take)
        for each in measures
        if each.take not in NOT_MOVING
    }


def measure_rest(
    chains: Mapping[str, Sequence[JointAxis]],
    displacements: Mapping[str, Array],
    measures: Iterable[Measure],
) -> Measured:
    """Return the measures at rest.

    Args:
        chains: the factors of each joint of the figure at rest.
        displacements: displacements of each joint, shape (n,) [rad or m].
        measures: measures to compute.

    Raises ModelError for an unknown column.
    """
    columns = {
        column.title: (column, float(value))
        for name, chain in chains.items()
        for column, value in zip(
            displacement_columns(name, chain), displacements[name], strict=True
        )
    }
    at_rest = [
        (each.name, _column(columns, each)) for each in measures if each.take is Statistic.REST
    ]
    return {name: float(column.format(value)) for name, (column, value) in at_rest}


def _column(columns: Mapping[str, T], measure: Measure) -> T:
    """Return the column of a measure. Raises ModelError if there is none."""
    if measure.column not in columns:
        message = f"the motion has no column `{shorten(measure.column)}`"
        raise ModelError(f"{message}; {spelling_hint(measure.column, columns)}")
    return columns[measure.column]


def _number(column: Column, motion: FigureMotion, take: Statistic) -> float | None:
    """Return a number in the unit of its column, or a time [s]."""
    match take:
        case Statistic.LAST:
            return _in_unit(column, float(column.read(motion)[-1]))
        case Statistic.LARGEST | Statistic.SMALLEST:
            extreme = column.extreme(motion, 1 if take is Statistic.LARGEST else -1)
            return None if extreme is None else _in_unit(column, extreme[1])
        case Statistic.TIME_OF_LARGEST | Statistic.TIME_OF_SMALLEST:
            extreme = column.extreme(motion, 1 if take is Statistic.TIME_OF_LARGEST else -1)
            if extreme is None or column.is_same_throughout(motion, extreme[1]):
                return None  # such as the force on a segment that touches nothing
            return extreme[0]
        case Statistic.REST | Statistic.START:
            raise ModelError(f'a motion has no number "{take}"')
        case _:
            assert_never(take)


def _in_unit(column: Column, value: float) -> float | None:
    """Return the number that the table has; None where it is blank."""
    text = column.format(value)
    return float(text) if text else None
