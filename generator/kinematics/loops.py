"""Loop closure: the pose nearest to a requested one in which every loop is closed."""

from collections.abc import Mapping, Set

import numpy as np

from generator.diagnostics import MoverError
from generator.kinematics.placement import (
    Displacements,
    Placement,
    forward_kinematics,
    relative_jacobian,
    segment_jacobians,
    with_followers,
)
from generator.kinematics.tree import Tree
from generator.rotations import Array, wrap_angle

MAX_LOOP_GAP = 1e-9
"""Largest gap of a closed loop [m and rad]."""


class OpenLoopError(MoverError):
    """A pose opens a loop and cannot be closed, or a velocity opens one."""


def close_loops(
    tree: Tree, displacements: Displacements, fixed: Set[str] = frozenset()
) -> Placement:
    """Return the placement at `displacements`, and what follows them, with its loops closed.

    Without loops that is the requested pose. Otherwise the joints that are not `fixed` change as
    little as possible; the displacements of the closing joints follow from the pose.

    Args:
        tree: the figure.
        displacements: displacements of all joints [rad or m].
        fixed: names of the joints whose displacements must not change.

    Raises:
        OpenLoopError: no pose nearby closes the loops; the message names the joint and the gap.
    """
    displacements = with_followers(tree.figure, displacements)
    placement = forward_kinematics(tree, displacements)
    if not tree.closures:
        return placement
    followed = closing_displacements(placement, displacements)
    moved = [followed[name] - displacements[name] for name in followed.keys() & fixed]
    if np.max(np.abs(np.concatenate([_loop_gaps(placement), *moved]))) > MAX_LOOP_GAP:
        placement = _solve_loops(tree, displacements, fixed)
        followed = closing_displacements(placement, displacements)
    _check_loops_closed(placement, displacements, followed, fixed)
    return Placement(tree, {**placement.displacements, **followed}, placement.poses)


def closing_displacements(placement: Placement, near: Displacements) -> dict[str, Array]:
    """Displacements of the closing joints in a pose, the nearest to `near`."""
    return {
        joint.name: placement.tree.chains[joint.name].displacements(
            placement.pose_in_parent(joint), near[joint.name]
        )
        for joint in placement.tree.closures
    }


def _loop_gaps(placement: Placement) -> Array:
    """Gaps of all closing joints, six numbers each [rad and m]."""
    tree = placement.tree
    gaps = [
        tree.chains[joint.name].pose_residual(placement.pose_in_parent(joint))
        for joint in tree.closures
    ]
    return np.concatenate(gaps)


def _solve_loops(tree: Tree, target: Displacements, fixed: Set[str]) -> Placement:
    """Return the placement whose free joints are moved until the loops close."""
    from scipy.optimize import least_squares

    free = [b.joint for b in tree.joints if b.joint.name not in fixed and b.joint.chain]
    fixed_closures = [joint for joint in tree.closures if joint.name in fixed]
    cuts = np.cumsum([len(joint.chain) for joint in free])[:-1]

    def place(values: Array) -> Placement:
        parts = np.split(values, cuts) if free else []
        moved = {joint.name: part for joint, part in zip(free, parts, strict=True)}
        return forward_kinematics(tree, {**target, **moved})

    def residual(values: Array) -> Array:
        placement = place(values)
        turned = [
            tree.chains[joint.name].displacements(
                placement.pose_in_parent(joint), target[joint.name]
            )
            - target[joint.name]
            for joint in fixed_closures
        ]
        return np.concatenate([_loop_gaps(placement), *turned])

    start = np.concatenate([target[joint.name] for joint in free]) if free else np.zeros(0)
    if not free:
        return place(start)
    solution = least_squares(residual, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=200)
    # The solver may add multiples of 2 pi: take the equivalent pose nearest to the start.
    twists = [factor.twist for joint in free for factor in joint.chain]
    is_periodic = np.array([not any(twist.linear) for twist in twists], dtype=bool)
    change = np.asarray(solution.x, dtype=float) - start
    return place(start + np.where(is_periodic, wrap_angle(change), change))


def _check_loops_closed(
    placement: Placement, target: Displacements, closing: Mapping[str, Array], fixed: Set[str]
) -> None:
    """Raise OpenLoopError when a loop is open or a fixed closing joint has moved."""
    for joint in placement.tree.closures:
        gap = placement.tree.chains[joint.name].pose_residual(placement.pose_in_parent(joint))
        if np.max(np.abs(gap)) > MAX_LOOP_GAP:
            raise OpenLoopError(
                f"the pose opens the loop at joint {joint.name}: its sites stay "
                f"{1000.0 * float(np.linalg.norm(gap[3:])):.4g} mm and "
                f"{round(np.degrees(float(np.linalg.norm(gap[:3]))), 6):.3g} deg apart"
            )
        if joint.name in fixed:
            off = np.max(np.abs(closing[joint.name] - target[joint.name]), initial=0.0)
            if off > 1e-6:
                raise OpenLoopError(
                    f"joint {joint.name} closes a loop and cannot have its requested displacement"
                )


def consistent_rates(placement: Placement, rates: Displacements, fixed: Set[str]) -> Array:
    """Return rates of the tree's displacements that keep loops closed, (n,) [rad/s or m/s].

    Joints that are not `fixed` change by the least squares. Raises OpenLoopError when the fixed
    rates open a loop.
    """
    tree = placement.tree
    joints = [branch.joint for branch in tree.joints]
    requested = np.concatenate([np.zeros(0), *(rates[joint.name] for joint in joints)])
    if not tree.closures:
        return requested
    maps = segment_jacobians(placement)
    rows, targets = [np.zeros((0, requested.size))], [np.zeros(0)]
    for joint in tree.closures:
        motion = relative_jacobian(placement, maps, joint)
        twists = tree.chains[joint.name].twists(placement.displacements[joint.name])
        twists = twists_at_child(twists, placement.pose_in_parent(joint)[:3, 3]).T
        if joint.name in fixed:
            rows.append(motion)
            targets.append(twists @ rates[joint.name])
        else:
            blocked = np.eye(6) - twists @ np.linalg.pinv(twists)
            rows.append(blocked @ motion)
            targets.append(np.zeros(6))
    loops, target = np.vstack(rows), np.concatenate(targets)
    may_change = np.concatenate(
        [np.full(len(joint.chain), joint.name not in fixed) for joint in joints]
    )
    change = np.linalg.lstsq(loops[:, may_change], target - loops @ requested, rcond=1e-10)[0]
    result = requested.copy()
    result[may_change] += change
    if np.max(np.abs(loops @ result - target)) > 1e-9 * (
        1.0 + np.max(np.abs(requested), initial=0.0)
    ):
        names = ", ".join(joint.name for joint in tree.closures)
        raise OpenLoopError(f"the requested velocity opens the loop closed by {names}")
    return result


def twists_at_child(twists: Array, offset: Array) -> Array:
    """Return twists (n, 6) at the parent's origin referred to the child's site."""
    moved = twists.copy()
    moved[:, 3:] += np.cross(twists[:, :3], offset)
    return moved
