"""The error of a law that another program holds approximately, over the range of the joint."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import isinf, radians

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.figure import Joint
from generator.joint_chain import Chain
from generator.losses import Effect, Losses
from generator.passive_curve import rotation_vector
from generator.rotations import Array, unit_axis, unit_vector
from generator.springs_file.axes import parallel_sign
from generator.units import ROTATION_UNITS, AxisUnits
from springs import AxisSpring, JointSprings
from springs.elastic import Range, common_valid_range
from springs.published.range_of_motion import normal_range

DEFAULT_ANGLE = radians(90.0)
"""End of a rotation's range that is neither limited nor published [rad]."""

DEFAULT_DISTANCE = 0.1
"""End of a translation's range that is not limited [m]."""


_HALF_TURN = np.pi - 1e-6
"""Largest size of a rotation that is sampled [rad]."""

_SAMPLES, _SEED = 8000, 0

_REFINED_SAMPLES, _TRIALS = 16, 40
"""Number of orientations with the largest errors, and of those tried around each."""

_REFINEMENT_DISTANCES = (0.1, 0.03, 0.01, 0.003)
"""Distances of these trials, as a share of the range."""


@dataclass(frozen=True)
class FitError:
    """The difference between an approximate torque and the law.

    Attributes:
        largest: its largest size, in `unit`.
        rms: its root mean square, in `unit`.
        unit: "N m", "N" along a translation, "N m s/rad" of damping.
    """

    largest: float
    rms: float
    unit: str = "N m"

    @classmethod
    def from_differences(cls, differences: ArrayLike, unit: str = "N m") -> "FitError":
        """Return the error of samples over the range; of several components, their sizes."""
        sizes = np.abs(np.asarray(differences, dtype=float))
        return cls(float(sizes.max(initial=0.0)), float(np.sqrt(np.mean(sizes**2))), unit)

    def __str__(self) -> str:
        """Both sizes with their unit ("0.81 N m at most, 0.2 N m rms")."""
        largest, rms = format_size(self.largest), format_size(self.rms)
        return f"{largest} {self.unit} at most, {rms} {self.unit} rms"


def format_size(size: float) -> str:
    """Return a size with two digits, or a whole number: never 1.2e+02."""
    return f"{size:.2g}" if not 99.5 <= size < 1e6 else f"{size:.0f}"


@dataclass
class FitErrors:
    """The errors of the fits in a model, by the sentence of their loss."""

    _places: dict[str, list[tuple[FitError, str, str]]] = field(
        default_factory=dict[str, list[tuple[FitError, str, str]]]
    )

    def add(self, what: str, place: str, error: FitError, note: str = "") -> None:
        """Add the error of the fit of a joint or a displacement; `note` follows it."""
        self._places.setdefault(what, []).append((error, place, f"{error}{note}"))

    def report(self, losses: Losses) -> None:
        """Add the losses, the largest errors first; places with equal errors are one."""
        for what, found in self._places.items():
            places: dict[str, list[str]] = {}
            for _, place, sizes in sorted(found, key=lambda each: -each[0].largest):
                places.setdefault(sizes, []).append(place)
            losses.add(
                what,
                *(f"{' and '.join(each)} ({sizes})" for sizes, each in places.items()),
                effect=Effect.APPROXIMATION,
            )


def orientations(chain: Chain, ranges: tuple[Range, ...]) -> Array:
    """Displacements of orientations in the range of a joint, at random, shape (n, factors) [rad].

    An orientation is in the range if its displacements are, and the components of its rotation
    vector too. Translations are zero.
    """
    rng = np.random.default_rng(_SEED)
    samples = np.zeros((_SAMPLES, len(chain.joint_axes)))
    for k in chain.rotations:
        samples[:, k] = rng.uniform(*within_half_turns(ranges[k]), len(samples))
    inside = are_in_range(chain, ranges, samples)
    return samples[inside] if inside.any() else samples


def orientation_error(
    sizes: Callable[[Array], Array], chain: Chain, ranges: tuple[Range, ...], unit: str = "N m"
) -> FitError:
    """Return the error at orientations throughout the range of a joint.

    The largest is searched from the worst orientations at random on.

    Args:
        sizes: function of displacements, shape (n, factors), to differences, shape (n,) or (n, m).
        chain: chain of the joint.
        ranges: ranges of its displacements [rad or m].
        unit: unit of the sizes.
    """
    rng = np.random.default_rng(_SEED)
    samples = orientations(chain, ranges)
    differences = np.abs(sizes(samples))
    worst, largest = samples, differences.reshape(len(samples), -1).max(axis=1)
    lower, upper = np.array([within_half_turns(ends) for ends in ranges]).T
    turning = np.isin(np.arange(len(ranges)), chain.rotations)
    for distance in _REFINEMENT_DISTANCES:
        worst = worst[np.argsort(largest)[-_REFINED_SAMPLES:]]
        moves = rng.uniform(-1.0, 1.0, (_TRIALS, *worst.shape)) * (upper - lower) * distance
        trials = np.clip(worst + moves * turning, lower, upper).reshape(-1, len(ranges)) * turning
        trials = trials[are_in_range(chain, ranges, trials)]
        worst = np.concatenate([worst, trials])
        largest = np.abs(sizes(worst)).reshape(len(worst), -1).max(axis=1)
    rms = FitError.from_differences(differences, unit).rms
    return FitError(float(largest.max()), rms, unit)


def are_in_range(chain: Chain, ranges: tuple[Range, ...], samples: Array) -> NDArray[np.bool_]:
    """Return True for orientations whose rotation vectors have their components in the range."""
    vectors, inside = rotation_vector(chain, samples), np.full(len(samples), True)
    for k in chain.rotations:
        component = vectors @ unit_vector(chain.joint_axes[k].axis)
        inside &= (component >= ranges[k][0] - 1e-9) & (component <= ranges[k][1] + 1e-9)
    return inside


def within_half_turns(ends: Range) -> Range:
    """Return a range within half a turn to both sides, where the rotation vector jumps [rad]."""
    return max(ends[0], -_HALF_TURN), min(ends[1], _HALF_TURN)


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
        if joint.chain[index].units.is_angle and spring.motion:
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
    for spring in springs.axes if any(factor.twist.angular) else springs.translations:
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
    default = DEFAULT_ANGLE if joint.chain[index].units.is_angle else DEFAULT_DISTANCE
    lower, upper = joint_limits(joint, index)
    if lower is None:
        lower = min([low for low, _ in found if low is not None], default=-default)
    if upper is None:
        upper = max([high for _, high in found if high is not None], default=default)
    start = joint.displacement[index]
    return min(lower, start), max(upper, start)


def format_range(ends: Range, units: AxisUnits = ROTATION_UNITS) -> str:
    """Return a range as text: `-20 to 100 deg`, or `-5 to 5 cm` of a translation."""
    low, high = (units.scale * end + 0.0 for end in ends)
    return f"{low:.3g} to {high:.3g} {units.displacement}"
