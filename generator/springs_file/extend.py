"""Springs of a file laid over those of the file that it extends."""

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, replace
from math import degrees

from generator.diagnostics import Diagnostics, shorten
from generator.springs_file.axes import parallel_sign
from generator.springs_file.bind import BoundSpring
from generator.springs_file.bind_reach import BoundReach
from springs import AxisSpring, CoupledAxis, CoupledSpring, Damping, SphericalLaw
from springs.axis import Direction
from springs.stop import DEFAULT_STOP_ONSET, DEFAULT_STOP_STIFFNESS


@dataclass(frozen=True)
class FileSprings:
    """Springs of a file, bound to the joints of a figure.

    Attributes:
        origin: the file's name, followed by those that it extends.
        springs: springs about one axis of one joint each.
        coupled: coupled over several joints.
        reaches: directions that limbs reach.
        law: law of spherical joints.
    """

    origin: str
    springs: tuple[BoundSpring, ...] = ()
    coupled: tuple[CoupledSpring, ...] = ()
    law: SphericalLaw | None = None
    reaches: tuple[BoundReach, ...] = ()

    def extend(self, base: "FileSprings", diagnostics: Diagnostics) -> "FileSprings":
        """Return these springs, and those of `base` that they do not replace.

        A law replaces the law of `base` about the same axis, as does a law over several joints with
        that axis, and a reach those about all axes of its joint; damping replaces damping. What is
        not stated about an axis stays: a law over several joints of `base` acts about the axes
        without a curve here, as with the others held.

        Args:
            base: springs of the extended file.
            diagnostics: diagnostics for curves about axes of reaches and, as warnings, for laws
                over several joints that lose an axis.
        """
        own_axes = [axis for spring in self.coupled for axis in _axes(spring)]
        kept_coupled = tuple(
            spring
            for spring in base.coupled
            if not any(_has_axis(own_axes, *axis) for axis in _axes(spring))
        )
        elastic = [one for one in self.springs if one.spring.elastic and not one.slides]
        kept_coupled, base_springs = _hold_named_axes(elastic, kept_coupled, base, diagnostics)
        reached = {one.joint for one in self.reaches}
        kept_reaches = tuple(one for one in base.reaches if one.joint not in reached)
        for one in elastic:
            if any(one.joint == other.joint for other in kept_reaches):
                diagnostics.error(
                    f"`{shorten(one.joint)}` has a reach in {base.origin}: axes have damping only",
                    one.span,
                    "extend other springs, or state the reach here",
                )
        return FileSprings(
            f"{self.origin} over {base.origin}",
            tuple(_merge(self.springs, base_springs, own_axes, reached)),
            (*self.coupled, *kept_coupled),
            self.law or base.law,
            (*self.reaches, *kept_reaches),
        )


def _hold_named_axes(
    named: Sequence[BoundSpring],
    laws: Sequence[CoupledSpring],
    base: FileSprings,
    diagnostics: Diagnostics,
) -> tuple[tuple[CoupledSpring, ...], tuple[BoundSpring, ...]]:
    """Return laws over several joints, and the springs of `base`, without torque about named axes.

    A law becomes that with each of these angles held, so that a gradient stays one: in the middle
    of the range in which the law is known, or at 0. About a single axis it becomes a curve.
    """
    kept: list[CoupledSpring] = []
    springs = list(base.springs)
    affected: dict[tuple[str, str, str], list[BoundSpring]] = {}
    for spring in laws:
        law, axes, curves, fixed = spring.law, list[CoupledAxis](), list[BoundSpring](), list[str]()
        for k, (name, axis) in enumerate(zip(spring.law.coordinates, spring.axes, strict=True)):
            curve = next((o for o in named if o.is_about(axis.joint, axis.direction)), None)
            if curve is None:
                axes.append(axis)
                continue
            low, high = spring.law.valid_ranges[k] or (0.0, 0.0)
            middle = 0.5 * (low + high)
            law = law.hold_coordinate(name, middle)
            fixed.append(f"{name} were {degrees(middle):.4g} deg")
            curves.append(curve)
        if len(axes) == 1:
            _add_curve(springs, replace(spring, law=law, axes=tuple(axes)))
        elif axes:
            original = None if curves else spring.original
            kept.append(replace(spring, law=law, axes=tuple(axes), original=original))
        if curves and axes:
            all_names, names = map(", ".join, (spring.law.coordinates, law.coordinates))
            affected.setdefault((all_names, names, ", ".join(fixed)), []).extend(curves)
    for (all_names, names, fixed), curves in affected.items():
        joints = " and ".join(f"`{shorten(one.joint)}`" for one in curves)
        diagnostics.warning(
            f"the law of {all_names} in {base.origin} acts about {names} only, as if {fixed} "
            f"all the time: {joints} {'has' if len(curves) == 1 else 'have'} curves of this file",
            curves[0].span,
            f"for another angle, state a law of {names} here",
        )
    return tuple(kept), tuple(springs)


def _add_curve(springs: list[BoundSpring], coupled: CoupledSpring) -> None:
    """Add the law of a single axis to the springs."""
    (name,), (axis,) = coupled.law.coordinates, coupled.axes
    law = coupled.law.single_angle_law(name, {})
    for k, one in enumerate(springs):
        if one.is_about(axis.joint, axis.direction):
            same = parallel_sign(one.spring.direction, axis.direction) > 0
            spring = replace(
                one.spring,
                elastic=(*one.spring.elastic, law if same else law.mirrored()),
                reference="; ".join(filter(None, (one.spring.reference, coupled.reference))),
                why=" ".join(filter(None, (one.spring.why, coupled.why))),
            )
            springs[k] = replace(one, spring=spring)
            return
    motion = name.partition(" ")[2]
    made = AxisSpring(axis.direction, (law,), motion=motion, reference=coupled.reference)
    springs.append(BoundSpring(axis.joint, replace(made, why=coupled.why), None))


_JointAxis = tuple[str, Direction]


def _axes(spring: CoupledSpring) -> list[_JointAxis]:
    return [(axis.joint, axis.direction) for axis in spring.axes]


def _has_axis(axes: list[_JointAxis], joint: str, direction: Direction) -> bool:
    """Return whether an axis of a joint, in either sense, is among `axes`."""
    return any(name == joint and parallel_sign(other, direction) != 0 for name, other in axes)


def _merge(
    own: tuple[BoundSpring, ...],
    base: tuple[BoundSpring, ...],
    coupled_axes: list[_JointAxis],
    reached: Container[str],
) -> Iterator[BoundSpring]:
    """Yield the springs of `base` as `own` changes them, then the others of `own`."""
    used: list[BoundSpring] = []
    for below in base:
        above = next(
            (
                one
                for one in own
                if one.is_about(below.joint, below.spring.direction, slides=below.slides)
            ),
            None,
        )
        is_coupled = _has_axis(coupled_axes, below.joint, below.spring.direction)
        kept = below.spring
        if not below.slides and (is_coupled or below.joint in reached):
            kept = replace(kept, elastic=(), reference="", why="")
        if above is None:
            if kept.elastic or kept.damping != Damping():
                yield replace(below, spring=kept)
            continue
        used.append(above)
        if parallel_sign(above.spring.direction, kept.direction) < 0:
            kept = kept.with_opposite_axis()
        spring = replace(above.spring, motion=above.spring.motion or kept.motion)
        if not above.has_damping:
            spring = replace(spring, damping=kept.damping)
        if not spring.elastic and kept.elastic:
            spring = replace(
                spring,
                elastic=kept.elastic,
                reference=spring.reference or kept.reference,
                why=spring.why or kept.why,
            )
        yield replace(
            above,
            spring=spring,
            stop_stiffness=_stated(
                above.stop_stiffness, below.stop_stiffness, DEFAULT_STOP_STIFFNESS
            ),
            stop_onset=_stated(above.stop_onset, below.stop_onset, DEFAULT_STOP_ONSET),
        )
    yield from (one for one in own if one not in used)


def _stated(above: float, below: float, default: float) -> float:
    """Return the value of a file, or that of the extended one where it is left at its default."""
    return below if above == default else above
