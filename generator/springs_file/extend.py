"""Springs of a file laid over those of the file that it extends."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import degrees

from generator.diagnostics import Diagnostics, shorten
from generator.springs_file.axes import is_slide, parallel_sign
from generator.springs_file.bind import BoundEntry, is_about
from generator.springs_file.parse import SpringEntry
from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    Damping,
    JointSprings,
    Reach,
    SpringSet,
    Stop,
)
from springs.axis import Direction
from springs.stop import DEFAULT_STOP_ONSET, DEFAULT_STOP_STIFFNESS


def extend_springs(
    base: SpringSet,
    own: Sequence[BoundEntry],
    coupled: Sequence[CoupledSpring],
    reaches: Mapping[str, Reach],
    diagnostics: Diagnostics,
) -> SpringSet:
    """Return the springs of a file, and those of `base` that they do not replace.

    A law replaces the law of `base` about the same axis, as does a law over several joints with
    that axis, and a reach those about all axes of its joint; damping replaces damping. What is
    not stated about an axis stays: a law over several joints of `base` acts about the axes
    without a curve here, as with the others held.

    Each spring has a stop without limits, with the stiffness and onset of the files; a figure gives
    the limits.

    Args:
        base: springs of the extended file; none for a file that stands alone.
        own: springs about one axis of one joint each.
        coupled: laws over several joints.
        reaches: directions that limbs reach, by joint.
        diagnostics: diagnostics for curves about axes of reaches and, as warnings, for laws
            over several joints that lose an axis.
    """
    own_axes = [axis for spring in coupled for axis in spring.axes]
    kept_coupled = [
        spring
        for spring in base.coupled
        if not any(_has_axis(own_axes, axis.joint, axis.direction) for axis in spring.axes)
    ]
    curves = [
        (entry, spring) for entry, spring in own if spring.elastic and not is_slide(entry.axis)
    ]
    axes = {name: list(joint.axes) for name, joint in base.joints.items()}
    kept_coupled = _hold_named_axes(curves, kept_coupled, axes, base.origin, diagnostics)
    joints: dict[str, JointSprings] = {}
    for name in dict.fromkeys([*axes, *(entry.joints[0] for entry, _ in own), *reaches]):
        below = base.joints.get(name, JointSprings(name))
        covered = [
            replace(one, elastic=(stop_of(one),), reference="", why="")
            if name in reaches or _has_axis(own_axes, name, one.direction)
            else one
            for one in axes.get(name, [])
        ]
        merged = tuple(_merge(_of_joint(own, name), covered))
        reach = reaches.get(name, below.reach)
        if reach is not None:
            damped = (one for one in merged if one.damping != Damping())
            merged = tuple(replace(one, elastic=()) for one in damped)
        slides = tuple(_merge(_of_joint(own, name, slides=True), below.translations))
        joints[name] = JointSprings(name, merged, slides, reach)
    for entry, _ in curves:
        (name,) = entry.joints
        if name not in reaches and joints[name].reach:
            diagnostics.error(
                f"`{shorten(name)}` has a reach in {base.origin}: axes have damping only",
                entry.origins.get("joints.0"),
                "extend other springs, or state the reach here",
            )
    return replace(base, joints=joints, coupled=(*coupled, *kept_coupled))


def _of_joint(own: Sequence[BoundEntry], name: str, *, slides: bool = False) -> list[BoundEntry]:
    """Return the springs about axes of a joint, or along its translations."""
    wanted = ((name,), slides)
    return [(entry, one) for entry, one in own if (entry.joints, is_slide(entry.axis)) == wanted]


def stop_of(spring: AxisSpring) -> Stop:
    """First stop of a spring; the default one without limits if it has none."""
    return next((law for law in spring.elastic if isinstance(law, Stop)), Stop(None, None))


def _hold_named_axes(
    named: Sequence[BoundEntry],
    laws: Sequence[CoupledSpring],
    axes_of: dict[str, list[AxisSpring]],
    origin: str,
    diagnostics: Diagnostics,
) -> list[CoupledSpring]:
    """Return laws over several joints without torque about named axes.

    A law becomes that with each of these angles held, so that a gradient stays one: in the middle
    of the range in which the law is known, or at 0. About a single axis it becomes a curve, which
    is added to the springs of the joint in `axes_of`.
    """
    kept: list[CoupledSpring] = []
    affected: dict[tuple[str, str, str], list[SpringEntry]] = {}
    for spring in laws:
        law, axes, curves, fixed = spring.law, list[CoupledAxis](), list[SpringEntry](), list[str]()
        for k, (name, axis) in enumerate(zip(spring.law.coordinates, spring.axes, strict=True)):
            matches = (one for one in named if is_about(one, axis.joint, axis.direction))
            curve, _ = next(matches, (None, None))
            if curve is None:
                axes.append(axis)
                continue
            low, high = spring.law.valid_ranges[k] or (0.0, 0.0)
            middle = 0.5 * (low + high)
            law = law.hold_coordinate(name, middle)
            fixed.append(f"{name} were {degrees(middle):.4g} deg")
            curves.append(curve)
        if len(axes) == 1:
            curve = replace(spring, law=law, axes=tuple(axes))
            _add_curve(axes_of.setdefault(axes[0].joint, []), curve)
        elif axes:
            original = None if curves else spring.original
            kept.append(replace(spring, law=law, axes=tuple(axes), original=original))
        if curves and axes:
            all_names, names = map(", ".join, (spring.law.coordinates, law.coordinates))
            affected.setdefault((all_names, names, ", ".join(fixed)), []).extend(curves)
    for (all_names, names, fixed), curves in affected.items():
        joints = " and ".join(f"`{shorten(one.joints[0])}`" for one in curves)
        diagnostics.warning(
            f"the law of {all_names} in {origin} acts about {names} only, as if {fixed} "
            f"all the time: {joints} {'has' if len(curves) == 1 else 'have'} curves of this file",
            curves[0].origins.get("joints.0"),
            f"for another angle, state a law of {names} here",
        )
    return kept


def _add_curve(springs: list[AxisSpring], coupled: CoupledSpring) -> None:
    """Add the law of a single axis to the springs of its joint."""
    (name,), (axis,) = coupled.law.coordinates, coupled.axes
    law = coupled.law.single_angle_law(name, {})
    for k, one in enumerate(springs):
        sign = parallel_sign(one.direction, axis.direction)
        if sign:
            springs[k] = replace(
                one,
                elastic=(
                    *one.laws_besides_stops,
                    law if sign > 0 else law.mirrored(),
                    stop_of(one),
                ),
                reference="; ".join(filter(None, (one.reference, coupled.reference))),
                why=" ".join(filter(None, (one.why, coupled.why))),
            )
            return
    motion = name.partition(" ")[2]
    made = AxisSpring(axis.direction, (law,), motion=motion, reference=coupled.reference)
    springs.append(replace(made, why=coupled.why))


def _has_axis(axes: Sequence[CoupledAxis], joint: str, direction: Direction) -> bool:
    """Return whether an axis of a joint, in either sense, is among `axes`."""
    return any(one.joint == joint and parallel_sign(one.direction, direction) for one in axes)


def _merge(own: Sequence[BoundEntry], base: Sequence[AxisSpring]) -> Iterator[AxisSpring]:
    """Yield the springs of `base` as `own` changes them, then the others of `own`."""
    others = list(own)
    for below in base:
        above = next((o for o in own if parallel_sign(o[1].direction, below.direction)), None)
        if above is not None:
            others = [one for one in others if one is not above]
            yield _lay_over(*above, below)
        else:
            yield below
    for entry, spring in others:
        yield _lay_over(entry, spring, AxisSpring(spring.direction))


def _lay_over(entry: SpringEntry, spring: AxisSpring, below: AxisSpring) -> AxisSpring:
    """Return the spring of a table, with what it does not state from the one below."""
    below = below.oriented_along(spring.direction)
    under, laws = stop_of(below), below.laws_besides_stops
    inherits = bool(laws) and not spring.elastic
    stop = Stop(
        None,
        None,
        _stated(entry.stop_stiffness, under.stiffness, DEFAULT_STOP_STIFFNESS),
        _stated(entry.stop_onset, under.onset, DEFAULT_STOP_ONSET),
    )
    return replace(
        spring,
        elastic=(*(spring.elastic or laws), stop),
        damping=below.damping if entry.damping is None else spring.damping,
        motion=spring.motion or below.motion,
        reference=spring.reference or (below.reference if inherits else ""),
        why=spring.why or (below.why if inherits else ""),
    )


def _stated(above: float, below: float, default: float) -> float:
    """Return the value of a file, or that of the extended one where it is left at its default."""
    return below if above == default else above
