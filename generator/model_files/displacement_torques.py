"""The torque of a joint's springs about each displacement alone, sampled to fit other forms to it.

The springs of several rotations depend on all of them. Formats that have a torque for each
displacement get that of a rotation about its axis alone; their sum differs from the law in between.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np

from generator.figure import Joint
from generator.model_files.export_model import JointLaws
from generator.model_files.fit_error import FitError, orientation_error, within_half_turns
from generator.passive_curve import rotation_vector
from generator.rotations import Array, matrix_from_rotation_vector
from springs import total_torque
from springs.elastic import Range

COUPLING_LOSS = "springs of several rotations, approximated by a sum of torques about single axes"

TYPICAL_TORQUE = 20.0
"""Torque beyond which the relative error of a fit counts [N m or N]."""

NEGLIGIBLE_TORQUE = 1e-9
"""Torque or error that is nothing [N m or N]."""

_SAMPLES_OF_ONE_ANGLE = 181


@dataclass(frozen=True, eq=False)
class SampledTorque:
    """The torque of springs about one displacement, the others of its joint at zero.

    Attributes:
        displacements: throughout a range, shape (n,) [rad or m].
        torques: shape (n,) [N m or N].
        range: range of the displacement.
        unit: unit of the torques.
    """

    displacements: Array
    torques: Array
    range: Range
    unit: str = "N m"

    @cached_property
    def weights(self) -> Array:
        """Weights of the differences: a stiff end of the range does not spoil the rest."""
        return 1.0 / (1.0 + np.abs(self.torques) / TYPICAL_TORQUE)

    @property
    def is_negligible(self) -> bool:
        """True without a torque."""
        return bool(np.abs(self.torques).max() < NEGLIGIBLE_TORQUE)

    def error_of(self, torque: Callable[[Array], Array]) -> FitError:
        """Return the error of another torque."""
        return FitError.from_differences(torque(self.displacements) - self.torques, self.unit)

    def misfit_of(self, torque: Callable[[Array], Array]) -> float:
        """Return the weighted sum of the squared errors of another torque."""
        return float(np.sum((self.weights * (torque(self.displacements) - self.torques)) ** 2))

    def solve(self, columns: Array) -> Array:
        """Return factors of columns whose sum is nearest to the torques, shape (n, m) to (m,)."""
        weighted = columns * self.weights[:, None]
        sizes = np.linalg.norm(weighted, axis=0)
        sizes[sizes == 0.0] = 1.0
        target = self.torques * self.weights
        solution = cast("Array", np.linalg.lstsq(weighted / sizes, target, rcond=1e-10)[0])
        return solution / sizes


def sampled_torques(
    joint: Joint, laws: JointLaws, ranges: tuple[Range, ...]
) -> dict[int, SampledTorque]:
    """Return the torques about the displacements that have springs, by index in the chain.

    Args:
        joint: the joint.
        laws: its springs.
        ranges: ranges of the displacements [rad or m].
    """
    found: dict[int, SampledTorque] = {}
    for k, spring in laws.uncoupled.items():
        x = np.linspace(*ranges[k], _SAMPLES_OF_ONE_ANGLE)
        torques = np.asarray(total_torque(spring.elastic, x)) + np.zeros_like(x)
        found[k] = SampledTorque(x, torques, ranges[k], joint.chain[k].units.effort)
    if any(axis.elastic for axis in laws.combined):
        for k in laws.chain.rotations:
            ends = within_half_turns(ranges[k])
            x = np.linspace(*ends, _SAMPLES_OF_ONE_ANGLE)
            alone = np.zeros((len(x), len(joint.chain)))
            alone[:, k] = x
            torques = generalized_torques(laws, alone)[:, k]
            found[k] = SampledTorque(x, torques, ends)
    return {k: one for k, one in found.items() if not one.is_negligible}


def coupling_error(
    laws: JointLaws, ranges: tuple[Range, ...], torques: Mapping[int, Callable[[Array], Array]]
) -> FitError | None:
    """Return the error of torques of single displacements at orientations throughout the ranges.

    None for a joint without springs of several rotations.

    Args:
        laws: springs of the joint.
        ranges: ranges of the displacements [rad or m].
        torques: torques by index in the chain, functions of the displacement; zero for others.
    """
    if not any(axis.elastic for axis in laws.combined):
        return None
    turns = laws.chain.rotations

    def differences(displacements: Array) -> Array:
        found = -generalized_torques(laws, displacements)
        for k in turns:
            if k in torques:
                found[:, k] += torques[k](displacements[:, k])
        return found[:, list(turns)]

    error = orientation_error(differences, laws.chain, ranges)
    return None if error.largest < NEGLIGIBLE_TORQUE else error


def generalized_torques(laws: JointLaws, displacements: Array) -> Array:
    """Generalized torques of the springs of several rotations, shape (n, factors) [N m].

    Args:
        laws: springs of the joint.
        displacements: displacements of the chain, shape (n, factors) [rad or m].
    """
    vectors = rotation_vector(laws.chain, displacements)
    half_way = np.asarray(laws.of_vector.torque(vectors))
    torques = np.einsum("nij,nj->ni", matrix_from_rotation_vector(0.5 * vectors), half_way)
    return np.einsum("nki,ni->nk", laws.chain.twists(displacements)[..., :3], torques)
