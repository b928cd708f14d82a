"""The springs of a joint, of several joints, and of a figure."""

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from math import hypot

from springs.axis import UNKNOWN_AXIS, AxisSpring, Direction
from springs.coupled import CoupledExponential
from springs.reach import Reach
from springs.short_repr import short_repr

_UNIT_LENGTH_TOLERANCE = 1e-9
"""By how much the length of a direction may differ from 1."""


class SphericalLaw(Enum):
    """Rule by which the laws of the axes form the law of a spherical joint (eq. 4.4)."""

    CONSERVATIVE = "conservative"
    """Laws of the components of the rotation vector, and their gradient."""
    WEIGHTED = "weighted"
    """The thesis's directional weighting, which has no energy."""
    COORDINATES = "coordinates"
    """Laws of the displacements of the joint's own chain."""


class Singularity(Enum):
    """Orientations at which a law has no torque."""

    HALF_TURN = "half turn"
    """A rotation by 180 deg, where the rotation vector changes its sign."""
    POLE = "pole"
    """The innermost and the outermost of three axes are parallel."""
    NONE = "none"


@short_repr
@dataclass(frozen=True)
class JointSprings:
    """The springs of a joint: about its axes, and along its slides.

    For a chain of one rotation the only axis is that of the rotation. A slide's spring is an
    `AxisSpring` along its direction, with metres, newtons and N/m in place of radians, N m and
    N m/rad. Axes and slides without any law are left out. A reach takes the place of the elastic
    laws about axes, which have damping only.
    """

    joint: str
    axes: tuple[AxisSpring, ...] = ()
    translations: tuple[AxisSpring, ...] = ()
    reach: Reach | None = None

    def __post_init__(self) -> None:
        """Refuse elastic laws of axes beside those of a reach."""
        if self.reach is not None and any(axis.elastic for axis in self.axes):
            raise ValueError("a joint with a reach has damping only about its axes")

    @property
    def is_elastic(self) -> bool:
        """True with an elastic law of the rotation."""
        return self.reach is not None or any(axis.elastic for axis in self.axes)

    def with_laws(self, change: Callable[[AxisSpring], AxisSpring]) -> "JointSprings":
        """Return the springs with a change of each, and of the laws of the reach."""
        return replace(
            self,
            axes=tuple(map(change, self.axes)),
            translations=tuple(map(change, self.translations)),
            reach=self.reach and self.reach.with_laws(change),
        )


@short_repr
@dataclass(frozen=True)
class CoupledAxis:
    """Joint and axis of a coordinate of a coupled law.

    Attributes:
        joint: name of the joint.
        direction: unit axis in the joint's frame (the parent site's); the coordinate grows with
            turns about it. For a joint of several turns the coordinate is the component of the
            rotation vector along it, as for an `AxisSpring`.
    """

    joint: str
    direction: Direction

    def __post_init__(self) -> None:
        """Refuse a direction that would stretch the coordinate."""
        length = hypot(*self.direction)
        if self.direction != UNKNOWN_AXIS and abs(length - 1.0) > _UNIT_LENGTH_TOLERANCE:
            raise ValueError(f"the direction of a coupled angle has length 1, not {self.direction}")


@short_repr
@dataclass(frozen=True)
class CoupledSpring:
    """A passive law over several joints' angles, bound to a figure; it adds to the axes' springs.

    The generalized force of each coordinate is the law's torque times the gradient of the
    coordinate, so that the power is the sum of torques times rates, also where no energy exists.

    Attributes:
        law: torques on the children of the angles.
        axes: where each of the law's coordinates is, in their order.
        reference: where the numbers are from.
        why: why they are read as they are.
        original: law for which this one stands as the nearest conservative one; None if it stands
            for itself.
    """

    law: CoupledExponential
    axes: tuple[CoupledAxis, ...]
    reference: str = ""
    why: str = ""
    original: CoupledExponential | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Refuse axes that do not fit the law's coordinates."""
        if len(self.axes) != len(self.law.coordinates):
            count = len(self.law.coordinates)
            raise ValueError(f"this law has {count} coordinates, not {len(self.axes)}")


@dataclass(frozen=True)
class SpringSet:
    """The springs of a figure by joint name, and the law that joins a spherical joint's axes."""

    joints: Mapping[str, JointSprings] = field(default_factory=dict[str, JointSprings])
    law: SphericalLaw = SphericalLaw.CONSERVATIVE
    origin: str = "none"
    coupled: tuple[CoupledSpring, ...] = ()

    def __repr__(self) -> str:
        """Origin and size, in a line."""
        coupled = f", {len(self.coupled)} over several joints" if self.coupled else ""
        return (
            f"<SpringSet {self.origin}: joints with springs: {len(self.joints)}{coupled}, "
            f"{self.law.value}>"
        )

    def of_joints(self, names: Container[str]) -> "SpringSet":
        """Return the springs that belong to some joints only."""
        return replace(
            self,
            joints={name: joint for name, joint in self.joints.items() if name in names},
            coupled=tuple(
                spring
                for spring in self.coupled
                if all(axis.joint in names for axis in spring.axes)
            ),
        )

    def scaled(self, elastic: float, damping: float) -> "SpringSet":
        """Return the springs with scaled elastic torques, and scaled damping and friction.

        Args:
            elastic: factor of the torques that depend on displacements only; not negative.
            damping: factor of those that depend on rates; not negative.
        """
        if elastic == damping == 1.0:
            return self
        joints = {
            name: joint.with_laws(lambda spring: spring.scaled(elastic, damping))
            for name, joint in self.joints.items()
        }
        coupled = tuple(
            replace(spring, law=spring.law.scaled(elastic), original=None)
            for spring in self.coupled
        )
        return replace(self, joints=joints, coupled=coupled)

    @property
    def references(self) -> tuple[str, ...]:
        """The references of all springs, each once, in order of appearance."""
        springs = (
            *(
                spring
                for joint in self.joints.values()
                for spring in (*joint.axes, *joint.translations)
            ),
            *(
                part
                for joint in self.joints.values()
                if joint.reach is not None
                for _, part in joint.reach.parts
            ),
            *self.coupled,
        )
        return tuple(dict.fromkeys(spring.reference for spring in springs if spring.reference))
