"""Springs along the translations of a joint.

What the connectors of springs have in common: how they are kept, and where they are hung.

One law of `springs` becomes an expression tree that Exudyn evaluates in C++, or on request a Python
function that it calls back. Exudyn counts connector torques on the left-hand side: the functions
return minus the torque on the child.

Springs of a joint of several rotations: a torque of the rotation vector, half-way.

Springs about the only rotation of a joint: a torque of its unwrapped angle.

The connectors of a joint's springs and damping: of its hinge or ball, and of its slides.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from generator.diagnostics import ModelError
from generator.figure import Joint
from generator.joint_chain import Chain
from generator.kinematics.placement import Placement
from generator.rotations import (
    PERPENDICULAR_TOLERANCE,
    Array,
    pose_matrix,
    rotation_with_z_axis,
    unit_vector,
)
from generator.simulation.bodies import add_marker
from generator.simulation.exudyn_api import (
    SYMBOLIC,
    Index,
    MainSystem,
    items,
    symbolic_user_function,
    symbols,
    unused_name,
)
from generator.simulation.preconditions import unsupported_spring
from springs import (
    FLOATS,
    AxisSpring,
    Joining,
    JointSprings,
    Operations,
    Real,
    damping_torque,
    elastic_torque,
    total_torque,
)


class JointKind(Enum):
    """The kind of displacement that a connector acts on."""

    REVOLUTE = "revolute"
    """One angle."""
    SPHERICAL = "spherical"
    """A rotation vector."""
    PRISMATIC = "prismatic"
    """One translation."""


@dataclass(frozen=True)
class Connector:
    """A spring as it stands in the system, or what only reads a joint's angle.

    Attributes:
        item: the Exudyn connector.
        springs: the axes it holds; none where it only reads.
        kind: the displacement that it acts on.
        function: its user function, which must outlive the system; None where it only reads.
        axis_index: of a hinge or a slide, the factor of the joint's chain whose displacement it takes.
        output_weights: of a hinge or a slide, what turns the item's output into that displacement.
        angle_node: of a hinge, the node that keeps its angle at the last step.
    """

    item: Index
    springs: tuple[AxisSpring, ...]
    kind: JointKind
    function: Any
    axis_index: int = 0
    output_weights: tuple[float, ...] = (1.0,)
    angle_node: Index | None = None


@dataclass(frozen=True)
class SpringBuilder:
    """Where connectors are hung: the system, the figure's start in it, and the kind of functions.

    Attributes:
        mbs: the Exudyn system.
        placement: the figure's start.
        bodies: Exudyn object of each segment.
        python_torques: whether laws become Python functions instead of expression trees.
    """

    mbs: MainSystem
    placement: Placement
    bodies: Mapping[str, Index]
    python_torques: bool = False

    def add_markers(self, joint: Joint, frame: Array) -> list[Index]:
        """Markers at the parent's and the child's site, their axes turned by `frame`."""
        turn = pose_matrix(frame, np.zeros(3))
        figure = self.placement.tree.figure
        return [
            add_marker(
                self.mbs,
                self.placement,
                self.bodies,
                ref.segment,
                figure.site(ref).pose_in_segment @ turn,
            )
            for ref in (joint.parent, joint.child)
        ]

    def function(self, function: Any, field: str, item: str) -> Any:
        """The function itself, or its expression tree."""
        if self.python_torques:
            return function
        return symbolic_user_function(self.mbs, function, field, item)


def orient_spring(spring: AxisSpring, axis: tuple[float, float, float]) -> AxisSpring:
    """The spring told about `axis`, which is its direction or the opposite of it."""
    return spring if float(np.dot(spring.direction, axis)) > 0.0 else spring.with_opposite_axis()


def generalized_force(spring: AxisSpring, value: Real, rate: Real, ops: Operations) -> Real:
    """Torque or force on the child of a spring of one displacement."""
    return total_torque(spring.elastic, value, ops) + spring.resistance(value, rate, ops)


_TORQUE_ROWS = np.vstack([np.zeros((3, 3)), -np.eye(3)])
"""Puts a torque on the child into Exudyn's left-hand six-vector of force and torque."""

WrenchFunction = Callable[[Any, Any, Any, Any], Any]
"""Left-hand six-vector of force and torque, of a connector's displacement [m], rotation vector
[rad], velocity [m/s] and angular velocity [rad/s]."""


def _add_wrench_connector(
    builder: SpringBuilder, joint: Joint, wrench: WrenchFunction | None
) -> tuple[Index, Any]:
    """A connector between the sites of a joint, and its user function; without one, a sensor."""

    def user_function(
        mbs: Any,
        t: Real,
        itemNumber: Real,
        displacement: Any,
        rotation: Any,
        velocity: Any,
        angularVelocity: Any,
        stiffness: Any,
        damping: Any,
        rotJ0: Any,
        rotJ1: Any,
        offset: Any,
    ) -> Any:
        assert wrench is not None
        return wrench(displacement, rotation, velocity, angularVelocity)

    function = None
    if wrench is not None:
        function = builder.function(
            user_function, "springForceTorqueUserFunction", "ObjectConnectorRigidBodySpringDamper"
        )
    item = builder.mbs.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(
            name=unused_name(builder.mbs, f"{joint.name} spring"),
            markerNumbers=builder.add_markers(joint, np.eye(3)),
            useIntrinsicFormulation=True,
            springForceTorqueUserFunction=0 if function is None else function,
        )
    )
    return item, function


def _scalar_user_function(builder: SpringBuilder, spring: AxisSpring, field: str, item: str) -> Any:
    """The user function of a torsional or linear connector: minus the force of a spring."""
    ops = FLOATS if builder.python_torques else SYMBOLIC

    def user_function(
        mbs: Any,
        t: Real,
        itemNumber: Real,
        displacement: Real,
        velocity: Real,
        stiffness: Real,
        damping: Real,
        offset: Real,
    ) -> Real:
        return -generalized_force(spring, displacement, velocity, ops)

    return builder.function(user_function, field, item)


def add_spherical_spring(
    builder: SpringBuilder, joint: Joint, axes: tuple[AxisSpring, ...], joining: Joining
) -> Connector:
    """A torque of the rotation vector, in the half-way frame; without axes, a reader of it."""

    def torque(rotation: Any, rate: Any, ops: Operations) -> Any:
        elastic = elastic_torque(joining, axes, rotation, ops)
        return elastic + damping_torque(axes, rotation, rate, ops)

    def wrench(displacement: Any, rotation: Any, velocity: Any, rate: Any) -> Any:
        if builder.python_torques:
            return _TORQUE_ROWS @ torque(np.asarray(rotation), np.asarray(rate), FLOATS)
        return symbols.Matrix(_TORQUE_ROWS.tolist()) * torque(rotation, rate, SYMBOLIC)

    item, function = _add_wrench_connector(builder, joint, wrench if axes else None)
    return Connector(item, axes, JointKind.SPHERICAL, function)


def add_revolute_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring | None
) -> Connector:
    """A torque about one axis; without a spring, a reader of the angle."""
    if spring is None:
        return _add_torsional_connector(builder, joint, chain, (), None)
    spring = orient_spring(spring, chain.rotation_axes[0])
    function = _scalar_user_function(
        builder, spring, "springTorqueUserFunction", "ObjectConnectorTorsionalSpringDamper"
    )
    return _add_torsional_connector(builder, joint, chain, (spring,), function)


def _add_torsional_connector(
    builder: SpringBuilder,
    joint: Joint,
    chain: Chain,
    springs: tuple[AxisSpring, ...],
    function: Any,
) -> Connector:
    mbs = builder.mbs
    start = float(builder.placement.displacements[joint.name][chain.rotations[0]])
    counter = mbs.AddNode(
        items.NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[start])
    )
    item = mbs.AddObject(
        items.ObjectConnectorTorsionalSpringDamper(
            name=unused_name(mbs, f"{joint.name} spring"),
            markerNumbers=builder.add_markers(joint, rotation_with_z_axis(chain.rotation_axes[0])),
            nodeNumber=counter,
            springTorqueUserFunction=0 if function is None else function,
        )
    )
    return Connector(
        item, springs, JointKind.REVOLUTE, function, chain.rotations[0], angle_node=counter
    )


def add_prismatic_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring
) -> Connector:
    """A force along one translation of a joint. Raises ModelError without one along the spring."""
    if len(chain.translations) == 1:
        return _add_single_translation_spring(builder, joint, chain, spring)
    return _add_multi_translation_spring(builder, joint, chain, spring)


def _add_single_translation_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring
) -> Connector:
    """A force along the only translation of a joint."""
    place = _translation_index(joint, chain, spring)
    spring = orient_spring(spring, chain.joint_axes[place].axis)
    function = _scalar_user_function(
        builder, spring, "springForceUserFunction", "ObjectConnectorLinearSpringDamper"
    )
    markers, axis = builder.add_markers(joint, np.eye(3)), spring.direction
    if not chain.translations_are_outer:
        # The axis is the child's, and seen from there the parent slides the other way.
        markers, axis = markers[::-1], tuple(-c for c in axis)
    item = builder.mbs.AddObject(
        items.ObjectConnectorLinearSpringDamper(
            name=unused_name(builder.mbs, f"{joint.name} spring"),
            markerNumbers=markers,
            axisMarker0=list(axis),
            springForceUserFunction=function,
        )
    )
    return Connector(item, (spring,), JointKind.PRISMATIC, function, place)


def _add_multi_translation_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring
) -> Connector:
    """A force along one of several translations of a joint that does not turn.

    The force acts on both bodies at the child's site, which the other slides carry away from the
    parent's. Exudyn's intrinsic connector applies what it is given half-way between the two, so the
    force has a moment about that point.
    """
    place = _translation_index(joint, chain, spring)
    spring = orient_spring(spring, chain.joint_axes[place].axis)
    ops = FLOATS if builder.python_torques else SYMBOLIC
    axes = np.array([chain.joint_axes[k].axis for k in chain.translations]).T
    # What reads one displacement where the slides are oblique to each other.
    x, y, z = np.linalg.pinv(axes)[chain.translations.index(place)].tolist()

    def wrench(displacement: Any, rotation: Any, velocity: Any, angular_velocity: Any) -> Any:
        p, q, r = (displacement[k] for k in range(3))
        speed = x * velocity[0] + y * velocity[1] + z * velocity[2]
        force = -generalized_force(spring, x * p + y * q + z * r, speed, ops)
        arms = (q * z - r * y, r * x - p * z, p * y - q * x)
        parts = [force * x, force * y, force * z, *(0.5 * arm * force for arm in arms)]
        return np.array(parts) if builder.python_torques else symbols.Vector(parts)

    item, function = _add_wrench_connector(builder, joint, wrench)
    return Connector(item, (spring,), JointKind.PRISMATIC, function, place, (x, y, z))


def _translation_index(joint: Joint, chain: Chain, spring: AxisSpring) -> int:
    """The factor of a chain along which a spring is. Raises ModelError when there is none."""
    for k in chain.translations:
        across = np.cross(unit_vector(chain.joint_axes[k].axis), spring.direction)
        if float(np.linalg.norm(across)) < PERPENDICULAR_TOLERANCE:
            return k
    raise ModelError(f"joint {joint.name} does not slide along {spring.direction}")


def add_joint_springs(
    builder: SpringBuilder,
    joint: Joint,
    springs: JointSprings,
    joining: Joining,
    *,
    read_rotation: bool = False,
) -> tuple[Connector, ...]:
    """The connectors of one joint's springs.

    Args:
        builder: where they are hung.
        joint: of the figure.
        springs: about its axes and along its slides.
        joining: how the axes of a ball join.
        read_rotation: whether the joint's turn is read in any case, also without springs about its axes.

    Raises:
        ModelError: springs about axes or along slides that the joint's chain does not have, or that
            no simulation supports.
    """
    chain = builder.placement.tree.chains[joint.name]
    if springs.axes and not chain.rotations:
        raise ModelError(f"joint {joint.name} has springs about axes but no rotation")
    if springs.translations and not chain.translations:
        raise ModelError(f"joint {joint.name} has springs along slides but no translation")
    refusal = unsupported_spring(builder.placement, joint, springs, is_coupled=read_rotation)
    if refusal is not None:
        raise ModelError(refusal.reason)
    made: list[Connector] = []
    if springs.axes or read_rotation:
        if len(chain.rotations) == 1:
            axis = springs.axes[0] if springs.axes else None
            made.append(add_revolute_spring(builder, joint, chain, axis))
        else:
            made.append(add_spherical_spring(builder, joint, springs.axes, joining))
    made.extend(
        add_prismatic_spring(builder, joint, chain, slide) for slide in springs.translations
    )
    return tuple(made)
