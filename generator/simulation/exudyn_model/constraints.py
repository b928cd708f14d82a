"""Linked and driven displacements as rate constraints with Python user functions.

The equations are `J(q) v = 0`. A row of J gives the rate of one displacement of a joint, or a
component of its angular velocity, as a function of the Euler parameters of its bodies. Exudyn's
index-2 integrator evaluates `J v` and J, and differentiates `J v` with respect to q at each start
to find the initial accelerations. Exudyn's generic joint has no moving offset on velocity level,
and its gears couple coordinates, not rotations.

Exudyn omits explicit time dependence from its initial accelerations. A drive depends on time, so
time becomes a coordinate: a clock, a mass without forces that starts with unit velocity and is so
heavy that the constraint forces do not change it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.drive import Drive
from generator.figure import Joint, SiteRef
from generator.follower_curve import FollowerCurve
from generator.joint_chain import Chain
from generator.kinematics.links import Link
from generator.kinematics.prescribed import PrescribedMotion, driven_indices
from generator.rotations import Array, inverse_pose, matrix_from_quaternion, pose_matrix
from generator.simulation.exudyn_model.bodies import require_centre_of_mass
from generator.simulation.exudyn_model.exudyn_api import Index, MainSystem, exu, items, unused_name
from generator.simulation.exudyn_model.relative_rotation import (
    JointEnd,
    JointRates,
    Quaternion,
    RelativeRotation,
    Vector,
    build_joint_end,
    product,
)
from generator.simulation.exudyn_model.springs import SpringBuilder

_UNIT_AXES: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class RateTerm:
    """A rate times a factor, as a term of an equation.

    Attributes:
        joint: name of the joint.
        component: index of a displacement in the joint's chain, or an axis of the parent's site for
            a component of the relative angular velocity.
        factor: coefficient of the rate.
        curve: curve of the displacement whose derivative multiplies the factor; None for none.
    """

    joint: str
    component: int | Vector
    factor: float = 1.0
    curve: FollowerCurve | None = None


RateEquation = tuple[RateTerm, ...]


@dataclass(frozen=True)
class SiteEnd:
    """A joint's site on a moving body, or on the ground.

    Attributes:
        first_coordinate: Index of the body's first coordinate; None for the ground.
        pose: Pose of the site relative to the body's centre of mass, or in the world, (4, 4).
    """

    first_coordinate: int | None
    pose: Array

    def place(self, coordinates: Sequence[float]) -> tuple[Array, Array, Array]:
        """Pose of the site in the world (4, 4), centre (3,) and Euler parameters (4,)."""
        if self.first_coordinate is None:
            return self.pose, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        own = np.array(coordinates[self.first_coordinate :][:_COORDINATES_PER_BODY])
        turn = matrix_from_quaternion(own[3:] / np.linalg.norm(own[3:]))
        return pose_matrix(turn, own[:3]) @ self.pose, own[:3], own[3:]

    def add_force(self, forces: list[float], force: Array, moment: Array, turn: Array) -> None:
        """Add a force and a moment about the centre to the forces on the coordinates."""
        if self.first_coordinate is not None:
            w, x, y, z = turn.tolist()
            a, b, c = (2.0 / (turn @ turn) * moment).tolist()
            parts = [*force.tolist(), *product((0.0, a, b, c), (w, x, y, z))]
            for k, part in enumerate(parts, self.first_coordinate):
                forces[k] += part


@dataclass
class JointRotation:
    """Motion of a joint by the coordinates of its bodies.

    Attributes:
        rotation: Rotation of the child's site in the parent's.
        rates: Rates of the rotations.
        rotation_indices: Places of the rotations by indices in the chain.
        chain: Chain of the joint.
        ends: Parent's and child's site.
        near: Displacements nearby, for whole turns, shape (n,).
    """

    rotation: RelativeRotation
    rates: JointRates
    rotation_indices: dict[int, int]
    chain: Chain
    ends: tuple[SiteEnd, SiteEnd]
    near: Array

    def displacements(self, q: Sequence[float]) -> Array:
        """Displacements of the joint, shape (n,) [rad or m]."""
        parent, child = (end.place(q)[0] for end in self.ends)
        return self.chain.displacements(inverse_pose(parent) @ child, self.near)

    def add_slide(self, forces: list[float], q: Sequence[float], index: int, factor: float) -> None:
        """Add factor times the derivative of a translation to the forces on the coordinates."""
        base, other = self.ends
        gradient = factor * self.chain.translation_gradient(index)
        if not self.chain.translations_are_outer:
            base, other, gradient = other, base, -gradient
        (pose, centre, turn), (other_pose, other_centre, other_turn) = base.place(q), other.place(q)
        force, place = pose[:3, :3] @ gradient, other_pose[:3, 3]
        base.add_force(forces, -force, -np.cross(place - centre, force), turn)
        other.add_force(forces, force, np.cross(place - other_centre, force), other_turn)


@dataclass(frozen=True)
class DrivenRotation:
    """Rates prescribed by the drive of one joint.

    A joint with all its rotations driven follows an angular velocity, which is defined in every
    orientation; rates of single displacements are undefined where two axes coincide.
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
        """Return the equations that follow the drive, for the joint of this name."""
        if self._is_fully_driven:
            return [(RateTerm(name, axis),) for axis in _UNIT_AXES]
        return [(RateTerm(name, k),) for k in self.driven_indices]

    def rates(self, times: float | Array) -> Array:
        """Prescribed rates [rad/s], shape (..., number of rows), at times of shape (...)."""
        rates = self.drive.rates(times)
        if not self._is_fully_driven:
            return rates
        order = [self.driven_indices.index(index) for index in self.chain.rotations]
        angles, rates = self.drive.displacements(times)[..., order], rates[..., order]
        angular_velocities = [
            self.joint_rates.angular_velocity(angle, rate)
            for angle, rate in zip(
                angles.reshape(-1, 3).tolist(), rates.reshape(-1, 3).tolist(), strict=True
            )
        ]
        return np.array(angular_velocities).reshape(rates.shape)

    def accelerations(self, time: float) -> Array:
        """Derivatives of the prescribed rates [rad/s^2], shape (number of rows,), at a time."""
        accelerations = self.drive.accelerations(time)
        if not self._is_fully_driven:
            return accelerations
        order = [self.driven_indices.index(index) for index in self.chain.rotations]
        derivatives = (self.drive.displacements(time), self.drive.rates(time), accelerations)
        angles, rates, second = (values[order].tolist() for values in derivatives)
        return np.array(self.joint_rates.angular_acceleration(angles, rates, second))


class RateConstraint:
    """User functions of a rate constraint; the Jacobian of the last coordinates is cached."""

    def __init__(
        self,
        equations: tuple[RateEquation, ...],
        rotations: Mapping[str, JointRotation],
        size: int,
        driven_rotation: DrivenRotation | None,
    ) -> None:
        """Set up the equations over `size` coordinates.

        With a driven rotation the last coordinate is the clock; without one the rows are zero.
        """
        self.driven_rotation = driven_rotation
        self._rows, self._rotations, self._size = equations, rotations, size
        self._coordinates: Sequence[float] = ()
        self._jacobian = np.zeros((0, 0))
        self._time, self._rates = float("nan"), np.zeros(0)
        self._places: dict[RateTerm, Any] | None = None

    def residual(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, velocityLevel: bool
    ) -> Any:
        """`J v`, the only residual that Exudyn's index-2 integrator evaluates."""
        return self._jacobian_matrix(q) @ np.asarray(q_t)

    def jacobian(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, velocityLevel: bool
    ) -> Any:
        """J, the derivative of `J v` with respect to v and the direction of the forces."""
        if self._has_curves:  # a step of the integrator, unlike `residual`
            self.set_near({name: one.displacements(q) for name, one in self._rotations.items()})
        matrix = exu.MatrixContainer()
        matrix.SetWithDenseMatrix(self._jacobian_matrix(q), useDenseMatrix=True)
        return matrix

    @property
    def _has_curves(self) -> bool:
        return any(term.curve is not None for row in self._rows for term in row)

    def set_near(self, displacements: Mapping[str, Array]) -> None:
        """Set displacements of the joints, shape (n,), near those of the next evaluations."""
        for name, joint in self._rotations.items():
            joint.near = displacements[name]

    def hold_pieces(self, *, hold: bool) -> None:
        """Use the pieces of curves of the next evaluation for those after it, or no longer."""
        self._places, self._coordinates = ({} if hold else None), ()

    def _factor(self, term: RateTerm, q: Sequence[float]) -> float:
        """Coefficient of a rate."""
        if term.curve is None or not isinstance(term.component, int):
            return term.factor
        value = self._rotations[term.joint].displacements(q)[term.component]
        places = term.curve.places(value)
        if self._places is not None:
            places = self._places.setdefault(term, places)
        return term.factor * float(term.curve.at(value, 1, places))

    def _jacobian_matrix(self, q: Sequence[float]) -> Array:
        if q == self._coordinates:
            return self._jacobian
        ends = {name: joint.rotation.orientations(q) for name, joint in self._rotations.items()}
        axes = {
            name: joint.rates.rate_axes(ends[name][2]) for name, joint in self._rotations.items()
        }
        jacobian: list[list[float]] = []
        for row in self._rows:
            forces = [0.0] * self._size
            for term in row:
                joint, factor = self._rotations[term.joint], self._factor(term, q)
                if isinstance(term.component, int) and term.component in joint.chain.translations:
                    joint.add_slide(forces, q, term.component, factor)
                    continue
                axis = (
                    axes[term.joint][joint.rotation_indices[term.component]]
                    if isinstance(term.component, int)
                    else term.component
                )
                gradient = _rate_gradient(ends[term.joint][2], axis, factor)
                joint.rotation.add_forces(forces, ends[term.joint], gradient)
            jacobian.append(forces)
        matrix = np.array(jacobian)
        if self.driven_rotation is not None:
            matrix[:, -1] = -self._driven_rates(q[-1])
        self._coordinates, self._jacobian = list(q), matrix
        return matrix

    def _driven_rates(self, time: float) -> Array:
        """Prescribed rates at a time, cached for the iterations of a step."""
        assert self.driven_rotation is not None
        if time != self._time:
            self._time, self._rates = time, self.driven_rotation.rates(time)
        return self._rates


def _rate_gradient(rotation: Quaternion, axis: Vector, factor: float) -> Quaternion:
    """Derivative of a rate `factor * axis . omega` with respect to the rate of the quaternion."""
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
"""Number of coordinates of a rigid body with Euler parameters."""

_CLOCK_MASS = 1e15
"""Mass of the clock [kg]; a drive of 1 kW slows it by 1 ps per second."""


@dataclass(frozen=True)
class CoordinateConstraint:
    """Rate equations built into the system.

    Attributes:
        item: the Exudyn constraint, with a multiplier for each row.
        equations: sums of terms, each equal to zero or to a prescribed rate.
        rate_constraint: its user functions, which must outlive the system.
    """

    item: Index
    equations: tuple[RateEquation, ...]
    rate_constraint: RateConstraint

    @property
    def driven_joint(self) -> str | None:
        """Name of the driven joint; None for links."""
        return None if self.rate_constraint.driven_rotation is None else self.equations[0][0].joint

    def rates(self, times: Array) -> Array:
        """Prescribed rates, shape (n, number of rows) [rad/s], at times (n,)."""
        if self.rate_constraint.driven_rotation is None:
            return np.zeros((len(times), len(self.equations)))
        return self.rate_constraint.driven_rotation.rates(times)


def add_coordinate_constraints(
    builder: SpringBuilder, prescribed: PrescribedMotion, start: float
) -> tuple[CoordinateConstraint, ...]:
    """Add the constraints of all links and drives.

    Args:
        builder: the system to build into.
        prescribed: links and drives.
        start: initial time [s].
    """
    joints = builder.placement.tree.figure.joints
    constraints = [
        _add_constraint(builder, rows, None, None)
        for rows in _link_equations(prescribed.resolved_links).values()
    ]
    if not prescribed.drives:
        return tuple(constraints)
    clock = _add_clock(builder.mbs, start)
    for name, drive in prescribed.drives.items():
        chain = builder.placement.tree.chains[name]
        joint_rates = JointRates.from_chain(chain, builder.placement.displacements[name])
        driven = DrivenRotation(chain, joint_rates, drive, driven_indices(joints[name], drive))
        constraints.append(_add_constraint(builder, driven.equations(name), driven, clock))
    return tuple(constraints)


def _link_equations(links: Sequence[Link]) -> dict[tuple[str, str], list[RateEquation]]:
    """Return the equations of links by pair of joints."""
    rows: dict[tuple[str, str], list[RateEquation]] = {}
    for link in links:
        follower, control = link.follower, link.control
        row = (
            RateTerm(follower.joint, follower.index),
            RateTerm(control.joint, control.index, -link.factor, link.curve),
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
    """Add one constraint with the given equations as its rows."""
    mbs, figure = builder.mbs, builder.placement.tree.figure
    joints = [
        figure.joints[name] for name in dict.fromkeys(t.joint for row in equations for t in row)
    ]
    bodies = list(dict.fromkeys(ref.segment for joint in joints for ref in joint.ends))
    bodies = [name for name in bodies if name not in figure.ground]
    first_coordinates = {name: k * _COORDINATES_PER_BODY for k, name in enumerate(bodies)}
    rotations = {
        joint.name: _build_joint_rotation(builder, joint, first_coordinates) for joint in joints
    }
    size = len(bodies) * _COORDINATES_PER_BODY + (clock is not None)
    user_functions = RateConstraint(tuple(equations), rotations, size, driven_rotation)
    nodes = [mbs.GetObject(builder.bodies[name])["nodeNumber"] for name in bodies]
    name = " ".join([*(joint.name for joint in joints), "rates"])
    # A constraint has two markers, but an object without forces may have any number of nodes.
    carrier = mbs.AddObject(
        items.ObjectGenericODE2(
            name=unused_name(mbs, name), nodeNumbers=[*nodes, *([] if clock is None else [clock])]
        )
    )
    ground_node = mbs.AddNode(items.NodePointGround(name=unused_name(mbs, f"{name} ground")))
    item = mbs.AddObject(
        items.ObjectConnectorCoordinateVector(
            name=unused_name(mbs, f"{name} constraint"),
            markerNumbers=[
                mbs.AddMarker(items.MarkerNodeCoordinates(nodeNumber=ground_node)),
                mbs.AddMarker(items.MarkerObjectODE2Coordinates(objectNumber=carrier)),
            ],
            scalingMarker0=np.zeros(
                (len(equations), 1)
            ),  # tells Exudyn how many equations there are
            constraintUserFunction=user_functions.residual,
            jacobianUserFunction=user_functions.jacobian,
        )
    )
    return CoordinateConstraint(item, tuple(equations), user_functions)


def _build_joint_rotation(
    builder: SpringBuilder, joint: Joint, first_coordinates: dict[str, int]
) -> JointRotation:
    figure, poses = builder.placement.tree.figure, builder.placement.poses

    def end(ref: Any) -> JointEnd:
        # The marker returns total coordinates, so the reference is zero.
        return build_joint_end(
            figure, poses, ref, first_coordinates.get(ref.segment), (0.0, 0.0, 0.0, 0.0)
        )

    def site_end(ref: SiteRef) -> SiteEnd:
        pose, first = figure.site(ref).pose_in_segment, first_coordinates.get(ref.segment)
        if first is None:
            return SiteEnd(None, poses[ref.segment] @ pose)
        centre = require_centre_of_mass(figure.segments[ref.segment])
        return SiteEnd(first, pose_matrix(np.eye(3), -centre) @ pose)

    chain = builder.placement.tree.chains[joint.name]
    near = builder.placement.displacements[joint.name]
    rotation_indices = {place: k for k, place in enumerate(chain.rotations)}
    return JointRotation(
        RelativeRotation(end(joint.parent), end(joint.child)),
        JointRates.from_chain(chain, near),
        rotation_indices,
        chain,
        (site_end(joint.parent), site_end(joint.child)),
        near,
    )
