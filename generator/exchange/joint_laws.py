"""The springs of a joint, as programs with a force for each displacement want them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from generator.chain import Chain
from generator.errors import InputError, error
from generator.exchange.model import Model
from generator.exchange.report import Report
from generator.frames import PERPENDICULAR, unit
from springs import AxisSpring, JointSprings, Linear, SpringSet
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
    """The springs of a joint with the chain `chain`.

    Raises InputError for a spring along a slide that the joint has not.
    """
    alone: dict[int, AxisSpring] = {}
    if len(chain.turns) == 1 and springs.axes:
        alone[chain.turns[0]] = _along(springs.axes[0], chain, chain.turns[0])
    for spring in springs.slides:
        place = next((k for k in chain.slides if _is_along(spring, chain, k)), None)
        if place is None:
            said = f"joint `{springs.joint}` has a spring along which it cannot slide"
            raise InputError([error(said)])
        alone[place] = _along(spring, chain, place)
    return JointLaws(alone, springs.axes if len(chain.turns) > 1 else ())


def _is_along(spring: AxisSpring, chain: Chain, place: int) -> bool:
    across = np.cross(unit(chain.factors[place].axis), spring.direction)
    return float(np.linalg.norm(across)) < PERPENDICULAR


def _along(spring: AxisSpring, chain: Chain, place: int) -> AxisSpring:
    same = float(np.dot(spring.direction, chain.factors[place].axis)) > 0.0
    return spring if same else spring.turned()


def used_springs(model: Model, springs: SpringSet) -> Iterator[tuple[str, JointSprings]]:
    """The springs of the tree's joints, in the order of the figure."""
    branches = {branch.joint.name for branch in model.tree.branches}
    for name in model.figure.joints:
        if name in springs.joints and name in branches:
            yield name, springs.joints[name]


def are_perpendicular(axes: tuple[AxisSpring, ...]) -> bool:
    """Whether these are springs about three axes, each perpendicular to the others."""
    if len(axes) != 3:
        return False
    rows: Array = np.array([axis.direction for axis in axes])
    return bool(np.abs(rows @ rows.T - np.eye(3)).max() < _EQUAL)


def common_stiffness(axes: tuple[AxisSpring, ...]) -> float | None:
    """Stiffness [N m/rad] of a ball that resists turns about all axes alike; None for others.

    Both ways of joining axes give then the torque -k r, where r is the rotation vector.
    """
    laws = {axis.elastic for axis in axes}
    if laws == {()}:
        return 0.0
    if not are_perpendicular(axes) or len(laws) > 1:
        return None
    (law,) = laws
    linear = [one for one in law if isinstance(one, Linear) and one.rest == 0.0]
    return sum(one.stiffness for one in linear) if len(linear) == len(law) else None


def common_damping(axes: tuple[AxisSpring, ...]) -> float | None:
    """Viscous damping [N m s/rad] that all axes share; None where they do not."""
    viscous = {axis.damping.viscous for axis in axes}
    if viscous == {0.0}:
        return 0.0
    return viscous.pop() if are_perpendicular(axes) and len(viscous) == 1 else None


def rubs(spring: AxisSpring) -> bool:
    """Whether a spring's elastic laws have a friction of their own."""
    return any(isinstance(law, Frictional) for law in spring.elastic)


def lose_what_no_format_has(model: Model, springs: SpringSet, report: Report) -> None:
    """Note the laws over several joints and of what closes a loop, and where numbers are from."""
    for joint in model.tree.closures:
        if joint.name in springs.joints:
            report.lose("springs of joints that close loops", joint.name)
    for spring in springs.coupled:
        joints = dict.fromkeys(axis.joint for axis in spring.axes)
        report.lose("laws over several joints", " and ".join(joints))
    if springs.references:
        report.lose("the references of the springs")
