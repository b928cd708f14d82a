"""The springs of a joint, as programs with a force for each displacement want them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from generator.chain import Chain
from generator.exchange.report import Report
from generator.figure import Figure
from generator.frames import PERPENDICULAR, unit
from springs import AxisSpring, Joining, JointSprings, Linear, SpringSet
from springs.elastic import Frictional
from springs.operations import Array

_EQUAL = 1e-9


@dataclass(frozen=True)
class JointLaws:
    """The springs of a joint, told by what they are functions of.

    Attributes:
        alone: by the place in the chain, springs that are functions of this displacement alone,
            told about its axis.
        together: springs of several turns, which are functions of the rotation vector.
    """

    alone: Mapping[int, AxisSpring]
    together: tuple[AxisSpring, ...]


def laws_of(chain: Chain, springs: JointSprings) -> JointLaws:
    """The springs of a joint with the chain `chain`."""
    alone: dict[int, AxisSpring] = {}
    if len(chain.turns) == 1 and springs.axes:
        alone[chain.turns[0]] = _along(springs.axes[0], chain, chain.turns[0])
    for spring in springs.slides:
        place = next((k for k in chain.slides if _is_along(spring, chain, k)), None)
        if place is not None:
            alone[place] = _along(spring, chain, place)
    return JointLaws(alone, springs.axes if len(chain.turns) > 1 else ())


def _is_along(spring: AxisSpring, chain: Chain, place: int) -> bool:
    across = np.cross(unit(chain.factors[place].axis), spring.direction)
    return float(np.linalg.norm(across)) < PERPENDICULAR


def _along(spring: AxisSpring, chain: Chain, place: int) -> AxisSpring:
    same = float(np.dot(spring.direction, chain.factors[place].axis)) > 0.0
    return spring if same else spring.turned()


def used_springs(figure: Figure, springs: SpringSet) -> Iterator[tuple[str, JointSprings]]:
    """The springs of the figure's joints that move, in the order of the figure."""
    for name, joint in figure.joints.items():
        held = {ref.segment for ref in joint.ends} <= figure.ground
        if name in springs.joints and not held:
            yield name, springs.joints[name]


def equal_about_all(axes: tuple[AxisSpring, ...]) -> bool:
    """Whether three directions are perpendicular to each other."""
    if len(axes) != 3:
        return False
    rows: Array = np.array([axis.direction for axis in axes])
    return bool(np.abs(rows @ rows.T - np.eye(3)).max() < _EQUAL)


def common_stiffness(axes: tuple[AxisSpring, ...], joining: Joining) -> float | None:
    """Stiffness [N m/rad] of a ball that resists turns about all axes alike; None for others.

    Both ways of joining give then the torque -k r, where r is the rotation vector.
    """
    del joining
    laws = {axis.elastic for axis in axes}
    if laws == {()}:
        return 0.0
    if not equal_about_all(axes) or len(laws) > 1:
        return None
    (law,) = laws
    linear = [one for one in law if isinstance(one, Linear) and one.rest == 0.0]
    return sum(one.stiffness for one in linear) if len(linear) == len(law) else None


def common_damping(axes: tuple[AxisSpring, ...]) -> float | None:
    """Viscous damping [N m s/rad] that all axes share; None where they do not."""
    viscous = {axis.damping.viscous for axis in axes}
    if viscous == {0.0}:
        return 0.0
    return viscous.pop() if equal_about_all(axes) and len(viscous) == 1 else None


def rubs(spring: AxisSpring) -> bool:
    """Whether a spring's elastic laws have a friction of their own."""
    return any(isinstance(law, Frictional) for law in spring.elastic)


def lose_what_no_format_has(springs: SpringSet, report: Report) -> None:
    """Note the laws over several joints, and where the numbers are from."""
    for spring in springs.coupled:
        joints = dict.fromkeys(axis.joint for axis in spring.axes)
        report.lose("laws over several joints are left out", " and ".join(joints))
    if springs.references:
        report.lose("the references of the springs")
