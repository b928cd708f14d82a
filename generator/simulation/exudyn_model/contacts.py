"""Contact of a figure in Exudyn: connectors of spheres and props, an object of all capsules.

Every pair of a contact sphere and a prop is a connector between the prop and the centre of the
sphere. Its user function is `contact_force` of `generator.contact.force` in the axes of the prop.

Where parts of the body have laws, all contact is one `ObjectGenericODE2` on the bodies' nodes.

Exudyn's connectors transmit no moment of their forces about each other's markers, and do not know
the angular velocity of the first one. So all pairs of capsules are one `ObjectGenericODE2` on the
nodes of their bodies as well, as coupled laws are, with a Python function that evaluates the law
for arrays. It has a Jacobian because Exudyn's numerical one would call it for each coordinate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.contact.force import contact_force
from generator.contact.scene import Prop
from generator.contact.self_contact import CapsulePair
from generator.contact.shape import Shape
from generator.contact.states import (
    CapsuleTable,
    ContactModel,
    evaluate_contacts,
    evaluate_self_contact,
    turned,
)
from generator.figure import ContactSphere, Figure
from generator.kinematics.placement import Placement
from generator.rotations import Array, pose_matrix
from generator.simulation.exudyn_model.bodies import add_marker
from generator.simulation.exudyn_model.exudyn_api import (
    SYMBOLIC,
    Index,
    MainSystem,
    exu,
    items,
    symbolic_user_function,
    unused_name,
)
from generator.simulation.plan import NO_LIMIT, WallLimit
from springs import FLOATS
from springs.contact import Surface

_CONNECTORS_AT_ONCE = 100
"""Number of connectors that are added between looks at the clock."""

_MAX_LENGTHS = 5
"""Most lengths of a shape: a connector's `offset` holds six numbers, the first is the radius."""

_COORDINATES = 7
"""Number of coordinates of a rigid body with Euler parameters."""

_NEAR = 1e-3
"""Distance below which a sphere and a prop are evaluated [m]: many times a step of differences."""

_DIFFERENCE = 1e-7
"""Step of the differences for the Jacobian, in all coordinates [m or 1] and their rates."""


def add_contacts(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    ground: Index,
    contacts: ContactModel,
    *,
    python_torques: bool,
    limit: WallLimit = NO_LIMIT,
) -> ContactModel:
    """Add a connector for each contact sphere and prop, and an object for all pairs of capsules.

    Args:
        mbs: the system to build into.
        placement: initial placement of the figure.
        bodies: Exudyn object of each segment.
        ground: Exudyn object of the ground.
        contacts: props, spheres and pairs.
        python_torques: whether forces of props are Python functions instead of expression trees.
        limit: wall-time limit of the run.

    Raises WallLimitError.
    """
    if contacts.laws:
        figure = placement.tree.figure
        made = _add_object(mbs, "contact", figure, bodies, _PartContact(contacts, figure))
        return replace(contacts, functions=made)
    centres = {
        (name, k): add_marker(
            mbs, placement, bodies, name, pose_matrix(np.eye(3), np.asarray(sphere.centre))
        )
        for name, some in contacts.spheres.items()
        for k, sphere in enumerate(some)
    }
    connectors: list[Index] = []
    functions: dict[tuple[type[Shape], Surface], Any] = {}
    for prop in contacts.scene.props:
        pose = prop.shape.pose
        origin = mbs.AddMarker(
            items.MarkerBodyRigid(
                bodyNumber=ground, localHT=exu.HT(rotation=pose[:3, :3], translation=pose[:3, 3])
            )
        )
        kind = type(prop.shape), prop.surface
        if kind not in functions:
            functions[kind] = _user_function(mbs, prop, python_torques)
        unused = [0.0] * (_MAX_LENGTHS - len(prop.shape.lengths))
        for (name, k), centre in centres.items():
            if len(connectors) % _CONNECTORS_AT_ONCE == _CONNECTORS_AT_ONCE - 1:
                limit.require_time(f"at prop {prop.name}, while the model was built")
            # Without a name, which Exudyn would compare with those of all other objects.
            connectors.append(
                mbs.AddObject(
                    items.ObjectConnectorRigidBodySpringDamper(
                        markerNumbers=[origin, centre],
                        offset=[
                            contacts.spheres[name][k].radius,
                            *prop.shape.lengths,
                            *unused,
                        ],
                        useIntrinsicFormulation=False,
                        springForceTorqueUserFunction=functions[kind],
                    )
                )
            )
    more: Sequence[Any] = ()
    if contacts.pairs:
        more = add_self_contact(mbs, placement.tree.figure, bodies, contacts.pairs)
    return replace(contacts, connectors=tuple(connectors), functions=(*functions.values(), *more))


def _user_function(mbs: MainSystem, prop: Prop, python_torques: bool) -> Any:
    """Return minus the force on a sphere and its moment about the centre, in the prop's axes.

    The connector's `offset` holds the radius of the sphere and the lengths of the shape, so that
    one function serves all props of a kind and a surface.
    """
    ops = FLOATS if python_torques else SYMBOLIC

    def user_function(
        mbs: Any,
        t: Any,
        itemNumber: Any,
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
        centre, speed, spin = (
            (vector[0], vector[1], vector[2])
            for vector in (displacement, velocity, angularVelocity)
        )
        lengths = tuple(offset[1 + k] for k in range(len(prop.shape.lengths)))
        force = contact_force(
            prop.shape, prop.surface, offset[0], centre, speed, spin, ops, lengths=lengths
        )
        parts = [-1.0 * part for part in (*force.direction, *force.arm)]
        return ops.scaled(force.normal, ops.vector(parts))

    if python_torques:
        return user_function
    return symbolic_user_function(
        mbs,
        user_function,
        "springForceTorqueUserFunction",
        "ObjectConnectorRigidBodySpringDamper",
    )


def add_self_contact(
    mbs: MainSystem, figure: Figure, bodies: Mapping[str, Index], pairs: Sequence[CapsulePair]
) -> tuple[Any, ...]:
    """Add the object of all pairs of capsules.

    Args:
        mbs: the system to build into.
        figure: the figure.
        bodies: Exudyn object of each segment.
        pairs: pairs of capsules, at least one.

    Returns:
        Its user functions, which must outlive the system.
    """
    contact = _SelfContact(CapsuleTable.of(pairs, figure))
    return _add_object(mbs, "self-contact", figure, bodies, contact)


def _add_object(
    mbs: MainSystem,
    name: str,
    figure: Figure,
    bodies: Mapping[str, Index],
    contact: "_SelfContact | _PartContact",
) -> tuple[Any, ...]:
    """Add an object of the forces on all bodies; return its user functions."""
    nodes = [mbs.GetObject(bodies[body])["nodeNumber"] for body in figure.bodies]
    reference = np.concatenate([mbs.GetNode(node)["referenceCoordinates"] for node in nodes])
    functions = _UserFunctions(contact, reference)
    mbs.AddObject(
        items.ObjectGenericODE2(
            name=unused_name(mbs, name),
            nodeNumbers=nodes,
            forceUserFunction=functions.forces,
            jacobianUserFunction=functions.jacobian,
        )
    )
    return functions.forces, functions.jacobian


@dataclass(frozen=True)
class _SelfContact:
    """Forces of capsules on each other."""

    table: CapsuleTable

    def near(self, positions: Array, rotations: Array) -> "_SelfContact":
        """Return what may touch in a state."""
        return _SelfContact(self.table.near(positions, rotations))

    @property
    def owners(self) -> NDArray[np.intp]:
        """Bodies that may touch."""
        return np.unique(self.table.owners)

    def wrenches(
        self, positions: Array, rotations: Array, velocities: Array, spins: Array
    ) -> Array:
        """Return force, and moment about the centre of mass, of each body, shape (n, B, 6)."""
        found = evaluate_self_contact(self.table, positions, rotations, velocities, spins)
        return found.wrenches


@dataclass(frozen=True)
class _PartContact:
    """Forces of props on parts of the body, and of capsules on each other."""

    contacts: ContactModel
    figure: Figure

    def near(self, positions: Array, rotations: Array) -> "_PartContact":
        """Return what may touch in a state; all, where capsules touch each other too."""
        if self.contacts.pairs:
            return self
        names = list(self.figure.bodies)
        near: dict[str, Sequence[ContactSphere]] = {}
        for name, spheres in self.contacts.spheres.items():
            k = names.index(name)
            local = np.array([sphere.centre for sphere in spheres])
            local -= np.asarray(self.figure.segments[name].centre_of_mass)
            centres = positions[k] + local @ rotations[k].T
            radii = np.array([sphere.radius for sphere in spheres]) + _NEAR
            for prop in self.contacts.scene.props:
                pose = prop.shape.pose
                x, y, z = ((centres - pose[:3, 3]) @ pose[:3, :3]).T
                if np.any(np.asarray(prop.shape.distance((x, y, z))[0]) < radii):
                    near[name] = spheres
        return _PartContact(replace(self.contacts, spheres=near), self.figure)

    @property
    def owners(self) -> NDArray[np.intp]:
        """Bodies that may touch."""
        names = list(self.figure.bodies)
        return np.array(sorted(names.index(name) for name in self.contacts.spheres))

    def wrenches(
        self, positions: Array, rotations: Array, velocities: Array, spins: Array
    ) -> Array:
        """Return force, and moment about the centre of mass, of each body, shape (n, B, 6)."""
        if not self.contacts.spheres:
            return np.zeros((*positions.shape[:2], 6))
        found = evaluate_contacts(
            self.contacts, self.figure, positions, rotations, velocities, spins
        )
        names = list(self.figure.bodies)
        owners = [names.index(name) for name in self.contacts.spheres]
        wrenches = np.zeros((*positions.shape[:2], 6))
        wrenches[:, owners] = found.wrenches + found.self_wrenches
        wrenches[..., 3:] -= np.cross(positions, wrenches[..., :3])
        return wrenches


@dataclass(frozen=True)
class _UserFunctions:
    """User functions of the forces on all bodies; `reference` is added to the coordinates."""

    contact: _SelfContact | _PartContact
    reference: Array

    def forces(self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any) -> Array:
        """Generalized forces on the coordinates of all bodies."""
        coordinates, rates = np.asarray(q) + self.reference, np.asarray(q_t)
        return self._forces(self._near(coordinates), coordinates[None], rates[None])[0]

    def jacobian(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, fODE2: float, fODE2_t: float
    ) -> Any:
        """Minus the derivatives of the forces by the coordinates and by their rates, weighted."""
        coordinates, rates = np.asarray(q) + self.reference, np.asarray(q_t)
        matrix, dense = exu.MatrixContainer(), np.zeros((len(rates), len(rates)))
        near = self._near(coordinates)
        moved = (_COORDINATES * near.owners[:, None] + np.arange(_COORDINATES)).ravel()
        if len(moved):
            steps = np.zeros((len(moved), len(rates)))
            steps[np.arange(len(moved)), moved] = _DIFFERENCE
            same = np.zeros_like(steps)
            base = self._forces(near, coordinates[None], rates[None])
            for factor, change, rate_change in ((fODE2, steps, same), (fODE2_t, same, steps)):
                if factor != 0.0:
                    ends = self._forces(near, coordinates + change, rates + rate_change)
                    dense[:, moved] -= factor * (ends - base).T / _DIFFERENCE
        matrix.SetWithDenseMatrix(dense, useDenseMatrix=False)
        return matrix

    def _near(self, coordinates: Array) -> _SelfContact | _PartContact:
        rows = coordinates.reshape(-1, _COORDINATES)
        return self.contact.near(rows[:, :3], _rotations(rows[:, 3:]))

    def _forces(
        self, contact: _SelfContact | _PartContact, coordinates: Array, rates: Array
    ) -> Array:
        """Generalized forces in n states, shape (n, 7 B)."""
        rows = coordinates.reshape(len(coordinates), -1, _COORDINATES)
        speeds = rates.reshape(rows.shape)
        basis = _spin_basis(rows[..., 3:])
        spins = turned(np.swapaxes(basis, -1, -2), speeds[..., 3:])
        wrenches = contact.wrenches(
            rows[..., :3], _rotations(rows[..., 3:]), speeds[..., :3], spins
        )
        on_parameters = turned(basis, wrenches[..., 3:])
        forces = np.concatenate([wrenches[..., :3], on_parameters], axis=-1)
        return forces.reshape(coordinates.shape)


def _rotations(parameters: Array) -> Array:
    """Rotation matrices of Euler parameters, shape (..., 4) to (..., 3, 3)."""
    w, x, y, z = np.moveaxis(parameters, -1, 0)
    zero = np.zeros_like(w)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    cross = cross.reshape(*w.shape, 3, 3)
    return np.eye(3) + 2.0 * (w[..., None, None] * cross + cross @ cross)


def _spin_basis(parameters: Array) -> Array:
    """Derivatives of the angular velocity by the rates of Euler parameters, shape (..., 4, 3)."""
    w, x, y, z = np.moveaxis(2.0 * parameters, -1, 0)
    rows = [[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
