"""Contact of segments with each other: an Exudyn object, and the same forces for arrays of states.

Exudyn's connectors transmit no moment of their forces about each other's markers, and do not know
the angular velocity of the first one. So all pairs of capsules are one `ObjectGenericODE2` on the
nodes of their bodies, as coupled laws are, with a Python function that evaluates the law for
arrays. It provides its Jacobian because Exudyn's numerical one would call it for each coordinate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.figure import Figure
from generator.rotations import Array
from generator.self_contact import LIMB_SURFACE, CapsulePair, Components, capsule_force
from generator.simulation.bodies import require_centre_of_mass
from generator.simulation.exudyn_api import Index, MainSystem, exu, items, unused_name

_COORDINATES = 7
"""Number of coordinates of a rigid body with Euler parameters."""

_DIFFERENCE = 1e-7
"""Step of the differences for the Jacobian, in all coordinates [m or 1] and their rates."""


@dataclass(frozen=True)
class SelfContactStates:
    """Contact of B bodies with each other in n states, in world axes.

    Attributes:
        depths: of the overlap of each pair, negative apart, shape (n, P) [m].
        wrenches: on each body about its centre of mass, shape (n, B, 6): force, moment.
        energy: stored, shape (n,) [J].
        impact_power: of damping in impacts, shape (n,) [W].
        friction_power: shape (n,) [W].
    """

    depths: Array
    wrenches: Array
    energy: Array
    impact_power: Array
    friction_power: Array


@dataclass(frozen=True)
class CapsuleTable:
    """P pairs of capsules among B bodies.

    Attributes:
        bodies: number of bodies.
        owners: bodies of the capsules, shape (P, 2).
        middles: from the centres of mass, in the axes of the bodies, shape (P, 2, 3) [m].
        half_lines: in the same axes, shape (P, 2, 3) [m].
        reach: distance of the lines below which they touch, shape (P,) [m].
        radius_differences: radius of the first less that of the second, shape (P,) [m].
    """

    bodies: int
    owners: NDArray[np.intp]
    middles: Array
    half_lines: Array
    reach: Array
    radius_differences: Array

    @classmethod
    def of(cls, pairs: Sequence[CapsulePair], figure: Figure) -> "CapsuleTable":
        """Tabulate pairs among the bodies of a figure."""
        names = list(figure.bodies)
        ends = [(pair.first, pair.second) for pair in pairs]
        centres = {name: require_centre_of_mass(figure.segments[name]) for name in names}
        capsules = [pair.capsules for pair in pairs]
        own_centres = np.array([[centres[name] for name in both] for both in ends])
        return cls(
            len(names),
            np.array([[names.index(name) for name in both] for both in ends]),
            np.array([[one.middle for one in both] for both in capsules]) - own_centres,
            np.array([[one.half_line for one in both] for both in capsules]),
            np.array([pair.reach for pair in pairs]),
            np.array([first.radius - second.radius for first, second in capsules]),
        )

    def near(self, positions: Array, rotations: Array) -> "CapsuleTable":
        """Return the pairs whose middles are so near that they may touch in a state.

        Args:
            positions: of the centres of mass, shape (B, 3) [m].
            rotations: of the bodies' axes, shape (B, 3, 3).
        """
        middles = positions[self.owners] + _turned(rotations[self.owners], self.middles)
        distances = np.linalg.norm(middles[:, 1] - middles[:, 0], axis=-1)
        lengths = np.linalg.norm(self.half_lines, axis=-1).sum(axis=1)
        kept = distances < self.reach + lengths
        return CapsuleTable(
            self.bodies,
            self.owners[kept],
            self.middles[kept],
            self.half_lines[kept],
            self.reach[kept],
            self.radius_differences[kept],
        )


def evaluate_self_contact(
    table: CapsuleTable,
    positions: Array,
    rotations: Array,
    velocities: Array,
    angular_velocities: Array,
) -> SelfContactStates:
    """Return the contact of bodies with each other in n states.

    Args:
        table: the pairs.
        positions: of the centres of mass, shape (n, B, 3) [m].
        rotations: of the bodies' axes, shape (n, B, 3, 3).
        velocities: of the centres of mass, shape (n, B, 3) [m/s].
        angular_velocities: shape (n, B, 3) [rad/s].
    """
    turns, spins = rotations[:, table.owners], angular_velocities[:, table.owners]
    arms, halves = _turned(turns, table.middles), _turned(turns, table.half_lines)
    places = positions[:, table.owners] + arms
    speeds = velocities[:, table.owners] + np.cross(spins, arms)
    force = capsule_force(
        LIMB_SURFACE,
        table.reach,
        table.radius_differences,
        _components(places[:, :, 1] - places[:, :, 0]),
        (_components(halves[:, :, 0]), _components(halves[:, :, 1])),
        _components(speeds[:, :, 1] - speeds[:, :, 0]),
        (_components(spins[:, :, 0]), _components(spins[:, :, 1])),
    )
    normal = np.asarray(force.normal)
    on_second, first_moment, second_moment = (
        normal[..., None] * np.stack(parts, axis=-1)
        for parts in (force.direction, force.first_arm, force.second_arm)
    )
    wrenches = np.zeros((len(positions), table.bodies, 6))
    for side, on_body, moment in ((0, -on_second, first_moment), (1, on_second, second_moment)):
        moment = moment + np.cross(arms[:, :, side], on_body)
        wrench = np.concatenate([on_body, moment], axis=-1)
        incidence = table.owners[:, side, None] == np.arange(table.bodies)
        wrenches += np.einsum("npk,pb->nbk", wrench, incidence.astype(float))
    return SelfContactStates(
        np.asarray(force.depth),
        wrenches,
        np.sum(LIMB_SURFACE.energy(force.depth), axis=1),
        np.sum((normal - force.elastic) * force.rate, axis=1),
        np.sum(normal * force.friction_power, axis=1),
    )


def _turned(turns: Array, vectors: Array) -> Array:
    return (turns @ vectors[..., None])[..., 0]


def _components(vectors: Array) -> Components:
    return vectors[..., 0], vectors[..., 1], vectors[..., 2]


def add_self_contact(
    mbs: MainSystem, figure: Figure, bodies: Mapping[str, Index], pairs: Sequence[CapsulePair]
) -> tuple[Any, ...]:
    """Add the object of all pairs of capsules.

    Args:
        mbs: the system to build into.
        figure: the figure.
        bodies: Exudyn object of each segment.
        pairs: of capsules, at least one.

    Returns:
        Its user functions, which must outlive the system.
    """
    nodes = [mbs.GetObject(bodies[name])["nodeNumber"] for name in figure.bodies]
    reference = np.concatenate([mbs.GetNode(node)["referenceCoordinates"] for node in nodes])
    functions = _UserFunctions(CapsuleTable.of(pairs, figure), reference)
    mbs.AddObject(
        items.ObjectGenericODE2(
            name=unused_name(mbs, "self-contact"),
            nodeNumbers=nodes,
            forceUserFunction=functions.forces,
            jacobianUserFunction=functions.jacobian,
        )
    )
    return functions.forces, functions.jacobian


@dataclass(frozen=True)
class _UserFunctions:
    """User functions of all pairs of capsules; `reference` is added to the coordinates."""

    table: CapsuleTable
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
        owners = np.unique(near.owners)
        moved = (_COORDINATES * owners[:, None] + np.arange(_COORDINATES)).ravel()
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

    def _near(self, coordinates: Array) -> CapsuleTable:
        rows = coordinates.reshape(-1, _COORDINATES)
        return self.table.near(rows[:, :3], _rotations(rows[:, 3:]))

    def _forces(self, table: CapsuleTable, coordinates: Array, rates: Array) -> Array:
        """Generalized forces in n states, shape (n, 7 B)."""
        rows = coordinates.reshape(len(coordinates), -1, _COORDINATES)
        speeds = rates.reshape(rows.shape)
        basis = _spin_basis(rows[..., 3:])
        spins = _turned(np.swapaxes(basis, -1, -2), speeds[..., 3:])
        contact = evaluate_self_contact(
            table, rows[..., :3], _rotations(rows[..., 3:]), speeds[..., :3], spins
        )
        on_parameters = _turned(basis, contact.wrenches[..., 3:])
        forces = np.concatenate([contact.wrenches[..., :3], on_parameters], axis=-1)
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
