"""Linked and driven turns as constraints that stand in the system.

Exudyn's generic joint has no moving offset on velocity level, and its gears join coordinates, not
turns. So the equations are Python functions of the bodies' coordinates.

Exudyn leaves out of its accelerations at a start what depends on time alone. A table of
displacements does, so time becomes a coordinate: a clock, a mass without forces that starts with
the velocity one, and so heavy that the constraints' forces on it do nothing. What they would do to
it is the work of the drive.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.engine.connector import Hanger
from generator.engine.exudyn_api import Index, MainSystem, items, unused_name
from generator.engine.rate_equations import DrivenTurn, JointTurn, RateEquations, Row, Term
from generator.engine.relative_turn import End, RelativeTurn, end_of
from generator.engine.turn_rates import TurnRates
from generator.figure import Joint
from generator.frames import Array
from generator.posture.links import Link
from generator.posture.prescribed import Prescribed, freedoms_driven

_COORDINATES = 7
"""Of a rigid body with Euler parameters."""

_CLOCK_MASS = 1e15
"""Of the clock [kg]: a drive of a kilowatt slows it by a picosecond a second."""


@dataclass(frozen=True)
class Servo:
    """Equations as they stand in the system.

    Attributes:
        item: the Exudyn constraint, which has a multiplier for each row.
        rows: sums of terms, each of which is zero or follows the drive.
        law: its user functions, which must outlive the system.
    """

    item: Index
    rows: tuple[Row, ...]
    law: RateEquations

    @property
    def driven(self) -> str | None:
        """Name of the joint that is driven; None for links."""
        return None if self.law.motion is None else self.rows[0][0].joint

    def rates(self, times: Array) -> Array:
        """What the rows follow, shape (n, number of rows) [rad/s], at times (n,)."""
        if self.law.motion is None:
            return np.zeros((len(times), len(self.rows)))
        return self.law.motion.rates(times)


def add_servos(hanger: Hanger, prescribed: Prescribed, start: float) -> tuple[Servo, ...]:
    """The constraints of all links and drives.

    Args:
        hanger: where they are hung.
        prescribed: what is linked and driven.
        start: time at which the run begins [s].
    """
    joints = hanger.placement.tree.figure.joints
    servos = [
        _add(hanger, rows, None, None)
        for rows in _rows_of_links(prescribed.links.resolved).values()
    ]
    if not prescribed.drives:
        return tuple(servos)
    clock = _add_clock(hanger.mbs, start)
    for name, drive in prescribed.drives.items():
        chain = hanger.placement.tree.chains[name]
        turns = TurnRates.of(chain, hanger.placement.displacements[name])
        motion = DrivenTurn(chain, turns, drive, freedoms_driven(joints[name], drive))
        servos.append(_add(hanger, motion.rows(name), motion, clock))
    return tuple(servos)


def _rows_of_links(links: Sequence[Link]) -> dict[tuple[str, str], list[Row]]:
    """The equations of links, by the joints that they join."""
    rows: dict[tuple[str, str], list[Row]] = {}
    for link in links:
        follower, control = link.follower, link.control
        row = (
            Term(follower.joint, follower.index),
            Term(control.joint, control.index, -link.factor),
        )
        rows.setdefault((follower.joint, control.joint), []).append(row)
    return rows


def _add_clock(mbs: MainSystem, start: float) -> Index:
    node = mbs.AddNode(
        items.Node1D(
            name=unused_name(mbs, "clock"),
            referenceCoordinates=[0.0],
            initialCoordinates=[start],
            initialVelocities=[1.0],
        )
    )
    mbs.AddObject(
        items.ObjectMass1D(name=unused_name(mbs, "clock"), mass=_CLOCK_MASS, nodeNumber=node)
    )
    return node


def _add(
    hanger: Hanger, rows: Sequence[Row], motion: DrivenTurn | None, clock: Index | None
) -> Servo:
    """The constraint of some rows."""
    mbs, figure = hanger.mbs, hanger.placement.tree.figure
    joints = [figure.joints[name] for name in dict.fromkeys(t.joint for row in rows for t in row)]
    bodies = list(dict.fromkeys(ref.segment for joint in joints for ref in joint.ends))
    bodies = [name for name in bodies if name not in figure.ground]
    places = {name: k * _COORDINATES for k, name in enumerate(bodies)}
    turns = {joint.name: _turn_of(hanger, joint, places) for joint in joints}
    size = len(bodies) * _COORDINATES + (clock is not None)
    law = RateEquations(tuple(rows), turns, size, motion)
    nodes = [mbs.GetObject(hanger.bodies[name])["nodeNumber"] for name in bodies]
    name = " ".join([*(joint.name for joint in joints), "servo"])
    # A constraint has two markers, but an object with no forces of its own has any number of nodes.
    carrier = mbs.AddObject(
        items.ObjectGenericODE2(
            name=unused_name(mbs, name), nodeNumbers=[*nodes, *([] if clock is None else [clock])]
        )
    )
    nothing = mbs.AddNode(items.NodePointGround(name=unused_name(mbs, f"{name} ground")))
    item = mbs.AddObject(
        items.ObjectConnectorCoordinateVector(
            name=unused_name(mbs, f"{name} constraint"),
            markerNumbers=[
                mbs.AddMarker(items.MarkerNodeCoordinates(nodeNumber=nothing)),
                mbs.AddMarker(items.MarkerObjectODE2Coordinates(objectNumber=carrier)),
            ],
            scalingMarker0=np.zeros((len(rows), 1)),  # tells Exudyn how many equations there are
            constraintUserFunction=law.residual,
            jacobianUserFunction=law.jacobian,
        )
    )
    return Servo(item, tuple(rows), law)


def _turn_of(hanger: Hanger, joint: Joint, places: dict[str, int]) -> JointTurn:
    figure, poses = hanger.placement.tree.figure, hanger.placement.poses

    def end(ref: Any) -> End:
        # The marker tells whole coordinates, so nothing is to be added to them.
        return end_of(figure, poses, ref, places.get(ref.segment), (0.0, 0.0, 0.0, 0.0))

    chain = hanger.placement.tree.chains[joint.name]
    turns = {place: k for k, place in enumerate(chain.turns)}
    return JointTurn(
        RelativeTurn(end(joint.parent), end(joint.child)),
        TurnRates.of(chain, hanger.placement.displacements[joint.name]),
        turns,
    )
