"""Contact in the states of a run: spheres with props, and capsules with each other, as arrays."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.contact.force import contact_force
from generator.contact.scene import Scene
from generator.contact.self_contact import LIMB_SURFACE, CapsulePair, capsule_force
from generator.contact.shape import Components
from generator.figure import ContactSphere, Figure
from generator.rotations import Array
from springs.contact_part import PartLaw, part_forces

_TIME_ROUNDING = 1e-12
"""Rounding of the times of steps, relative to 1 s or to the time."""


@dataclass(frozen=True)
class ContactModel:
    """Contact of a figure with the props of a scene, and of its segments with each other.

    Attributes:
        scene: the props.
        spheres: contact spheres of each moving segment that has some.
        pairs: capsules of segments that touch each other.
        laws: laws of parts of the body by name; a sphere that belongs to none resists by itself.
        connectors: the Exudyn connector of each sphere and prop.
        functions: user functions of the system, which must outlive it.
    """

    scene: Scene
    spheres: Mapping[str, Sequence[ContactSphere]]
    pairs: tuple[CapsulePair, ...] = ()
    laws: Mapping[str, PartLaw] = field(default_factory=dict[str, PartLaw])
    connectors: tuple[Any, ...] = ()
    functions: tuple[Any, ...] = ()

    @property
    def parts(self) -> list[str]:
        """Name of the part of each sphere, which is its segment's without another."""
        return [one.part or name for name, some in self.spheres.items() for one in some]

    @property
    def groups(self) -> dict[str, NDArray[np.intp]]:
        """Spheres of each part of the body, and of each segment whose spheres have no part."""
        names = np.array(self.parts)
        return {name: np.flatnonzero(names == name) for name in dict.fromkeys(self.parts)}

    @property
    def owners(self) -> NDArray[np.intp]:
        """Place of the segment of each sphere among those with spheres, shape (S,)."""
        sizes = [len(some) for some in self.spheres.values()]
        return np.repeat(np.arange(len(sizes)), sizes)


@dataclass(frozen=True)
class ContactStates:
    """Contact in n states; S spheres of G segments, in world axes.

    Attributes:
        depths: deepest penetration of each sphere, negative off the props, shape (n, S) [m].
        rates: rate of this depth, shape (n, S) [m/s].
        wrenches: wrenches of props on each segment about the world's origin, shape (n, G, 6):
            force, moment.
        self_wrenches: self wrenches of other segments on each, likewise.
        energy: stored, shape (n,) [J].
        impact_power: impact power of damping in impacts, shape (n,) [W].
        friction_power: shape (n,) [W].
        part_forces: forces of props on each of the P parts with laws, shape (n, P, 3) [N].
        group_forces: forces of props on each of the K groups of spheres, shape (n, K, 3) [N].
        group_points: points of these forces: means of the touched points of the spheres, weighted
            by the normal forces, zero without a force, shape (n, K, 3) [m].
    """

    depths: Array
    rates: Array
    wrenches: Array
    self_wrenches: Array
    energy: Array
    impact_power: Array
    friction_power: Array
    part_forces: Array
    group_forces: Array
    group_points: Array

    @property
    def forces(self) -> Array:
        """Force of props on each segment, shape (n, G, 3) [N]."""
        return self.wrenches[..., :3]


@dataclass(frozen=True)
class ContactSteps:
    """Contact at the start and after each step of a run, m states in all, in world axes.

    Attributes:
        times: shape (m,) [s].
        forces: forces of props on each segment with spheres, shape (m, G, 3) [N].
        depths: deepest penetration of each sphere, negative off the props, shape (m, S) [m]; of a
            sphere that is farther than 0.1 m from all props, some value below -0.1 m or equal.
        rates: rate of this depth, shape (m, S) [m/s].
        centres: centre of mass of the figure, shape (m, 3) [m].
        accelerations: accelerations of the centres of mass of the B bodies, shape (m, B, 3)
            [m/s^2].
        part_forces: forces of props on each of the P parts with laws, shape (m, P, 3) [N].
    """

    times: Array
    forces: Array
    depths: Array
    rates: Array
    centres: Array
    accelerations: Array
    part_forces: Array

    def take(self, places: Any) -> "ContactSteps":
        """Return the steps at some places."""
        return ContactSteps(*(values[places] for values in self._arrays))

    @classmethod
    def join(cls, parts: "Sequence[ContactSteps]") -> "ContactSteps":
        """Return the steps of all parts."""
        columns = zip(*(part._arrays for part in parts), strict=True)
        return cls(*(np.concatenate(column) for column in columns))

    @property
    def _arrays(self) -> tuple[Array, ...]:
        return (
            self.times,
            self.forces,
            self.depths,
            self.rates,
            self.centres,
            self.accelerations,
            self.part_forces,
        )


@dataclass(frozen=True)
class ContactTrace:
    """Integrals of the contact forces at n frames, and the contact after each step.

    Attributes:
        losses: losses of impact damping and of friction since the start, shape (n, 2) [J].
        impulses: impulses of the force on each segment since the start, shape (n, G, 3) [N s].
        steps: contact after each step.
        sensitivity: differences of a run whose start is disturbed, shape (n, 2): the largest angle
            between the joints [rad], and the height of the centre of mass [m]; None without one.
        disturbed: contact after each step of that run; None likewise.
    """

    losses: Array
    impulses: Array
    steps: ContactSteps
    sensitivity: Array | None = None
    disturbed: ContactSteps | None = None

    def first_frames(self, count: int, last_time: float) -> "ContactTrace":
        """Return the first `count` frames, the last of which is at `last_time` [s]."""
        kept = self.steps.times <= last_time + _TIME_ROUNDING * max(1.0, abs(last_time))
        return ContactTrace(
            self.losses[:count],
            self.impulses[:count],
            self.steps if kept.all() else self.steps.take(kept),
            None if self.sensitivity is None else self.sensitivity[:count],
            self.disturbed,
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
        figure: figure with these bodies.
        positions: positions of the centres of mass, shape (n, B, 3) [m].
        rotations: rotations of the segment axes, shape (n, B, 3, 3).
        velocities: velocities of the centres of mass, shape (n, B, 3) [m/s].
        angular_velocities: shape (n, B, 3) [rad/s].
    """
    count = len(positions)
    bodies, owners, groups = list(figure.bodies), contacts.owners, len(contacts.spheres)
    places = np.array([bodies.index(name) for name in contacts.spheres])[owners]
    radii = np.array([s.radius for some in contacts.spheres.values() for s in some])
    local = np.array(
        [
            np.asarray(sphere.centre) - np.asarray(figure.segments[name].centre_of_mass)
            for name, some in contacts.spheres.items()
            for sphere in some
        ]
    )
    arms = (rotations[:, places] @ local[..., None])[..., 0]
    centres, spins = positions[:, places] + arms, angular_velocities[:, places]
    speeds = velocities[:, places] + np.cross(spins, arms)
    depths, rates = np.full((count, len(radii)), -np.inf), np.zeros((count, len(radii)))
    forces, moments = np.zeros_like(centres), np.zeros_like(centres)
    weights, weighted_points = np.zeros_like(depths), np.zeros_like(centres)
    energy, impact, friction = (np.zeros(count) for _ in range(3))
    named = [(one.part, one.region) for some in contacts.spheres.values() for one in some]
    spheres_of = {
        name: np.flatnonzero([name in names for names in named]) for name in contacts.laws
    }
    for prop in contacts.scene.props:
        pose = prop.shape.pose
        turn = pose[:3, :3]
        inputs = [
            tuple(np.moveaxis(vectors @ turn, -1, 0))
            for vectors in (centres - pose[:3, 3], speeds, spins)
        ]
        force = contact_force(prop.shape, prop.surface, radii, inputs[0], inputs[1], inputs[2])
        normal, elastic = np.asarray(force.normal), np.asarray(force.elastic)
        stored = np.asarray(prop.surface.energy(force.depth))
        for name, law in contacts.laws.items():
            own = spheres_of[name]
            part = part_forces(law.on(prop.surface.layer), force.depth[:, own], force.rate[:, own])
            if law.within is None:
                normal[:, own], elastic[:, own], stored[:, own] = 0.0, 0.0, 0.0
            normal[:, own] += part.normal
            elastic[:, own] += part.elastic
            energy += part.energy
        on_sphere, about_centre = (
            np.stack([np.broadcast_to(normal * part, normal.shape) for part in parts], axis=-1)
            @ turn.T
            for parts in (force.direction, force.arm)
        )
        outward = np.broadcast_arrays(*force.normal_direction, normal)[:3]
        touched = centres - radii[:, None] * (np.stack(outward, axis=-1) @ turn.T)
        weights += normal
        weighted_points += normal[..., None] * touched
        forces += on_sphere
        moments += about_centre + np.cross(centres, on_sphere)
        energy += np.sum(stored, axis=1)
        impact += np.sum((normal - elastic) * force.rate, axis=1)
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
    on_parts = [forces[:, own].sum(axis=1) for own in spheres_of.values()]
    own_groups = contacts.groups.values()
    on_groups = np.stack([forces[:, own].sum(axis=1) for own in own_groups], axis=1)
    totals = np.stack([weights[:, own].sum(axis=1) for own in own_groups], axis=1)[..., None]
    sums = np.stack([weighted_points[:, own].sum(axis=1) for own in own_groups], axis=1)
    return ContactStates(
        depths,
        rates,
        wrenches,
        self_wrenches,
        energy,
        impact,
        friction,
        np.stack(on_parts, axis=1) if on_parts else np.zeros((count, 0, 3)),
        on_groups,
        np.divide(sums, totals, out=np.zeros_like(sums), where=totals > 0.0),
    )


@dataclass(frozen=True)
class SelfContactStates:
    """Contact of B bodies with each other in n states, in world axes.

    Attributes:
        depths: depths of the overlap of each pair, negative apart, shape (n, P) [m].
        wrenches: wrenches on each body about its centre of mass, shape (n, B, 6): force, moment.
        energy: stored, shape (n,) [J].
        impact_power: impact power of damping in impacts, shape (n,) [W].
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
        middles: middles from the centres of mass, in the axes of the bodies, shape (P, 2, 3) [m].
        half_lines: half lines in the same axes, shape (P, 2, 3) [m].
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
        centres = {name: np.asarray(figure.segments[name].centre_of_mass) for name in names}
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
            positions: positions of the centres of mass, shape (B, 3) [m].
            rotations: rotations of the bodies' axes, shape (B, 3, 3).
        """
        middles = positions[self.owners] + turned(rotations[self.owners], self.middles)
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
        positions: positions of the centres of mass, shape (n, B, 3) [m].
        rotations: rotations of the bodies' axes, shape (n, B, 3, 3).
        velocities: velocities of the centres of mass, shape (n, B, 3) [m/s].
        angular_velocities: shape (n, B, 3) [rad/s].
    """
    turns, spins = rotations[:, table.owners], angular_velocities[:, table.owners]
    arms, halves = turned(turns, table.middles), turned(turns, table.half_lines)
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


def turned(turns: Array, vectors: Array) -> Array:
    """Return vectors along other axes, shape (..., 3)."""
    return (turns @ vectors[..., None])[..., 0]


def _components(vectors: Array) -> Components:
    return vectors[..., 0], vectors[..., 1], vectors[..., 2]
