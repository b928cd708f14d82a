"""Passive torque about one axis of the prototype, read out of Exudyn, and the claims about it.

Claims of resistance fail for a joint without springs. Claims that a joint is free somewhere cannot:
they are made only where it, or the published curve, has some torque.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, nan, radians

import numpy as np
from numpy.typing import NDArray

from generator import Plan, read_figure, static_torques
from generator.simulation.plan import resolve_springs
from plots.literature import Literature
from plots.plate import Claim
from springs import AxisSpring, Cubic, total_torque
from springs.backends import Array
from springs.cubic import outer_roots, polynomial
from springs.lint.curve import FIRM_TORQUE, RANGE_MARGIN
from springs.published.range_of_motion import RangeEnd, normal_range

Mask = NDArray[np.bool_]

SWEEP = np.arange(-150.0, 175.5, 1.0)
"""Angles at which a joint is read [deg]; a spherical joint cannot be rotated by 180."""


@dataclass(frozen=True)
class JointCurve:
    """Static torques of a joint rotated about one axis; torques act on the child.

    Attributes:
        joint: its name, the left one of a pair.
        spring: the figure's spring about the axis.
        angles: in the sense of the motion, increasing, shape (n,) [rad].
        simulated: read out of Exudyn, shape (n,) [N m].
        other_side_torques: the same of the right joint about its own axis, or None without one.
        low: lower end of the normal range of motion, or None if unknown.
        high: upper end likewise.
        held_text: angles of the other joints in words, or "" if all are zero.
    """

    joint: str
    spring: AxisSpring
    angles: Array
    simulated: Array
    other_side_torques: Array | None
    low: RangeEnd | None
    high: RangeEnd | None
    held_text: str = ""

    def __post_init__(self) -> None:
        """Raise ValueError for readings that do not match."""
        if self.simulated.shape != self.angles.shape or self.angles.ndim != 1:
            raise ValueError("there must be one torque per angle")
        if not np.all(np.diff(self.angles) > 0.0):
            raise ValueError("the angles of a curve must increase")

    @property
    def motion(self) -> str:
        """Name of the positive sense."""
        return self.spring.motion

    @property
    def cubic(self) -> Cubic:
        """The thesis's law of the axis."""
        (law,) = self.spring.elastic
        assert isinstance(law, Cubic)
        return law

    @property
    def dead_zone(self) -> tuple[float, float]:
        """The dead zone of a law that has one [rad]."""
        zone = self.cubic.dead_zone
        assert zone is not None
        return zone

    @property
    def law_torques(self) -> Array:
        """Torque of the law at the angles, shape (n,) [N m]."""
        return np.asarray(total_torque(self.spring.elastic, self.angles))

    def printed_torques(self, angles: Array) -> Array:
        """The cubic without its dead zone, as torque on the child [N m]."""
        return self.cubic.sense * np.asarray(polynomial(self.cubic.coefficients, angles))

    @property
    def normal_range(self) -> tuple[float, float]:
        """The normal range [rad]; zero for an unknown end."""
        low = 0.0 if self.low is None else self.low.angle
        return low, 0.0 if self.high is None else self.high.angle

    @property
    def range_ends(self) -> list[RangeEnd]:
        """The known ends of the normal range, the lower one first."""
        return [end for end in (self.low, self.high) if end is not None]

    def range_mask(self, low: float, high: float) -> Mask:
        """True for readings from `low` to `high` [rad], shape (n,)."""
        return (self.angles >= low - 1e-12) & (self.angles <= high + 1e-12)

    def torque_at(self, angle: float) -> float:
        """Torque at an angle [rad], interpolated between readings [N m]."""
        return float(np.interp(angle, self.angles, self.simulated))

    def firm_resistance_angle(self, side: int) -> float:
        """First angle of firm resistance from zero towards a side (+1 or -1) [rad], or nan."""
        outward = np.argsort(side * self.angles)
        angles, resisting = side * self.angles[outward], -side * self.simulated[outward]
        firm = np.flatnonzero((angles >= 0.0) & (resisting >= FIRM_TORQUE))
        if not firm.size:
            return nan
        k = int(firm[0])
        if angles[k] == 0.0:
            return 0.0
        pair = slice(k - 1, k + 1)
        return side * float(np.interp(FIRM_TORQUE, resisting[pair], angles[pair]))

    def zero_crossing(self, low: float, high: float) -> float:
        """Angle at which the torque changes its sign within a range, interpolated [rad]."""
        inside = self.range_mask(low, high)
        return first_zero_crossing(self.angles[inside], self.simulated[inside])

    def compare_with(self, literature: Literature, low: float, high: float) -> tuple[Array, Array]:
        """Published torque, and simulated minus published, within a range [rad].

        Both are taken at the points of a digitised curve, otherwise at those readings for which the
        curve is published.

        Returns:
            Both in N m, shape (m,) each.
        """
        inside = self.range_mask(low, high)
        angles, simulated = self.angles[inside], self.simulated[inside]
        if literature.points is not None:
            at, published = literature.points
            chosen = (at >= low - 1e-12) & (at <= high + 1e-12)
            published = published[chosen]
            return published, np.interp(at[chosen], self.angles, self.simulated) - published
        published = literature.torque(angles)
        known = np.isfinite(published)
        return published[known], (simulated - published)[known]


def first_zero_crossing(angles: Array, torques: Array) -> float:
    """First angle at which torques change their sign, interpolated [rad], or nan.

    A run of zeros counts from its start.
    """
    changes = np.flatnonzero(torques[:-1] * torques[1:] <= 0.0)
    if not changes.size:
        return nan
    k = int(changes[0])
    a, b = float(torques[k]), float(torques[k + 1])
    share = a / (a - b) if a != b else 0.0
    return float(angles[k] + share * (angles[k + 1] - angles[k]))


def read_curve(joint: str, motion: str, held_deg: Mapping[str, float] | None = None) -> JointCurve:
    """Rotate a joint of the prototype and its counterpart about one axis, and read both torques.

    Args:
        joint: its name.
        motion: name of the positive sense about the axis.
        held_deg: angles of revolute joints other than zero [deg].
    """
    figure = read_figure("prototype")
    plan = Plan()
    springs = resolve_springs(figure, plan)
    pair = [name for name in (joint, joint.replace("left", "right")) if name in figure.joints]
    pair = list(dict.fromkeys(pair))
    springs_of_pair = {name: _spring_about(springs.joints[name].axes, motion) for name in pair}
    low, high = normal_range(joint, motion)
    range_ends = [end.angle for end in (low, high) if end is not None and abs(end.angle) < np.pi]
    breakpoints = [angle for law in springs_of_pair[joint].elastic for angle in law.breakpoints]
    angles = np.unique([*np.radians(SWEEP), *range_ends, *breakpoints])
    poses: list[dict[str, Array]] = []
    for angle in angles:
        pose = {name: np.array([radians(at)]) for name, at in (held_deg or {}).items()}
        for name, spring in springs_of_pair.items():
            chain = figure.joints[name].chain
            pose[name] = np.array([angle * np.dot(f.axis, spring.direction) for f in chain])
        poses.append(pose)
    read = static_torques(figure, poses, plan)
    sides = [read[name] @ spring.direction for name, spring in springs_of_pair.items()]
    return JointCurve(
        joint,
        springs_of_pair[joint],
        angles,
        sides[0],
        sides[1] if len(sides) > 1 else None,
        low,
        high,
        ", ".join(f"{name} at {at:g} deg" for name, at in (held_deg or {}).items()),
    )


def _spring_about(axes: tuple[AxisSpring, ...], motion: str) -> AxisSpring:
    return next(spring for spring in axes if spring.motion == motion)


def format_range(low: float, high: float) -> str:
    """Format a range [rad] as `-0.8 to 144.6 deg`."""
    return f"{round(degrees(low), 1):g} to {round(degrees(high), 1):g} deg"


TORQUE_TOLERANCE = 1e-6
"""Difference below which torques are equal [N m]."""

RANGE_END_MOMENT = 5.0
"""Moment that defines the ends of the range of a cadaver joint [N m]."""

MAX_SIZE_RATIO = 2.0
"""Largest ratio of torques of the same magnitude, either way."""

MIN_DRIVING_TORQUE = 1.0
"""Smallest torque that sets a limb moving [N m]."""

MAX_RELATIVE_RMS = 0.5
"""Largest rms difference from a published curve relative to its rms; 1 without springs."""


def law_claims(curve: JointCurve) -> list[Claim]:
    """Claim that the model has the torque of the law, on both sides of the body."""
    swept = format_range(float(curve.angles[0]), float(curve.angles[-1]))
    claims = [
        Claim(
            f"The torque read out of Exudyn is that of the law from {swept}",
            float(np.abs(curve.simulated - curve.law_torques).max()),
            "N m",
            at_most=TORQUE_TOLERANCE,
        )
    ]
    if curve.other_side_torques is not None:
        claims.append(
            Claim(
                "The joint of the other side has the same torque about its own axis",
                float(np.abs(curve.simulated - curve.other_side_torques).max()),
                "N m",
                at_most=TORQUE_TOLERANCE,
            )
        )
    return claims


def low_resistance_claim(curve: JointCurve, remark: str = "") -> Claim:
    """Claim that a joint can be moved through its normal range."""
    low, high = curve.normal_range
    high = min(high, float(curve.angles[-1]))
    inside = curve.range_mask(low, high)
    return Claim(
        f"Within the normal range, {format_range(low, high)}, the joint resists with less than "
        f"{FIRM_TORQUE:g} N m, the torque that stops an examiner's hand",
        float(np.abs(curve.simulated[inside]).max()),
        "N m",
        at_most=FIRM_TORQUE,
        remark=remark,
    )


def stop_not_early_claim(curve: JointCurve, remark: str = "") -> Claim:
    """Claim that a joint's stop is not below the upper end of its normal range."""
    assert curve.high is not None
    end = degrees(curve.high.angle)
    return Claim(
        f"The stop of {curve.motion} ({FIRM_TORQUE:g} N m) is not below the normal limit, "
        f"{end:.4g} deg",
        degrees(curve.firm_resistance_angle(1)),
        "deg",
        at_least=end,
        remark=remark,
    )


def printed_cubic_claim(curve: JointCurve) -> Claim:
    """Claim that the printed cubic does not push outwards between its outer roots."""
    zone = outer_roots(curve.cubic.coefficients)
    assert zone is not None
    between = np.linspace(*zone, 1001)
    return Claim(
        f"As printed, the cubic does not push the joint outwards between its outer two roots, "
        f"{format_range(*zone)}",
        float(np.abs(curve.printed_torques(between)).max()),
        "N m",
        at_most=0.0,
        remark="so the law has a dead zone there, as eq. 4.5 gives elbow and knee",
    )


def same_direction_claim(
    curve: JointCurve, literature: Literature, low: float, high: float, remark: str = ""
) -> Claim:
    """Claim that simulated and published torque have the same sign wherever both drive.

    For a joint that drives nowhere in the range the measured share is nan.

    Args:
        curve: simulated.
        literature: published.
        low: lower end of the range compared [rad].
        high: upper end.
        remark: of the claim.
    """
    inside = curve.range_mask(low, high)
    published = literature.torque(curve.angles[inside])
    simulated = curve.simulated[inside]
    both = np.minimum(np.abs(simulated), np.abs(published)) > MIN_DRIVING_TORQUE
    angles = curve.angles[inside]
    widths = np.diff([angles[0], *(0.5 * (angles[1:] + angles[:-1])), angles[-1]])
    over = float(np.sum(widths[both]))
    opposed = float(np.sum(widths[both & (simulated * published < 0.0)]))
    return Claim(
        f"From {format_range(low, high)} simulated curve and {literature.label} push the same way "
        f"wherever both exceed {MIN_DRIVING_TORQUE:g} N m, over {degrees(over):.3g} deg",
        100.0 * (1.0 - opposed / over) if over else nan,
        "%",
        at_least=100.0,
        remark=remark,
    )


def low_torque_claim(
    curve: JointCurve, literature: Literature, low: float, high: float, remark: str = ""
) -> Claim:
    """Claim that neither simulated nor published torque is firm: both joints are free.

    Args:
        curve: simulated.
        literature: published.
        low: lower end of the range compared [rad].
        high: upper end.
        remark: of the claim.
    """
    published, _ = curve.compare_with(literature, low, high)
    inside = curve.range_mask(low, high)
    return Claim(
        f"From {format_range(low, high)} both torques are small: neither the simulated one nor "
        f"that of {literature.label} exceeds {FIRM_TORQUE:g} N m, which stops an examiner's hand",
        max(float(np.abs(curve.simulated[inside]).max()), float(np.abs(published).max())),
        "N m",
        at_most=FIRM_TORQUE,
        remark=remark,
    )


def rms_difference_claim(
    curve: JointCurve, literature: Literature, low: float, high: float, remark: str = ""
) -> Claim:
    """Claim that simulated and published torque differ by little, relative to the published one.

    Args:
        curve: simulated.
        literature: published.
        low: lower end of the range compared [rad].
        high: upper end.
        remark: of the claim.
    """
    published, less = curve.compare_with(literature, low, high)
    own = float(np.sqrt(np.mean(published**2)))
    return Claim(
        f"From {format_range(low, high)} the simulated torque is within half of that of "
        f"{literature.label}: rms of {less.size} differences relative to the rms published, "
        f"{own:.3g} N m",
        float(np.sqrt(np.mean(less**2))) / own,
        at_most=MAX_RELATIVE_RMS,
        remark=remark,
    )


def same_magnitude_claim(
    curve: JointCurve, literature: Literature, angle_deg: float, remark: str = ""
) -> Claim:
    """Claim that simulated and published torque at an angle [deg] agree in magnitude and sign."""
    angle = radians(angle_deg)
    published = literature.torque_at(angle)
    return Claim(
        f"At {angle_deg:g} deg the simulated torque is that of {literature.label}, "
        f"{published:.3g} N m, within a factor of {MAX_SIZE_RATIO:g}: ratio",
        curve.torque_at(angle) / published,
        at_least=1.0 / MAX_SIZE_RATIO,
        at_most=MAX_SIZE_RATIO,
        remark=remark,
    )


def stop_not_late_claim(curve: JointCurve, remark: str = "") -> Claim:
    """Claim that a joint stops not far beyond the ends of its normal range."""
    assert curve.low is not None
    assert curve.high is not None
    over = max(
        curve.firm_resistance_angle(1) - curve.high.angle,
        curve.low.angle - curve.firm_resistance_angle(-1),
    )
    return Claim(
        f"At both ends the joint resists with {FIRM_TORQUE:g} N m not more than "
        f"{degrees(RANGE_MARGIN):g} deg beyond its normal range, "
        f"{format_range(*curve.normal_range)}",
        degrees(over),
        "deg",
        at_most=degrees(RANGE_MARGIN),
        remark=remark,
    )
