"""Differences of two motions at common times: in joints, touches, forces and energies.

The difference of a joint that turns about one axis is that of its displacements. That of a joint
of several rotations is the angle of the rotation `R_B R_A^T`, from the orientation of its child in
the reference to that in the other motion: it does not depend on the order of the rotations, has no
poles, and is at most 180 deg. The axis whose displacement differs most names it ("mostly flexion")
and gives its sign. The difference of a position is along the axis along which it is the largest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite, pi, remainder

import numpy as np

from generator.comparison.difference import Difference, Quantity
from generator.contact.record import ContactRecord, PartContact, SegmentContact
from generator.diagnostics import UsageError
from generator.figure import JointAxis, is_rotation
from generator.joint_chain import build_chain
from generator.kinematics.free_root import FREE_CHAINS
from generator.losses import Loss
from generator.motion_files import FigureMotion
from generator.motion_files.page import springs_of_header
from generator.passive_curve import axis_springs
from generator.recording import Ending, energy_kinds
from generator.rotations import Array, rotation_vector_from_matrix, unit_axis
from generator.springs_file.axes import axis_label, parallel_sign
from springs import JointSprings, SpringSet

Contact = PartContact | SegmentContact


@dataclass(frozen=True)
class Pair:
    """Reference and another motion.

    Attributes:
        name: Name of the other motion.
        motions: Both as they were read.
        aligned: Both at the common times.
        times: Common times, shape (n,) [s].
        threshold: Difference of an angle above which they diverge [rad].
    """

    name: str
    motions: tuple[FigureMotion, FigureMotion]
    aligned: tuple[FigureMotion, FigureMotion]
    times: Array
    threshold: float

    def differences(self) -> Iterator[Difference]:
        """Yield the differences, the largest first in each quantity. Raises UsageError."""
        if not self._common_joints:
            raise UsageError(f"{self.name} has no joint in common with the reference")
        every = [*self._of_joints(), *self._of_contact(), *self._of_energies()]
        for quantity in Quantity:
            yield from sorted((one for one in every if one.quantity is quantity), key=_rank)

    def notes(self, reference: str) -> Iterator[str]:
        """Yield the sentences about what was left out, and the sensitivity of the runs."""
        of_both = tuple(zip((reference, self.name), self.motions, strict=True))
        for name, motion in of_both:
            left = tuple(one for one in motion.chains if one not in self._common_joints)
            if left:
                loss = Loss(f"Left out, joints of {name} that the other has not as such", left)
                yield f"{loss}."
        if self._peaks_outside:
            loss = Loss("Left out, peaks of forces at other times", self._peaks_outside)
            yield f"{loss}."
        for name, motion in of_both:
            contact = None if motion.recording is None else motion.recording.contact
            chaotic = contact.chaotic_from(motion.times) if contact else None
            if chaotic is not None and chaotic < self.times[-1]:
                since = f"Poses of {name} are chaotic from {chaotic:.3g} s"
                yield f"{since}: later differences of angles are partly chance."
            if motion.header.outcome is not Ending.DONE:
                yield f"{name}: {motion.header.message}"

    @cached_property
    def _common_joints(self) -> tuple[str, ...]:
        """Moving joints of both whose displacements can be compared."""
        first, other = (one.chains for one in self.motions)
        common = (name for name, chain in first.items() if chain and name in other)
        return tuple(name for name in common if are_comparable(first[name], other[name]))

    @cached_property
    def _springs(self) -> SpringSet | None:
        """Springs of the first motion that has some which are known; they name the axes."""
        return known_springs(self.motions)

    def _of_joints(self) -> Iterator[Difference]:
        """Yield the largest difference of each joint in angle, and in position."""
        for joint in self._common_joints:
            chain = build_chain(self.aligned[0].chains[joint])
            first, other = (one.displacements[joint] for one in self.aligned)
            turns, slides = list(chain.rotations), list(chain.translations)
            if turns:
                sizes = np.abs(other[:, turns[0]] - first[:, turns[0]])
                if len(turns) > 1:
                    poses = chain.pose(first), chain.pose(other)
                    relative = poses[1][:, :3, :3] @ np.swapaxes(poses[0][:, :3, :3], 1, 2)
                    sizes = np.linalg.norm(rotation_vector_from_matrix(relative), axis=1)
                yield self._largest(Quantity.ANGLE, joint, turns, sizes)
            if slides:
                sizes = np.abs(other[:, slides] - first[:, slides]).max(axis=1)
                yield self._largest(Quantity.POSITION, joint, slides, sizes)

    def _largest(
        self, quantity: Quantity, joint: str, axes: Sequence[int], sizes: Array
    ) -> Difference:
        """Return the largest of the differences of a joint.

        Args:
            quantity: Angle or position.
            joint: Name of the joint.
            axes: Indices of its rotations or translations, one of which names the difference.
            sizes: Sizes of the differences, shape (n,) [rad or m].
        """
        k = int(np.argmax(sizes))
        first, other = (one.displacements[joint][k] for one in self.aligned)
        steps = [float(other[axis] - first[axis]) for axis in axes]
        is_of_several = len(axes) > 1 and quantity is Quantity.ANGLE
        if is_of_several:
            steps = [remainder(step, 2.0 * pi) for step in steps]
        step, axis = max(zip(steps, axes, strict=True), key=lambda pair: abs(pair[0]))
        about, sense = name_axis(self.aligned[0], self._springs, joint, axis)
        time, is_angle = float(self.times[k]), quantity is Quantity.ANGLE
        return Difference(
            self.name,
            quantity,
            joint,
            f"mostly {about}" if is_of_several else about,
            float(np.copysign(sizes[k], sense * step)) if sizes[k] else 0.0,
            sense * float(first[axis]) + 0.0,
            sense * float(other[axis]) + 0.0,
            time,
            time,
            self._error(time) if is_angle else None,
            first_crossing(self.times, sizes, self.threshold) if is_angle else None,
            f"{joint}.{axis + 1}",
        )

    def _error(self, time: float) -> float | None:
        """Return the sum of the estimated errors of both runs at a time [rad]."""
        total = 0.0
        for motion in self.motions:
            run = motion.recording
            if run is None or run.accuracy.tolerance is None:
                return None
            total += float(np.interp(time, motion.times, run.accuracy.by_frame))
        return total if isfinite(total) else None

    @cached_property
    def _records(self) -> tuple[ContactRecord, ContactRecord] | None:
        """Contact of both runs, None where one has none."""
        first, other = (one.recording.contact if one.recording else None for one in self.motions)
        return None if first is None or other is None else (first, other)

    @cached_property
    def _contacts(self) -> dict[str, tuple[Contact, Contact]]:
        """Contact of both of each part of the body, or of each segment where one has no parts."""
        if self._records is None:
            return {}
        first, other = self._records
        if first.parts and other.parts:
            return {k: (first.parts[k], other.parts[k]) for k in first.parts if k in other.parts}
        common = (name for name in first.segments if name in other.segments)
        return {name: (first.segments[name], other.segments[name]) for name in common}

    @cached_property
    def _peaks_outside(self) -> tuple[str, ...]:
        """Parts or segments with the peak of a force at another time than the common one."""
        return tuple(
            name
            for name, both in self._contacts.items()
            if not all(self._is_inside(one.peak_time) for one in both if one.peak_force)
        )

    def _is_inside(self, time: float) -> bool:
        return bool(self.times[0] <= time <= self.times[-1])

    def _of_contact(self) -> Iterator[Difference]:
        """Yield the differences of first touches, and of peaks of forces over all steps."""
        for name, (first, other) in self._contacts.items():
            column = f"{name}.contact_force"
            column = column if self._records and name in self._records[0].forces else ""
            before, after = (
                time if time is not None and time <= self.times[-1] else None
                for time in (first.first_time, other.first_time)
            )
            if before is not None or after is not None:
                size = None if before is None or after is None else after - before
                yield Difference(
                    self.name, Quantity.FIRST_TOUCH, name, "", size, before, after, before, after,
                    column=column,
                )  # fmt: skip
            if name not in self._peaks_outside and (first.peak_force or other.peak_force):
                yield Difference(
                    self.name,
                    Quantity.PEAK_FORCE,
                    name,
                    "",
                    other.peak_force - first.peak_force,
                    first.peak_force,
                    other.peak_force,
                    first.peak_time if first.peak_force else None,
                    other.peak_time if other.peak_force else None,
                    column=column,
                )

    def _of_energies(self) -> Iterator[Difference]:
        """Yield the largest difference over time of each kind of energy of both runs."""
        runs = [one.recording for one in self.motions]
        if runs[0] is None or runs[1] is None:
            return
        first, other = runs[0].energy, runs[1].energy
        for kind in energy_kinds(first):
            if kind not in other or not (np.any(first[kind]) or np.any(other[kind])):
                continue
            before, after = (
                np.interp(self.times, motion.times, energy[kind])
                for motion, energy in zip(self.motions, (first, other), strict=True)
            )
            k = int(np.argmax(np.abs(after - before)))
            time, values = float(self.times[k]), (float(before[k]), float(after[k]))
            size = values[1] - values[0]
            yield Difference(
                self.name, Quantity.ENERGY, kind, "", size, *values, time, time, column=kind
            )


def known_springs(motions: Sequence[FigureMotion]) -> SpringSet | None:
    """Return the springs of the first motion that has some which are known."""
    of_all = (one.springs or springs_of_header(one.header, one.figure) for one in motions)
    return next((one for one in of_all if one is not None and one.joints), None)


def name_axis(
    motion: FigureMotion, springs: SpringSet | None, joint: str, axis: int
) -> tuple[str, int]:
    """Return the motion of an axis of a joint that springs name, and its sense; or the axis."""
    factor = motion.chains[joint][axis]
    direction = unit_axis(factor.axis)
    if springs is not None:
        own = springs.joints.get(joint, JointSprings(joint))
        turning = (*own.axes, *axis_springs(springs, joint))
        for spring in turning if is_rotation(factor.kind) else own.translations:
            sense = parallel_sign(spring.direction, direction)
            if sense and spring.motion:
                return spring.motion, sense
    return f"{factor.units.preposition} {axis_label(direction)}", 1


def _rank(difference: Difference) -> float:
    """Key that sorts differences by size, touches by the time of the earlier one."""
    if difference.quantity is Quantity.FIRST_TOUCH:
        both = (difference.reference, difference.value)
        return min(time for time in both if time is not None)
    return -abs(difference.size or 0.0)


def are_comparable(chain: Sequence[JointAxis], other: Sequence[JointAxis]) -> bool:
    """Return whether joints have the same axes, or both let a segment free."""
    if len(chain) != len(other):
        return False
    if tuple(chain) in FREE_CHAINS and tuple(other) in FREE_CHAINS:
        return True
    return all(
        one.kind is two.kind and parallel_sign(unit_axis(one.axis), unit_axis(two.axis)) == 1
        for one, two in zip(chain, other, strict=True)
    )


def first_crossing(times: Array, sizes: Array, threshold: float) -> float | None:
    """Return the time from which a size first exceeds a threshold; None where it never does.

    Between frames it is interpolated linearly.

    Args:
        times: Times, shape (n,) [s].
        sizes: Sizes, shape (n,).
        threshold: Threshold, in the unit of the sizes.
    """
    above = np.flatnonzero(sizes > threshold)
    if not above.size:
        return None
    k = int(above[0])
    if k == 0:
        return float(times[0])
    share = (threshold - sizes[k - 1]) / (sizes[k] - sizes[k - 1])
    return float(times[k - 1] + share * (times[k] - times[k - 1]))
