"""Joint moments of a measured motion, with powers, works and what is left over at the root."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.diagnostics import ModelError
from generator.figure import Figure
from generator.input_files.coordinates import Coordinates, displacement_columns
from generator.inverse.dynamics import (
    add_followers_forces,
    check_masses,
    follow_curves,
    generalized_forces,
)
from generator.inverse.external_loads import (
    ExternalForce,
    common_times,
    wrenches_of_forces,
)
from generator.inverse.smoothing import (
    UNSURE_TIME,
    check_frames,
    input_error,
    smooth_motion,
)
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import Tree, build_tree
from generator.motion_files import FigureMotion
from generator.person.identity import identity_of
from generator.rotations import Array

STANDARD_GRAVITY = (0.0, -9.81, 0.0)

MIN_SURE = 3
"""Smallest number of sure samples whose peaks and works say something about a motion."""


@dataclass(frozen=True, eq=False)
class CoordinateForce:
    """A coordinate over n times, with the generalized force that moves it.

    Attributes:
        name: Name of the coordinate in the model.
        is_angle: Whether it is an angle, so that the force is a moment.
        is_root: Whether its joint is to the ground, so that the force is a residual.
        values: Values, shape (n,) [rad or m].
        rates: Rates, likewise [rad/s or m/s].
        forces: Moments on the child or forces, likewise [N m or N].
    """

    name: str
    is_angle: bool
    is_root: bool
    values: Array
    rates: Array
    forces: Array

    @property
    def label(self) -> str:
        """Title of the column of the force, as OpenSim calls it."""
        return f"{self.name}_{'moment' if self.is_angle else 'force'}"

    @property
    def unit(self) -> str:
        """Unit of the force."""
        return "N m" if self.is_angle else "N"

    @property
    def powers(self) -> Array:
        """Power of the force, shape (n,) [W]."""
        return self.forces * self.rates


@dataclass(frozen=True)
class Works:
    """Work of a moment along a motion, [J].

    Attributes:
        positive: Work while the power is positive.
        negative: Work while it is negative.
    """

    positive: float
    negative: float


@dataclass(frozen=True, eq=False)
class JointMoments:
    """Generalized forces that a motion needs, by coordinate.

    Attributes:
        times: Times [s], shape (n,).
        coordinates: Coordinates by name, in the order of the figure's joints.
        is_sure: Whether each time is at least `UNSURE_TIME` from the ends of the motion, where
            accelerations are uncertain, shape (n,); none is where fewer than `MIN_SURE` are.
        mass: Mass of the segments that move [kg].
        height: Stature of a person, else the vertical extent of the figure's sites [m].
        weight: Mass times gravity [N].
        cutoff: Frequency of the filter [Hz]; None without one.
    """

    times: Array
    coordinates: Mapping[str, CoordinateForce]
    is_sure: NDArray[np.bool_]
    mass: float
    height: float
    weight: float
    cutoff: float | None

    @cached_property
    def kept(self) -> NDArray[np.bool_]:
        """Samples of peaks and works: those that are sure, or all where none is."""
        return self.is_sure if self.is_sure.any() else np.ones_like(self.is_sure)

    def works(self, powers: Array, among: NDArray[np.bool_] | None = None) -> Works:
        """Return the works of a power, shape (n,) [W], over the samples that are kept.

        Args:
            powers: Power.
            among: Samples that count beside being kept, shape (n,); None for all.
        """
        kept = self.kept if among is None else self.kept & among
        steps = np.diff(self.times) * (kept[1:] & kept[:-1])
        positive, negative = (
            float((steps * (part[1:] + part[:-1])).sum() / 2.0)
            for part in (np.clip(powers, 0.0, None), np.clip(powers, None, 0.0))
        )
        return Works(positive, negative)

    def residual_share(self, name: str) -> float:
        """Return the largest residual of a root's coordinate, in body weights or N m/(kg m)."""
        one = self.coordinates[name]
        largest = float(np.abs(one.forces[self.kept]).max())
        return largest / (self.mass * self.height if one.is_angle else self.weight)

    @property
    def mean_residual_share(self) -> float:
        """Mean size of the root's residual force in body weights, 0 without gravity or residual."""
        return float(np.mean(self._residual_shares))

    @property
    def largest_residual_share(self) -> float:
        """Largest size of the root's residual force, likewise."""
        return float(np.max(self._residual_shares))

    @cached_property
    def _residual_shares(self) -> Array:
        """Size of the root's residual force in body weights, over the samples that are kept."""
        forces = [
            one.forces[self.kept]
            for one in self.coordinates.values()
            if one.is_root and not one.is_angle
        ]
        if not forces or not self.weight:
            return np.zeros(1)
        return np.sqrt(sum(one**2 for one in forces)) / self.weight


def joint_moments(
    motion: FigureMotion,
    coordinates: Coordinates,
    forces: Sequence[ExternalForce] = (),
    cutoff: float | None = None,
    gravity: ArrayLike = STANDARD_GRAVITY,
) -> JointMoments:
    """Return the moments that a motion needs, at its frames while all forces are known.

    Args:
        motion: Motion of the figure.
        coordinates: Coordinates of the model that the figure is from.
        forces: Forces on it beside gravity.
        cutoff: Frequency of the filter of displacements [Hz]; None for none.
        gravity: Acceleration of gravity, shape (3,) [m/s2].

    Raises:
        InputError: The motion has too few frames, a gap, or other units than it says, the filter
            does not fit it, or forces are not known at its times.
        ModelError: A body has no mass, or a joint closes a loop.
    """
    tree = motion.tree
    check_masses(tree)
    check_frames(motion)
    columns = {
        name: at
        for name, at in displacement_columns(motion.chains, coordinates).items()
        if at.joint in tree.kinematics.columns
    }
    _check_units(motion, columns)
    times = common_times(motion.times, forces)
    smooth = follow_curves(tree, smooth_motion(tree, motion, cutoff, times))
    poses = tree.kinematics.poses(smooth.values)
    wrenches = wrenches_of_forces(forces, times, poses, tree.figure)
    needed = generalized_forces(tree, smooth, wrenches, gravity)
    needed = add_followers_forces(tree, smooth, needed)
    found: dict[str, CoordinateForce] = {}
    roots = set(_root_joints(tree))
    for name, at in columns.items():
        if at.index not in tree.figure.joints[at.joint].free_places:
            continue
        k = tree.kinematics.columns[at.joint].start + at.index
        found[name] = CoordinateForce(
            name,
            motion.chains[at.joint][at.index].units.is_angle,
            at.joint in roots,
            at.scale * smooth.values[:, k] + at.offset,
            at.scale * smooth.rates[:, k],
            needed[:, k] / at.scale,
        )
    first, last = motion.times[0] + UNSURE_TIME, motion.times[-1] - UNSURE_TIME
    is_sure = (times >= first) & (times <= last)
    mass, size = motion.figure.total_mass, float(np.linalg.norm(np.asarray(gravity)))
    return JointMoments(
        times,
        found,
        is_sure & (np.count_nonzero(is_sure) >= MIN_SURE),
        mass,
        body_height(motion.figure),
        mass * size,
        cutoff,
    )


def _root_joints(tree: Tree) -> Iterator[str]:
    """Yield the joints between the ground and segments that move."""
    for branch in tree.joints:
        if branch.inboard in tree.figure.ground:
            yield branch.joint.name


def body_height(figure: Figure) -> float:
    """Return the stature of a person, else the vertical extent of the sites in the file's pose [m].

    Raises ModelError for a figure without size.
    """
    person = identity_of(figure)
    if person is not None:
        return person.stature
    tree = build_tree(figure)
    poses = forward_kinematics(tree, initial_displacements(tree)).poses
    heights = [
        float((poses[name] @ site.pose_in_segment)[1, 3])
        for name, segment in figure.bodies.items()
        for site in segment.sites.values()
    ]
    height = max(heights) - min(heights)
    if height <= 0.0:
        raise ModelError("the figure has no height, by which residuals could be divided")
    return height


def _check_units(motion: FigureMotion, columns: Coordinates) -> None:
    """Raise InputError where most angles range over more than half a turn: they are in degrees."""
    ranges = {
        name: float(np.ptp(motion.displacements[at.joint][:, at.index])) * at.scale
        for name, at in columns.items()
        if motion.chains[at.joint][at.index].units.is_angle
    }
    moving = {name: size for name, size in ranges.items() if size > 0.0}
    large = [name for name, size in moving.items() if size > np.pi]
    if len(moving) > 1 and 2 * len(large) > len(moving):
        name = max(large, key=moving.__getitem__)
        raise input_error(
            f"`{name}` moves through {moving[name]:.3g} rad, and most angles through more than "
            "half a turn: they seem to be degrees",
            "write `inDegrees=yes` in the header of the file",
        )


def format_moments(moments: JointMoments) -> Iterator[str]:
    """Yield the lines of the table that OpenSim's inverse dynamics writes, `.sto`."""
    labels = ["time", *(one.label for one in moments.coordinates.values())]
    yield "Inverse Dynamics Generalized Forces"
    yield "version=1"
    yield f"nRows={len(moments.times)}"
    yield f"nColumns={len(labels)}"
    yield "inDegrees=no"
    yield "endheader"
    yield "\t".join(labels)
    columns = [moments.times, *(one.forces for one in moments.coordinates.values())]
    for row in np.stack(columns, axis=1).tolist():
        yield "\t".join(map(repr, row))
