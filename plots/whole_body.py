"""Mass properties and extents of a posed figure."""

from collections.abc import Iterator, Mapping, Sequence
from functools import reduce
from math import radians
from operator import add

import numpy as np

from generator.figure import Figure
from generator.inertia import MassProperties
from generator.kinematics.centre_of_mass import own_segments, segment_masses
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.motion_files import FigureMotion
from plots.figure_image import Body
from springs.backends import Array

Posture = Mapping[str, Sequence[float]]
"""Displacements that are not those of the figure, by joint [deg]."""


def place_in_posture(figure: Figure, posture: Posture) -> dict[str, Array]:
    """Return the poses of the segments in the world, shape (4, 4) each."""
    tree = build_tree(figure)
    displacements = initial_displacements(tree)
    for name, angles in posture.items():
        displacements[figure.joints[name].name] = np.radians(np.array(angles, dtype=float))
    return dict(forward_kinematics(tree, displacements).poses)


def posture_in_radians(posture: Posture) -> dict[str, tuple[float, ...]]:
    """Return a posture as displacements of a plan [rad]."""
    return {name: tuple(map(radians, angles)) for name, angles in posture.items()}


def on_both_sides(posture: Posture) -> dict[str, Sequence[float]]:
    """Return a posture with the joints of each `left_` and `right_` for names without side."""
    return {
        f"{side}_{name}": angles for name, angles in posture.items() for side in ("left", "right")
    }


def mass_properties(
    figure: Figure, poses: Mapping[str, Array], segments: Sequence[str] = ()
) -> MassProperties:
    """Return the mass properties of segments [default: all of the figure's] in the world."""
    parts: list[MassProperties] = []
    for name in segments or own_segments(figure):
        segment = figure.segments[name]
        assert segment.mass is not None
        assert segment.inertia is not None
        assert segment.centre_of_mass is not None
        own = MassProperties(segment.mass, segment.centre_of_mass, np.diag(segment.inertia))
        parts.append(own.transform(poses[name]))
    return reduce(add, parts)


def surface_points(body: Body, poses: Mapping[str, Array], segments: Sequence[str] = ()) -> Array:
    """Corners of the surfaces of segments [default: all] in the world, shape (n, 3) [m]."""
    corners, _ = body.place(poses)
    if segments:
        chosen = [body.segments.index(name) for name in segments]
        corners = corners[np.isin(body.owners, chosen)]
    return corners.reshape(-1, 3)


def centre_velocities(
    motion: FigureMotion, poses: Mapping[str, Array], rates: Mapping[str, Array]
) -> Iterator[tuple[str, Array, Array, Array]]:
    """Yield each segment with its centre of mass, and the angular velocity and that of the centre.

    Args:
        motion: Motion of a figure over n frames.
        poses: Poses of its segments in the world, shape (n, 4, 4) each.
        rates: Rates of its displacements by joint.

    Yields:
        Name, centre [m], angular velocity [rad/s] and velocity [m/s], in the world, (n, 3) each.
    """
    kinematics, masses = motion.tree.kinematics, segment_masses(motion.tree.figure)
    values = kinematics.displacement_vector(motion.displacements)
    twists = kinematics.twists(values) * kinematics.displacement_vector(rates)[..., None]
    for name, centre_in_segment in zip(masses.segments, masses.centres_in_segment, strict=True):
        pose, velocity = poses[name], twists[:, kinematics.motion_masks[name]].sum(axis=1)
        centre = np.asarray(pose[:, :3, :3] @ centre_in_segment + pose[:, :3, 3], dtype=float)
        yield name, centre, velocity[:, :3], velocity[:, 3:] + np.cross(velocity[:, :3], centre)
