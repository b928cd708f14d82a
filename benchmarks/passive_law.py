"""The passive law of balls and hinges, written once more for the engines that are compared with.

Nothing of `springs` is used. The torque of a ball is found by the chain rule through its
quaternion, where the program has the half-way frame: with the quaternion (w, v) of the tip in the
base, s = |v|, and r = 2 h v its rotation vector, h = atan2(s, w)/s, the power f . dr/dt of
f = -dU/dr is that of the torque

    h w f + (1 - h w)/s^2 v (v . f) + h f x v

on the tip, in the tip's own axes.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Protocol

import numpy as np

from benchmarks.tree import Link, TreeModel
from generator.figure import Figure
from generator.rotations import Array


class PassiveLaw(Protocol):
    """Torques on the tips of a tree's balls (in their axes) and hinges."""

    def torques(
        self, quaternions: Array, angles: Array, spins: Array, rates: Array
    ) -> tuple[Array, Array]:
        """Of balls, shape (b, 3), and of hinges, shape (h,) [N m]."""
        ...

    def energy(self, quaternions: Array, angles: Array) -> float:
        """Stored [J]."""
        ...


@dataclass(frozen=True)
class RadialLaw:
    """(linear + cubic a^2) r against the displacement and `viscous` against the rate.

    The reference figure's, the same for all joints; of a ball U depends on a = |r| alone, so the
    torque is along r in base and tip alike.
    """

    linear: float = 20.0
    cubic: float = 60.0
    viscous: float = 0.08

    def torques(
        self, quaternions: Array, angles: Array, spins: Array, rates: Array
    ) -> tuple[Array, Array]:
        """See `PassiveLaw`."""
        r, _, _ = rotation_vectors(quaternions)
        square = np.sum(r * r, axis=-1, keepdims=True)
        balls = -(self.linear + self.cubic * square) * r - self.viscous * spins
        hinges = -(self.linear + self.cubic * angles**2) * angles - self.viscous * rates
        return balls, hinges

    def energy(self, quaternions: Array, angles: Array) -> float:
        """See `PassiveLaw`."""
        r, _, _ = rotation_vectors(quaternions)
        square = np.concatenate([np.sum(r * r, axis=-1), angles**2])
        return float(np.sum((0.5 * self.linear + 0.25 * self.cubic * square) * square))


class CurveLaw:
    """Cubics with dead zones about the axes of joints (eq. 4.5), from a springs file's numbers."""

    @classmethod
    def from_file(cls, model: TreeModel, figure: Figure, name: str) -> "CurveLaw":
        """Gather the curves of `figures/NAME`."""
        document = tomllib.loads((files("figures") / name).read_text(encoding="utf-8"))
        return cls(model, figure, document["spring"])

    def __init__(
        self, model: TreeModel, figure: Figure, springs: Sequence[Mapping[str, Any]]
    ) -> None:
        """Gather the curves; every axis must have the same damping in a joint."""
        links = [*model.balls, *model.hinges]
        slots = [3] * len(model.balls) + [1] * len(model.hinges)
        first = dict(zip([link.joint for link in links], np.cumsum([0, *slots]), strict=False))
        count = sum(slots)
        self._c = np.zeros((4, count))
        self._sense, self._low, self._high = np.zeros(count), np.zeros(count), np.zeros(count)
        self._bounded = np.zeros(count)
        self._viscous = np.zeros(count)
        self._axes = np.zeros((len(model.balls), 3, 3))
        by_joint = {link.joint: link for link in links}
        used = dict.fromkeys(first, 0)
        for spring in springs:
            if spring["coulomb_Nm"]:
                raise ValueError("this law has no friction")
            for joint in spring["joints"]:
                link, k = by_joint[joint], first[joint] + used[joint]
                direction = _declared(figure, link, spring["axis"])
                if link.axis is None:
                    self._axes[model.balls.index(link), used[joint]] = direction
                used[joint] += 1
                self._c[:, k] = spring["coefficients_Nm_rad"]
                self._sense[k] = spring["sense"]
                self._viscous[k] = spring["viscous_Nms_rad"]
                if "dead_zone_deg" in spring:
                    self._bounded[k] = 1.0
                    self._low[k], self._high[k] = np.radians(spring["dead_zone_deg"])
        self._cut = 3 * len(model.balls)
        per_ball = self._viscous[: self._cut].reshape(-1, 3)
        if np.any(per_ball != per_ball[:, :1]):
            raise ValueError("this law damps a ball alike about all axes")
        self._ball_damping = per_ball[:, :1]
        self._hinge_damping = self._viscous[self._cut :]

    def torques(
        self, quaternions: Array, angles: Array, spins: Array, rates: Array
    ) -> tuple[Array, Array]:
        """See `PassiveLaw`."""
        r, h, s = rotation_vectors(quaternions)
        a = self._displacements(r, angles)
        edge = np.clip(a, self._low, self._high)
        size = self._sense * (self._moment(a) - self._bounded * self._moment(edge))
        f = np.einsum("bi,bij->bj", size[: self._cut].reshape(-1, 3), self._axes)
        w, v = near_side(quaternions)
        along = np.sum(v * f, axis=-1, keepdims=True)
        near = s < 1e-3
        part = np.where(
            near, 1.0 / 3.0 + 2.0 / 15.0 * s * s, (1.0 - h * w) / np.where(near, 1.0, s * s)
        )
        balls = h * w * f + part * along * v + h * cross(f, v) - self._ball_damping * spins
        return balls, size[self._cut :] - self._hinge_damping * rates

    def energy(self, quaternions: Array, angles: Array) -> float:
        """See `PassiveLaw`."""
        r, _, _ = rotation_vectors(quaternions)
        a = self._displacements(r, angles)
        edge = np.clip(a, self._low, self._high)
        beyond = (
            self._work(a)
            - self._bounded * self._work(edge)
            - (self._bounded * self._moment(edge) * (a - edge))
        )
        return float(-np.sum(self._sense * beyond))

    def zones(self, quaternions: Array, angles: Array) -> Array:
        """-1 below, 0 within or 1 above the dead zone of each curve that has one."""
        r, _, _ = rotation_vectors(quaternions)
        a = self._displacements(r, angles)
        return self._bounded * (1.0 * (a > self._high) - (a < self._low))

    def _displacements(self, r: Array, angles: Array) -> Array:
        """Of all axes: components of the rotation vectors, then the hinges' angles [rad]."""
        return np.concatenate([np.einsum("bij,bj->bi", self._axes, r).ravel(), angles])

    def _moment(self, a: Array) -> Array:
        c = self._c
        return c[0] + a * (c[1] + a * (c[2] + a * c[3]))

    def _work(self, a: Array) -> Array:
        c = self._c
        return a * (c[0] + a * (c[1] / 2.0 + a * (c[2] / 3.0 + a * c[3] / 4.0)))


def _declared(figure: Figure, link: Link, axis: str | tuple[float, ...]) -> Array:
    """The axis that a springs file names, as the joint declares it, for turns of the tip."""
    chain = figure.joints[link.joint].chain
    if isinstance(axis, tuple):
        return link.sign * np.array(axis)
    if axis == "joint":
        return link.sign * np.array(chain[0].axis)
    place = "xyz".index(axis)
    (found,) = [factor.axis for factor in chain if factor.axis[place]]
    return link.sign * np.array(found)


def rotation_vectors(quaternions: Array) -> tuple[Array, Array, Array]:
    """The r (b, 3) [rad], h (b, 1) and s (b, 1) of unit quaternions (b, 4), below a half turn."""
    w, v = near_side(quaternions)
    s = np.sqrt(np.sum(v * v, axis=-1, keepdims=True))
    near = s < 1e-4
    h = np.where(near, 1.0 + s * s / 6.0, np.arctan2(s, w) / np.where(near, 1.0, s))
    return 2.0 * h * v, h, s


def near_side(quaternions: Array) -> tuple[Array, Array]:
    """Scalar part (b, 1) and vector part (b, 3), the scalar not negative."""
    sign = np.where(quaternions[:, :1] < 0.0, -1.0, 1.0)
    return sign * quaternions[:, :1], sign * quaternions[:, 1:]


def cross(one: Array, other: Array) -> Array:
    """Row by row; numpy's own costs several times as much on small arrays."""
    return one[:, [1, 2, 0]] * other[:, [2, 0, 1]] - one[:, [2, 0, 1]] * other[:, [1, 2, 0]]
