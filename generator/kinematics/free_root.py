"""A figure whose root is free: its joints to the ground give way to joints of six coordinates."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from generator.diagnostics import ModelError, spelling_hint
from generator.figure import AxisKind, Figure, Joint, JointAxis, Site, SiteRef
from generator.joint_chain import build_chain
from generator.kinematics.placement import (
    Displacements,
    forward_kinematics,
    initial_displacements,
)
from generator.kinematics.tree import Tree, build_tree
from generator.rotations import Array

_FRAME_SITE = "segment frame"
"""Site at the segment's own frame; no name in a file contains a blank."""

FREE_CHAIN = (
    JointAxis(AxisKind.ROTATION, (1.0, 0.0, 0.0)),
    JointAxis(AxisKind.ROTATION, (0.0, 1.0, 0.0)),
    JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0)),
    JointAxis(AxisKind.TRANSLATION, (1.0, 0.0, 0.0)),
    JointAxis(AxisKind.TRANSLATION, (0.0, 1.0, 0.0)),
    JointAxis(AxisKind.TRANSLATION, (0.0, 0.0, 1.0)),
)
"""Rotation and translation in the world."""


def detach_root(figure: Figure, displacements: Displacements) -> tuple[Figure, dict[str, Array]]:
    """Return the figure without its joints to the ground, and its displacements in the same pose.

    Each part that was attached gets a joint of three rotations and three translations from the
    root's site to its first segment, named after that segment (with "free " before it where a
    joint has that name already): its pose in the world.

    Args:
        figure: attached to the ground.
        displacements: of its joints [rad or m].
    """
    poses = forward_kinematics(build_tree(figure), displacements).poses
    world = poses[figure.root.segment] @ figure.site(figure.root).pose_in_segment
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
        pose = np.linalg.inv(world) @ poses[first]
        displacement = build_chain(FREE_CHAIN).displacements(pose)
        name = first
        while name in remaining_joints:
            name = f"free {name}"
        free[name] = Joint(
            name,
            figure.root,
            SiteRef(first, _FRAME_SITE),
            FREE_CHAIN,
            tuple(float(value) for value in displacement),
        )
        sites = {**segments[first].sites, _FRAME_SITE: Site(_FRAME_SITE)}
        segments[first] = replace(segments[first], sites=sites)
        moved[name] = displacement
    return replace(figure, segments=segments, joints={**free, **remaining_joints}), moved


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
        figure: as its file describes it.
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
    if _has_chains(freed, chains):
        return build_tree(freed)
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


def _has_chains(figure: Figure, chains: JointChains) -> bool:
    return {name: joint.chain for name, joint in figure.joints.items()} == {
        name: tuple(chain) for name, chain in chains.items()
    }
