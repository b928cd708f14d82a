"""Springs and damping of joints as Exudyn connectors.

A law of `springs` becomes an expression tree that Exudyn evaluates in C++, or on request a Python
function. Exudyn has connector torques on the left-hand side, so the functions return minus the
torque on the child. The springs of a revolute are a torque of its unwrapped angle, those of a joint
of several rotations a torque of its rotation vector in the half-way frame.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from generator.figure import Joint, is_rotation
from generator.joint_chain import Chain
from generator.kinematics.placement import Placement
from generator.rotations import (
    Array,
    matrix_from_rotation_vector,
    pose_matrix,
    rotation_with_z_axis,
)
from generator.simulation.exudyn_model.bodies import add_marker
from generator.simulation.exudyn_model.exudyn_api import (
    SYMBOLIC,
    Index,
    MainSystem,
    items,
    symbolic_user_function,
    symbols,
    unused_name,
)
from generator.simulation.muscle_tone import JointTones
from springs import (
    FLOATS,
    AxisSpring,
    JointSprings,
    Operations,
    ReachLaw,
    Real,
    RotationLaw,
    SphericalLaw,
    rotation_law,
    total_torque,
)
from springs.spherical import VectorLaw
from springs.tone.law import AxisTone, rotation_tone


class JointKind(Enum):
    """The kind of displacement that a connector acts on."""

    REVOLUTE = "revolute"
    """One angle."""
    SPHERICAL = "spherical"
    """A rotation vector."""
    PRISMATIC = "prismatic"
    """One translation."""


def _screw_chord(displacement: Array, rotation: Array) -> Array:
    """Return the straight displacement of a screw, in the axes half-way, shape (..., 3) [m]."""
    half = 0.5 * np.linalg.norm(rotation, axis=-1, keepdims=True)
    axis = np.divide(rotation, 2.0 * half, out=np.zeros_like(rotation), where=half > 0.0)
    along = np.sum(axis * displacement, axis=-1, keepdims=True) * axis
    return along + np.sinc(half / np.pi) * (displacement - along)


@dataclass(frozen=True)
class SlideFrame:
    """Axes along which a joint with several translations slides, where a connector cannot tell.

    A connector knows displacement and velocity in the axes half-way between its sites. Its
    displacement is that of the screw from one site to the other, which is longer across the
    rotation than their distance; its velocity contains the spin of the parent. The axes are those
    of the parent's site where the translations are outside the rotations, else of the child's.

    Attributes:
        body: Exudyn body of the segment that has the axes; None for the ground.
        site: axes in those of the segment, shape (3, 3).
        is_parent: whether they are the parent's.
    """

    body: Index | None
    site: Array
    is_parent: bool

    def half_turn(self, rotation: Array) -> Array:
        """Return the turn from the half-way axes to these, of rotation vectors (..., 3)."""
        return matrix_from_rotation_vector((0.5 if self.is_parent else -0.5) * rotation)

    def motion(
        self, displacement: Array, rotation: Array, velocity: Array, spin: Array
    ) -> tuple[Array, Array]:
        """Return the offset of the child's site from the parent's and its rate, in these axes.

        Args:
            displacement: displacement of the connector, shape (..., 3) [m].
            rotation: rotation vector of the joint, shape (..., 3) [rad].
            velocity: difference of the velocities of the sites in these axes, (..., 3) [m/s].
            spin: angular velocity of the segment in its own axes, shape (..., 3) [rad/s].
        """
        turn = self.half_turn(rotation)
        chord = _screw_chord(displacement, rotation)
        offset, speed = ((turn @ one[..., None])[..., 0] for one in (chord, velocity))
        return offset, speed - np.cross(spin @ self.site, offset)


@dataclass(frozen=True)
class Connector:
    """A connector with springs, or one that only measures a rotation.

    Attributes:
        item: the Exudyn connector.
        springs: its springs; empty if it only measures.
        kind: kind of the displacement that it acts on.
        function: its user function, which must outlive the system; None if it only measures.
        axis_index: axis index of a revolute or prismatic, the index of its axis in the joint's
            chain.
        output_weights: output weights of a revolute or prismatic, weights of the output in the
            displacement.
        angle_node: angle node of a revolute, the node that stores its angle at the last step.
        law: law of several rotations; None for a single displacement.
        tone: tones about the axes of the rotations.
        frame: axes of a translation of several beside rotations; None where they are those half-way
            between the sites.
    """

    item: Index
    springs: tuple[AxisSpring, ...]
    kind: JointKind
    function: Any
    axis_index: int = 0
    output_weights: tuple[float, ...] = (1.0,)
    angle_node: Index | None = None
    law: RotationLaw | None = None
    tone: tuple[AxisTone, ...] = ()
    frame: SlideFrame | None = None


@dataclass(frozen=True)
class SpringBuilder:
    """A system to which connectors are added.

    Attributes:
        mbs: the Exudyn system.
        placement: initial placement of the figure.
        bodies: Exudyn object of each segment.
        python_torques: whether laws are Python functions instead of expression trees.
        tone: tone of the joints.
    """

    mbs: MainSystem
    placement: Placement
    bodies: Mapping[str, Index]
    python_torques: bool = False
    tone: JointTones | None = None

    def add_markers(self, joint: Joint, frame: Array) -> list[Index]:
        """Add markers at the parent's and the child's site, with axes rotated by `frame`."""
        rotation = pose_matrix(frame, np.zeros(3))
        figure = self.placement.tree.figure
        return [
            add_marker(
                self.mbs,
                self.placement,
                self.bodies,
                ref.segment,
                figure.site(ref).pose_in_segment @ rotation,
            )
            for ref in (joint.parent, joint.child)
        ]

    def held_axes(self, joint: str) -> tuple[AxisTone, ...]:
        """Return the tones that hold the angles of a joint."""
        return () if self.tone is None else self.tone.hold.get(joint, ())

    def activation(self, time: Real, ops: Operations) -> Real:
        """Return the activation of muscles at a time [s]."""
        assert self.tone is not None
        return self.tone.activation.at(time, ops)

    def function(self, function: Any, field: str, item: str) -> Any:
        """Return the function, or its expression tree unless torques are Python functions."""
        if self.python_torques:
            return function
        return symbolic_user_function(self.mbs, function, field, item)


def generalized_force(spring: AxisSpring, value: Real, rate: Real, ops: Operations) -> Real:
    """Torque or force of a spring of one displacement on the child."""
    return total_torque(spring.elastic, value, ops) + spring.resistance(value, rate, ops)


_TORQUE_ROWS = np.vstack([np.zeros((3, 3)), -np.eye(3)])
"""Matrix from a torque on the child to Exudyn's left-hand six-vector of force and torque."""

WrenchFunction = Callable[[Any, Any, Any, Any, Any], Any]
"""Left-hand six-vector of force and torque, of the time [s] and of a connector's displacement [m],
rotation vector [rad], velocity [m/s] and angular velocity [rad/s]."""


def add_wrench_connector(
    builder: SpringBuilder, joint: Joint, wrench: WrenchFunction | None
) -> tuple[Index, Any]:
    """Add a connector between the sites of a joint; without a wrench it only measures."""

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
        return wrench(t, displacement, rotation, velocity, angularVelocity)

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


def _scalar_user_function(
    builder: SpringBuilder,
    spring: AxisSpring | None,
    field: str,
    item: str,
    tone: AxisTone | None = None,
) -> Any:
    """Return the user function of a torsional or linear connector: minus the force of a spring."""
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
        total: Real = 0.0
        if spring is not None:
            total = generalized_force(spring, displacement, velocity, ops)
        if tone is not None:
            active = builder.activation(t, ops)
            total = total + tone.torque(displacement, velocity, active, ops)
        return -total

    return builder.function(user_function, field, item)


def add_spherical_spring(builder: SpringBuilder, joint: Joint, law: RotationLaw) -> Connector:
    """Add a torque of the rotation vector in the half-way frame; without axes, only measure it."""
    # Expression trees share nothing: those of coordinates take five times as long as Python.
    own = builder if isinstance(law, VectorLaw) else replace(builder, python_torques=True)
    tones = builder.held_axes(joint.name)

    def torque(time: Real, rotation: Any, rate: Any, ops: Operations) -> Any:
        passive = law.torque(rotation, ops) + law.damping(rotation, rate, ops)
        if not tones:
            return passive
        active = builder.activation(time, ops)
        return passive + rotation_tone(law, tones, rotation, rate, active, ops)

    def wrench(time: Any, displacement: Any, rotation: Any, velocity: Any, rate: Any) -> Any:
        if own.python_torques:
            return _TORQUE_ROWS @ torque(time, np.asarray(rotation), np.asarray(rate), FLOATS)
        return symbols.Matrix(_TORQUE_ROWS.tolist()) * torque(time, rotation, rate, SYMBOLIC)

    axes = tuple(law.axes)
    acts = bool(axes or tones) or isinstance(law, ReachLaw)
    item, function = add_wrench_connector(own, joint, wrench if acts else None)
    return Connector(item, axes, JointKind.SPHERICAL, function, law=law, tone=tones)


def add_revolute_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring | None
) -> Connector:
    """Add a torque about one axis; without a spring, only measure the angle."""
    axis = chain.rotation_axes[0]
    tones = tuple(tone.oriented_along(axis) for tone in builder.held_axes(joint.name))
    if spring is None and not tones:
        return _add_torsional_connector(builder, joint, chain, (), None)
    spring = None if spring is None else spring.oriented_along(axis)
    function = _scalar_user_function(
        builder,
        spring,
        "springTorqueUserFunction",
        "ObjectConnectorTorsionalSpringDamper",
        *tones,
    )
    springs = () if spring is None else (spring,)
    made = _add_torsional_connector(builder, joint, chain, springs, function)
    return replace(made, tone=tones)


def _add_torsional_connector(
    builder: SpringBuilder,
    joint: Joint,
    chain: Chain,
    springs: tuple[AxisSpring, ...],
    function: Any,
) -> Connector:
    mbs = builder.mbs
    start = float(builder.placement.displacements[joint.name][chain.rotations[0]])
    angle_node = mbs.AddNode(
        items.NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[start])
    )
    item = mbs.AddObject(
        items.ObjectConnectorTorsionalSpringDamper(
            name=unused_name(mbs, f"{joint.name} spring"),
            markerNumbers=builder.add_markers(joint, rotation_with_z_axis(chain.rotation_axes[0])),
            nodeNumber=angle_node,
            springTorqueUserFunction=0 if function is None else function,
        )
    )
    return Connector(
        item, springs, JointKind.REVOLUTE, function, chain.rotations[0], angle_node=angle_node
    )


def add_prismatic_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring
) -> Connector:
    """Add a force along a translation."""
    if len(chain.translations) == 1:
        return _add_single_translation_spring(builder, joint, chain, spring)
    return _add_multi_translation_spring(builder, joint, chain, spring)


def _add_single_translation_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring
) -> Connector:
    """Add a force along the only translation of a joint."""
    index = chain.translation_along(spring.direction)
    spring = spring.oriented_along(chain.joint_axes[index].axis)
    function = _scalar_user_function(
        builder, spring, "springForceUserFunction", "ObjectConnectorLinearSpringDamper"
    )
    markers, axis = builder.add_markers(joint, np.eye(3)), spring.direction
    if not chain.translations_are_outer:
        # The axis is the child's, in whose frame the parent moves the opposite way.
        markers, axis = markers[::-1], tuple(-c for c in axis)
    item = builder.mbs.AddObject(
        items.ObjectConnectorLinearSpringDamper(
            name=unused_name(builder.mbs, f"{joint.name} spring"),
            markerNumbers=markers,
            axisMarker0=list(axis),
            springForceUserFunction=function,
        )
    )
    return Connector(item, (spring,), JointKind.PRISMATIC, function, index)


def _add_multi_translation_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, spring: AxisSpring
) -> Connector:
    """Add a force along one of several translations of a joint without rotations.

    The force acts on both bodies at the child's site, which the other translations displace from
    the parent's. Exudyn's intrinsic connector applies a wrench half-way between the sites, so the
    force has a moment about that point.
    """
    index = chain.translation_along(spring.direction)
    spring = spring.oriented_along(chain.joint_axes[index].axis)
    ops = FLOATS if builder.python_torques else SYMBOLIC
    axes = np.array([chain.joint_axes[k].axis for k in chain.translations]).T
    # Row of the pseudo-inverse, because the axes may be oblique.
    x, y, z = np.linalg.pinv(axes)[chain.translations.index(index)].tolist()

    def wrench(
        time: Any, displacement: Any, rotation: Any, velocity: Any, angular_velocity: Any
    ) -> Any:
        p, q, r = (displacement[k] for k in range(3))
        speed = x * velocity[0] + y * velocity[1] + z * velocity[2]
        force = -generalized_force(spring, x * p + y * q + z * r, speed, ops)
        lever_arms = (q * z - r * y, r * x - p * z, p * y - q * x)
        components = [
            force * x,
            force * y,
            force * z,
            *(0.5 * lever_arm * force for lever_arm in lever_arms),
        ]
        return np.array(components) if builder.python_torques else symbols.Vector(components)

    item, function = add_wrench_connector(builder, joint, wrench)
    return Connector(item, (spring,), JointKind.PRISMATIC, function, index, (x, y, z))


def add_joint_springs(
    builder: SpringBuilder,
    joint: Joint,
    springs: JointSprings,
    law: SphericalLaw,
    *,
    read_rotation: bool = False,
) -> tuple[Connector, ...]:
    """Add the connectors of one joint's springs, which have no obstacles.

    Args:
        builder: the system to build into.
        joint: joint of the figure.
        springs: springs about its axes and along its translations.
        law: law of spherical joints.
        read_rotation: whether to measure the rotation also without springs, for coupled laws.
    """
    chain = builder.placement.tree.chains[joint.name]
    connectors: list[Connector] = []
    if springs.axes or springs.reach or read_rotation:
        if sum(is_rotation(axis.kind) for axis in chain.joint_axes) == 1:
            axis = springs.axes[0] if springs.axes else None
            connectors.append(add_revolute_spring(builder, joint, chain, axis))
        else:
            made = rotation_law(springs, law, chain.rotation_axes)
            connectors.append(add_spherical_spring(builder, joint, made))
    if not needs_slide_object(builder.placement, joint, springs):
        connectors.extend(
            add_prismatic_spring(builder, joint, chain, spring) for spring in springs.translations
        )
    return tuple(connectors)


def needs_slide_object(placement: Placement, joint: Joint, springs: JointSprings) -> bool:
    """Return whether no connector has the force of the springs along a joint's translations.

    Exudyn's have it for one translation, and for several without a rotation; their velocity
    contains the spin of the parent.
    """
    chain = placement.tree.chains[joint.name]
    if not springs.translations or len(chain.translations) < 2:
        return False
    is_between_bodies = not {ref.segment for ref in joint.ends} & placement.tree.figure.ground
    is_damped = any(spring.is_damped for spring in springs.translations)
    return bool(chain.rotations) or (is_between_bodies and is_damped)
