"""Righting of segments as Exudyn connectors.

A connector between the sites of a joint acts on the child and back on the parent, but knows only
their relative motion. Its user function reads the child's motion in the world from its body; the
torque along the child's axes is turned to the half-way frame, in which the connector takes it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.rotations import (
    matrix_from_rotation_vector,
    rotation_vector_from_matrix,
)
from generator.simulation.exudyn_model.exudyn_api import Index, exu, items, unused_name
from generator.simulation.exudyn_model.springs import SpringBuilder
from springs import FLOATS
from springs.tone.law import vector_tone


@dataclass(frozen=True)
class RightingConnector:
    """A connector that rights the child of a joint.

    Attributes:
        item: Exudyn connector.
        body: Exudyn body of the child.
        function: User function, which must outlive the system.
    """

    item: Index
    body: Index
    function: Any


def add_righting(builder: SpringBuilder) -> dict[str, RightingConnector]:
    """Add a connector for each joint that rights its child."""
    tone = builder.tone
    assert tone is not None
    return {name: _add_connector(builder, name) for name in tone.righting}


def _add_connector(builder: SpringBuilder, name: str) -> RightingConnector:
    assert builder.tone is not None
    figure, activation = builder.placement.tree.figure, builder.tone.activation
    joint, righting = figure.joints[name], builder.tone.righting[name]
    body = builder.bodies[joint.child.segment]
    site = figure.site(joint.child).pose_in_segment[:3, :3]

    def user_function(
        mbs: Any,
        t: float,
        itemNumber: int,
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
        kinds = exu.OutputVariableType
        turn, spin = (
            np.asarray(mbs.GetObjectOutputBody(body, kind, [0.0, 0.0, 0.0]))
            for kind in (kinds.RotationMatrix, kinds.AngularVelocity)
        )
        turn = turn.reshape(3, 3) @ site
        error = rotation_vector_from_matrix(righting.upright.T @ turn)
        active = activation.at(t, FLOATS)
        torque = vector_tone(righting.axes, error, turn.T @ spin, active, FLOATS)
        half_turn = matrix_from_rotation_vector(0.5 * np.asarray(rotation))
        return np.concatenate([np.zeros(3), -(half_turn @ torque)])

    item = builder.mbs.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(
            name=unused_name(builder.mbs, f"{name} righting"),
            markerNumbers=builder.add_markers(joint, np.eye(3)),
            useIntrinsicFormulation=True,
            springForceTorqueUserFunction=user_function,
        )
    )
    return RightingConnector(item, body, user_function)
