"""A mechanism as DYSPAM has it (section 3.1.1): bodies, joints and points by number, in SI.

Body 0 is the ground, and its frame is the world's. Everything else is counted from 1 in the order
in which it stands here. Angles are radians.

How a figure's joint becomes one that DYSPAM allows: z joints, and z-y-x angles (section 3.1.3).

A joint's triads are its two sites turned alike, so that the joint itself stays what it was. A
revolute's are turned until its axis is z (`zifyjoint`, figure 3.5), with the sign that the figure
gives it: the knees of the prototype turn about -y, and their dead zone is printed from 0 to 1.553
rad. Those of a spherical joint are turned by a half turn where that makes negative axes of the
figure positive; otherwise they stay the sites. A curve of `optional` is then about the axis that
the figure declares, on the right side as on the left.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import Diagnostic, ModelError, Span, error
from generator.figure import AxisKind, Joint, JointAxis, Vector
from generator.figure_file.resolve import origin_span
from generator.joint_chain import build_chain
from generator.loads import LoadKind
from generator.rotations import Array, RotationSequence, rotation_with_z_axis
from generator.springs_file.axes import parallel_sign, rotation_axes

Row4 = tuple[float, float, float, float]
Triad = tuple[Row4, Row4, Row4]
"""A joint's frame in a body: a row for each axis of the body, turn and position [m]."""


def triad_from_rows(rows: Iterable[Sequence[float]]) -> Triad:
    """Return the triad of three rows of four numbers."""
    first, second, third = ((a, b, c, d) for a, b, c, d in rows)
    return first, second, third


LOAD_KINDS = tuple(LoadKind)
"""The order in which `structure` counts loads and `jackforce` lists them."""


class JointType(IntEnum):
    """The supported joint types, by number.

    Figure 3.2 gives the number of spherical joints. No printed page gives that of revolutes: 1 is
    this program's choice.
    """

    REVOLUTE = 1
    SPHERICAL = 7

    @property
    def chain(self) -> tuple[JointAxis, ...]:
        """The chain that DYSPAM allows: about z, or z-y-x (innermost first)."""
        z = JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0))
        if self is JointType.REVOLUTE:
            return (z,)
        return (
            JointAxis(AxisKind.ROTATION, (1.0, 0.0, 0.0)),
            JointAxis(AxisKind.ROTATION, (0.0, 1.0, 0.0)),
            z,
        )

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
        type: type of the joint.
        triads: the joint's frame in the first and in the second body.
        angles: angles at the start [rad], one, or three about z, y and x.
        rates: rates of the angles [rad/s].
        span: where the joint table has it.
    """

    first: int
    second: int
    type: JointType
    triads: tuple[Triad, Triad]
    angles: tuple[float, ...]
    rates: tuple[float, ...]
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class MechanismBody:
    """A body that moves.

    Attributes:
        centre: number of the point at its centre of mass.
        mass: [kg].
        inertia: principal moments about the centre of mass along the body's axes [kg m2].
        span: where the mass table has it.
    """

    centre: int
    mass: float
    inertia: Vector
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Point:
    """A point of interest: the number of its body, and its position there [m]."""

    body: int
    position: Vector
    span: Span | None = field(default=None, compare=False, repr=False)


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
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class PointLoad:
    """A constant load at a point of interest: three components [N or N m]."""

    kind: LoadKind
    point: int
    components: Vector


@dataclass(frozen=True)
class Mechanism:
    """Contents of `ndyspamfile`, table by table."""

    connections: tuple[Connection, ...]
    bodies: tuple[MechanismBody, ...]
    points: tuple[Point, ...]
    springs: tuple[LinearSpring, ...] = ()


@dataclass(frozen=True, eq=False)
class JointTriad:
    """The triad of a figure's joint.

    Attributes:
        type: type of the joint.
        rotation: axes of the triad as columns in the joint's sites, shape (3, 3).
    """

    type: JointType
    rotation: Array

    def initial_angles(self, matrix: ArrayLike, displacement: ArrayLike) -> tuple[float, ...]:
        """The initial angles [rad]: of a revolute its own, of a spherical about z, y and x.

        Args:
            matrix: orientation of the child's site in the parent's, shape (3, 3).
            displacement: displacement of the figure's joint [rad].
        """
        if self.type is JointType.REVOLUTE:
            return (float(np.asarray(displacement)[0]),)
        axes = tuple(factor.axis for factor in self.type.chain)
        angles = RotationSequence(axes).angles(self.rotation.T @ np.asarray(matrix) @ self.rotation)
        x, y, z = (float(angle) for angle in angles)
        return z, y, x


def joint_triad(joint: Joint) -> JointTriad | Diagnostic:
    """Return the triad of a joint, or the diagnostic that DYSPAM has no such joint."""
    reason = ""
    try:
        chain = build_chain(joint.chain)
    except ModelError as failure:
        chain, reason = None, str(failure)
    if chain is not None:
        match len(chain.translations), len(chain.rotations):
            case 0, 1:
                return JointTriad(JointType.REVOLUTE, rotation_with_z_axis(chain.rotation_axes[0]))
            case 0, 3:
                return JointTriad(JointType.SPHERICAL, np.diag(_axis_signs(joint)))
            case 0, 0:
                reason = "it is rigid"
            case 0, _:
                reason = "it turns about two axes"
            case _:
                reason = "it has a translation"
    return error(
        f"joint `{joint.name}` cannot be written for DYSPAM: {reason}",
        origin_span(joint.origins, "type", "connect"),
        "DYSPAM's files hold one rotation or three: revolutes and sphericals",
    )


def _axis_signs(joint: Joint) -> Array:
    """Return the signs of a half turn, or none, from site axes to declared ones; shape (3,).

    If an odd number of axes is negative no rotation makes all positive, and the sites stay.
    """
    declared = [
        next(
            (sign for turn in rotation_axes(joint) if (sign := parallel_sign(tuple(axis), turn))), 0
        )
        for axis in np.eye(3)
    ]
    signs = np.array([sign or 1 for sign in declared], dtype=float)
    if np.prod(signs) > 0.0:
        return signs
    if 0 in declared:
        signs[declared.index(0)] = -1.0
        return signs
    return np.ones(3)
