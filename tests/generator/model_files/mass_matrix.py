"""The mass matrix of a figure by the motions of its segments."""

import numpy as np

from generator.figure import Figure
from generator.kinematics.placement import forward_kinematics, segment_jacobians
from generator.kinematics.tree import build_tree


def mass_matrix(
    of: Figure, values: dict[str, np.ndarray]
) -> tuple[list[tuple[str, int]], np.ndarray]:
    """Joint and place of each displacement of the tree, and the mass matrix in this order."""
    tree = build_tree(of)
    order = [
        (branch.joint.name, k) for branch in tree.joints for k in range(len(branch.joint.chain))
    ]
    placement = forward_kinematics(tree, values)
    expected = np.zeros((len(order), len(order)))
    maps = segment_jacobians(placement)
    for segment in of.bodies.values():
        assert segment.centre_of_mass is not None
        assert segment.inertia is not None
        assert segment.mass is not None
        pose, motion = placement.poses[segment.name], maps[segment.name]
        turn = pose[:3, :3]
        centre = turn @ segment.centre_of_mass + pose[:3, 3]
        velocity = motion[3:] + np.cross(motion[:3], centre, axisa=0, axisc=0)
        inertia = turn @ np.diag(segment.inertia) @ turn.T
        expected += segment.mass * velocity.T @ velocity + motion[:3].T @ inertia @ motion[:3]
    return order, expected
