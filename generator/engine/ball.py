"""Springs of a joint of several rotations: a torque of the rotation vector, half-way."""

from typing import Any

import numpy as np

from generator.engine.connector import Connector, Hanger, SpringError
from generator.engine.exudyn_api import items, symbols, unused_name
from generator.engine.symbolic import SYMBOLIC
from generator.figure import Joint
from generator.frames import rotation_vector_from_matrix
from springs import (
    FLOATS,
    AxisSpring,
    Joining,
    Operations,
    Real,
    damping_torque,
    elastic_torque,
)

_TORQUE_ROWS = np.vstack([np.zeros((3, 3)), -np.eye(3)])
"""Puts a torque on the child into Exudyn's left-hand six-vector of force and torque."""

_HALF_TURN_SLACK = 1e-6
"""A start nearer than this to 180 deg falls to either side by its rounding [rad]."""


def hang_ball(
    hanger: Hanger, joint: Joint, axes: tuple[AxisSpring, ...], joining: Joining
) -> Connector:
    """A torque of the rotation vector, in the half-way frame; without axes, a reader of it.

    Raises:
        SpringError: an elastic torque that would start at 180 deg.
    """
    if any(axis.elastic for axis in axes):
        refuse_half_turn(hanger, joint)

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
    used = in_python if hanger.python else in_symbols
    function = hanger.function(used, field, name) if axes else None
    item = hanger.mbs.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(
            name=unused_name(hanger.mbs, f"{joint.name} spring"),
            markerNumbers=hanger.markers(joint, np.eye(3)),
            useIntrinsicFormulation=True,
            springForceTorqueUserFunction=0 if function is None else function,
        )
    )
    return Connector(item, axes, "ball", function)


def refuse_half_turn(hanger: Hanger, joint: Joint) -> None:
    """Raises SpringError where a joint of several turns starts at 180 deg."""
    angle = np.linalg.norm(rotation_vector_from_matrix(hanger.placement.between(joint)[:3, :3]))
    if angle > np.pi - _HALF_TURN_SLACK:
        raise SpringError(
            f"joint {joint.name} starts at 180 deg, where the torque of its springs is not defined"
        )
