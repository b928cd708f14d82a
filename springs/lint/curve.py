"""Checks of a curve: sense, equilibria, stiffness, jumps, energy, range of motion and symmetry.

Angles are counted in the sense of each joint's declared axis, in which a motion has the same name
on both sides. Mirror images are then the same function.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import ceil, degrees, floor, pi, radians

import numpy as np

from springs.axis import AxisSpring
from springs.backends import FLOATS, Array
from springs.damping import Damping
from springs.elastic import (
    Elastic,
    HasValidRange,
    describe_extrapolation,
    total_energy,
    total_friction,
    total_torque,
    valid_range,
)
from springs.hysteresis import Hysteresis
from springs.joint import JointSprings
from springs.lint.finding import Finding, FindingKind, doubts_first
from springs.published.range_of_motion import RangeEnd
from springs.transformed import Transformed

_SAMPLE_SPACING = radians(0.1)
_RELATIVE_ROUNDING = 1e-9


@dataclass(frozen=True)
class SignInterval:
    """An interval of angles [rad] in which the torque has one sign: -1, 0 or +1."""

    sign: int
    start: float
    end: float


@dataclass(frozen=True)
class SampledCurve:
    """The sum of an axis's elastic laws, sampled over a range [rad] and at its breakpoints."""

    laws: tuple[Elastic, ...]
    low: float
    high: float

    @cached_property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of the laws within the range [rad], in order."""
        found = {breakpoint for law in self.laws for breakpoint in law.breakpoints}
        return tuple(sorted(c for c in found if self.low < c < self.high))

    @cached_property
    def angles(self) -> Array:
        """Sampled angles [rad]."""
        count = int((self.high - self.low) / _SAMPLE_SPACING) + 2
        return np.unique([*np.linspace(self.low, self.high, count), *self.breakpoints])

    @cached_property
    def torques(self) -> Array:
        """Torque on the child at the angles [N m]."""
        return np.asarray(total_torque(self.laws, self.angles))

    @property
    def max_torque(self) -> float:
        """Largest absolute torque in the range [N m]."""
        return float(np.abs(self.torques).max())

    @property
    def rounding_torque(self) -> float:
        """Torque that is nothing but rounding [N m]."""
        return _RELATIVE_ROUNDING * self.max_torque

    def torque_at(self, angle: float) -> float:
        """Torque on the child at one angle [N m]."""
        return float(total_torque(self.laws, angle, FLOATS))

    @cached_property
    def sign_intervals(self) -> tuple[SignInterval, ...]:
        """Intervals of one sign, in order, divided at the zeros of the torque."""
        from scipy.optimize import brentq

        signs = np.sign(np.where(np.abs(self.torques) > self.rounding_torque, self.torques, 0.0))
        cuts = np.flatnonzero(np.diff(signs)).tolist()
        edges = [(self.low, self.low)]
        for cut in cuts:
            before, after = float(self.angles[cut]), float(self.angles[cut + 1])
            if signs[cut] and signs[cut + 1]:
                before = after = float(brentq(self.torque_at, before, after))
            elif signs[cut]:
                before = after
            else:
                after = before
            edges.append((before, after))
        edges.append((self.high, self.high))
        firsts = [0, *(cut + 1 for cut in cuts)]
        return tuple(
            SignInterval(int(signs[first]), start[1], end[0])
            for first, (start, end) in zip(firsts, pairwise(edges), strict=True)
        )

    def max_torque_within(self, interval: SignInterval) -> float:
        """Largest absolute torque in an interval [N m]."""
        inside = (self.angles >= interval.start) & (self.angles <= interval.end)
        return float(np.abs(self.torques[inside]).max(initial=0.0))


_HYSTERESIS_TOLERANCE = 1e-6
"""Rounding in the order of two curves [N m]."""


def lint_valid_range(curve: SampledCurve) -> Iterator[Finding]:
    """Report extrapolation, for laws that know their valid range."""
    ends = curve.low, curve.high
    for law in curve.laws:
        message = describe_extrapolation(valid_range(law), *ends) if _has_valid_range(law) else ""
        if message:
            torques = curve.torque_at(curve.low), curve.torque_at(curve.high)
            places = " and ".join(
                f"{torque + 0.0:.4g} N m at {_format_degrees(end)}"
                for end, torque in zip(ends, torques, strict=True)
            )
            yield Finding(FindingKind.VALID_RANGE, False, f"{message}; {places}", ends, torques)


def lint_hysteresis(curve: SampledCurve) -> Iterator[Finding]:
    """Report the energy lost in a slow cycle, and angles at which a cycle would gain energy."""
    for law in curve.laws:
        if not isinstance(law, Hysteresis):
            continue
        lost, ends = law.cycle_loss(curve.low, curve.high), (curve.low, curve.high)
        over = f"{_format_degrees(curve.low, '')} .. {_format_degrees(curve.high)}"
        message = f"a slow cycle over {over} loses {lost:.4g} J to the hysteresis"
        yield Finding(FindingKind.HYSTERESIS, False, message, ends, (lost,))
        up, down = (
            np.asarray(one.torque(curve.angles)) for one in (law.increasing, law.decreasing)
        )
        excess = up - down
        worst = int(excess.argmax())
        if excess[worst] > _HYSTERESIS_TOLERANCE * max(1.0, curve.max_torque):
            angle, amount = float(curve.angles[worst]), float(excess[worst])
            message = (
                f"at {_format_degrees(angle)} the curve of the growing angle lies "
                f"{amount:.3g} N m above that of the falling one: a cycle there feeds energy"
            )
            yield Finding(FindingKind.HYSTERESIS, True, message, (angle,), (amount,))


def _has_valid_range(law: Elastic) -> bool:
    """Return whether a law, below its transformations, has a valid range."""
    while isinstance(law, Transformed | Hysteresis):
        law = law.law if isinstance(law, Transformed) else law.increasing
    return isinstance(law, HasValidRange)


DEFAULT_RANGE_END = radians(90.0)
"""End of the checked range where no normal range is known [rad]."""

RANGE_MARGIN = radians(10.0)
"""Distance beyond the normal range over which a curve is checked [rad]."""

FIRM_TORQUE = 10.0
"""A torque that stops an examiner's hand [N m]: twice what cadaver hips hold at their ends."""

_MARK_SPACING = radians(30.0)
_DIFFERENCE_STEP = 1e-5
_RELATIVE_TOLERANCE = 1e-6


def lint_curve(
    spring: AxisSpring, low: RangeEnd | None = None, high: RangeEnd | None = None
) -> tuple[Finding, ...]:
    """Check the elastic laws and the damping about one axis.

    Args:
        spring: spring with one elastic law at least.
        low: lower end of the normal range of motion, where one is known.
        high: upper end likewise.
    """
    first, last = lint_range(low, high)
    curve = SampledCurve(spring.elastic, first, last)
    found = [
        *_lint_sense(curve),
        *_lint_equilibria(curve),
        *_lint_stiffness(curve),
        *_lint_jumps(curve),
        *_lint_energy(curve, spring.damping),
        *lint_hysteresis(curve),
        *lint_valid_range(curve),
        *(_lint_range_end(curve, low, -1.0) if low is not None else ()),
        *(_lint_range_end(curve, high, 1.0) if high is not None else ()),
    ]
    return doubts_first(found)


def lint_range(low: RangeEnd | None, high: RangeEnd | None) -> tuple[float, float]:
    """Range over which a curve is checked [rad]."""
    first = -DEFAULT_RANGE_END if low is None else low.angle - RANGE_MARGIN
    return first, DEFAULT_RANGE_END if high is None else high.angle + RANGE_MARGIN


def _lint_sense(curve: SampledCurve) -> Iterator[Finding]:
    """Check that the torque restores towards one rest from both sides."""
    runs, last = curve.sign_intervals, curve.sign_intervals[-1]
    acting = [run for run in runs if run.sign]
    fine = True
    for one, other in pairwise(acting):
        if one.sign < 0 < other.sign:
            fine = False
            push = max(curve.max_torque_within(one), curve.max_torque_within(other))
            yield Finding(
                FindingKind.SENSE,
                True,
                f"the torque drives away from {_format_gap(one, other)}, with up to {push:.3g} N m",
                (one.end, other.start),
                (push,),
            )
    for run, side, outwards in ((runs[0], "lower", -1), (last, "upper", 1)):
        if run.sign == outwards:
            fine = False
            angle, push = (run.start if outwards < 0 else run.end), curve.max_torque_within(run)
            yield Finding(
                FindingKind.SENSE,
                True,
                f"at the {side} end, {_format_degrees(angle)}, the torque drives the joint on, "
                f"with up to {push:.3g} N m",
                (angle,),
                (push,),
            )
    if fine:
        over = f"over {_format_degrees(curve.low, '')} .. {_format_degrees(curve.high)}"
        message = (
            f"the torque never drives the joint away {over}"
            if acting
            else f"there is no torque {over}"
        )
        yield Finding(FindingKind.SENSE, False, message)


def _format_gap(one: SignInterval, other: SignInterval) -> str:
    if one.end == other.start:
        return _format_degrees(one.end)
    return f"{_format_degrees(one.end, '')} .. {_format_degrees(other.start)}"


def _lint_equilibria(curve: SampledCurve) -> Iterator[Finding]:
    for run in curve.sign_intervals:
        if run.sign == 0 and run.end > run.start:
            start, end = _format_degrees(run.start), _format_degrees(run.end)
            where = (
                f"at {end}"
                if start == end
                else f"between {_format_degrees(run.start, '')} and {end}"
            )
            message = f"there is no torque {where}"
            yield Finding(FindingKind.EQUILIBRIUM, False, message, (run.start, run.end))
    acting = [run for run in curve.sign_intervals if run.sign]
    for one, other in pairwise(acting):
        if one.sign != other.sign and one.end == other.start:
            stable = one.sign > 0
            kind = "a stable" if stable else "an unstable"
            message = f"{kind} equilibrium at {_format_degrees(one.end)}"
            yield Finding(FindingKind.EQUILIBRIUM, not stable, message, (one.end,))


def _lint_stiffness(curve: SampledCurve) -> Iterator[Finding]:
    angles, torques = curve.angles, curve.torques
    slopes = np.diff(torques) / np.diff(angles)
    stiffest = int(np.argmin(slopes))
    angle, stiffness = float(angles[stiffest]), -float(slopes[stiffest])
    if stiffness > 0.0:
        message = f"the stiffness is at most {stiffness:.4g} N m/rad, at {_format_degrees(angle)}"
        yield Finding(FindingKind.SLOPE, False, message, (angle,), (stiffness,))
    growing = np.diff(torques) > curve.rounding_torque
    edges = np.flatnonzero(np.diff([False, *growing.tolist(), False])).reshape(-1, 2)
    for first, last in edges.tolist():
        start, end = float(angles[first]), float(angles[last])
        rise = float(torques[last] - torques[first])
        yield Finding(
            FindingKind.SLOPE,
            True,
            f"between {_format_degrees(start, '')} and {_format_degrees(end)} "
            f"the torque grows with the angle, by {rise:.3g} N m: a negative stiffness",
            (start, end),
            (rise,),
        )


def _lint_jumps(curve: SampledCurve) -> Iterator[Finding]:
    """Report jumps of torque and slope at breakpoints, from two points on each side."""
    for breakpoint in curve.breakpoints:
        (a, b), (c, d) = (
            (
                curve.torque_at(breakpoint + side * _DIFFERENCE_STEP),
                curve.torque_at(breakpoint + side * 2.0 * _DIFFERENCE_STEP),
            )
            for side in (-1.0, 1.0)
        )
        jump, kink = (
            (2.0 * c - d) - (2.0 * a - b),
            (d - c) / _DIFFERENCE_STEP - (a - b) / _DIFFERENCE_STEP,
        )
        if abs(jump) > _RELATIVE_TOLERANCE * max(1.0, curve.max_torque):
            message = f"at {_format_degrees(breakpoint)} the torque jumps by {jump:.3g} N m"
            yield Finding(FindingKind.JUMP, True, message, (breakpoint,), (jump,))
        elif abs(kink) > 1.0:
            message = (
                f"at {_format_degrees(breakpoint)} the stiffness jumps by {abs(kink):.4g} N m/rad"
            )
            yield Finding(FindingKind.JUMP, False, message, (breakpoint,), (-kink,))


def _lint_energy(curve: SampledCurve, damping: Damping) -> Iterator[Finding]:
    """Report the energy that a cycle over the range stores and loses.

    The work of the torque is compared with the energy: Gauss's rule of three points between
    neighbouring samples is exact for cubics. Damping of a cosine of amplitude A and rate w takes
    pi viscous w A^2 + 4 coulomb A.
    """
    nodes, weights = np.polynomial.legendre.leggauss(3)
    half = 0.5 * np.diff(curve.angles)
    places = (curve.angles[:-1] + half)[:, None] + half[:, None] * nodes
    work = float(np.sum(np.asarray(total_torque(curve.laws, places)) @ weights * half))
    ends = curve.low, curve.high
    places = np.array([*ends, *curve.angles, *(run.end for run in curve.sign_intervals)])
    energies = np.asarray(total_energy(curve.laws, places))
    gap = work + float(energies[1] - energies[0])
    stored = float(energies.max() - energies.min())
    if abs(gap) > _RELATIVE_TOLERANCE * max(stored, 1.0):
        message = (
            f"torque and energy disagree by {gap:.3g} J over the range: it is not an elastic law"
        )
        yield Finding(FindingKind.ENERGY, True, message, ends, (gap,))
    amplitude = 0.5 * (curve.high - curve.low)
    lost = 2.0 * pi**2 * damping.viscous * amplitude**2 + 4.0 * damping.coulomb * amplitude
    over = f"a cycle over {_format_degrees(curve.low, '')} .. {_format_degrees(curve.high)} in 1 s"
    message = f"{over} stores and returns up to {stored:.4g} J and loses {lost:.3g} J"
    yield Finding(FindingKind.ENERGY, False, message, ends, (stored, lost))


def _lint_range_end(curve: SampledCurve, end: RangeEnd, side: float) -> Iterator[Finding]:
    """Check the curve up to the upper (side 1) or lower (side -1) end of the normal range."""
    torque, where = (
        curve.torque_at(end.angle),
        f"{end.motion} normally ends at {_format_degrees(end.angle)}",
    )
    message = f"{where} ({end.source}): {torque + 0.0:.4g} N m there"
    yield Finding(FindingKind.RANGE_END, False, message, (end.angle,), (torque,))
    if -side * torque <= FIRM_TORQUE:
        return
    edge = _free_range_end(curve.sign_intervals, side)
    if edge is not None and side * edge < side * end.angle:
        message = f"free motion ends at {_format_degrees(edge)}, but {where}"
        yield Finding(FindingKind.FREE_MOTION, True, message, (edge, end.angle))
    firm = _firm_resistance_angle(curve, end.angle, side)
    places = [*_round_angles_between(firm, end.angle), end.angle]
    torques = [curve.torque_at(place) for place in places]
    pairs = zip(places, torques, strict=True)
    listed = ", ".join(
        f"{abs(torque):.4g} N m at {_format_degrees(place)}" for place, torque in pairs
    )
    where = f"with {FIRM_TORQUE:g} N m from {_format_degrees(firm)} on"
    if firm == (curve.low if side > 0.0 else curve.high):
        where = f"with more than {FIRM_TORQUE:g} N m at all angles from {_format_degrees(firm)} on"
    message = f"it resists {where}: {listed}, the normal end"
    yield Finding(
        FindingKind.EARLY_RESISTANCE, True, message, (firm, *places), (FIRM_TORQUE, *torques)
    )


def _free_range_end(runs: Sequence[SignInterval], side: float) -> float | None:
    """The end of the outermost stretch without torque on one side [rad], None without any."""
    edges = [r.end if side > 0.0 else r.start for r in runs if r.sign == 0 and r.end > r.start]
    return max(edges, key=lambda edge: side * edge, default=None)


def _firm_resistance_angle(curve: SampledCurve, end: float, side: float) -> float:
    """Start of the last interval of firm resistance before an end [rad]."""
    before = side * curve.angles < side * end
    soft = curve.angles[before & (-side * curve.torques < FIRM_TORQUE)]
    return side * float((side * soft).max(initial=side * (curve.low if side > 0 else curve.high)))


def _round_angles_between(start: float, end: float) -> list[float]:
    """Round angles after `start` and before `end` [rad]."""
    low, high = sorted((start, end))
    counts = range(floor(low / _MARK_SPACING), ceil(high / _MARK_SPACING))
    found = [count * _MARK_SPACING for count in counts if low < count * _MARK_SPACING < high]
    return found if end > start else found[::-1]


def _format_degrees(angle: float, unit: str = " deg") -> str:
    return f"{round(degrees(angle), 1) + 0.0:.1f}{unit}"


_COMPARED_ANGLES = np.radians(np.linspace(-180.0, 180.0, 721))
_SYMMETRY_TOLERANCE = 1e-9
_SIDES = {"left": "right", "right": "left"}
_PARALLEL_ANGLE = radians(0.01)


def other_side(joint: str) -> str | None:
    """The name of the same joint on the other side; None for a name without a side."""
    words = joint.split("_")
    if not set(words) & set(_SIDES):
        return None
    return "_".join(_SIDES.get(word, word) for word in words)


MirrorRotations = Mapping[str, tuple[str, Array]]
"""The joint on the other side of each joint that has one, and the matrix from an axis of the joint
to the axis of the mirror image of a rotation about it, each in its joint's axes."""


def lint_symmetry(
    joint: str,
    spring: AxisSpring,
    joints: Mapping[str, JointSprings],
    mirrors: MirrorRotations | None = None,
) -> tuple[Finding, ...]:
    """Compare the spring of a joint with that of the joint on the other side.

    Args:
        joint: name of the joint.
        spring: spring about one of its axes.
        joints: all springs.
        mirrors: mirrors of the figure; None where it is not known: names then tell the other side,
            and positive angles are mirror images.
    """
    if mirrors is None:
        name, image = other_side(joint), None
    else:
        name, rotation = mirrors.get(joint, (None, np.eye(3)))
        image = rotation @ np.asarray(spring.direction)
    if name is None:
        return ()
    others = joints[name].axes if name in joints else ()
    direction = spring.direction if image is None else (image[0], image[1], image[2])
    other = next((one for one in others if is_same_axis(one, direction)), None)
    if other is not None and image is not None and float(image @ other.direction) < 0.0:
        other = other.with_opposite_axis()
    if other is None:
        return (Finding(FindingKind.SYMMETRY, True, f"`{name}` has no spring about this axis"),)
    mine, its = (np.asarray(total_torque(one.elastic, _COMPARED_ANGLES)) for one in (spring, other))
    differences = np.abs(mine - its)
    worst = int(differences.argmax())
    angle, difference = float(_COMPARED_ANGLES[worst]), float(differences[worst])
    if difference > _SYMMETRY_TOLERANCE * (1.0 + abs(float(mine[worst]))):
        message = f"`{name}` differs by up to {difference:.3g} N m, at {_format_degrees(angle)}"
        return (Finding(FindingKind.SYMMETRY, True, message, (angle,), (difference,)),)
    frictions = (total_friction(one.elastic, _COMPARED_ANGLES, 1.0) for one in (spring, other))
    mine, its = (np.asarray(0.0 if one is None else one) for one in frictions)
    if float(np.abs(mine - its).max()) > _SYMMETRY_TOLERANCE * (1.0 + float(np.abs(mine).max())):
        message = f"`{name}` has another hysteresis"
        return (Finding(FindingKind.SYMMETRY, True, message),)
    if spring.damping != other.damping:
        message = f"`{name}` has another damping"
        return (Finding(FindingKind.SYMMETRY, True, message),)
    return (Finding(FindingKind.SYMMETRY, False, "left and right are mirror images"),)


def is_same_axis(spring: AxisSpring, direction: tuple[float, float, float]) -> bool:
    """Return whether a spring is about the line of a direction in its joint's frame."""
    return float(np.linalg.norm(np.cross(spring.direction, direction))) < _PARALLEL_ANGLE
