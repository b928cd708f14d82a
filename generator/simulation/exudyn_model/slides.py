"""Springs along several translations of a joint that turns, as Exudyn objects.

Exudyn's connectors apply a force at the ends of a screw from one site to the other, not at one
point of both bodies. So the springs of a joint are an `ObjectGenericODE2` on the nodes of its
bodies, which adds forces on their coordinates, and a connector without a force measures the joint.

With translations along axes of the parent, the force acts on both bodies at the child's site, else
at the parent's. It is the sum of the forces f of the springs times the gradients of their
displacements x: the coordinates' generalized force is f dx/dq, since the rates of the displacements
are these gradients times the rates of the coordinates.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.figure import Joint, SiteRef
from generator.rotations import Array
from generator.simulation.exudyn_model.exudyn_api import exu, items, unused_name
from generator.simulation.exudyn_model.springs import (
    Connector,
    SlideFrame,
    SpringBuilder,
    add_wrench_connector,
)
from generator.simulation.run_model import BoundSpring, generalized_force
from springs import FLOATS, AxisSpring

_COORDINATES_PER_BODY = 7
"""Number of coordinates of a rigid body with Euler parameters."""

_SLOPE_STEP = 1e-6
"""Change of a displacement [m] or a rate [m/s] by which the slope of a force is differenced."""


def add_slide_springs(
    builder: SpringBuilder, joint: Joint, springs: Sequence[BoundSpring]
) -> tuple[Connector, ...]:
    """Add the springs along the translations of a joint, a connector for each.

    Args:
        builder: system to build into.
        joint: joint with several translations.
        springs: springs along them.
    """
    chain = builder.placement.tree.chains[joint.name]
    figure = builder.placement.tree.figure
    is_parent = chain.translations_are_outer
    ref = joint.parent if is_parent else joint.child
    body = None if ref.segment in figure.ground else builder.bodies[ref.segment]
    frame = SlideFrame(body, figure.site(ref).pose_in_segment[:3, :3], is_parent)
    oriented = tuple(spring for bound in springs for spring in bound.springs)
    weights = np.array([bound.output_weights for bound in springs])
    moving = [ref.segment for ref in joint.ends if ref.segment not in figure.ground]
    nodes = [builder.mbs.GetObject(builder.bodies[name])["nodeNumber"] for name in moving]
    places = {name: _COORDINATES_PER_BODY * k for k, name in enumerate(moving)}
    parent, child = (_end(builder, one, places) for one in joint.ends)
    size = _COORDINATES_PER_BODY * len(moving)
    functions = _SlideFunctions(oriented, weights, parent, child, is_parent, size)
    builder.mbs.AddObject(
        items.ObjectGenericODE2(
            name=unused_name(builder.mbs, f"{joint.name} slides"),
            nodeNumbers=nodes,
            forceUserFunction=functions.forces,
            jacobianUserFunction=functions.jacobian,
        )
    )
    item, _ = add_wrench_connector(builder, joint, None)
    return tuple(Connector.of(bound, item, functions, frame=frame) for bound in springs)


@dataclass(frozen=True)
class _End:
    """A site of a joint on a moving body or on the ground.

    Attributes:
        place: index of the first coordinate of the body in the object; None on the ground.
        reference: coordinates to which those of the body are added, shape (7,).
        site: pose of the site in the body, whose origin is the centre of mass; of the ground, in
            the world, shape (4, 4).
    """

    place: int | None
    reference: Array
    site: Array

    def state(self, q: Array, q_t: Array) -> "_EndState":
        """Return position, turn and velocities at coordinates and their rates."""
        if self.place is None:
            return _EndState(np.zeros(3), np.eye(3), self.site, np.zeros(3), np.zeros(3), None)
        own = slice(self.place, self.place + _COORDINATES_PER_BODY)
        values, rates = q[own] + self.reference, q_t[own]
        centre, (w, x, y, z) = values[:3], values[3:]
        rate_matrix = 2.0 * np.array([[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])
        body_matrix = 0.5 * np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])
        turn = rate_matrix @ body_matrix.T
        pose = np.eye(4)
        pose[:3, :3] = turn @ self.site[:3, :3]
        pose[:3, 3] = centre + turn @ self.site[:3, 3]
        return _EndState(centre, turn, pose, rates[:3], rate_matrix @ rates[3:], rate_matrix)


@dataclass(frozen=True)
class _EndState:
    """State of an end of a joint, in world axes.

    Attributes:
        centre: position of the centre of mass, shape (3,) [m].
        turn: orientation of the body, shape (3, 3).
        site: pose of the site, shape (4, 4).
        velocity: velocity of the centre of mass, shape (3,) [m/s].
        spin: angular velocity, shape (3,) [rad/s].
        rate_matrix: matrix from rates of Euler parameters to the spin, (3, 4); None on the ground.
    """

    centre: Array
    turn: Array
    site: Array
    velocity: Array
    spin: Array
    rate_matrix: Array | None

    def generalized(self, forces: Array, point: Array) -> Array:
        """Return forces (n, 3) at a point as generalized forces of the coordinates, (n, 7)."""
        assert self.rate_matrix is not None
        moments = np.cross(point - self.centre, forces)
        return np.concatenate([forces, moments @ self.rate_matrix], axis=1)


@dataclass(frozen=True)
class _SlideFunctions:
    """User functions of the springs along the translations of a joint.

    Attributes:
        springs: springs, in the sense of the translations.
        weights: weights of an offset in their displacements, shape (n, 3).
        parent: parent's site.
        child: child's site.
        is_parent: whether translations are along axes of the parent.
        size: number of coordinates of the object.
    """

    springs: tuple[AxisSpring, ...]
    weights: Array
    parent: _End
    child: _End
    is_parent: bool
    size: int

    def _motion(self, q: Any, q_t: Any) -> tuple[Array, Array, Array]:
        """Displacements and rates of the springs (n,), and their gradients (n, size)."""
        q, q_t = np.asarray(q), np.asarray(q_t)
        parent, child = (end.state(q, q_t) for end in (self.parent, self.child))
        axes, point = (parent, child) if self.is_parent else (child, parent)
        directions = self.weights @ axes.site[:3, :3].T
        gradients = np.zeros((len(self.springs), self.size))
        for end, state, sign in ((self.parent, parent, -1.0), (self.child, child, 1.0)):
            if end.place is not None:
                own = slice(end.place, end.place + _COORDINATES_PER_BODY)
                gradients[:, own] = state.generalized(sign * directions, point.site[:3, 3])
        offset = child.site[:3, 3] - parent.site[:3, 3]
        return directions @ offset, gradients @ q_t, gradients

    def _forces(self, displacements: Array, rates: Array) -> Array:
        """Forces of the springs, shape (n,) [N]."""
        rows = zip(self.springs, displacements.tolist(), rates.tolist(), strict=True)
        return np.array([generalized_force(spring, x, v, FLOATS) for spring, x, v in rows])

    def forces(self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any) -> list[float]:
        """Generalized forces on the bodies' coordinates."""
        displacements, rates, gradients = self._motion(q, q_t)
        return (self._forces(displacements, rates) @ gradients).tolist()

    def jacobian(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, fODE2: float, fODE2_t: float
    ) -> Any:
        """Minus the derivatives of the forces by coordinates and rates, times the factors.

        The change of the gradients is neglected: a modified Newton iteration converges without it.
        """
        x, v, gradients = self._motion(q, q_t)
        step = _SLOPE_STEP
        by_place = (self._forces(x + step, v) - self._forces(x - step, v)) / (2.0 * step)
        by_rate = (self._forces(x, v + step) - self._forces(x, v - step)) / (2.0 * step)
        slopes = fODE2 * by_place + fODE2_t * by_rate
        matrix = exu.MatrixContainer()
        matrix.SetWithDenseMatrix(-gradients.T * slopes @ gradients, useDenseMatrix=False)
        return matrix


def _end(builder: SpringBuilder, ref: SiteRef, places: Mapping[str, int]) -> _End:
    """Return the site of a joint on a body of the object, or on the ground."""
    placement = builder.placement
    site = placement.tree.figure.site(ref).pose_in_segment
    place = places.get(ref.segment)
    if place is None:
        return _End(None, np.zeros(_COORDINATES_PER_BODY), placement.poses[ref.segment] @ site)
    segment = placement.tree.figure.segments[ref.segment]
    assert segment.centre_of_mass is not None
    site = site.copy()
    site[:3, 3] -= segment.centre_of_mass
    node = builder.mbs.GetObject(builder.bodies[ref.segment])["nodeNumber"]
    reference = builder.mbs.GetNode(node)["referenceCoordinates"]
    return _End(place, np.array(reference, dtype=float), site)
