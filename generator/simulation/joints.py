"""The constraints of a joint: which relative motions Exudyn's generic joint locks.

A chain's turns and slides each leave some axes free. The axes to lock are the coordinate axes of a
joint frame; a revolute is turned so that it is about z (the thesis's `zifyjoint`). Where turns and
slides ask for different frames the joint becomes two items, one locking translations and one
locking rotations.

Which locks of loop-closing joints are needed: a planar loop of revolutes locks too much.

A singular Jacobian stops the solver, so rows that the rest of the system implies are left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from generator.figure import Joint
from generator.joint_chain import Chain
from generator.kinematics.loops import OpenLoopError, assemble
from generator.kinematics.placement import Placement, motion_maps, relative_motion_map
from generator.rotations import Array, frame_with_z, homogeneous, inverse_pose, unit
from generator.simulation.bodies import add_marker
from generator.simulation.exudyn_api import Index, MainSystem, items, unused_name

Locks = tuple[int, int, int]

FREE: Locks = (0, 0, 0)
LOCKED: Locks = (1, 1, 1)


@dataclass(frozen=True)
class Lock:
    """What one generic joint locks, in a frame common to both sites at zero displacement.

    Attributes:
        frame: axes of the joint frame in the site's axes, shape (3, 3).
        translations: locked along x, y, z of the frame of the first marker.
        rotations: locked about x, y, z.
        from_child: whether the first marker is the child's, so that slides are along its axes.
        rest: pose (4, 4) of the child's site in the parent's in which the locked ones are zero.
    """

    frame: Array
    translations: Locks
    rotations: Locks
    from_child: bool = False
    rest: Array = field(default_factory=lambda: np.eye(4))


def whole_lock(between: Array) -> Lock:
    """The lock of a joint that stays in the pose (4, 4) of the child's site in the parent's."""
    return Lock(np.eye(3), LOCKED, LOCKED, rest=between)


def locks_of(chain: Chain) -> tuple[Lock, ...]:
    """The locks that leave just the chain's freedoms."""
    turn_frame, rotations = _rotation_lock(chain)
    slide_frame, translations = _translation_lock(chain)
    inside = not chain.slides_are_outside
    if translations in (FREE, LOCKED):
        lock = Lock(turn_frame, translations, rotations)
        return () if lock.translations == lock.rotations == FREE else (lock,)
    if rotations in (FREE, LOCKED):
        return (Lock(slide_frame, translations, rotations, inside),)
    return (Lock(slide_frame, translations, FREE, inside), Lock(turn_frame, FREE, rotations))


def _rotation_lock(chain: Chain) -> tuple[Array, Locks]:
    axes = [unit(axis) for axis in chain.turn_axes]
    if len(axes) == 0:
        return np.eye(3), LOCKED
    if len(axes) == 1:
        return frame_with_z(axes[0]), (1, 1, 0)
    if len(axes) == 2:
        # Exudyn's third rotation lock alone keeps the first marker's x across the second's y.
        inner, outer = axes
        return np.stack([outer, inner, np.cross(outer, inner)], axis=1), (0, 0, 1)
    return np.eye(3), FREE


def _translation_lock(chain: Chain) -> tuple[Array, Locks]:
    axes = [unit(chain.factors[k].axis) for k in chain.slides]
    if len(axes) == 0:
        return np.eye(3), LOCKED
    if len(axes) == 1:
        return frame_with_z(axes[0]), (1, 1, 0)
    if len(axes) == 2:
        return frame_with_z(np.cross(axes[0], axes[1])), (0, 0, 1)
    return np.eye(3), FREE


def lock_rows(lock: Lock, between: Array) -> Array:
    """Rows (n, 6) that give the rates of the locked motions from (angular, linear) motion.

    The motion is the child's relative to the parent in the parent's site axes, linear at the
    child's site; `between` is the pose of the child's site in the parent's.
    """
    first = between[:3, :3] @ lock.frame if lock.from_child else lock.frame
    second = lock.frame if lock.from_child else between[:3, :3] @ lock.frame
    rows: list[Array] = []
    offset = between[:3, 3]
    for k in range(3):
        if lock.translations[k]:
            axis = first[:, k]
            # Slides along the child's axes: the axis itself turns with the child.
            arm = np.cross(offset, axis) if lock.from_child else np.zeros(3)
            rows.append(np.concatenate([-arm, axis]))
    for k in range(3):
        if lock.rotations[k]:
            about = first[:, k]
            if lock.rotations == (0, 0, 1):
                about = np.cross(second[:, 1], first[:, 0])
            rows.append(np.concatenate([about, np.zeros(3)]))
    return np.array(rows).reshape(-1, 6)


def thinned(lock: Lock, keep: list[bool]) -> Lock:
    """The lock without the rows (in the order of `lock_rows`) that are not kept."""
    flags = iter(keep)
    x, y, z = (int(bool(on) and next(flags)) for on in lock.translations)
    a, b, c = (int(bool(on) and next(flags)) for on in lock.rotations)
    return Lock(lock.frame, (x, y, z), (a, b, c), lock.from_child)


@dataclass(frozen=True)
class Constraint:
    """A lock as it stands in the system: the Exudyn item and what it locks."""

    item: Index
    lock: Lock

    @property
    def is_ball(self) -> bool:
        """Whether the item is Exudyn's spherical joint, which tells its force in world axes."""
        return (self.lock.translations, self.lock.rotations) == (LOCKED, FREE)


def add_constraints(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    joint: Joint,
    locks: tuple[Lock, ...],
) -> tuple[Constraint, ...]:
    """The constraint items of one joint: Exudyn's own spherical and revolute where they fit."""
    figure = placement.tree.figure
    added: list[Constraint] = []
    for lock in locks:
        turn = homogeneous(lock.frame, np.zeros(3))
        poses = {
            joint.parent: figure.site(joint.parent).pose_in_segment,
            joint.child: figure.site(joint.child).pose_in_segment @ inverse_pose(lock.rest),
        }
        ends = (joint.child, joint.parent) if lock.from_child else (joint.parent, joint.child)
        markers = [
            add_marker(mbs, placement, bodies, ref.segment, poses[ref] @ turn) for ref in ends
        ]
        name = unused_name(mbs, joint.name)
        added.append(Constraint(mbs.AddObject(_item(name, markers, lock)), lock))
    return tuple(added)


def _item(name: str, markers: list[Index], lock: Lock) -> Any:
    """The Exudyn joint that locks just this, with as few equations as there are."""
    if lock.translations == LOCKED and lock.rotations == FREE:
        return items.ObjectJointSpherical(name=name, markerNumbers=markers)
    if lock.translations == LOCKED and lock.rotations == (1, 1, 0):
        return items.ObjectJointRevoluteZ(name=name, markerNumbers=markers)
    return items.ObjectJointGeneric(
        name=name,
        markerNumbers=markers,
        constrainedAxes=[*lock.translations, *lock.rotations],
    )


_DEPENDENT = 1e-7
"""What is left of a row across the others when they imply it [m or 1]."""

_TRIES = (0.0, 0.13, -0.17)
"""Turns of all displacements from which closed poses near by are looked for [rad or m]: at a dead
point of the loop rows depend on each other only for a moment."""


def needed_locks(placement: Placement) -> dict[str, tuple[Lock, ...]]:
    """The locks of every joint; of closing joints only those that are independent."""
    tree = placement.tree
    locks = {name: locks_of(chain) for name, chain in tree.chains.items()}
    if not tree.closures:
        return locks
    best = max((_independent(pose) for pose in _closed_poses(placement)), key=_count)
    for joint in tree.closures:
        keep = best[joint.name]
        cut: list[Lock] = []
        for lock in locks[joint.name]:
            width = sum(lock.translations) + sum(lock.rotations)
            cut.append(thinned(lock, keep[:width]))
            keep = keep[width:]
        locks[joint.name] = tuple(lock for lock in cut if any(lock.translations + lock.rotations))
    return locks


def _count(keep: dict[str, list[bool]]) -> int:
    return sum(sum(flags) for flags in keep.values())


def _closed_poses(placement: Placement) -> list[Placement]:
    """Poses in which the loops are closed, near the given one."""
    tree = placement.tree
    poses: list[Placement] = []
    for turn in _TRIES:
        moved = {
            name: values + turn * np.cos(1.0 + np.arange(values.size))
            for name, values in placement.displacements.items()
        }
        try:
            poses.append(assemble(tree, moved) if turn else placement)
        except OpenLoopError:
            continue
    return poses


def _independent(placement: Placement) -> dict[str, list[bool]]:
    """For each closing joint, which of its rows no other row implies."""
    tree = placement.tree
    maps = motion_maps(placement)
    basis = np.zeros((0, next(iter(maps.values())).shape[1]))
    keep: dict[str, list[bool]] = {}
    for joint in tree.closures:
        motion = relative_motion_map(placement, maps, joint)
        left = _all_rows(tree.chains[joint.name], placement.between(joint)) @ motion
        left = left - left @ basis.T @ basis
        keep[joint.name] = [False] * len(left)
        # The row with most to say comes first: it is the last to fall silent in other poses.
        while left.size and np.max(sizes := np.linalg.norm(left, axis=1)) > _DEPENDENT:
            most = int(np.argmax(sizes))
            keep[joint.name][most] = True
            basis = np.vstack([basis, left[most] / sizes[most]])
            left = left - np.outer(left @ basis[-1], basis[-1])
    return keep


def _all_rows(chain: Chain, between: Array) -> Array:
    rows = [lock_rows(lock, between) for lock in locks_of(chain)]
    return np.vstack(rows) if rows else np.zeros((0, 6))
