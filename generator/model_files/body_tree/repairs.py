"""Repairs of bodies that no engine can move as they are: without mass, or of impossible inertia.

Models have them from rounding in CAD programs, as point masses, or as frames at the ends of chains.
"""

from dataclasses import replace

import numpy as np

from generator.inertia import MassProperties
from generator.losses import Losses
from generator.model_files.body_tree.tree import Body, BodyTree
from generator.rotations import Array

LEAST_RADIUS = 1e-3
"""Radius of the ball that a point mass becomes [m]."""

_NOISE = 1e-12
"""Moments that count as zero, relative to the largest."""


def fix_massless_ends(tree: BodyTree, losses: Losses) -> BodyTree:
    """Return the tree in which bodies that move no mass are fixed in the pose of the model.

    Without any mass in the tree nothing changes: it is for the caller to report that.
    """
    moves_mass = {body.name: body.mass is not None for body in tree.bodies}
    for body in reversed(tree.bodies):
        if body.parent is not None:
            moves_mass[body.parent] |= moves_mass[body.name]
    if not any(moves_mass.values()):
        return tree
    bodies: list[Body] = []
    for body in tree.bodies:
        kept = body
        if body.dofs and not moves_mass[body.name]:
            pose = body.pose
            for dof in body.dofs:
                pose = pose @ dof.pose
            kept = replace(body, pose=pose, dofs=(), joint="")
            what = "bodies without mass at the end of a chain are fixed, and so are their joints"
            losses.add(what, f"{body.name} ({', '.join(dof.name for dof in body.dofs)})")
        bodies.append(kept)
    return replace(tree, bodies=tuple(bodies))


def with_possible_inertia(body: Body, losses: Losses) -> Body:
    """Return the body with the inertia of one that can exist.

    Moments of zero or less are those of a ball of 1 mm; then, if the largest moment is above the
    sum of the others, the smallest is raised to the difference, or both to half the largest.
    """
    if body.mass is None:
        return body
    tensor = body.mass.inertia + body.extra_inertia
    moments, axes = np.linalg.eigh((tensor + tensor.T) / 2.0)
    possible = _possible_moments(moments, body.mass.mass)
    if np.array_equal(moments, possible):
        return body
    numbers = (", ".join(f"{moment:.3g}" for moment in row) for row in (moments, possible))
    what = "moments of inertia that no body has are raised to possible ones [kg m2]"
    losses.add(what, f"{body.name} ({' to '.join(numbers)})")
    mass = MassProperties(body.mass.mass, body.mass.centre, axes @ np.diag(possible) @ axes.T)
    return replace(body, mass=mass, extra_inertia=np.zeros((3, 3)))


def _possible_moments(moments: Array, mass: float) -> Array:
    """Return principal moments in ascending order, raised to those of a body, shape (3,)."""
    ball = 0.4 * mass * LEAST_RADIUS**2
    largest = moments[2] if moments[2] > 0.0 else ball
    raised = np.where(moments > _NOISE * largest, moments, min(ball, largest))
    first, second, third = np.sort(raised)
    if third > (first + second) * (1.0 + _ROUNDING):
        first = third - second
        if first > second:
            first = second = third / 2.0
        return np.array([first, second, third])
    return raised


_ROUNDING = 1e-9
"""Relative excess of the largest moment over the sum of the others that is left as it is."""
