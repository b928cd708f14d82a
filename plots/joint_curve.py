"""The passive torque about one axis of the prototype, read out of Exudyn as the joint is moved."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, nan, radians

import numpy as np
from numpy.typing import NDArray

from generator import Plan, read_figure, static_torques
from generator.engine.chosen_springs import springs_of
from plots.literature import Literature
from springs import AxisSpring, Cubic, total_torque
from springs.cubic import polynomial
from springs.lint import FIRM
from springs.normal_range import RangeEnd, normal_range
from springs.operations import Array

Mask = NDArray[np.bool_]

SWEEP = np.arange(-150.0, 175.5, 1.0)
"""Angles at which a joint is read [deg]; a spherical joint cannot be turned by 180."""


@dataclass(frozen=True)
class JointCurve:
    """A joint moved about one axis, at rest in every pose; torques act on the child.

    Attributes:
        joint: its name, the left one of a pair.
        spring: what the figure has about the axis.
        angles: in the sense of the motion, increasing, shape (n,) [rad].
        simulated: read out of Exudyn, shape (n,) [N m].
        other_side: the same of the right joint about its own axis, or None where there is none.
        low: lower end of the normal range of motion, where one is known.
        high: upper end likewise.
        held: how the other joints stood, in words.
    """

    joint: str
    spring: AxisSpring
    angles: Array
    simulated: Array
    other_side: Array | None
    low: RangeEnd | None
    high: RangeEnd | None
    held: str = ""

    def __post_init__(self) -> None:
        """Refuse readings that do not belong together."""
        if self.simulated.shape != self.angles.shape or self.angles.ndim != 1:
            raise ValueError("there is one torque for each angle")
        if not np.all(np.diff(self.angles) > 0.0):
            raise ValueError("the angles of a curve increase")

    @property
    def motion(self) -> str:
        """What a positive angle is."""
        return self.spring.motion

    @property
    def cubic(self) -> Cubic:
        """The thesis's law of the axis."""
        (law,) = self.spring.elastic
        assert isinstance(law, Cubic)
        return law

    @property
    def law(self) -> Array:
        """The torque that the law has at the angles, shape (n,) [N m]."""
        return np.asarray(total_torque(self.spring.elastic, self.angles))

    def printed(self, angles: Array) -> Array:
        """The cubic without dead zone, in the sense of the torque on the child [N m]."""
        return self.cubic.sense * np.asarray(polynomial(self.cubic.coefficients, angles))

    @property
    def normal(self) -> tuple[float, float]:
        """The normal range [rad]; where one end is not known, zero."""
        low = 0.0 if self.low is None else self.low.angle
        return low, 0.0 if self.high is None else self.high.angle

    def within(self, low: float, high: float) -> Mask:
        """Which readings are from `low` to `high` [rad], shape (n,) of bool."""
        return (self.angles >= low - 1e-12) & (self.angles <= high + 1e-12)

    def at(self, angle: float) -> float:
        """The torque read at an angle [rad] or interpolated between its neighbours [N m]."""
        return float(np.interp(angle, self.angles, self.simulated))

    def firm_angle(self, side: int) -> float:
        """The first angle from zero towards a side (+1 or -1) of firm resistance [rad].

        nan where there is none among the readings.
        """
        outward = np.argsort(side * self.angles)
        angles, resisting = side * self.angles[outward], -side * self.simulated[outward]
        firm = np.flatnonzero((angles >= 0.0) & (resisting >= FIRM))
        if not firm.size:
            return nan
        k = int(firm[0])
        if angles[k] == 0.0:
            return 0.0
        pair = slice(k - 1, k + 1)
        return side * float(np.interp(FIRM, resisting[pair], angles[pair]))

    def zero_between(self, low: float, high: float) -> float:
        """Where the torque changes its sign within a range, by interpolation [rad]."""
        inside = self.within(low, high)
        return zero_of(self.angles[inside], self.simulated[inside])

    def beside(self, literature: Literature, low: float, high: float) -> tuple[Array, Array]:
        """Published torque, and simulated less published, within a range.

        They are at the readings, or at the points of a digitised curve; readings at which the
        literature has no curve are left out.

        Returns:
            Both in N m, shape (m,) each.
        """
        inside = self.within(low, high)
        angles, simulated = self.angles[inside], self.simulated[inside]
        if literature.points is not None:
            at, published = literature.points
            chosen = (at >= low - 1e-12) & (at <= high + 1e-12)
            published = published[chosen]
            return published, np.interp(at[chosen], self.angles, self.simulated) - published
        published = literature.torque(angles)
        given = np.isfinite(published)
        return published[given], (simulated - published)[given]


def zero_of(angles: Array, torques: Array) -> float:
    """The first angle at which torques change their sign, by interpolation [rad], or nan.

    A stretch of zeros counts from its start.
    """
    changes = np.flatnonzero(torques[:-1] * torques[1:] <= 0.0)
    if not changes.size:
        return nan
    k = int(changes[0])
    a, b = float(torques[k]), float(torques[k + 1])
    share = a / (a - b) if a != b else 0.0
    return float(angles[k] + share * (angles[k + 1] - angles[k]))


def read_curve(joint: str, motion: str, held_deg: Mapping[str, float] | None = None) -> JointCurve:
    """Move a joint of the prototype about one axis, its counterpart with it, and read both.

    Args:
        joint: its name.
        motion: what a positive angle about the axis is.
        held_deg: hinges that stand at an angle [deg]; every other joint is straight.
    """
    figure = read_figure("prototype")
    plan = Plan()
    springs = springs_of(figure, plan)
    pair = [name for name in (joint, joint.replace("left", "right")) if name in figure.joints]
    pair = list(dict.fromkeys(pair))
    found = {name: _about(springs.joints[name].axes, motion) for name in pair}
    low, high = normal_range(joint, motion)
    marks = [end.angle for end in (low, high) if end is not None and abs(end.angle) < np.pi]
    corners = [corner for law in found[joint].elastic for corner in law.corners]
    angles = np.unique([*np.radians(SWEEP), *marks, *corners])
    poses: list[dict[str, Array]] = []
    for angle in angles:
        pose = {name: np.array([radians(at)]) for name, at in (held_deg or {}).items()}
        for name, spring in found.items():
            chain = figure.joints[name].chain
            pose[name] = np.array([angle * np.dot(f.axis, spring.direction) for f in chain])
        poses.append(pose)
    read = static_torques(figure, poses, plan)
    sides = [read[name] @ spring.direction for name, spring in found.items()]
    return JointCurve(
        joint,
        found[joint],
        angles,
        sides[0],
        sides[1] if len(sides) > 1 else None,
        low,
        high,
        ", ".join(f"{name} at {at:g} deg" for name, at in (held_deg or {}).items()),
    )


def _about(axes: tuple[AxisSpring, ...], motion: str) -> AxisSpring:
    return next(spring for spring in axes if spring.motion == motion)


def range_words(low: float, high: float) -> str:
    """A range [rad] as `-0.8 to 144.6 deg`."""
    return f"{round(degrees(low), 1):g} to {round(degrees(high), 1):g} deg"
