"""Passive torque about one axis of the prototype, read out of Exudyn, and the claims about it.

A curve is compared with measurements of people only, within the range that was measured, and not
within a dead zone that the thesis does not print.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import degrees, inf, isnan, nan, radians

import numpy as np
from numpy.typing import NDArray

from generator import read_figure, static_torques
from generator.springs_file.read import read_springs
from plots.literature import Literature
from plots.plate import Claim, ClaimKind, comparison, incomparable_claim
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
        angles: angles in the sense of the motion, increasing, shape (n,) [rad].
        simulated: read out of Exudyn, shape (n,) [N m].
        other_side_torques: the same of the right joint about its own axis, or None without one.
        low: lower end of the normal range of motion, or None if unknown.
        high: upper end likewise.
        held_text: angles of the other joints in words, or "" if all are zero.
        has_assumed_dead_zone: True if the dead zone is this project's reading: the thesis prints
            none for spherical joints.
    """

    joint: str
    spring: AxisSpring
    angles: Array
    simulated: Array
    other_side_torques: Array | None
    low: RangeEnd | None
    high: RangeEnd | None
    held_text: str = ""
    has_assumed_dead_zone: bool = False

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

    def other_sense_torques(self, angles: Array) -> Array:
        """The cubic without its dead zone, in the sense that was not chosen [N m]."""
        return -self.printed_torques(angles)

    @property
    def outward_torque(self) -> float:
        """Largest torque of the printed cubic between its outer two roots, or 0 [N m]."""
        zone = outer_roots(self.cubic.coefficients)
        if zone is None:
            return 0.0
        return float(np.abs(self.printed_torques(np.linspace(*zone, 1001))).max())

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

    def zero_crossing(self, low: float, high: float) -> float:
        """Angle at which the torque changes its sign within a range, interpolated [rad]."""
        inside = self.range_mask(low, high)
        return first_zero_crossing(self.angles[inside], self.simulated[inside])

    def resistance_angle(self, side: int, torque: float) -> float:
        """First angle from zero towards a side (+1 or -1) with a resisting torque [rad], or nan."""
        outward = np.argsort(side * self.angles)
        angles, resisting = side * self.angles[outward], -side * self.simulated[outward]
        firm = np.flatnonzero((angles >= 0.0) & (resisting >= torque))
        if not firm.size:
            return nan
        k = int(firm[0])
        if angles[k] == 0.0:
            return 0.0
        pair = slice(k - 1, k + 1)
        return side * float(np.interp(torque, resisting[pair], angles[pair]))

    def compare_with(self, literature: Literature, low: float, high: float) -> tuple[Array, Array]:
        """Published torque, and simulated minus published, within a range [rad].

        Both are taken at the points of a digitised curve, otherwise at those readings for which the
        curve is published; not beyond the range in which it is known, nor within a dead zone that
        the thesis does not print.

        Returns:
            Both in N m, shape (m,) each.
        """
        angles = self.angles if literature.points is None else literature.points[0]
        low, high = literature.known_part(low, high)
        chosen = (angles >= low - 1e-12) & (angles <= high + 1e-12)
        if self.has_assumed_dead_zone:
            first, last = self.dead_zone
            chosen &= (angles < first) | (angles > last)
        at = angles[chosen]
        published = literature.torque(at)
        known_at = np.isfinite(published)
        at, published = at[known_at], published[known_at]
        return published, np.interp(at, self.angles, self.simulated) - published


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
    springs = read_springs(None, figure)
    pair = [name for name in (joint, joint.replace("left", "right")) if name in figure.joints]
    pair = list(dict.fromkeys(pair))
    springs_of_pair = {
        one: next(axis for axis in springs.joints[one].axes if axis.motion == motion)
        for one in pair
    }
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
    read = static_torques(figure, poses)
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
        len(figure.joints[joint].chain) > 1 and springs_of_pair[joint].elastic[0].breakpoints != (),
    )


def format_range(low: float, high: float) -> str:
    """Format a range [rad] as `-0.8 to 144.6 deg`."""
    return f"{round(degrees(low), 1):g} to {round(degrees(high), 1):g} deg"


TORQUE_TOLERANCE = 1e-6
"""Difference below which torques are equal [N m]."""

AGREEMENT_TORQUE = 5.0
"""Difference from a measurement that still agrees [N m].

The thesis gives 5 to 10 N m between the curves of the hip towards flexion and towards extension, of
which it takes one; cadaver hips end their range at 5 N m.
"""

MIN_DRIVING_TORQUE = 1.0
"""Smallest torque that sets a limb moving [N m]."""


def law_claims(curve: JointCurve) -> list[Claim]:
    """Claim that the model has the torque of the law, on both sides of the body."""
    swept = format_range(float(curve.angles[0]), float(curve.angles[-1]))
    other = curve.other_side_torques
    sides = {f"The torque read out of Exudyn is that of the law from {swept}": curve.law_torques}
    if other is not None:
        sides["The joint of the other side has the same torque about its own axis"] = other
    claims: list[Claim] = []
    for sentence, torques in sides.items():
        difference = float(np.abs(curve.simulated - torques).max())
        claims.append(Claim(sentence, difference, "N m", at_most=TORQUE_TOLERANCE))
    return claims


def range_end_claim(
    curve: JointCurve, end: RangeEnd, remark: str = "", obstacle: str = ""
) -> Claim:
    """Compare the angle of firm resistance with an end of the normal range.

    Args:
        curve: simulated.
        end: one of `curve.range_ends`.
        remark: remark of the claim.
        obstacle: reason why this end cannot be compared, or "".
    """
    side = -1 if end is curve.low else 1
    at, normal = degrees(curve.resistance_angle(side, FIRM_TORQUE)), degrees(end.angle)
    reached = "at no angle" if isnan(at) else f"at {at:.1f} deg"
    sentence = (
        f"The resistance reaches {FIRM_TORQUE:g} N m (where an examiner would stop) {reached}; the "
        f"normal range of {end.motion} ends at {normal:.1f} deg ({end.sample}): difference"
    )
    if obstacle:
        return incomparable_claim(sentence.removesuffix(": difference"), obstacle)
    return comparison(sentence, abs(at - normal), "deg", -inf, degrees(RANGE_MARGIN), remark)


def range_end_claims(
    curve: JointCurve, low: str = "", high: str = "", obstacle: str = ""
) -> Iterator[Claim]:
    """Compare both ends of the normal range, with a remark on each; see `range_end_claim`."""
    for end in curve.range_ends:
        yield range_end_claim(curve, end, high if end is curve.high else low, obstacle)


def range_width_claim(curve: JointCurve, remark: str = "") -> Claim:
    """Compare the width between firm resistance on both sides with that of the normal range.

    A width does not depend on the zero of the measurement.
    """
    assert curve.low is not None
    assert curve.high is not None
    low, high = (degrees(curve.resistance_angle(side, FIRM_TORQUE)) for side in (-1, 1))
    normal = degrees(curve.high.angle - curve.low.angle)
    return comparison(
        f"From one end to the other the joint has less than {FIRM_TORQUE:g} N m over "
        f"{high - low:.0f} deg, the normal range is {normal:.0f} deg wide: difference",
        abs(high - low - normal),
        "deg",
        -inf,
        2.0 * degrees(RANGE_MARGIN),
        remark,
    )


def difference_claim(
    curve: JointCurve, literature: Literature, low: float, high: float, remark: str = ""
) -> Claim:
    """Compare a torque with a measured one: root mean square of their difference.

    The bound is that of the published scatter, `AGREEMENT_TORQUE` at least. Where a joint without
    springs would agree as well there is nothing to compare.

    Args:
        curve: simulated.
        literature: published.
        low: lower end of the range compared [rad], cut to the range that was measured.
        high: upper end.
        remark: remark of the claim.
    """
    low, high = literature.known_part(low, high)
    sentence = f"From {format_range(low, high)} the torque is that of {literature.label}"
    published, less = curve.compare_with(literature, low, high)
    obstacle = literature.obstacle
    if not obstacle and not less.size:
        obstacle = "all of it is in a dead zone that the thesis does not print"
    bound = AGREEMENT_TORQUE
    edges = literature.band(np.linspace(low, high, 101))
    if edges is not None:
        bound = max(bound, float(np.sqrt(np.mean(((edges[1] - edges[0]) / 2.0) ** 2))))
    rms, soft = (
        float(np.sqrt(np.mean(np.square(x)))) if x.size else nan for x in (less, published)
    )
    if not obstacle and max(rms, soft) <= bound:
        obstacle = f"both torques are below {bound:.2g} N m (rms), as those of any soft joint"
    if obstacle:
        return incomparable_claim(sentence, obstacle)
    sentence = (
        f"{sentence}: rms of {less.size} differences, of torques up to "
        f"{np.abs(published).max():.3g} N m"
    )
    return comparison(sentence, rms, "N m", -inf, bound, remark)


def same_direction_claim(
    curve: JointCurve, literature: Literature, low: float, high: float
) -> Claim:
    """Compare the signs of simulated and measured torque wherever both drive.

    Args:
        curve: simulated.
        literature: published.
        low: lower end of the range compared [rad], cut to the range that was measured.
        high: upper end.
    """
    low, high = literature.known_part(low, high)
    inside = curve.range_mask(low, high)
    published = literature.torque(curve.angles[inside])
    simulated = curve.simulated[inside]
    both = np.minimum(np.abs(simulated), np.abs(published)) > MIN_DRIVING_TORQUE
    angles = curve.angles[inside]
    widths = np.diff([angles[0], *(0.5 * (angles[1:] + angles[:-1])), angles[-1]])
    over = float(np.sum(widths[both]))
    opposed = float(np.sum(widths[both & (simulated * published < 0.0)]))
    sentence = f"From {format_range(low, high)} torque and {literature.label} push the same way"
    obstacle = literature.obstacle
    if not obstacle and not over:
        obstacle = f"nowhere do both exceed {MIN_DRIVING_TORQUE:g} N m"
    if obstacle:
        return incomparable_claim(sentence, obstacle)
    return Claim(
        f"{sentence} wherever both exceed {MIN_DRIVING_TORQUE:g} N m, over {degrees(over):.3g} deg",
        100.0 * (1.0 - opposed / over),
        "%",
        at_least=100.0,
        kind=ClaimKind.COMPARISON,
    )
