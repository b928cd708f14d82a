"""Passive laws over several joints as Exudyn objects.

Exudyn's connectors have two bodies, so a coupled law is an `ObjectGenericODE2` on the nodes of all
its bodies: it adds forces on their Euler parameters, but no coordinates and no mass. Its user
function is always Python, because Exudyn 1.13.6 fails on symbolic vectors of more than seven
components. The Jacobian is provided because Exudyn's numerical one evaluates the forces twice per
coordinate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.coupled_motion import axis_sign
from generator.figure import SiteRef
from generator.rotations import unit_vector
from generator.simulation.exudyn_model.exudyn_api import Index, exu, items, unused_name
from generator.simulation.exudyn_model.relative_rotation import (
    CoordinateAngles,
    JointAngles,
    JointEnd,
    Quaternion,
    RelativeRotation,
    RevoluteAngles,
    SphericalAngles,
    build_joint_end,
)
from generator.simulation.exudyn_model.springs import Connector, JointKind, SpringBuilder
from springs import FLOATS, CoupledSpring
from springs.coordinates import CoordinateLaw

_COORDINATES_PER_BODY = 7
"""Number of coordinates of a rigid body with Euler parameters."""

Forces = list[float]


@dataclass(frozen=True)
class CoupledObject:
    """A coupled law built into the system.

    Attributes:
        item: the Exudyn object.
        spring: the law and its axes.
        functions: its user functions, which must outlive the system.
    """

    item: Index
    spring: CoupledSpring
    functions: tuple[Any, ...]


def add_coupled_spring(
    builder: SpringBuilder, spring: CoupledSpring, connectors: Mapping[str, tuple[Connector, ...]]
) -> CoupledObject:
    """Add the object of one coupled law.

    Args:
        builder: the system to build into.
        spring: a law without `model_obstacles`, over joints that all move.
        connectors: connectors by joint; each joint of the law has one that measures its rotation.
    """
    figure = builder.placement.tree.figure
    joints = [figure.joints[name] for name in dict.fromkeys(axis.joint for axis in spring.axes)]
    bodies = list(dict.fromkeys(ref.segment for joint in joints for ref in joint.ends))
    bodies = [name for name in bodies if name not in figure.ground]
    nodes = [builder.mbs.GetObject(builder.bodies[name])["nodeNumber"] for name in bodies]
    first_coordinates = {name: k * _COORDINATES_PER_BODY for k, name in enumerate(bodies)}

    def end(ref: SiteRef) -> JointEnd:
        place, reference = first_coordinates.get(ref.segment), (0.0, 0.0, 0.0, 0.0)
        if place is not None:
            node = builder.mbs.GetNode(nodes[place // _COORDINATES_PER_BODY])
            w, x, y, z = (float(node["referenceCoordinates"][k]) for k in range(3, 7))
            reference = (w, x, y, z)
        return build_joint_end(figure, builder.placement.poses, ref, place, reference)

    joint_terms: list[_JointTerm] = []
    for joint in joints:
        coordinate_indices = tuple(
            k for k, axis in enumerate(spring.axes) if axis.joint == joint.name
        )
        rotation_axes = builder.placement.tree.chains[joint.name].rotation_axes
        angle_node = None
        if len(rotation_axes) == 1:
            signs = tuple(axis_sign(spring.axes[k], rotation_axes[0]) for k in coordinate_indices)
            x, y, z = unit_vector(rotation_axes[0]).tolist()
            angles = RevoluteAngles((x, y, z), signs)
            angle_node = rotation_connector(connectors[joint.name]).angle_node
        else:
            directions = tuple(spring.axes[k].direction for k in coordinate_indices)
            law = rotation_connector(connectors[joint.name]).law
            angles = (
                CoordinateAngles(directions, law)
                if isinstance(law, CoordinateLaw)
                else SphericalAngles(directions)
            )
        rotation = RelativeRotation(end(joint.parent), end(joint.child))
        joint_terms.append(_JointTerm(rotation, angles, coordinate_indices, angle_node))
    user_functions = _CoupledUserFunctions(
        spring, tuple(joint_terms), len(bodies) * _COORDINATES_PER_BODY
    )
    item = builder.mbs.AddObject(
        items.ObjectGenericODE2(
            name=unused_name(builder.mbs, " ".join([*(j.name for j in joints), "spring"])),
            nodeNumbers=nodes,
            forceUserFunction=user_functions.forces,
            jacobianUserFunction=user_functions.jacobian,
        )
    )
    functions = (user_functions.forces, user_functions.jacobian)
    return CoupledObject(item, spring, functions)


def rotation_connector(connectors: Sequence[Connector]) -> Connector:
    """Return the connector that measures a joint's rotation."""
    return next(connector for connector in connectors if connector.kind is not JointKind.PRISMATIC)


@dataclass(frozen=True)
class _JointTerm:
    """A joint of a coupled law: its rotation, its coordinates in the law, its angle's node."""

    rotation: RelativeRotation
    angles: JointAngles
    coordinate_indices: tuple[int, ...]
    angle_node: Index | None

    def last_angle(self, mbs: Any) -> float:
        """Angle of the joint at the last step, by which whole turns are counted [rad]."""
        if self.angle_node is None:
            return 0.0
        return float(mbs.GetNodeOutput(self.angle_node, exu.OutputVariableType.Coordinates))

    def add_forces(
        self,
        forces: list[float],
        ends: tuple[Quaternion, Quaternion, Quaternion],
        torques: Sequence[float],
    ) -> None:
        """Add the generalized forces of torques about the angles [N m]."""
        self.rotation.add_forces(forces, ends, self.angles.gradient(ends[2], torques))


@dataclass(frozen=True)
class _CoupledUserFunctions:
    """User functions of a coupled law."""

    spring: CoupledSpring
    joint_terms: tuple[_JointTerm, ...]
    size: int

    def _angles(
        self, mbs: Any, q: Sequence[float]
    ) -> tuple[list[float], list[tuple[Quaternion, Quaternion, Quaternion]]]:
        """Angles of the law [rad], and the orientations of each joint's ends."""
        angles = [0.0] * len(self.spring.axes)
        ends = [term.rotation.orientations(q) for term in self.joint_terms]
        for term, (_, _, rotation) in zip(self.joint_terms, ends, strict=True):
            values = term.angles.values(rotation, term.last_angle(mbs))
            for index, value in zip(term.coordinate_indices, values, strict=True):
                angles[index] = value
        return angles, ends

    def forces(self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any) -> Forces:
        """Generalized forces on the bodies' coordinates: sum of torques times gradients."""
        angles, ends = self._angles(mbs, q)
        torques = self.spring.law.torques(angles, FLOATS)
        forces = [0.0] * self.size
        for term, orientations in zip(self.joint_terms, ends, strict=True):
            term.add_forces(forces, orientations, [torques[k] for k in term.coordinate_indices])
        return forces

    def jacobian(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, fODE2: float, fODE2_t: float
    ) -> Any:
        """Minus the derivatives of the forces with respect to the coordinates, times `fODE2`.

        The change of the gradients is neglected: a modified Newton iteration converges without it.
        """
        angles, ends = self._angles(mbs, q)
        gradients = np.zeros((len(angles), self.size))
        for term, orientations in zip(self.joint_terms, ends, strict=True):
            for k in term.coordinate_indices:
                forces = [0.0] * self.size
                term.add_forces(
                    forces, orientations, [float(k == index) for index in term.coordinate_indices]
                )
                gradients[k] = forces
        matrix = exu.MatrixContainer()
        slopes = np.array(self.spring.law.torque_jacobian(angles))
        dense = -fODE2 * gradients.T @ slopes @ gradients
        matrix.SetWithDenseMatrix(dense, useDenseMatrix=False)
        return matrix
