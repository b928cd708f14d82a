"""The passive law for MuJoCo, written a second time and in another form than in `springs`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.figure import Figure, Joint, SiteRef
from generator.rotations import Array
from springs import AxisSpring, Cubic, Linear, SpringSet


@dataclass(frozen=True)
class Hung:
    """A joint of the tree: which of its sites is on the tip, and which on the base."""

    joint: Joint
    base: SiteRef
    tip: SiteRef

    @property
    def sign(self) -> float:
        """+1 where the tip is the joint's child, else -1."""
        return 1.0 if self.tip is self.joint.child else -1.0


class PassiveLaw:
    """The conservative law and the damping as MuJoCo's callback, for all joints at once.

    With rho the rotation vector of a ball and U(rho) the energy of its axes' curves, the torque in
    the tip's axes is J^-T (-dU/drho), where J is the right Jacobian of the rotation group: the
    tip's angular velocity in its own axes is J rho'. Damping acts about the axes turned half way.
    """

    def __init__(
        self, figure: Figure, model: Any, hung: Mapping[str, Hung], springs: SpringSet
    ) -> None:
        """Gather the springs of all joints into arrays."""
        given = {name: s.axes for name, s in springs.joints.items() if name in hung}
        hinges = [name for name in given if len(hung[name].joint.chain) == 1]
        balls = [name for name in given if name not in hinges]
        item = {name: model.joint(name) for name in given}
        self._ball_q = np.array([item[n].qposadr[0] + np.arange(4) for n in balls], dtype=int)
        self._ball_v = np.array([item[n].dofadr[0] + np.arange(3) for n in balls], dtype=int)
        self._hinge_q = np.array([item[name].qposadr[0] for name in hinges], dtype=int)
        self._hinge_v = np.array([item[name].dofadr[0] for name in hinges], dtype=int)
        self._axes = np.zeros((len(balls), 3, 3))
        for k, name in enumerate(balls):
            site = figure.site(hung[name].tip).pose_in_segment[:3, :3]
            directions = np.array([axis.direction for axis in given[name]])
            self._axes[k] = hung[name].sign * directions @ site.T
        self._signs = np.array(
            [np.dot(given[n][0].direction, hung[n].joint.chain[0].axis) for n in hinges]
        )
        slots = [axis for name in (*balls, *hinges) for axis in given[name]]
        self._curves = Curves(slots)

    def __call__(self, model: Any, data: Any) -> None:
        """Add the passive torques to those of MuJoCo."""
        scalar, vector, rho = _rotations(data.qpos[self._ball_q])
        rate = data.qvel[self._ball_v]
        across = _cross(vector, rate)
        rate = rate + across + _cross(vector, across) / (1.0 + scalar)
        elastic, damping = self._curves.torques(
            self._along(rho, data.qpos[self._hinge_q]), self._along(rate, data.qvel[self._hinge_v])
        )
        cut = 3 * len(self._axes)
        force, damped = (
            np.einsum("bi,bij->bj", part[:cut].reshape(-1, 3), self._axes)
            for part in (elastic, damping)
        )
        across = _cross(vector, damped)
        damped = damped - across + _cross(vector, across) / (1.0 + scalar)
        across = _cross(rho, force)
        torque = force - 0.5 * across + _jacobian_term(rho) * _cross(rho, across)
        data.qfrc_passive[self._ball_v] += torque + damped
        data.qfrc_passive[self._hinge_v] += self._signs * (elastic + damping)[cut:]

    def energy(self, qpos: Array) -> float:
        """Stored in the springs [J]."""
        return self._curves.energy(self._angles(qpos))

    def zones(self, qpos: Array) -> Array:
        """Side of each curve's dead zone: below (-1), within (0) or above (1)."""
        return self._curves.zones(self._angles(qpos))

    def _angles(self, qpos: Array) -> Array:
        _, _, rho = _rotations(qpos[self._ball_q])
        return self._along(rho, qpos[self._hinge_q])

    def _along(self, vectors: Array, values: Array) -> Array:
        """Components of the balls' vectors along their axes, then the hinges' values."""
        parts = np.einsum("bij,bj->bi", self._axes, vectors)
        return np.concatenate([parts.ravel(), self._signs * values])


class Curves:
    """The curves of many axes as arrays: sense (M(a) - M(edge)) beyond the edges (eq. 4.5)."""

    def __init__(self, springs: Sequence[AxisSpring]) -> None:
        """Gather the numbers; each axis has one law."""
        laws = [_as_cubic(spring) for spring in springs]
        self._c = np.array([law.coefficients for law in laws]).T
        self._sense = np.array([float(law.sense) for law in laws])
        self._rest = np.array([law.rest for law in laws])
        # Without a dead zone every angle is below an edge at infinity, where nothing is taken off.
        edges = np.array([law.dead_zone or (np.inf, np.inf) for law in laws]).T
        self._low, self._high = edges
        bounded = np.isfinite(edges)
        self._edges = np.where(bounded, edges, 0.0)
        self._off = np.where(bounded, self._moment(self._edges), 0.0)
        self._viscous, self._coulomb, self._slip = np.array(
            [(s.damping.viscous, s.damping.coulomb, s.damping.slip) for s in springs]
        ).T

    def _moment(self, a: Array) -> Array:
        c = self._c
        return ((c[3] * a + c[2]) * a + c[1]) * a + c[0]

    def _work(self, a: Array) -> Array:
        c = self._c
        return (((c[3] / 4.0 * a + c[2] / 3.0) * a + c[1] / 2.0) * a + c[0]) * a

    def torques(self, angles: Array, rates: Array) -> tuple[Array, Array]:
        """Elastic torque and damping torque on the child, shape (k,) each [N m]."""
        a = angles - self._rest
        moment = self._moment(a)
        below, above = a < self._low, a > self._high
        elastic = self._sense * (below * (moment - self._off[0]) + above * (moment - self._off[1]))
        return elastic, -self._viscous * rates - self._coulomb * np.tanh(rates / self._slip)

    def zones(self, angles: Array) -> Array:
        """-1, 0 or 1 for each curve, shape (k,)."""
        a = angles - self._rest
        return 1 * (a > self._high) - (a < self._low)

    def energy(self, angles: Array) -> float:
        """Sum of the stored energies [J]."""
        a = angles - self._rest
        work = self._work(a) - self._work(self._edges) - self._off * (a - self._edges)
        outside = (a < self._low) * work[0] + (a > self._high) * work[1]
        return float(np.sum(-self._sense * outside))


def _as_cubic(spring: AxisSpring) -> Cubic:
    (law,) = spring.elastic
    if isinstance(law, Linear):
        return Cubic((0.0, law.stiffness, 0.0, 0.0), -1, None, law.rest)
    assert isinstance(law, Cubic)
    return law


def _rotations(quaternions: Array) -> tuple[Array, Array, Array]:
    """Scalar part (n, 1), vector part (n, 3) and rotation vector (n, 3) of quaternions (n, 4)."""
    q = np.where(quaternions[:, :1] < 0.0, -quaternions, quaternions)
    scalar, vector = q[:, :1], q[:, 1:]
    size = np.sqrt(np.sum(vector * vector, axis=1, keepdims=True))
    small = size < 1e-9
    factor = np.where(small, 2.0, 2.0 * np.arctan2(size, scalar) / np.where(small, 1.0, size))
    return scalar, vector, factor * vector


def _jacobian_term(rho: Array) -> Array:
    """(1 - (a/2) cot(a/2)) / a^2 with a = |rho|, shape (n, 1)."""
    square = np.sum(rho * rho, axis=1, keepdims=True)
    small = square < 1e-4
    safe = np.where(small, 1.0, square)
    half = 0.5 * np.sqrt(safe)
    series = 1.0 / 12.0 + square / 720.0 + square * square / 30240.0
    return np.where(small, series, (1.0 - half / np.tan(half)) / safe)


def _cross(one: Array, other: Array) -> Array:
    return one[:, _NEXT] * other[:, _LAST] - one[:, _LAST] * other[:, _NEXT]


_NEXT, _LAST = [1, 2, 0], [2, 0, 1]
