"""Passive laws over several joints, as one Exudyn object on all bodies concerned.

Exudyn has connectors of two bodies only, so a coupled law is an `ObjectGenericODE2` on the nodes
that the bodies have anyway: it adds no coordinates and no mass, only forces on the bodies' Euler
parameters. Its function is Python in any case: Exudyn 1.13.6 breaks down over symbolic vectors of
more than seven components, which are the coordinates of a single body. The Jacobian is given, since
Exudyn would ask for the forces twice a coordinate to find it.

Coupled laws over a motion: their angles, their torques on the joints and their energy.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.diagnostics import ModelError, spelling_hint
from generator.figure import AxisKind, Figure, SiteRef
from generator.joint_chain import Chain
from generator.rotations import PERPENDICULAR_TOLERANCE, Array, unit_vector
from generator.simulation.exudyn_api import Index, exu, items, unused_name
from generator.simulation.relative_rotation import (
    JointAngles,
    JointEnd,
    Quaternion,
    RelativeRotation,
    RevoluteAngles,
    SphericalAngles,
    build_joint_end,
)
from generator.simulation.springs import Connector, JointKind, SpringBuilder
from springs import FLOATS, CoupledAxis, CoupledSpring, group_torque

_COORDINATES_PER_BODY = 7
"""Of a rigid body with Euler parameters."""

Forces = list[float]


@dataclass(frozen=True)
class CoupledObject:
    """A coupled law as it stands in the system.

    Attributes:
        item: the Exudyn object.
        spring: the law and where its coordinates are.
        functions: its user functions, which must outlive the system.
        is_conservative: whether the law has an energy.
    """

    item: Index
    spring: CoupledSpring
    functions: tuple[Any, ...]
    is_conservative: bool


def check_coupled(figure: Figure, springs: Sequence[CoupledSpring]) -> None:
    """Refuse coupled laws that do not fit a figure.

    Raises:
        ModelError: an unknown joint, a joint without turns, or an axis that a joint does not have.
    """
    for spring in springs:
        for name, axis in zip(spring.law.coordinates, spring.axes, strict=True):
            joint = figure.joints.get(axis.joint)
            if joint is None:
                raise ModelError(
                    f"the figure has no joint {axis.joint}, to which a coupled law gives its "
                    f"{name}; {spelling_hint(axis.joint, figure.joints)}"
                )
            turns = [
                unit_vector(factor.axis)
                for factor in joint.chain
                if factor.kind is AxisKind.ROTATION
            ]
            if not turns:
                raise ModelError(f"joint {joint.name} has the {name} of a coupled law but no turn")
            across = _distance_from_span(np.array(turns), np.asarray(axis.direction))
            if across > PERPENDICULAR_TOLERANCE:
                raise ModelError(
                    f"joint {joint.name} does not turn about {axis.direction}, the axis of the "
                    f"{name} of a coupled law"
                )


def _distance_from_span(axes: Array, direction: Array) -> float:
    """Length of what no sum of the axes, shape (n, 3), gives of a direction."""
    return float(np.linalg.norm(direction - axes.T @ np.linalg.lstsq(axes.T, direction)[0]))


def add_coupled_spring(
    builder: SpringBuilder, spring: CoupledSpring, connectors: Mapping[str, tuple[Connector, ...]]
) -> CoupledObject:
    """The object of one coupled law.

    Args:
        builder: where it is hung.
        spring: a law that `check_coupled` has let pass, over joints that all move.
        connectors: of the joints; those that it is about have one that reads the turn.
    """
    figure = builder.placement.tree.figure
    joints = [figure.joints[name] for name in dict.fromkeys(axis.joint for axis in spring.axes)]
    bodies = list(dict.fromkeys(ref.segment for joint in joints for ref in joint.ends))
    bodies = [name for name in bodies if name not in figure.ground]
    nodes = [builder.mbs.GetObject(builder.bodies[name])["nodeNumber"] for name in bodies]
    places = {name: k * _COORDINATES_PER_BODY for k, name in enumerate(bodies)}

    def end(ref: SiteRef) -> JointEnd:
        place, rest = places.get(ref.segment), (0.0, 0.0, 0.0, 0.0)
        if place is not None:
            node = builder.mbs.GetNode(nodes[place // _COORDINATES_PER_BODY])
            w, x, y, z = (float(node["referenceCoordinates"][k]) for k in range(3, 7))
            rest = (w, x, y, z)
        return build_joint_end(figure, builder.placement.poses, ref, place, rest)

    parts: list[_JointTerm] = []
    for joint in joints:
        mine = tuple(k for k, axis in enumerate(spring.axes) if axis.joint == joint.name)
        turn_axes = builder.placement.tree.chains[joint.name].rotation_axes
        counter = None
        if len(turn_axes) == 1:
            signs = tuple(axis_sign(spring.axes[k], turn_axes[0]) for k in mine)
            x, y, z = unit_vector(turn_axes[0]).tolist()
            angles = RevoluteAngles((x, y, z), signs)
            counter = rotation_connector(connectors[joint.name]).angle_node
        else:
            angles = SphericalAngles(tuple(spring.axes[k].direction for k in mine))
        turn = RelativeRotation(end(joint.parent), end(joint.child))
        parts.append(_JointTerm(turn, angles, mine, counter))
    law = _CoupledUserFunctions(spring, tuple(parts), len(bodies) * _COORDINATES_PER_BODY)
    item = builder.mbs.AddObject(
        items.ObjectGenericODE2(
            name=unused_name(builder.mbs, " ".join([*(j.name for j in joints), "spring"])),
            nodeNumbers=nodes,
            forceUserFunction=law.forces,
            jacobianUserFunction=law.jacobian,
        )
    )
    functions = (law.forces, law.jacobian)
    return CoupledObject(item, spring, functions, spring.law.is_conservative)


def axis_sign(axis: CoupledAxis, turn_axis: tuple[float, float, float]) -> float:
    """1 where a coordinate grows with turns about a hinge's axis, else -1."""
    return float(np.sign(np.dot(axis.direction, turn_axis)))


def rotation_connector(connectors: Sequence[Connector]) -> Connector:
    """The connector among a joint's own that reads its turn."""
    return next(connector for connector in connectors if connector.kind is not JointKind.PRISMATIC)


@dataclass(frozen=True)
class _JointTerm:
    """A joint of a coupled law: its turn, the coordinates it gives, what counts whole turns."""

    rotation: RelativeRotation
    angles: JointAngles
    coordinate_indices: tuple[int, ...]
    angle_node: Index | None

    def last_angle(self, mbs: Any) -> float:
        """The joint's angle at the last step, to tell whole turns [rad]."""
        if self.angle_node is None:
            return 0.0
        return float(mbs.GetNodeOutput(self.angle_node, exu.OutputVariableType.Coordinates))

    def add_forces(
        self,
        forces: list[float],
        ends: tuple[Quaternion, Quaternion, Quaternion],
        torques: Sequence[float],
    ) -> None:
        """Add what torques per radian of the angles [N m] are to the bodies' Euler parameters."""
        self.rotation.add_forces(forces, ends, self.angles.gradient(ends[2], torques))


@dataclass(frozen=True)
class _CoupledUserFunctions:
    """The user functions of a coupled law."""

    spring: CoupledSpring
    joint_terms: tuple[_JointTerm, ...]
    size: int

    def _angles(
        self, mbs: Any, q: Sequence[float]
    ) -> tuple[list[float], list[tuple[Quaternion, Quaternion, Quaternion]]]:
        """The law's angles [rad], and the orientations of each part's ends."""
        angles = [0.0] * len(self.spring.axes)
        ends = [part.rotation.orientations(q) for part in self.joint_terms]
        for part, (_, _, turn) in zip(self.joint_terms, ends, strict=True):
            values = part.angles.values(turn, part.last_angle(mbs))
            for place, value in zip(part.coordinate_indices, values, strict=True):
                angles[place] = value
        return angles, ends

    def forces(self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any) -> Forces:
        """Generalized forces on the bodies' coordinates: sum of torques times gradients."""
        angles, ends = self._angles(mbs, q)
        torques = self.spring.law.torques(angles, FLOATS)
        forces = [0.0] * self.size
        for part, its in zip(self.joint_terms, ends, strict=True):
            part.add_forces(forces, its, [torques[k] for k in part.coordinate_indices])
        return forces

    def jacobian(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, fODE2: float, fODE2_t: float
    ) -> Any:
        """Minus the slopes of the forces by the coordinates, times `fODE2`.

        Only the torques are varied: how the gradients turn with the bodies is left out, as a
        modified Newton iteration converges well without.
        """
        angles, ends = self._angles(mbs, q)
        gradients = np.zeros((len(angles), self.size))
        for part, its in zip(self.joint_terms, ends, strict=True):
            for k in part.coordinate_indices:
                forces = [0.0] * self.size
                part.add_forces(
                    forces, its, [float(k == place) for place in part.coordinate_indices]
                )
                gradients[k] = forces
        matrix = exu.MatrixContainer()
        slopes = np.array(self.spring.law.torque_jacobian(angles))
        dense = -fODE2 * gradients.T @ slopes @ gradients
        matrix.SetWithDenseMatrix(dense, useDenseMatrix=False)
        return matrix


JointRotations = Mapping[str, Array]
"""By joint n turns: of a hinge the unwrapped angle, shape (n,) [rad]; else the rotation vector of
the child's site in the parent's, shape (n, 3) [rad]."""


def coupled_angles(
    spring: CoupledSpring, chains: Mapping[str, Chain], rotations: JointRotations
) -> list[Array]:
    """The law's angles, in the order of its coordinates, shape (n,) each [rad]."""
    return [
        _rotation_sign(axis, chains) * _rotation_component(axis, rotations[axis.joint])
        for axis in spring.axes
    ]


def coupled_torques(
    spring: CoupledSpring, chains: Mapping[str, Chain], rotations: JointRotations
) -> dict[str, Array]:
    """Torque on the child of each joint concerned [N m].

    Of a hinge about its axis, shape (n,); of a ball in the half-way frame, shape (n, 3).
    """
    sums: dict[str, Array] = {}
    sizes = spring.law.torques(coupled_angles(spring, chains, rotations))
    for axis, size in zip(spring.axes, sizes, strict=True):
        turn = rotations[axis.joint]
        size = np.broadcast_to(size, turn.shape[:1])
        one = (
            size * _rotation_sign(axis, chains)
            if turn.ndim == 1
            else np.outer(size, axis.direction)
        )
        sums[axis.joint] = sums[axis.joint] + one if axis.joint in sums else one
    return {
        name: one if one.ndim == 1 else group_torque(one, rotations[name])
        for name, one in sums.items()
    }


def coupled_energy(
    spring: CoupledSpring, chains: Mapping[str, Chain], rotations: JointRotations
) -> Array:
    """Stored energy of a law that has one, shape (n,) [J]."""
    return np.asarray(spring.law.energy(coupled_angles(spring, chains, rotations)))


def _rotation_component(axis: CoupledAxis, rotation: Array) -> Array:
    return rotation if rotation.ndim == 1 else rotation @ np.asarray(axis.direction)


def _rotation_sign(axis: CoupledAxis, chains: Mapping[str, Chain]) -> float:
    """The sense in which a hinge's angle is counted; 1 for a ball."""
    axes = chains[axis.joint].rotation_axes
    return axis_sign(axis, axes[0]) if len(axes) == 1 else 1.0
