"""Joints from degrees of freedom, and their passive laws.

Degrees of freedom form one joint if their axes meet in one point, each perpendicular to the next.
Its laws become fields of the figure, or else tables of a springs file.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import degrees, pi, radians
from typing import assert_never

import numpy as np

from generator.diagnostics import ModelError
from generator.figure import AxisKind, Joint, JointAxis, Vector, is_rotation
from generator.joint_chain import build_chain
from generator.losses import Effect, Losses
from generator.model_files.body_tree.tree import Curve, DegreeOfFreedom
from generator.model_files.fit_error import FitError, format_range
from generator.rotations import PERPENDICULAR_TOLERANCE, Array
from generator.springs_file.laws import CubicEntry, EntryLaw, is_finite
from generator.springs_file.parse import SpringEntry
from generator.toml_file.reader import MAX_TEXT_LENGTH
from springs import Cubic, Damping, Linear, NotRestoringError, passive_cubic
from springs.elastic import Range
from springs.exponential import Exponential
from springs.interpolated import Interpolated
from springs.smooth_limit import SmoothLimit

MAX_AXIS_GAP = 1e-9
"""Distance of axes that count as meeting [m]."""


@dataclass(frozen=True)
class JointGroup:
    """Degrees of freedom that form one joint.

    Attributes:
        dofs: dofs from the parent outwards to the child.
        centre: the point where the axes of the turns meet, in the body's frame [m].
        frame: axes of the joint in the body's, shape (3, 3): where the turns are about axes across
            each other, along them.
    """

    dofs: tuple[DegreeOfFreedom, ...]
    centre: Vector
    frame: Array

    @property
    def rotations(self) -> tuple[DegreeOfFreedom, ...]:
        """The rotations among them."""
        return tuple(freedom for freedom in self.dofs if is_rotation(freedom.kind))

    @property
    def chain(self) -> tuple[JointAxis, ...]:
        """The chain of the joint in its frame, innermost axis first."""
        return _joint_chain(self.dofs, self.frame)


def group_dofs(
    dofs: Sequence[DegreeOfFreedom], *, separate: bool = False
) -> tuple[JointGroup, ...]:
    """Group degrees of freedom of a body into as few joints as possible, from the parent outwards.

    Args:
        dofs: dofs in that order.
        separate: give each passive rotation its own joint, so that its law is a law of its angle;
            in a joint with others it becomes a law of the rotation vector.
    """
    units: list[tuple[DegreeOfFreedom, ...]] = []
    for freedom in dofs:
        if units and freedom.joint and units[-1][-1].joint == freedom.joint:
            units[-1] = (*units[-1], freedom)
        else:
            units.append((freedom,))
    groups: list[JointGroup] = []
    current: tuple[DegreeOfFreedom, ...] = ()
    for unit in units:
        joined = _joint_group((*current, *unit), separate=separate) if current else None
        if joined is not None:
            groups[-1] = joined
            current = joined.dofs
            continue
        alone = _joint_group(unit, separate=False)
        assert alone is not None, "freedoms of one joint of a model form a joint"
        groups.append(alone)
        current = alone.dofs
    return tuple(groups)


def rotation_group(dofs: Sequence[DegreeOfFreedom], joint: str) -> JointGroup | None:
    """Return the joint `joint` of several rotations that are about axes across each other.

    It has the laws of its rotation vector's components along these axes. None where the rotations
    of a body are not such a joint.
    """
    marked = [replace(dof, joint=joint) if is_rotation(dof.kind) else dof for dof in dofs]
    turns = [dof for dof in marked if is_rotation(dof.kind)]
    if len(turns) < 2 or not _are_orthogonal(turns):
        return None
    if _joint_group(tuple(turns), separate=False) is None:
        return None
    groups = group_dofs(marked)
    return next((one for one in groups if len(one.rotations) == len(turns)), None)


def _joint_group(dofs: tuple[DegreeOfFreedom, ...], *, separate: bool) -> JointGroup | None:
    """Return the joint of these degrees of freedom; None if they do not form one."""
    turns = [freedom for freedom in dofs if is_rotation(freedom.kind)]
    try:
        build_chain(_joint_chain(dofs, np.eye(3)))
    except ModelError:
        return None
    centre = _axes_intersection(turns)
    if centre is None:
        return None
    passive = any(freedom.is_passive for freedom in turns)
    is_ball = bool(turns) and len({freedom.joint or freedom.name for freedom in turns}) == 1
    if len(turns) > 1 and passive and not is_ball and (separate or not _are_orthogonal(turns)):
        return None
    return JointGroup(dofs, centre, _joint_frame(turns))


def _joint_chain(dofs: Sequence[DegreeOfFreedom], frame: Array) -> tuple[JointAxis, ...]:
    return tuple(
        JointAxis(freedom.kind, _snap_axis(frame.T @ freedom.axis)) for freedom in reversed(dofs)
    )


def _snap_axis(axis: Array) -> Vector:
    """Return the axis; a coordinate axis without its rounding errors."""
    x, y, z = (float(round(part)) if abs(part - round(part)) < 1e-15 else part for part in axis)
    return float(x) + 0.0, float(y) + 0.0, float(z) + 0.0


def _are_orthogonal(rotations: Sequence[DegreeOfFreedom]) -> bool:
    axes = np.array([freedom.axis for freedom in rotations])
    return bool(np.abs(axes @ axes.T - np.eye(len(rotations))).max() < PERPENDICULAR_TOLERANCE)


def _axes_intersection(rotations: Sequence[DegreeOfFreedom]) -> Vector | None:
    """Return the common point of the axes, nearest to the first point; None if there is none."""
    if not rotations:
        return 0.0, 0.0, 0.0
    start = np.asarray(rotations[0].point)
    rows = np.vstack([np.eye(3) - np.outer(turn.axis, turn.axis) for turn in rotations])
    arms = np.array([np.asarray(turn.point) - start for turn in rotations]).reshape(-1, 1)
    aims = np.vstack(
        [rows[3 * k : 3 * k + 3] @ arms[3 * k : 3 * k + 3] for k in range(len(rotations))]
    )
    moved = np.linalg.lstsq(rows, aims, rcond=1e-9)[0]
    if np.abs(rows @ moved - aims).max() > MAX_AXIS_GAP:
        return None
    x, y, z = (start + moved[:, 0]).tolist()
    return x, y, z


def _joint_frame(rotations: Sequence[DegreeOfFreedom]) -> Array:
    """Return the body's axes if the rotations are about these; otherwise the rotation axes."""
    axes = [np.asarray(turn.axis) for turn in rotations]
    if len(axes) < 2 or all(np.abs(axis).max() > 1.0 - 1e-12 for axis in axes):
        return np.eye(3)
    third = np.cross(axes[0], axes[1])
    third /= np.linalg.norm(third)
    return np.stack([axes[0], axes[1], third], axis=1)


UNLIMITED_ANGLE = 200.0 * pi
"""Limit of an unlimited rotation in a joint where another axis is limited [rad]: 100 turns."""

UNLIMITED_LENGTH = 1000.0
"""The same for a translation [m]."""


def with_reachable_limits(dof: DegreeOfFreedom, losses: Losses) -> DegreeOfFreedom:
    """Return the degree of freedom without limits that stand for none, such as 1e16."""
    most = _unlimited(dof.kind)
    if (dof.lower or 0.0) > most or (dof.upper or 0.0) < -most:
        return dof
    lower = None if dof.lower is None or dof.lower < -most else dof.lower
    upper = None if dof.upper is None or dof.upper > most else dof.upper
    if (lower, upper) != (dof.lower, dof.upper):
        losses.add("limits beyond 100 turns or 1 km are left out", dof.name)
    return replace(dof, lower=lower, upper=upper)


def _unlimited(kind: AxisKind) -> float:
    """Return the limit of a displacement without any, in a joint that has others [rad or m]."""
    match kind:
        case AxisKind.ROTATION:
            return UNLIMITED_ANGLE
        case AxisKind.TRANSLATION:
            return UNLIMITED_LENGTH
        case _:
            assert_never(kind)


def with_group(joint: Joint, group: JointGroup, losses: Losses) -> Joint:
    """Return a joint with the chain and the fields of a group.

    Reports the laws of translations that fields cannot hold.
    """
    freedoms = [_field_part(freedom, joint.name, losses) for freedom in reversed(group.dofs)]
    stiff = tuple(freedom.stiffness for freedom in freedoms)
    rest = tuple(freedom.rest if freedom.stiffness else 0.0 for freedom in freedoms)
    damp = tuple(freedom.damping for freedom in freedoms)
    bounded = any(one.lower is not None or one.upper is not None for one in freedoms)
    lower = tuple(-_unlimited(dof.kind) if dof.lower is None else dof.lower for dof in freedoms)
    upper = tuple(_unlimited(dof.kind) if dof.upper is None else dof.upper for dof in freedoms)
    return replace(
        joint,
        chain=group.chain,
        displacement=tuple(freedom.value for freedom in freedoms),
        stiff=stiff if any(stiff) else None,
        rest=rest if any(rest) else None,
        damp=damp if any(damp) else None,
        lower_limit=lower if bounded else None,
        upper_limit=upper if bounded else None,
    )


def _field_part(dof: DegreeOfFreedom, joint: str, losses: Losses) -> DegreeOfFreedom:
    """Return the part of the law that the fields hold."""
    if not needs_table(dof):
        return dof
    match dof.kind:
        case AxisKind.ROTATION:
            return replace(dof, stiffness=0.0, damping=0.0)
        case AxisKind.TRANSLATION:
            losses.add("friction and nonlinear springs of sliding joints", dof.name or joint)
            return dof
        case _:
            assert_never(dof.kind)


def needs_table(dof: DegreeOfFreedom) -> bool:
    """Return True if a degree of freedom has a law that the fields cannot hold."""
    return bool(dof.friction or any(dof.cubic) or dof.laws)


def spring_entries(
    group: JointGroup, joint: str, max_points: int, losses: Losses
) -> Iterator[SpringEntry]:
    """Yield the tables of a springs file for a joint, one for each axis that needs it.

    A law that no table holds exactly becomes one of `max_points` points.
    """
    for freedom in group.rotations:
        if needs_table(freedom):
            yield _entry(freedom, _axis_name(freedom, group), joint, max_points, losses)


def damping_entries(group: JointGroup, joint: str) -> Iterator[SpringEntry]:
    """Yield the tables of the damping of a joint whose elastic law is another, one an axis."""
    for freedom in group.rotations:
        damping = Damping(freedom.damping, freedom.friction)
        if damping != Damping():
            axis = _axis_name(freedom, group)
            yield SpringEntry((joint,), axis, damping=damping, motion=freedom.name)


def without_laws(dof: DegreeOfFreedom) -> DegreeOfFreedom:
    """Return a rotation without its springs, damping and friction; a translation as it is."""
    if not is_rotation(dof.kind):
        return dof
    return replace(dof, stiffness=0.0, cubic=(0.0, 0.0), damping=0.0, friction=0.0, laws=())


def max_table_points(dofs: Iterable[DegreeOfFreedom]) -> int:
    """Return the number of points with which all tables of a springs file fit into it."""
    listed = [dof for dof in dofs if needs_table(dof)]
    count = sum(bool(dof.laws or any(dof.cubic)) for dof in listed)
    names = sum(len(dof.name) for dof in listed)  # of the joint, and of the motion
    room = MAX_TEXT_LENGTH - ENTRY_LENGTH * len(listed) - 2 * names
    return max(min(MAX_TABLE_POINTS, room // POINT_LENGTH // max(count, 1)), 2)


def _axis_name(dof: DegreeOfFreedom, group: JointGroup) -> str | None:
    """Return the name of the joint axis of this rotation; None for a single one."""
    if len(group.rotations) == 1:
        return None
    return "xyz"[int(np.argmax(np.abs(group.frame.T @ dof.axis)))]


def _entry(
    dof: DegreeOfFreedom, axis: str | None, joint: str, max_points: int, losses: Losses
) -> SpringEntry:
    damping = Damping(dof.damping, dof.friction)
    entry = SpringEntry((joint,), axis, damping=damping, motion=dof.name)
    laws = list(dof.laws)
    if any(dof.cubic):
        laws.insert(0, Cubic((0.0, dof.stiffness, *dof.cubic), -1, None, dof.rest))
    elif dof.stiffness:
        laws.insert(0, Linear(dof.stiffness, dof.rest))
    if not laws:
        return entry
    law = _stated_law(laws[0]) if len(laws) == 1 else None
    return replace(entry, law=law or _sampled_law(dof, laws, max_points, losses))


def _stated_law(law: Curve) -> EntryLaw | None:
    """Return a law as a table states it; None if it cannot."""
    if isinstance(law, Cubic):
        try:
            rule = passive_cubic(law.coefficients, law.dead_zone, law.rest)
        except NotRestoringError:
            return None
        if rule.sense != law.sense or not is_finite(law):  # every reading would warn, or fail
            return None
        return CubicEntry(law.coefficients, law.sense, law.dead_zone, True, law.rest)
    stated = isinstance(law, Linear | SmoothLimit | Exponential | Interpolated)
    return law if stated and is_finite(law) else None


FIRST_INTERVALS = 24
"""Intervals of the coarsest table of a law."""

MAX_TABLE_POINTS = 120
"""Points of the finest table of a law."""

ENTRY_LENGTH, POINT_LENGTH = 160, 32
"""Characters of a table of a springs file without names and points, and of a point, at most."""

SAMPLING_TOLERANCE = 1e-4
"""Error below which an interval of a table is not halved, relative to the largest torque."""

MAX_SAMPLED_TORQUE = 1e4
"""Torque above which a law is sampled over a smaller range [N m]."""

MAX_TABLE_TORQUE = 1e9
"""Largest torque of a table [N m]: steeper ones overflow beyond their last point."""

CORNER_WIDTH = 0.05
"""Distance of the points on both sides of a corner, which a table rounds off [deg]."""

ANGLE_DIGITS, TORQUE_DIGITS = 4, 9
"""Decimals of angles [deg], and digits of torques in a table."""


def _sampled_law(
    dof: DegreeOfFreedom, laws: Sequence[Curve], max_points: int, losses: Losses
) -> Interpolated | None:
    """Return a table of the sum of laws, finer where it is curved; report its error.

    None, with a loss, for a sum that is not finite.
    """
    most = MAX_TABLE_TORQUE

    def torque(angles: Array) -> Array:
        with np.errstate(all="ignore"):
            total: Array = np.sum([law.torque(angles) * np.ones_like(angles) for law in laws], 0)
        return np.where(np.isfinite(total), np.clip(total, -most, most), total)

    low, high = ends = _sampled_range(dof, torque)
    corners = [degrees(point) for law in laws for point in law.breakpoints if low < point < high]
    coarse = np.linspace(degrees(low), degrees(high), min(FIRST_INTERVALS + 1, max_points))
    sides = [corner + side for corner in corners for side in (-CORNER_WIDTH, 0.0, CORNER_WIDTH)]
    angles = np.unique(np.round([*coarse.tolist(), *sides], ANGLE_DIGITS))
    if len(angles) > max_points:
        angles = np.unique(np.round(coarse, ANGLE_DIGITS))
    while True:
        checks = np.linspace(angles[:-1], angles[1:], 6)[1:-1]
        values, exact = torque(np.radians(angles)), torque(np.radians(checks))
        if not (np.isfinite(values).all() and np.isfinite(exact).all()):
            losses.add("springs that are not finite in their range", dof.name)
            return None
        points = tuple(
            (radians(angle), float(f"{value:.{TORQUE_DIGITS}g}"))
            for angle, value in zip(angles.tolist(), values.tolist(), strict=True)
        )
        table = Interpolated(points)
        differences = table.torque(np.radians(checks)) - exact
        errors = np.abs(differences).max(axis=0)
        poor = np.flatnonzero(errors > SAMPLING_TOLERANCE * float(np.abs(exact).max()))
        poor = poor[np.diff(angles)[poor] > 2.0 * CORNER_WIDTH]
        room = max_points - len(angles)
        if not len(poor) or room <= 0:
            break
        worst = poor[np.argsort(errors[poor])[::-1][:room]]
        middles = 0.5 * (angles[worst] + angles[worst + 1])
        angles = np.unique(np.round(np.concatenate([angles, middles]), ANGLE_DIGITS))
    if max(np.abs(values).max(), np.abs(exact).max()) >= most:
        losses.add(f"springs of more than {most:g} N m are bounded there", dof.name)
    losses.add(
        "springs that become tables of points",
        f"{dof.name}: {FitError.from_differences(differences)} over {format_range(ends)}",
        effect=Effect.APPROXIMATION,
    )
    return table


def _sampled_range(dof: DegreeOfFreedom, torque: Callable[[Array], Array]) -> Range:
    """Return the range in which a law is sampled: the known one, or one of moderate torques."""
    low, high = -pi, pi
    if dof.lower is not None and dof.upper is not None:
        low, high = dof.lower - BEYOND_LIMITS, dof.upper + BEYOND_LIMITS
    elif dof.expected_range is not None:  # beyond it a law may have a stop
        first, last = dof.expected_range
        low = min(first, max(first - BEYOND_LIMITS, -pi))
        high = max(last, min(last + BEYOND_LIMITS, pi))
    while high - low > SMALLEST_SAMPLED_RANGE:
        sizes = np.abs(torque(np.linspace(low, high, FIRST_INTERVALS + 1)))
        if np.all(sizes < MAX_SAMPLED_TORQUE):
            break
        low, high = 0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high
    return low, high


BEYOND_LIMITS = 0.2
"""Angle beyond each limit, or end of a range, over which a law is sampled as well [rad]."""

SMALLEST_SAMPLED_RANGE = 0.2
"""Smallest range in which a law is sampled for its torques [rad]."""
