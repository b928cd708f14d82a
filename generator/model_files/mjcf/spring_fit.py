"""Springs of several rotations as ramps of the rotation vector's components.

The torque of our law acts along the axes of the half-way frame, with its part across the rotation
vector r scaled by (a/2)/sin(a/2), a = |r|. A model of MuJoCo has the components of r, but axes of
the parent and of the child only. Half the torque about an axis of either is right along r, and
scaled by cos(a/2) across r.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import radians
from typing import cast

import numpy as np

from generator.figure import Joint, is_rotation
from generator.joint_chain import Chain
from generator.model_files.fit_error import (
    FitError,
    joint_ranges,
    orientation_error,
    orientations,
)
from generator.model_files.piecewise import ROTATION_MARGIN
from generator.passive_curve import rotation_vector
from generator.rotations import (
    Array,
    matrix_from_rotation_vector,
    unit_vector,
)
from springs import AxisSpring, JointSprings, SphericalLaw, total_torque
from springs.elastic import Range
from springs.spherical import elastic_torque

SMALLEST_TOLERANCE, RELATIVE_TOLERANCE = 0.5, 0.03
"""Difference of a law and its ramps [N m], and as a share of the torque; the larger holds."""

SHORTEST_PIECE = radians(0.5)
"""Pieces are not divided further [rad]."""

ROUNDING = 1e-9
"""Share of the largest torque below which a difference is one of rounding."""

_SAMPLES_PER_PIECE = 9

_GRID = 7
"""Values of each displacement at which a law is compared with an isotropic one."""


@dataclass(frozen=True)
class Ramp:
    """A torque slope * (x - start) on one side of `start`, or offset + slope * x everywhere.

    Attributes:
        slope: [N m/rad].
        start: [rad]; None for a torque that applies everywhere.
        above: it applies above `start`, otherwise below.
        offset: torque at x = 0 [N m]; only of one that applies everywhere.
    """

    slope: float
    start: float | None = None
    above: bool = True
    offset: float = 0.0

    def torque(self, angle: Array) -> Array:
        """Torque [N m] at angles [rad]."""
        if self.start is None:
            return self.offset + self.slope * angle
        beyond = angle - self.start
        return self.slope * (np.maximum(beyond, 0.0) if self.above else np.minimum(beyond, 0.0))


def fit_ramps(
    torque: Callable[[Array], Array], breakpoints: Sequence[float], ends: Range
) -> tuple[Ramp, ...]:
    """Return ramps whose sum is near a continuous torque, exact where it is piecewise linear.

    Args:
        torque: function of angles [rad].
        breakpoints: angles at which its slope jumps.
        ends: range in which it is followed [rad]; beyond, the torque continues with its slope.
    """
    low, high = ends
    inner = sorted(x for x in {*breakpoints, 0.0} if low < x < high)
    corners = [low]
    for start, end in pairwise([low, *inner, high]):
        _append_chords(torque, start, end, corners)
    values = torque(np.array(corners))
    slopes = np.diff(values) / np.diff(corners)
    return _ramps_of_corners(np.array(corners), values, slopes)


def _append_chords(
    torque: Callable[[Array], Array], start: float, end: float, corners: list[float]
) -> None:
    """Append the corners of chords from `start` to `end`, without `start`, each chord the longest.

    A chord that fits is searched by bisection: longer ones fit worse, as the curve bends one way.
    """
    while start < end:
        reach = end
        if not _chord_fits(torque, start, reach):
            fitting = start
            while reach - fitting > SHORTEST_PIECE:
                middle = 0.5 * (fitting + reach)
                if _chord_fits(torque, start, middle):
                    fitting = middle
                else:
                    reach = middle
            reach = max(fitting, min(start + SHORTEST_PIECE, end))
        corners.append(reach)
        start = reach


def _chord_fits(torque: Callable[[Array], Array], start: float, end: float) -> bool:
    """Return True if the chord from `start` to `end` differs little from the curve."""
    x = np.linspace(start, end, _SAMPLES_PER_PIECE)
    y = torque(x)
    chord = y[0] + (y[-1] - y[0]) * (x - start) / (end - start)
    allowed = np.maximum(SMALLEST_TOLERANCE, RELATIVE_TOLERANCE * np.abs(y))
    return bool((np.abs(y - chord) <= allowed).all())


def _ramps_of_corners(corners: Array, values: Array, slopes: Array) -> tuple[Ramp, ...]:
    """Return one ramp for the piece above 0, or that nearest to 0, and one a change of slope."""
    base = int(np.clip(np.searchsorted(corners, 0.0, side="right") - 1, 0, len(slopes) - 1))
    negligible = ROUNDING * (float(np.abs(values).max()) + float(np.abs(slopes).max()))
    slope = float(slopes[base])
    offset = float(values[base] - slope * corners[base])
    ramps: list[Ramp] = []
    if abs(slope) > negligible or abs(offset) > negligible:
        ramps.append(Ramp(slope, offset=offset))
    for k in range(1, len(slopes)):
        above = k > base
        change = float(slopes[k] - slopes[k - 1]) * (1.0 if above else -1.0)
        if abs(change) > negligible:
            ramps.append(Ramp(change, float(corners[k]), above))
    return tuple(ramps)


def axis_ramps(joint: Joint, springs: JointSprings, spring: AxisSpring) -> tuple[Ramp, ...]:
    """Return the ramps of the elastic laws about an axis of a joint."""
    if not spring.elastic:
        return ()
    low, high = component_range(joint, springs, spring)
    corners = [corner for law in spring.elastic for corner in law.breakpoints]

    def torque(angle: Array) -> Array:
        return np.asarray(total_torque(spring.elastic, angle)) + np.zeros_like(angle)

    return fit_ramps(torque, corners, (low - ROTATION_MARGIN, high + ROTATION_MARGIN))


def component_range(joint: Joint, springs: JointSprings, spring: AxisSpring) -> Range:
    """Range of the rotation vector's component along an axis [rad]: that of its displacement."""
    for factor, (low, high) in zip(joint.chain, joint_ranges(joint, springs), strict=True):
        along = float(unit_vector(factor.axis) @ np.array(spring.direction))
        if is_rotation(factor.kind) and abs(along) > np.cos(radians(1.0)):
            return (low, high) if along > 0.0 else (-high, -low)
    return radians(-90.0), radians(90.0)


Ramps = Sequence[tuple[AxisSpring, Sequence[Ramp]]]
"""The ramps of each axis of a joint."""


def ramps_torque(ramps: Ramps, r: Array) -> Array:
    """Torque of ramps on the child in the parent's frame [N m], shape (n, 3).

    Args:
        ramps: ramps of each axis; a half of each acts about the parent's axis, a half about the
            child's.
        r: rotation vectors [rad], shape (n, 3).
    """
    total = np.zeros_like(r)
    for spring, each in ramps:
        axis = np.array(spring.direction)
        sizes = sum((ramp.torque(r @ axis) for ramp in each), np.zeros(len(r)))
        total += sizes[:, None] * axis
    turned = np.einsum("nij,nj->ni", matrix_from_rotation_vector(r), total)
    return 0.5 * (total + turned)


def spring_error(joint: Joint, springs: JointSprings, law: SphericalLaw, ramps: Ramps) -> FitError:
    """Return the error of the ramps' torque over the range of the joint [N m]."""
    chain = Chain(joint.chain)

    def sizes(displacements: Array) -> Array:
        r = rotation_vector(chain, displacements)
        half_way = elastic_torque(law, springs.axes, r)
        exact = np.einsum("nij,nj->ni", matrix_from_rotation_vector(0.5 * r), half_way)
        return np.linalg.norm(ramps_torque(ramps, r) - exact, axis=1)

    return orientation_error(sizes, chain, joint_ranges(joint, springs))


def isotropic_stiffness(
    joint: Joint, springs: JointSprings, law: SphericalLaw
) -> tuple[float, float, float] | None:
    """Return k1, k2, k3 of a torque -(k1 a + k2 a^2 + k3 a^3) r/a; None for another law.

    The law has this form over the range and beyond its ends, where stops would change it.
    """
    turns = [
        np.linspace(low - ROTATION_MARGIN, high + ROTATION_MARGIN, _GRID)
        if is_rotation(factor.kind)
        else np.zeros(1)
        for factor, (low, high) in zip(joint.chain, joint_ranges(joint, springs), strict=True)
    ]
    r = rotation_vector(Chain(joint.chain), np.array(list(product(*turns))))
    torques = elastic_torque(law, springs.axes, r)
    angle = np.linalg.norm(r, axis=1)
    powers = np.stack([-r * angle[:, None] ** power for power in range(3)], axis=-1).reshape(-1, 3)
    found = cast("Array", np.linalg.lstsq(powers, torques.ravel())[0])
    largest = float(np.abs(torques).max())
    if np.abs(powers @ found - torques.ravel()).max() > ROUNDING * largest:
        return None
    small = np.abs(found) * angle.max() ** np.arange(1, 4) <= ROUNDING * largest
    k1, k2, k3 = (0.0 if none else float(f"{k:.12g}") for k, none in zip(found, small, strict=True))
    return k1, k2, k3


def largest_torque(joint: Joint, springs: JointSprings, law: SphericalLaw) -> float:
    """Return the largest elastic torque over the range of the joint [N m]."""
    chain = Chain(joint.chain)
    r = rotation_vector(chain, orientations(chain, joint_ranges(joint, springs)))
    torques = elastic_torque(law, springs.axes, r)
    return float(np.linalg.norm(torques, axis=1).max())


def damping_error(joint: Joint, springs: JointSprings) -> FitError:
    """Return the error of viscous damping about the axes of parent and child [N m s/rad]."""
    chain = Chain(joint.chain)
    axes = np.array([axis.direction for axis in springs.axes])
    matrix = axes.T @ np.diag([axis.damping.viscous for axis in springs.axes]) @ axes

    def sizes(displacements: Array) -> Array:
        r = rotation_vector(chain, displacements)
        turn, half = matrix_from_rotation_vector(r), matrix_from_rotation_vector(0.5 * r)
        exact = half @ matrix @ half.transpose(0, 2, 1)
        approximate = 0.5 * (matrix + turn @ matrix @ turn.transpose(0, 2, 1))
        return np.linalg.norm(approximate - exact, ord=2, axis=(1, 2))

    return orientation_error(sizes, chain, joint_ranges(joint, springs), "N m s/rad")
