"""The spring about one axis of a joint: its elastic laws, its damping and their reference."""

from dataclasses import dataclass, field, replace

from springs.backends import NUMPY, Operations, Real
from springs.damping import Damping
from springs.elastic import Elastic, Frictional, total_friction
from springs.hysteresis import Hysteresis
from springs.short_repr import short_repr
from springs.stop import Stop
from springs.transformed import Transformed

Direction = tuple[float, float, float]

UNKNOWN_AXIS: Direction = (0.0, 0.0, 0.0)
"""Stands for the only axis of a joint whose figure is not known; nothing can be simulated so."""

_NO_DAMPING = Damping()


@short_repr
@dataclass(frozen=True)
class AxisSpring:
    """The passive law about one axis of a joint.

    Attributes:
        direction: unit axis in the joint's frame (the parent site's); positive turns are about it.
        elastic: laws whose torques add.
        damping: viscous and Coulomb damping of the rate about the axis.
        motion: the anatomist's name of a positive angle ("flexion"), or "".
        reference: where the numbers are from.
        why: why they are read as they are.
        middle: middle of the range [rad]; a law of coordinates has its seam opposite to it.
    """

    direction: Direction
    elastic: tuple[Elastic, ...] = ()
    damping: Damping = _NO_DAMPING
    motion: str = ""
    reference: str = ""
    why: str = ""
    middle: float = field(default=0.0, compare=False)

    def __hash__(self) -> int:
        """Hash of axis and laws, by which springs mostly differ."""
        return hash((self.direction, self.elastic))

    @property
    def laws_besides_stops(self) -> tuple[Elastic, ...]:
        """Elastic laws without the stops."""
        return tuple(law for law in self.elastic if not isinstance(law, Stop))

    @property
    def is_damped(self) -> bool:
        """True with damping, or with friction of an elastic law."""
        has_friction = any(isinstance(law, Frictional) for law in self.elastic)
        return has_friction or self.damping != _NO_DAMPING

    def resistance(self, angle: Real, rate: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child against the rate [N m]: damping, and friction of directional laws.

        Args:
            angle: component of the displacement along the axis [rad]; read by directional laws.
            rate: component of its rate [rad/s].
            ops: functions of the kind of number in both.
        """
        friction = total_friction(self.elastic, angle, rate, ops)
        is_damped = self.damping.viscous or self.damping.coulomb
        damping = self.damping.torque(rate, ops) if is_damped else 0.0 * rate
        return damping if friction is None else damping + friction

    def oriented_along(self, axis: Direction) -> "AxisSpring":
        """Return the same spring about `axis`, which is its direction or the opposite."""
        along = sum(a * b for a, b in zip(self.direction, axis, strict=True))
        return self if along > 0.0 else self.with_opposite_axis()

    def with_opposite_axis(self) -> "AxisSpring":
        """Return the same spring about the opposite axis: direction and laws mirrored."""
        x, y, z = self.direction
        laws = tuple(law.mirrored() for law in self.elastic)
        return replace(self, direction=(-x, -y, -z), elastic=laws, middle=-self.middle)

    def scaled(self, elastic: float, damping: float, *, stops: bool = True) -> "AxisSpring":
        """Return the spring with factors of its elastic torque, and of damping and friction.

        Args:
            elastic: Factor of the torques that depend on the angle only.
            damping: Factor of damping and friction.
            stops: Whether stops are scaled as well.
        """
        laws = tuple(
            part
            for law in self.elastic
            for part in (
                _scaled_law(law, elastic, damping) if stops or not isinstance(law, Stop) else (law,)
            )
        )
        resistance = replace(
            self.damping,
            viscous=damping * self.damping.viscous,
            coulomb=damping * self.damping.coulomb,
        )
        return replace(self, elastic=laws, damping=resistance)


def _scaled_law(law: Elastic, elastic: float, friction: float) -> tuple[Elastic, ...]:
    """Laws whose torques add to the scaled ones of a law.

    The curves of a directional law are scaled like its friction; half of the rest of each belongs
    to the elastic law, which is their mean.
    """
    if not isinstance(law, Hysteresis):
        return (transform(law, elastic),)
    rest = 0.5 * (elastic - friction)
    halves = transform(law.increasing, rest), transform(law.decreasing, rest)
    return transform(law, friction), *halves


def transform(law: Elastic, scale: float, offset: float = 0.0) -> Elastic:
    """Return a law scaled and shifted, each of its curves as one transformation.

    Args:
        law: Law of an angle.
        scale: Factor of its torque.
        offset: Shift towards larger angles [rad].
    """
    if isinstance(law, Hysteresis):
        up, down = (transform(one, scale, offset) for one in (law.increasing, law.decreasing))
        return replace(law, increasing=up, decreasing=down)
    if isinstance(law, Transformed):
        return Transformed(law.law, scale * law.scale, law.offset + offset, scale * law.constant)
    return Transformed(law, scale, offset)
