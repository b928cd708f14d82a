"""The prototype's leg with a law over hip and knee, its torques read out of Exudyn at rest."""

from collections.abc import Sequence

import numpy as np

from generator import Plan, read_figure, static_torques
from springs import CoupledAxis, CoupledSpring, SpringSet
from springs.coupled import CoupledExponential
from springs.measured import Range
from springs.operations import Array

HIP, KNEE = "left_hip_joint", "left_knee"

_FLEXION = (CoupledAxis(HIP, (0.0, 1.0, 0.0)), CoupledAxis(KNEE, (0.0, -1.0, 0.0)))
_NODES = 32
"""Gauss-Legendre nodes of a side of a loop."""


class TwoJointLeg:
    """The left leg of the prototype, with a law over hip and knee flexion and no other springs."""

    def __init__(self, law: CoupledExponential) -> None:
        """Hang the law on the leg."""
        self._body = read_figure("prototype")
        self._plan = Plan(springs=SpringSet(coupled=(CoupledSpring(law, _FLEXION),)))

    def torques(self, hip: Array, knee: Array) -> Array:
        """Torques [N m] on thigh and shank, in the sense of flexion, shape (n, 2).

        Args:
            hip: flexion, shape (n,) [rad].
            knee: flexion, shape (n,) [rad].
        """
        poses = [
            {HIP: np.array([0.0, 0.0, h]), KNEE: np.array([k])}
            for h, k in zip(hip, knee, strict=True)
        ]
        read = static_torques(self._body, poses, self._plan)
        return np.stack([read[axis.joint] @ np.array(axis.direction) for axis in _FLEXION], axis=1)

    def loop_work(self, rectangle: tuple[Range, Range]) -> float:
        """Work of both torques once round a rectangle of hip and knee flexion [rad], in J.

        As `springs.conservative.loop_work`: along the hip first, then along the knee.
        """
        (hip_low, hip_high), (knee_low, knee_high) = rectangle
        corners = ((hip_low, knee_low), (hip_high, knee_low), (hip_high, knee_high))
        return self._work((*corners, (hip_low, knee_high), (hip_low, knee_low)))

    def _work(self, corners: Sequence[tuple[float, float]]) -> float:
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        share, part = 0.5 * (nodes + 1.0), 0.5 * weights
        ends = np.array(corners)
        sides = np.diff(ends, axis=0)
        at = ends[:-1, None] + share[:, None] * sides[:, None]
        steps = part[:, None] * sides[:, None]
        torques = self.torques(at[..., 0].ravel(), at[..., 1].ravel())
        return float(np.sum(torques * steps.reshape(-1, 2)))
