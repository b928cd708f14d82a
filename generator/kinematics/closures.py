"""Constraints that close the loops of a figure: the relative motions that its joints lock.

Joints that close a loop lock only the independent rows: a planar loop of revolutes would otherwise
be overconstrained, and the equations of motion would have a singular matrix.
"""

import numpy as np

from generator.joint_chain import AxisFlags, LockedAxes, locked_axes_from_chain
from generator.kinematics.loops import OpenLoopError, close_loops
from generator.kinematics.placement import Placement, relative_jacobian, segment_jacobians
from generator.rotations import Array


def constraint_jacobian(lock: LockedAxes, pose_in_parent: Array) -> Array:
    """Jacobian (n, 6) of the locked motions by the relative velocity (angular, linear).

    The velocity is that of the child's site relative to the parent, in the parent's site axes;
    `pose_in_parent` is the pose of the child's site in the parent's.
    """
    first = pose_in_parent[:3, :3] @ lock.frame if lock.from_child else lock.frame
    second = lock.frame if lock.from_child else pose_in_parent[:3, :3] @ lock.frame
    rows: list[Array] = []
    offset = pose_in_parent[:3, 3]
    for k in range(3):
        if lock.translations[k]:
            axis = first[:, k]
            # An axis of the child rotates with it.
            arm = np.cross(offset, axis) if lock.from_child else np.zeros(3)
            rows.append(np.concatenate([-arm, axis]))
    for k in range(3):
        if lock.rotations[k]:
            about = first[:, k]
            if lock.rotations == (0, 0, 1):
                about = np.cross(second[:, 1], first[:, 0])
            rows.append(np.concatenate([about, np.zeros(3)]))
    return np.array(rows).reshape(-1, 6)


def rotation_equations(locks: AxisFlags) -> list[tuple[int, int, int]]:
    """Return the equations of locked rotations, as Exudyn has them.

    The axis u of the first site stays perpendicular to the axis v of the second.

    Returns:
        Of each equation (u, v, number of its multiplier).
    """
    x, y, z = 0, 1, 2
    table = {
        (1, 1, 1): [(z, y, 0), (z, x, 1), (x, y, 2)],
        (0, 1, 1): [(x, y, 1), (x, z, 2)],
        (1, 0, 1): [(y, x, 0), (y, z, 2)],
        (1, 1, 0): [(z, x, 0), (z, y, 1)],
        (1, 0, 0): [(y, z, 0)],
        (0, 1, 0): [(x, z, 1)],
        (0, 0, 1): [(x, y, 2)],
        (0, 0, 0): [],
    }
    return table[locks]


def without(lock: LockedAxes, keep: list[bool]) -> LockedAxes:
    """Remove rows from a lock; `keep` is in the order of `constraint_jacobian`."""
    flags = iter(keep)
    x, y, z = (int(bool(on) and next(flags)) for on in lock.translations)
    a, b, c = (int(bool(on) and next(flags)) for on in lock.rotations)
    return LockedAxes(lock.frame, (x, y, z), (a, b, c), lock.from_child)


_INDEPENDENCE_TOLERANCE = 1e-7
"""Norm of a row's component orthogonal to the others below which it depends on them [m or 1]."""

_DISPLACEMENT_OFFSETS = (0.0, 0.13, -0.17)
"""Offsets of all displacements that give nearby closed poses [rad or m]: at a dead point of a loop
rows may be dependent in that pose only."""


def independent_constraints(placement: Placement) -> dict[str, tuple[LockedAxes, ...]]:
    """Return the locks of every joint; of loop-closing joints only the independent ones."""
    tree = placement.tree
    locks = {name: locked_axes_from_chain(chain) for name, chain in tree.chains.items()}
    best = max(
        (_independent_rows(pose) for pose in _nearby_closed_placements(placement)),
        key=lambda keep: sum(map(sum, keep.values())),
    )
    for joint in tree.closures:
        kept_rows = best[joint.name]
        remaining: list[LockedAxes] = []
        for lock in locks[joint.name]:
            width = sum(lock.translations) + sum(lock.rotations)
            remaining.append(without(lock, kept_rows[:width]))
            kept_rows = kept_rows[width:]
        locks[joint.name] = tuple(
            lock for lock in remaining if any(lock.translations + lock.rotations)
        )
    return locks


def _nearby_closed_placements(placement: Placement) -> list[Placement]:
    """Return nearby placements with closed loops, and the placement itself."""
    tree = placement.tree
    poses: list[Placement] = []
    for offset in _DISPLACEMENT_OFFSETS:
        displacements = {
            name: values + offset * np.cos(1.0 + np.arange(values.size))
            for name, values in placement.displacements.items()
        }
        try:
            poses.append(close_loops(tree, displacements) if offset else placement)
        except OpenLoopError:
            continue
    return poses


def _independent_rows(placement: Placement) -> dict[str, list[bool]]:
    """Flag the independent rows of each loop-closing joint."""
    tree = placement.tree
    maps = segment_jacobians(placement)
    basis = np.zeros((0, next(iter(maps.values())).shape[1]))
    keep: dict[str, list[bool]] = {}
    for joint in tree.closures:
        motion = relative_jacobian(placement, maps, joint)
        pose, locks = (
            placement.pose_in_parent(joint),
            locked_axes_from_chain(tree.chains[joint.name]),
        )
        rows = np.vstack([np.zeros((0, 6)), *(constraint_jacobian(lock, pose) for lock in locks)])
        rows = rows @ motion
        rows = rows - rows @ basis.T @ basis
        keep[joint.name] = [False] * len(rows)
        # The largest row comes first: it stays independent in most other poses.
        while rows.size and np.max(sizes := np.linalg.norm(rows, axis=1)) > _INDEPENDENCE_TOLERANCE:
            largest = int(np.argmax(sizes))
            keep[joint.name][largest] = True
            basis = np.vstack([basis, rows[largest] / sizes[largest]])
            rows = rows - np.outer(rows @ basis[-1], basis[-1])
    return keep
