"""How a figure's joint becomes one that DYSPAM allows: z joints, and z-y-x angles (section 3.1.3).

A joint's triads are its two sites turned alike, so that the joint itself stays what it was. A
revolute's are turned until its axis is z (`zifyjoint`, figure 3.5), with the sign that the figure
gives it: the knees of the prototype turn about -y, and their dead zone is printed from 0 to 1.553
rad. Those of a spherical joint are turned by a half turn where that makes negative axes of the
figure positive; otherwise they stay the sites. A curve of `optional` is then about the axis that
the figure declares, on the right side as on the left.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generator.chain import ChainError, chain_of
from generator.errors import Fault, error
from generator.exchange.dyspam_mechanism import JointType
from generator.figure import Joint
from generator.frames import Array, Sequence3, frame_with_z
from generator.reader.draft import place_of
from generator.reader.joint_axes import sign_along, turn_axes

_WHAT_IS_HELD = "DYSPAM's files hold one rotation or three: revolutes and sphericals"


@dataclass(frozen=True, eq=False)
class JointTriad:
    """What becomes of a joint.

    Attributes:
        type: of the joint.
        turn: axes of the triad as columns in the joint's sites, shape (3, 3).
    """

    type: JointType
    turn: Array

    def angles(self, matrix: ArrayLike, displacement: ArrayLike) -> tuple[float, ...]:
        """The initial angles [rad]: of a revolute its own, of a spherical about z, y and x.

        Args:
            matrix: orientation of the child's site in the parent's, shape (3, 3).
            displacement: of the figure's joint [rad].
        """
        if self.type is JointType.REVOLUTE:
            return (float(np.asarray(displacement)[0]),)
        axes = tuple(factor.axis for factor in self.type.chain)
        found = Sequence3(axes).angles(self.turn.T @ np.asarray(matrix) @ self.turn)
        x, y, z = (float(angle) for angle in found)
        return z, y, x


def triad_of(joint: Joint) -> JointTriad | Fault:
    """The triad of a joint, or the fault that DYSPAM has no such joint."""
    place = place_of(joint.origins, "type", "connect")
    who = f"joint `{joint.name}`"
    try:
        chain = chain_of(joint.chain)
    except ChainError as failure:
        return error(f"{who} cannot be written for DYSPAM: {failure}", place, _WHAT_IS_HELD)
    if not joint.chain:
        return error(f"{who} cannot be written for DYSPAM: it is rigid", place, _WHAT_IS_HELD)
    if chain.slides:
        return error(f"{who} cannot be written for DYSPAM: it slides", place, _WHAT_IS_HELD)
    if len(chain.turns) == 2:
        return error(
            f"{who} cannot be written for DYSPAM: it turns about two axes", place, _WHAT_IS_HELD
        )
    if len(chain.turns) == 1:
        return JointTriad(JointType.REVOLUTE, frame_with_z(chain.turn_axes[0]))
    return JointTriad(JointType.SPHERICAL, np.diag(_signs(joint)))


def _signs(joint: Joint) -> Array:
    """A half turn, or none, that brings the axes of sites to the declared ones; shape (3,).

    Where an odd number of axes is negative no turn makes all positive, and the sites stay.
    """
    declared = [
        next((sign for turn in turn_axes(joint) if (sign := sign_along(tuple(axis), turn))), 0)
        for axis in np.eye(3)
    ]
    signs = np.array([sign or 1 for sign in declared], dtype=float)
    if np.prod(signs) > 0.0:
        return signs
    if 0 in declared:
        signs[declared.index(0)] = -1.0
        return signs
    return np.ones(3)
