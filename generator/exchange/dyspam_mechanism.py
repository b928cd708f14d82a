"""A mechanism as DYSPAM has it (section 3.1.1): bodies, joints and points by number, in SI.

Body 0 is the ground, and its frame is the world's. Everything else is counted from 1 in the order
in which it stands here. Angles are radians.
"""

from dataclasses import dataclass, field
from enum import IntEnum

from generator.figure import Factor, Vector
from generator.loads import LoadKind
from generator.source import Span

Row4 = tuple[float, float, float, float]
Triad = tuple[Row4, Row4, Row4]
"""A joint's frame in a body: a row for each axis of the body, turn and position [m]."""

LOAD_KINDS = (
    LoadKind.GLOBAL_FORCE,
    LoadKind.LOCAL_FORCE,
    LoadKind.GLOBAL_MOMENT,
    LoadKind.LOCAL_MOMENT,
)
"""The order in which `structure` counts loads and `jackforce` lists them."""

ANGLE_AXES = (3, 2, 1)
"""Of a spherical joint's three initial angles, the axis of each: z, y, x."""


class JointType(IntEnum):
    """The joint types that can be held, by their numbers.

    Figure 3.2 gives the number of spherical joints. No printed page gives that of revolutes: 1 is
    this program's choice.
    """

    REVOLUTE = 1
    SPHERICAL = 7

    @property
    def chain(self) -> tuple[Factor, ...]:
        """The chain that DYSPAM allows: about z, or z-y-x (innermost first)."""
        z = Factor("R", (0.0, 0.0, 1.0))
        if self is JointType.REVOLUTE:
            return (z,)
        return Factor("R", (1.0, 0.0, 0.0)), Factor("R", (0.0, 1.0, 0.0)), z

    @property
    def axes(self) -> tuple[int, ...]:
        """The axis number of each factor of the chain: 1, 2, 3 for x, y, z of the triad."""
        return (3,) if self is JointType.REVOLUTE else (1, 2, 3)


@dataclass(frozen=True)
class Connection:
    """A joint of two bodies.

    Attributes:
        first: number of the body in whose triad the other moves.
        second: number of that other body.
        type: of the joint.
        triads: the joint's frame in the first and in the second body.
        angles: at the start [rad], one, or three about z, y and x.
        rates: of the angles [rad/s].
        place: where the joint table has it.
    """

    first: int
    second: int
    type: JointType
    triads: tuple[Triad, Triad]
    angles: tuple[float, ...]
    rates: tuple[float, ...]
    place: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Body:
    """A body that moves.

    Attributes:
        centre: number of the point at its centre of mass.
        mass: [kg].
        inertia: principal moments about the centre of mass along the body's axes [kg m2].
        place: where the mass table has it.
    """

    centre: int
    mass: float
    inertia: Vector
    place: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Point:
    """A point of interest: the number of its body, and its position there [m]."""

    body: int
    position: Vector
    place: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class LinearSpring:
    """A linear spring and damper about an axis of a joint.

    joint and axis by number; stiffness [N m/rad], damping [N m s/rad], rest [rad].
    """

    joint: int
    axis: int
    stiffness: float
    damping: float
    rest: float
    place: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class PointLoad:
    """A constant load at a point of interest: three components [N or N m]."""

    kind: LoadKind
    point: int
    components: Vector


@dataclass(frozen=True)
class Mechanism:
    """What `ndyspamfile` says, table by table."""

    connections: tuple[Connection, ...]
    bodies: tuple[Body, ...]
    points: tuple[Point, ...]
    springs: tuple[LinearSpring, ...] = ()
