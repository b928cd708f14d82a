"""A person on a chair: the pose, and a chair as high, wide and deep as the person needs."""

from math import radians

import numpy as np

from generator.contact.box import Box
from generator.contact.scene import Prop, Scene, floor_prop
from generator.contact.spheres import fit_contact_spheres
from generator.diagnostics import ModelError
from generator.figure import Figure
from generator.kinematics.placement import (
    Displacements,
    forward_kinematics,
    initial_displacements,
)
from generator.kinematics.tree import build_tree
from springs.contact import DEFAULT_SURFACE

_SIDES = ("left", "right")
_FLEXION = radians(90.0)
"""Flexion of hips and knees, so that trunk and shanks are upright."""

_BACK_HEIGHT, _BACK_DEPTH = 0.5, 0.08
"""Height of the back of the chair above the seat, and thickness of the back [m]."""

_FRONT_GAP, _BACK_GAP = 0.12, 0.02
"""Distances of the seat from the knees and of the back from the pelvis [m]."""


def sitting_start(figure: Figure) -> tuple[Displacements, Scene]:
    """Return the displacements of a person who sits, and a floor and a chair around him.

    The feet are on the floor at y = 0 where the lowest point of the figure is moved there.

    Raises ModelError for a figure without the legs of a person.
    """
    needed = [f"{side}_{name}" for side in _SIDES for name in ("hip_joint", "knee")]
    if any(name not in figure.joints for name in needed):
        raise ModelError("only a person sits so: the figure has no hip joints and knees")
    tree = build_tree(figure)
    pose = dict(initial_displacements(tree))
    for name in needed:
        pose[name] = np.array([*pose[name][:-1], _FLEXION])
    poses = forward_kinematics(tree, pose).poses
    spheres = {
        name: np.array(
            [[*(poses[name] @ np.append(one.centre, 1.0))[:3], one.radius] for one in fit.spheres]
        )
        for name, fit in fit_contact_spheres(figure).items()
        if fit.spheres
    }
    hip, knee = (figure.joints[name] for name in needed[:2])
    carried = [hip.parent.segment, *(figure.joints[name].child.segment for name in needed[::2])]
    try:
        pelvis = spheres[hip.parent.segment]
        seated = np.concatenate([spheres[name] for name in carried])
    except KeyError as missing:
        raise ModelError(f"segment {missing} has no contact spheres to sit on") from None
    every = np.concatenate(list(spheres.values()))
    bottom = float(np.min(every[:, 1] - every[:, 3]))
    top = float(np.min(seated[:, 1] - seated[:, 3])) - bottom
    behind = float(np.min(pelvis[:, 2] - pelvis[:, 3])) - _BACK_GAP
    site = figure.segments[knee.parent.segment].sites[knee.parent.site]
    front = float((poses[knee.parent.segment] @ site.pose_in_segment)[2, 3]) - _FRONT_GAP
    left, right = seated[:, 0] - seated[:, 3], seated[:, 0] + seated[:, 3]
    middle, width = 0.5 * float(left.min() + right.max()), float(right.max() - left.min())
    seat = Box((middle, 0.5 * top, 0.5 * (behind + front)), (width, top, front - behind))
    back_height = top + _BACK_HEIGHT
    back = Box(
        (middle, 0.5 * back_height, behind - 0.5 * _BACK_DEPTH), (width, back_height, _BACK_DEPTH)
    )
    return pose, Scene(
        (
            floor_prop((0.0, 1.0, 0.0)),
            Prop("seat", seat, DEFAULT_SURFACE),
            Prop("back", back, DEFAULT_SURFACE),
        )
    )
