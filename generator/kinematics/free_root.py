"""A figure let go: its joints to the ground give way to a joint of six freedoms."""

from dataclasses import replace

import numpy as np

from generator.figure import AxisKind, Figure, Joint, JointAxis, Site, SiteRef
from generator.joint_chain import build_chain
from generator.kinematics.placement import Displacements, forward_kinematics
from generator.kinematics.tree import build_tree
from generator.rotations import Array

_FRAME_SITE = "segment frame"
"""A site at the segment's own frame; the blank keeps it apart from every written name."""

FREE_CHAIN = (
    JointAxis(AxisKind.ROTATION, (1.0, 0.0, 0.0)),
    JointAxis(AxisKind.ROTATION, (0.0, 1.0, 0.0)),
    JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0)),
    JointAxis(AxisKind.TRANSLATION, (1.0, 0.0, 0.0)),
    JointAxis(AxisKind.TRANSLATION, (0.0, 1.0, 0.0)),
    JointAxis(AxisKind.TRANSLATION, (0.0, 0.0, 1.0)),
)
"""Turn in the world, then shift along the world's axes."""


def detach_root(figure: Figure, displacements: Displacements) -> tuple[Figure, dict[str, Array]]:
    """The figure without its joints to the ground, and its displacements in the same pose.

    Each part that loses its hold gets a joint of three rotations and three translations from the
    root's site to its first segment, named after that segment (with "free " before it where a
    joint has that name already): its pose in the world.

    Args:
        figure: a figure held by the ground.
        displacements: of its joints [rad or m].
    """
    poses = forward_kinematics(build_tree(figure), displacements).poses
    world = poses[figure.root.segment] @ figure.site(figure.root).pose_in_segment
    held = {
        name: joint
        for name, joint in figure.joints.items()
        if {joint.parent.segment, joint.child.segment} & figure.ground
    }
    kept = {name: joint for name, joint in figure.joints.items() if name not in held}
    moved = {name: np.asarray(displacements[name]) for name in kept}
    loose = set(figure.bodies)
    free: dict[str, Joint] = {}
    segments = dict(figure.segments)
    for first in _segments_next_to_ground(figure, held):
        if first not in loose:
            continue
        loose -= _connected_segments(first, kept)
        pose = np.linalg.inv(world) @ poses[first]
        displacement = build_chain(FREE_CHAIN).displacements(pose)
        name = first
        while name in kept:
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
    return replace(figure, segments=segments, joints={**free, **kept}), moved


def _segments_next_to_ground(figure: Figure, held: dict[str, Joint]) -> list[str]:
    """The moving segments next to the ground, in the order of their joints."""
    ends = [
        ref.segment
        for joint in held.values()
        for ref in (joint.parent, joint.child)
        if ref.segment not in figure.ground
    ]
    return list(dict.fromkeys(ends))


def _connected_segments(first: str, joints: dict[str, Joint]) -> set[str]:
    """All segments that hang together with `first`."""
    together = {first}
    grown = True
    while grown:
        grown = False
        for joint in joints.values():
            ends = {joint.parent.segment, joint.child.segment}
            if ends & together and not ends <= together:
                together |= ends
                grown = True
    return together
