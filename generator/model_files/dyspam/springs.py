"""The springs of a figure as DYSPAM has them: rows of `ndyspamfile`, and cubics of `optional`.

A spring is written only if reading it back gives the same law. `optional` says neither in which
sense a curve acts nor, for a spherical joint, where it has a dead zone: reading follows from the
coefficients (`springs.cubic`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from generator.losses import LossReport
from generator.model_files.dyspam.mechanism import JointTriad, JointType, LinearSpring
from generator.springs_file.axes import AXIS_NAMES, parallel_sign
from generator.springs_file.optional import OptionalRecord
from springs import (
    AxisSpring,
    Coefficients,
    Cubic,
    Elastic,
    Joining,
    Linear,
    NotRestoringError,
    SpringSet,
    Stop,
    passive_cubic,
)
from springs.damping import DEFAULT_SLIP_RATE

ANGLE_DECIMALS = 7
"""Edges of dead zones are rounded to so many decimals of a radian: springs files give them in
degrees, in which 1.7 rad has no end."""

_MAX_EDGE_DIFFERENCE = 1e-6
"""Edges of dead zones that are nearer are the same [rad]."""

LIMITS_LOSS = "limits and their stops"
_OTHER_LAW = "springs whose law is neither a line nor a cubic, left out"
_SEVERAL = "springs of several laws about one axis, left out"
_OTHER_AXIS = "springs about axes that are none of their joint's x, y and z, left out"
_OTHER_SENSE = (
    "cubics with another sense or dead zone than `optional` gives them when it is read, left out"
)
_SLIP = f"the slip rate of friction, which is then {DEFAULT_SLIP_RATE:g} rad/s"


@dataclass
class DyspamSprings:
    """What could be written; what could not is in the report.

    Attributes:
        report: of the losses.
        rows: of `ndyspamfile`, linear springs.
        records: of `optional`, cubics.
    """

    report: LossReport
    rows: list[LinearSpring] = field(default_factory=list[LinearSpring])
    records: list[OptionalRecord] = field(default_factory=list[OptionalRecord])


def convert_springs(
    springs: SpringSet, triads: Mapping[str, JointTriad], report: LossReport
) -> DyspamSprings:
    """The springs of a figure's joints, and what is lost of them.

    Args:
        springs: of the figure.
        triads: of its joints, by name in the order of their numbers.
        report: for the losses.
    """
    written = DyspamSprings(report)
    for number, (name, triad) in enumerate(triads.items(), start=1):
        given = springs.joints.get(name)
        by_axis: dict[int, list[AxisSpring]] = {}
        for spring in () if given is None else given.axes:
            if any(isinstance(law, Stop) for law in spring.elastic):
                report.add(LIMITS_LOSS, name)
            axis, told = _in_triad_axes(spring, triad)
            if axis is None:
                written.report.add(_OTHER_AXIS, name)
            else:
                by_axis.setdefault(axis, []).append(told)
        for axis, several in sorted(by_axis.items()):
            where = name if triad.type is JointType.REVOLUTE else f"{name} {AXIS_NAMES[axis - 1]}"
            if len(several) > 1:
                written.report.add(_SEVERAL, where)
            else:
                _convert_axis_spring(several[0], triad, (number, axis), where, written)
    _add_other_losses(springs, report)
    return written


def _add_other_losses(springs: SpringSet, report: LossReport) -> None:
    """Note what no row and no record says."""
    for spring in springs.coupled:
        joints = (axis.joint for axis in spring.axes)
        report.add("springs over several joints, left out", *dict.fromkeys(joints))
    for name, joint in springs.joints.items():
        if any(axis.motion or axis.reference or axis.why for axis in joint.axes):
            report.add("what springs say of their motions, references and reasons", name)
    if springs.joining is not Joining.CONSERVATIVE:
        how = f"the axes of a spherical joint join ({springs.joining.value})"
        report.add(f"the way in which {how}, which is conservative when read")


def _in_triad_axes(spring: AxisSpring, triad: JointTriad) -> tuple[int | None, AxisSpring]:
    """The axis of the triad about which a spring is, and the spring told about it."""
    x, y, z = (float(part) for part in triad.rotation.T @ np.asarray(spring.direction))
    for number in triad.type.axes:
        a, b, c = (float(number == k) for k in (1, 2, 3))
        sign = parallel_sign((a, b, c), (x, y, z))
        if sign:
            return number, spring if sign > 0 else spring.with_opposite_axis()
    return None, spring


def _convert_axis_spring(
    spring: AxisSpring,
    triad: JointTriad,
    number_and_axis: tuple[int, int],
    where: str,
    converted: DyspamSprings,
) -> None:
    """Write the spring of one axis, without its stops."""
    laws = [law for law in spring.elastic if not isinstance(law, Stop)]
    joint, axis = number_and_axis
    if len(laws) > 1:
        converted.report.add(_SEVERAL, where)
        return
    law = laws[0] if laws else Linear(0.0)
    viscous, coulomb = spring.damping.viscous, spring.damping.coulomb
    if isinstance(law, Linear) and not coulomb:
        if laws or viscous:
            row = LinearSpring(joint, axis, law.stiffness, viscous, law.rest)
            converted.rows.append(row)
        return
    cubic = _as_cubic(law)
    if cubic is None:
        converted.report.add(_OTHER_LAW, where)
        return
    spherical = triad.type is JointType.SPHERICAL
    record = _cubic_record(cubic, joint, axis, spherical=spherical)
    if record is None:
        converted.report.add(_OTHER_SENSE, where)
        return
    if coulomb and spring.damping.slip != DEFAULT_SLIP_RATE:
        converted.report.add(_SLIP, where)
    # The printed tables give the moment about the site's own positive axis. Negated or not, a curve
    # is read as the same law: its sense follows from its coefficients.
    if spherical and triad.rotation[axis - 1, axis - 1] < 0.0:
        c0, c1, c2, c3 = record.coefficients
        record = replace(record, coefficients=(-c0, -c1, -c2, -c3))
    converted.records.append(replace(record, viscous=viscous, coulomb=coulomb))


def _as_cubic(law: Elastic) -> Cubic | None:
    """A law as a cubic, where it is one."""
    if isinstance(law, Linear):
        return Cubic((0.0, law.stiffness, 0.0, 0.0), rest=law.rest)
    return law if isinstance(law, Cubic) else None


def _cubic_record(law: Cubic, joint: int, axis: int, *, spherical: bool) -> OptionalRecord | None:
    """The record of a cubic; None where it would be read as another law."""
    zone = law.dead_zone or (0.0, 0.0)
    if spherical:
        law = _with_zero_rest(law)
        record = OptionalRecord(joint, axis, law.coefficients)
    else:
        low, high = (round(edge, ANGLE_DECIMALS) for edge in zone)
        record = OptionalRecord(joint, axis, law.coefficients, rest=law.rest, dead_zone=(low, high))
    given = None if record.dead_zone == (0.0, 0.0) else record.dead_zone
    try:
        read = passive_cubic(record.coefficients, given, record.rest)
    except NotRestoringError:
        return None
    return record if read.sense == law.sense and _equal_dead_zones(read, law) else None


def _with_zero_rest(law: Cubic) -> Cubic:
    """The same law with the rest at zero, which is all that a spherical axis can have."""
    r, (c0, c1, c2, c3) = law.rest, law.coefficients
    moved: Coefficients = (
        c0 - r * (c1 - r * (c2 - r * c3)),
        c1 - r * (2.0 * c2 - 3.0 * r * c3),
        c2 - 3.0 * r * c3,
        c3,
    )
    zone = law.dead_zone
    return Cubic(moved, law.sense, zone and (zone[0] + r, zone[1] + r))


def _equal_dead_zones(one: Cubic, other: Cubic) -> bool:
    if one.dead_zone is None or other.dead_zone is None:
        return one.dead_zone is other.dead_zone
    edges = zip(one.dead_zone, other.dead_zone, strict=True)
    return all(abs(a - b) <= _MAX_EDGE_DIFFERENCE for a, b in edges)
