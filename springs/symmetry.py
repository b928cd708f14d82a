"""Left and right: whether the curves of two joints are mirror images of each other.

Angles are counted in the sense of each joint's declared axis, in which a motion has the same name
on both sides. Mirror images are then the same function.
"""

from collections.abc import Mapping
from math import degrees, radians

import numpy as np

from springs.elastic import total_friction, total_torque
from springs.finding import Finding, Kind
from springs.joint import AxisSpring, JointSprings

_ANGLES = np.radians(np.linspace(-180.0, 180.0, 721))
_EQUAL = 1e-9
_SIDES = {"left": "right", "right": "left"}
_PARALLEL = radians(0.01)


def other_side(joint: str) -> str | None:
    """The name of the same joint on the other side; None for a name without a side."""
    words = joint.split("_")
    if not set(words) & set(_SIDES):
        return None
    return "_".join(_SIDES.get(word, word) for word in words)


def lint_symmetry(
    joint: str, spring: AxisSpring, joints: Mapping[str, JointSprings]
) -> tuple[Finding, ...]:
    """How the spring of a joint compares with that of the joint on the other side.

    Args:
        joint: name of the joint.
        spring: about one of its axes.
        joints: all springs.
    """
    name = other_side(joint)
    if name is None:
        return ()
    others = joints[name].axes if name in joints else ()
    other = next((one for one in others if _same_axis(one, spring)), None)
    if other is None:
        return (Finding(Kind.SYMMETRY, True, f"`{name}` has no spring about this axis"),)
    mine, its = (np.asarray(total_torque(one.elastic, _ANGLES)) for one in (spring, other))
    differences = np.abs(mine - its)
    worst = int(differences.argmax())
    angle, much = float(_ANGLES[worst]), float(differences[worst])
    if much > _EQUAL * (1.0 + abs(float(mine[worst]))):
        said = (
            f"`{name}` differs by up to {much:.3g} N m, at {round(degrees(angle), 1) + 0.0:.1f} deg"
        )
        return (Finding(Kind.SYMMETRY, True, said, (angle,), (much,)),)
    frictions = (total_friction(one.elastic, _ANGLES, 1.0) for one in (spring, other))
    mine, its = (np.asarray(0.0 if one is None else one) for one in frictions)
    if float(np.abs(mine - its).max()) > _EQUAL * (1.0 + float(np.abs(mine).max())):
        said = f"`{name}` has another hysteresis"
        return (Finding(Kind.SYMMETRY, True, said),)
    if spring.damping != other.damping:
        said = f"`{name}` has another damping"
        return (Finding(Kind.SYMMETRY, True, said),)
    return (Finding(Kind.SYMMETRY, False, "left and right are mirror images"),)


def _same_axis(one: AxisSpring, other: AxisSpring) -> bool:
    """Whether two springs are about the same line in their joints' frames."""
    return float(np.linalg.norm(np.cross(one.direction, other.direction))) < _PARALLEL
