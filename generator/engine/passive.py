"""Springs and damping hung on a joint as Exudyn connectors with user-function torques.

One law of `springs` becomes an expression tree that Exudyn evaluates in C++, or on request a Python
function that it calls back. Exudyn counts connector torques on the left-hand side: the functions
return minus the torque on the child.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.chain import Chain
from generator.engine.bodies import add_marker
from generator.engine.exudyn_api import (
    Index,
    MainSystem,
    items,
    symbolic_user_function,
    symbols,
)
from generator.engine.symbolic import SYMBOLIC
from generator.errors import MoverError
from generator.figure import Joint
from generator.frames import Array, frame_with_z, homogeneous
from generator.posture.placement import Placement
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

_TORQUE_ROWS = np.vstack([np.zeros((3, 3)), -np.eye(3)])
"""Puts a torque on the child into Exudyn's left-hand six-vector of force and torque."""


class SpringError(MoverError):
    """A spring that no connector can hold."""


@dataclass(frozen=True)
class Connector:
    """A spring as it stands in the system.

    Attributes:
        item: the Exudyn connector.
        springs: the axes it holds.
        kind: "hinge" (one angle), "ball" (a rotation vector) or "slide" (one translation).
        function: its user function, which must outlive the system.
    """

    item: Index
    springs: tuple[AxisSpring, ...]
    kind: str
    function: Any


def add_springs(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    joint: Joint,
    springs: JointSprings,
    joining: Joining,
    *,
    python: bool = False,
) -> tuple[Connector, ...]:
    """The connectors of one joint's springs.

    Raises:
        SpringError: springs about axes or along slides that the joint's chain does not have.
    """
    chain = placement.tree.chains[joint.name]
    if springs.axes and not chain.turns:
        raise SpringError(f"joint {joint.name} has springs about axes but no rotation")
    if springs.slides and not chain.slides:
        raise SpringError(f"joint {joint.name} has springs along slides but no translation")
    if springs.slides and len(chain.slides) > 1 and chain.turns:
        raise SpringError(
            f"joint {joint.name} both turns and slides along more than one axis: "
            "springs along its slides are not supported"
        )
    made: list[Connector] = []
    if springs.axes and len(chain.turns) == 1:
        made.append(_hinge(mbs, placement, bodies, joint, chain, springs.axes[0], python))
    elif springs.axes:
        made.append(_ball(mbs, placement, bodies, joint, springs.axes, joining, python))
    made.extend(_slide(mbs, placement, bodies, joint, slide, python) for slide in springs.slides)
    return tuple(made)


def _markers(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    joint: Joint,
    frame: Array,
) -> list[Index]:
    """Markers at the parent's and the child's site, their axes turned by `frame`."""
    turn = homogeneous(frame, np.zeros(3))
    figure = placement.tree.figure
    return [
        add_marker(mbs, placement, bodies, ref.segment, figure.site(ref).pose_in_segment @ turn)
        for ref in (joint.parent, joint.child)
    ]


def _along(spring: AxisSpring, axis: tuple[float, float, float]) -> AxisSpring:
    """The spring told about `axis`, which is its direction or the opposite of it."""
    return spring if float(np.dot(spring.direction, axis)) > 0.0 else spring.turned()


def _hinge(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    joint: Joint,
    chain: Chain,
    spring: AxisSpring,
    python: bool,
) -> Connector:
    """A torque about one axis, of the unwrapped angle."""
    spring = _along(spring, chain.turn_axes[0])
    ops = FLOATS if python else SYMBOLIC
    start = float(placement.displacements[joint.name][chain.turns[0]])

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
        return -_one_axis(spring, rotation, angularVelocity, ops)

    name = "ObjectConnectorTorsionalSpringDamper"
    function = _function(mbs, left_hand_torque, "springTorqueUserFunction", name, python)
    counter = mbs.AddNode(
        items.NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[start])
    )
    item = mbs.AddObject(
        items.ObjectConnectorTorsionalSpringDamper(
            name=f"{joint.name} spring",
            markerNumbers=_markers(mbs, placement, bodies, joint, frame_with_z(chain.turn_axes[0])),
            nodeNumber=counter,
            springTorqueUserFunction=function,
        )
    )
    return Connector(item, (spring,), "hinge", function)


def _ball(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    joint: Joint,
    axes: tuple[AxisSpring, ...],
    joining: Joining,
    python: bool,
) -> Connector:
    """A torque of the rotation vector, in the half-way frame."""

    def torque(rotation: Any, rate: Any, ops: Operations) -> Any:
        return elastic_torque(joining, axes, rotation, ops) + damping_torque(axes, rate, ops)

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
    function = _function(mbs, in_python if python else in_symbols, field, name, python)
    item = mbs.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(
            name=f"{joint.name} spring",
            markerNumbers=_markers(mbs, placement, bodies, joint, np.eye(3)),
            useIntrinsicFormulation=True,
            springForceTorqueUserFunction=function,
        )
    )
    return Connector(item, axes, "ball", function)


def _slide(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    joint: Joint,
    spring: AxisSpring,
    python: bool,
) -> Connector:
    """A force along one translation."""
    ops = FLOATS if python else SYMBOLIC

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
        return -_one_axis(spring, displacement, velocity, ops)

    name = "ObjectConnectorLinearSpringDamper"
    function = _function(mbs, left_hand_force, "springForceUserFunction", name, python)
    item = mbs.AddObject(
        items.ObjectConnectorLinearSpringDamper(
            name=f"{joint.name} spring along {spring.direction}",
            markerNumbers=_markers(mbs, placement, bodies, joint, np.eye(3)),
            axisMarker0=list(spring.direction),
            springForceUserFunction=function,
        )
    )
    return Connector(item, (spring,), "slide", function)


def _one_axis(spring: AxisSpring, value: Real, rate: Real, ops: Operations) -> Real:
    """Torque or force on the child of a spring of one displacement."""
    return total_torque(spring.elastic, value, ops) + spring.damping.torque(rate, ops)


def _function(mbs: MainSystem, function: Any, field: str, item: str, python: bool) -> Any:
    """The function itself, or its expression tree."""
    return function if python else symbolic_user_function(mbs, function, field, item)
