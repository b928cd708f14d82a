"""Editing a pose: one coordinate, a limb, an arm or a whole side at a time, with undo and redo."""

import itertools
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from math import ceil, degrees, inf, isfinite, pi, radians
from pathlib import Path
from typing import assert_never

import numpy as np

from generator.diagnostics import ModelError, UsageError
from generator.figure import AxisKind, Figure, Joint, JointAxis
from generator.figure_file.write import write_pose
from generator.input_files.pose import POSE_FILE
from generator.kinematics.links import Coordinate, mirrored_name
from generator.kinematics.placement import (
    Displacements,
    Placement,
    forward_kinematics,
    site_pose,
)
from generator.kinematics.reach import Target, follow_and_close, reach
from generator.kinematics.shoulder import Side
from generator.kinematics.shoulder_pose import arm_latitude_and_longitude, pose_arm
from generator.kinematics.tree import Tree, build_tree
from generator.rotations import Array, pose_matrix, unit_axis
from generator.springs_file.axes import parallel_sign
from springs import AxisSpring, SpringSet
from springs.elastic import Range, common_valid_range, mirror_range, total_torque
from springs.published.range_of_motion import normal_range

MAX_UNDO_STEPS = 200

NO_SPRINGS = SpringSet()

DEFAULT_TRANSLATION_RANGE = 0.5
"""Range of a translation without limits, to both sides [m]."""

SLIDER_MARGIN = radians(15.0)
"""Angle by which a slider without limits goes beyond the normal range and the dead zone [rad]."""

MAX_DISPLACEMENT = 1e3
"""Largest displacement that is set [rad or m]."""

_PARALLEL = 1e-6
"""Largest distance between unit vectors that count as equal."""


class Mirroring(Enum):
    """Sides between which a pose is mirrored."""

    LEFT_TO_RIGHT = "left to right"
    RIGHT_TO_LEFT = "right to left"
    SWAP = "swap sides"


class PoseEditor:
    """A pose of a figure, with loops closed, and the poses before it."""

    def __init__(self, placement: Placement, springs: SpringSet = NO_SPRINGS) -> None:
        """Begin with a placement, to which `reset` returns; the springs name the motions."""
        self.tree: Tree = placement.tree
        self.figure = self.tree.figure
        self.placement = placement
        self._first = placement
        self._undo: list[Placement] = []
        self._redo: list[Placement] = []
        self._group: Hashable = None
        self._bounded_tree = build_tree(with_normal_limits(self.figure, springs))

    @property
    def displacements(self) -> Displacements:
        """Displacements of the present pose [rad or m]."""
        return self.placement.displacements

    @property
    def can_undo(self) -> bool:
        """Return whether there is a pose before the present one."""
        return bool(self._undo)

    @property
    def can_redo(self) -> bool:
        """Return whether an undone pose can be restored."""
        return bool(self._redo)

    def change(self, placement: Placement, group: Hashable = None) -> None:
        """Make a placement the present one.

        Changes in a row of one group that is not None are undone together.
        """
        if group is None or group != self._group:
            self._undo.append(self.placement)
            del self._undo[:-MAX_UNDO_STEPS]
        self._group = group
        self._redo.clear()
        self.placement = placement

    def end_group(self) -> None:
        """Let the next change be undone alone."""
        self._group = None

    def undo(self) -> None:
        """Return to the pose before the last change, if there is one."""
        self._restore(self._undo, self._redo)

    def redo(self) -> None:
        """Return to the pose before the last `undo`, if there is one."""
        self._restore(self._redo, self._undo)

    def _restore(self, source: list[Placement], target: list[Placement]) -> None:
        if source:
            target.append(self.placement)
            self.placement = source.pop()
        self._group = None

    def reset(self) -> None:
        """Return to the first pose."""
        self.change(self._first)

    def take_over(self, displacements: Displacements) -> None:
        """Take over displacements of the joints that this figure has, such as those of a motion."""
        known = {
            name: np.asarray(values)
            for name, values in displacements.items()
            if name in self.figure.joints and len(values) == len(self.figure.joints[name].chain)
        }
        if any(not np.array_equal(values, self.displacements[name])
               for name, values in known.items()):  # fmt: skip
            self.set(known, group="taken over")

    def set(self, displacements: Displacements, fixed: bool = True, group: Hashable = None) -> None:
        """Change the displacements of some joints [rad or m]; loops close.

        Unless they are fixed, they change as well to close loops. Raises OpenLoopError if no pose
        nearby does.
        """
        joints = frozenset(displacements) if fixed else frozenset[str]()
        new = {**self.displacements, **displacements}
        self.change(follow_and_close(self.tree, new, joints), group)

    def set_coordinate(self, coordinate: Coordinate, value: float) -> None:
        """Change one displacement [rad or m].

        Raises UsageError for a value that is no number or too large, and as `set` does.
        """
        if not (isfinite(value) and abs(value) <= MAX_DISPLACEMENT):
            raise UsageError(f"{coordinate}: {value:g} is not a displacement")
        row = np.array(self.displacements[coordinate.joint], dtype=float)
        row[coordinate.index] = value
        self.set({coordinate.joint: row}, group=coordinate)

    def drag(self, target: Target, locked: frozenset[str]) -> None:
        """Move a point of a segment towards a target; `locked` joints do not move.

        Hinges without limits stay in their normal range of motion, so that an elbow bends forwards.
        """
        moved = reach(self._bounded_tree, self.displacements, target, locked)
        placement = Placement(self.tree, moved.displacements, moved.poses)
        self.change(placement, ("drag", target.segment))

    def pose_arm(self, side: Side, latitude: float, longitude: float) -> None:
        """Point the elbow of an arm to a latitude and longitude in the torso's frame [rad].

        Raises ModelError if the figure has no such arm, or the direction is out of range.
        """
        pose = pose_arm(self.figure, side, latitude, longitude)
        self.set(pose.displacements, group=("arm", side))

    def arm_direction(self, side: Side) -> tuple[float, float] | None:
        """Latitude and longitude of an elbow [rad]; None if the figure has no such arm."""
        try:
            return arm_latitude_and_longitude(self.placement, side)
        except ModelError:
            return None

    def mirror(self, mirroring: Mirroring) -> None:
        """Mirror the pose of one side to the other one, or exchange the sides of the whole pose."""
        new = dict[str, Array]()
        for name, image in self._images.items():
            match mirroring:
                case Mirroring.LEFT_TO_RIGHT:
                    wanted = "left" in name and image.joint != name
                case Mirroring.RIGHT_TO_LEFT:
                    wanted = "right" in name and image.joint != name
                case Mirroring.SWAP:
                    wanted = True
                case _:
                    assert_never(mirroring)
            if wanted:
                new[image.joint] = image.displacements(self.tree, self.displacements)
        self.set(new, fixed=False)

    @property
    def can_mirror(self) -> bool:
        """Return whether the figure has joints of two sides."""
        return any(image.joint != name for name, image in self._images.items())

    @cached_property
    def _images(self) -> "dict[str, _Image]":
        """The mirror image of each joint that has one."""
        zeros = {name: np.zeros(len(joint.chain)) for name, joint in self.figure.joints.items()}
        zero = forward_kinematics(self.tree, zeros)
        forward = {branch.joint.name: branch.parent_is_inboard for branch in self.tree.joints}
        images: dict[str, _Image] = {}
        for name, joint in self.figure.joints.items():
            opposite = mirrored_name(name)
            other = self.figure.joints.get(opposite)
            if other is None or not joint.chain:
                continue
            axes, image = (site_pose(zero, one, "parent")[:3, :3] for one in (joint, other))
            same_sense = forward.get(name, True) == forward.get(opposite, True)
            turn = image.T @ np.diag([1.0, -1.0, -1.0]) @ axes
            found = _find_image(joint, other, turn if same_sense else -turn)
            if found is not None:
                images[name] = found
        return images

    def load(self, path: Path) -> None:
        """Take over the pose in a file; joints that it does not name stay.

        Raises InputError for a file that is not a pose of this figure, and as `set` does.
        """
        pose = POSE_FILE.parse_file(path, self.figure).require_value()
        self.set(pose, fixed=False)

    def text(self) -> str:
        """Return the pose as the text of a pose file."""
        return write_pose(
            self.figure, {n: list(map(float, v)) for n, v in self.displacements.items()}
        )


@dataclass(frozen=True)
class _Image:
    """The mirror image of a joint.

    Attributes:
        joint: name of the image.
        source: name of the joint.
        signs: signs of the displacements; None for the general case of three rotations.
        turn: matrix (3, 3) from the axis of a rotation to that of its image; a rotation, or minus
            one where the parent of only one of both joints is nearer to the root.
    """

    joint: str
    source: str
    signs: Array | None
    turn: Array

    def displacements(self, tree: Tree, displacements: Displacements) -> Array:
        """Return the displacements of the image [rad or m]."""
        values = np.asarray(displacements[self.source])
        if self.signs is not None:
            return self.signs * values
        rotation = tree.chains[self.source].pose(values)[:3, :3]
        image = self.turn @ rotation @ self.turn.T
        if np.linalg.det(self.turn) < 0.0:
            image = image.T
        pose = pose_matrix(image, np.zeros(3))
        return tree.chains[self.joint].displacements(pose, displacements[self.joint])


def _find_image(joint: Joint, other: Joint, turn: Array) -> _Image | None:
    """Return the image of a joint in another one; None if their chains are not images."""
    kinds = [factor.kind for factor in joint.chain]
    signs = [
        _image_sign(one, two, turn) for one, two in zip(joint.chain, other.chain, strict=False)
    ]
    if kinds == [factor.kind for factor in other.chain] and all(signs):
        return _Image(other.name, joint.name, np.array(signs, dtype=float), turn)
    balls = [[factor.kind for factor in each.chain] for each in (joint, other)]
    if all(each == [AxisKind.ROTATION] * 3 for each in balls):
        return _Image(other.name, joint.name, None, turn)
    return None


def _image_sign(one: JointAxis, other: JointAxis, turn: Array) -> int:
    """+1 or -1 if the mirror image of a motion is one about `other`, 0 if it is not."""
    angular, linear = np.array(one.twist) @ turn.T
    image = np.array([angular, -linear])
    for sign in (1, -1):
        if np.linalg.norm(image - sign * np.array(other.twist)) < _PARALLEL:
            return sign
    return 0


def limb_joints(tree: Tree, segment: str) -> tuple[str, ...]:
    """Return the joints between a segment and the nearest one from which the tree branches.

    With closed loops they are all joints that move the segment.
    """
    inward = {branch.outboard: branch for branch in tree.joints}
    outward: dict[str, int] = {}
    for branch in tree.joints:
        outward[branch.inboard] = outward.get(branch.inboard, 0) + 1
    names: list[str] = []
    while (branch := inward.get(segment)) is not None:
        names.append(branch.joint.name)
        segment = branch.inboard
        if outward[segment] > 1 and not tree.closures:
            break
    return tuple(names)


def end_segments(tree: Tree) -> tuple[str, ...]:
    """Return the segments from which no further joint leads outwards: hands, feet, the head."""
    inner = {branch.inboard for branch in tree.joints} | tree.figure.ground
    loops = {ref.segment for joint in tree.closures for ref in joint.ends} - tree.figure.ground
    return tuple(
        branch.outboard
        for branch in tree.joints
        if branch.outboard not in inner or branch.outboard in loops
    )


def drag_point(tree: Tree, segment: str) -> Array:
    """Return the point by which a segment is dragged, in its frame [m], shape (3,).

    It is the site that is farthest from the joint that carries the segment, or the centre of mass
    if that is farther.
    """
    branch = next(each for each in tree.joints if each.outboard == segment)
    ends = {ref.segment: ref for ref in branch.joint.ends}
    start = tree.figure.site(ends[segment]).pose_in_segment[:3, 3]
    points = [site.pose_in_segment[:3, 3] for site in tree.figure.segments[segment].sites.values()]
    return max(points, key=lambda point: float(np.linalg.norm(point - start)))


@dataclass(frozen=True)
class CoordinateRange:
    """The range of a slider and what is known of the coordinate.

    Attributes:
        low: end of the slider [rad or m].
        high: the same.
        limits: limits of the figure [rad or m]; infinite where there is none, or None.
        normal: published range of motion [rad], or None.
        dead_zone: dead zone in which the springs have no moment [rad], or None.
        measured: range in which the law was measured [rad], or None.
        motion: name of the positive or negative displacement, or "".
        sign: +1 where `motion` names the positive displacement, else -1.
    """

    low: float
    high: float
    limits: Range | None = None
    normal: Range | None = None
    dead_zone: Range | None = None
    measured: Range | None = None
    motion: str = ""
    sign: int = 1


def coordinate_range(joint: Joint, index: int, springs: SpringSet) -> CoordinateRange:
    """Return the range of one displacement of a joint, with what the springs know of it."""
    factor = joint.chain[index]
    lower = -inf if joint.lower_limit is None else joint.lower_limit[index]
    upper = inf if joint.upper_limit is None else joint.upper_limit[index]
    limits = None if (lower, upper) == (-inf, inf) else (lower, upper)
    if not factor.units.is_angle:
        width = DEFAULT_TRANSLATION_RANGE
        low = lower if isfinite(lower) else min(-width, upper - 2.0 * width)
        high = upper if isfinite(upper) else max(width, lower + 2.0 * width)
        return CoordinateRange(low, high, limits)
    spring, sign = _spring_about(joint, factor, springs)
    normal = dead_zone = measured = None
    motion = ""
    if spring is not None:
        motion = spring.motion
        ends = [None if end is None else end.angle for end in normal_range(joint.name, motion)]
        if ends != [None, None]:
            normal = (-inf if ends[0] is None else ends[0], inf if ends[1] is None else ends[1])
        dead_zone, measured = spring_dead_zone(spring), common_valid_range(spring.elastic)
        if sign < 0:
            normal, dead_zone, measured = map(mirror_range, (normal, dead_zone, measured))
    known = [end for each in (normal, dead_zone, measured) for end in each or ()]
    low = lower if isfinite(lower) else _slider_end(normal and normal[0], known, -1.0)
    high = upper if isfinite(upper) else _slider_end(normal and normal[1], known, 1.0)
    return CoordinateRange(low, high, limits, normal, dead_zone, measured, motion, sign)


def with_normal_limits(figure: Figure, springs: SpringSet) -> Figure:
    """Return a figure whose hinges without limits have their normal range of motion instead."""
    bounded: list[Joint] = []
    for joint in figure.joints.values():
        if len(joint.chain) == 1 and joint.lower_limit is None and joint.upper_limit is None:
            normal = coordinate_range(joint, 0, springs).normal
            if normal is not None:
                low, high = normal
                bounded.append(replace(joint, lower_limit=(low,), upper_limit=(high,)))
    return figure.with_parts(*bounded)


def _slider_end(normal: float | None, known: Sequence[float], sign: float) -> float:
    """Return the end of a slider without a limit: beyond all that is known, else half a turn."""
    if normal is None or not isfinite(normal):
        return sign * pi
    farthest = max(sign * end for end in known if isfinite(end))
    return sign * min(radians(5.0 * ceil(degrees(farthest + SLIDER_MARGIN) / 5.0 - 1e-9)), pi)


def _spring_about(
    joint: Joint, factor: JointAxis, springs: SpringSet
) -> tuple[AxisSpring | None, int]:
    """Return the spring about an axis of a joint, and whether its direction is that axis's."""
    own = springs.joints.get(joint.name)
    for spring in own.axes if own is not None else ():
        sign = parallel_sign(spring.direction, unit_axis(factor.axis))
        if sign:
            return spring, sign
    return None, 1


def spring_dead_zone(spring: AxisSpring) -> Range | None:
    """Return the widest interval between breakpoints in which a spring has no torque [rad]."""
    laws = spring.laws_besides_stops
    corners = sorted({corner for law in laws for corner in law.breakpoints if isfinite(corner)})
    zone: Range | None = None
    for low, high in itertools.pairwise(corners):
        inside = np.linspace(low, high, 9)[1:-1]
        if np.any(np.asarray(total_torque(laws, inside)) != 0.0):
            continue
        zone = (zone[0], high) if zone is not None and zone[1] == low else (low, high)
    return zone
