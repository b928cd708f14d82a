"""The springs of several rotations that MuJoCo's ball joint has: equal in all directions."""

from itertools import product
from typing import cast

import numpy as np

from generator.figure import Joint, is_rotation
from generator.joint_chain import Chain
from generator.model_files.fit_error import joint_ranges
from generator.model_files.piecewise import ROTATION_MARGIN
from generator.passive_curve import rotation_vector
from generator.rotations import Array
from springs import JointSprings
from springs.spherical import VectorLaw

ROUNDING = 1e-9
"""Share of the largest torque below which a difference is one of rounding."""

_GRID = 7
"""Values of each displacement at which a law is compared with an isotropic one."""


def isotropic_stiffness(
    joint: Joint, springs: JointSprings, law: VectorLaw
) -> tuple[float, float, float] | None:
    """Return k1, k2, k3 of a torque -(k1 a + k2 a^2 + k3 a^3) r/a; None for another law.

    The law has this form over the range and beyond its ends, where stops would change it.
    """
    turns = [
        np.linspace(low - ROTATION_MARGIN, high + ROTATION_MARGIN, _GRID)
        if is_rotation(factor.kind)
        else np.zeros(1)
        for factor, (low, high) in zip(joint.chain, joint_ranges(joint, springs), strict=True)
    ]
    r = rotation_vector(Chain(joint.chain), np.array(list(product(*turns))))
    torques = law.torque(r)
    angle = np.linalg.norm(r, axis=1)
    powers = np.stack([-r * angle[:, None] ** power for power in range(3)], axis=-1).reshape(-1, 3)
    found = cast("Array", np.linalg.lstsq(powers, torques.ravel())[0])
    largest = float(np.abs(torques).max())
    if np.abs(powers @ found - torques.ravel()).max() > ROUNDING * largest:
        return None
    small = np.abs(found) * angle.max() ** np.arange(1, 4) <= ROUNDING * largest
    k1, k2, k3 = (0.0 if none else float(f"{k:.12g}") for k, none in zip(found, small, strict=True))
    return k1, k2, k3
