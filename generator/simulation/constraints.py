"""Equations between the rates of joints, as user functions of a constraint of Exudyn.

They are `J(q) v = 0`, where a row of J gives the rate of one displacement, or a component of the
angular velocity, of a joint by the Euler parameters of its bodies. Exudyn's index-2 integrator asks
for `J v` and for J, and at each start finds the slope of `J v` by q, from which it has the
accelerations.

Linked and driven turns as constraints that stand in the system.

Exudyn's generic joint has no moving offset on velocity level, and its gears join coordinates, not
turns. So the equations are Python functions of the bodies' coordinates.

Exudyn leaves out of its accelerations at a start what depends on time alone. A table of
displacements does, so time becomes a coordinate: a clock, a mass without forces that starts with
the velocity one, and so heavy that the constraints' forces on it do nothing. What they would do to
it is the work of the drive.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.drive import Drive
from generator.figure import Joint
from generator.joint_chain import Chain
from generator.kinematics.links import Link
from generator.kinematics.prescribed import PrescribedMotion, driven_indices
from generator.rotations import Array
from generator.simulation.exudyn_api import Index, MainSystem, exu, items, unused_name
from generator.simulation.relative_rotation import (
    JointEnd,
    JointRates,
    Quaternion,
    RelativeRotation,
    Vector,
    build_joint_end,
)
from generator.simulation.springs import SpringBuilder

_UNIT_AXES: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class RateTerm:
    """A rate in an equation, times a factor.

    Attributes:
        joint: whose rate.
        component: the place of a displacement in the joint's chain, or an axis of the parent's site along
            which the relative angular velocity is taken.
        factor: of the rate.
    """

    joint: str
    component: int | Vector
    factor: float = 1.0


RateEquation = tuple[RateTerm, ...]


@dataclass(frozen=True)
class JointRotation:
    """The turn of one joint of a law; `rotation_indices` finds the turn of a place in its chain."""

    rotation: RelativeRotation
    rates: JointRates
    rotation_indices: dict[int, int]


@dataclass(frozen=True)
class DrivenRotation:
    """The rates that the table of one joint asks for.

    A joint all of whose turns are driven follows an angular velocity, which is defined in every
    orientation; of single displacements the rates are not where two axes fall together.
    """

    chain: Chain
    joint_rates: JointRates
    drive: Drive
    driven_indices: tuple[int, ...]

    @property
    def _is_fully_driven(self) -> bool:
        return len(self.chain.rotations) == 3 and set(self.driven_indices) == set(
            self.chain.rotations
        )

    def equations(self, name: str) -> list[RateEquation]:
        """The equations."""
        if self._is_fully_driven:
            return [(RateTerm(name, axis),) for axis in _UNIT_AXES]
        return [(RateTerm(name, k),) for k in self.driven_indices]

    def rates(self, times: float | Array) -> Array:
        """What the rows follow [rad/s], shape (..., number of rows), at times of shape (...)."""
        rates = self.drive.rates(times)
        if not self._is_fully_driven:
            return rates
        order = [self.driven_indices.index(place) for place in self.chain.rotations]
        angles, rates = self.drive.displacements(times)[..., order], rates[..., order]
        found = [
            self.joint_rates.angular_velocity(one, other)
            for one, other in zip(
                angles.reshape(-1, 3).tolist(), rates.reshape(-1, 3).tolist(), strict=True
            )
        ]
        return np.array(found).reshape(rates.shape)


class RateConstraint:
    """The user functions of a servo; they keep what they found for the last coordinates."""

    def __init__(
        self,
        equations: tuple[RateEquation, ...],
        rotations: Mapping[str, JointRotation],
        size: int,
        driven_rotation: DrivenRotation | None,
    ) -> None:
        """Equations `equations` of joints `rotations` over `size` coordinates, the last of them the clock's.

        With a motion, the rows follow it; without one they are zero, and there is no clock.
        """
        self.driven_rotation = driven_rotation
        self._rows, self._turns, self._size = equations, rotations, size
        self._at: Sequence[float] = ()
        self._found = np.zeros((0, 0))
        self._time, self._rates = float("nan"), np.zeros(0)

    def residual(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, velocityLevel: bool
    ) -> Any:
        """`J v`: Exudyn's index-2 integrator asks for nothing else."""
        return self._jacobian_matrix(q) @ np.asarray(q_t)

    def jacobian(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, velocityLevel: bool
    ) -> Any:
        """J, which is the slope of `J v` by v, and the direction of the constraints' forces."""
        matrix = exu.MatrixContainer()
        matrix.SetWithDenseMatrix(self._jacobian_matrix(q), useDenseMatrix=True)
        return matrix

    def _jacobian_matrix(self, q: Sequence[float]) -> Array:
        if q == self._at:
            return self._found
        ends = {name: turn.rotation.orientations(q) for name, turn in self._turns.items()}
        axes = {name: turn.rates.rate_axes(ends[name][2]) for name, turn in self._turns.items()}
        found: list[list[float]] = []
        for row in self._rows:
            forces = [0.0] * self._size
            for term in row:
                turn = self._turns[term.joint]
                axis = (
                    axes[term.joint][turn.rotation_indices[term.component]]
                    if isinstance(term.component, int)
                    else term.component
                )
                gradient = _rate_gradient(ends[term.joint][2], axis, term.factor)
                turn.rotation.add_forces(forces, ends[term.joint], gradient)
            found.append(forces)
        matrix = np.array(found)
        if self.driven_rotation is not None:
            matrix[:, -1] = -self._driven_rates(q[-1])
        self._at, self._found = list(q), matrix
        return matrix

    def _driven_rates(self, time: float) -> Array:
        """What the rows follow at a time, which is the same for all iterations of a step."""
        assert self.driven_rotation is not None
        if time != self._time:
            self._time, self._rates = time, self.driven_rotation.rates(time)
        return self._rates


def _rate_gradient(rotation: Quaternion, axis: Vector, factor: float) -> Quaternion:
    """Slope, by the turn, of a rate `factor * axis . omega`: the turn changes by omega turn / 2."""
    w, a, b, c = rotation
    x, y, z = axis
    size = 2.0 * factor / (w * w + a * a + b * b + c * c)
    return (
        -size * (x * a + y * b + z * c),
        size * (x * w + y * c - z * b),
        size * (y * w + z * a - x * c),
        size * (z * w + x * b - y * a),
    )


_COORDINATES_PER_BODY = 7
"""Of a rigid body with Euler parameters."""

_CLOCK_MASS = 1e15
"""Of the clock [kg]: a drive of a kilowatt slows it by a picosecond a second."""


@dataclass(frozen=True)
class CoordinateConstraint:
    """Equations as they stand in the system.

    Attributes:
        item: the Exudyn constraint, which has a multiplier for each row.
        equations: sums of terms, each of which is zero or follows the drive.
        rate_constraint: its user functions, which must outlive the system.
    """

    item: Index
    equations: tuple[RateEquation, ...]
    rate_constraint: RateConstraint

    @property
    def driven_joint(self) -> str | None:
        """Name of the joint that is driven; None for links."""
        return None if self.rate_constraint.driven_rotation is None else self.equations[0][0].joint

    def rates(self, times: Array) -> Array:
        """What the rows follow, shape (n, number of rows) [rad/s], at times (n,)."""
        if self.rate_constraint.driven_rotation is None:
            return np.zeros((len(times), len(self.equations)))
        return self.rate_constraint.driven_rotation.rates(times)


def add_coordinate_constraints(
    builder: SpringBuilder, prescribed: PrescribedMotion, start: float
) -> tuple[CoordinateConstraint, ...]:
    """The constraints of all links and drives.

    Args:
        builder: where they are hung.
        prescribed: what is linked and driven.
        start: time at which the run begins [s].
    """
    joints = builder.placement.tree.figure.joints
    servos = [
        _add_constraint(builder, rows, None, None)
        for rows in _link_equations(prescribed.links.resolved).values()
    ]
    if not prescribed.drives:
        return tuple(servos)
    clock = _add_clock(builder.mbs, start)
    for name, drive in prescribed.drives.items():
        chain = builder.placement.tree.chains[name]
        turns = JointRates.from_chain(chain, builder.placement.displacements[name])
        motion = DrivenRotation(chain, turns, drive, driven_indices(joints[name], drive))
        servos.append(_add_constraint(builder, motion.equations(name), motion, clock))
    return tuple(servos)


def _link_equations(links: Sequence[Link]) -> dict[tuple[str, str], list[RateEquation]]:
    """The equations of links, by the joints that they join."""
    rows: dict[tuple[str, str], list[RateEquation]] = {}
    for link in links:
        follower, control = link.follower, link.control
        row = (
            RateTerm(follower.joint, follower.index),
            RateTerm(control.joint, control.index, -link.factor),
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


def _add_constraint(
    builder: SpringBuilder,
    equations: Sequence[RateEquation],
    driven_rotation: DrivenRotation | None,
    clock: Index | None,
) -> CoordinateConstraint:
    """The constraint of some rows."""
    mbs, figure = builder.mbs, builder.placement.tree.figure
    joints = [
        figure.joints[name] for name in dict.fromkeys(t.joint for row in equations for t in row)
    ]
    bodies = list(dict.fromkeys(ref.segment for joint in joints for ref in joint.ends))
    bodies = [name for name in bodies if name not in figure.ground]
    places = {name: k * _COORDINATES_PER_BODY for k, name in enumerate(bodies)}
    turns = {joint.name: _build_joint_rotation(builder, joint, places) for joint in joints}
    size = len(bodies) * _COORDINATES_PER_BODY + (clock is not None)
    law = RateConstraint(tuple(equations), turns, size, driven_rotation)
    nodes = [mbs.GetObject(builder.bodies[name])["nodeNumber"] for name in bodies]
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
            scalingMarker0=np.zeros(
                (len(equations), 1)
            ),  # tells Exudyn how many equations there are
            constraintUserFunction=law.residual,
            jacobianUserFunction=law.jacobian,
        )
    )
    return CoordinateConstraint(item, tuple(equations), law)


def _build_joint_rotation(
    builder: SpringBuilder, joint: Joint, first_coordinates: dict[str, int]
) -> JointRotation:
    figure, poses = builder.placement.tree.figure, builder.placement.poses

    def end(ref: Any) -> JointEnd:
        # The marker tells whole coordinates, so nothing is to be added to them.
        return build_joint_end(
            figure, poses, ref, first_coordinates.get(ref.segment), (0.0, 0.0, 0.0, 0.0)
        )

    chain = builder.placement.tree.chains[joint.name]
    turns = {place: k for k, place in enumerate(chain.rotations)}
    return JointRotation(
        RelativeRotation(end(joint.parent), end(joint.child)),
        JointRates.from_chain(chain, builder.placement.displacements[joint.name]),
        turns,
    )
