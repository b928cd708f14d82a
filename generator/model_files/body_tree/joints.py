"""Which freedoms of a body make one joint: rotations about one point, each axis across the next.

The passive laws of a joint: as fields of a figure, else as tables of a springs file.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from generator.figure import Factor, Vector
from generator.joint_chain import ChainError, chain_of
from generator.losses import Report
from generator.model_files.body_tree.tree import Freedom
from generator.rotations import PERPENDICULAR, Array
from generator.springs_file.parse import SpringEntry
from springs import Damping

TOGETHER = 1e-9
"""Distance of axes that count as meeting [m]."""


@dataclass(frozen=True)
class Group:
    """Freedoms that make one joint.

    Attributes:
        freedoms: from the parent outwards to the child.
        centre: the point where the axes of the turns meet, in the body's frame [m].
        frame: axes of the joint in the body's, shape (3, 3): where the turns are about axes across
            each other, along them.
    """

    freedoms: tuple[Freedom, ...]
    centre: Vector
    frame: Array

    @property
    def turns(self) -> tuple[Freedom, ...]:
        """Those that turn."""
        return tuple(freedom for freedom in self.freedoms if freedom.kind == "R")

    @property
    def chain(self) -> tuple[Factor, ...]:
        """The factors of the joint in its frame, innermost first."""
        return _chain(self.freedoms, self.frame)


def groups_of(freedoms: Sequence[Freedom], *, apart: bool = False) -> tuple[Group, ...]:
    """The joints that a body's freedoms make, the fewest that do, from the parent outwards.

    Args:
        freedoms: in that order.
        apart: whether passive turns each get a joint of their own, so that their laws stay laws of
            their angles; in one joint with others they become laws of the rotation vector.
    """
    units: list[tuple[Freedom, ...]] = []
    for freedom in freedoms:
        if units and freedom.whole and units[-1][-1].whole == freedom.whole:
            units[-1] = (*units[-1], freedom)
        else:
            units.append((freedom,))
    groups: list[Group] = []
    held: tuple[Freedom, ...] = ()
    for unit in units:
        joined = _group((*held, *unit), apart=apart) if held else None
        if joined is not None:
            groups[-1] = joined
            held = joined.freedoms
            continue
        alone = _group(unit, apart=False)
        assert alone is not None, "a freedom, or those of a ball, make one joint"
        groups.append(alone)
        held = alone.freedoms
    return tuple(groups)


def _group(freedoms: tuple[Freedom, ...], *, apart: bool) -> Group | None:
    """The joint of these freedoms; None where one joint cannot hold them."""
    turns = [freedom for freedom in freedoms if freedom.kind == "R"]
    slides = [freedom for freedom in freedoms if freedom.kind == "T"]
    try:
        chain_of(_chain(freedoms, np.eye(3)))
    except ChainError:
        return None
    centre = _centre(turns)
    if centre is None:
        return None
    passive = any(freedom.is_passive for freedom in turns)
    is_ball = bool(turns) and len({freedom.whole or freedom.name for freedom in turns}) == 1
    if len(turns) > 1 and passive and not is_ball and (apart or not _orthogonal(turns)):
        return None
    if len(slides) > 1 and any(freedom.is_passive for freedom in slides):
        # Exudyn's connectors would lose a moment there.
        return None
    return Group(freedoms, centre, _frame(turns))


def _chain(freedoms: Sequence[Freedom], frame: Array) -> tuple[Factor, ...]:
    return tuple(
        Factor(freedom.kind, _clean(frame.T @ freedom.axis)) for freedom in reversed(freedoms)
    )


def _clean(axis: Array) -> Vector:
    """The axis with rounding errors taken off a coordinate axis."""
    x, y, z = (float(round(part)) if abs(part - round(part)) < 1e-15 else part for part in axis)
    return float(x) + 0.0, float(y) + 0.0, float(z) + 0.0


def _orthogonal(turns: Sequence[Freedom]) -> bool:
    axes = np.array([freedom.axis for freedom in turns])
    return bool(np.abs(axes @ axes.T - np.eye(len(turns))).max() < PERPENDICULAR)


def _centre(turns: Sequence[Freedom]) -> Vector | None:
    """The point where the axes meet, nearest to the point of the first; None where they do not."""
    if not turns:
        return 0.0, 0.0, 0.0
    start = np.asarray(turns[0].point)
    rows = np.vstack([np.eye(3) - np.outer(turn.axis, turn.axis) for turn in turns])
    arms = np.array([np.asarray(turn.point) - start for turn in turns]).reshape(-1, 1)
    aims = np.vstack([rows[3 * k : 3 * k + 3] @ arms[3 * k : 3 * k + 3] for k in range(len(turns))])
    moved = np.linalg.lstsq(rows, aims, rcond=1e-9)[0]
    if np.abs(rows @ moved - aims).max() > TOGETHER:
        return None
    x, y, z = (start + moved[:, 0]).tolist()
    return x, y, z


def _frame(turns: Sequence[Freedom]) -> Array:
    """The body's axes where the turns are about some of them; else axes along the turns."""
    axes = [np.asarray(turn.axis) for turn in turns]
    if len(axes) < 2 or all(np.abs(axis).max() > 1.0 - 1e-12 for axis in axes):
        return np.eye(3)
    third = np.cross(axes[0], axes[1])
    third /= np.linalg.norm(third)
    return np.stack([axes[0], axes[1], third], axis=1)


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
