"""Passive moments of a posture: the elastic laws of joints, without their stops."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import degrees, inf, radians

import numpy as np

from generator.kinematics.placement import Displacements, Placement
from generator.kinematics.tree import Tree
from generator.passive_curve import angle_about, passive_torque, rotation_vector
from generator.rotations import Array, matrix_from_rotation_vector
from springs import JointSprings, SphericalLaw, SpringSet, total_torque
from springs.axis import Direction
from springs.elastic import Range, common_valid_range

RANGE_TOLERANCE = radians(15.0)
"""Angle beyond a limit up to which a posture is judged [rad], an estimate: limits are of joints
without load, and an ankle that bears the body in a squat bends further."""

_ANGLE_ROUNDING = 1e-6
"""Rounding of an angle at the end of a range [rad]."""


@dataclass(frozen=True)
class PassiveMoments:
    """Passive moments of a figure.

    Stops are left out: their stiffness is an estimate that holds a falling body, and a posture
    beyond a limit is reported instead.

    Attributes:
        tree: Tree of the figure.
        springs: Springs of its joints.
    """

    tree: Tree
    springs: SpringSet

    @cached_property
    def _elastic(self) -> SpringSet:
        """The springs without stops and translations."""
        joints = {name: _without_stops(own) for name, own in self.springs.joints.items()}
        return replace(self.springs, joints=joints)

    @cached_property
    def _joints(self) -> tuple[str, ...]:
        """Joints of the tree on which a law acts."""
        coupled = {axis.joint for one in self.springs.coupled for axis in one.axes}
        return tuple(
            name
            for name in self.tree.kinematics.columns
            if name in coupled
            or (
                (own := self._elastic.joints.get(name)) is not None
                and (own.reach is not None or any(axis.elastic for axis in own.axes))
            )
        )

    def moments(self, displacements: Displacements) -> dict[str, Array]:
        """Return the generalized forces of all laws on joints, shape (n,) per joint [N m]."""
        found = {name: np.zeros(len(displacements[name])) for name in self._joints}
        for name, own in found.items():
            springs = self._elastic.joints.get(name, JointSprings(name))
            if name not in self._displacement_joints:
                own += self._projected(name, displacements)
                continue
            for spring in springs.axes:
                k, sense = self._place(name, spring.direction)
                torque = total_torque(spring.elastic, sense * float(displacements[name][k]))
                own[k] += sense * float(torque)
        for coupled in self.springs.coupled:
            places = [
                (axis.joint, *self._place(axis.joint, axis.direction)) for axis in coupled.axes
            ]
            if not {joint for joint, *_ in places} <= self._displacement_joints:
                continue
            angles = [sense * float(displacements[joint][k]) for joint, k, sense in places]
            torques = coupled.law.torques(angles)
            for (joint, k, sense), torque in zip(places, torques, strict=True):
                found[joint][k] += sense * float(torque)
        return found

    @cached_property
    def _displacement_joints(self) -> frozenset[str]:
        """Joints whose laws are all of displacements, and act along them."""
        joints = set(filter(self._reads_displacements, self.tree.kinematics.columns))
        coupled = [{axis.joint for axis in one.axes} for one in self.springs.coupled]
        # A joint of two laws takes the joints of the second with it.
        while any(own & joints and not own <= joints for own in coupled):
            for own in coupled:
                if not own <= joints:
                    joints -= own
        return frozenset(joints)

    def _reads_displacements(self, joint: str) -> bool:
        own = self.springs.joints.get(joint)
        if own is not None and own.reach is not None:
            return False
        is_hinge = len(self.tree.chains[joint].rotations) == 1
        return is_hinge or self.springs.law is SphericalLaw.COORDINATES

    def _place(self, joint: str, direction: Direction) -> tuple[int, float]:
        """Return the index of the rotation about an axis, and 1 or -1 for the opposite axis."""
        chain = self.tree.chains[joint]
        along = [float(np.dot(axis, direction)) for axis in chain.rotation_axes]
        k = int(np.argmax(np.abs(along)))
        return chain.rotations[k], float(np.sign(along[k]))

    def _projected(self, joint: str, displacements: Displacements) -> Array:
        """Return the generalized forces of laws of the rotation vector, shape (n,) [N m]."""
        chain, values = self.tree.chains[joint], displacements[joint]
        torque = passive_torque(self.tree.figure, self._elastic, joint, displacements)
        own, turns = np.zeros(len(values)), list(chain.rotations)
        if len(turns) > 1:
            torque = matrix_from_rotation_vector(0.5 * rotation_vector(chain, values)) @ torque
        own[turns] = chain.twists(values)[turns, :3] @ torque
        return own

    def notes(self, placement: Placement) -> Iterator[str]:
        """Yield where a posture is beyond the range of a joint or of a law that acts there."""
        figure = self.tree.figure
        for name in self.tree.kinematics.columns:
            joint, values = figure.joints[name], placement.displacements[name]
            lower, upper = joint.lower_limit, joint.upper_limit
            for k in self.tree.chains[name].rotations:
                low = None if lower is None else lower[k]
                high = None if upper is None else upper[k]
                yield from _beyond(f"joint {name}", float(values[k]), (low, high), "its limit")
        for joint, direction, noun, known in self._measured_ranges:
            chain, values = self.tree.chains[joint], placement.displacements[joint]
            angle = float(angle_about(chain, self.springs.law, direction, values))
            yield from _beyond(noun, angle, known, "what its passive law was measured for")

    @cached_property
    def _measured_ranges(self) -> tuple[tuple[str, Direction, str, Range], ...]:
        """Ranges in which laws are known to hold, with joint, axis and name of the angle."""
        found: list[tuple[str, Direction, str, Range]] = []
        for name, own in self._elastic.joints.items():
            for axis in own.axes if name in self._joints and own.reach is None else ():
                known = common_valid_range(axis.elastic)
                if known is not None:
                    noun = f"{name} {axis.motion}".strip()
                    found.append((name, axis.direction, noun, known))
        for coupled in self.springs.coupled:
            law = coupled.law
            for axis, angle, known in zip(
                coupled.axes, law.coordinates, law.valid_ranges, strict=True
            ):
                if known is not None:
                    noun = f"{axis.joint} {angle.rpartition(' ')[2]}"
                    found.append((axis.joint, axis.direction, noun, known))
        return tuple(found)


def ranges_exceeded(placement: Placement) -> dict[str, tuple[float, Range]]:
    """Return angle and range of joints that are beyond it by more than `RANGE_TOLERANCE` [rad]."""
    found: dict[str, tuple[float, Range]] = {}
    for name in placement.tree.kinematics.columns:
        joint, values = placement.tree.figure.joints[name], placement.displacements[name]
        for k in placement.tree.chains[name].rotations:
            low = None if joint.lower_limit is None else joint.lower_limit[k]
            high = None if joint.upper_limit is None else joint.upper_limit[k]
            known = -inf if low is None else low, inf if high is None else high
            angle = float(values[k])
            if range_excess(angle, known) > RANGE_TOLERANCE:
                found.setdefault(name, (angle, known))
    return found


def range_excess(angle: float, known: Range) -> float:
    """Return by how much an angle is beyond a range; negative within it [rad]."""
    return max(known[0] - angle, angle - known[1])


def _without_stops(own: JointSprings) -> JointSprings:
    axes = tuple(replace(axis, elastic=axis.laws_besides_stops) for axis in own.axes)
    return replace(own, axes=axes, translations=())


def _beyond(
    noun: str, angle: float, ends: Range | tuple[float | None, float | None], what: str
) -> Iterator[str]:
    """Yield a sentence on an angle beyond a range."""
    low, high = ends
    for end, excess in (
        (low, -1.0 if low is None else low - angle),
        (high, -1.0 if high is None else angle - high),
    ):
        if end is not None and excess > _ANGLE_ROUNDING:
            yield f"{noun} at {degrees(angle):.0f} deg is beyond {what}, {degrees(end):.0f} deg"
