"""Springs of a file laid over those of the file that it extends."""

from collections.abc import Container, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from generator.diagnostics import Diagnostics, shorten
from generator.springs_file.axes import parallel_sign
from generator.springs_file.bind import BoundSpring
from generator.springs_file.bind_reach import BoundReach
from springs import CoupledSpring, Damping, SphericalLaw
from springs.axis import Direction
from springs.stop import DEFAULT_STOP_ONSET, DEFAULT_STOP_STIFFNESS

if TYPE_CHECKING:
    from springs.lint.report import LawReplacement


@dataclass(frozen=True)
class FileSprings:
    """Springs of a file, bound to the joints of a figure.

    Attributes:
        origin: the file's name, followed by those that it extends.
        springs: springs about one axis of one joint each.
        coupled: coupled over several joints.
        reaches: directions that limbs reach.
        law: law of spherical joints.
        replaced: laws over several joints that stand for others.
    """

    origin: str
    springs: tuple[BoundSpring, ...] = ()
    coupled: tuple[CoupledSpring, ...] = ()
    law: SphericalLaw | None = None
    replaced: "tuple[LawReplacement, ...]" = ()
    reaches: tuple[BoundReach, ...] = ()

    def extend(self, base: "FileSprings", diagnostics: Diagnostics) -> "FileSprings":
        """Return these springs, and those of `base` that they do not replace.

        A law replaces the law of `base` about the same axis, as does a law over several joints with
        that axis, and a reach those about all axes of its joint; damping replaces damping. What is
        not stated about an axis stays.

        Args:
            base: springs of the extended file.
            diagnostics: diagnostics for curves about axes that have a law over several joints in
                `base`.
        """
        own_axes = [axis for spring in self.coupled for axis in _axes(spring)]
        kept_coupled = tuple(
            spring
            for spring in base.coupled
            if not any(_has_axis(own_axes, *axis) for axis in _axes(spring))
        )
        base_axes = [axis for spring in kept_coupled for axis in _axes(spring)]
        for one in self.springs:
            is_elastic = one.spring.elastic and not one.slides
            if is_elastic and _has_axis(base_axes, one.joint, one.spring.direction):
                diagnostics.error(
                    f"`{shorten(one.joint)}` has a law over several joints about this axis in "
                    f"{base.origin}, to which this one would add",
                    one.span,
                    "extend other springs, or state the law over several joints here",
                )
        reached = {one.joint for one in self.reaches}
        kept_reaches = tuple(one for one in base.reaches if one.joint not in reached)
        for one in self.springs:
            is_elastic = one.spring.elastic and not one.slides
            if is_elastic and any(one.joint == other.joint for other in kept_reaches):
                diagnostics.error(
                    f"`{shorten(one.joint)}` has a reach in {base.origin}: axes have damping only",
                    one.span,
                    "extend other springs, or state the reach here",
                )
        kept_laws = [spring.law for spring in kept_coupled]
        return FileSprings(
            f"{self.origin} over {base.origin}",
            tuple(_merge(self.springs, base.springs, own_axes, reached)),
            (*self.coupled, *kept_coupled),
            self.law or base.law,
            (*self.replaced, *(one for one in base.replaced if one.law in kept_laws)),
            (*self.reaches, *kept_reaches),
        )


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
