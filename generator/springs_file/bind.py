"""Binding of the springs of a file to the joints of a figure."""

from collections.abc import Iterable
from dataclasses import replace
from math import degrees
from pathlib import Path
from typing import TypeAlias

from generator.diagnostics import Diagnostics, Span, shorten
from generator.figure import Figure, Joint, Vector
from generator.springs_file.axes import (
    AxisError,
    axis_by_number,
    find_axis,
    is_bounded,
    is_slide,
    parallel_sign,
    rotation_axes,
)
from generator.springs_file.laws import (
    COEFFICIENTS_KEY,
    ELASTIC_KEYS,
    CubicEntry,
    SlideEntry,
    is_finite,
)
from generator.springs_file.optional import OptionalRecord
from generator.springs_file.parse import REACH_AXES, SpringEntry, SpringsFile
from generator.springs_file.published import PublishedLaw
from springs import (
    AxisSpring,
    Coefficients,
    Cubic,
    Damping,
    Elastic,
    NotRestoringError,
    passive_cubic,
)
from springs.hysteresis import Hysteresis
from springs.transformed import Transformed

BoundEntry: TypeAlias = tuple[SpringEntry, AxisSpring]
"""A table for a single joint, and its law and damping bound to the axis of this joint."""


def bind_optional_records(
    figure: Figure,
    records: Iterable[OptionalRecord],
    use_printed_values: bool,
    diagnostics: Diagnostics,
) -> list[BoundEntry]:
    """Bind the springs of an `optional` file.

    The tables give the moment about the positive axis at the angle about the declared one, so a
    spherical axis that is declared negative has its coefficients negated. alpha_0, alpha_l and
    alpha_u count for revolutes only.

    Args:
        figure: the figure whose joints the records count.
        records: records as read.
        use_printed_values: take every moment as the resisting one and no dead zone from roots.
        diagnostics: diagnostics for faults.
    """
    bound: list[BoundEntry] = []
    for record in records:
        place = record.origins.get("axis")
        joint = _joint_by_number(figure, record.joint, place, diagnostics)
        if joint is None:
            continue
        try:
            direction = axis_by_number(joint, record.axis)
        except AxisError as fault:
            diagnostics.error(str(fault), place, fault.hint)
            continue
        spring = _spring_from_record(joint, record, direction, use_printed_values, diagnostics)
        if spring is not None:
            origins = {} if place is None else {"joints.0": place}
            entry = SpringEntry((joint.name,), damping=spring.damping, origins=origins)
            bound.append((entry, spring))
    return _drop_duplicates(bound, diagnostics)


def bind_springs_file(
    figure: Figure | None, content: SpringsFile, diagnostics: Diagnostics
) -> list[BoundEntry]:
    """Bind the springs about axes, each joint of a table by itself.

    A stated sense or dead zone overrides the rule.

    Args:
        figure: the figure; None if it is not known, so that no limits bound an axis.
        content: the file.
        diagnostics: diagnostics for faults.
    """
    bound: list[BoundEntry] = []
    for table in content.entries:
        for k, name in enumerate(() if table.axis in REACH_AXES else table.joints):
            origins = dict(table.origins)
            if origins:
                origins["joints.0"] = origins[f"joints.{k}"]
            entry = replace(table, joints=(name,), origins=origins)
            place, axis_place = (origins.get(key) for key in ("joints.0", "axis"))
            direction = find_axis(figure, name, entry.axis, diagnostics, place, axis_place)
            if direction is not None:
                bounded = figure is not None and is_bounded(figure.joints[name], direction)
                spring = spring_from_entry(name, entry, direction, diagnostics, bounded=bounded)
                if spring is not None:
                    bound.append((entry, spring))
    return _drop_duplicates(bound, diagnostics)


def _joint_by_number(
    figure: Figure, number: int, span: Span | None, diagnostics: Diagnostics
) -> Joint | None:
    names = list(figure.joints)
    if number <= len(names):
        return figure.joints[names[number - 1]]
    has = "1 joint" if len(names) == 1 else f"{len(names)} joints"
    diagnostics.error(
        f"there is no joint number {number}", span, f"the figure has {has}, counted from 1"
    )
    return None


def _spring_from_record(
    joint: Joint,
    record: OptionalRecord,
    direction: Vector,
    use_printed_values: bool,
    diagnostics: Diagnostics,
) -> AxisSpring | None:
    """Return the law of one record; None with a fault noted."""
    coefficients, rest, zone = record.coefficients, 0.0, None
    is_revolute, negated = len(rotation_axes(joint)) == 1, sum(direction) < 0.0
    if is_revolute:
        rest = record.rest
        if record.dead_zone != (0.0, 0.0):
            zone = record.dead_zone
    elif negated:
        c0, c1, c2, c3 = coefficients
        coefficients = (-c0, -c1, -c2, -c3)
    place = record.origins.get("dead_zone")
    if zone is not None and zone[0] > zone[1]:
        diagnostics.error("the dead zone ends before it begins", place, "alpha_0 alpha_l alpha_u")
        return None
    if not is_revolute and (record.rest, *record.dead_zone) != (0.0, 0.0, 0.0):
        diagnostics.warning(
            f"rest and dead zone of `{shorten(joint.name)}` are not used",
            place,
            "these numbers count for revolutes only; a springs file can state them",
        )
    if use_printed_values:
        law, why = Cubic(coefficients, -1, zone, rest), "As printed: the moment resists"
        why += f"; {_describe_dead_zone(zone)} is given." if zone else ", without a dead zone."
    else:
        bounded = is_bounded(joint, direction)
        try:
            law = passive_cubic(coefficients, zone, rest, bounded=bounded)
        except NotRestoringError as failure:
            _report_not_restoring(
                joint.name, failure, record.origins.get("coefficients"), diagnostics
            )
            return None
        why = describe_sense_rule(coefficients, law, zone_is_stated=zone is not None)
    if negated and not is_revolute:
        why += " Negated on reading, since the joint declares the axis negative."
    return AxisSpring(
        direction,
        (law,),
        Damping(record.viscous, record.coulomb),
        reference=Path(place.source.name).name if place else "",
        why=why,
    )


def spring_from_entry(
    joint: str, entry: SpringEntry, direction: Vector, diagnostics: Diagnostics, *, bounded: bool
) -> AxisSpring | None:
    """Return the law of one table for one joint; None with a fault noted.

    Args:
        joint: its name.
        entry: the table.
        direction: the axis in the joint's frame.
        diagnostics: diagnostics for faults.
        bounded: whether stops bound the range, as for `passive_cubic`.
    """
    law, why = _base_law(joint, entry, diagnostics, bounded=bounded)
    if law is None and entry.law is not None:
        return None
    if law is not None:
        law = modified_law(law, entry.scale, entry.offset, entry.hysteresis, entry.slip_rate)
        if not is_finite(law):
            diagnostics.error(
                f"the torque of this law of `{shorten(joint)}` is too large for a number within a "
                "turn",
                _law_span(entry),
                "are its rates for angles in rad?",
            )
            return None
    return AxisSpring(
        direction,
        () if law is None else (law,),
        entry.damping or Damping(),
        entry.motion,
        entry.reference,
        why or entry.why,
    )


def modified_law(
    law: Elastic, scale: float, offset: float, hysteresis: float, slip_rate: float
) -> Elastic:
    """Return a law scaled and shifted, then split by the direction of motion.

    Args:
        law: law as written.
        scale: factor of its torque.
        offset: shift towards larger angles [rad].
        hysteresis: difference of the curves of a decreasing and an increasing angle [N m].
        slip_rate: rate at which friction reaches 76 % of its full value [rad/s].
    """
    if isinstance(law, Hysteresis):
        up, down = (
            _scale_and_shift(one, scale, offset) for one in (law.increasing, law.decreasing)
        )
        return Hysteresis(up, down, slip_rate)
    moved = _scale_and_shift(law, scale, offset)
    return Hysteresis.from_mean_and_width(moved, hysteresis, slip_rate) if hysteresis else moved


def _scale_and_shift(law: Elastic, scale: float, offset: float) -> Elastic:
    return law if (scale, offset) == (1.0, 0.0) else Transformed(law, scale, offset)


def _law_span(entry: SpringEntry) -> Span | None:
    """Span of the law of a table."""
    found = (entry.origins[key] for key in ELASTIC_KEYS if key in entry.origins)
    return next(found, entry.origins.get("spring"))


def _base_law(
    joint: str, entry: SpringEntry, diagnostics: Diagnostics, *, bounded: bool
) -> tuple[Elastic | None, str]:
    """Return the law of a table before its modifiers, and how the rule of a cubic read it."""
    stated = entry.law
    if isinstance(stated, PublishedLaw | SlideEntry):
        return stated.law, ""
    if not isinstance(stated, CubicEntry):
        return stated, ""
    try:
        ruled = passive_cubic(stated.coefficients, stated.dead_zone, stated.rest, bounded=bounded)
    except NotRestoringError as failure:
        _report_not_restoring(joint, failure, entry.origins.get(COEFFICIENTS_KEY), diagnostics)
        return None, ""
    law = replace(ruled, sense=stated.sense or ruled.sense)
    if stated.dead_zone_stated:
        law = replace(law, dead_zone=stated.dead_zone)
    if law.sense != ruled.sense:
        diagnostics.warning(
            "in this sense the cubic drives the joint away at both ends",
            entry.origins.get("sense"),
            f"the sense that restores is {ruled.sense:+d}",
        )
    if not entry.why and stated.sense is None:
        return law, describe_sense_rule(
            stated.coefficients, law, zone_is_stated=stated.dead_zone_stated
        )
    return law, ""


def _report_not_restoring(
    joint: str, failure: NotRestoringError, span: Span | None, diagnostics: Diagnostics
) -> None:
    diagnostics.error(
        f"no sense makes this cubic of `{shorten(joint)}` restoring: {failure}",
        span,
        "give the axis limits on both sides (`llimit`, `ulimit`) or another cubic",
    )


def is_about(bound: BoundEntry, joint: str, direction: Vector, *, slides: bool = False) -> bool:
    """Return whether a spring is about an axis of a joint in either sense, or along it."""
    entry, spring = bound
    is_same = (entry.joints, is_slide(entry.axis)) == ((joint,), slides)
    return is_same and parallel_sign(spring.direction, direction) != 0


def _drop_duplicates(bound: list[BoundEntry], diagnostics: Diagnostics) -> list[BoundEntry]:
    """Return the first spring of each axis of a joint; report the others."""
    kept: dict[str, list[BoundEntry]] = {}
    for entry, spring in bound:
        (name,), slides = entry.joints, is_slide(entry.axis)
        others = kept.setdefault(name, [])
        same = [o for o in others if is_about(o, name, spring.direction, slides=slides)]
        if not same:
            others.append((entry, spring))
            continue
        first = same[0][0].origins.get("joints.0")
        diagnostics.error(
            f"a second spring {'along' if slides else 'about'} one axis of `{shorten(name)}`",
            entry.origins.get("joints.0"),
            f"the first is in line {first.line}" if first else "",
        )
    return [one for others in kept.values() for one in others]


def describe_sense_rule(coefficients: Coefficients, law: Cubic, *, zone_is_stated: bool) -> str:
    """Explain in a sentence how the rule chose the sense and the dead zone of a cubic."""
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
    origin = "is given" if zone_is_stated else "lies between the outer two of three roots"
    return f"{first}; {_describe_dead_zone(law.dead_zone)} {origin}."


def _describe_dead_zone(zone: tuple[float, float]) -> str:
    low, high = (degrees(edge) for edge in zone)
    return f"the dead zone, {low:.1f} to {high:.1f} deg,"
