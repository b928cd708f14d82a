"""The thesis's moment-displacement cubic with its dead zone (eq. 4.1-4.3 as corrected, 4.5-4.7)."""

from dataclasses import dataclass

from springs.operations import NUMPY, Operations, Real

Coefficients = tuple[float, float, float, float]


def polynomial(coefficients: Coefficients, a: Real) -> Real:
    """M(a) = c0 + c1 a + c2 a^2 + c3 a^3 [N m], a in rad."""
    c0, c1, c2, c3 = coefficients
    return c0 + a * (c1 + a * (c2 + a * c3))


def antiderivative(coefficients: Coefficients, a: Real) -> Real:
    """The integral of `polynomial` from 0 to a [J]."""
    c0, c1, c2, c3 = coefficients
    return a * (c0 + a * (c1 / 2.0 + a * (c2 / 3.0 + a * (c3 / 4.0))))


@dataclass(frozen=True)
class Cubic:
    """Torque on the child = sense * (M(a) - M(edge)) beyond the dead zone's edges, zero inside.

    a = angle - rest. Without a dead zone the torque is sense * M(a) everywhere, and the energy is
    counted from a = 0; with one it is counted from the dead zone.

    Attributes:
        coefficients: c0..c3 [N m, N m/rad, N m/rad^2, N m/rad^3].
        sense: -1 when M is the resisting moment (eq. 4.5), +1 when M acts on the child.
        dead_zone: lower and upper edge of a [rad], or None.
        rest: the displacement at which a is zero (alpha_0 of eq. 4.5) [rad].
    """

    coefficients: Coefficients
    sense: int = -1
    dead_zone: tuple[float, float] | None = None
    rest: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a sense that is no sign and a dead zone that ends before it begins."""
        if self.sense not in (-1, 1):
            raise ValueError(f"the sense of a cubic is +1 or -1, not {self.sense}")
        if self.dead_zone is not None and self.dead_zone[0] > self.dead_zone[1]:
            raise ValueError(
                f"the dead zone {self.dead_zone[0]:g} .. {self.dead_zone[1]:g} rad "
                "ends before it begins"
            )

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Torque on the child about the axis [N m] at `angle` [rad]."""
        a = self._from_rest(angle)
        if self.dead_zone is None:
            return polynomial(self._acting(None), a)
        low, high = self.dead_zone
        below = polynomial(self._acting(low), a)
        above = polynomial(self._acting(high), a)
        return ops.where(a < low, below, ops.where(a > high, above, 0.0))

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        """Stored energy [J] at `angle` [rad]; the torque is minus its slope."""
        a = self._from_rest(angle)
        if self.dead_zone is None:
            return -self.sense * antiderivative(self.coefficients, a)
        low, high = self.dead_zone
        below, above = (self._work_from(edge, a) for edge in (low, high))
        return -self.sense * ops.where(a < low, below, ops.where(a > high, above, 0.0))

    @property
    def corners(self) -> tuple[float, ...]:
        """Angles of the dead zone's edges [rad], where the slope of the torque jumps."""
        return tuple(edge + self.rest for edge in self.dead_zone or ())

    def mirrored(self) -> "Cubic":
        """The law of the same joint when its angle is counted the other way."""
        c0, c1, c2, c3 = self.coefficients
        zone = self.dead_zone
        return Cubic((-c0, c1, -c2, c3), self.sense, zone and (-zone[1], -zone[0]), -self.rest)

    def _from_rest(self, angle: Real) -> Real:
        return angle - self.rest if self.rest else angle

    def _acting(self, edge: float | None) -> Coefficients:
        """Coefficients of the torque on the child beyond an edge: sense * (M(a) - M(edge))."""
        c0, c1, c2, c3 = self.coefficients
        c0 -= 0.0 if edge is None else polynomial(self.coefficients, edge)
        s = self.sense
        return s * c0, s * c1, s * c2, s * c3

    def _work_from(self, edge: float, a: Real) -> Real:
        """Integral of M - M(edge) from the edge to a [J]."""
        c = self.coefficients
        work = antiderivative(c, a) - antiderivative(c, edge)
        return work - polynomial(c, edge) * (a - edge)
