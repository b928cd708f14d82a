"""Contact of a run with the props of its scene, and what follows from it; `docs/contact.md`.

The head injury criterion is that of Versace (1971, A review of the severity index, Proc. 15th Stapp
Car Crash Conf., SAE 710881) with the window of 49 CFR 571.208 (FMVSS 208), S6.2(b).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.contact_file.parts import Evidence
from generator.diagnostics import NamedMapping
from generator.figure import Vector
from generator.rotations import Array, unit_vector
from springs.short_repr import short_repr

STANDARD_ACCELERATION = 9.80665
"""Unit of the accelerations in the head injury criterion [m/s^2]."""

HEAD_INJURY_WINDOW = 0.015
"""Longest interval of the head injury criterion [s]."""

WINDOW_ROUNDING = 1e-9
"""Relative rounding of an interval as long as the window."""

HEAD_CAVEAT = "one of many, no prognosis of injury"
"""Clause that every report of a head contains."""

INJURY_CAVEAT = "twice the stiffness: some 1.6 times the HIC"
"""Clause that every report of the head injury criterion contains beside it.

A mass m that meets a spring k at v has v sqrt(k/m) at most, for a time that is proportional to
sqrt(m/k), so that HIC grows as k^(3/4): 1.68 for twice k. 13 falls of a man with parts have 1.2 to
1.7, with a median of 1.6.
"""

MIN_VERTICAL_FORCE = 1.0
"""Vertical force below which the centre of pressure is undefined [N]."""

MAX_STEP_RATIO = 3.0
"""Ratio of two steps up to which a parabola through their ends gives a peak."""

CHAOTIC_ANGLE = 0.1
"""Difference of the joint angles from those of a start 0.001 rad apart, from which poses are
chaotic [rad]."""

IMPACT_SPEED = 0.5
"""Normal speed from which a first touch is an impact [m/s]."""

START_ROUNDING = 1e-12
"""Distance at the start up to which a sphere touches, for the rounding of its position [m]."""

REST_DURATION = 0.2
"""Duration of the mean values at the end of a run [s]."""


@short_repr
@dataclass(frozen=True)
class SegmentContact:
    """Contact of a segment over all steps of a run, not its frames only.

    Attributes:
        first_time: first touch [s]; None if it never touched.
        impact_speed: normal speed of the sphere that touched first, at that moment [m/s].
        peak_force: largest size of the force on the segment [N].
        peak_time: its time [s]; the start of the run without a force.
        impulse: integral of the force on the segment, world axes [N s].
    """

    first_time: float | None
    impact_speed: float
    peak_force: float
    peak_time: float
    impulse: Vector


@short_repr
@dataclass(frozen=True)
class PartContact:
    """Contact of a part of the body over all steps of a run; it may span segments.

    Attributes:
        first_time: Time of the first touch [s]; None if it never touched.
        impact_speed: Normal speed of the sphere that touched first, at that moment [m/s].
        peak_force: Largest size of the force on the part [N].
        peak_time: Time of this force [s]; the start of the run without a force.
        body_weights: Largest force over the weight of the figure; None without gravity.
        band: Lowest and highest likely stiffness of the part over that of the run.
        evidence: Evidence for its stiffness.
        within: Name of the part of which it is a firmer region; "" for a part of its own.
    """

    first_time: float | None
    impact_speed: float
    peak_force: float
    peak_time: float
    body_weights: float | None
    band: tuple[float, float]
    evidence: Evidence
    within: str = ""

    @property
    def force_band(self) -> tuple[float, float]:
        """Peak forces at the ends of the band [N].

        They are those of a mass that hits a linear spring, with the root of the stiffness.
        """
        low, high = self.band
        return self.peak_force * low**0.5, self.peak_force * high**0.5


@short_repr
@dataclass(frozen=True)
class HeadImpact:
    """Impact of a segment that is a head, over all steps of a run.

    Attributes:
        peak_acceleration: Largest acceleration of its centre of mass, in free fall one [g].
        peak_time: Time of this acceleration [s].
        head_weights: Largest force of props on it over its own weight under standard gravity.
    """

    peak_acceleration: float
    peak_time: float
    head_weights: float


class Overlap(NamedTuple):
    """Interpenetration of two segments that no joint connects.

    Attributes:
        depth: [m].
        segment: one segment.
        other: the other.
        time: [s].
    """

    depth: float
    segment: str
    other: str
    time: float


class PressedLayer(NamedTuple):
    """Layer that a part of the body pressed through.

    Attributes:
        layer: Name of the prop with the layer, or "cover of PART".
        part: Name of the part.
        time: When it first was [s].
    """

    layer: str
    part: str
    time: float


@short_repr
@dataclass(frozen=True, eq=False)
class ContactRecord:
    """Contact of a run of n frames; forces in world axes.

    `forces`, `depths` and `segments` have the names of all segments with contact spheres, `parts`
    those of the parts of the body, and none without parts. `part_forces` add up to `forces`. A
    record of steps alone has no names and no rows in what is known by frame.

    Attributes:
        forces: forces on each segment, shape (n, 3) [N].
        ground_reaction: total force and its moment about the world's origin, shape (n, 6)
            [N, N m].
        depths: deepest penetration of each segment, zero where it touches nothing, shape (n,) [m].
        segments: contact of each segment over all steps.
        max_force: largest total force over all steps [N].
        max_force_time: its time [s].
        max_depth: deepest penetration over all steps [m].
        max_depth_segment: its segment.
        max_depth_part: Part of the segment that the sphere belongs to, by default the segment.
        weight_carried: mean vertical force of the last 0.2 s over the weight; None without gravity.
        creep: horizontal displacement of the centre of mass in the last 0.2 s, over this time
            [m/s].
        dissipated: energy lost in contact damping and friction [J].
        sensitivity: largest difference of the joint angles, of each frame, from a run whose start
            differs by 0.001 rad, shape (n,) [rad]; None if it was not computed.
        height_sensitivity: difference of the height of the centre of mass from that run, shape (n,)
            [m]; None likewise.
        impact_shift: difference of the time of the first impact from that run [s]; None likewise,
            and without an impact in both.
        overlap: deepest interpenetration of segments that no joint connects; None without any.
        head_injury: head injury criterion of each head of a body with parts; see `INJURY_CAVEAT`.
        extreme_forces: extreme forces of the total force along each axis, over all steps, the time
            [s] and size [N] of the largest and of the smallest, shape (3, 4); None in files of
            older versions.
        parts: Contact of each part of the body over all steps.
        heads: Impact of each segment that is a head.
        pressed_layers: Layers of props and covers that parts of the body pressed through; none in
            files.
        part_forces: Force on each part of the body, and on each segment for its spheres without a
            part, shape (n, 3) [N]; none in files of older versions.
        force_points: Point of each of these forces, zero without a force, shape (n, 3) [m].
    """

    forces: Mapping[str, Array]
    ground_reaction: Array
    depths: Mapping[str, Array]
    segments: Mapping[str, SegmentContact]
    max_force: float
    max_force_time: float
    max_depth: float
    max_depth_segment: str
    weight_carried: float | None
    creep: float
    dissipated: float
    sensitivity: Array | None = None
    height_sensitivity: Array | None = None
    impact_shift: float | None = None
    overlap: Overlap | None = None
    head_injury: Mapping[str, float] = field(default_factory=dict[str, float])
    extreme_forces: Array | None = None
    max_depth_part: str = ""
    parts: Mapping[str, PartContact] = field(default_factory=dict[str, PartContact])
    heads: Mapping[str, HeadImpact] = field(default_factory=dict[str, HeadImpact])
    pressed_layers: tuple[PressedLayer, ...] = ()
    part_forces: Mapping[str, Array] = field(default_factory=dict[str, Array])
    force_points: Mapping[str, Array] = field(default_factory=dict[str, Array])

    def chaotic_from(self, times: Array) -> float | None:
        """Return the time from which poses are chaotic [s]; None if they are not, or unknown.

        Then starts that differ by 0.001 rad differ by more than `CHAOTIC_ANGLE`, so that times,
        heights, energies and forces are to be read, not poses.

        Args:
            times: times of the frames, shape (n,) [s].
        """
        if self.sensitivity is None:
            return None
        chaotic = np.flatnonzero(self.sensitivity > CHAOTIC_ANGLE)
        return float(times[chaotic[0]]) if chaotic.size else None

    def __post_init__(self) -> None:
        """Refuse other names; give the mappings errors that state the nearest name."""
        by_frame = self.forces.keys() == self.depths.keys()
        if not by_frame or (self.forces and self.forces.keys() != self.segments.keys()):
            raise ValueError("forces, depths and segments of a contact record differ in names")
        if not self.max_depth_part:
            object.__setattr__(self, "max_depth_part", self.max_depth_segment)
        if self.part_forces.keys() != self.force_points.keys():
            raise ValueError("part forces and force points of a contact record differ in names")
        for name in ("forces", "depths", "segments", "parts", "part_forces", "force_points"):
            is_of_parts = name not in ("forces", "depths", "segments")
            subject = f"the record has no contact of {'part' if is_of_parts else 'segment'}"
            object.__setattr__(self, name, NamedMapping(getattr(self, name), subject))


def first_impact(segments: Mapping[str, SegmentContact]) -> float | None:
    """Return the first touch of a segment with more than `IMPACT_SPEED` [s]; None without any."""
    times = [
        one.first_time
        for one in segments.values()
        if one.first_time is not None and one.impact_speed > IMPACT_SPEED
    ]
    return min(times, default=None)


def summarize_steps(
    segments: Sequence[str],
    owners: Sequence[int] | NDArray[np.intp],
    times: Array,
    forces: Array,
    depths: Array,
    speeds: Array,
    impulses: Array,
    touches: "Touches | None" = None,
) -> dict[str, SegmentContact]:
    """Return the contact of B segments with S spheres over n steps.

    A sphere touches from the depth zero on; the moment is interpolated linearly between the steps,
    and so is the speed. A segment that touches at the first step, to within `START_ROUNDING`,
    touches first at its time.

    Args:
        segments: names of the segments.
        owners: index of the segment of each sphere, shape (S,).
        times: times of the steps, shape (n,) [s].
        forces: forces on each segment, world axes, shape (n, B, 3) [N].
        depths: depths of each sphere, negative outside, shape (n, S) [m].
        speeds: rate of each depth, shape (n, S) [m/s].
        impulses: impulses on each segment over the run, world axes, shape (B, 3) [N s].
        touches: result of `first_touches`, where it is known.
    """
    touch_times, touch_speeds, touch_depths = touches or first_touches(times, depths, speeds)
    x, y, z = np.moveaxis(forces, -1, 0)
    sizes = np.sqrt(x * x + y * y + z * z)  # as `np.linalg.norm`, and faster
    contacts: dict[str, SegmentContact] = {}
    for index, name in enumerate(segments):
        spheres = np.flatnonzero(np.equal(owners, index))
        order = np.lexsort((-touch_depths[spheres], touch_times[spheres]))
        first = spheres[order[0]] if spheres.size else None
        has_touched = first is not None and bool(np.isfinite(touch_times[first]))
        impulse_x, impulse_y, impulse_z = impulses[index].tolist()
        peak_time, peak_force = peak_of(times, sizes[:, index])
        contacts[name] = SegmentContact(
            first_time=float(touch_times[first]) if has_touched else None,
            impact_speed=max(float(touch_speeds[first]), 0.0) if has_touched else 0.0,
            peak_force=peak_force,
            peak_time=peak_time,
            impulse=(impulse_x, impulse_y, impulse_z),
        )
    return contacts


Touches: TypeAlias = tuple[Array, Array, Array]
"""Time (infinite without), speed and depth at the next step of each sphere's first touch."""


def first_touches(times: Array, depths: Array, speeds: Array) -> Touches:
    """Return the first touches of S spheres; the arguments are those of `summarize_steps`."""
    count = int(depths.shape[1])
    spheres = np.arange(count)
    touches = depths >= 0.0
    touches[0] |= depths[0] >= -START_ROUNDING
    after = np.argmax(touches, axis=0)
    before = np.maximum(after - 1, 0)
    rise = depths[after, spheres] - depths[before, spheres]
    share = np.divide(-depths[before, spheres], rise, out=np.zeros(count), where=after > 0)
    moments = times[before] + share * (times[after] - times[before])
    speed_before = speeds[before, spheres]
    touch_speeds = speed_before + share * (speeds[after, spheres] - speed_before)
    return (
        np.where(touches.any(axis=0), moments, np.inf),
        touch_speeds,
        depths[after, spheres],
    )


def peak_of(times: Array, values: Array) -> tuple[float, float]:
    """Return the time [s] and size of the peak of n values.

    It is that of a parabola through the largest value and its neighbours, or the largest value
    where the steps before and after it are of very different lengths.
    """
    k = int(np.argmax(values))
    time, value = float(times[k]), float(values[k])
    if not 0 < k < len(values) - 1:
        return time, value
    before, after = float(times[k] - times[k - 1]), float(times[k + 1] - times[k])
    if not 1.0 / MAX_STEP_RATIO < before / max(after, 1e-300) < MAX_STEP_RATIO:
        return time, value
    rise = (value - float(values[k - 1])) / before
    fall = (float(values[k + 1]) - value) / after
    bend = (fall - rise) / (before + after)
    if not bend < 0.0:
        return time, value
    slope = rise + bend * before
    return time - 0.5 * slope / bend, value - 0.25 * slope * slope / bend


def extremes_of(times: Array, values: Array) -> tuple[float, float, float, float]:
    """Return time [s] and size of the largest and of the smallest of n values; see `peak_of`."""
    time, size = peak_of(times, -values)
    return *peak_of(times, values), time, -size


def mean_at_end(times: Array, values: Array, duration: float = REST_DURATION) -> float:
    """Mean over the last `duration` [s] of values at unequal times, both of shape (n,).

    It is the mean of a shorter run as a whole, and the value of a single time.
    """
    start = max(times[-1] - duration, times[0])
    if not start < times[-1]:
        return float(values[-1])
    late = times > start
    points = np.append(start, times[late])
    found = np.append(np.interp([start], times, values), values[late])
    return float(_running_integral(points, found)[-1] / (times[-1] - start))


def _running_integral(times: Array, values: Array) -> Array:
    """Integral from the first time by the trapezoidal rule, shape (n,)."""
    steps = 0.5 * np.diff(times) * (values[1:] + values[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def centre_of_pressure(
    ground_reaction: Array,
    up: ArrayLike = (0.0, 1.0, 0.0),
    height: float = 0.0,
    min_force: float = MIN_VERTICAL_FORCE,
) -> tuple[Array, Array]:
    """Return the centre of pressure, shape (n, 3) [m], and the free moment, shape (n,) [N m].

    The force in this point of the plane at `height` and the moment about `up` are together
    equivalent to the ground reaction. Both are NaN where the vertical force is below `min_force`.

    Args:
        ground_reaction: force and its moment about the world's origin, shape (n, 6) [N, N m].
        up: normal of the plane.
        height: height of the plane along `up`, from the world's origin [m].
        min_force: smallest vertical force [N].
    """
    normal = unit_vector(up)
    forces, moments = ground_reaction[:, :3], ground_reaction[:, 3:]
    vertical = forces @ normal
    divisor = np.where(vertical >= min_force, vertical, np.nan)
    points = (np.cross(normal, moments) + height * forces) / divisor[:, None]
    return points, (moments - np.cross(points, forces)) @ normal


def head_segments(moving_segments: Iterable[str]) -> tuple[str, ...]:
    """Return the segments that are a head: those whose names contain "head"."""
    return tuple(name for name in moving_segments if "head" in name.lower())


def head_injury_criterion(
    times: Array, accelerations: Array, window: float = HEAD_INJURY_WINDOW
) -> float:
    """Return the head injury criterion of the acceleration of a head's centre of mass.

    It is the largest value, for t2 - t1 up to `window`, of (mean of the acceleration from t1 to t2,
    in multiples of g)^2.5 (t2 - t1). The size of the acceleration is linear between the steps; t1
    and t2 are steps, or one is a step and the other a window from it. Report it with
    `HEAD_CAVEAT` and `INJURY_CAVEAT`.

    Args:
        times: shape (n,), not decreasing; a jump has two rows at its time [s].
        accelerations: shape (n, 3) [m/s^2].
        window: longest interval [s].

    Returns:
        The criterion; NaN where an acceleration is not finite.

    Raises:
        ValueError: a time is not finite, or times decrease.
    """
    if not np.all(np.isfinite(times)) or np.any(np.diff(times) < 0.0):
        raise ValueError("times must be finite and must not decrease")
    if not np.all(np.isfinite(accelerations)):
        return nan
    sizes = np.linalg.norm(accelerations, axis=1) / STANDARD_ACCELERATION
    gaps = np.diff(times)
    if not np.any(gaps > 0.0):
        return 0.0
    points = np.concatenate([times, times - window, times + window])
    points = np.unique(points[(points >= times[0]) & (points <= times[-1])])
    step = np.minimum(np.searchsorted(times, points, side="right") - 1, gaps.size - 1)
    slopes = np.divide(np.diff(sizes), gaps, out=np.zeros(gaps.size), where=gaps > 0.0)
    into = points - times[step]
    speeds = _running_integral(times, sizes)[step] + into * (
        sizes[step] + 0.5 * into * slopes[step]
    )
    return search_injury(points, speeds, window * (1.0 + WINDOW_ROUNDING)).value


class InjurySearch(NamedTuple):
    """Largest value of the head injury criterion, and how many pairs it took to find it.

    Attributes:
        value: (mean from one point to another)^2.5 times the time between them.
        examined: number of pairs of points or of blocks of points.
    """

    value: float
    examined: int


_BOUND_ROUNDING = 1e-9
"""Relative rounding of a bound of the criterion."""


def search_injury(points: Array, speeds: Array, longest: float) -> InjurySearch:
    """Return the largest of (V2 - V1)^2.5 / (t2 - t1)^1.5 of all pairs of n points.

    Pairs of blocks of points are halved, but for those whose bound is below the largest value so
    far: the number of pairs that are left is proportional to n, whatever the time between points.

    Args:
        points: times, increasing, shape (n,) [s].
        speeds: integral V of the size of the acceleration until then, shape (n,).
        longest: longest time between two points of a pair [s].
    """
    count = points.size
    pairs = np.arange(count - 1), np.arange(1, count)
    means = np.maximum(np.diff(speeds), 0.0) / np.diff(points)
    best = _largest_of_pairs(points, speeds, longest, *pairs)
    last = np.searchsorted(points, points[:-1] + longest, side="right") - 1
    best = max(best, _largest_of_pairs(points, speeds, longest, pairs[0], last))
    examined = 2 * (count - 1)
    size = 1 << max(count - 1, 1).bit_length()
    one = other = np.zeros(1, dtype=np.intp)
    while size > 1:
        size //= 2
        one = 2 * one[:, None] + np.array([0, 0, 1, 1])
        other = 2 * other[:, None] + np.array([0, 1, 0, 1])
        is_pair = (one <= other) & (other * size < count)
        one, other = one[is_pair], other[is_pair]
        examined += len(one)
        starts = np.arange(0, count, size)
        ends = np.minimum(starts + size, count) - 1
        shortest = points[starts[other]] - points[ends[one]]
        greatest = np.minimum(points[ends[other]] - points[starts[one]], longest)
        gains = np.maximum.reduceat(speeds, starts)[other]
        gains = np.maximum(gains - np.minimum.reduceat(speeds, starts)[one], 0.0)
        rates = np.maximum.reduceat(np.append(means, 0.0), starts)
        bound = np.full(len(one), np.inf)
        is_separate = one < other
        np.divide(gains**2.5, np.maximum(shortest, 0.0) ** 1.5, out=bound, where=is_separate)
        # The mean over an interval is at most the largest one of its parts.
        near = other <= one + 1
        rate = np.maximum(rates[one], rates[other])
        bound = np.where(near, np.minimum(bound, rate**2.5 * greatest), bound)
        best = max(best, _largest_of_pairs(points, speeds, longest, starts[one], ends[other]))
        is_possible = (bound * (1.0 + _BOUND_ROUNDING) > best) & (shortest <= longest)
        one, other = one[is_possible], other[is_possible]
    return InjurySearch(max(best, _largest_of_pairs(points, speeds, longest, one, other)), examined)


def _largest_of_pairs(
    points: Array,
    speeds: Array,
    longest: float,
    first: NDArray[np.intp],
    second: NDArray[np.intp],
) -> float:
    """Return the largest value of pairs of points, of which some may be too long or one point."""
    durations = points[second] - points[first]
    some = (durations > 0.0) & (durations <= longest)
    durations = durations[some]
    gains = np.maximum(speeds[second[some]] - speeds[first[some]], 0.0)
    return float(np.max((gains / durations) ** 2.5 * durations, initial=0.0))
