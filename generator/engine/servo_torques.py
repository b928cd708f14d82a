"""What the multipliers of servos are as torques on the joints."""

from collections.abc import Mapping

import numpy as np

from generator.chain import Chain
from generator.engine.assembly import Assembly
from generator.engine.motion import JointMotion
from generator.engine.rate_equations import Term
from generator.engine.trace import Trace
from generator.frames import Array


def servo_torques(
    assembly: Assembly, trace: Trace, joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """Torque of all links and drives on the child of each joint concerned.

    Args:
        assembly: what was simulated.
        trace: n frames.
        joints: the motion of every joint.

    Returns:
        In the parent's site axes, shape (n, 3) [N m].
    """
    torques: dict[str, Array] = {}
    column = 0
    for servo in assembly.servos:
        for row in servo.rows:
            for term in row:
                size = -term.factor * trace.pulls[:, column]
                chain = assembly.placement.tree.chains[term.joint]
                torque = size[:, None] * _axis(term, chain, joints[term.joint].displacements)
                torques[term.joint] = torques.get(term.joint, 0.0) + torque
            column += 1
    return torques


def drive_torques(
    assembly: Assembly, torques: Mapping[str, Array], joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """Torque of each drive about the axis of each displacement, whose power is torque times rate.

    Args:
        assembly: what was simulated.
        torques: as `servo_torques` gives them.
        joints: the motion of every joint.

    Returns:
        By driven joint, shape (n, degrees of freedom) [N m].
    """
    found: dict[str, Array] = {}
    for name in assembly.prescribed.drives:
        axes = assembly.placement.tree.chains[name].twists(joints[name].displacements)[..., :3]
        found[name] = (axes @ torques[name][..., None])[..., 0]
    return found


def _axis(term: Term, chain: Chain, displacements: Array) -> Array:
    """What a term's rate is of the angular velocity in the parent's axes, shape (n, 3) or (3,)."""
    if not isinstance(term.of, int):
        return np.asarray(term.of)
    axes = chain.twists(displacements)[:, list(chain.turns), :3]
    duals = np.linalg.pinv(np.swapaxes(axes, -1, -2))
    return np.asarray(duals[:, chain.turns.index(term.of)], dtype=float)
