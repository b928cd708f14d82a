"""Positioning an arm of a figure: the clavicle by its rhythm, the humerus by the elbow's direction.

The printed humerus angles (eq. 5.47-5.48) are differences, but rotations do not subtract. So the
orientation of the humerus in the torso's frame is computed first, and the displacements of the
shoulder on the raised clavicle follow. Joints are found by name, `left_clavicle`, `left_shoulder`
and `left_elbow` on the left; the torso's frame has x ahead, y left and z up. Without a clavicle the
shoulder moves on the torso.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from generator.diagnostics import ModelError, spelling_hint
from generator.figure import Figure, Joint, SiteRef
from generator.joint_chain import Chain, build_chain
from generator.kinematics.placement import Placement, forward_kinematics, initial_displacements
from generator.kinematics.shoulder import (
    OTANI,
    ShoulderAngles,
    ShoulderRhythm,
    Side,
    angle_between,
    arm_direction,
    arm_orientation,
    clavicle_orientation,
    printed_angle_error,
    shoulder_angles,
)
from generator.kinematics.tree import build_tree
from generator.rotations import Array, pose_matrix, rotation_with_z_axis

MAX_ROTATION_ERROR = 1e-6
"""Largest error of the orientation that a joint reaches [rad]."""


@dataclass(frozen=True)
class ArmPose:
    """The pose of an arm.

    Attributes:
        angles: angles of the formulas, each a single number.
        displacements: displacements of the clavicle's and the shoulder's joint, for their chains
            [rad].
        elbow_error: angle between the elbow's direction in the figure and the requested one
            [rad].
        printed_angle_error: the same with the humerus angles as printed [rad].
    """

    angles: ShoulderAngles
    displacements: Mapping[str, Array]
    elbow_error: float
    printed_angle_error: float


@dataclass(frozen=True)
class _Arm:
    """Joints and segments of one arm; without a clavicle the carrier is the torso."""

    clavicle: Joint | None
    shoulder: Joint
    torso: str
    carrier: str
    humerus: str
    elbow: SiteRef
    socket: SiteRef


def pose_arm(
    figure: Figure,
    side: Side,
    latitude: float,
    longitude: float,
    rhythm: ShoulderRhythm = OTANI,
) -> ArmPose:
    """Return displacements with which the elbow of a figure points to a latitude and longitude.

    Args:
        figure: its other joints keep their displacements.
        side: side of the arm.
        latitude: 0 overhead to pi hanging, in the torso's frame [rad].
        longitude: 0 ahead, pi/2 to the arm's own side [rad].
        rhythm: rhythm of the clavicle.

    Raises:
        ModelError: the direction is out of range, or the figure has no such arm.
    """
    angles = shoulder_angles(latitude, longitude, rhythm)
    arm = _find_arm(figure, side)
    upper_arm = _zero_orientation(figure, arm.shoulder, arm.carrier)
    clavicle_in_torso = np.eye(3)
    displacements: dict[str, Array] = {}
    if arm.clavicle is not None:
        drawn = _zero_orientation(figure, arm.clavicle, arm.torso)
        upper_arm = drawn @ upper_arm
        lifted = clavicle_orientation(angles.clavicle_elevation, angles.clavicle_abduction, side)
        clavicle_in_torso = lifted @ drawn
        displacements[arm.clavicle.name] = _solve_displacements(
            figure, arm.clavicle, arm.torso, clavicle_in_torso
        )
    along = upper_arm @ _upper_arm_direction(figure, arm)
    # The shortest rotation from the drawn arm to the hanging one.
    hanging = rotation_with_z_axis(-along).T @ upper_arm
    humerus_in_torso = arm_orientation(latitude, longitude, angles.twist, side) @ hanging
    displacements[arm.shoulder.name] = _solve_displacements(
        figure, arm.shoulder, arm.carrier, clavicle_in_torso.T @ humerus_in_torso
    )
    tree = build_tree(figure)
    placement = forward_kinematics(tree, {**initial_displacements(tree), **displacements})
    requested = arm_direction(latitude, longitude, side)
    return ArmPose(
        angles=angles,
        displacements=displacements,
        elbow_error=float(angle_between(_elbow_direction(placement, arm), requested)),
        printed_angle_error=float(printed_angle_error(latitude, longitude, angles)),
    )


def arm_latitude_and_longitude(placement: Placement, side: Side) -> tuple[float, float]:
    """Latitude and longitude of an elbow in the torso's frame [rad], as `pose_arm` takes them.

    Raises ModelError when the figure has no such arm.
    """
    arm = _find_arm(placement.tree.figure, side)
    ahead, left, up = _elbow_direction(placement, arm)
    outwards = left if side is Side.LEFT else -left
    return float(np.arccos(np.clip(up, -1.0, 1.0))), float(np.arctan2(outwards, ahead))


def _elbow_direction(placement: Placement, arm: _Arm) -> Array:
    def at(ref: SiteRef) -> Array:
        pose = placement.poses[ref.segment]
        return (pose @ placement.tree.figure.site(ref).pose_in_segment)[:3, 3]

    along = at(arm.elbow) - at(arm.socket)
    return placement.poses[arm.torso][:3, :3].T @ along / np.linalg.norm(along)


def _find_arm(figure: Figure, side: Side) -> _Arm:
    """Return the arm of a figure. Raises ModelError when it has none that can be positioned."""
    shoulder_joint, elbow_joint = (
        _find_joint(figure, f"{side.value}_{part}") for part in ("shoulder", "elbow")
    )
    shared = _joint_segments(shoulder_joint) & _joint_segments(elbow_joint)
    if len(shared) != 1:
        raise ModelError(
            f"the joints `{shoulder_joint.name}` and `{elbow_joint.name}` share no segment; "
            "the upper arm must connect them"
        )
    (humerus,) = shared
    (carrier,) = _joint_segments(shoulder_joint) - shared
    torso, clavicle = carrier, figure.joints.get(f"{side.value}_clavicle")
    if clavicle is not None:
        if carrier not in _joint_segments(clavicle):
            raise ModelError(f"the joint `{clavicle.name}` does not carry `{shoulder_joint.name}`")
        (torso,) = _joint_segments(clavicle) - {carrier}
    elbow, socket = (
        next(ref for ref in joint.ends if ref.segment == humerus)
        for joint in (elbow_joint, shoulder_joint)
    )
    arm = _Arm(clavicle, shoulder_joint, torso, carrier, humerus, elbow, socket)
    if not np.any(_shoulder_to_elbow(figure, arm)):
        raise ModelError(
            f"the joints `{shoulder_joint.name}` and `{elbow_joint.name}` are at the same point"
        )
    return arm


def _find_joint(figure: Figure, name: str) -> Joint:
    if name not in figure.joints:
        hint = spelling_hint(name, figure.joints) or "it has none"
        raise ModelError(f"the figure has no joint `{name}`; {hint}")
    return figure.joints[name]


def _joint_segments(joint: Joint) -> set[str]:
    return {ref.segment for ref in joint.ends}


def _shoulder_to_elbow(figure: Figure, arm: _Arm) -> Array:
    elbow, socket = (figure.site(ref).pose_in_segment[:3, 3] for ref in (arm.elbow, arm.socket))
    return elbow - socket


def _upper_arm_direction(figure: Figure, arm: _Arm) -> Array:
    """Return the unit vector from shoulder to elbow in the humerus's frame."""
    between = _shoulder_to_elbow(figure, arm)
    return between / np.linalg.norm(between)


def _zero_orientation(figure: Figure, joint: Joint, base: str) -> Array:
    """Return the orientation in `base` of the other segment of a joint at zero displacements."""
    parent, child = _site_orientations(figure, joint)
    orientation_at_zero = parent @ child.T
    return orientation_at_zero if joint.parent.segment == base else orientation_at_zero.T


def _solve_displacements(figure: Figure, joint: Joint, base: str, orientation: Array) -> Array:
    """Return displacements for an orientation in `base` of the other segment of a joint.

    Raises ModelError when the joint cannot reach it.
    """
    parent, child = _site_orientations(figure, joint)
    forward = orientation if joint.parent.segment == base else orientation.T
    requested = pose_matrix(parent.T @ forward @ child, np.zeros(3))
    chain = _build_chain(joint)
    rotation_error = float(np.linalg.norm(chain.pose_residual(requested)[:3]))
    found = chain.displacements(requested)
    if rotation_error > MAX_ROTATION_ERROR:
        raise ModelError(
            f"the joint `{joint.name}` cannot reach this orientation: it is off by "
            f"{np.degrees(rotation_error):.3g} deg"
        )
    return found


def _build_chain(joint: Joint) -> Chain:
    try:
        return build_chain(joint.chain)
    except ModelError as failure:
        raise ModelError(f"joint `{joint.name}`: {failure}") from None


def _site_orientations(figure: Figure, joint: Joint) -> tuple[Array, Array]:
    parent, child = (figure.site(ref).pose_in_segment[:3, :3] for ref in joint.ends)
    return parent, child
