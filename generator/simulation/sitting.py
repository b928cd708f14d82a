"""A person on a chair: the pose, and a chair as high, wide and deep as the person needs."""

from math import cos, pi, radians, sin

import numpy as np

from generator.contact.box import Box
from generator.contact.scene import Prop, Scene, floor_prop
from generator.contact.spheres import fit_contact_spheres
from generator.diagnostics import ModelError
from generator.figure import Figure, is_rotation
from generator.kinematics.placement import (
    Displacements,
    forward_kinematics,
    initial_displacements,
)
from generator.kinematics.tree import build_tree
from springs.contact import DEFAULT_SURFACE

_SIDES = ("left", "right")
_TILT, _RECLINE = radians(10.0), radians(25.0)
"""Angles of the seat from level and of the back from upright, as of an easy chair: a limp trunk
that is upright falls forward, and takes the person off the chair."""

_BACK_HEIGHT, _THICKNESS = 0.85, 0.08
"""Height of the back of the chair along itself, head included, and thickness of its parts [m]."""

_SIDE_ROOM = 0.2
"""Width of the back beside the hips, on either side [m]."""

_FRONT_GAP = 0.03
"""Distance of the seat from the calves [m]."""


def sitting_start(figure: Figure) -> tuple[Displacements, Scene]:
    """Return the displacements of a person who sits, and a floor and a chair around him.

    He leans back in an easy chair with upright shanks. The feet are on the floor at y = 0 where the
    lowest point of the figure is moved there.

    Raises ModelError for a figure without the legs of a person.
    """
    needed = [f"{side}_{name}" for side in _SIDES for name in ("hip_joint", "knee")]
    if any(name not in figure.joints for name in needed):
        raise ModelError("only a person sits so: the figure has no hip joints and knees")
    pelvis = figure.joints[needed[0]].parent.segment
    tree = build_tree(figure)
    pose = dict(initial_displacements(tree))
    flexions = (pi / 2.0 - _RECLINE + _TILT, pi / 2.0 + _TILT)
    for name, flexion in zip(needed, 2 * flexions, strict=True):
        pose[name] = np.array([*pose[name][:-1], flexion])
    pose |= _reclined(figure, pelvis)
    poses = forward_kinematics(tree, pose).poses
    spheres = {
        name: np.array(
            [[*(poses[name] @ np.append(one.centre, 1.0))[:3], one.radius] for one in fit.spheres]
        )
        for name, fit in fit_contact_spheres(figure).items()
        if fit.spheres
    }
    legs = [figure.joints[name].child.segment for name in needed]
    bottom = min(float(np.min(some[:, 1] - some[:, 3])) for some in spheres.values())
    for some in spheres.values():
        some[:, 1] -= bottom
    try:
        seated = np.concatenate([spheres[name] for name in (pelvis, *legs[::2])])
        shanks = np.concatenate([spheres[name] for name in legs[1::2]])
    except KeyError as missing:
        raise ModelError(f"segment {missing} has no contact spheres to sit on") from None
    every = np.concatenate(list(spheres.values()))
    left, right = float(np.min(seated[:, 0] - seated[:, 3])), np.max(seated[:, 0] + seated[:, 3])
    width, middle = float(right) - left, 0.5 * (left + float(right))
    wide = width + 2.0 * _SIDE_ROOM
    before_back = every[np.abs(every[:, 0] - middle) < 0.5 * wide]
    # Planes that touch the body from below and from behind, in y and z; their edge is the corner.
    normals = np.array([[cos(_TILT), -sin(_TILT)], [sin(_RECLINE), cos(_RECLINE)]])
    offsets = [
        float(np.min(some[:, 1:3] @ normal - some[:, 3]))
        for some, normal in zip((seated, before_back), normals, strict=True)
    ]
    corner = np.linalg.solve(normals, offsets)
    forward, upward = np.array([sin(_TILT), cos(_TILT)]), np.array([cos(_RECLINE), -sin(_RECLINE)])
    depth = float(np.min((shanks[:, 1:3] - corner) @ forward - shanks[:, 3])) - _FRONT_GAP
    seat, back = (
        corner + 0.5 * length * along - 0.5 * _THICKNESS * normal
        for length, along, normal in zip(
            (depth, _BACK_HEIGHT), (forward, upward), normals, strict=True
        )
    )
    seat_box = Box((middle, *seat.tolist()), (width, _THICKNESS, depth), (-_TILT, 0.0, 0.0))
    back_box = Box(
        (middle, *back.tolist()), (wide, _BACK_HEIGHT, _THICKNESS), (-_RECLINE, 0.0, 0.0)
    )
    return pose, Scene(
        (
            floor_prop((0.0, 1.0, 0.0)),
            Prop("seat", seat_box, DEFAULT_SURFACE),
            Prop("back", back_box, DEFAULT_SURFACE),
        )
    )


def _reclined(figure: Figure, pelvis: str) -> Displacements:
    """Return the displacements of the joint that holds a pelvis, for a trunk that leans back.

    Raises ModelError without a turn about x between the ground and the pelvis.
    """
    for name, joint in figure.joints.items():
        if joint.parent.segment in figure.ground and joint.child.segment == pelvis:
            frame = figure.site(joint.parent).pose_in_segment[:3, :3]
            for k, axis in enumerate(joint.chain):
                along = float((frame @ axis.axis)[0])
                if is_rotation(axis.kind) and abs(along) > 1.0 - 1e-9:
                    return {name: -_RECLINE * np.sign(along) * np.eye(len(joint.chain))[k]}
    raise ModelError(f"only a person sits so: the ground has no joint that turns {pelvis} about x")
