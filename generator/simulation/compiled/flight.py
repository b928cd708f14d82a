"""Distance of spheres from props, and the step in which a sphere cannot pass through one."""

from math import inf, sqrt

from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    Vector,
    apply,
    apply_transposed,
    cross,
    dot,
    matrix,
    minus,
    plus,
    vector,
)
from generator.simulation.compiled.compiler import COUNT, MATRIX, REAL, compiled, inlined
from generator.simulation.compiled.layout import (
    GROUP_END,
    GROUP_FIRST,
    GROUP_LINK,
    MECHANISM,
    POINT,
    PROP_AXES,
    PROP_LARGEST,
    PROP_LEAST,
    PROP_ORIGIN,
    ROTATION,
    SCRATCH,
    SPHERE_CENTRE,
    SPHERE_RADIUS,
    SPIN,
    VELOCITY,
    Mechanism,
    Scratch,
)


@inlined
def distance_below(props: Array, d: int, place: Vector) -> float:
    """Return a lower bound of the distance of a place, in a prop's axes, from this prop [m]."""
    x, y, z = place
    beyond = max(x - props[d, PROP_LARGEST], props[d, PROP_LEAST] - x)
    beyond = max(beyond, max(y - props[d, PROP_LARGEST + 1], props[d, PROP_LEAST + 1] - y))
    return max(beyond, max(z - props[d, PROP_LARGEST + 2], props[d, PROP_LEAST + 2] - z))


@compiled(REAL, MATRIX, COUNT)
def _thickness(props: Array, d: int) -> float:
    """Return the smallest length of a prop [m]."""
    width = inf
    for k in range(3):
        width = min(width, props[d, PROP_LARGEST + k] - props[d, PROP_LEAST + k])
    return width


@compiled(REAL, MECHANISM, SCRATCH, REAL)
def longest_flight(mechanism: Mechanism, scratch: Scratch, step: float) -> float:
    """Return the longest step in which no sphere passes through a prop near it, between stages.

    Args:
        mechanism: tables.
        scratch: evaluation at the start of the step, or near it.
        step: intended step [s].
    """
    groups, places, props = (
        mechanism.sphere_groups,
        mechanism.sphere_constants,
        mechanism.prop_constants,
    )
    work, longest = scratch.work, step
    x, y, z = mechanism.gravity
    gravity = sqrt(x * x + y * y + z * z)
    fallen = 0.5 * gravity * step * step
    for d in range(len(props)):
        thickness = _thickness(props, d)
        if thickness == inf:
            continue
        axes = matrix(props, d, PROP_AXES)
        for g in range(len(groups)):
            i, reach = groups[g, GROUP_LINK], mechanism.sphere_reaches[g]
            velocity, spin = vector(work, i, VELOCITY), vector(work, i, SPIN)
            origin = minus(vector(work, i, POINT), vector(props, d, PROP_ORIGIN))
            origin = apply_transposed(axes, origin)
            speed = sqrt(dot(velocity, velocity)) + reach * sqrt(dot(spin, spin))
            if distance_below(props, d, origin) - reach > step * speed + fallen:
                continue
            turn = matrix(work, i, ROTATION)
            for s in range(groups[g, GROUP_FIRST], groups[g, GROUP_END]):
                arm = apply(turn, vector(places, s, SPHERE_CENTRE))
                place = plus(origin, apply_transposed(axes, arm))
                gap = distance_below(props, d, place) - places[s, SPHERE_RADIUS]
                motion = plus(velocity, cross(spin, arm))
                speed = sqrt(dot(motion, motion))
                width = thickness + 2.0 * places[s, SPHERE_RADIUS]
                if 0.0 < gap < step * speed + fallen and step * speed + fallen > width:
                    # The positive root of width = speed t + gravity t^2 / 2.
                    root = sqrt(speed * speed + 2.0 * gravity * width)
                    longest = min(longest, 2.0 * width / (speed + root))
    return longest
