"""Binding of the reaches of a springs file to the joints of a figure."""

from collections.abc import Iterator
from dataclasses import replace

from generator.diagnostics import Diagnostics, Span, shorten
from generator.figure import Figure, Joint, Vector
from generator.springs_file.axes import (
    AXIS_NAMES,
    AxisError,
    axis_by_name,
    axis_label,
    find_joint,
    parallel_sign,
    rotation_axes,
)
from generator.springs_file.bind import spring_from_entry
from generator.springs_file.parse import REACH_AXES, SpringsFile
from generator.springs_file.reach import LONG_AXES, ReachEntry
from springs import AxisSpring, Damping, Reach, ReachPoint, Stop
from springs.axis import UNKNOWN_AXIS
from springs.reach import NO_LAW

_LEAST_TORQUE = 1e-6
"""Torque at the centre of a reach from which there is a warning [N m]."""

_STOP_ONLY = replace(NO_LAW, elastic=(Stop(None, 0.0),))
"""Law of a reach without a curve: the stop at its end."""


def bind_reaches(
    figure: Figure, content: SpringsFile, diagnostics: Diagnostics
) -> dict[str, Reach]:
    """Return the reaches of a file by joint, with the laws of springs whose axis is of a reach."""
    found: dict[str, Reach] = {}
    for entry in content.reaches:
        for k, name in enumerate(entry.joints):
            span = entry.origins.get(f"joints.{k}")
            joint = find_joint(figure, name, span, diagnostics)
            if name in found:
                diagnostics.error(f"a second reach of `{shorten(name)}`", span)
            elif joint is not None:
                reach = _build_reach(joint, entry, content, span, diagnostics)
                if reach is not None:
                    found[name] = reach
    reached = {name for entry in content.reaches for name in entry.joints}
    for entry in content.entries:
        for k, name in enumerate(entry.joints):
            span = entry.origins.get(f"joints.{k}")
            if entry.axis in REACH_AXES and name not in reached:
                hint = "a table `[[reach]]` states it"
                diagnostics.error(f"joint `{shorten(name)}` has no reach in this file", span, hint)
            elif entry.axis not in REACH_AXES and name in reached and entry.law is not None:
                hint = 'its laws have the axis "reach" or "turn"'
                message = f"joint `{shorten(name)}` has a reach: its axes have damping only"
                diagnostics.error(message, span, hint)
    return found


def _build_reach(
    joint: Joint,
    entry: ReachEntry,
    content: SpringsFile,
    span: Span | None,
    diagnostics: Diagnostics,
) -> Reach | None:
    """Return the reach of a joint; None with a fault noted."""
    if len(rotation_axes(joint)) != 3:
        hint = "a reach is of a joint with three rotations"
        message = f"joint `{shorten(joint.name)}` does not turn about three axes"
        diagnostics.error(message, span, hint)
        return None
    beyond, turn = (_law(joint, axis, content, diagnostics) for axis in REACH_AXES)
    try:
        first, second = (axis_by_name(joint, name) for name in entry.planes)
        declared = axis_by_name(joint, entry.long_axis[-1])
        long_axis = _axis_vector(entry.long_axis)
        reach = Reach(
            long_axis,
            (first, second),
            ReachPoint(*entry.centre),
            entry.boundary,
            entry.turns,
            entry.harmonics,
            float(parallel_sign(long_axis, declared) or 1),
            beyond,
            turn,
            entry.reference,
            entry.why,
        )
    except AxisError as fault:
        diagnostics.error(str(fault), entry.origins.get("planes") or span, fault.hint)
        return None
    except ValueError as fault:
        diagnostics.error(str(fault), entry.origins.get("boundary_deg") or span)
        return None
    if abs(reach.torque_at_centre) > _LEAST_TORQUE:
        diagnostics.warning(
            f"the reach of `{shorten(joint.name)}` pushes with {reach.torque_at_centre:.3g} N m at "
            "its centre, where the way to the boundary has no direction",
            span,
            "a law of a reach begins near the boundary, as limits do",
        )
    return reach


def _law(joint: Joint, axis: str, content: SpringsFile, diagnostics: Diagnostics) -> AxisSpring:
    """Return the law of an axis of a reach, with the stop at its end."""
    entries = [one for one in content.entries if one.axis == axis and joint.name in one.joints]
    for second in entries[1:]:
        span = second.origins.get("spring")
        diagnostics.error(f"a second law of the {axis} of `{shorten(joint.name)}`", span)
    if not entries:
        return _STOP_ONLY
    (entry, *_) = entries
    if entry.damping is not None and entry.damping != Damping():
        hint = "the joint's axes have it"
        diagnostics.error("a law of a reach has no damping", entry.origins.get("spring"), hint)
    stop = Stop(None, 0.0, entry.stop_stiffness, entry.stop_onset)
    spring = spring_from_entry(joint.name, entry, UNKNOWN_AXIS, diagnostics, bounded=False)
    found = NO_LAW if spring is None else replace(spring, damping=Damping())
    return replace(found, elastic=(*found.elastic, stop))


def _axis_vector(name: str) -> Vector:
    sign = -1.0 if name.startswith("-") else 1.0
    x, y, z = (sign if letter == name[-1] else 0.0 for letter in AXIS_NAMES)
    return x, y, z


def reach_entry(joint: Joint, reach: Reach) -> ReachEntry:
    """Return the table of a reach, without its laws."""
    return ReachEntry(
        (joint.name,),
        next(name for name in LONG_AXES if _axis_vector(name) == reach.long_axis),
        tuple(axis_label(axis).lstrip("-") for axis in reach.planes),
        (reach.centre.plane, reach.centre.elevation),
        reach.boundary,
        reach.turns,
        reach.harmonics,
        reach.reference,
        reach.why,
    )


def reach_laws(reach: Reach) -> Iterator[tuple[str, AxisSpring]]:
    """Yield the laws of a reach that a file states, by the names of their axes."""
    for axis, law in zip(REACH_AXES, (reach.beyond, reach.turn), strict=True):
        if law != _STOP_ONLY:
            yield axis, law
