"""Springs along the translations of a joint.

What the connectors of springs have in common: how they are kept, and where they are hung.

One law of `springs` becomes an expression tree that Exudyn evaluates in C++, or on request a Python
function that it calls back. Exudyn counts connector torques on the left-hand side: the functions
return minus the torque on the child.

Springs of a joint of several rotations: a torque of the rotation vector, half-way.

Springs about the only rotation of a joint: a torque of its unwrapped angle.

The connectors of a joint's springs and damping: of its hinge or ball, and of its slides.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.diagnostics import MoverError
from generator.figure import Joint
from generator.joint_chain import Chain
from generator.kinematics.placement import Placement
from generator.rotations import (
    PERPENDICULAR_TOLERANCE,
    Array,
    pose_matrix,
    rotation_vector_from_matrix,
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
from springs.elastic import Frictional


class SpringError(MoverError):
    """A spring that no connector can hold."""


@dataclass(frozen=True)
class Connector:
    """A spring as it stands in the system, or what only reads a joint's angle.

    Attributes:
        item: the Exudyn connector.
        springs: the axes it holds; none where it only reads.
        kind: "hinge" (one angle), "ball" (a rotation vector) or "slide" (one translation).
        function: its user function, which must outlive the system; None where it only reads.
        axis_index: of a hinge or a slide, the factor of the joint's chain whose displacement it takes.
        output_weights: of a hinge or a slide, what turns the item's output into that displacement.
        angle_node: of a hinge, the node that keeps its angle at the last step.
    """

    item: Index
    springs: tuple[AxisSpring, ...]
    kind: str
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

_HALF_TURN_TOLERANCE = 1e-6
"""A start nearer than this to 180 deg falls to either side by its rounding [rad]."""


def add_spherical_spring(
    builder: SpringBuilder, joint: Joint, axes: tuple[AxisSpring, ...], joining: Joining
) -> Connector:
    """A torque of the rotation vector, in the half-way frame; without axes, a reader of it.

    Raises:
        SpringError: an elastic torque that would start at 180 deg.
    """
    if any(axis.elastic for axis in axes):
        check_half_turn(builder, joint)

    def torque(rotation: Any, rate: Any, ops: Operations) -> Any:
        elastic = elastic_torque(joining, axes, rotation, ops)
        return elastic + damping_torque(axes, rotation, rate, ops)

    def in_symbols(
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
        return symbols.Matrix(_TORQUE_ROWS.tolist()) * torque(rotation, angularVelocity, SYMBOLIC)

    def in_python(
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
        return _TORQUE_ROWS @ torque(np.asarray(rotation), np.asarray(angularVelocity), FLOATS)

    name = "ObjectConnectorRigidBodySpringDamper"
    field = "springForceTorqueUserFunction"
    used = in_python if builder.python_torques else in_symbols
    function = builder.function(used, field, name) if axes else None
    item = builder.mbs.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(
            name=unused_name(builder.mbs, f"{joint.name} spring"),
            markerNumbers=builder.add_markers(joint, np.eye(3)),
            useIntrinsicFormulation=True,
            springForceTorqueUserFunction=0 if function is None else function,
        )
    )
    return Connector(item, axes, "ball", function)


def check_half_turn(builder: SpringBuilder, joint: Joint) -> None:
    """Raises SpringError where a joint of several turns starts at 180 deg."""
    angle = np.linalg.norm(
        rotation_vector_from_matrix(builder.placement.pose_in_parent(joint)[:3, :3])
    )
    if angle > np.pi - _HALF_TURN_TOLERANCE:
        raise SpringError(
            f"joint {joint.name} starts at 180 deg, where the torque of its springs is not defined"
        )


def add_revolute_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring | None
) -> Connector:
    """A torque about one axis; without a spring, a reader of the angle."""
    if spring is None:
        return _add_torsional_connector(builder, joint, chain, (), None)
    spring = orient_spring(spring, chain.rotation_axes[0])
    ops = FLOATS if builder.python_torques else SYMBOLIC

    def left_hand_torque(
        mbs: Any,
        t: Real,
        itemNumber: Real,
        rotation: Real,
        angularVelocity: Real,
        stiffness: Real,
        damping: Real,
        offset: Real,
    ) -> Real:
        return -generalized_force(spring, rotation, angularVelocity, ops)

    name = "ObjectConnectorTorsionalSpringDamper"
    function = builder.function(left_hand_torque, "springTorqueUserFunction", name)
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
    return Connector(item, springs, "hinge", function, chain.rotations[0], angle_node=counter)


def add_prismatic_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring
) -> Connector:
    """A force along one translation of a joint.

    Raises:
        SpringError: the joint does not slide there, or slides in a way that is not supported.
    """
    if len(chain.translations) > 1 and chain.rotations:
        raise SpringError(
            f"joint {joint.name} both turns and slides along more than one axis: "
            "springs along its slides are not supported"
        )
    held = {ref.segment for ref in joint.ends} & builder.placement.tree.figure.ground
    if len(chain.translations) > 1 and not held and _has_damping(spring):
        # Exudyn gives the difference of two points' velocities, which holds the parent's turning.
        raise SpringError(
            f"joint {joint.name} slides along more than one axis between two moving segments: "
            "damping along its slides is not supported"
        )
    hang = (
        _add_single_translation_spring
        if len(chain.translations) == 1
        else _add_multi_translation_spring
    )
    return hang(builder, joint, chain, spring)


def _add_single_translation_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring
) -> Connector:
    """A force along the only translation of a joint."""
    place = _translation_index(joint, chain, spring)
    spring = orient_spring(spring, chain.joint_axes[place].axis)
    ops = FLOATS if builder.python_torques else SYMBOLIC

    def left_hand_force(
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

    name = "ObjectConnectorLinearSpringDamper"
    function = builder.function(left_hand_force, "springForceUserFunction", name)
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
    return Connector(item, (spring,), "slide", function, place)


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

    def left_hand(displacement: Any, velocity: Any) -> list[Real]:
        p, q, r = (displacement[k] for k in range(3))
        speed = x * velocity[0] + y * velocity[1] + z * velocity[2]
        force = -generalized_force(spring, x * p + y * q + z * r, speed, ops)
        arms = (q * z - r * y, r * x - p * z, p * y - q * x)
        return [force * x, force * y, force * z, *(0.5 * arm * force for arm in arms)]

    def six(
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
        parts = left_hand(displacement, velocity)
        return np.array(parts) if builder.python_torques else symbols.Vector(parts)

    name = "ObjectConnectorRigidBodySpringDamper"
    function = builder.function(six, "springForceTorqueUserFunction", name)
    item = builder.mbs.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(
            name=unused_name(builder.mbs, f"{joint.name} spring"),
            markerNumbers=builder.add_markers(joint, np.eye(3)),
            useIntrinsicFormulation=True,
            springForceTorqueUserFunction=function,
        )
    )
    return Connector(item, (spring,), "slide", function, place, (x, y, z))


def _has_damping(spring: AxisSpring) -> bool:
    rubs = any(isinstance(law, Frictional) for law in spring.elastic)
    return rubs or spring.damping.viscous > 0.0 or spring.damping.coulomb > 0.0


def _translation_index(joint: Joint, chain: Chain, spring: AxisSpring) -> int:
    """The factor of a chain along which a spring is. Raises SpringError when there is none."""
    for k in chain.translations:
        across = np.cross(unit_vector(chain.joint_axes[k].axis), spring.direction)
        if float(np.linalg.norm(across)) < PERPENDICULAR_TOLERANCE:
            return k
    raise SpringError(f"joint {joint.name} does not slide along {spring.direction}")


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
        SpringError: springs about axes or along slides that the joint's chain does not have.
    """
    chain = builder.placement.tree.chains[joint.name]
    if springs.axes and not chain.rotations:
        raise SpringError(f"joint {joint.name} has springs about axes but no rotation")
    if springs.translations and not chain.translations:
        raise SpringError(f"joint {joint.name} has springs along slides but no translation")
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
