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
    unused_name,
)
from generator.engine.symbolic import SYMBOLIC
from generator.errors import MoverError
from generator.figure import Joint
from generator.frames import (
    PERPENDICULAR,
    Array,
    frame_with_z,
    homogeneous,
    rotation_vector_from_matrix,
    unit,
)
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

_HALF_TURN_SLACK = 1e-6
"""A start nearer than this to 180 deg falls to either side by its rounding [rad]."""


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
        place: of a hinge or a slide, the factor of the joint's chain whose displacement it takes.
        reading: of a hinge or a slide, what turns the item's output into that displacement.
    """

    item: Index
    springs: tuple[AxisSpring, ...]
    kind: str
    function: Any
    place: int = 0
    reading: tuple[float, ...] = (1.0,)


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
    held = {ref.segment for ref in joint.ends} & placement.tree.figure.ground
    if len(chain.slides) > 1 and not held and any(_damps(slide) for slide in springs.slides):
        # Exudyn gives the difference of two points' velocities, which holds the parent's turning.
        raise SpringError(
            f"joint {joint.name} slides along more than one axis between two moving segments: "
            "damping along its slides is not supported"
        )
    made: list[Connector] = []
    if springs.axes and len(chain.turns) == 1:
        made.append(_hinge(mbs, placement, bodies, joint, chain, springs.axes[0], python))
    elif springs.axes:
        made.append(_ball(mbs, placement, bodies, joint, springs.axes, joining, python))
    hang = _slide if len(chain.slides) == 1 else _slide_among
    made.extend(
        hang(mbs, placement, bodies, joint, chain, slide, python) for slide in springs.slides
    )
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
            name=unused_name(mbs, f"{joint.name} spring"),
            markerNumbers=_markers(mbs, placement, bodies, joint, frame_with_z(chain.turn_axes[0])),
            nodeNumber=counter,
            springTorqueUserFunction=function,
        )
    )
    return Connector(item, (spring,), "hinge", function, chain.turns[0])


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
    angle = np.linalg.norm(rotation_vector_from_matrix(placement.between(joint)[:3, :3]))
    if angle > np.pi - _HALF_TURN_SLACK and any(axis.elastic for axis in axes):
        raise SpringError(
            f"joint {joint.name} starts at 180 deg, where the torque of its springs is not defined"
        )

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
            name=unused_name(mbs, f"{joint.name} spring"),
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
    chain: Chain,
    spring: AxisSpring,
    python: bool,
) -> Connector:
    """A force along the only translation of a joint."""
    place = _slide_place(joint, chain, spring)
    spring = _along(spring, chain.factors[place].axis)
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
    markers, axis = _markers(mbs, placement, bodies, joint, np.eye(3)), spring.direction
    if not chain.slides_are_outside:
        # The axis is the child's, and seen from there the parent slides the other way.
        markers, axis = markers[::-1], tuple(-c for c in axis)
    item = mbs.AddObject(
        items.ObjectConnectorLinearSpringDamper(
            name=unused_name(mbs, f"{joint.name} spring"),
            markerNumbers=markers,
            axisMarker0=list(axis),
            springForceUserFunction=function,
        )
    )
    return Connector(item, (spring,), "slide", function, place)


def _slide_among(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    joint: Joint,
    chain: Chain,
    spring: AxisSpring,
    python: bool,
) -> Connector:
    """A force along one of several translations of a joint that does not turn.

    The force acts on both bodies at the child's site, which the other slides carry away from the
    parent's. Exudyn's intrinsic connector applies what it is given half-way between the two, so the
    force has a moment about that point.
    """
    place = _slide_place(joint, chain, spring)
    spring = _along(spring, chain.factors[place].axis)
    ops = FLOATS if python else SYMBOLIC
    axes = np.array([chain.factors[k].axis for k in chain.slides]).T
    # What reads one displacement where the slides are oblique to each other.
    x, y, z = np.linalg.pinv(axes)[chain.slides.index(place)].tolist()

    def left_hand(displacement: Any, velocity: Any) -> list[Real]:
        p, q, r = (displacement[k] for k in range(3))
        speed = x * velocity[0] + y * velocity[1] + z * velocity[2]
        force = -_one_axis(spring, x * p + y * q + z * r, speed, ops)
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
        return np.array(parts) if python else symbols.Vector(parts)

    name = "ObjectConnectorRigidBodySpringDamper"
    function = _function(mbs, six, "springForceTorqueUserFunction", name, python)
    item = mbs.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(
            name=unused_name(mbs, f"{joint.name} spring"),
            markerNumbers=_markers(mbs, placement, bodies, joint, np.eye(3)),
            useIntrinsicFormulation=True,
            springForceTorqueUserFunction=function,
        )
    )
    return Connector(item, (spring,), "slide", function, place, (x, y, z))


def _damps(spring: AxisSpring) -> bool:
    return spring.damping.viscous > 0.0 or spring.damping.coulomb > 0.0


def _slide_place(joint: Joint, chain: Chain, spring: AxisSpring) -> int:
    """The factor of a chain along which a spring is. Raises SpringError when there is none."""
    for k in chain.slides:
        across = np.cross(unit(chain.factors[k].axis), spring.direction)
        if float(np.linalg.norm(across)) < PERPENDICULAR:
            return k
    raise SpringError(f"joint {joint.name} does not slide along {spring.direction}")


def _one_axis(spring: AxisSpring, value: Real, rate: Real, ops: Operations) -> Real:
    """Torque or force on the child of a spring of one displacement."""
    return total_torque(spring.elastic, value, ops) + spring.damping.torque(rate, ops)


def _function(mbs: MainSystem, function: Any, field: str, item: str, python: bool) -> Any:
    """The function itself, or its expression tree."""
    return function if python else symbolic_user_function(mbs, function, field, item)
