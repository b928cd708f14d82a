"""What the connectors of springs have in common: how they are kept, and where they are hung.

One law of `springs` becomes an expression tree that Exudyn evaluates in C++, or on request a Python
function that it calls back. Exudyn counts connector torques on the left-hand side: the functions
return minus the torque on the child.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.engine.bodies import add_marker
from generator.engine.exudyn_api import Index, MainSystem, symbolic_user_function
from generator.errors import MoverError
from generator.figure import Joint
from generator.frames import Array, homogeneous
from generator.posture.placement import Placement
from springs import AxisSpring, Operations, Real, total_torque


class SpringError(MoverError):
    """A spring that no connector can hold."""


@dataclass(frozen=True)
class Connector:
    """A spring as it stands in the system, or what only reads a joint's angle.

    Attributes:
        item: the Exudyn connector.
        springs: the axes it holds; none where it only reads.
        kind: "hinge" (one angle), "ball" (a rotation vector) or "slide" (one translation).
        function: its user function, which must outlive the system; None where it only reads.
        place: of a hinge or a slide, the factor of the joint's chain whose displacement it takes.
        reading: of a hinge or a slide, what turns the item's output into that displacement.
        counter: of a hinge, the node that keeps its angle at the last step.
    """

    item: Index
    springs: tuple[AxisSpring, ...]
    kind: str
    function: Any
    place: int = 0
    reading: tuple[float, ...] = (1.0,)
    counter: Index | None = None


@dataclass(frozen=True)
class Hanger:
    """Where connectors are hung: the system, the figure's start in it, and the kind of functions.

    Attributes:
        mbs: the Exudyn system.
        placement: the figure's start.
        bodies: Exudyn object of each segment.
        python: whether laws become Python functions instead of expression trees.
    """

    mbs: MainSystem
    placement: Placement
    bodies: Mapping[str, Index]
    python: bool = False

    def markers(self, joint: Joint, frame: Array) -> list[Index]:
        """Markers at the parent's and the child's site, their axes turned by `frame`."""
        turn = homogeneous(frame, np.zeros(3))
        figure = self.placement.tree.figure
        return [
            add_marker(
                self.mbs,
                self.placement,
                self.bodies,
                ref.segment,
                figure.site(ref).pose_in_segment @ turn,
            )
            for ref in (joint.parent, joint.child)
        ]

    def function(self, function: Any, field: str, item: str) -> Any:
        """The function itself, or its expression tree."""
        if self.python:
            return function
        return symbolic_user_function(self.mbs, function, field, item)


def along(spring: AxisSpring, axis: tuple[float, float, float]) -> AxisSpring:
    """The spring told about `axis`, which is its direction or the opposite of it."""
    return spring if float(np.dot(spring.direction, axis)) > 0.0 else spring.turned()


def one_axis(spring: AxisSpring, value: Real, rate: Real, ops: Operations) -> Real:
    """Torque or force on the child of a spring of one displacement."""
    return total_torque(spring.elastic, value, ops) + spring.resistance(value, rate, ops)
