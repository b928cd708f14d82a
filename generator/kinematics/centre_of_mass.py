"""The centre of mass of a figure, or of some of its segments, and how joints move it (eq. 5.1)."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from generator.diagnostics import (
    Diagnostic,
    InputError,
    MoverError,
    UsageError,
    error,
    spelling_hint,
)
from generator.figure import CENTRE_OF_MASS_SITE, Figure
from generator.figure_file.resolve import origin_span
from generator.kinematics.placement import Placement
from generator.rotations import Array


@dataclass(frozen=True)
class Masses:
    """The masses of some segments, each at its centre.

    Attributes:
        segments: their names, shape (k,).
        masses: shape (k,) [kg].
        centres_in_segment: position of each centre in its segment, shape (k, 3) [m].
    """

    segments: tuple[str, ...]
    masses: Array
    centres_in_segment: Array

    def __post_init__(self) -> None:
        """Check that the masses are finite, not negative, and not all zero."""
        if not np.all(np.isfinite(self.masses)) or np.any(self.masses < 0.0):
            raise ValueError("masses are finite and not negative")
        if self.total == 0.0:
            raise MoverError("the segments have no mass, so there is no centre of mass")

    @cached_property
    def total(self) -> float:
        """Sum of the masses [kg]."""
        return float(np.sum(self.masses))

    @cached_property
    def _mass_fractions(self) -> Array:
        """Mass of each segment relative to the total, shape (k,)."""
        return self.masses / self.total

    def centres(self, poses: Mapping[str, Array]) -> Array:
        """Return the centres of mass of the segments in the world, shape (..., k, 3) [m].

        Args:
            poses: poses of the segments in the world, shape (..., 4, 4).
        """
        stack = np.stack([poses[name] for name in self.segments], axis=-3)
        turned = (stack[..., :3, :3] @ self.centres_in_segment[..., None])[..., 0]
        return turned + stack[..., :3, 3]

    def centre(self, poses: Mapping[str, Array]) -> Array:
        """Return the common centre of mass in the world, shape (..., 3) [m], eq. 5.1."""
        return self._mass_fractions @ self.centres(poses)

    def jacobian(self, placement: Placement) -> Array:
        """Return the Jacobian of the centre of mass by displacements, (..., 3, n) [m/rad or m/m].

        The n columns are the displacements of the figure's joints, in the order of the file. A
        joint that closes a loop has columns of zeros: the others determine all poses. The product
        with rates that keep the loops closed is the centre's velocity.
        """
        tree = placement.tree
        kinematics = tree.kinematics
        twists = kinematics.twists(kinematics.displacement_vector(placement.displacements))
        moves = np.stack([kinematics.motion_masks[name] for name in self.segments])
        weights = moves * self._mass_fractions[:, None]
        levers = weights.T @ self.centres(placement.poses)
        velocities = np.sum(weights, axis=0)[:, None] * twists[..., 3:]
        slopes = np.swapaxes(velocities + np.cross(twists[..., :3], levers), -1, -2)
        count = sum(len(joint.chain) for joint in tree.figure.joints.values())
        result = np.zeros((*slopes.shape[:-1], count))
        start = 0
        for joint in tree.figure.joints.values():
            stop = start + len(joint.chain)
            if joint.name in kinematics.columns:
                result[..., start:stop] = slopes[..., kinematics.columns[joint.name]]
            start = stop
        return result


def own_segments(figure: Figure) -> tuple[str, ...]:
    """Return the segments that belong to the figure itself, in the order of the file.

    These are all that move, and the root's where it has a mass. A negative mass marks a part of
    the ground.
    """
    return tuple(
        name
        for name, segment in figure.segments.items()
        if name not in figure.ground or (segment.mass is not None and not segment.has_ground_mass)
    )


def segment_masses(figure: Figure, segments: Iterable[str] | None = None) -> Masses:
    """Return the masses of `segments` [default: all of the figure's own].

    Raises:
        UsageError: a segment that the figure does not have, or a part of the ground.
        InputError: a segment without mass or centre of mass; one error for each.
        MoverError: the total mass is zero.
    """
    own = own_segments(figure)
    names = own if segments is None else tuple(dict.fromkeys(segments))
    for name in names:
        if name not in figure.segments:
            raise UsageError(f"the figure has no segment `{name}`; {spelling_hint(name, own)}")
        if name not in own:
            raise UsageError(f"segment `{name}` is part of the ground and has no mass")
    diagnostics = list(_missing_mass_diagnostics(figure, names))
    if diagnostics:
        raise InputError(diagnostics)
    chosen = [figure.segments[name] for name in names]
    centres = [segment.centre_of_mass for segment in chosen]
    return Masses(
        names,
        np.array([segment.mass for segment in chosen], dtype=float),
        np.array(centres, dtype=float).reshape(-1, 3),
    )


def _missing_mass_diagnostics(figure: Figure, names: Iterable[str]) -> Iterator[Diagnostic]:
    for name in names:
        segment = figure.segments[name]
        place = origin_span(segment.origins)
        if segment.mass is None:
            yield error(f"segment `{name}` has no mass", place, "the centre of mass needs it")
        if segment.centre_of_mass is None:
            hint = "the centre of mass of the figure is computed from those of its segments"
            yield error(f"segment `{name}` has no site `{CENTRE_OF_MASS_SITE}`", place, hint)


def centre_of_mass(placement: Placement, segments: Iterable[str] | None = None) -> Array:
    """Return the centre of mass of a placed figure or some of its segments, shape (..., 3) [m].

    Raises as `segment_masses`, whose result serves many poses.
    """
    return segment_masses(placement.tree.figure, segments).centre(placement.poses)


def centre_of_mass_jacobian(placement: Placement, segments: Iterable[str] | None = None) -> Array:
    """Return the Jacobian of the centre of mass by the displacements, shape (..., 3, n).

    See `Masses.jacobian`. Raises as `segment_masses`.
    """
    return segment_masses(placement.tree.figure, segments).jacobian(placement)
