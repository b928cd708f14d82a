"""Segments as Exudyn rigid bodies, referred to their centres of mass."""

from collections.abc import Mapping

import numpy as np

from generator.engine.exudyn_api import Index, MainSystem, exu, items, rigid, unused_name
from generator.errors import MoverError
from generator.figure import Figure, Segment
from generator.frames import Array, homogeneous
from generator.posture.placement import Placement, motion_maps

Vector = tuple[float, float, float]


class IncompleteFigureError(MoverError):
    """A segment lacks what a simulation needs of it."""


def centre_of_mass(segment: Segment) -> Array:
    """Position of the centre of mass in the segment frame [m], shape (3,)."""
    centre = segment.centre_of_mass
    if centre is None or segment.mass is None or segment.inertia is None or not segment.mass > 0.0:
        raise IncompleteFigureError(
            f"segment {segment.name} cannot be simulated: "
            "it needs a positive mass, an inertia and a site CM"
        )
    return centre


def body_pose(placement: Placement, segment: Segment) -> Array:
    """Pose in the world of the segment's axes at its centre of mass, shape (4, 4)."""
    return placement.poses[segment.name] @ homogeneous(np.eye(3), centre_of_mass(segment))


def add_bodies(
    mbs: MainSystem, placement: Placement, rates: Array, gravity: Vector
) -> tuple[Mapping[str, Index], Index]:
    """One rigid body a moving segment, with Euler parameters, under gravity; and the ground.

    Args:
        mbs: the system to build into.
        placement: where the segments start.
        rates: rates of the tree's displacements [rad/s or m/s], shape (n,).
        gravity: [m/s^2].

    Raises:
        IncompleteFigureError: a segment lacks mass, inertia or CM, or there is none that moves.

    Returns:
        Object index of each segment (the ground's for those that do not move), and of the ground.
    """
    figure: Figure = placement.tree.figure
    if not figure.bodies:
        raise IncompleteFigureError("the figure cannot be simulated: none of its segments moves")
    ground = mbs.AddObject(items.ObjectGround())
    bodies: dict[str, Index] = dict.fromkeys(figure.ground, ground)
    maps = motion_maps(placement)
    for name, segment in figure.bodies.items():
        pose = body_pose(placement, segment)
        motion = maps[name] @ rates
        velocity = motion[3:] + np.cross(motion[:3], pose[:3, 3])
        parameters = np.asarray(rigid.RotationMatrix2EulerParameters(pose[:3, :3]))
        change = np.asarray(rigid.AngularVelocity2EulerParameters_t(motion[:3], parameters))
        item_name = unused_name(mbs, name)
        node = mbs.AddNode(
            items.NodeRigidBodyEP(
                name=item_name,
                referenceCoordinates=[*pose[:3, 3], *parameters],
                initialVelocities=[*velocity, *change],
            )
        )
        assert segment.inertia is not None
        bodies[name] = mbs.AddObject(
            items.ObjectRigidBody(
                name=item_name,
                mass=segment.mass,
                inertia=[*segment.inertia, 0.0, 0.0, 0.0],
                nodeNumber=node,
            )
        )
        centre = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=bodies[name]))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=centre, loadVector=list(gravity)))
    return bodies, ground


def add_marker(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    segment: str,
    pose_in_segment: Array,
) -> Index:
    """A rigid marker on a segment at a pose in the segment frame, shape (4, 4)."""
    figure = placement.tree.figure
    if segment in figure.ground:
        pose = placement.poses[segment] @ pose_in_segment
    else:
        offset = homogeneous(np.eye(3), -centre_of_mass(figure.segments[segment]))
        pose = offset @ pose_in_segment
    return mbs.AddMarker(
        items.MarkerBodyRigid(
            bodyNumber=bodies[segment],
            localHT=exu.HT(rotation=pose[:3, :3], translation=pose[:3, 3]),
        )
    )
