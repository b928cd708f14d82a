"""The resistance of a surface to what is pressed into it and slides on it."""

from dataclasses import dataclass, field
from math import isfinite

from springs.backends import NUMPY, Operations, Real
from springs.layer import Layer

STIFFNESS_SOURCE = (
    "the pelvis of 7 men and 5 women has a secant stiffness of 24.6 to 35.6 kN/m as a whole "
    "(Choi et al. 2024, J. Biomech. 162:111885, abstract); assumed for each sphere of all segments"
)
FRICTION_SOURCE = "assumed; between skin or cloth and a dry floor"
DAMPING_SOURCE = "chosen: a segment that hits the floor with 1 m/s leaves it with 0.59 m/s"


def rising_force(depth: Real, k: Real, e: Real, ops: Operations = NUMPY) -> Real:
    """Force k q(d) of a stiffness k [N/m] that grows over the depth e [m]; see `Surface`."""
    rising = depth * depth * depth * (k / (e * e) - (0.5 * k / (e * e * e)) * depth)
    inside = ops.smooth_where(depth > e, k * depth - 0.5 * k * e, rising)
    return ops.smooth_where(depth > 0.0, inside, 0.0)


def rising_slope(depth: Real, k: Real, e: Real, ops: Operations = NUMPY) -> Real:
    """Derivative of `rising_force` by the depth [N/m]."""
    rising = depth * depth * (3.0 * k / (e * e) - (2.0 * k / (e * e * e)) * depth)
    inside = ops.smooth_where(depth > e, k, rising)
    return ops.smooth_where(depth > 0.0, inside, 0.0)


def rising_energy(depth: Real, k: Real, e: Real, ops: Operations = NUMPY) -> Real:
    """Integral of `rising_force` from depth 0 [J]."""
    rising = k * depth * depth * depth * depth * (0.25 / e**2 - (0.1 / e**3) * depth)
    full = 0.5 * k * depth * (depth - e) + 0.15 * k * e * e
    return ops.smooth_where(depth > 0.0, ops.smooth_where(depth > e, full, rising), 0.0)


@dataclass(frozen=True)
class Surface:
    """A one-sided elastic resistance with impact damping and sliding friction.

    At the depth d and its rate d' the normal force is N = k q(d) max(0, 1 + a d'), with

        q(d) = d^3 / e^2 (1 - d / 2e)  for 0 < d < e,  d - e/2  beyond,

    which is twice continuously differentiable and exactly zero outside (the damping is that of Hunt
    & Crossley, J. Appl. Mech. 42:440, 1975). Sliding with the velocity c is opposed by the Coulomb
    friction mu N c / sqrt(c^2 + s^2), made smooth at rest: a body on a slope creeps with a speed
    below the friction speed s.

    Attributes:
        stiffness: k, at each sphere [N/m].
        damping: a, zero for an elastic impact [s/m].
        friction: mu.
        transition_depth: e, over which the stiffness grows [m].
        friction_speed: s [m/s]. The steps of an explicit integration are proportional to it below
            0.02 m/s.
        source: where the numbers are from.
        layer: what is below the surface, such as a mat, in series with a part of the body that has
            a law of its own; None for what is hard.
    """

    stiffness: float = 3e4
    damping: float = 1.0
    friction: float = 0.6
    transition_depth: float = 5e-3
    friction_speed: float = 0.02
    source: str = field(default="", compare=False)
    layer: Layer | None = None

    def __post_init__(self) -> None:
        """Check the numbers. Raises ValueError."""
        for name in ("stiffness", "transition_depth", "friction_speed"):
            if not (isfinite(value := getattr(self, name)) and value > 0.0):
                raise ValueError(
                    f"the {name.replace('_', ' ')} must be positive and finite, not {value:g}"
                )
        for name in ("damping", "friction"):
            if not (isfinite(value := getattr(self, name)) and value >= 0.0):
                raise ValueError(f"the {name} must not be negative, and finite, not {value:g}")

    def elastic_force(self, depth: Real, ops: Operations = NUMPY) -> Real:
        """Elastic normal force [N] at a depth [m]; zero outside."""
        return rising_force(depth, self.stiffness, self.transition_depth, ops)

    def elastic_slope(self, depth: Real, ops: Operations = NUMPY) -> Real:
        """Derivative of the elastic force by the depth [N/m], at a depth [m]."""
        return rising_slope(depth, self.stiffness, self.transition_depth, ops)

    def energy(self, depth: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J] at a depth [m]: the integral of the elastic force."""
        return rising_energy(depth, self.stiffness, self.transition_depth, ops)

    def impact_factor(self, rate: Real, ops: Operations = NUMPY) -> Real:
        """Normal force over the elastic one, at a rate of the depth [m/s]."""
        factor = 1.0 + self.damping * rate
        return ops.smooth_where(factor > 0.0, factor, 0.0)

    def friction_factor(self, squared_speed: Real, ops: Operations = NUMPY) -> Real:
        """Friction over normal force and sliding velocity [s/m], of its square [m^2/s^2]."""
        return self.friction / ops.sqrt(squared_speed + self.friction_speed**2)


DEFAULT_SURFACE = Surface(source="; ".join((STIFFNESS_SOURCE, DAMPING_SOURCE, FRICTION_SOURCE)))
"""Surface of the floor."""
