"""What a file of spring data gives the joints of a figure: laws about axes, each with its place."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import degrees
from pathlib import Path

from generator.diagnostics import Findings, Span, nearest, shorten
from generator.figure import Figure, Joint, Vector
from generator.springs_file.axes import (
    AxisError,
    axis_named,
    axis_numbered,
    is_bounded,
    sign_along,
    turn_axes,
)
from generator.springs_file.laws import ELASTIC_KEYS, PublishedLaw, changed_law, is_finite
from generator.springs_file.optional import OptionalRecord
from generator.springs_file.parse import SpringEntry, SpringsFile
from springs import (
    AxisSpring,
    Coefficients,
    Cubic,
    Damping,
    Elastic,
    Linear,
    NotRestoringError,
    passive_cubic,
)
from springs.stop import ONSET, STIFFNESS


@dataclass(frozen=True)
class GivenSpring:
    """A spring that a file gives one axis of one joint; the stops are at the figure's limits.

    stop_stiffness [N m/rad], stop_onset [rad].
    """

    joint: str
    spring: AxisSpring
    place: Span | None
    stop_stiffness: float = STIFFNESS
    stop_onset: float = ONSET


def from_records(
    figure: Figure, records: Iterable[OptionalRecord], printed: bool, findings: Findings
) -> list[GivenSpring]:
    """The springs of an `optional` file.

    The tables give the moment about the positive axis at the angle about the declared one, so a
    spherical axis that is declared negative has its coefficients negated. alpha_0, alpha_l and
    alpha_u count for revolutes only.

    Args:
        figure: the figure whose joints the records count.
        records: as read.
        printed: take every moment as the resisting one and no dead zone from roots.
        findings: for faults.
    """
    given: list[GivenSpring] = []
    for record in records:
        place = record.origins.get("axis")
        joint = _joint_numbered(figure, record.joint, place, findings)
        if joint is None:
            continue
        try:
            direction = axis_numbered(joint, record.axis)
        except AxisError as fault:
            findings.error(str(fault), place, fault.hint)
            continue
        spring = _record_spring(joint, record, direction, printed, findings)
        if spring is not None:
            given.append(GivenSpring(joint.name, spring, place))
    return without_repeats(given, findings)


def from_springs_file(
    figure: Figure, content: SpringsFile, findings: Findings
) -> list[GivenSpring]:
    """The springs of a springs file; what it states wins over the rule."""
    given: list[GivenSpring] = []
    for entry in content.entries:
        for k, name in enumerate(entry.joints):
            place = entry.origins.get(f"joints.{k}")
            joint = figure.joints.get(name)
            if joint is None:
                findings.error(
                    f"the figure has no joint `{shorten(name)}`",
                    place,
                    nearest(name, figure.joints),
                )
                continue
            try:
                direction = axis_named(joint, entry.axis)
            except AxisError as fault:
                findings.error(str(fault), entry.origins.get("axis") or place, fault.hint)
                continue
            bounded = is_bounded(joint, direction)
            spring = entry_spring(name, entry, direction, findings, bounded=bounded)
            if spring is not None:
                stop = (entry.stop_stiffness, entry.stop_onset)
                given.append(GivenSpring(name, spring, place, *stop))
    return without_repeats(given, findings)


def _joint_numbered(
    figure: Figure, number: int, place: Span | None, findings: Findings
) -> Joint | None:
    names = list(figure.joints)
    if number <= len(names):
        return figure.joints[names[number - 1]]
    has = "1 joint" if len(names) == 1 else f"{len(names)} joints"
    findings.error(
        f"there is no joint number {number}", place, f"the figure has {has}, counted from 1"
    )
    return None


def _record_spring(
    joint: Joint, record: OptionalRecord, direction: Vector, printed: bool, findings: Findings
) -> AxisSpring | None:
    """The law of one record; None, with a fault noted, when it is none."""
    coefficients, rest, zone = record.coefficients, 0.0, None
    is_revolute, negated = len(turn_axes(joint)) == 1, sum(direction) < 0.0
    if is_revolute:
        rest = record.rest
        if record.dead_zone != (0.0, 0.0):
            zone = record.dead_zone
    elif negated:
        c0, c1, c2, c3 = coefficients
        coefficients = (-c0, -c1, -c2, -c3)
    place = record.origins.get("dead_zone")
    if zone is not None and zone[0] > zone[1]:
        findings.error("the dead zone ends before it begins", place, "alpha_0 alpha_l alpha_u")
        return None
    if not is_revolute and (record.rest, *record.dead_zone) != (0.0, 0.0, 0.0):
        findings.warning(
            f"rest and dead zone of `{shorten(joint.name)}` are not used",
            place,
            "these numbers count for revolutes only; a springs file can state them",
        )
    if printed:
        law, why = Cubic(coefficients, -1, zone, rest), "As printed: the moment resists"
        why += f"; {_zone_said(zone)} is given." if zone else ", without a dead zone."
    else:
        bounded = is_bounded(joint, direction)
        try:
            law = passive_cubic(coefficients, zone, rest, bounded=bounded)
        except NotRestoringError as failure:
            _refuse(joint.name, failure, record.origins.get("coefficients"), findings)
            return None
        why = rule_said(coefficients, law, zone_given=zone is not None)
    if negated and not is_revolute:
        why += " Negated on reading, since the joint declares the axis negative."
    return AxisSpring(
        direction,
        (law,),
        Damping(record.viscous, record.coulomb),
        reference=Path(place.source.name).name if place else "",
        why=why,
    )


def entry_spring(
    joint: str, entry: SpringEntry, direction: Vector, findings: Findings, *, bounded: bool
) -> AxisSpring | None:
    """The law of one table for one joint; None, with a fault noted, when it is none.

    Args:
        joint: its name.
        entry: the table.
        direction: the axis in the joint's frame.
        findings: for faults.
        bounded: whether stops bound the range, as for `passive_cubic`.
    """
    law, why = _main_law(joint, entry, findings, bounded=bounded)
    if law is None:
        return None if entry.coefficients is not None else _damper(direction, entry)
    changed = changed_law(law, entry.scale, entry.offset, entry.hysteresis, entry.slip)
    if not is_finite(changed):
        findings.error(
            f"the torque of this law of `{shorten(joint)}` is too large for a number within a turn",
            _law_place(entry),
            "are its rates for angles in rad?",
        )
        return None
    return AxisSpring(
        direction, (changed,), entry.damping, entry.motion, entry.reference, why or entry.why
    )


def _damper(direction: Vector, entry: SpringEntry) -> AxisSpring:
    """A spring of a table without an elastic law."""
    return AxisSpring(direction, (), entry.damping, entry.motion, entry.reference, entry.why)


def _law_place(entry: SpringEntry) -> Span | None:
    """Where the law of a table is written."""
    found = (entry.origins[key] for key in ELASTIC_KEYS if key in entry.origins)
    return next(found, entry.origins.get("spring"))


def _main_law(
    joint: str, entry: SpringEntry, findings: Findings, *, bounded: bool
) -> tuple[Elastic | None, str]:
    """The law of a table before it is changed, and why it is read so where the rule reads it."""
    if isinstance(entry.law, PublishedLaw):
        return entry.law.law, ""
    if entry.law is not None:
        return entry.law, ""
    if entry.stiffness is not None:
        return Linear(entry.stiffness, entry.rest), ""
    if entry.coefficients is None:
        return None, ""
    try:
        ruled = passive_cubic(entry.coefficients, entry.dead_zone, entry.rest, bounded=bounded)
    except NotRestoringError as failure:
        _refuse(joint, failure, entry.origins.get("coefficients_Nm_rad"), findings)
        return None, ""
    law = replace(ruled, sense=entry.sense or ruled.sense)
    if entry.dead_zone_stated:
        law = replace(law, dead_zone=entry.dead_zone)
    if law.sense != ruled.sense:
        findings.warning(
            "in this sense the cubic drives the joint away at both ends",
            entry.origins.get("sense"),
            f"the sense that restores is {ruled.sense:+d}",
        )
    if not entry.why and entry.sense is None:
        return law, rule_said(entry.coefficients, law, zone_given=entry.dead_zone_stated)
    return law, ""


def _refuse(joint: str, failure: NotRestoringError, place: Span | None, findings: Findings) -> None:
    findings.error(
        f"no sense makes this cubic of `{shorten(joint)}` restoring: {failure}",
        place,
        "give the axis limits on both sides (`llimit`, `ulimit`) or another cubic",
    )


def without_repeats(given: list[GivenSpring], findings: Findings) -> list[GivenSpring]:
    """Each axis of a joint once; a second spring is a fault."""
    kept: list[GivenSpring] = []
    by_joint: dict[str, list[GivenSpring]] = {}
    for one in given:
        others = by_joint.setdefault(one.joint, [])
        same = [o for o in others if sign_along(o.spring.direction, one.spring.direction)]
        if not same:
            others.append(one)
            kept.append(one)
            continue
        first = same[0].place
        findings.error(
            f"a second spring about one axis of `{shorten(one.joint)}`",
            one.place,
            f"the first stands in line {first.line}" if first else "",
        )
    return kept


def rule_said(coefficients: Coefficients, law: Cubic, *, zone_given: bool) -> str:
    """In a sentence: how the rule came to the sense and the dead zone of a cubic."""
    _, c1, c2, c3 = coefficients
    acts = "the moment resists" if law.sense == -1 else "the moment acts on the child"
    if c3 != 0.0:
        first = f"c3 is {'positive' if c3 > 0.0 else 'negative'}, so {acts}"
    elif c2 == 0.0 and c1 != 0.0:
        first = f"c3 is zero and c1 is {'positive' if c1 > 0.0 else 'negative'}, so {acts}"
    else:
        first = f"No sense restores at both ends; the limits bound the range, and {acts}"
    if law.dead_zone is None:
        return f"{first}; there is no dead zone."
    origin = "is given" if zone_given else "lies between the outer two of three roots"
    return f"{first}; {_zone_said(law.dead_zone)} {origin}."


def _zone_said(zone: tuple[float, float]) -> str:
    low, high = (degrees(edge) for edge in zone)
    return f"the dead zone, {low:.1f} to {high:.1f} deg,"
