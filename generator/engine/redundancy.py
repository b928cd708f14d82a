"""Which locks of loop-closing joints are needed: a planar loop of revolutes locks too much.

A singular Jacobian stops the solver, so rows that the rest of the system implies are left out.
"""

import numpy as np

from generator.chain import Chain
from generator.engine.joints import Lock, lock_rows, locks_of, thinned
from generator.frames import Array
from generator.posture.assemble import OpenLoopError, assemble
from generator.posture.placement import Placement, motion_maps, relative_motion_map

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
