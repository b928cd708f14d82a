"""The error of a law that another program holds approximately, over the range of the joint."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import degrees, isinf, radians

import numpy as np
from numpy.typing import ArrayLike

from generator.figure import AxisKind, Joint
from generator.springs_file.axes import parallel_sign, unit_axis
from springs import AxisSpring, JointSprings
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
        return f"{_format_size(self.largest)} N m at most, {_format_size(self.rms)} N m rms"


def _format_size(size: float) -> str:
    """Return a size with two digits, or a whole number: never 1.2e+02."""
    return f"{size:.2g}" if size < 99.5 else f"{size:.0f}"


Ends = tuple[float | None, float | None]
"""Lower and upper end of a displacement [rad or m], None where it is not known."""


def joint_limits(joint: Joint, index: int) -> Ends:
    """Return the finite limits of a displacement of a joint."""
    limits = joint.lower_limit, joint.upper_limit
    low, high = (None if each is None or isinf(each[index]) else each[index] for each in limits)
    return low, high


def normal_ends(joint: Joint, springs: JointSprings, index: int) -> Ends:
    """Return the published normal range of motion of a displacement, in the sense of its axis.

    The motion of a spring about this axis selects it; translations have none.
    """
    for spring, sign in _springs_along(joint, springs, index):
        if joint.chain[index].kind is AxisKind.ROTATION and spring.motion:
            low, high = normal_range(joint.name, spring.motion)[::sign]
            return (
                None if low is None else sign * low.angle,
                None if high is None else sign * high.angle,
            )
    return None, None


def _springs_along(
    joint: Joint, springs: JointSprings, index: int
) -> Iterator[tuple[AxisSpring, int]]:
    """Yield the springs about or along an axis of a joint, with 1, or -1 for the opposite axis."""
    factor = joint.chain[index]
    turns = factor.kind is AxisKind.ROTATION
    for spring in springs.axes if turns else springs.translations:
        sign = parallel_sign(spring.direction, unit_axis(factor.axis))
        if sign:
            yield spring, sign


def joint_ranges(joint: Joint, springs: JointSprings) -> tuple[Range, ...]:
    """Return the range of each displacement of a joint, in which a fit has to be good [rad or m].

    An end is the joint's limit; else that of the normal range of motion or of the range in which
    the law is known, whichever is farther; else 90 deg or 0.1 m. The range holds the figure's own
    displacement.
    """
    return tuple(_displacement_range(joint, springs, k) for k in range(len(joint.chain)))


def _displacement_range(joint: Joint, springs: JointSprings, index: int) -> Range:
    found = [normal_ends(joint, springs, index)]
    for spring, sign in _springs_along(joint, springs, index):
        known = common_valid_range(spring.elastic)
        if known is not None:
            low, high = (None if isinf(end) else sign * end for end in known[::sign])
            found.append((low, high))
    turns = joint.chain[index].kind is AxisKind.ROTATION
    default = DEFAULT_ANGLE if turns else DEFAULT_DISTANCE
    lower, upper = joint_limits(joint, index)
    if lower is None:
        lower = min([low for low, _ in found if low is not None], default=-default)
    if upper is None:
        upper = max([high for _, high in found if high is not None], default=default)
    start = joint.displacement[index]
    return min(lower, start), max(upper, start)


def format_range(ends: Range, *, turns: bool = True) -> str:
    """Return a range as text: `-20 to 100 deg`, or `-5 to 5 cm` of a translation."""
    low, high = ((degrees(end) if turns else 100.0 * end) + 0.0 for end in ends)
    return f"{low:.3g} to {high:.3g} {'deg' if turns else 'cm'}"
