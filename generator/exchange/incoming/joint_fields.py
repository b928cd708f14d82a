"""The passive laws of a joint: as fields of a figure, else as tables of a springs file."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from generator.exchange.incoming.freedom_groups import Group
from generator.exchange.incoming.passive_tree import Freedom
from generator.exchange.report import Report
from generator.reader.springs_file import SpringEntry
from springs import Damping

FAR_ANGLE = 200.0 * pi
"""Limit of a turn that has none, in a joint in which another has one [rad]: a hundred turns."""

FAR = 1000.0
"""Likewise of a slide [m]."""

Row = tuple[float, ...] | None


@dataclass(frozen=True)
class JointFields:
    """The rows of a joint in a figure file, each in the order of its chain or None."""

    stiff: Row
    rest: Row
    damp: Row
    lower_limit: Row
    upper_limit: Row


def joint_fields(group: Group, joint: str, report: Report) -> JointFields:
    """What the figure's own fields say of a joint; what they cannot say of slides is reported."""
    freedoms = [_in_fields(freedom, joint, report) for freedom in reversed(group.freedoms)]
    stiff = tuple(freedom.stiffness for freedom in freedoms)
    rest = tuple(freedom.rest if freedom.stiffness else 0.0 for freedom in freedoms)
    damp = tuple(freedom.damping for freedom in freedoms)
    bounded = any(one.lower is not None or one.upper is not None for one in freedoms)
    return JointFields(
        stiff if any(stiff) else None,
        rest if any(rest) else None,
        damp if any(damp) else None,
        tuple(_bound(one, one.lower, -1.0) for one in freedoms) if bounded else None,
        tuple(_bound(one, one.upper, 1.0) for one in freedoms) if bounded else None,
    )


def _bound(freedom: Freedom, bound: float | None, sign: float) -> float:
    if bound is not None:
        return bound
    return sign * (FAR_ANGLE if freedom.kind == "R" else FAR)


def _in_fields(freedom: Freedom, joint: str, report: Report) -> Freedom:
    """The part of a freedom's law that stands in the fields."""
    if not needs_table(freedom):
        return freedom
    if freedom.kind == "R":
        return replace(freedom, stiffness=0.0, damping=0.0)
    report.lose("friction, limits and curved springs along slides", freedom.name or joint)
    return freedom


def needs_table(freedom: Freedom) -> bool:
    """Whether a freedom has a law that the fields cannot hold."""
    return bool(freedom.friction or any(freedom.cubic) or freedom.limit is not None)


def spring_entries(group: Group, joint: str, report: Report) -> Iterator[SpringEntry]:
    """The tables of a springs file for a joint, one for each axis that needs it."""
    for freedom in group.turns:
        if needs_table(freedom):
            yield _entry(freedom, _axis_name(freedom, group), joint, report)


def _axis_name(freedom: Freedom, group: Group) -> str | None:
    """The axis of the joint about which the freedom turns; None for the only one."""
    if len(group.turns) == 1:
        return None
    return "xyz"[int(np.argmax(np.abs(group.frame.T @ freedom.axis)))]


def _entry(freedom: Freedom, axis: str | None, joint: str, report: Report) -> SpringEntry:
    entry = SpringEntry(
        (joint,),
        axis,
        damping=Damping(freedom.damping, freedom.friction),
        motion=freedom.name,
    )
    if freedom.limit is not None:
        if freedom.stiffness:
            report.lose("springs beside a smooth limit about the same axis", freedom.name)
        return replace(entry, law=freedom.limit)
    if any(freedom.cubic):
        second, third = freedom.cubic
        if third > 0.0:
            return replace(
                entry,
                coefficients=(0.0, freedom.stiffness, second, third),
                sense=-1,
                dead_zone_stated=True,
                rest=freedom.rest,
            )
        report.lose("parts of springs that do not restore at both ends", freedom.name)
    if freedom.stiffness:
        return replace(entry, stiffness=freedom.stiffness, rest=freedom.rest)
    return entry
