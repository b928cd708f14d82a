"""A figure whose root is free: its joints to the ground give way to joints of six coordinates."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from generator.diagnostics import ModelError, spelling_hint
from generator.figure import (
    AxisKind,
    ContactSphere,
    Figure,
    Joint,
    JointAxis,
    Location,
    Rotation,
    Site,
    SiteRef,
    Vector,
)
from generator.joint_chain import build_chain
from generator.kinematics.placement import (
    Displacements,
    Placement,
    forward_kinematics,
    initial_displacements,
)
from generator.kinematics.tree import Tree, build_tree, build_valid_tree
from generator.rotations import Array, RotationSequence

FREE_SITE = "free frame"
"""Site of a free segment that its joint moves; no name in a file contains a blank."""


def _free_chain(*axes: Vector) -> tuple[JointAxis, ...]:
    return (
        *(JointAxis(AxisKind.ROTATION, axis) for axis in axes),
        *(JointAxis(AxisKind.TRANSLATION, axis) for axis in (_X, _Y, _Z)),
    )


_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

FREE_CHAINS = (_free_chain(_Z, _Y, _X), _free_chain(_Y, _Z, _X))
"""Rotation and translation of a free segment in the world, innermost first.

With rotation matrix R the first sequence is singular where R[0, 2] is 1 or -1, a quarter turn about
the vertical, and the second where R[0, 1] is, a quarter turn about z. Both are in one row of R, so
that any orientation is at least 45 deg away from the poles of one of them.
"""


def detach_root(figure: Figure, displacements: Displacements) -> tuple[Figure, dict[str, Array]]:
    """Return the figure without its joints to the ground, and its displacements in the same pose.

    Each part that was attached gets a joint of three rotations and three translations from the
    root's site to its first segment, named after that segment (with "free_" before it where a
    joint has that name already). The rotations are zero where the segment has its orientation in
    the figure's file; the translations are the position of its frame.

    Args:
        figure: attached to the ground.
        displacements: displacements of its joints [rad or m].
    """
    tree = build_tree(figure)
    poses = forward_kinematics(tree, displacements).poses
    file_poses = forward_kinematics(tree, initial_displacements(tree)).poses
    ground_joints = {
        name: joint
        for name, joint in figure.joints.items()
        if {joint.parent.segment, joint.child.segment} & figure.ground
    }
    remaining_joints = {
        name: joint for name, joint in figure.joints.items() if name not in ground_joints
    }
    moved = {name: np.asarray(displacements[name]) for name in remaining_joints}
    loose = set(figure.bodies)
    free: dict[str, Joint] = {}
    segments = dict(figure.segments)
    for first in _segments_next_to_ground(figure, ground_joints):
        if first not in loose:
            continue
        loose -= _connected_segments(first, remaining_joints)
        site = _unrotated_site(file_poses[first])
        pose = poses[first] @ site.pose_in_segment
        chain = max(FREE_CHAINS, key=lambda chain: _sine_from_pole(chain, pose))
        displacement = build_chain(chain).displacements(pose)
        name = first
        while name in figure.joints:
            name = f"free_{name}"
        free[name] = Joint(
            name,
            figure.root,
            SiteRef(first, FREE_SITE),
            chain,
            tuple(float(value) for value in displacement),
        )
        sites = {**segments[first].sites, FREE_SITE: site}
        segments[first] = replace(segments[first], sites=sites)
        moved[name] = displacement
    return replace(figure, segments=segments, joints={**free, **remaining_joints}), moved


def attaching_joints(figure: Figure) -> tuple[str, ...]:
    """Return the joints by which a figure stays attached to the ground.

    A joint with three translations lets its segment fall, and is not one of them.
    """
    return tuple(
        name
        for name, joint in figure.joints.items()
        if len({joint.parent.segment, joint.child.segment} & figure.ground) == 1
        and sum(any(axis.twist.linear) for axis in joint.chain) < 3
    )


def free_joints(figure: Figure) -> dict[str, Joint]:
    """Return the joints that `detach_root` has made, by name."""
    return {name: joint for name, joint in figure.joints.items() if joint.child.site == FREE_SITE}


def _unrotated_site(pose: Array) -> Site:
    """Return a site at a segment's origin with the world's axes where the segment is at `pose`."""
    sequence = RotationSequence((_Z, _Y, _X))
    angles = sequence.angles(pose[:3, :3].T)[::-1]
    return Site(FREE_SITE, Location((Rotation(cast("Vector", tuple(map(float, angles)))),)))


def _sine_from_pole(chain: Sequence[JointAxis], pose: Array) -> float:
    """Sine of the angle between the orientation of a pose and the poles of a free chain.

    Of two equal ones the first chain has a small advantage, so that rounding does not decide.
    """
    inner, outer = np.asarray(chain[0].axis), np.asarray(chain[2].axis)
    cosine = abs(float(outer @ pose[:3, :3] @ inner))
    return float(np.sqrt(max(0.0, 1.0 - cosine**2))) + (1e-6 if chain == FREE_CHAINS[0] else 0.0)


def free_joint_rates(
    joint: Joint, pose: Array, displacements: Array, centre_of_mass: Array, velocity: Array
) -> Array:
    """Return the displacement rates of a free segment with an angular and a linear velocity.

    Args:
        joint: joint of the segment, made by `detach_root`.
        pose: pose of the segment in the world, shape (4, 4).
        displacements: displacements of the joint, shape (6,) [rad or m].
        centre_of_mass: centre of mass of the segment in its frame, shape (3,) [m].
        velocity: angular velocity [rad/s] and velocity of the centre of mass [m/s], world axes,
            shape (6,).

    Returns:
        Rates, shape (6,) [rad/s or m/s].
    """
    angular, linear = velocity[:3], velocity[3:]
    centre = pose[:3, :3] @ centre_of_mass + pose[:3, 3]
    at_origin = linear - np.cross(angular, centre)
    twists = build_chain(joint.chain).twists(displacements)
    rates = np.linalg.solve(twists.T, np.concatenate([angular, at_origin]))
    return np.asarray(rates, dtype=float)


def lowest_point(placement: Placement, up: Array) -> float:
    """Height of the lowest point of the moving segments along the unit vector `up` [m].

    A point is a vertex of a segment's psurf, or a site of a segment without one.

    Raises:
        InputError: a psurf cannot be read.
    """
    from generator.geometry.read import read_segment_surface  # no other run reads surfaces

    figure = placement.tree.figure
    heights: list[float] = []
    for name, segment in figure.bodies.items():
        if segment.psurf is None:
            points = np.array([site.pose_in_segment[:3, 3] for site in segment.sites.values()])
        else:
            points = read_segment_surface(figure, segment).vertices
        pose = placement.poses[name]
        heights.append(float(np.min((points @ pose[:3, :3].T + pose[:3, 3]) @ up)))
    return min(heights)


def lowest_sphere_point(
    placement: Placement, spheres: Mapping[str, Sequence[ContactSphere]], up: Array
) -> float:
    """Height of the lowest point of the contact spheres along the unit vector `up` [m]."""
    return min(
        float((placement.poses[name] @ np.append(sphere.centre, 1.0))[:3] @ up) - sphere.radius
        for name, some in spheres.items()
        for sphere in some
    )


def lift_free_segments(placement: Placement, shift: Array) -> dict[str, Array]:
    """Return displacements that move a detached figure by a shift, shape (3,) [m]."""
    moved = dict(placement.displacements)
    for name in free_joints(placement.tree.figure):
        moved[name] = np.concatenate([moved[name][:3], moved[name][3:] + shift])
    return moved


def _segments_next_to_ground(figure: Figure, ground_joints: dict[str, Joint]) -> list[str]:
    """Return the moving segments next to the ground, in the order of their joints."""
    ends = [
        ref.segment
        for joint in ground_joints.values()
        for ref in (joint.parent, joint.child)
        if ref.segment not in figure.ground
    ]
    return list(dict.fromkeys(ends))


def _connected_segments(first: str, joints: dict[str, Joint]) -> set[str]:
    """Return all segments connected to `first` by joints."""
    connected = {first}
    grown = True
    while grown:
        grown = False
        for joint in joints.values():
            ends = {joint.parent.segment, joint.child.segment}
            if ends & connected and not ends <= connected:
                connected |= ends
                grown = True
    return connected


JointChains = Mapping[str, Sequence[JointAxis]]


def tree_for_motion(figure: Figure, chains: JointChains) -> Tree:
    """Return the tree that a motion moves: the figure's, or that of the figure with a free root.

    Args:
        figure: figure as its file describes it.
        chains: the factors of each joint of the motion.

    Raises:
        ModelError: the motion is of another figure.
        ModelError: no single joint can have the chain of a joint.
    """
    tree = build_tree(figure)
    if not tree.joints:
        raise ModelError("no segment of the figure moves, so it has no motion")
    if _has_chains(tree.figure, chains):
        return tree
    freed, _ = detach_root(figure, initial_displacements(tree))
    freed = _with_free_chains(freed, chains)
    if _has_chains(freed, chains):
        return build_valid_tree(freed)
    for name in chains:
        if name not in figure.joints and name not in freed.joints:
            hint = spelling_hint(name, figure.joints)
            raise ModelError(f"the motion moves joint `{name}`, unknown to the figure; {hint}")
    for name, joint in figure.joints.items():
        if name not in chains and name in freed.joints:
            raise ModelError(f"the motion has no joint `{name}`, which the figure has")
        if name in chains and tuple(chains[name]) != joint.chain:
            raise ModelError(f"joint `{name}` has different axes in the motion and in the figure")
    raise ModelError("the joints of the motion are not those of the figure")


def _with_free_chains(freed: Figure, chains: JointChains) -> Figure:
    """Return a detached figure with those of `FREE_CHAINS` that a motion has."""
    changed = {
        name: replace(joint, chain=tuple(chains[name]))
        for name, joint in free_joints(freed).items()
        if tuple(chains.get(name, ())) in FREE_CHAINS
    }
    return replace(freed, joints={**freed.joints, **changed})


def _has_chains(figure: Figure, chains: JointChains) -> bool:
    return {name: joint.chain for name, joint in figure.joints.items()} == {
        name: tuple(chain) for name, chain in chains.items()
    }


Joints = Mapping[str, Joint]


def settable_joints(figure: Figure, *, free_root: bool = False) -> Joints:
    """Return the joints whose displacements can be set, by name.

    With a free root, joints named after the detached segments replace those to the ground.
    """
    if free_root:
        figure, _ = detach_root(figure, initial_displacements(build_tree(figure)))
    return figure.joints
