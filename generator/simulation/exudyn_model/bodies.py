"""Segments as Exudyn rigid bodies, joints as constraints between them, and loads at sites.

A body is referred to its centre of mass. A joint locks relative motions of two markers.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.diagnostics import ModelError
from generator.figure import Figure, Joint, Segment, SiteRef
from generator.joint_chain import FREE, LOCKED, LockedAxes
from generator.kinematics.placement import Placement, segment_jacobians
from generator.loads import TimedLoad
from generator.rotations import Array, inverse_pose, pose_matrix
from generator.simulation.exudyn_model.exudyn_api import (
    Index,
    MainSystem,
    exu,
    items,
    rigid,
    symbolic_user_function,
    symbols,
    unused_name,
)
from generator.simulation.run_model import require_centre_of_mass

Vector = tuple[float, float, float]


def body_pose(placement: Placement, segment: Segment) -> Array:
    """Pose in the world of the segment's axes at its centre of mass, shape (4, 4)."""
    return placement.poses[segment.name] @ pose_matrix(np.eye(3), require_centre_of_mass(segment))


def add_bodies(
    mbs: MainSystem, placement: Placement, rates: Array, gravity: Vector
) -> tuple[Mapping[str, Index], Index]:
    """Add the ground, and a rigid body with Euler parameters for each moving segment.

    Args:
        mbs: the system to build into.
        placement: initial poses of the segments.
        rates: rates of the tree's displacements [rad/s or m/s], shape (n,).
        gravity: [m/s^2].

    Raises:
        ModelError: a segment lacks mass, inertia or CM, or no segment moves.

    Returns:
        Object index of each segment (the ground's for fixed segments), and of the ground.
    """
    figure: Figure = placement.tree.figure
    if not figure.bodies:
        raise ModelError("the figure cannot be simulated: none of its segments moves")
    ground = mbs.AddObject(items.ObjectGround())
    bodies: dict[str, Index] = dict.fromkeys(figure.ground, ground)
    jacobians = segment_jacobians(placement)
    for name, segment in figure.bodies.items():
        pose = body_pose(placement, segment)
        motion = jacobians[name] @ rates
        velocity = motion[3:] + np.cross(motion[:3], pose[:3, 3])
        parameters = np.asarray(rigid.RotationMatrix2EulerParameters(pose[:3, :3]))
        parameter_rates = np.asarray(
            rigid.AngularVelocity2EulerParameters_t(motion[:3], parameters)
        )
        item_name = unused_name(mbs, name)
        node = mbs.AddNode(
            items.NodeRigidBodyEP(
                name=item_name,
                referenceCoordinates=[*pose[:3, 3], *parameters],
                initialVelocities=[*velocity, *parameter_rates],
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
        marker = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=bodies[name]))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=list(gravity)))
    return bodies, ground


def add_marker(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    segment: str,
    pose_in_segment: Array,
) -> Index:
    """Add a rigid marker to a segment at a pose in the segment frame, shape (4, 4)."""
    figure = placement.tree.figure
    if segment in figure.ground:
        pose = placement.poses[segment] @ pose_in_segment
    else:
        offset = pose_matrix(np.eye(3), -require_centre_of_mass(figure.segments[segment]))
        pose = offset @ pose_in_segment
    return mbs.AddMarker(
        items.MarkerBodyRigid(
            bodyNumber=bodies[segment],
            localHT=exu.HT(rotation=pose[:3, :3], translation=pose[:3, 3]),
        )
    )


@dataclass(frozen=True)
class Constraint:
    """A constraint built into the system: the Exudyn item and the axes that it locks."""

    item: Index
    locked_axes: LockedAxes

    @property
    def is_spherical(self) -> bool:
        """True for Exudyn's spherical joint, whose force is in world axes."""
        return (self.locked_axes.translations, self.locked_axes.rotations) == (LOCKED, FREE)


def add_constraints(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    joint: Joint,
    locks: tuple[LockedAxes, ...],
) -> tuple[Constraint, ...]:
    """Add the constraint items of one joint."""
    figure = placement.tree.figure
    added: list[Constraint] = []
    for lock in locks:
        frame = pose_matrix(lock.frame, np.zeros(3))
        poses = {
            joint.parent: figure.site(joint.parent).pose_in_segment,
            joint.child: figure.site(joint.child).pose_in_segment @ inverse_pose(lock.zero_pose),
        }
        ends = (joint.child, joint.parent) if lock.from_child else (joint.parent, joint.child)
        markers = [
            add_marker(mbs, placement, bodies, ref.segment, poses[ref] @ frame) for ref in ends
        ]
        name = unused_name(mbs, joint.name)
        added.append(Constraint(mbs.AddObject(_build_exudyn_joint(name, markers, lock)), lock))
    return tuple(added)


def _build_exudyn_joint(name: str, markers: list[Index], lock: LockedAxes) -> Any:
    """Return the Exudyn joint with these locked axes: spherical, revolute or generic."""
    if lock.translations == LOCKED and lock.rotations == FREE:
        return items.ObjectJointSpherical(name=name, markerNumbers=markers)
    if lock.translations == LOCKED and lock.rotations == (1, 1, 0):
        return items.ObjectJointRevoluteZ(name=name, markerNumbers=markers)
    return items.ObjectJointGeneric(
        name=name,
        markerNumbers=markers,
        constrainedAxes=[*lock.translations, *lock.rotations],
    )


def load_pose(figure: Figure, ref: SiteRef) -> Array:
    """Pose of a load in the segment frame: at the site, along the segment's axes; shape (4, 4)."""
    return pose_matrix(np.eye(3), figure.site(ref).pose_in_segment[:3, 3])


def add_loads(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    loads: Iterable[TimedLoad],
) -> tuple[tuple[Index, Any], ...]:
    """Add load items; return the marker of each and the user function to keep alive."""
    figure = placement.tree.figure
    added: list[tuple[Index, Any]] = []
    for load in loads:
        point = load_pose(figure, load.site)
        marker = add_marker(mbs, placement, bodies, load.site.segment, point)
        name = "LoadForceVector" if load.kind.is_force else "LoadTorqueVector"
        function = _load_user_function(mbs, load, name)
        mbs.AddLoad(
            getattr(items, name)(
                markerNumber=marker,
                loadVector=[0.0, 0.0, 0.0],
                bodyFixed=load.kind.is_local,
                loadVectorUserFunction=function,
            )
        )
        added.append((marker, function))
    return tuple(added)


def _load_user_function(mbs: MainSystem, load: TimedLoad, item: str) -> Any:
    """Record the load's value as an expression tree in time."""
    times = np.asarray(load.times, dtype=float)
    values = np.asarray(load.values, dtype=float)

    def value(mbs: Any, t: Any, loadVector: Any) -> Any:
        return symbols.Vector([_interpolate_or_zero(t, times, values[:, k]) for k in range(3)])

    return symbolic_user_function(mbs, value, "loadVectorUserFunction", item)


def _interpolate_or_zero(t: Any, times: Array, values: Array) -> Any:
    """Interpolate linearly between the rows; return zero before the first and after the last."""
    if not np.any(values):
        return symbols.Real(0.0)
    zero = symbols.Real(0.0)
    inside = _interpolation_tree(t, times, values)
    after_start = symbols.IfThenElse(t > float(times[-1]), zero, inside)
    return symbols.IfThenElse(t < float(times[0]), zero, after_start)


def _interpolation_tree(t: Any, times: Array, values: Array) -> Any:
    """Interpolate linearly by a balanced tree of conditions, whose cost is logarithmic."""
    if times.size == 1:
        return symbols.Real(float(values[0]))
    if times.size == 2:
        slope = float((values[1] - values[0]) / (times[1] - times[0]))
        return symbols.Real(float(values[0])) + slope * (t - float(times[0]))
    middle = times.size // 2
    return symbols.IfThenElse(
        t < float(times[middle]),
        _interpolation_tree(t, times[: middle + 1], values[: middle + 1]),
        _interpolation_tree(t, times[middle:], values[middle:]),
    )
