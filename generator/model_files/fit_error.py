"""The error of a law that another program holds approximately, over the range of the joint."""

from dataclasses import dataclass
from math import degrees, inf, radians

import numpy as np
from numpy.typing import ArrayLike

from generator.figure import AxisKind, Joint
from generator.springs_file.axes import parallel_sign, unit_axis
from springs import JointSprings
from springs.elastic import Range, common_valid_range
from springs.published.range_of_motion import normal_range

DEFAULT_ANGLE = radians(90.0)
"""End of a rotation's range that is neither limited nor published [rad]."""

DEFAULT_DISTANCE = 0.1
"""End of a translation's range that is not limited [m]."""


@dataclass(frozen=True)
class FitError:
    """The difference between an approximate torque and the law.

    Attributes:
        largest: its largest size [N m, or N along a translation].
        rms: its root mean square.
    """

    largest: float
    rms: float

    @classmethod
    def from_differences(cls, differences: ArrayLike) -> "FitError":
        """Return the error of samples over the range; of several components, their sizes."""
        sizes = np.abs(np.asarray(differences, dtype=float))
        return cls(float(sizes.max(initial=0.0)), float(np.sqrt(np.mean(sizes**2))))

    def __str__(self) -> str:
        """Both sizes with their unit ("0.81 N m at most, 0.2 N m rms")."""
        return f"{self.largest:.2g} N m at most, {self.rms:.2g} N m rms"


def joint_ranges(joint: Joint, springs: JointSprings) -> tuple[Range, ...]:
    """Return the range of each displacement of a joint, in which a fit has to be good [rad or m].

    An end is the joint's limit; else the end of the normal range of motion about this axis; else
    90 deg or 0.1 m, or farther if the law is known farther. The range holds the figure's own
    displacement.
    """
    return tuple(_displacement_range(joint, springs, k) for k in range(len(joint.chain)))


def _displacement_range(joint: Joint, springs: JointSprings, index: int) -> Range:
    factor = joint.chain[index]
    turns = factor.kind is AxisKind.ROTATION
    ends: list[list[float]] = [[], []]
    for spring in springs.axes if turns else springs.translations:
        sign = parallel_sign(spring.direction, unit_axis(factor.axis))
        if not sign:
            continue
        normal = [
            None if end is None else end.angle for end in normal_range(joint.name, spring.motion)
        ]
        known = [
            end if abs(end) < inf else None for end in common_valid_range(spring.elastic) or ()
        ]
        for found in (normal, known):
            for side, end in enumerate(found):
                if end is not None:
                    ends[side if sign > 0 else 1 - side].append(sign * end)
    default = DEFAULT_ANGLE if turns else DEFAULT_DISTANCE
    start = joint.displacement[index]
    low = min([*ends[0], start], default=0.0) if ends[0] else min(-default, start)
    high = max([*ends[1], start], default=0.0) if ends[1] else max(default, start)
    if joint.lower_limit is not None:
        low = min(joint.lower_limit[index], start)
    if joint.upper_limit is not None:
        high = max(joint.upper_limit[index], start)
    return low, high


def format_range(ends: Range, *, turns: bool = True) -> str:
    """Return a range as text: `-20 to 100 deg`, or `-5 to 5 cm` of a translation."""
    low, high = ((degrees(end) if turns else 100.0 * end) + 0.0 for end in ends)
    return f"{low:.3g} to {high:.3g} {'deg' if turns else 'cm'}"
