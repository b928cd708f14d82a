"""The passive moment of a joint about one axis as a curve, beside published ones.

The angle about an axis is that of the spring model: the displacement of a hinge, else the component
of the rotation vector.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import degrees, radians

import numpy as np

from generator.figure import Figure, Joint
from generator.joint_chain import Chain, build_chain
from generator.notebook import html_curves
from generator.rotations import Array, rotation_vector_from_matrix
from generator.springs_file.axes import axis_label, parallel_sign
from springs import (
    AxisSpring,
    CoupledSpring,
    Elastic,
    JointSprings,
    SphericalLaw,
    SpringSet,
    rotation_law,
    total_torque,
)
from springs.axis import Direction
from springs.elastic import Range, common_valid_range
from springs.lint.curve import FIRM_TORQUE, lint_range
from springs.published.range_of_motion import RangeEnd, normal_range
from springs.published.rows import PublishedCurve
from springs.published.tables import curves_of_motion
from springs.short_repr import short_repr

_SPACING = radians(1.0)
"""Distance of the angles of a curve [rad]."""

_MARGIN = radians(15.0)
"""Angle drawn beyond the normal range, the limits and the known range [rad]."""

_RELATIVE_ROUNDING = 1e-9
"""Torque that is nothing but rounding, relative to the largest one."""

Displacements = Mapping[str, Array]
"""By joint: a value for each factor of its chain, shape (n,) [rad or m]."""


@short_repr
@dataclass(frozen=True, eq=False)
class PublishedTorques:
    """A published curve at the angles of a passive curve.

    Attributes:
        key: `publication/name`.
        row: as published.
        torques: torques on the child, nan beyond the range in which the curve is known, shape (n,)
            [N m].
        band: lower and upper edge of the published scatter, nan likewise [N m]; None without one.
    """

    key: str
    row: PublishedCurve
    torques: Array
    band: tuple[Array, Array] | None

    @property
    def label(self) -> str:
        """Publication and curve in words ("Silder 2007, knee hip 0 ankle 20")."""
        source, _, name = self.key.partition("/")
        words = (word.capitalize() for word in source.split("_"))
        return f"{' '.join(words)}, {name.replace('_', ' ')}"


@short_repr
@dataclass(frozen=True, eq=False)
class PassiveCurve:
    """The passive moment of a joint about one axis, as a function of the angle about it.

    Attributes:
        joint: its name.
        spring: spring about the axis.
        chain: chain of the joint.
        law: law of joints of several rotations.
        laws: those of the spring, and of laws over several joints at the present values of the
            other angles.
        held_angles: angles of other joints on which the curve depends, by coordinate [rad].
        angles: increasing, shape (n,) [rad].
        torques: torques of all laws on the child, shape (n,) [N m].
        normal_ends: ends of the normal range of motion; None where one is not known.
        published: curves of the same motion, measurements first.
        references: references of the laws, each once.
    """

    joint: str
    spring: AxisSpring
    chain: Chain
    law: SphericalLaw
    laws: tuple[Elastic, ...]
    held_angles: Mapping[str, float]
    angles: Array
    torques: Array
    normal_ends: tuple[RangeEnd | None, RangeEnd | None]
    published: tuple[PublishedTorques, ...]
    references: tuple[str, ...] = ()

    @property
    def motion(self) -> str:
        """Name of a positive angle, or of the axis."""
        return self.spring.motion or f"about {axis_label(self.spring.direction)}"

    @property
    def label(self) -> str:
        """Joint and motion ("Left knee flexion")."""
        return f"{joint_label(self.joint)} {self.motion}"

    @property
    def valid_range(self) -> Range | None:
        """Range in which the laws are known to hold [rad], or None where that is not known."""
        return common_valid_range(self.laws)

    @property
    def checked_range(self) -> Range:
        """The normal range with a margin, or -90 to 90 deg for an end that is not known [rad]."""
        return lint_range(*self.normal_ends)

    @property
    def dead_zone(self) -> Range | None:
        """The widest range without a torque among the angles [rad], or None."""
        free = np.abs(self.torques) <= _RELATIVE_ROUNDING * np.abs(self.torques).max(initial=0.0)
        edges = np.flatnonzero(np.diff([False, *free.tolist(), False])).reshape(-1, 2)
        zones = [(float(self.angles[a]), float(self.angles[b - 1])) for a, b in edges]
        zone = max(zones, key=lambda one: one[1] - one[0], default=None)
        return zone if zone is not None and zone[1] > zone[0] else None

    def component(self, displacements: Displacements) -> Array:
        """Angle about the axis in a pose, or in frames of shape (m, n) [rad]."""
        return angle_about(self.chain, self.law, self.spring.direction, displacements[self.joint])

    def moment_at(self, angle: float | Array) -> Array:
        """Torque on the child at angles about the axis alone [N m]."""
        at = np.asarray(angle, dtype=float)
        return np.asarray(total_torque(self.laws, at)) + np.zeros_like(at)

    def describe(self, angle: float) -> tuple[str, ...]:
        """Return the moment at an angle [rad] and what holds there, a sentence each."""
        moment, at = float(self.moment_at(angle)), f"{degrees(angle):.1f} deg"
        zone, known = self.dead_zone, self.valid_range
        if zone is not None and zone[0] <= angle <= zone[1]:
            lines = [f"0.0 N m at {at}", f"In the dead zone, {_format_range(zone)}"]
        else:
            drives = "back" if moment * angle < 0.0 else "on"
            size = f"{moment:.1f}" if abs(moment) >= 0.1 or not moment else f"{moment:.2g}"
            lines = [f"{size} N m at {at}" + (f" (drives {drives})" if moment else "")]
        if known is not None and not known[0] <= angle <= known[1]:
            lines.append(f"Extrapolated: the curve is known for {_format_range(known)} only")
        for end, side in zip(self.normal_ends, (-1.0, 1.0), strict=True):
            if end is not None and side * (angle - end.angle) > 0.0:
                normal = f"{abs(degrees(end.angle)):.0f} deg"
                lines.append(
                    f"Beyond the normal range: {end.motion} ends at {normal} ({end.sample})"
                )
        if self.held_angles:
            others = (f"{name} at {degrees(a):.1f} deg" for name, a in self.held_angles.items())
            lines.append(f"A law over several joints, drawn with {' and '.join(others)}")
        return tuple(lines)

    def summary(self) -> tuple[str, ...]:
        """Return joint, motion, known range, torques at its ends, and damping, as texts.

        Where the known range is not stated the ends are those of the normal one.
        """
        known = self.valid_range
        low, high = known or self.checked_range
        ends = " and ".join(f"{moment:.1f}" for moment in self.moment_at(np.array([low, high])))
        shown = "" if known is None else f"{degrees(low):.0f} to {degrees(high):.0f}"
        return self.joint, self.motion, shown, ends, f"{self.spring.damping.viscous:.3g}"

    def _repr_html_(self) -> str:
        """The curve beside published ones, for notebooks."""
        low, high = self.checked_range
        shown = (self.angles >= low - _MARGIN) & (self.angles <= high + _MARGIN)
        angles = np.degrees(self.angles[shown])
        curves = [(self.label, angles, self.torques[shown])]
        curves += [(one.label, angles, one.torques[shown]) for one in self.published]
        return html_curves(("angle [deg]", "torque [N m]"), curves, self.torque_limits())

    def torque_limits(self) -> Range:
        """Limits that show measurements, and the curve as far as `LARGEST_TORQUE` [N m]."""
        low, high = self.checked_range
        inside = (self.angles >= low) & (self.angles <= high)
        sizes = np.abs(self.torques)
        least = min(FIRM_TORQUE, float(sizes.max(initial=_SMALLEST_TORQUE)))
        largest = min(float(sizes[inside].max(initial=least)), LARGEST_TORQUE)
        for one in self.published:
            if not one.row.obstacle:
                known = inside & np.isfinite(one.torques)
                largest = max(largest, float(np.abs(one.torques[known]).max(initial=0.0)))
        return -TORQUE_MARGIN * largest, TORQUE_MARGIN * largest


LARGEST_TORQUE = 40.0
"""Torque of a law up to which it is drawn [N m], so that measurements below it remain legible."""

_SMALLEST_TORQUE = 1e-6
"""Torque of a curve that is zero everywhere, for the limits of its drawing [N m]."""

TORQUE_MARGIN = 1.4
"""Largest torque drawn, relative to the largest of the curve and of measurements."""


def passive_curves(
    figure: Figure, springs: SpringSet, displacements: Displacements | None = None
) -> dict[str, tuple[PassiveCurve, ...]]:
    """Return the curves of all joints that have springs about axes, by joint.

    Args:
        figure: the figure.
        springs: springs of its joints.
        displacements: angles at which laws over several joints are taken; None for those of the
            figure.
    """
    at = initial_angles(figure) if displacements is None else displacements
    curves = {
        name: tuple(
            passive_curve(figure, springs, name, spring, at)
            for spring in axis_springs(springs, name)
        )
        for name in figure.joints
    }
    return {name: found for name, found in curves.items() if found}


def initial_angles(figure: Figure) -> dict[str, Array]:
    """Return the displacements in the figure's file, shape (n,) per joint [rad or m]."""
    return {name: np.array(joint.displacement) for name, joint in figure.joints.items()}


def axis_springs(springs: SpringSet, joint: str) -> tuple[AxisSpring, ...]:
    """Return the springs about the axes of a joint with a law, one of their own or a coupled one.

    An axis that has only a law over several joints gets a spring without a law of its own.
    """
    own = springs.joints.get(joint)
    found = [] if own is None else list(own.axes)
    for coupled in springs.coupled:
        for coordinate, axis in zip(coupled.law.coordinates, coupled.axes, strict=True):
            known = any(parallel_sign(spring.direction, axis.direction) for spring in found)
            if axis.joint == joint and not known:
                found.append(AxisSpring(axis.direction, motion=coordinate.partition(" ")[2]))
    return tuple(
        spring for spring in found if spring.elastic or _coupled_about(springs, joint, spring)
    )


def passive_curve(
    figure: Figure,
    springs: SpringSet,
    joint: str,
    spring: AxisSpring,
    displacements: Displacements,
) -> PassiveCurve:
    """Return the curve of one of the `axis_springs` of a joint in a pose; see `passive_curves`."""
    laws, held_angles = list(spring.elastic), dict[str, float]()
    references = [spring.reference]
    for coupled, k, sign in _coupled_about(springs, joint, spring):
        others = _other_angles(figure, springs.law, coupled, k, displacements)
        law = coupled.law.single_angle_law(coupled.law.coordinates[k], others)
        laws.append(law if sign > 0 else law.mirrored())
        held_angles |= others
        references.append(coupled.reference)
    ends = normal_range(joint, spring.motion)
    angles = _sampled_angles(figure.joints[joint], spring, laws, lint_range(*ends))
    return PassiveCurve(
        joint,
        spring,
        build_chain(figure.joints[joint].chain),
        springs.law,
        tuple(laws),
        held_angles,
        angles,
        np.asarray(total_torque(laws, angles)) + np.zeros_like(angles),
        ends,
        _published_curves(joint, spring.motion, tuple(angles.tolist())),
        tuple(dict.fromkeys(reference for reference in references if reference)),
    )


def passive_torque(
    figure: Figure, springs: SpringSet, joint: str, displacements: Displacements
) -> Array:
    """Return the elastic torque of all laws of a joint on its child in a pose, shape (3,) [N m].

    Components are in the half-way frame, the parent's site turned by half the joint's rotation; for
    a hinge its component along the axis counts.
    """
    own = springs.joints.get(joint, JointSprings(joint))
    chain = build_chain(figure.joints[joint].chain)
    coupled_torques: list[tuple[Direction, float]] = []
    for coupled in springs.coupled:
        if not any(axis.joint == joint for axis in coupled.axes):
            continue
        angles = [
            float(_coupled_angle(figure, springs.law, coupled, k, displacements))
            for k in range(len(coupled.axes))
        ]
        for torque, axis in zip(coupled.law.torques(angles), coupled.axes, strict=True):
            if axis.joint == joint:
                coupled_torques.append((axis.direction, float(torque)))
    if len(chain.rotations) == 1:
        for axis in own.axes:
            angle = angle_about(chain, springs.law, axis.direction, displacements[joint])
            coupled_torques.append(
                (axis.direction, float(total_torque(axis.elastic, float(angle))))
            )
        return sum((torque * np.array(axis) for axis, torque in coupled_torques), np.zeros(3))
    law = rotation_law(own, springs.law, chain.rotation_axes)
    vector = rotation_vector(chain, displacements[joint])
    directions, torques = (
        [axis for axis, _ in coupled_torques],
        [torque for _, torque in coupled_torques],
    )
    total = law.torque_about(directions, torques, vector) if coupled_torques else np.zeros(3)
    return total + law.torque(vector)


def rotation_vector(chain: Chain, displacements: Array) -> Array:
    """Return the rotation vector of a joint's child in its parent, (..., n) to (..., 3) [rad]."""
    return rotation_vector_from_matrix(chain.pose(displacements)[..., :3, :3])


def angle_about(
    chain: Chain, law: SphericalLaw, direction: Direction, displacements: Array
) -> Array:
    """Return the angle about an axis that a law reads, (..., n) [rad or m] to (...) [rad].

    It is the displacement of a hinge, which may exceed a turn, or of an axis of a chain under a law
    of coordinates, else the component of the rotation vector.
    """
    values = np.asarray(displacements, dtype=float)
    if len(chain.rotations) == 1 or law is SphericalLaw.COORDINATES:
        along = [float(np.dot(axis, direction)) for axis in chain.rotation_axes]
        k = int(np.argmax(np.abs(along)))
        return values[..., chain.rotations[k]] * np.sign(along[k])
    return rotation_vector(chain, values) @ np.array(direction)


def joint_label(joint: str) -> str:
    """Return the name of a joint as a label ("Left hip" of `left_hip_joint`)."""
    words = joint.replace("_", " ").strip()
    shorter = words.removesuffix(" joint") or words
    return shorter[:1].upper() + shorter[1:] or joint


def _format_range(ends: Range) -> str:
    low, high = (degrees(end) + 0.0 for end in ends)
    return f"{low:.1f} to {high:.1f} deg"


def _sampled_angles(
    joint: Joint, spring: AxisSpring, laws: Sequence[Elastic], checked: Range
) -> Array:
    """Return the angles at which a curve is drawn, with the breakpoints of its laws [rad].

    Breakpoints beyond `LARGEST_TORQUE` do not widen them.
    """
    ends = [*checked, *(common_valid_range(laws) or ())]
    all_corners = np.array([corner for law in laws for corner in law.breakpoints])
    small = np.abs(np.asarray(total_torque(laws, all_corners))) <= LARGEST_TORQUE
    ends += all_corners[small].tolist() if laws else []
    for k, axis in enumerate(joint.chain):
        sign = parallel_sign(axis.axis, spring.direction)
        for limits in (joint.lower_limit, joint.upper_limit):
            if sign and limits is not None:
                ends.append(sign * limits[k])
    ends = [end for end in ends if np.isfinite(end)]
    low, high = max(min(ends) - _MARGIN, -np.pi), min(max(ends) + _MARGIN, np.pi)
    corners = all_corners[(low < all_corners) & (all_corners < high)]
    count = int((high - low) / _SPACING) + 2
    return np.unique([*np.linspace(low, high, count), *corners])


@lru_cache(maxsize=64)
def _published_curves(
    joint: str, motion: str, angles: tuple[float, ...]
) -> tuple[PublishedTorques, ...]:
    """Return the published curves of a motion; a change of the springs does not change them."""
    at = np.array(angles)
    return tuple(_published_torques(key, row, at) for key, row in curves_of_motion(joint, motion))


def _published_torques(key: str, row: PublishedCurve, angles: Array) -> PublishedTorques:
    low, high = row.valid_range or (-np.inf, np.inf)
    known = (angles >= low - 1e-12) & (angles <= high + 1e-12)
    band = row.torque_band(angles)
    return PublishedTorques(
        key,
        row,
        np.where(known, np.asarray(row.law.torque(angles)), np.nan),
        None
        if band is None
        else (np.where(known, band[0], np.nan), np.where(known, band[1], np.nan)),
    )


def _coupled_about(
    springs: SpringSet, joint: str, spring: AxisSpring
) -> list[tuple[CoupledSpring, int, int]]:
    """Return the coupled laws about the axis of a spring: coordinate and sense in the axis."""
    return [
        (coupled, k, sign)
        for coupled in springs.coupled
        for k, axis in enumerate(coupled.axes)
        if axis.joint == joint and (sign := parallel_sign(axis.direction, spring.direction))
    ]


def _other_angles(
    figure: Figure,
    law: SphericalLaw,
    coupled: CoupledSpring,
    k: int,
    displacements: Displacements,
) -> dict[str, float]:
    """Return the angles of the other coordinates of a coupled law [rad]."""
    return {
        name: float(_coupled_angle(figure, law, coupled, j, displacements))
        for j, name in enumerate(coupled.law.coordinates)
        if j != k
    }


def _coupled_angle(
    figure: Figure,
    law: SphericalLaw,
    coupled: CoupledSpring,
    k: int,
    displacements: Displacements,
) -> Array:
    axis = coupled.axes[k]
    chain = build_chain(figure.joints[axis.joint].chain)
    return angle_about(chain, law, axis.direction, displacements[axis.joint])
