"""Springs about the only rotation of a joint: a torque of its unwrapped angle."""

from typing import Any

from generator.chain import Chain
from generator.engine.connector import Connector, Hanger, along, one_axis
from generator.engine.exudyn_api import items, unused_name
from generator.engine.symbolic import SYMBOLIC
from generator.figure import Joint
from generator.frames import frame_with_z
from springs import FLOATS, AxisSpring, Real


def hang_hinge(hanger: Hanger, joint: Joint, chain: Chain, spring: AxisSpring | None) -> Connector:
    """A torque about one axis; without a spring, a reader of the angle."""
    if spring is None:
        return _add(hanger, joint, chain, (), None)
    spring = along(spring, chain.turn_axes[0])
    ops = FLOATS if hanger.python else SYMBOLIC

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
        return -one_axis(spring, rotation, angularVelocity, ops)

    name = "ObjectConnectorTorsionalSpringDamper"
    function = hanger.function(left_hand_torque, "springTorqueUserFunction", name)
    return _add(hanger, joint, chain, (spring,), function)


def _add(
    hanger: Hanger, joint: Joint, chain: Chain, springs: tuple[AxisSpring, ...], function: Any
) -> Connector:
    mbs = hanger.mbs
    start = float(hanger.placement.displacements[joint.name][chain.turns[0]])
    counter = mbs.AddNode(
        items.NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[start])
    )
    item = mbs.AddObject(
        items.ObjectConnectorTorsionalSpringDamper(
            name=unused_name(mbs, f"{joint.name} spring"),
            markerNumbers=hanger.markers(joint, frame_with_z(chain.turn_axes[0])),
            nodeNumber=counter,
            springTorqueUserFunction=0 if function is None else function,
        )
    )
    return Connector(item, springs, "hinge", function, chain.turns[0], counter=counter)
