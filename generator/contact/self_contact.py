"""Capsules by which the segments of a figure touch each other, and the force of two capsules.

`capsule_force` is written once for arrays and recorded code; see `springs.backends`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from generator.contact.shape import Components
from generator.figure import Figure, Vector
from generator.rotations import Array
from springs.backends import NUMPY, Operations, Real
from springs.contact import DEFAULT_SURFACE, Surface

LIMB_SURFACE = Surface(
    stiffness=0.5 * DEFAULT_SURFACE.stiffness,
    source="assumed: both segments give way as one does on the floor",
)
"""Surface of two segments that touch each other."""

BLEND_LENGTH = 0.025
"""Length by which the distance of two capsules exceeds that of their ends [m].

The nearest points of two lines are those that minimise the square of their distance plus the
squares of this length times their places, from -1 at one end to 1 at the other. So they move
continuously when the lines become parallel, and the force is the slope of an energy.
"""

_SMALLEST_DISTANCE = 1e-6
"""Distance of lines that cross [m]; the direction of the force is not defined there."""


@dataclass(frozen=True)
class Capsule:
    """All points within a radius of a line, in the axes of a segment.

    Attributes:
        middle: middle of the line [m].
        half_line: half line from the middle to one end [m]; zero for a sphere.
        radius: [m].
    """

    middle: Vector
    half_line: Vector
    radius: float


@dataclass(frozen=True)
class CapsulePair:
    """Capsules of two segments that may touch each other.

    Attributes:
        first: name of a segment.
        second: name of the other.
        capsules: capsules of both.
        reach: distance of their lines below which they touch [m]: the sum of the radii, less what
            they overlap by at the start.
    """

    first: str
    second: str
    capsules: tuple[Capsule, Capsule]
    reach: float


def unjoined_pairs(figure: Figure) -> Iterator[tuple[str, str]]:
    """Yield the pairs of moving segments that no joint connects."""
    joined = {
        frozenset((joint.parent.segment, joint.child.segment)) for joint in figure.joints.values()
    }
    names = list(figure.bodies)
    for index, second in enumerate(names):
        for first in names[:index]:
            if frozenset((first, second)) not in joined:
                yield first, second


def capsule_pairs(
    figure: Figure, capsules: Mapping[str, Capsule], poses: Mapping[str, Array]
) -> tuple[CapsulePair, ...]:
    """Return the pairs of unjoined segments that have capsules.

    Args:
        figure: figure whose joints say which segments are joined.
        capsules: capsules by segment.
        poses: poses of the segments at the start, shape (4, 4).
    """
    pairs: list[CapsulePair] = []
    for names in unjoined_pairs(figure):
        if not capsules.keys() >= set(names):
            continue
        first, second = (capsules[name] for name in names)
        turns = [poses[name][:3, :3] for name in names]
        middles = [
            poses[name][:3, 3] + turn @ capsules[name].middle
            for name, turn in zip(names, turns, strict=True)
        ]
        between, one, other = (
            (float(x), float(y), float(z))
            for x, y, z in (
                middles[1] - middles[0],
                turns[0] @ first.half_line,
                turns[1] @ second.half_line,
            )
        )
        distance = float(_nearest_points(between, one, other, NUMPY).distance)
        reach = min(first.radius + second.radius, distance)
        pairs.append(CapsulePair(*names, (first, second), reach))
    return tuple(pairs)


class _NearestPoints(NamedTuple):
    """Nearest points of two lines: from the first's middle to its point, from there to the other's.

    The distance is longer than that between the points; see `BLEND_LENGTH`.
    """

    along: Components
    across: Components
    distance: Real


def _nearest_points(
    between: Components, first: Components, second: Components, ops: Operations
) -> _NearestPoints:
    """Return the nearest points of two lines.

    Args:
        between: vector from the middle of the first line to that of the second [m].
        first: half of the first line [m].
        second: half of the second [m].
        ops: kind of the numbers.
    """
    squared = BLEND_LENGTH**2
    own, other = _dot(first, first) + squared, _dot(second, second) + squared
    mixed, one, two = _dot(first, second), _dot(first, between), _dot(second, between)
    s = _clip((other * one - mixed * two) / (own * other - mixed * mixed), ops)
    t = _clip((mixed * s - two) / other, ops)
    s = _clip((one + mixed * t) / own, ops)
    along = _scaled(s, first)
    x, y, z = (b + t * h - a for b, h, a in zip(between, second, along, strict=True))
    excess = squared * (s * s + t * t) + _SMALLEST_DISTANCE**2
    return _NearestPoints(along, (x, y, z), ops.sqrt(_dot((x, y, z), (x, y, z)) + excess))


class CapsuleForce(NamedTuple):
    """Force of a capsule on another one.

    Attributes:
        depth: depth of their overlap, negative apart [m].
        rate: rate of the depth [m/s].
        elastic: elastic part of the normal force [N].
        normal: normal force [N].
        direction: force on the second over the normal force; the first bears the opposite.
        first_arm: moment on the first about its middle over the normal force [m].
        second_arm: the same on the second.
        friction_power: power of the friction over the normal force [m/s].
    """

    depth: Real
    rate: Real
    elastic: Real
    normal: Real
    direction: Components
    first_arm: Components
    second_arm: Components
    friction_power: Real


def capsule_force(
    surface: Surface,
    reach: Real,
    radius_difference: Real,
    between: Components,
    half_lines: tuple[Components, Components],
    velocity: Components,
    spins: tuple[Components, Components],
    ops: Operations = NUMPY,
) -> CapsuleForce:
    """Return the force of a capsule on another one, along any axes.

    Both forces act at one point, in the middle of the overlap, so that momentum and angular
    momentum are conserved.

    Args:
        surface: surface of both.
        reach: distance of the lines below which they touch [m].
        radius_difference: radius of the first less that of the second [m].
        between: vector from the middle of the first to that of the second [m].
        half_lines: half lines of both [m].
        velocity: velocity of the second's middle relative to the first's [m/s].
        spins: angular velocities of both [rad/s].
        ops: kind of the numbers.
    """
    along, across, distance = _nearest_points(between, *half_lines, ops)
    depth = reach - distance
    elastic = surface.elastic_force(depth, ops)
    inverse = 1.0 / distance
    share = 0.5 + (0.5 * radius_difference) * inverse
    first_place = _plus(along, _scaled(share, across))
    second_place = _minus(first_place, between)
    sliding = _plus(velocity, _cross(spins[1], second_place))
    sliding = _minus(sliding, _cross(spins[0], first_place))
    normal_speed = _dot(across, sliding)
    squared_gap = _dot(across, across) + _SMALLEST_DISTANCE**2
    tangential = _minus(sliding, _scaled(normal_speed / squared_gap, across))
    rate = -1.0 * normal_speed * inverse
    factor = surface.friction_factor(_dot(tangential, tangential), ops)
    direction = _minus(_scaled(inverse, across), _scaled(factor, tangential))
    normal = elastic * surface.impact_factor(rate, ops)
    return CapsuleForce(
        depth,
        rate,
        elastic,
        normal,
        direction,
        _cross(direction, first_place),
        _cross(second_place, direction),
        factor * _dot(tangential, sliding),
    )


def _clip(value: Real, ops: Operations) -> Real:
    """The value from -1 to 1 that is nearest."""
    value = ops.smooth_where(value < -1.0, -1.0, value)
    return ops.smooth_where(value > 1.0, 1.0, value)


def _dot(a: Components, b: Components) -> Real:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Components, b: Components) -> Components:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _scaled(factor: Real, a: Components) -> Components:
    return (factor * a[0], factor * a[1], factor * a[2])


def _plus(a: Components, b: Components) -> Components:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _minus(a: Components, b: Components) -> Components:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
