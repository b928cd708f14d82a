"""Positions an arm of a figure: the clavicle by its rhythm, the humerus so that the elbow is there.

The printed humerus angles (eq. 5.47-5.48) subtract what rotations do not, so the humerus is solved
for: in the torso's frame its attitude is known, and on the raised clavicle the joint's own
displacements follow. The joints are found by their names, `left_clavicle`, `left_shoulder` and
`left_elbow` for the left side; the segment that carries them has x ahead, y left and z up. A figure
without the clavicle is positioned too: its shoulder then turns on the torso.
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
"""Largest turn that a joint's chain may leave undone [rad]."""


@dataclass(frozen=True)
class ArmPose:
    """An arm that was positioned.

    Attributes:
        angles: those of the formulas, each a single number.
        displacements: of the clavicle's and the shoulder's joint, for their chains [rad].
        elbow_error: between the elbow's direction in the posed figure and the one asked for [rad].
        printed_angle_error: the same with the humerus angles as printed [rad].
    """

    angles: ShoulderAngles
    displacements: Mapping[str, Array]
    elbow_error: float
    printed_angle_error: float


@dataclass(frozen=True)
class _Arm:
    """Joints and segments of one arm; without a clavicle, the torso stands for it."""

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
    """The displacements with which the elbow of a figure points to a latitude and longitude [rad].

    Args:
        figure: the figure; its other joints stay as drawn.
        side: which arm.
        latitude: 0 overhead to pi hanging, in the torso's frame.
        longitude: 0 ahead, pi/2 to the arm's own side.
        rhythm: how the clavicle follows the arm.

    Raises:
        ModelError: there is no such direction, or the figure has no such arm.
    """
    angles = shoulder_angles(latitude, longitude, rhythm)
    arm = _find_arm(figure, side)
    upper_arm = _zero_orientation(figure, arm.shoulder, arm.carrier)
    carried = np.eye(3)
    displacements: dict[str, Array] = {}
    if arm.clavicle is not None:
        drawn = _zero_orientation(figure, arm.clavicle, arm.torso)
        upper_arm = drawn @ upper_arm
        lifted = clavicle_orientation(angles.clavicle_elevation, angles.clavicle_abduction, side)
        carried = lifted @ drawn
        displacements[arm.clavicle.name] = _solve_displacements(
            figure, arm.clavicle, arm.torso, carried
        )
    along = upper_arm @ _upper_arm_direction(figure, arm)
    # Whichever way the arm is drawn, the shortest turn brings it to hang.
    hanging = rotation_with_z_axis(-along).T @ upper_arm
    aimed = arm_orientation(latitude, longitude, angles.twist, side) @ hanging
    displacements[arm.shoulder.name] = _solve_displacements(
        figure, arm.shoulder, arm.carrier, carried.T @ aimed
    )
    tree = build_tree(figure)
    placement = forward_kinematics(tree, {**initial_displacements(tree), **displacements})
    asked = arm_direction(latitude, longitude, side)
    return ArmPose(
        angles=angles,
        displacements=displacements,
        elbow_error=float(angle_between(_elbow_direction(placement, arm), asked)),
        printed_angle_error=float(printed_angle_error(latitude, longitude, angles)),
    )


def _elbow_direction(placement: Placement, arm: _Arm) -> Array:
    def at(ref: SiteRef) -> Array:
        pose = placement.poses[ref.segment]
        return (pose @ placement.tree.figure.site(ref).pose_in_segment)[:3, 3]

    along = at(arm.elbow) - at(arm.socket)
    return placement.poses[arm.torso][:3, :3].T @ along / np.linalg.norm(along)


def _find_arm(figure: Figure, side: Side) -> _Arm:
    """The arm of a figure. Raises ModelError when it has none, or one that cannot be aimed."""
    ball, hinge = (_find_joint(figure, f"{side.value}_{part}") for part in ("shoulder", "elbow"))
    shared = _joint_segments(ball) & _joint_segments(hinge)
    if len(shared) != 1:
        raise ModelError(
            f"the joints `{ball.name}` and `{hinge.name}` share no segment, the upper arm"
        )
    (humerus,) = shared
    (carrier,) = _joint_segments(ball) - shared
    torso, clavicle = carrier, figure.joints.get(f"{side.value}_clavicle")
    if clavicle is not None:
        if carrier not in _joint_segments(clavicle):
            raise ModelError(f"the joint `{clavicle.name}` does not carry `{ball.name}`")
        (torso,) = _joint_segments(clavicle) - {carrier}
    elbow, socket = (
        next(ref for ref in joint.ends if ref.segment == humerus) for joint in (hinge, ball)
    )
    arm = _Arm(clavicle, ball, torso, carrier, humerus, elbow, socket)
    if not np.any(_shoulder_to_elbow(figure, arm)):
        raise ModelError(f"the joints `{ball.name}` and `{hinge.name}` are at one point")
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
    """Unit vector from shoulder to elbow in the humerus's frame."""
    between = _shoulder_to_elbow(figure, arm)
    return between / np.linalg.norm(between)


def _zero_orientation(figure: Figure, joint: Joint, base: str) -> Array:
    """Orientation in `base` of the other segment of a joint whose displacements are zero."""
    parent, child = _site_orientations(figure, joint)
    turn = parent @ child.T
    return turn if joint.parent.segment == base else turn.T


def _solve_displacements(figure: Figure, joint: Joint, base: str, orientation: Array) -> Array:
    """Displacements that give the other segment of a joint the orientation `orientation` in `base`.

    Raises ModelError when the joint cannot.
    """
    parent, child = _site_orientations(figure, joint)
    forward = orientation if joint.parent.segment == base else orientation.T
    asked = pose_matrix(parent.T @ forward @ child, np.zeros(3))
    chain = _build_chain(joint)
    missed = float(np.linalg.norm(chain.pose_residual(asked)[:3]))
    found = chain.displacements(asked)
    if missed > MAX_ROTATION_ERROR:
        raise ModelError(
            f"the joint `{joint.name}` cannot turn so: it stays {np.degrees(missed):.3g} deg away"
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
