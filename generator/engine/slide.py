"""Springs along the translations of a joint."""

from typing import Any

import numpy as np

from generator.chain import Chain
from generator.engine.connector import Connector, Hanger, SpringError, along, one_axis
from generator.engine.exudyn_api import items, symbols, unused_name
from generator.engine.symbolic import SYMBOLIC
from generator.figure import Joint
from generator.frames import PERPENDICULAR, unit
from springs import FLOATS, AxisSpring, Real
from springs.elastic import Frictional


def hang_slide(hanger: Hanger, joint: Joint, chain: Chain, spring: AxisSpring) -> Connector:
    """A force along one translation of a joint.

    Raises:
        SpringError: the joint does not slide there, or slides in a way that is not supported.
    """
    if len(chain.slides) > 1 and chain.turns:
        raise SpringError(
            f"joint {joint.name} both turns and slides along more than one axis: "
            "springs along its slides are not supported"
        )
    held = {ref.segment for ref in joint.ends} & hanger.placement.tree.figure.ground
    if len(chain.slides) > 1 and not held and _damps(spring):
        # Exudyn gives the difference of two points' velocities, which holds the parent's turning.
        raise SpringError(
            f"joint {joint.name} slides along more than one axis between two moving segments: "
            "damping along its slides is not supported"
        )
    hang = _slide if len(chain.slides) == 1 else _slide_among
    return hang(hanger, joint, chain, spring)


def _slide(hanger: Hanger, joint: Joint, chain: Chain, spring: AxisSpring) -> Connector:
    """A force along the only translation of a joint."""
    place = _slide_place(joint, chain, spring)
    spring = along(spring, chain.factors[place].axis)
    ops = FLOATS if hanger.python else SYMBOLIC

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
        return -one_axis(spring, displacement, velocity, ops)

    name = "ObjectConnectorLinearSpringDamper"
    function = hanger.function(left_hand_force, "springForceUserFunction", name)
    markers, axis = hanger.markers(joint, np.eye(3)), spring.direction
    if not chain.slides_are_outside:
        # The axis is the child's, and seen from there the parent slides the other way.
        markers, axis = markers[::-1], tuple(-c for c in axis)
    item = hanger.mbs.AddObject(
        items.ObjectConnectorLinearSpringDamper(
            name=unused_name(hanger.mbs, f"{joint.name} spring"),
            markerNumbers=markers,
            axisMarker0=list(axis),
            springForceUserFunction=function,
        )
    )
    return Connector(item, (spring,), "slide", function, place)


def _slide_among(hanger: Hanger, joint: Joint, chain: Chain, spring: AxisSpring) -> Connector:
    """A force along one of several translations of a joint that does not turn.

    The force acts on both bodies at the child's site, which the other slides carry away from the
    parent's. Exudyn's intrinsic connector applies what it is given half-way between the two, so the
    force has a moment about that point.
    """
    place = _slide_place(joint, chain, spring)
    spring = along(spring, chain.factors[place].axis)
    ops = FLOATS if hanger.python else SYMBOLIC
    axes = np.array([chain.factors[k].axis for k in chain.slides]).T
    # What reads one displacement where the slides are oblique to each other.
    x, y, z = np.linalg.pinv(axes)[chain.slides.index(place)].tolist()

    def left_hand(displacement: Any, velocity: Any) -> list[Real]:
        p, q, r = (displacement[k] for k in range(3))
        speed = x * velocity[0] + y * velocity[1] + z * velocity[2]
        force = -one_axis(spring, x * p + y * q + z * r, speed, ops)
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
        return np.array(parts) if hanger.python else symbols.Vector(parts)

    name = "ObjectConnectorRigidBodySpringDamper"
    function = hanger.function(six, "springForceTorqueUserFunction", name)
    item = hanger.mbs.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(
            name=unused_name(hanger.mbs, f"{joint.name} spring"),
            markerNumbers=hanger.markers(joint, np.eye(3)),
            useIntrinsicFormulation=True,
            springForceTorqueUserFunction=function,
        )
    )
    return Connector(item, (spring,), "slide", function, place, (x, y, z))


def _damps(spring: AxisSpring) -> bool:
    rubs = any(isinstance(law, Frictional) for law in spring.elastic)
    return rubs or spring.damping.viscous > 0.0 or spring.damping.coulomb > 0.0


def _slide_place(joint: Joint, chain: Chain, spring: AxisSpring) -> int:
    """The factor of a chain along which a spring is. Raises SpringError when there is none."""
    for k in chain.slides:
        across = np.cross(unit(chain.factors[k].axis), spring.direction)
        if float(np.linalg.norm(across)) < PERPENDICULAR:
            return k
    raise SpringError(f"joint {joint.name} does not slide along {spring.direction}")
