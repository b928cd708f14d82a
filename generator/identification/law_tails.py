"""Tails of an elastic law: ends of its range that a motion reached once, or that are extrapolated.

A shape that is wrong there is not contradicted by another swing: the fitted quantities follow it,
and the residuals stay as they are. So each estimate is stated with its change when the torque of a
tail is changed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from generator.rotations import Array
from generator.springs_file.axes import parallel_sign, rotation_axes
from generator.study.parameter_paths import Case
from springs import AxisSpring, total_torque
from springs.elastic import Range, common_valid_range
from springs.interpolated import Interpolated

TORQUE_CHANGE = 0.1
"""Relative change of the torque at the end of a tail. Models that Silder et al. (J. Biomech. 2007)
fitted to the knees of single subjects differ from these by 1.4 N m, which is 11 to 15 % of the
torque at the ends of a swing from 0 deg."""

_SHORTEST = 1e-3
"""Length below which a tail is left out [rad]."""

_POINTS = 25
"""Number of points of the changed torque."""


@dataclass(frozen=True)
class LawTail:
    """A tail of the elastic law of a joint of one rotation.

    Attributes:
        joint: name of the joint.
        inner: angle at which it begins [rad].
        end: smallest or largest angle of the motion [rad].
        known: range in which the law was measured [rad]; None where that is not known.
        changes: Changes of the estimates with `TORQUE_CHANGE`, in their units.
    """

    joint: str
    inner: float
    end: float
    known: Range | None = None
    changes: tuple[float, ...] = ()

    @property
    def is_extrapolated(self) -> bool:
        """Return whether the law was not measured as far as its end."""
        return self.known is not None and not self.known[0] <= self.end <= self.known[1]


def find_tails(
    case: Case, columns: Sequence[tuple[str, int]], angles: Array
) -> tuple[LawTail, ...]:
    """Find the tails of the laws of a motion.

    A tail goes from the end of the motion to where the motion reversed a second time on the same
    side, or where the law was measured if that is further in; to the other end of the motion if it
    did not come back.

    Args:
        case: figure and springs.
        columns: joint and number of its displacement, of k columns.
        angles: Angles of the motion, shape (n, k) [rad].
    """
    return tuple(
        tail
        for (joint, _), series in zip(columns, angles.T, strict=True)
        for tail in _tails_of_joint(case, joint, series)
    )


def change_tail(case: Case, tail: LawTail) -> Case:
    """Return the case with `TORQUE_CHANGE` at the end of a tail, which fades to its inner end."""
    found = _elastic_spring(case, tail.joint)
    if found is None:
        return case
    spring, sign = found
    share = np.linspace(0.0, 1.0, _POINTS)
    angles = sign * (tail.inner + share * (tail.end - tail.inner))
    fade = share**2 * (3.0 - 2.0 * share)
    torques = TORQUE_CHANGE * fade * np.asarray(total_torque(spring.laws_besides_stops, angles))
    # A point of no torque before the first one: there the curve continues without torque.
    points = [
        (2.0 * angles[0] - angles[1], 0.0),
        *zip(angles.tolist(), torques.tolist(), strict=True),
    ]
    law = Interpolated(tuple(sorted((float(angle), torque) for angle, torque in points)))
    changed = replace(spring, elastic=(*spring.elastic, law))
    springs = case.springs
    own = springs.joints[tail.joint]
    axes = tuple(changed if one is spring else one for one in own.axes)
    joints = {**springs.joints, tail.joint: replace(own, axes=axes)}
    return case.with_springs(replace(springs, joints=joints))


def _tails_of_joint(case: Case, joint: str, series: Array) -> Iterator[LawTail]:
    found = _elastic_spring(case, joint)
    if found is None:
        return
    spring, sign = found
    known = common_valid_range(spring.elastic)
    if known is not None and sign < 0:
        known = (-known[1], -known[0])
    for side in (-1.0, 1.0):
        peaks = _peaks(side * series)
        end = peaks[0]
        inner = peaks[1] if len(peaks) > 1 else float(np.min(side * series))
        if known is not None:
            inner = min(inner, max(side * known[0], side * known[1]))
            inner = max(inner, float(np.min(side * series)))
        if end - inner > _SHORTEST:
            yield LawTail(joint, side * inner, side * end, known)


def _peaks(series: Array) -> list[float]:
    """Largest values of a motion between its reversals, from the largest on; ends count as well."""
    levels = series[np.concatenate([[True], np.diff(series) != 0.0])]
    padded = np.concatenate([[-np.inf], levels, [-np.inf]])
    is_peak = (padded[1:-1] > padded[:-2]) & (padded[1:-1] > padded[2:])
    return sorted(levels[is_peak].tolist(), reverse=True)


def _elastic_spring(case: Case, joint: str) -> tuple[AxisSpring, int] | None:
    """Spring of a joint of one rotation, and the sign of its angle; None without an elastic law."""
    axes, own = rotation_axes(case.figure.joints[joint]), case.springs.joints.get(joint)
    if own is None or len(axes) != 1 or len(case.figure.joints[joint].chain) != 1:
        return None
    for spring in own.axes:
        sign = parallel_sign(spring.direction, axes[0])
        if sign and spring.laws_besides_stops:
            return spring, sign
    return None
