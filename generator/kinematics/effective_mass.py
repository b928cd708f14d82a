"""The mass that a figure opposes to a short blow at a point, along a direction.

In a blow much shorter than all other motion the impulse p alone changes the rates q' of the joints:
M q' = J^T n p, so that the point moves along n by p n^T J M^-1 J^T n, and the effective mass is

    1 / (n^T J M^-1 J^T n)

with the mass matrix M of the figure in its pose and the Jacobian J of the point: an element of the
operational-space inertia of Khatib (IEEE J. Robot. Autom. 3:43-53, 1987).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import ModelError
from generator.figure import Figure, Segment
from generator.kinematics.free_root import detach_root
from generator.kinematics.placement import (
    Placement,
    checked_joint_values,
    forward_kinematics,
    initial_displacements,
    segment_jacobians,
)
from generator.kinematics.tree import build_tree
from generator.rotations import Array, cross_matrix, unit_vector

HEAD = "head"
"""Segment of a person whose effective mass its description states."""

BLOWS: Mapping[str, tuple[float, float, float]] = {
    "crown": (0.0, 0.0, -1.0),
    "front_or_back": (1.0, 0.0, 0.0),
    "side": (0.0, 1.0, 0.0),
}
"""Directions of blows to the head of a person in its axes: x forward, y left, z up."""


def effective_mass(
    figure: Figure,
    segment: str,
    point: ArrayLike,
    direction: ArrayLike,
    displacements: Mapping[str, ArrayLike] | None = None,
) -> float:
    """Return the mass that a figure free of the ground opposes to a short blow to a segment [kg].

    All joints move freely, also along their translations: springs, damping and limits do not act in
    so short a time.

    Args:
        figure: figure with masses; its loops are open.
        segment: name of the segment that is hit.
        point: point on the line of the blow in the segment's axes, shape (3,) [m].
        direction: direction of the blow in these axes, shape (3,), of any length.
        displacements: displacements of joints that differ from the figure's own [rad or m].

    Raises:
        ModelError: the segment does not move, a moving segment lacks mass, inertia or centre, point
            or direction are not three finite numbers, or displacements do not fit their joint.
        UnknownNameError: the figure has no such joint.
    """
    if segment not in figure.bodies:
        raise ModelError(f"segment `{segment}` does not move")
    for name, values in (("point", point), ("direction", direction)):
        vector = np.asarray(values, dtype=float)
        if vector.shape != (3,) or not np.all(np.isfinite(vector)):
            raise ModelError(f"the {name} of a blow has three finite numbers, not {values}")
    if not np.any(direction):
        raise ModelError("the direction of a blow is not zero")
    own = checked_joint_values(figure, displacements or {})
    start = {**initial_displacements(build_tree(figure)), **own}
    freed, moved = detach_root(figure, start)
    placement = forward_kinematics(build_tree(freed), moved)
    jacobians = segment_jacobians(placement)
    masses = mass_matrix(placement, jacobians)
    pose = placement.poses[segment]
    place = pose[:3, :3] @ np.asarray(point, dtype=float) + pose[:3, 3]
    along = pose[:3, :3] @ unit_vector(np.asarray(direction, dtype=float))
    gradient = along @ point_jacobian(jacobians[segment], place)
    # At a pole of a chain the mass matrix is singular, but not along the rates of any point.
    return float(1.0 / (gradient @ np.linalg.lstsq(masses, gradient)[0]))


def head_effective_masses(figure: Figure) -> dict[str, float]:
    """Return the effective mass of the head to blows towards its centre of mass [kg], by `BLOWS`.

    Empty for a figure without a head, or one that lacks masses. A blow from the front and one from
    the back are alike.
    """
    head = figure.bodies.get(HEAD)
    if head is None or any(not _has_mass(segment) for segment in figure.bodies.values()):
        return {}
    centre = head.centre_of_mass
    assert centre is not None
    return {name: effective_mass(figure, HEAD, centre, blow) for name, blow in BLOWS.items()}


def _has_mass(segment: Segment) -> bool:
    return None not in (segment.mass, segment.inertia) and segment.centre_of_mass is not None


def point_jacobian(jacobian: Array, point: Array) -> Array:
    """Return the velocity of a segment's material point by the displacements, shape (3, n)."""
    return jacobian[3:] - cross_matrix(point) @ jacobian[:3]


def mass_matrix(placement: Placement, jacobians: Mapping[str, Array]) -> Array:
    """Return the mass matrix in the displacements of a placement, shape (n, n)."""
    size = placement.tree.kinematics.size
    total = np.zeros((size, size))
    for name, segment in placement.tree.figure.bodies.items():
        centre = segment.centre_of_mass
        if segment.mass is None or segment.inertia is None or centre is None:
            raise ModelError(f"segment `{name}` lacks mass, inertia or centre of mass")
        turn = placement.poses[name][:3, :3]
        place = turn @ centre + placement.poses[name][:3, 3]
        spin, speed = jacobians[name][:3], point_jacobian(jacobians[name], place)
        inertia = turn @ np.diag(segment.inertia) @ turn.T
        total += spin.T @ inertia @ spin + segment.mass * speed.T @ speed
    return total
