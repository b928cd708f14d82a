"""Springs and damping of joints as Exudyn connectors.

A law of `springs` becomes an expression tree that Exudyn evaluates in C++, or on request a Python
function. Exudyn has connector torques on the left-hand side, so the functions return minus the
torque on the child. The springs of a revolute are a torque of its unwrapped angle, those of a joint
of several rotations a torque of its rotation vector in the half-way frame.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, assert_never

import numpy as np

from generator.figure import Joint
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
from generator.simulation.run_model import BoundSpring, JointKind, generalized_force
from springs import (
    FLOATS,
    AxisSpring,
    Operations,
    Real,
)
from springs.spherical import VectorLaw
from springs.tone.law import AxisTone, rotation_tone


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


@dataclass(frozen=True, kw_only=True)
class Connector(BoundSpring):
    """A connector with springs, or one that only measures a rotation.

    Attributes:
        item: the Exudyn connector.
        function: its user function, which must outlive the system; None if it only measures.
        angle_node: angle node of a revolute, the node that stores its angle at the last step.
        frame: axes of a translation of several beside rotations; None where they are those half-way
            between the sites.
    """

    item: Index
    function: Any
    angle_node: Index | None = None
    frame: SlideFrame | None = None

    @classmethod
    def of(cls, bound: BoundSpring, item: Index, function: Any, **more: Any) -> "Connector":
        """Return the connector of a bound spring; `more` are its further attributes."""
        own = {one.name: getattr(bound, one.name) for one in fields(BoundSpring)}
        return cls(**own, item=item, function=function, **more)


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

    def activation(self, time: Real, ops: Operations) -> Real:
        """Return the activation of muscles at a time [s]."""
        assert self.tone is not None
        return self.tone.activation.at(time, ops)

    def function(self, function: Any, field: str, item: str) -> Any:
        """Return the function, or its expression tree unless torques are Python functions."""
        if self.python_torques:
            return function
        return symbolic_user_function(self.mbs, function, field, item)


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


def add_spherical_spring(builder: SpringBuilder, joint: Joint, bound: BoundSpring) -> Connector:
    """Add a torque of the rotation vector in the half-way frame; without axes, only measure it."""
    law, tones = bound.law, bound.tone
    assert law is not None
    # Expression trees share nothing: those of coordinates take five times as long as Python.
    own = builder if isinstance(law, VectorLaw) else replace(builder, python_torques=True)

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

    item, function = add_wrench_connector(own, joint, wrench if bound.acts else None)
    return Connector.of(bound, item, function)


def add_revolute_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, bound: BoundSpring
) -> Connector:
    """Add a torque about one axis; without a spring, only measure the angle."""
    mbs, function = builder.mbs, None
    if bound.acts:
        function = _scalar_user_function(
            builder,
            next(iter(bound.springs), None),
            "springTorqueUserFunction",
            "ObjectConnectorTorsionalSpringDamper",
            *bound.tone,
        )
    start = float(builder.placement.displacements[joint.name][bound.axis_index])
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
    return Connector.of(bound, item, function, angle_node=angle_node)


def add_prismatic_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, bound: BoundSpring
) -> Connector:
    """Add a force along a translation."""
    if len(chain.translations) == 1:
        return _add_single_translation_spring(builder, joint, chain, bound)
    return _add_multi_translation_spring(builder, joint, bound)


def _add_single_translation_spring(
    builder: SpringBuilder, joint: Joint, chain: Chain, bound: BoundSpring
) -> Connector:
    """Add a force along the only translation of a joint."""
    (spring,) = bound.springs
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
    return Connector.of(bound, item, function)


def _add_multi_translation_spring(
    builder: SpringBuilder, joint: Joint, bound: BoundSpring
) -> Connector:
    """Add a force along one of several translations of a joint without rotations.

    The force acts on both bodies at the child's site, which the other translations displace from
    the parent's. Exudyn's intrinsic connector applies a wrench half-way between the sites, so the
    force has a moment about that point.
    """
    (spring,), (x, y, z) = bound.springs, bound.output_weights
    ops = FLOATS if builder.python_torques else SYMBOLIC

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
    return Connector.of(bound, item, function)


def add_joint_springs(
    builder: SpringBuilder, joint: Joint, bound: Sequence[BoundSpring]
) -> tuple[Connector, ...]:
    """Add the connectors of one joint's springs; see `needs_slide_object` for further ones."""
    chain = builder.placement.tree.chains[joint.name]
    connectors: list[Connector] = []
    for spring in bound:
        match spring.kind:
            case JointKind.REVOLUTE:
                connectors.append(add_revolute_spring(builder, joint, chain, spring))
            case JointKind.SPHERICAL:
                connectors.append(add_spherical_spring(builder, joint, spring))
            case JointKind.PRISMATIC:
                connectors.append(add_prismatic_spring(builder, joint, chain, spring))
            case _:
                assert_never(spring.kind)
    return tuple(connectors)


def needs_slide_object(
    placement: Placement, joint: Joint, translations: Sequence[BoundSpring]
) -> bool:
    """Return whether no connector has the force of the springs along a joint's translations.

    Exudyn's have it for one translation, and for several without a rotation; their velocity
    contains the spin of the parent.
    """
    chain = placement.tree.chains[joint.name]
    if not translations or len(chain.translations) < 2:
        return False
    is_between_bodies = not {ref.segment for ref in joint.ends} & placement.tree.figure.ground
    is_damped = any(spring.is_damped for bound in translations for spring in bound.springs)
    return bool(chain.rotations) or (is_between_bodies and is_damped)
