"""Contact of a figure: Exudyn connectors, and the same forces for arrays of states.

Every pair of a contact sphere and a prop is a connector between the prop and the centre of the
sphere. Its user function is `generator.scene.contact_force` in the axes of the prop. Segments that
touch each other are in `generator.simulation.self_contacts`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.figure import ContactSphere, Figure
from generator.kinematics.placement import Placement
from generator.rotations import Array, pose_matrix
from generator.scene import Box, Prop, Scene, Shape, contact_force
from generator.self_contact import CapsulePair
from generator.simulation.bodies import add_marker, require_centre_of_mass
from generator.simulation.exudyn_api import (
    SYMBOLIC,
    Index,
    MainSystem,
    exu,
    items,
    symbolic_user_function,
)
from generator.simulation.self_contacts import (
    CapsuleTable,
    add_self_contact,
    evaluate_self_contact,
)
from generator.simulation.wall_limit import NO_LIMIT, WallLimit
from springs import FLOATS
from springs.contact import Surface

_CONNECTORS_AT_ONCE = 100
"""Number of connectors that are added between looks at the clock."""

_TIME_ROUNDING = 1e-12
"""Rounding of the times of steps, relative to 1 s or to the time."""


@dataclass(frozen=True)
class ContactModel:
    """Contact of a figure with the props of a scene, and of its segments with each other.

    Attributes:
        scene: the props.
        spheres: contact spheres of each moving segment that has some.
        pairs: capsules of segments that touch each other.
        connectors: the Exudyn connector of each sphere and prop.
        functions: user functions of the system, which must outlive it.
    """

    scene: Scene
    spheres: Mapping[str, Sequence[ContactSphere]]
    pairs: tuple[CapsulePair, ...] = ()
    connectors: tuple[Index, ...] = ()
    functions: tuple[Any, ...] = ()

    @property
    def owners(self) -> NDArray[np.intp]:
        """Place of the segment of each sphere among those with spheres, shape (S,)."""
        sizes = [len(some) for some in self.spheres.values()]
        return np.repeat(np.arange(len(sizes)), sizes)


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
        size = prop.shape.size if isinstance(prop.shape, Box) else (0.0, 0.0, 0.0)
        for (name, k), centre in centres.items():
            if len(connectors) % _CONNECTORS_AT_ONCE == _CONNECTORS_AT_ONCE - 1:
                limit.require_time(f"at prop {prop.name}, while the model was built")
            # Without a name, which Exudyn would compare with those of all other objects.
            connectors.append(
                mbs.AddObject(
                    items.ObjectConnectorRigidBodySpringDamper(
                        markerNumbers=[origin, centre],
                        offset=[*size, contacts.spheres[name][k].radius, 0.0, 0.0],
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

    The connector's `offset` holds the edges of a box and the radius of the sphere, so that one
    function serves all props of a kind and a surface.
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
        size, radius = (offset[0], offset[1], offset[2]), offset[3]
        force = contact_force(prop.shape, prop.surface, radius, centre, speed, spin, ops, size=size)
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


@dataclass(frozen=True)
class ContactStates:
    """Contact in n states; S spheres of G segments, in world axes.

    Attributes:
        depths: deepest penetration of each sphere, negative off the props, shape (n, S) [m].
        rates: rate of this depth, shape (n, S) [m/s].
        wrenches: of props on each segment about the world's origin, shape (n, G, 6): force, moment.
        self_wrenches: of other segments on each, likewise.
        energy: stored, shape (n,) [J].
        impact_power: of damping in impacts, shape (n,) [W].
        friction_power: shape (n,) [W].
    """

    depths: Array
    rates: Array
    wrenches: Array
    self_wrenches: Array
    energy: Array
    impact_power: Array
    friction_power: Array

    @property
    def forces(self) -> Array:
        """Force of props on each segment, shape (n, G, 3) [N]."""
        return self.wrenches[..., :3]

    def take(self, places: Any) -> "ContactStates":
        """Return the states at some places."""
        return ContactStates(*(values[places] for values in self._arrays))

    def extend(self, more: "ContactStates") -> "ContactStates":
        """Append states."""
        return ContactStates.join([self, more])

    @classmethod
    def join(cls, parts: "Sequence[ContactStates]") -> "ContactStates":
        """Return the states of all parts."""
        columns = zip(*(part._arrays for part in parts), strict=True)
        return cls(*(np.concatenate(column) for column in columns))

    @property
    def _arrays(self) -> tuple[Array, ...]:
        return (
            self.depths,
            self.rates,
            self.wrenches,
            self.self_wrenches,
            self.energy,
            self.impact_power,
            self.friction_power,
        )


@dataclass(frozen=True)
class ContactTrace:
    """Integrals of the contact forces at n frames, and the contact after each of m steps.

    Attributes:
        losses: of impact damping and of friction since the start, shape (n, 2) [J].
        impulses: of the force on each segment since the start, shape (n, G, 3) [N s].
        step_times: start, and ends of the steps, shape (m,) [s].
        steps: contact then.
        centres: centre of mass of the figure then, shape (m, 3) [m].
        accelerations: of the centres of mass of the B bodies then, shape (m, B, 3) [m/s^2].
        is_complete: whether the contact of all steps is there, and not of the start alone.
        sensitivity: differences of a run whose start is disturbed, shape (n, 2): the largest angle
            between the joints [rad], and the height of the centre of mass [m]; None without one.
        disturbed: times of the steps of that run, and contact then; None likewise.
    """

    losses: Array
    impulses: Array
    step_times: Array
    steps: ContactStates
    centres: Array
    accelerations: Array
    sensitivity: Array | None = None
    disturbed: tuple[Array, ContactStates] | None = None
    is_complete: bool = True

    def first_frames(self, count: int, last_time: float) -> "ContactTrace":
        """Return the first `count` frames, the last of which is at `last_time` [s]."""
        kept = self.step_times <= last_time + _TIME_ROUNDING * max(1.0, abs(last_time))
        return ContactTrace(
            self.losses[:count],
            self.impulses[:count],
            self.step_times[kept],
            self.steps.take(kept),
            self.centres[kept],
            self.accelerations[kept],
            None if self.sensitivity is None else self.sensitivity[:count],
            self.disturbed,
            self.is_complete,
        )

    def extend_from(self, longer: "ContactTrace") -> "ContactTrace":
        """Append the frames and steps by which another trace is longer."""
        count, later = len(self.losses), longer.step_times > self.step_times[-1]
        return ContactTrace(
            np.concatenate([self.losses, longer.losses[count:]]),
            np.concatenate([self.impulses, longer.impulses[count:]]),
            np.concatenate([self.step_times, longer.step_times[later]]),
            self.steps.extend(longer.steps.take(later)),
            np.concatenate([self.centres, longer.centres[later]]),
            np.concatenate([self.accelerations, longer.accelerations[later]]),
        )


def evaluate_contacts(
    contacts: ContactModel,
    figure: Figure,
    positions: Array,
    rotations: Array,
    velocities: Array,
    angular_velocities: Array,
) -> ContactStates:
    """Return the contact of a figure in n states of its B bodies.

    Args:
        contacts: props, spheres and pairs.
        figure: with these bodies.
        positions: of the centres of mass, shape (n, B, 3) [m].
        rotations: of the segment axes, shape (n, B, 3, 3).
        velocities: of the centres of mass, shape (n, B, 3) [m/s].
        angular_velocities: shape (n, B, 3) [rad/s].
    """
    count = len(positions)
    bodies, owners, groups = list(figure.bodies), contacts.owners, len(contacts.spheres)
    places = np.array([bodies.index(name) for name in contacts.spheres])[owners]
    radii = np.array([s.radius for some in contacts.spheres.values() for s in some])
    local = np.array(
        [
            np.asarray(sphere.centre) - require_centre_of_mass(figure.segments[name])
            for name, some in contacts.spheres.items()
            for sphere in some
        ]
    )
    arms = (rotations[:, places] @ local[..., None])[..., 0]
    centres, spins = positions[:, places] + arms, angular_velocities[:, places]
    speeds = velocities[:, places] + np.cross(spins, arms)
    depths, rates = np.full((count, len(radii)), -np.inf), np.zeros((count, len(radii)))
    forces, moments = np.zeros_like(centres), np.zeros_like(centres)
    energy, impact, friction = (np.zeros(count) for _ in range(3))
    for prop in contacts.scene.props:
        pose = prop.shape.pose
        turn = pose[:3, :3]
        inputs = [
            tuple(np.moveaxis(vectors @ turn, -1, 0))
            for vectors in (centres - pose[:3, 3], speeds, spins)
        ]
        force = contact_force(prop.shape, prop.surface, radii, inputs[0], inputs[1], inputs[2])
        normal = force.normal
        on_sphere, about_centre = (
            np.stack([np.broadcast_to(normal * part, normal.shape) for part in parts], axis=-1)
            @ turn.T
            for parts in (force.direction, force.arm)
        )
        forces += on_sphere
        moments += about_centre + np.cross(centres, on_sphere)
        energy += np.sum(prop.surface.energy(force.depth), axis=1)
        impact += np.sum((normal - force.elastic) * force.rate, axis=1)
        friction += np.sum(normal * force.friction_power, axis=1)
        is_deeper = force.depth > depths
        depths = np.where(is_deeper, force.depth, depths)
        rates = np.where(is_deeper, force.rate, rates)
    wrenches = np.zeros((count, groups, 6))
    for g in range(groups):
        own = owners == g
        wrenches[:, g, :3] = forces[:, own].sum(axis=1)
        wrenches[:, g, 3:] = moments[:, own].sum(axis=1)
    self_wrenches = np.zeros_like(wrenches)
    if contacts.pairs:
        states = evaluate_self_contact(
            CapsuleTable.of(contacts.pairs, figure),
            positions,
            rotations,
            velocities,
            angular_velocities,
        )
        energy, impact = energy + states.energy, impact + states.impact_power
        friction = friction + states.friction_power
        own_bodies = [bodies.index(name) for name in contacts.spheres]
        self_wrenches = states.wrenches[:, own_bodies]
        self_wrenches[..., 3:] += np.cross(positions[:, own_bodies], self_wrenches[..., :3])
    return ContactStates(depths, rates, wrenches, self_wrenches, energy, impact, friction)


def mean_position(figure: Figure, positions: Array) -> Array:
    """Centre of mass of all bodies (eq. 5.1), shape (n, 3) [m].

    Args:
        figure: with B bodies.
        positions: of their centres of mass, shape (n, B, 3) [m].
    """
    masses = np.array([body.mass for body in figure.bodies.values()], dtype=float)
    return np.asarray(np.einsum("b,nbk->nk", masses, positions) / np.sum(masses))
