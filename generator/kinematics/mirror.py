"""Which joints are mirror images, and which signs make the one move as the image of the other.

The plane of symmetry is the sagittal one of the world's frame, x = 0, with all displacements zero.
Two joints are a pair where their names say so (`left_knee` and `right_knee`: people are not quite
even), or where the place of the one is the mirror image of that of the other. A turn about an axis
is, in the mirror, the opposite turn about the axis's image; a slide goes along the image itself.
"""

import re
from typing import assert_never

import numpy as np

from generator.diagnostics import MoverError
from generator.figure import AxisKind, Figure, Joint, JointAxis
from generator.kinematics.placement import Placement, forward_kinematics, site_pose
from generator.kinematics.tree import build_tree
from generator.rotations import Array, unit_vector

PARALLEL_TOLERANCE = 1e-6
"""Largest distance between unit vectors that count as one."""

MIRROR_POSITION_TOLERANCE = 0.01
"""Largest distance of places that count as mirror images, as part of that from the plane."""

_SIDE_PATTERN = re.compile(r"left|right")

_MIRROR_SIGNS = np.array([-1.0, 1.0, 1.0])


class MirrorError(MoverError, ValueError):
    """Two joints are no mirror images; the message says why."""


def format_dof_count(count: int) -> str:
    """`1 degree of freedom`, `3 degrees of freedom`."""
    return f"{count} degree{'' if count == 1 else 's'} of freedom"


def mirror_signs(figure: Figure, control: Joint, follower: Joint) -> tuple[int, ...]:
    """Signs by which `follower` has to take the displacements of `control` to be its image.

    They are all +1 where the figure declares the axes of the other side as mirror images, as the
    prototype does with its negative axes.

    Args:
        figure: the figure of both.
        control: the joint that is mirrored.
        follower: the joint of the other side.

    Raises:
        MirrorError: no signs make them mirror images.
    """
    if len(control.chain) != len(follower.chain):
        raise MirrorError(
            f"`{control.name}` has {format_dof_count(len(control.chain))} and "
            f"`{follower.name}` {len(follower.chain)}"
        )
    tree = build_tree(figure)
    zeros = {name: np.zeros(len(joint.chain)) for name, joint in figure.joints.items()}
    placement = forward_kinematics(tree, zeros)
    if not (_names_match(control, follower) or _positions_match(placement, control, follower)):
        raise MirrorError(
            f"`{follower.name}` is no mirror image of `{control.name}`: neither do their names "
            "differ in left and right alone, nor are their places mirror images in the plane x = 0"
        )
    signs: list[int] = []
    for number, (one, other) in enumerate(zip(control.chain, follower.chain, strict=True), 1):
        image = _mirrored_direction(_axis_in_world(placement, control, one), one.kind)
        sign = _relative_sign(image, _axis_in_world(placement, follower, other))
        if one.kind != other.kind or sign is None:
            raise MirrorError(
                f"degree of freedom {number} of `{follower.name}` is no mirror image of that of "
                f"`{control.name}`"
            )
        signs.append(sign)
    return tuple(signs)


def _mirrored_direction(direction: Array, kind: AxisKind) -> Array:
    """Mirror image in the plane x = 0 of an axis to slide along, or of one to turn about."""
    match kind:
        case AxisKind.ROTATION:
            return -_MIRROR_SIGNS * direction
        case AxisKind.TRANSLATION:
            return _MIRROR_SIGNS * direction
        case _:
            assert_never(kind)


def _names_match(one: Joint, other: Joint) -> bool:
    """Whether the names are the same but for `left` and `right`, which stand for each other."""
    exchanged = _SIDE_PATTERN.sub(lambda side: "right" if side[0] == "left" else "left", one.name)
    return exchanged == other.name != one.name


def _positions_match(placement: Placement, one: Joint, other: Joint) -> bool:
    """Whether the joints lie off the plane, each where the other one's image is."""
    place, opposite = (site_pose(placement, joint, "parent")[:3, 3] for joint in (one, other))
    return bool(
        np.linalg.norm(_MIRROR_SIGNS * place - opposite) < MIRROR_POSITION_TOLERANCE * abs(place[0])
    )


def _axis_in_world(placement: Placement, joint: Joint, factor: JointAxis) -> Array:
    """Axis along or about which the segment farther from the root moves, shape (3,)."""
    axis = site_pose(placement, joint, "parent")[:3, :3] @ unit_vector(factor.axis)
    forward = next(
        (branch.parent_is_inboard for branch in placement.tree.joints if branch.joint is joint),
        True,
    )
    return axis if forward else -axis


def _relative_sign(one: Array, other: Array) -> int | None:
    if np.linalg.norm(one - other) < PARALLEL_TOLERANCE:
        return 1
    return -1 if np.linalg.norm(one + other) < PARALLEL_TOLERANCE else None
