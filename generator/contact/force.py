"""Force of a prop on a contact sphere.

`contact_force` is written once for arrays, symbols of Exudyn and recorded code; see
`springs.backends`.
"""

from collections.abc import Sequence
from typing import NamedTuple

from generator.contact.shape import Components, Shape
from springs.backends import NUMPY, Operations, Real
from springs.contact import Surface


class ContactForce(NamedTuple):
    """Force of a prop on a sphere, in the axes of the prop.

    Attributes:
        depth: depth of the sphere in the prop, negative outside [m].
        rate: rate of the depth [m/s].
        elastic: elastic part of the normal force [N].
        normal: normal force [N].
        direction: force over the normal force.
        arm: moment about the sphere's centre over the normal force [m].
        friction_power: power of the friction over the normal force [m/s].
        normal_direction: direction of the normal force.
        stiffness: derivative of the normal force by the depth [N/m].
        damping: derivative of the normal force by the rate of the depth [N s/m].
        friction: friction over the sliding velocity [N s/m].
        friction_bend: what the last loses along the sliding velocity, over the square of this [N
            s^3/m^3].
    """

    depth: Real
    rate: Real
    elastic: Real
    normal: Real
    direction: Components
    arm: Components
    friction_power: Real
    normal_direction: Components
    stiffness: Real
    damping: Real
    friction: Real
    friction_bend: Real


def contact_force(
    shape: Shape,
    surface: Surface,
    radius: Real,
    centre: Components,
    velocity: Components,
    spin: Components,
    ops: Operations = NUMPY,
    *,
    lengths: Sequence[Real] | None = None,
) -> ContactForce:
    """Return the force on a sphere.

    Friction acts at the point of the sphere that is deepest in the prop.

    Args:
        shape: Shape of the prop.
        surface: Surface of the prop.
        radius: Radius of the sphere [m].
        centre: Centre of the sphere in the axes of the prop [m].
        velocity: Velocity of the centre, likewise [m/s].
        spin: Angular velocity of the sphere, likewise [rad/s].
        ops: Kind of the numbers.
        lengths: Lengths of the shape [m], which may be arrays or symbols [default: its own].
    """
    distance, normal = shape.distance(centre, ops, lengths)
    depth = radius - distance
    normal_speed = _dot(normal, velocity)
    rate = -normal_speed
    slip: list[Real] = []
    for k in range(3):
        speed = _difference(velocity[k], _product(normal[k], normal_speed))
        is_negative, turning = _cross(spin, normal, k)
        turning = _product(radius, turning)
        slip.append(_sum(speed, turning) if is_negative else _difference(speed, turning))
    squared_speed = _dot(slip, slip)
    factor = surface.friction_factor(squared_speed, ops)
    across = radius * factor
    direction = [
        _product(-factor, c) if _is_zero(n) else _difference(n, _product(factor, c))
        for n, c in zip(normal, slip, strict=True)
    ]
    arms = (_cross(normal, slip, k) for k in range(3))
    arm = [_product(-across if is_negative else across, part) for is_negative, part in arms]
    elastic, impact = surface.elastic_force(depth, ops), surface.impact_factor(rate, ops)
    force = elastic * impact
    friction = force * factor
    return ContactForce(
        depth,
        rate,
        elastic,
        force,
        (direction[0], direction[1], direction[2]),
        (arm[0], arm[1], arm[2]),
        factor * squared_speed,
        normal,
        surface.elastic_slope(depth, ops) * impact,
        ops.smooth_where(impact > 0.0, elastic * surface.damping, 0.0),
        friction,
        friction / (squared_speed + surface.friction_speed**2),
    )


# The constants 0 and 1, which the normal of a plane consists of, leave no operation behind.


def _is_zero(value: Real) -> bool:
    return type(value) is float and value == 0.0


def _product(a: Real, b: Real) -> Real:
    for constant, other in ((a, b), (b, a)):
        if type(constant) is float and constant in (0.0, 1.0):
            return other if constant else 0.0
    return a * b


def _sum(a: Real, b: Real) -> Real:
    if _is_zero(a):
        return b
    return a if _is_zero(b) else a + b


def _difference(a: Real, b: Real) -> Real:
    if a is b:
        return 0.0
    return a if _is_zero(b) else a - b


def _dot(a: Sequence[Real], b: Sequence[Real]) -> Real:
    return _sum(_sum(_product(a[0], b[0]), _product(a[1], b[1])), _product(a[2], b[2]))


def _cross(a: Sequence[Real], b: Sequence[Real], k: int) -> tuple[bool, Real]:
    """Return a component of a vector product or its negative: whether it is that, and its value."""
    i, j = (k + 1) % 3, (k + 2) % 3
    first, second = _product(a[i], b[j]), _product(a[j], b[i])
    return (True, second) if _is_zero(first) else (False, _difference(first, second))
