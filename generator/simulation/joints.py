"""Joints of a figure as Exudyn's joints, which lock relative motions of two markers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.figure import Joint
from generator.kinematics.closures import FREE, LOCKED, LockedAxes
from generator.kinematics.placement import Placement
from generator.rotations import inverse_pose, pose_matrix
from generator.simulation.bodies import add_marker
from generator.simulation.exudyn_api import Index, MainSystem, items, unused_name


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
